//! Cook's membrane at finite strain, nearly incompressible neo-Hookean (de Souza Neto et al., Int. J. Solids Struct. 33,
//! 1996, 3277; Simo and Armero 1992 for the form).
//!
//! ```text
//!            __--| 60       left edge clamped, dead traction 6.25 MPa upwards on the right edge
//!    44 |--''    | 44       G = 80.1938 MPa, K = 40.0942e4 MPa
//!       |     __/
//!     0 |__--'   48
//! ```
//! Goal: u_y of the upper right corner 6.93 mm within 0.5 % for quadratic elements from 16 a side, 1 % for linear ones at 32.

use salp_core::mesh::gmsh::{GmshElementKind, structured};
use serde_json::json;

use super::{displacement, solve};

fn corner_displacement(kind: GmshElementKind, n: usize) -> f64 {
    let mesh = structured(kind, [n, n], |s, t| {
        let (low, high) = (44.0 * s, 44.0 + 16.0 * s);
        [48.0 * s, low + t * (high - low)]
    });
    let (shear, bulk) = (80.1938, 40.0942e4);
    let scene = json!({
        "version": 1,
        "mesh_file": "mesh.msh",
        "material": {"model": "neo_hookean", "c10_mpa": shear / 2.0, "bulk_over_shear": bulk / shear},
        "actuation": {"schedule": "ramp", "load_steps_per_leg": 4},
        "supports": [{"group": "left", "fix": ["x", "y"]}],
        "tractions": [{"group": "right", "mpa": [0, 6.25], "channel": 0}],
        "probes": {"corner": [48, 60]}
    });
    displacement(&solve(&mesh, &scene), "corner")[1]
}

#[test]
fn the_corner_moves_as_published() {
    for (kind, n, bound) in [
        (GmshElementKind::Quad9, 16, 0.005),
        (GmshElementKind::Quad8, 16, 0.005),
        (GmshElementKind::Quad4, 32, 0.01),
        (GmshElementKind::Triangle6, 32, 0.005),
    ] {
        let u = corner_displacement(kind, n);
        assert!((u / 6.93 - 1.0).abs() < bound, "{kind:?} {n}: {u}");
    }
}

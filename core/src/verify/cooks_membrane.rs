//! Cook's membrane at finite strain, nearly incompressible neo-Hookean (de Souza Neto et al., Int. J. Solids Struct. 33,
//! 1996, 3277; Simo and Armero 1992 for the form).
//!
//! ```text
//!            __--| 60       left edge clamped, dead traction 6.25 MPa upwards on the right edge
//!    44 |--''    | 44       G = 80.1938 MPa, K = 40.0942e4 MPa
//!       |     __/
//!     0 |__--'   48
//! ```
//! The corner's u_y is about 6.93 mm on fine meshes of high order; the clamped corner's singularity limits every order, so
//! none is asked for.

use serde_json::json;

use super::bench::{Bench, Checked};
use super::problem::{MESH_FILE, Problem, file_kind};
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, structured};

/// The published displacement of the corner, mm.
pub const CORNER_MM: f64 = 6.93;

/// The membrane of n x n cells.
pub fn problem(kind: GmshElementKind, n: usize) -> Problem {
    let mesh = structured(kind, [n, n], |s, t| {
        let (low, high) = (44.0 * s, 44.0 + 16.0 * s);
        [48.0 * s, low + t * (high - low)]
    });
    let (shear, bulk) = (80.1938, 40.0942e4);
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": {"model": "neo_hookean", "c10_mpa": shear / 2.0, "bulk_over_shear": bulk / shear},
        "actuation": {"schedule": "ramp", "load_steps_per_leg": 4},
        "supports": [{"group": "left", "fix": ["x", "y"]}],
        "tractions": [{"group": "right", "mpa": [0, 6.25], "channel": 0}],
        "probes": {"corner": [48, 60]}
    });
    Problem {
        mesh,
        scene,
        driven: None,
    }
}

pub(super) fn run(bench: &mut Bench<'_>, element: ElementKind) {
    let (n, bound) = match element {
        ElementKind::Quad9 | ElementKind::Tri7 => (32, 5e-3),
        ElementKind::Quad4 => (64, 5e-3),
    };
    match problem(file_kind(element), n).solve(bench.observer()) {
        Ok(solved) => bench.check(Checked {
            quantity: format!("corner u_y (mm), {n} cells a side"),
            value: solved.displacement(0, solved.last())[1],
            expected: CORNER_MM,
            scale: CORNER_MM,
            bound,
            orders: None,
        }),
        Err(reason) => bench.unsolved("corner u_y", &reason),
    }
}

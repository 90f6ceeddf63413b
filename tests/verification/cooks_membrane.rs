//! Cook's membrane (`salp_core::verify::cooks_membrane`) from files: u_y of the corner 6.93 mm within 0.5 % for quadratic
//! elements from 16 a side, 1 % for linear ones at 32.

use salp_core::mesh::gmsh::GmshElementKind;
use salp_core::verify::cooks_membrane::{CORNER_MM, problem};

use super::{displacement, solve};

#[test]
fn the_corner_moves_as_published() {
    for (kind, n, bound) in [
        (GmshElementKind::Quad9, 16, 0.005),
        (GmshElementKind::Quad8, 16, 0.005),
        (GmshElementKind::Quad4, 32, 0.01),
        (GmshElementKind::Triangle6, 32, 0.005),
    ] {
        let u = displacement(&solve(&problem(kind, n)), "corner")[1];
        assert!((u / CORNER_MM - 1.0).abs() < bound, "{kind:?} {n}: {u}");
    }
}

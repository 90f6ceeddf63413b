//! Rounded corners.

use super::super::*;
use super::mesh_of;
use super::shapes::{paper_unit, rectangles, with_radius};
use crate::geometry::samples::Stratum;
use crate::geometry::{LayoutBoxes, polygon};

/// Area within a cavity's quadratic edges.
fn cavity_area(d: &Discretisation, cavity: &Cavity) -> f64 {
    let at = |n: u32| d.mesh.nodes[n as usize];
    cavity
        .edges
        .iter()
        .map(|e| {
            let (a, b, m) = (at(e.ends[0]), at(e.ends[1]), at(e.mid.unwrap()));
            let bulge = polygon::cross(polygon::difference(a, m), polygon::difference(a, b));
            0.5 * polygon::cross(a, b) + 2.0 / 3.0 * bulge
        })
        .sum()
}

#[test]
fn a_rounded_chamber_has_the_area_of_its_arcs() {
    for (radius, bound) in [(0.1, 2e-3), (0.5, 0.01), (3.0, 0.03)] {
        let mesh = mesh_of(
            &with_radius(rectangles(40.0, 15.0), radius),
            PlanElement::Quad9,
        );
        let exact = 600.0 - (4.0 - std::f64::consts::PI) * radius * radius;
        let d = &mesh.discretisation;
        let error = (cavity_area(d, &d.cavities[0]) - exact).abs();
        assert!(error < bound, "{radius}: {error}");
        assert!(mesh.scaled_jacobian > 0.3);
    }
}

#[test]
fn random_designs_mesh_with_rounded_corners() {
    for (stratum, may_fold) in [
        (Stratum::Uniform, 0),
        (Stratum::NearOuterEdges, 0),
        // Corners at the far ends of a sheared wall: see `docs/decisions/block-map.md`.
        (Stratum::NearBounds, 12),
    ] {
        let mut folds = 0;
        for index in 0..60 {
            let x = stratum.design(&LayoutBoxes::PAPER, 20_230_328, index);
            let actuator = with_radius(paper_unit(&x, 1), 0.5);
            let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
            match build(&actuator, &plan) {
                Ok(mesh) => {
                    let bound = quality::least_jacobian_bound(&mesh.discretisation.mesh);
                    assert!(bound > 0.0, "{stratum:?} {index}");
                }
                Err(InfeasibleGeometry::MeshFolds { .. }) => folds += 1,
                Err(other) => panic!("{stratum:?} {index}: {other}"),
            }
        }
        assert!(folds <= may_fold, "{stratum:?}: {folds}");
    }
}

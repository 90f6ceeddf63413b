//! Plans: followed, refined, bounded, stored.

use super::super::*;
use super::meshes::check;
use super::shapes::{named, paper_unit, slanted};
use crate::geometry::polygon::signed_area;
use crate::geometry::samples::Stratum;
use crate::geometry::{LayoutBoxes, MeshSize};

#[test]
fn a_plan_follows_other_designs() {
    // From the 1 x 1 start to random designs, and between random designs, in one leap.
    let start = paper_unit(&LayoutBoxes::PAPER.common_start(), 3);
    let mut plan = MeshPlan::choose(&start, PlanElement::Quad9, None).unwrap();
    for index in 0..100 {
        let x = Stratum::Uniform.design(&LayoutBoxes::PAPER, 7, index);
        let actuator = paper_unit(&x, 3);
        let mesh = build(&actuator, &plan).unwrap();
        assert!(mesh.scaled_jacobian > quality::SCALED_JACOBIAN_FLOOR);
        plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
    }
}

#[test]
fn a_largest_size_holds_for_every_edge() {
    for (name, actuator) in named() {
        for (element, limit) in [(PlanElement::Quad9, 3.0), (PlanElement::Quad4, 0.9)] {
            let plan = MeshPlan::choose(&actuator, element, Some(limit)).unwrap();
            let mesh = build(&actuator, &plan).unwrap();
            assert!(
                mesh.longest_edge_mm <= limit * (1.0 + 1e-12),
                "{name}: {} mm",
                mesh.longest_edge_mm
            );
        }
    }
}

#[test]
fn a_mean_size_fills_the_solid_with_squares() {
    for (name, actuator) in named() {
        let chambers = actuator.units.iter().flat_map(|unit| &unit.chambers_mm);
        let cavities: f64 = chambers.map(|corners| signed_area(corners)).sum();
        let [w, h] = actuator.unit_mm;
        let solid = w * h * actuator.units.len() as f64 - cavities;
        let elements = |side: f64| {
            let size = MeshSize::Mean(side);
            let plan = MeshPlan::choose(&actuator, PlanElement::Quad4, size).unwrap();
            plan.elements() as f64
        };
        let ratio = |side: f64| elements(side) / (solid / (side * side));
        // Three elements through a thin wall may be more than were asked for.
        assert!(ratio(1.5) >= 1.0, "{name}: {}", ratio(1.5));
        let fine = ratio(0.4);
        assert!((1.0..1.25).contains(&fine), "{name}: {fine}");
    }
}

#[test]
fn a_refined_plan_is_nested() {
    let actuator = slanted();
    let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
    let (coarse, fine) = (
        build(&actuator, &plan).unwrap(),
        build(&actuator, &plan.refined(2)).unwrap(),
    );
    check("refined", &actuator, &fine);
    assert_eq!(plan.refined(2).elements(), 4 * plan.elements());
    assert!(plan.same_counts(&plan) && !plan.same_counts(&plan.refined(2)));
    // A coarse quad9 node is a corner of the fine mesh.
    let mut places: Vec<Point> = fine.discretisation.mesh.nodes.clone();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for p in &coarse.discretisation.mesh.nodes {
        let start = places.partition_point(|q| q[0] < p[0] - 1e-9);
        let found = places[start..]
            .iter()
            .take_while(|q| q[0] <= p[0] + 1e-9)
            .any(|q| (q[1] - p[1]).abs() < 1e-9);
        assert!(found);
    }
}

#[test]
fn a_plan_survives_its_document() {
    let plan = MeshPlan::choose(&slanted(), PlanElement::Quad9, None).unwrap();
    let text = serde_json::to_string(&plan).unwrap();
    assert_eq!(serde_json::from_str::<MeshPlan>(&text).unwrap(), plan);
}

//! Nodes move smoothly with the design, and derivatives pull back through them exactly.

use super::super::*;
use super::shapes::{layouts, non_convex, rectangles, slanted, with_radius};
use crate::geometry::{Unit, polygon};

/// A smooth function of all node positions, with its gradient.
fn measure(nodes: &[Point]) -> (f64, Vec<Point>) {
    let mut sum = 0.0;
    let gradient = nodes
        .iter()
        .enumerate()
        .map(|(n, p)| {
            let phase = 0.7 * n as f64;
            let (a, b) = (0.05 * p[0] + phase, 0.04 * p[1] - phase);
            sum += a.sin() + (2.0 * b).cos() + 0.01 * p[0] * p[1];
            [
                0.05 * a.cos() + 0.01 * p[1],
                -0.08 * (2.0 * b).sin() + 0.01 * p[0],
            ]
        })
        .collect();
    (sum, gradient)
}

/// `h`: step of the differences, mm; `bound`: of their deviation, relative.
fn check_pull_back(name: &str, actuator: &Actuator, h: f64, bound: f64) {
    let plan = MeshPlan::choose(actuator, PlanElement::Quad9, None).unwrap();
    let mesh = build(actuator, &plan).unwrap();
    let pulled = mesh.pull_back(&measure(&mesh.discretisation.mesh.nodes).1);
    assert_eq!(pulled.len(), actuator.units.len());
    let distinct = if actuator.repeated { 1 } else { pulled.len() };
    let largest = pulled
        .iter()
        .flatten()
        .flatten()
        .flatten()
        .fold(0.0_f64, |m, g| m.max(g.abs()));
    for unit in 0..distinct {
        for (chamber, corners) in actuator.units[unit].chambers_mm.iter().enumerate() {
            for corner in 0..corners.len() {
                for c in 0..2 {
                    let at = |step: f64| {
                        let mut moved = actuator.clone();
                        for (u, content) in moved.units.iter_mut().enumerate() {
                            if actuator.repeated || u == unit {
                                content.chambers_mm[chamber][corner][c] += step;
                            }
                        }
                        measure(&build(&moved, &plan).unwrap().discretisation.mesh.nodes).0
                    };
                    // Fourth order, so that truncation is far below the bound.
                    let difference =
                        (8.0 * (at(h) - at(-h)) - at(2.0 * h) + at(-2.0 * h)) / (12.0 * h);
                    let exact: f64 = if actuator.repeated {
                        pulled.iter().map(|u| u[chamber][corner][c]).sum()
                    } else {
                        pulled[unit][chamber][corner][c]
                    };
                    assert!(
                        (difference - exact).abs() < bound * largest.max(1.0),
                        "{name}: unit {unit}, chamber {chamber}, corner {corner}, {c}: {difference} {exact}"
                    );
                }
            }
        }
    }
}

#[test]
fn pull_back_agrees_with_differences() {
    for (name, actuator) in [
        ("40x15", rectangles(40.0, 15.0)),
        ("slanted", slanted()),
        ("non-convex", non_convex()),
    ] {
        check_pull_back(name, &actuator, 2e-3, 1e-8);
    }
    let units: Vec<Unit> = [slanted(), rectangles(76.0, 36.0), non_convex()]
        .iter()
        .map(|a| a.units[0].clone())
        .collect();
    check_pull_back(
        "free units",
        &Actuator {
            unit_mm: [80.0, 80.0],
            units,
            repeated: false,
            corner_radius_mm: 0.0,
        },
        2e-3,
        1e-8,
    );
    for (name, actuator) in layouts() {
        if ["triangle", "octagon", "unlike units"].contains(&name) {
            check_pull_back(name, &actuator, 2e-3, 1e-8);
        }
    }
}

#[test]
fn pull_back_through_rounded_corners_agrees_with_differences() {
    for (name, actuator, radius) in [
        ("40x15", rectangles(40.0, 15.0), 0.5),
        ("slanted", slanted(), 3.0),
        ("non-convex", non_convex(), 0.5),
        ("void", rectangles(1.0, 1.0), 0.5),
    ] {
        check_pull_back(name, &with_radius(actuator, radius), 1e-4, 1e-7);
    }
}

#[test]
fn nodes_move_smoothly_with_the_design() {
    // Along a straight line between two designs no node jumps.
    let (a, b) = (slanted(), non_convex());
    let plan = MeshPlan::choose(&a, PlanElement::Quad9, None).unwrap();
    let at = |t: f64| {
        let mut actuator = a.clone();
        for (unit, other) in actuator.units.iter_mut().zip(&b.units) {
            for (p, q) in unit
                .chambers_mm
                .iter_mut()
                .flatten()
                .zip(other.chambers_mm.iter().flatten())
            {
                *p = [0, 1].map(|c| p[c] + t * (q[c] - p[c]));
            }
        }
        build(&actuator, &plan).unwrap().discretisation.mesh.nodes
    };
    let steps = 200;
    let mut before = at(0.0);
    for k in 1..=steps {
        let now = at(k as f64 / steps as f64);
        let moved = before
            .iter()
            .zip(&now)
            .map(|(p, q)| polygon::distance(*p, *q))
            .fold(0.0, f64::max);
        // Corners move 0.3 mm a step at most.
        assert!(moved < 1.0, "step {k}: {moved} mm");
        before = now;
    }
}

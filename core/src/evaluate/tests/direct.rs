//! Free units: gradients against differences, and against the repeated unit.

use serde_json::{Value, json};

use super::ask::Asked;
use crate::scene::Orientation;
use crate::study::{Outcome, Study, read_study};

/// A slanted lower chamber above whose thin wall a non-convex upper one is squeezed.
const DESIGN: [f64; 16] = [
    20.0, 3.0, 61.0, 2.5, 58.0, 38.5, 24.0, 39.0, //
    22.0, 41.5, 64.0, 43.0, 59.0, 60.5, 38.0, 63.0,
];

fn study(kind: &str, units: usize, max_size_mm: f64) -> Study {
    let document: Value = json!({
        "name": "direct",
        "actuator": {"units": units},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 12, "load_steps_per_leg": 2},
        "step": [{
            "id": "direct",
            "target": {"kind": "enclosed_area", "probe_mm": [80 * units, 40], "orientation": "clockwise"},
            "model": {
                "kind": kind,
                "element": "quad9",
                "max_size_mm": max_size_mm,
                "relative_residual_force_tolerance": 1e-11
            },
            "constraints": {"stretch": 1.5, "wall_gap_mm": 0.2},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": ["paper"]}
        }]
    });
    read_study(&document, true).unwrap_or_else(|faults| panic!("{faults}"))
}

fn asked<'a>(study: &'a Study, base: &'a [f64]) -> Asked<'a> {
    Asked {
        study,
        base,
        orientation: Some(Orientation::Clockwise),
    }
}

/// Units that differ: each corner moved by up to a millimetre inwards.
fn unequal(units: usize) -> Vec<f64> {
    let inwards = |k: usize| {
        let of_corner = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        of_corner[(k / 2) % 4][k % 2]
    };
    (0..16 * units)
        .map(|k| DESIGN[k % 16] + inwards(k % 16) * (0.5 + 0.5 * (7.0 * k as f64).sin()))
        .collect()
}

#[test]
fn gradients_of_free_units_match_differences() {
    let study = study("fe_direct", 2, 8.0);
    let x = unequal(2);
    asked(&study, &x).check_gradients(&x, 2, 1e-3, 1e-6);
}

/// The meshes differ only where the outermost units meet the ends: copies have tied faces, free units have not.
#[test]
fn equal_free_units_sum_to_the_repeated_unit() {
    let (direct, cascade) = (study("fe_direct", 3, 5.0), study("fe_cascade", 3, 5.0));
    let all = DESIGN.repeat(3);
    let free = asked(&direct, &all).at(&all, true);
    let copies = asked(&cascade, &DESIGN).at(&DESIGN, true);
    let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= 0.02 * scale;
    let (a, b) = (free.objective.unwrap(), copies.objective.unwrap());
    assert!(near(a, b, b.abs()), "{a} {b}");
    let sum = |gradient: &[f64]| -> Vec<f64> {
        (0..16)
            .map(|k| gradient.iter().skip(k).step_by(16).sum())
            .collect()
    };
    let compare = |free: &[f64], copies: &[f64], what: &str| {
        let scale = copies.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (k, (a, b)) in sum(free).iter().zip(copies).enumerate() {
            assert!(near(*a, *b, scale), "{what}, variable {k}: {a} {b}");
        }
    };
    compare(
        free.gradient.as_ref().unwrap(),
        copies.gradient.as_ref().unwrap(),
        "objective",
    );
    // Behind the geometric rows: stretch per corner, gap per chamber.
    let tail = |o: &Outcome| {
        let rows = o.constraint_gradients.as_ref().unwrap();
        let values = o.constraints[o.constraints.len() - 10..].to_vec();
        (values, rows[rows.len() - 10..].to_vec())
    };
    let ((values, rows), (of_copies, copied)) = (tail(&free), tail(&copies));
    for i in 0..10 {
        assert!(near(values[i], of_copies[i], 1.0), "row {i}");
        compare(&rows[i], &copied[i], &format!("row {i}"));
    }
}

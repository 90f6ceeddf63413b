//! Measures as targets and bounds: derivatives against differences, and what physics says of their values.

use serde_json::{Value, json};

use super::ask::Asked;
use crate::study::{Study, read_study};

/// A slanted lower chamber, a non-convex upper one.
const DESIGN: [f64; 16] = [
    20.0, 3.0, 61.0, 2.5, 58.0, 38.5, 24.0, 39.0, //
    22.0, 41.5, 64.0, 43.0, 59.0, 70.5, 38.0, 63.0,
];

/// Two chambers that mirror each other about mid-height.
const MIRRORED: [f64; 16] = [
    20.0, 8.0, 60.0, 5.0, 62.0, 37.0, 18.0, 36.0, //
    18.0, 44.0, 62.0, 43.0, 60.0, 75.0, 20.0, 72.0,
];

fn study(target: &Value, bounds: &Value, schedule: &Value) -> Study {
    study_at(8.0, target, bounds, schedule)
}

/// A study of one step with no element edge longer than `max_size_mm`.
fn study_at(max_size_mm: f64, target: &Value, bounds: &Value, schedule: &Value) -> Study {
    let document = json!({
        "name": "measures",
        "actuator": {"units": 1},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": schedule, "load_steps_per_leg": 2},
        "step": [{
            "id": "one",
            "target": target,
            "model": {
                "kind": "fe_cascade",
                "element": "quad9",
                "max_size_mm": max_size_mm,
                "relative_residual_force_tolerance": 1e-11
            },
            "constraints": {"stretch": "off", "wall_gap_mm": "off", "load_margin": "off", "exclude_non_unique": false, "bounds": bounds},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": ["paper"]}
        }]
    });
    let study = read_study(&document, true).unwrap_or_else(|faults| panic!("{faults}"));
    assert_eq!(read_study(&study.document(), true), Ok(study.clone()));
    study
}

fn asked<'a>(study: &'a Study, base: &'a [f64]) -> Asked<'a> {
    Asked {
        study,
        base,
        orientation: None,
    }
}

/// Values of the target's measure and of the bounds'.
fn measures(study: &Study, x: &[f64]) -> Vec<f64> {
    let outcome = asked(study, x).at(x, false);
    outcome.report.expect("a report").measures
}

fn check(study: &Study, directions: u8) {
    asked(study, &DESIGN).check_gradients(&DESIGN, directions, 1e-3, 1e-7);
}

#[test]
fn gradients_of_bounds_of_every_kind_match_differences() {
    let bounds = json!([
        {"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "clockwise", "at_least": 0.5},
        {"kind": "displacement", "probe_mm": [80, 80], "direction": [1, 2], "leg": 1, "at_least": -5, "at_most": 0},
        {"kind": "bending_angle", "probes_mm": [[80, 0], [80, 80]], "leg": 0, "at_most": 30},
        {"kind": "tip_path", "probe_mm": [80, 40], "points_mm": [[80, 40], [81, 44], [82, 40], [80, 40]], "at_most": 9},
        {"kind": "chamber_area", "channel": 1, "leg": 1, "at_most": 1000},
        {"kind": "chamber_area", "channel": 0, "state": 3, "change": true, "at_most": 500},
    ]);
    let target = json!({"kind": "displacement", "probe_mm": [80, 40], "component": "y", "leg": 0});
    let hold = json!([[0, 0], [15, 0], [15, 15], [0, 0]]);
    check(&study(&target, &bounds, &hold), 2);
}

#[test]
fn gradients_of_targets_of_every_kind_match_differences() {
    let by_state = [
        [80, 40],
        [80, 42],
        [81, 43],
        [82, 42],
        [82, 40],
        [81, 39],
        [80, 40],
    ];
    for target in [
        json!({"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "clockwise"}),
        json!({"kind": "displacement", "probe_mm": [80, 0], "direction": [3, -1], "leg": 0, "reach": 2}),
        json!({"kind": "bending_angle", "probes_mm": [[80, 0], [80, 80]], "leg": 0, "sense": "maximise"}),
        json!({"kind": "bending_angle", "probes_mm": [[80, 0], [80, 80]], "leg": 0, "reach": 25}),
        json!({"kind": "tip_path", "probe_mm": [80, 40], "points_mm": by_state}),
        json!({"kind": "chamber_area", "channel": 0, "leg": 0, "change": true, "sense": "minimise"}),
    ] {
        check(
            &study(
                &target,
                &json!([]),
                &json!([[0, 0], [15, 0], [15, 15], [0, 0]]),
            ),
            1,
        );
    }
}

#[test]
fn one_channel_retraced_encloses_nothing_and_an_area_at_rest_is_the_polygons() {
    let study = study(
        &json!({"kind": "enclosed_area", "probe_mm": [80, 40]}),
        &json!([
            {"kind": "chamber_area", "channel": 0, "state": 0, "at_most": 1e4},
            {"kind": "chamber_area", "channel": 1, "state": 0, "at_most": 1e4},
            {"kind": "chamber_area", "channel": 0, "leg": 1, "change": true, "at_most": 1e4},
            {"kind": "chamber_area", "channel": 0, "leg": 0, "change": true, "at_most": 1e4},
        ]),
        &json!([[0, 0], [15, 0], [0, 0]]),
    );
    let polygon = |corners: &[f64]| {
        let at = |k: usize| (corners[2 * (k % 4)], corners[2 * (k % 4) + 1]);
        let twice = |k| at(k).0 * at(k + 1).1 - at(k + 1).0 * at(k).1;
        (0..4).map(twice).sum::<f64>() / 2.0
    };
    let values = measures(&study, &DESIGN);
    assert!(values[0].abs() < 1e-7, "{values:?}");
    assert!((values[1] - polygon(&DESIGN[..8])).abs() < 1e-9);
    assert!((values[2] - polygon(&DESIGN[8..])).abs() < 1e-9);
    assert!(values[3].abs() < 1e-6 && values[4] > 1.0, "{values:?}");
}

#[test]
fn a_unit_that_mirrors_itself_bends_alike_to_both_sides() {
    let bound = |leg: usize| json!({"kind": "bending_angle", "probes_mm": [[80, 0], [80, 80]], "leg": leg, "at_most": 90});
    // At this size the mesh mirrors itself as well.
    let study = study_at(
        12.0,
        &json!({"kind": "displacement", "probe_mm": [80, 40], "component": "x", "leg": 2}),
        &json!([bound(0), bound(1), bound(2)]),
        &json!([[0, 0], [12, 0], [0, 12], [12, 12]]),
    );
    let values = measures(&study, &MIRRORED);
    // The driven chamber lengthens its side, so that the end face turns away from it: the lower one lifts the tip.
    assert!(values[1] > 0.5, "{values:?}");
    assert!(
        (values[1] + values[2]).abs() < 1e-8 * values[1],
        "{values:?}"
    );
    assert!(values[3].abs() < 1e-8 && values[0] > 0.0, "{values:?}");
}

//! Layouts beyond the stacked pair: gradients against differences, and what the channels do.

use serde_json::json;

use super::ask::Asked;
use crate::scene::Orientation;
use crate::study::{Study, read_study};

/// A slanted left chamber beside a non-convex right one.
const SIDE_BY_SIDE: [f64; 16] = [
    4.0, 9.0, 35.0, 4.5, 38.0, 62.0, 6.0, 72.0, //
    43.0, 6.0, 74.0, 12.0, 66.0, 70.0, 52.0, 44.0,
];

/// Slanted chambers below and above a non-convex one.
const THREE: [f64; 24] = [
    5.0, 4.0, 72.0, 8.0, 70.0, 24.0, 8.0, 17.0, //
    6.0, 30.0, 74.0, 33.0, 52.0, 42.0, 12.0, 50.0, //
    9.0, 56.0, 70.0, 58.0, 76.0, 74.0, 10.0, 77.0,
];

fn study(layout: &str, gap: f64) -> Study {
    let document = json!({
        "name": "layouts",
        "actuator": {"units": 1, "layout": layout},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 8, "load_steps_per_leg": 2},
        "step": [{
            "id": "one",
            "target": {"kind": "enclosed_area", "probe_mm": [80, 27], "orientation": "clockwise"},
            "model": {
                "kind": "fe_cascade",
                "element": "quad9",
                "max_size_mm": 8,
                "relative_residual_force_tolerance": 1e-11
            },
            "constraints": {"stretch": 1.5, "wall_gap_mm": gap},
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

#[test]
fn gradients_of_chambers_side_by_side_match_differences() {
    let study = study("side_by_side", 0.2);
    asked(&study, &SIDE_BY_SIDE).check_gradients(&SIDE_BY_SIDE, 2, 1e-3, 1e-6);
}

#[test]
fn gradients_of_three_chambers_match_differences() {
    let study = study("three_chambers", 0.2);
    asked(&study, &THREE).check_gradients(&THREE, 2, 1e-3, 1e-6);
}

/// A scene of three chambers has three pressures, the report of its study those of the two channels.
#[test]
fn reports_have_the_pressures_of_channels() {
    let study = study("three_chambers", 0.2);
    let outcome = asked(&study, &THREE).at(&THREE, false);
    let path = outcome.report.expect("a report").path;
    let pressures: Vec<_> = path.iter().map(|s| s.pressure_kpa.clone()).collect();
    assert_eq!(pressures[2], [8.0, 0.0]);
    assert_eq!(pressures[4], [8.0, 8.0]);
}

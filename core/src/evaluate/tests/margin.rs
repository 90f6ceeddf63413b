//! The load margin at a true limit point: an Ogden law with alpha = 1, whose balloons have a largest pressure.

use serde_json::json;

use super::ask::{Asked, difference, direction, dot, size};
use crate::study::{Study, read_study};

const DESIGN: [f64; 16] = [
    12., 6., 68., 5., 66., 36., 14., 37., 16., 44., 62., 45., 64., 72., 18., 70.,
];
const MARGIN: f64 = 3.0;

fn study() -> Study {
    let document = json!({
        "name": "margin",
        "actuator": {"units": 1},
        "material": {"model": "ogden", "form": "m", "mu_mpa": [0.2], "alpha": [1.0]},
        "actuation": {"schedule": [[0, 0], [8, 0]], "load_steps_per_leg": 2},
        "step": [{
            "id": "one",
            "target": {"kind": "displacement", "probe_mm": [80, 40], "component": "y", "leg": 0},
            "model": {
                "kind": "fe_cascade",
                "element": "quad9",
                "max_size_mm": 14,
                "relative_residual_force_tolerance": 1e-11
            },
            "constraints": {"stretch": 5, "wall_gap_mm": "off", "load_margin": MARGIN},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": ["paper"]}
        }]
    });
    read_study(&document, false).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn what_is_missing_of_a_margin_has_the_derivative_of_the_limit_load() {
    let study = study();
    let asked = Asked {
        study: &study,
        base: &DESIGN,
        orientation: None,
    };
    let outcome = asked.at(&DESIGN, true);
    let report = outcome.report.as_ref().expect("a report");
    let reached = report.margin_reached.expect("a limit before the margin");
    assert!(reached > 1.05 && reached < MARGIN - 0.1, "{reached}");
    let missing = *outcome.constraints.last().expect("a margin row");
    assert!((missing - (MARGIN - reached)).abs() < 1e-12);
    let gradient = outcome
        .constraint_gradients
        .as_ref()
        .and_then(|rows| rows.last())
        .expect("its derivative");
    let along = direction(16, 0.0);
    // With derivatives, since the limit point is found to the solver's tolerance only for them.
    let differences = difference(&DESIGN, &along, 1e-2, |x| asked.at(x, true).constraints);
    let (difference, exact) = (*differences.last().expect("a row"), dot(gradient, &along));
    assert!(
        (difference - exact).abs() <= 1e-6 * size(gradient),
        "{difference} against {exact}, of {}",
        size(gradient)
    );
}

//! Study documents: examples, presets, round trip.

use serde_json::json;

use super::*;
use crate::document::mutate::for_each_mutation;
use crate::optimiser::{GradientSource, OptimiserOptions};
use crate::scene::read_scene;

/// The command model's form, exactly as the contract writes it.
const CONTRACT: &str = r#"
name = "three-bar-truss"
[[step]]
id = "solve"
model = { kind = "command", argv = ["python3", "truss.py"], time_limit_s = 60, gradient = true }
variables = { lower = [0.001, 0.001], upper = [1e10, 1e10] }
constraints = { inequalities = 6, equalities = 0 }       # feasible when <= 0; equalities follow the inequalities in the array
optimiser = { method = "mmfd", gradient = "model", difference_step = 1e-3, max_iterations = 100 }   # gradient: "model" | "differences"
restarts = { start = "given", points = [[1.0, 1.0]] }
"#;

const EXAMPLES: [&str; 8] = [
    "paper-hierarchical",
    "asymmetric-bending",
    "direct",
    "rectangles",
    "bend-90",
    "follow-path",
    "three-bar-truss",
    "mixed",
];

#[test]
fn the_contracts_command_study_reads() {
    let study = study(&parse_toml(CONTRACT).expect("valid TOML"));
    assert_eq!(study.constraint_count(0), Ok(6));
    assert_eq!(study.variables(0).expect("variables").upper, [1e10, 1e10]);
    assert_eq!(
        study.restarts(0, &StepInputs::default()).expect("restarts")[0].x0,
        [1.0, 1.0]
    );
    assert!(study.body.is_none());
}

#[test]
fn examples_read_and_resolve_to_documents_that_read_back() {
    for name in EXAMPLES {
        let first = study(&example(name));
        let text = first.document().to_string();
        let again = study(&serde_json::from_str(&text).expect("JSON"));
        assert_eq!(again, first, "{name}");
        assert_eq!(again.fingerprint(), first.fingerprint());
        assert_eq!(first.fingerprint().len(), 64);
    }
}

#[test]
fn the_fewest_fit_units_and_their_tip_follow_from_the_schedule() {
    let mut document = example("asymmetric-bending");
    document["actuator"]["units"] = json!(9);
    document["step"][0]["model"]["units"] = json!("fit");
    document["step"][0]["target"]["probe_mm"] = json!("tip");
    // Five units are fit for `swap` alone; a schedule that was not measured has all nine.
    for (schedule, units) in [
        (json!("hold"), 9),
        (json!("swap"), 5),
        (json!("overlap"), 9),
        (json!([[0, 0], [15, 5], [5, 15], [0, 0]]), 9),
    ] {
        document["actuation"]["schedule"] = schedule.clone();
        if schedule.is_array()
            && let Some(fields) = document["actuation"].as_object_mut()
        {
            fields.remove("pressure_kpa");
        }
        let study = study(&document);
        assert_eq!(study.steps[0].model.units(), Some(units), "{schedule}");
        let resolved = study.document();
        let tip = json!([80.0 * (units - 1) as f64, 40.0]);
        assert_eq!(resolved["step"][0]["target"]["probe_mm"], tip, "{schedule}");
    }
}

#[test]
fn examples_say_what_the_presets_say() {
    for (preset, file) in [
        ("paper", "paper-hierarchical"),
        ("asymmetric-bending", "asymmetric-bending"),
    ] {
        assert_eq!(
            study(&json!({"preset": preset})),
            study(&example(file)),
            "{preset}"
        );
    }
}

#[test]
fn a_preset_is_overridden_field_by_field() {
    let study = study(&json!({
        "preset": "asymmetric-bending",
        "name": "mine",
        "actuation": {"pressure_kpa": 10},
        "step": [{"optimiser": {"max_iterations": 3}, "restarts": {"start": "paper"}}],
    }));
    let preset = super::study(&json!({"preset": "asymmetric-bending"}));
    let mut expected = preset.clone();
    expected.name = "mine".into();
    if let Some(body) = &mut expected.body {
        body.actuation.rows_kpa =
            crate::actuation::ActuationCycle::named_rows("hold", 10.0).expect("known");
    }
    if let OptimiserOptions::Gcmma(options) = &mut expected.steps[0].optimiser {
        options.descent.max_iterations = 3;
    }
    expected.steps[0].restarts = spec::Restarts {
        start: vec![spec::StartKind::Paper],
        points: Vec::new(),
        count: 0,
        seed: 1,
        least_distance: spec::LEAST_DISTANCE,
        competition: race::Competition::default(),
    };
    assert_eq!(study, expected);
    assert_eq!(
        faults(&json!({"preset": "paper", "colour": 1, "step": [{"keeps": 0}]})),
        ["colour", "step[0].keeps"]
    );
}

#[test]
fn fingerprints_tell_studies_apart() {
    let base = study(&example("asymmetric-bending"));
    let other = study(&with(
        &example("asymmetric-bending"),
        &["actuation.pressure_kpa=14"],
    ));
    assert_ne!(base.fingerprint(), other.fingerprint());
}

#[test]
fn scenes_of_a_study_read_back_as_scenes() {
    let study = study(&example("paper-hierarchical"));
    let x = study.paper_start(0).expect("a start");
    assert_eq!(x[..8], [39.5, 20.0, 40.5, 20.0, 40.5, 21.0, 39.5, 21.0]);
    let scene = study.scene(0, &x, None).expect("a scene");
    let read = read_scene(&scene.document(), std::path::Path::new("")).expect("sound");
    assert_eq!(read, scene);
}

#[test]
fn corner_boxes_are_those_of_the_paper() {
    let study = study(&example("paper-hierarchical"));
    let v = study.variables(0).expect("variables");
    assert_eq!(v.lower[..4], [2.0, 2.0, 40.5, 2.0]);
    assert_eq!(v.upper[..4], [39.5, 20.0, 78.0, 20.0]);
    assert_eq!(v.lower[8..12], [2.0, 41.0, 40.5, 41.0]);
    assert_eq!(v.upper[12..], [78.0, 78.0, 39.5, 78.0]);
    assert_eq!(v.names[15], "y8");
}

#[test]
fn rectangles_move_their_corners() {
    let study = study(&example("rectangles"));
    let corners = study.corners(0, &[40.0, 15.0]).expect("corners");
    assert_eq!(
        corners[..8],
        [20.0, 13.0, 60.0, 13.0, 60.0, 28.0, 20.0, 28.0]
    );
    // The chain rule against differences of a function of all corners.
    let f = |x: &[f64]| -> f64 {
        let c = study.corners(0, x).expect("corners");
        c.iter()
            .enumerate()
            .map(|(k, v)| (k as f64 + 1.0) * v * v)
            .sum()
    };
    let x = [40.0, 15.0];
    let gradient: Vec<f64> = corners
        .iter()
        .enumerate()
        .map(|(k, v)| 2.0 * (k as f64 + 1.0) * v)
        .collect();
    let gradient = study.design_gradient(0, &x, &gradient).expect("a gradient");
    for k in 0..2 {
        let (mut a, mut b) = (x, x);
        a[k] -= 1e-4;
        b[k] += 1e-4;
        let difference = (f(&b) - f(&a)) / 2e-4;
        assert!((gradient[k] - difference).abs() < 1e-5 * difference.abs().max(1.0));
    }
}

#[test]
fn gradients_come_from_the_model_unless_it_has_none() {
    let gradient = |document: &serde_json::Value| match &study(document).steps[0].optimiser {
        OptimiserOptions::Mmfd(options) => options.descent.gradient,
        OptimiserOptions::Gcmma(options) => options.descent.gradient,
        OptimiserOptions::Sqp(options) => options.descent.gradient,
        other => panic!("a method without gradients: {other:?}"),
    };
    for method in ["mmfd", "gcmma", "sqp"] {
        let mut truss = example("three-bar-truss");
        truss["step"][0]["optimiser"]["method"] = json!(method);
        assert_eq!(gradient(&truss), GradientSource::Model);
        truss["step"][0]["model"]["gradient"] = json!(false);
        assert_eq!(faults(&truss), ["step[0].optimiser.gradient"]);
        truss["step"][0]["optimiser"] = json!({"method": method});
        assert_eq!(gradient(&truss), GradientSource::Differences);
    }
}

#[test]
fn each_unit_may_have_its_material() {
    let read = study(&with(
        &example("asymmetric-bending"),
        &[
            "unit_materials=[\"mold-star-30\", {\"model\": \"ogden\", \"form\": \"m\", \"mu_mpa\": [0.5], \"alpha\": [1.5], \"fit_stretch\": 1.7}, \"dragon-skin-20\"]",
        ],
    ));
    let body = read.body.as_ref().expect("a body");
    let laws = body.material.laws(3);
    assert_eq!(laws.len(), 3);
    assert!((laws[1].shear_modulus_mpa() - 0.375).abs() < 1e-15);
    assert_eq!(body.material.stretch_limit(), Some(1.7));
    let document = read.document();
    assert!(document.get("material").is_none());
    assert_eq!(document["unit_materials"][2], "dragon-skin-20");
    assert_eq!(study(&document), read);
    let lower = read.variables(0).expect("variables").lower;
    let scene = read.scene(0, &lower, None).expect("a scene");
    let crate::scene::Body::Actuator(chain) = &scene.body else {
        panic!("an actuator")
    };
    assert_eq!(chain.materials, laws);
}

#[test]
fn no_single_odd_value_is_more_than_a_fault() {
    for name in EXAMPLES {
        let (mut read, mut refused) = (0, 0);
        for_each_mutation(&example(name), &mut |odd| match read_study(odd, true) {
            Ok(study) => {
                read += 1;
                assert_eq!(read_study(&study.document(), true), Ok(study.clone()));
                for step in 0..study.steps.len() {
                    assert!(study.problem(step).is_ok());
                    let restarts = study.restarts(step, &StepInputs::default());
                    // What takes its starts from others has none before them.
                    let waits = !study.steps[step].takes.is_empty();
                    assert!(waits || !restarts.expect("restarts").is_empty(), "{odd}");
                }
            }
            Err(faults) => {
                refused += 1;
                assert!(!faults.0.is_empty());
            }
        });
        assert!(read > 10 && refused > 200, "{name}: {read} {refused}");
    }
}

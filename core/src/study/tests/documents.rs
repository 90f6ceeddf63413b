//! Study documents: examples, presets, round trip, faults.

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
fn every_fault_of_a_quadratic_programme_is_told_at_once() {
    let mut truss = example("three-bar-truss");
    truss["step"][0]["optimiser"] = json!({
        "method": "sqp", "first_move": 0.0, "stall_factor": -1.0, "violation_tolerance": 0.0
    });
    let mut found = faults(&truss);
    found.sort();
    assert_eq!(
        found,
        [
            "step[0].optimiser.first_move",
            "step[0].optimiser.stall_factor",
            "step[0].optimiser.violation_tolerance",
        ]
    );
    truss["step"][0]["optimiser"] =
        json!({"method": "sqp", "globalise": true, "max_iterations": 0});
    let mut found = faults(&truss);
    found.sort();
    assert_eq!(
        found,
        [
            "step[0].optimiser.globalise",
            "step[0].optimiser.max_iterations"
        ]
    );
}

#[test]
fn every_fault_of_the_asymptotes_is_told_at_once() {
    let mut truss = example("three-bar-truss");
    truss["step"][0]["optimiser"] = json!({
        "method": "gcmma", "first_move": 2.0, "relative_tolerance": -1.0, "violation_tolerance": 0.0
    });
    assert_eq!(
        faults(&truss),
        [
            "step[0].optimiser.violation_tolerance",
            "step[0].optimiser.relative_tolerance",
            "step[0].optimiser.first_move"
        ]
    );
    truss["step"][0]["optimiser"] =
        json!({"method": "gcmma", "globalise": 1, "active_from": -0.1, "consecutive": 0});
    let mut found = faults(&truss);
    found.sort();
    assert_eq!(
        found,
        [
            "step[0].optimiser.active_from",
            "step[0].optimiser.consecutive",
            "step[0].optimiser.globalise"
        ]
    );
}

#[test]
fn commands_are_refused_where_paths_are() {
    let refused = read_study(&example("three-bar-truss"), false).unwrap_err();
    assert_eq!(refused.0.len(), 1);
    assert_eq!(refused.0[0].path, "step[0].model.argv");
    assert!(read_study(&example("asymmetric-bending"), false).is_ok());
}

#[test]
fn each_kind_of_fault_is_noted_at_its_path() {
    let cases: &[(&str, &str)] = &[
        ("name=7", "name"),
        ("name=../x", "name"),
        ("colour=red", "colour"),
        ("preset=nature", "preset"),
        ("actuator.units=0", "actuator.units"),
        ("actuator.units=31", "actuator.units"),
        ("actuator.unit_mm=[80, -80]", "actuator.unit_mm"),
        ("actuator.corner_radius_mm=-1", "actuator.corner_radius_mm"),
        ("actuator.corner_radius_mm=41", "actuator.corner_radius_mm"),
        ("actuator.layout=ring", "actuator.layout"),
        ("actuator.wall_mm=-2", "actuator.wall_mm"),
        ("actuator.wall_mm=27", "actuator.wall_mm"),
        (
            "actuator.centre_clearance_mm=0",
            "actuator.centre_clearance_mm",
        ),
        ("actuator.chambers_mm=[]", "actuator.chambers_mm"),
        ("material=butter", "material"),
        (
            "material={\"model\": \"neo_hookean\", \"c10_mpa\": -1}",
            "material.c10_mpa",
        ),
        (
            "material={\"model\": \"neo_hookean\", \"c10_mpa\": 1}",
            "step[0].constraints.stretch",
        ),
        (
            "material={\"model\": \"ogden\", \"form\": \"m\", \"mu_mpa\": [0.2], \"alpha\": [0.5], \"fit_stretch\": 4}",
            "material.fit_stretch",
        ),
        ("unit_materials=[\"mold-star-30\"]", "unit_materials"),
        ("unit_materials=mold-star-30", "unit_materials"),
        (
            "unit_materials=[\"mold-star-30\", \"butter\", \"mold-star-30\"]",
            "unit_materials[1]",
        ),
        (
            "unit_materials=[\"mold-star-30\", \"mold-star-30\", {\"model\": \"ogden\"}]",
            "unit_materials[2].alpha",
        ),
        (
            "unit_materials=[\"mold-star-30\", \"smooth-sil-950\", \"mold-star-30\"]",
            "step[0].constraints.stretch",
        ),
        ("actuation.schedule=sideways", "actuation.schedule"),
        ("actuation.schedule=ramp", "actuation"),
        ("actuation={\"schedule\": [[0, 0]]}", "actuation.schedule"),
        (
            "actuation.load_steps_per_leg=0",
            "actuation.load_steps_per_leg",
        ),
        ("step=[]", "step"),
        ("step=7", "step"),
        ("step[0].id=null", "step[0].id"),
        ("step[0].level=0", "step[0].level"),
        ("step[0].colour=red", "step[0].colour"),
        ("step[0].target.kind=beauty", "step[0].target.kind"),
        (
            "step[0].target.probe_mm=[241, 40]",
            "step[0].target.probe_mm",
        ),
        (
            "step[0].target.probe_mm=[120, 20]",
            "step[0].target.probe_mm",
        ),
        (
            "step[0].target.orientation=up",
            "step[0].target.orientation",
        ),
        (
            "step[0].target={\"kind\": \"displacement\", \"probe_mm\": [160, 40], \"component\": \"x\", \"state\": 99}",
            "step[0].target.state",
        ),
        ("step[0].model.kind=constant_beam", "step[0].model.kind"),
        ("step[0].model.kind=oracle", "step[0].model.kind"),
        ("step[0].model.element=hex", "step[0].model.element"),
        (
            "step[0].model.max_size_mm=1e-9",
            "step[0].model.max_size_mm",
        ),
        ("step[0].model.contact=perhaps", "step[0].model.contact"),
        (
            "step[0].model.contact_activation_mm=0",
            "step[0].model.contact_activation_mm",
        ),
        (
            "step[0].model.mesh={\"error\": 0}",
            "step[0].model.mesh.error",
        ),
        ("step[0].model.mesh={}", "step[0].model.mesh.error"),
        (
            "step[0].model.mesh={\"error\": 0.1, \"chosen\": {\"at\": \"middle\", \"tip_error\": 0.01, \"uncertainty\": 0}}",
            "step[0].model.mesh.chosen.elements",
        ),
        (
            "step[0].model.relative_residual_force_tolerance=0",
            "step[0].model.relative_residual_force_tolerance",
        ),
        (
            "step[0].variables.parametrisation=splines",
            "step[0].variables.parametrisation",
        ),
        ("step[0].variables.lower=[1]", "step[0].variables.lower"),
        (
            "step[0].constraints.wall_mm=0",
            "step[0].constraints.wall_mm",
        ),
        (
            "step[0].constraints.wall_mm=1.9",
            "step[0].constraints.stretch_length_mm",
        ),
        (
            "step[0].constraints.stretch_length_mm=0.6",
            "step[0].constraints.stretch_length_mm",
        ),
        (
            "step[0].constraints.spike_deg=90",
            "step[0].constraints.spike_deg",
        ),
        (
            "step[0].constraints.stretch=0.9",
            "step[0].constraints.stretch",
        ),
        (
            "step[0].constraints.stretch=much",
            "step[0].constraints.stretch",
        ),
        (
            "step[0].constraints.inequalities=2",
            "step[0].constraints.inequalities",
        ),
        ("step[0].optimiser.method=luck", "step[0].optimiser.method"),
        (
            "step[0].optimiser.max_iterations=0",
            "step[0].optimiser.max_iterations",
        ),
        (
            "step[0].optimiser.difference_step=-1",
            "step[0].optimiser.difference_step",
        ),
        (
            "step[0].optimiser.active_from=1",
            "step[0].optimiser.active_from",
        ),
        ("step[0].optimiser.fdch=1", "step[0].optimiser.fdch"),
        ("step[0].restarts.start=[]", "step[0].restarts.start"),
        ("step[0].restarts.start=luck", "step[0].restarts.start"),
        (
            "step[0].restarts.start=[\"paper\", \"paper\"]",
            "step[0].restarts.start",
        ),
        ("step[0].restarts.start=paper", "step[0].restarts.count"),
        ("step[0].restarts.count=0", "step[0].restarts.count"),
        ("step[0].restarts.seed=-1", "step[0].restarts.seed"),
        (
            "step[0].restarts.least_distance=2",
            "step[0].restarts.least_distance",
        ),
        (
            "step[0].restarts={\"start\": \"paper\", \"least_distance\": 0.1}",
            "step[0].restarts.least_distance",
        ),
        (
            "step[0].restarts.start=[\"random\", \"uniform\"]",
            "step[0].restarts.start",
        ),
        (
            "step[0].restarts={\"start\": \"sobol\"}",
            "step[0].restarts.count",
        ),
        (
            "step[0].restarts={\"start\": \"given\"}",
            "step[0].restarts.points",
        ),
        (
            "step[0].restarts={\"start\": \"given\", \"points\": []}",
            "step[0].restarts.points",
        ),
        (
            "step[0].restarts={\"start\": \"given\", \"points\": [[1]]}",
            "step[0].restarts.points[0]",
        ),
        (
            "step[0].restarts={\"start\": \"random\"}",
            "step[0].restarts.count",
        ),
        ("step[0].budget.evaluations=0", "step[0].budget.evaluations"),
        ("step[0].budget.evaluations=7", "step[0].budget.evaluations"),
        ("step[0].budget.seconds=1", "step[0].budget.seconds"),
        ("step[0].takes=[\"other\"]", "step[0].takes[0]"),
        ("step[0].keeps=0", "step[0].keeps"),
    ];
    for (assignment, path) in cases {
        let found = faults(&with(&example("asymmetric-bending"), &[assignment]));
        assert!(
            found.iter().any(|p| p == path),
            "{assignment}: expected a fault at {path}, found {found:?}"
        );
    }
}

#[test]
fn each_fault_of_a_command_study_is_noted_at_its_path() {
    let cases: &[(&str, &str)] = &[
        ("material=mold-star-30", "material"),
        ("unit_materials=[]", "unit_materials"),
        (
            "step[0].target={\"kind\": \"enclosed_area\", \"probe_mm\": [0, 0]}",
            "step[0].target",
        ),
        ("step[0].model.argv=[]", "step[0].model.argv"),
        ("step[0].model.argv=[1]", "step[0].model.argv[0]"),
        ("step[0].model.time_limit_s=0", "step[0].model.time_limit_s"),
        ("step[0].model.gradient=yes", "step[0].model.gradient"),
        (
            "step[0].variables.lower=[1, 1e11]",
            "step[0].variables.upper[1]",
        ),
        ("step[0].variables.lower=[1]", "step[0].variables.upper"),
        (
            "step[0].variables.lower=[\"a\", 1]",
            "step[0].variables.lower[0]",
        ),
        ("step[0].variables={}", "step[0].variables.lower"),
        (
            "step[0].constraints.inequalities=-1",
            "step[0].constraints.inequalities",
        ),
        (
            "step[0].constraints.wall_mm=2",
            "step[0].constraints.wall_mm",
        ),
        (
            "step[0].restarts.points[0][0]=0",
            "step[0].restarts.points[0][0]",
        ),
        (
            "step[0].restarts.points=[[1, 1, 1]]",
            "step[0].restarts.points[0]",
        ),
        ("step[0].restarts.start=paper", "step[0].restarts.start"),
        (
            "step[0].optimiser={\"method\": \"sweep\", \"grid\": [[1, 2]]}",
            "step[0].optimiser.grid",
        ),
        (
            "step[0].optimiser={\"method\": \"sweep\", \"grid\": [[1, 2], [0]]}",
            "step[0].optimiser.grid[1][0]",
        ),
        (
            "step[0].optimiser={\"method\": \"sweep\", \"grid\": [[1], [2]]}",
            "step[0].restarts",
        ),
    ];
    for (assignment, path) in cases {
        let found = faults(&with(&example("three-bar-truss"), &[assignment]));
        assert!(
            found.iter().any(|p| p == path),
            "{assignment}: expected a fault at {path}, found {found:?}"
        );
    }
}

#[test]
fn all_faults_come_at_once() {
    let document = with(
        &example("asymmetric-bending"),
        &[
            "colour=red",
            "actuator.units=0",
            "material=butter",
            "actuation={\"schedule\": [[0, 0]]}",
            "step[0].level=-1",
            "step[0].target.orientation=up",
            "step[0].model.element=hex",
            "step[0].restarts.count=0",
            "step[0].keeps=0",
        ],
    );
    assert_eq!(
        faults(&document),
        [
            "colour",
            "actuator.units",
            "material",
            "actuation.schedule",
            "step[0].level",
            "step[0].model.element",
            "step[0].target.orientation",
            "step[0].restarts.count",
            "step[0].keeps",
        ]
    );
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
fn two_steps_need_two_names() {
    let mut document = example("three-bar-truss");
    let step = document["step"][0].clone();
    document["step"].as_array_mut().expect("a list").push(step);
    assert_eq!(faults(&document), ["step[1].id"]);
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

#[test]
fn targets_and_bounds_say_what_is_wrong_with_them() {
    let base = example("bend-90");
    assert_eq!(faults(&base), Vec::<String>::new());
    let bound = "step[0].constraints.bounds";
    for (assignment, path) in [
        (
            "step[0].target={\"kind\": \"chamber_area\", \"channel\": 2, \"leg\": 0, \"sense\": \"minimise\"}",
            "step[0].target.channel",
        ),
        (
            "step[0].target={\"kind\": \"chamber_area\", \"channel\": 0, \"leg\": 1, \"sense\": \"minimise\"}",
            "step[0].target.leg",
        ),
        (
            "step[0].target={\"kind\": \"chamber_area\", \"channel\": 0, \"leg\": 0}",
            "step[0].target",
        ),
        ("step[0].target.reach=5", "step[0].target.reach"),
        ("step[0].target.state=1", "step[0].target.leg"),
        ("step[0].target.sense=up", "step[0].target.sense"),
        (
            "step[0].target={\"kind\": \"displacement\", \"probe_mm\": [480, 40], \"direction\": [0, 0], \"leg\": 0}",
            "step[0].target.direction",
        ),
        (
            "step[0].target={\"kind\": \"displacement\", \"probe_mm\": [480, 40], \"component\": \"x\", \"direction\": [0, 1], \"leg\": 0}",
            "step[0].target.direction",
        ),
        (
            "step[0].target={\"kind\": \"tip_path\", \"probe_mm\": [480, 40], \"points_mm\": [[0, 0], [1, 1], [2, 2]]}",
            "step[0].target.points_mm",
        ),
        (
            "step[0].constraints.bounds=[{\"kind\": \"bending_angle\", \"probes_mm\": [[480, 0], [480, 0]], \"leg\": 0, \"at_least\": 1}]",
            "step[0].constraints.bounds[0].probes_mm",
        ),
        (
            "step[0].constraints.bounds=[{\"kind\": \"bending_angle\", \"probes_mm\": [[480, 0], [40, 20]], \"leg\": 0, \"at_least\": 1}]",
            "step[0].constraints.bounds[0].probes_mm[1]",
        ),
        (
            "step[0].constraints.bounds=[{\"kind\": \"enclosed_area\", \"probe_mm\": [480, 40]}]",
            "step[0].constraints.bounds[0]",
        ),
        (
            "step[0].constraints.bounds=[{\"kind\": \"enclosed_area\", \"probe_mm\": [480, 40], \"orientation\": \"either\", \"at_most\": 1}]",
            "step[0].constraints.bounds[0].orientation",
        ),
        (
            "step[0].constraints.bounds=[{\"kind\": \"enclosed_area\", \"probe_mm\": [480, 40], \"at_least\": 2, \"at_most\": 1}]",
            "step[0].constraints.bounds[0].at_most",
        ),
    ] {
        assert_eq!(faults(&with(&base, &[assignment])), [path], "{assignment}");
    }
    let both = format!(
        "{bound}=[{{\"kind\": \"chamber_area\", \"channel\": 0, \"state\": 1, \"at_least\": 1, \"at_most\": 2}}]"
    );
    let study = study(&with(&base, &[&both]));
    assert_eq!(
        study.constraint_count(0).expect("a step"),
        super::study(&base).constraint_count(0).expect("a step") + 1
    );
}

//! What is wrong with a study document is said at its path, all at once.

use serde_json::json;

use super::*;

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
fn two_steps_need_two_names() {
    let mut document = example("three-bar-truss");
    let step = document["step"][0].clone();
    document["step"].as_array_mut().expect("a list").push(step);
    assert_eq!(faults(&document), ["step[1].id"]);
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

//! Scenes read, their faults, and the round trip of `resolved`.

use std::path::Path;

use serde_json::{Value, json};

use super::*;
use crate::document::mutate::for_each_mutation;
use crate::document::set;

fn base() -> Value {
    json!({"version": 1,
        "actuator": {"repeat": 3, "unit_mm": [80, 80],
            "chambers_mm": [[[20, 13], [60, 13], [60, 28], [20, 28]], [[20, 52], [60, 52], [60, 67], [20, 67]]]},
        "material": {"model": "neo_hookean", "c10_mpa": 0.11, "bulk_over_shear": 1000},
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 10, "spacing": "equal"},
        "mesh": {"element": "auto", "max_size_mm": null},
        "contact": "off",
        "relative_residual_force_tolerance": 1e-8,
        "probes": {"tip": [160, 40], "end": [240, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "counter_clockwise"}})
}

fn mesh_base() -> Value {
    json!({"version": 1, "mesh_file": "x.msh", "material": "mold-star-30",
        "actuation": {"schedule": "ramp", "pressure_kpa": 20},
        "supports": [{"group": "left", "fix": ["x"], "displacement_mm": [1, 0]}, {"group": "bottom", "fix": ["y"]}],
        "tractions": [{"group": "right", "mpa": [0, 6.25], "channel": 0}],
        "pressures": [{"group": "bore", "channel": 0}],
        "materials": [{"group": "stiff", "material": {"model": "yeoh", "c_mpa": [0.1, 0.01, -0.001]}}]})
}

fn with(mut document: Value, assignments: &[&str]) -> Value {
    for assignment in assignments {
        set(&mut document, assignment).expect("an assignment that applies");
    }
    document
}

fn scene(document: &Value) -> Scene {
    read_scene(document, Path::new("")).expect("a sound scene")
}

/// Paths of the faults of a document.
fn faults(document: &Value) -> Vec<String> {
    match read_scene(document, Path::new("")) {
        Ok(_) => Vec::new(),
        Err(faults) => faults.0.into_iter().map(|f| f.path).collect(),
    }
}

#[test]
fn the_contracts_example_reads() {
    let scene = scene(&base());
    let Body::Actuator(body) = &scene.body else {
        panic!("an actuator")
    };
    assert_eq!(body.actuator.units.len(), 3);
    assert!(body.actuator.repeated);
    assert_eq!(body.materials.len(), 3);
    assert_eq!(scene.actuation.path().len(), 31);
    assert_eq!(scene.probes[1].name, "end");
}

#[test]
fn defaults_are_those_of_the_contract() {
    let scene = scene(&json!({"version": 1,
        "actuator": {"chambers_mm": []}, "material": "mold-star-30", "actuation": {"schedule": "hold"}}));
    let Body::Actuator(body) = &scene.body else {
        panic!("an actuator")
    };
    assert_eq!(body.actuator.unit_mm, [80.0, 80.0]);
    assert_eq!(body.actuator.units.len(), 1);
    assert_eq!(body.materials[0].bulk_over_shear, 1000.0);
    assert_eq!(scene.actuation.rows_kpa[1], [15.0, 0.0]);
    assert_eq!(scene.actuation.load_steps_per_leg, 10);
    assert_eq!(scene.mesh, MeshRequest::default());
    assert_eq!(scene.contact, ContactMode::Auto);
    assert_eq!(scene.relative_residual_force_tolerance, 1e-8);
    assert!(scene.probes.is_empty() && scene.objective.is_none());
}

#[test]
fn what_acted_reads_back_to_the_same_scene() {
    let documents = [
        base(),
        mesh_base(),
        with(
            base(),
            &["actuation.schedule=[[0, 0], [0, 15.1], [-3, 0.1]]"],
        )
        .as_object()
        .map(|d| {
            let mut d = d.clone();
            if let Some(actuation) = d["actuation"].as_object_mut() {
                actuation.remove("pressure_kpa");
            }
            Value::Object(d)
        })
        .expect("an object"),
        with(
            base(),
            &[
                "unit_materials=[\"mold-star-30\", {\"model\": \"ogden\", \"form\": \"m\", \"mu_mpa\": [0.63, 0.0012, -0.01], \"alpha\": [1.3, 5, -2]}, \"ecoflex-00-30\"]",
                "mesh.max_size_mm=2.5",
                "objective={\"kind\": \"displacement\", \"probe\": \"end\", \"component\": \"y\", \"state\": 10, \"sign\": -1}",
            ],
        ),
        with(
            base(),
            &[
                "actuator={\"units\": [{\"chambers_mm\": []}, {\"chambers_mm\": [[[1, 1], [2, 1], [1.5, 70.123456789]]]}, {\"chambers_mm\": []}]}",
            ],
        ),
    ];
    for document in documents {
        let read = scene(&document);
        let echo = serde_json::to_string(&read).expect("serialises");
        let echoed: Value = serde_json::from_str(&echo).expect("is JSON");
        assert_eq!(scene(&echoed), read);
        assert_eq!(scene(&echoed).document(), read.document());
    }
}

#[test]
fn each_kind_of_fault_is_noted_at_its_path() {
    let cases: &[(&str, &str)] = &[
        ("version=2", "version"),
        ("colour=1", "colour"),
        ("actuator.repeat=0", "actuator.repeat"),
        ("actuator.repeat=2.5", "actuator.repeat"),
        ("actuator.repeat=1000000000", "actuator.repeat"),
        ("actuator.unit_mm=[80, 0]", "actuator.unit_mm"),
        ("actuator.unit_mm=[80]", "actuator.unit_mm"),
        ("actuator.unit_mm=80", "actuator.unit_mm"),
        (
            "actuator.corner_radius_mm=-0.5",
            "actuator.corner_radius_mm",
        ),
        (
            "actuator.corner_radius_mm=1e-3",
            "actuator.corner_radius_mm",
        ),
        ("actuator.corner_radius_mm=41", "actuator.corner_radius_mm"),
        (
            "actuator.corner_radius_mm=\"round\"",
            "actuator.corner_radius_mm",
        ),
        (
            "actuator.chambers_mm[1][2]=[90, 67]",
            "actuator.chambers_mm[1]",
        ),
        (
            "actuator.chambers_mm[1][2][0]=\"x\"",
            "actuator.chambers_mm[1][2][0]",
        ),
        (
            "actuator.chambers_mm[0][0]=[20, 0]",
            "actuator.chambers_mm[0]",
        ),
        (
            "actuator.chambers_mm[0]=[[20, 13], [20, 28], [60, 28], [60, 13]]",
            "actuator.chambers_mm[0]",
        ),
        (
            "actuator.chambers_mm[0]=[[20, 13], [60, 28], [60, 13], [20, 28]]",
            "actuator.chambers_mm[0]",
        ),
        (
            "actuator.chambers_mm[0]=[[20, 13], [60, 13]]",
            "actuator.chambers_mm[0]",
        ),
        (
            "actuator.chambers_mm[0][2]=[60, 55]",
            "actuator.chambers_mm[1]",
        ),
        (
            "actuator.chambers_mm[0]=[[20, 13], [60, 13], [60, 52], [20, 28]]",
            "actuator.chambers_mm[1]",
        ),
        ("actuator.units=[{\"chambers_mm\": []}]", "actuator.units"),
        ("material=butter", "material"),
        ("material.c10_mpa=-0.11", "material.c10_mpa"),
        ("material.c10_mpa=null", "material.c10_mpa"),
        ("material.bulk_over_shear=0", "material.bulk_over_shear"),
        ("material.model=ogden", "material.form"),
        ("material.fit_stretch=1", "material.fit_stretch"),
        (
            "material={\"model\": \"ogden\", \"form\": \"b\", \"mu_mpa\": [0.2], \"alpha\": [2]}",
            "material.form",
        ),
        (
            "material={\"model\": \"ogden\", \"form\": \"m\", \"mu_mpa\": [0.2], \"alpha\": [0]}",
            "material.alpha[0]",
        ),
        (
            "material={\"model\": \"ogden\", \"form\": \"m\", \"mu_mpa\": [0.2, 0.1], \"alpha\": [2]}",
            "material.alpha",
        ),
        (
            "material={\"model\": \"ogden\", \"form\": \"m\", \"mu_mpa\": [0.2], \"alpha\": [-2]}",
            "material.mu_mpa",
        ),
        (
            "material={\"model\": \"ogden\", \"form\": \"a\", \"mu_mpa\": [], \"alpha\": [2]}",
            "material.mu_mpa",
        ),
        (
            "material={\"model\": \"yeoh\", \"c_mpa\": [0.1, 0.01, -0.001], \"fit_stretch\": 4}",
            "material.fit_stretch",
        ),
        ("material.model=elastic", "material.model"),
        (
            "material={\"model\": \"yeoh\", \"c_mpa\": [-0.1, 0, 0]}",
            "material.c_mpa",
        ),
        (
            "material={\"model\": \"yeoh\", \"c_mpa\": [0.1, 0]}",
            "material.c_mpa",
        ),
        (
            "material={\"model\": \"mooney_rivlin\", \"c10_mpa\": 0.1, \"c01_mpa\": -0.2}",
            "material",
        ),
        ("unit_materials=[\"mold-star-30\"]", "unit_materials"),
        (
            "unit_materials=[\"mold-star-30\", \"a\", \"mold-star-30\"]",
            "unit_materials[1]",
        ),
        ("actuation.schedule=sideways", "actuation.schedule"),
        ("actuation.schedule=7", "actuation.schedule"),
        ("actuation.schedule=ramp", "actuator.chambers_mm"),
        (
            "actuation.schedule=[[0, 0], [1, 0]]",
            "actuation.pressure_kpa",
        ),
        ("actuation={\"schedule\": [[0, 0]]}", "actuation.schedule"),
        (
            "actuation={\"schedule\": [[1, 0], [0, 0]]}",
            "actuation.schedule[0]",
        ),
        (
            "actuation={\"schedule\": [[0, 0], [1, 0], [1, 0]]}",
            "actuation.schedule[2]",
        ),
        (
            "actuation={\"schedule\": [[0, 0], [1, 0], [0]]}",
            "actuation.schedule[2]",
        ),
        (
            "actuation={\"schedule\": [[0, 0], [1, \"x\"]]}",
            "actuation.schedule[1][1]",
        ),
        ("actuation.pressure_kpa=0", "actuation.pressure_kpa"),
        (
            "actuation.load_steps_per_leg=0",
            "actuation.load_steps_per_leg",
        ),
        (
            "actuation.load_steps_per_leg=100000000000",
            "actuation.load_steps_per_leg",
        ),
        ("actuation.spacing=random", "actuation.spacing"),
        ("actuation={}", "actuation.schedule"),
        ("mesh.element=tri3", "mesh.element"),
        ("mesh.max_size_mm=0", "mesh.max_size_mm"),
        ("mesh.max_size_mm=1e-6", "mesh.max_size_mm"),
        ("mesh.size=1", "mesh.size"),
        (
            "mesh={\"max_size_mm\": 3, \"mean_size_mm\": 3}",
            "mesh.mean_size_mm",
        ),
        ("contact=perhaps", "contact"),
        ("contact_activation_mm=0", "contact_activation_mm"),
        ("contact_activation_mm=-1", "contact_activation_mm"),
        ("contact=true", "contact"),
        (
            "obstacles=[{\"name\": \"a\", \"shape\": \"circle\", \"centre_mm\": [40, 200], \"radius_mm\": -1}]",
            "obstacles[0].radius_mm",
        ),
        (
            "obstacles=[{\"name\": \"cuts\", \"shape\": \"line\", \"points_mm\": [[100, -10], [100, 90]]}]",
            "obstacles[0]",
        ),
        (
            "obstacles=[{\"name\": \"off\", \"shape\": \"line\", \"points_mm\": [[0, 200], [100, 200]]}]",
            "contact",
        ),
        (
            "relative_residual_force_tolerance=-1",
            "relative_residual_force_tolerance",
        ),
        ("probes.tip=[241, 40]", "probes.tip"),
        ("probes.tip=[40, 20]", "probes.tip"),
        ("probes.tip=[120, 60]", "probes.tip"),
        ("probes=[]", "probes"),
        ("objective.kind=beauty", "objective.kind"),
        ("objective.probe=nose", "objective.probe"),
        ("objective.orientation=either", "objective.orientation"),
        ("objective.sign=1", "objective.sign"),
        (
            "objective={\"kind\": \"displacement\", \"probe\": \"tip\", \"component\": \"y\", \"state\": 31}",
            "objective.state",
        ),
        (
            "objective={\"kind\": \"displacement\", \"probe\": \"tip\", \"component\": \"z\", \"state\": 1}",
            "objective.component",
        ),
        (
            "objective={\"kind\": \"displacement\", \"probe\": \"tip\", \"component\": \"x\", \"state\": 1, \"sign\": 2}",
            "objective.sign",
        ),
        ("supports=[]", "supports"),
        ("mesh_file=x.msh", "mesh_file"),
    ];
    for (assignment, path) in cases {
        let found = faults(&with(base(), &[assignment]));
        assert!(
            found.iter().any(|p| p == path),
            "{assignment}: expected a fault at {path}, found {found:?}"
        );
    }
}

#[test]
fn a_sound_neighbour_of_each_fault_reads() {
    for assignment in [
        "actuator.chambers_mm[0]=[[20, 13], [60, 13], [60, 51.9], [20, 28]]",
        "probes.tip=[20, 13]",
        "probes.tip=[240, 80]",
        "actuation={\"schedule\": [[0, 0], [1, 0], [0, 0]]}",
        "actuation={\"schedule\": [[0, 0, 0], [-1, 0, 7]]}",
        "material={\"model\": \"mooney_rivlin\", \"c10_mpa\": 0.2, \"c01_mpa\": -0.1}",
        "material={\"model\": \"ogden\", \"form\": \"a\", \"mu_mpa\": [0.2, -0.01], \"alpha\": [2, -2]}",
        "material={\"model\": \"yeoh\", \"c_mpa\": [0.1, 0.01, -0.001], \"fit_stretch\": 2}",
        "objective=null",
        "unit_materials=null",
        "contact=auto",
        "contact=on",
    ] {
        assert_eq!(
            faults(&with(base(), &[assignment])),
            Vec::<String>::new(),
            "{assignment}"
        );
    }
}

#[test]
fn all_faults_come_at_once() {
    let document = with(
        base(),
        &[
            "version=3",
            "colour=red",
            "actuator.chambers_mm[0][0]=[-1, 13]",
            "actuator.chambers_mm[1][0][1]=\"x\"",
            "material.c10_mpa=-1",
            "actuation={\"schedule\": [[0]], \"load_steps_per_leg\": 0}",
            "mesh.element=hex",
            "contact=perhaps",
            "relative_residual_force_tolerance=0",
            "objective.probe=nose",
        ],
    );
    assert_eq!(
        faults(&document),
        [
            "colour",
            "version",
            "actuation.schedule",
            "actuation.load_steps_per_leg",
            "actuator.chambers_mm[0]",
            "actuator.chambers_mm[1][0][1]",
            "material.c10_mpa",
            "mesh.element",
            "contact",
            "relative_residual_force_tolerance",
            "objective.probe",
        ]
    );
}

#[test]
fn what_is_missing_is_named() {
    assert_eq!(
        faults(&json!({})),
        ["version", "actuation", "actuator", "material"]
    );
    assert_eq!(faults(&json!([])), [""]);
    assert_eq!(
        faults(&json!({"version": 1, "mesh_file": "x.msh"})),
        ["actuation", "material", "supports"]
    );
}

#[test]
fn faults_of_mesh_file_scenes_are_noted() {
    assert_eq!(faults(&mesh_base()), Vec::<String>::new());
    let cases: &[(&str, &str)] = &[
        ("mesh_file=7", "mesh_file"),
        (
            "supports=[{\"group\": \"left\", \"fix\": [\"x\"]}]",
            "supports",
        ),
        ("supports[0].fix=[\"z\"]", "supports[0].fix[0]"),
        ("supports[0].fix=[\"y\", \"y\"]", "supports[0].fix"),
        (
            "supports[0].displacement_mm=[1, 1]",
            "supports[0].displacement_mm",
        ),
        ("supports[0].channel=1", "supports[0].channel"),
        ("tractions[0].channel=-1", "tractions[0].channel"),
        ("tractions[0].mpa=[0]", "tractions[0].mpa"),
        ("pressures[0].channel=5", "pressures[0].channel"),
        ("pressures[0].mpa=[0, 1]", "pressures[0].mpa"),
        (
            "materials[0].material.c_mpa[0]=-1",
            "materials[0].material.c_mpa",
        ),
        ("contact_pairs=[[\"bore\"]]", "contact_pairs[0]"),
        ("contact_pairs=[[\"bore\", 7]]", "contact_pairs[0][1]"),
        ("unit_materials=[]", "unit_materials"),
        (
            "actuation={\"schedule\": [[0, 0], [0, 1]]}",
            "tractions[0].channel",
        ),
    ];
    for (assignment, path) in cases {
        let found = faults(&with(mesh_base(), &[assignment]));
        assert!(
            found.iter().any(|p| p == path),
            "{assignment}: expected {path}, found {found:?}"
        );
    }
}

#[test]
fn a_mesh_file_is_looked_up_from_the_scenes_folder() {
    let read = read_scene(&mesh_base(), Path::new("some/folder")).expect("sound");
    let Body::MeshFile(body) = read.body else {
        panic!("a mesh file")
    };
    assert_eq!(body.path, Path::new("some/folder/x.msh"));
}

#[test]
fn no_single_odd_value_is_more_than_a_fault() {
    for document in [base(), mesh_base()] {
        let (mut read, mut refused) = (0, 0);
        for_each_mutation(&document, &mut |odd| match read_scene(odd, Path::new("")) {
            Ok(scene) => {
                read += 1;
                assert_eq!(read_scene(&scene.document(), Path::new("")), Ok(scene));
            }
            Err(faults) => {
                refused += 1;
                assert!(!faults.0.is_empty());
            }
        });
        assert!(read > 10 && refused > 300, "{read} {refused}");
    }
}

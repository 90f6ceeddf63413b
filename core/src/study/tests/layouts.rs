//! Layouts beyond the stacked pair: their variables, rows, schedules and faults.

use serde_json::json;

use super::*;
use crate::scene::read_scene;

fn of_layout(layout: &str, assignments: &[&str]) -> Value {
    let assignment = format!("actuator.layout={layout}");
    with(
        &with(&example("asymmetric-bending"), &[&assignment]),
        assignments,
    )
}

#[test]
fn documents_read_back_and_tell_layouts_apart() {
    let mut prints = vec![study(&example("asymmetric-bending")).fingerprint()];
    for layout in ["side_by_side", "three_chambers"] {
        let first = study(&of_layout(layout, &[]));
        let document = first.document();
        assert_eq!(document["actuator"]["layout"], layout);
        assert_eq!(study(&document), first);
        assert!(!prints.contains(&first.fingerprint()));
        prints.push(first.fingerprint());
        let x = &first.restarts(0, &StepInputs::default()).expect("restarts")[2].x0;
        let scene = first.scene(0, x, None).expect("a scene");
        let read = read_scene(&scene.document(), std::path::Path::new("")).expect("sound");
        assert_eq!(read, scene);
    }
    assert_eq!(
        study(&of_layout("stacked_pair", &[])).fingerprint(),
        prints[0]
    );
}

#[test]
fn every_corner_has_its_rows_and_every_chamber_its_gap() {
    for (layout, chambers) in [("side_by_side", 2), ("three_chambers", 3)] {
        let gap = ["step[0].constraints.wall_gap_mm=0.2"];
        let study = study(&of_layout(layout, &gap));
        let variables = study.variables(0).expect("variables");
        assert_eq!(variables.lower.len(), 8 * chambers);
        assert_eq!(
            variables.names.last(),
            Some(&format!("y{}", 4 * chambers)),
            "{layout}"
        );
        // Of each corner: a spike, two walls to the outline, one to each other chamber, stretch at the rows and at the margin.
        let of_corner = 1 + 2 + (chambers - 1) + 2;
        let expected = 4 * chambers * of_corner + chambers;
        assert_eq!(study.constraint_count(0), Ok(expected));
        let names = study.constraint_names(0).expect("names");
        assert_eq!(names.len(), expected);
        let of = |text: &str| names.iter().filter(|n| n.contains(text)).count();
        assert_eq!(of("gap of facing walls"), chambers);
        assert_eq!(of("stretch: "), 2 * 4 * chambers);
        for restart in study.restarts(0, &StepInputs::default()).expect("restarts") {
            let (values, gradients) = study.geometry_rows(0, &restart.x0).expect("rows");
            assert_eq!(values.len(), 4 * chambers * (of_corner - 2));
            assert!(values.iter().all(|v| *v <= 0.0), "{layout}");
            assert!(gradients.iter().all(|row| row.len() == 8 * chambers));
        }
    }
}

#[test]
fn chambers_that_share_a_channel_have_its_pressure() {
    let study = study(&of_layout(
        "three_chambers",
        &["actuation.schedule=overlap"],
    ));
    let x = study.paper_start(0).expect("a start");
    let scene = study.scene(0, &x, None).expect("a scene");
    let p = 15.0;
    assert_eq!(
        scene.actuation.rows_kpa,
        [
            [0., 0., 0.],
            [p, 0., 0.],
            [p, p, p],
            [0., p, p],
            [0., 0., 0.]
        ]
    );
    // Nothing else of the schedule changes, and the document keeps the channels.
    let of_study = &study.body.as_ref().expect("chambers").actuation;
    assert_eq!(
        scene.actuation.load_steps_per_leg,
        of_study.load_steps_per_leg
    );
    assert_eq!(
        study.document()["actuation"]["schedule"][1],
        json!([15.0, 0.0])
    );
}

#[test]
fn a_channel_without_chambers_is_left_out() {
    let schedule = "actuation={\"schedule\": [[0, 0, 0], [9, 0, 4], [0, 0, 0]]}";
    for (layout, rows) in [
        ("stacked_pair", vec![9., 0.]),
        ("three_chambers", vec![9., 0., 0.]),
    ] {
        let study = study(&of_layout(layout, &[schedule]));
        let x = study.paper_start(0).expect("a start");
        let scene = study.scene(0, &x, None).expect("a scene");
        assert_eq!(scene.actuation.rows_kpa[1], rows);
    }
}

#[test]
fn rectangles_fill_every_domain() {
    let rectangle = ["step[0].variables.parametrisation=rectangle"];
    for (layout, largest) in [
        ("side_by_side", [37.0, 76.0]),
        ("three_chambers", [76.0, 24.0]),
    ] {
        let study = study(&of_layout(layout, &rectangle));
        let variables = study.variables(0).expect("variables");
        assert_eq!(variables.upper, largest);
        let (values, gradients) = study.geometry_rows(0, &largest).expect("rows");
        assert!(values.iter().all(|v| *v <= 1e-12));
        assert!(gradients.iter().all(|row| row.len() == 2));
    }
}

#[test]
fn units_may_be_free() {
    let mut document = example("direct");
    document["actuator"]["layout"] = json!("three_chambers");
    let one = study(&of_layout("three_chambers", &[]))
        .paper_start(0)
        .expect("a start");
    document["step"][0]["restarts"] = json!({"start": "given", "points": [one]});
    let direct = study(&document);
    let variables = direct.variables(0).expect("variables");
    assert_eq!(variables.lower.len(), 9 * 24);
    assert_eq!(variables.names[47], "unit2.y12");
    assert_eq!(
        direct
            .restarts(0, &StepInputs::default())
            .expect("restarts")[0]
            .x0,
        one.repeat(9)
    );
    document["step"][0]["restarts"]["points"] = json!([one[..16]]);
    let told = read_study(&document, true).expect_err("a fault").0;
    assert_eq!(told[0].path, "step[0].restarts.points[0]");
    assert!(told[0].message.contains("216 numbers, or 24 for all units"));
}

#[test]
fn faults_name_what_the_layout_needs() {
    for layout in ["side_by_side", "three_chambers"] {
        let faults = |assignments: &[&str]| faults(&of_layout(layout, assignments));
        assert_eq!(faults(&["actuation.schedule=ramp"]), ["actuation"]);
        // The tip in a domain, and walls that leave no room.
        let (point, wall) = match layout {
            "side_by_side" => ("[160, 40]", 27.0),
            _ => ("[160, 27]", 20.0),
        };
        assert!(faults(&[&format!("step[0].target.probe_mm={point}")]).is_empty());
        let [x, y] = if layout == "side_by_side" {
            [20, 40]
        } else {
            [40, 40]
        };
        let inside = format!("step[0].target.probe_mm=[{x}, {y}]");
        assert_eq!(faults(&[&inside]), ["step[0].target.probe_mm"]);
        assert_eq!(
            faults(&[&format!("actuator.wall_mm={wall}")]),
            ["actuator.wall_mm"]
        );
        let area = |channel| {
            format!(
                "step[0].target={{\"kind\": \"chamber_area\", \"channel\": {channel}, \"leg\": 0, \"sense\": \"maximise\"}}"
            )
        };
        let last = if layout == "side_by_side" { 1 } else { 2 };
        assert!(faults(&[&area(last)]).is_empty());
        assert_eq!(faults(&[&area(last + 1)]), ["step[0].target.channel"]);
    }
}

/// Hexagons have half as many variables again, and rows for each corner and each edge.
#[test]
fn six_corners_bring_their_variables_and_rows() {
    let corners = &["actuator.corners=6"];
    let mut prints = Vec::new();
    for (layout, chambers) in [
        ("stacked_pair", 2),
        ("side_by_side", 2),
        ("three_chambers", 3),
    ] {
        let study = study(&of_layout(layout, corners));
        assert_eq!(super::study(&study.document()), study);
        assert_eq!(study.document()["actuator"]["corners"], 6);
        prints.push(study.fingerprint());
        let variables = study.variables(0).expect("variables");
        assert_eq!(variables.lower.len(), 12 * chambers, "{layout}");
        let of_corner = 1 + 2 + (chambers - 1) + 1 + 2;
        assert_eq!(study.constraint_count(0), Ok(6 * chambers * of_corner));
        let names = study.constraint_names(0).expect("names");
        assert_eq!(names.len(), 6 * chambers * of_corner);
        let last = format!("stretch: chamber {chambers}, corner 6");
        assert!(names.contains(&last), "{names:?}");
        let edges = names
            .iter()
            .filter(|n| n.starts_with("edge round the centre"));
        assert_eq!(edges.count(), 6 * chambers);
        let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
        assert_eq!(
            restarts[0].x0[..6],
            study.paper_start(0).expect("a start")[..6]
        );
        for restart in restarts {
            let (values, gradients) = study.geometry_rows(0, &restart.x0).expect("rows");
            assert!(values.iter().all(|v| *v <= 0.0), "{layout} {values:?}");
            assert!(gradients.iter().all(|row| row.len() == 12 * chambers));
        }
    }
    let four = study(&of_layout("stacked_pair", &["actuator.corners=4"]));
    assert_eq!(four, study(&example("asymmetric-bending")));
    assert!(!prints.contains(&four.fingerprint()));
    assert_eq!(
        faults(&of_layout("stacked_pair", &["actuator.corners=5"])),
        ["actuator.corners"]
    );
    // A rectangle of six corners is the same scene but for two corners in line with their neighbours.
    let rectangle = [
        "actuator.corners=6",
        "step[0].variables.parametrisation=rectangle",
    ];
    let rectangle = study(&of_layout("stacked_pair", &rectangle));
    let x = [40.0, 15.0];
    let corners = rectangle.corners(0, &x).expect("corners");
    assert_eq!(corners[..6], [20.0, 13.0, 40.0, 13.0, 60.0, 13.0]);
    let (_, gradients) = rectangle.geometry_rows(0, &x).expect("rows");
    assert!(gradients.iter().all(|row| row.len() == 2));
}

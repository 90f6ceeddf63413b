//! Free units: their variables, starts, rows and faults.

use serde_json::json;

use super::*;
use crate::geometry::LayoutBoxes;

#[test]
fn each_unit_has_the_variables_of_one() {
    let study = study(&example("direct"));
    let v = study.variables(0).expect("variables");
    assert_eq!(v.lower.len(), 9 * 16);
    let [lower, upper] = LayoutBoxes::PAPER.bounds();
    for k in 0..9 {
        let unit = 16 * k..16 * (k + 1);
        assert_eq!(v.lower[unit.clone()], lower);
        assert_eq!(v.upper[unit], upper);
    }
    assert_eq!(
        [&v.names[0], &v.names[31], &v.names[143]],
        ["unit1.x1", "unit2.y8", "unit9.y8"]
    );
}

#[test]
fn a_start_of_one_unit_stands_for_all() {
    let one = LayoutBoxes::PAPER.rectangles([40.0, 15.0]);
    let given = |points: &[Vec<f64>]| {
        let mut document = example("direct");
        document["step"][0]["restarts"] =
            json!({"start": ["paper", "given", "random"], "points": points, "count": 2});
        document
    };
    let first = study(&given(&[one.clone(), one.repeat(9)]));
    // Two senses of each start.
    let restarts = first.restarts(0, &StepInputs::default()).expect("restarts");
    assert_eq!(restarts.len(), 10);
    assert_eq!(restarts[0].x0, LayoutBoxes::PAPER.common_start().repeat(9));
    assert_eq!(restarts[2].x0, one.repeat(9));
    assert_eq!(restarts[4].x0, restarts[2].x0);
    let [a, b] = [0, 1].map(|unit| &restarts[6].x0[16 * unit..16 * (unit + 1)]);
    assert_ne!(a, b);
    assert_eq!(study(&first.document()), first);
    let mut wrong = one.repeat(2);
    assert_eq!(
        faults(&given(&[wrong.clone()])),
        ["step[0].restarts.points[0]"]
    );
    wrong.truncate(16);
    wrong[3] = 39.0;
    assert_eq!(faults(&given(&[wrong])), ["step[0].restarts.points[0][3]"]);
}

#[test]
fn every_unit_has_its_geometric_rows() {
    let of_kind = |kind: &str| {
        let assignment = format!("step[0].model.kind={kind}");
        study(&with(&example("direct"), &[&assignment]))
    };
    let (direct, cascade) = (of_kind("fe_direct"), of_kind("fe_cascade"));
    let one = LayoutBoxes::PAPER.rectangles([60.0, 30.0]);
    let rows = |study: &Study, x: &[f64]| study.geometry_rows(0, x).expect("rows");
    let (of_one, of_all) = (rows(&cascade, &one), rows(&direct, &one.repeat(9)));
    assert_eq!(of_all.0.len(), 9 * of_one.0.len());
    assert!(of_all.1.iter().all(|row| row.len() == 144));
    // A thin wall in one unit is seen in that unit's variables alone.
    let mut x = one.repeat(9);
    x[16 * 4 + 1] = 2.5;
    let (values, gradients) = rows(&direct, &x);
    let worst = (0..values.len())
        .max_by(|a, b| values[*a].total_cmp(&values[*b]))
        .expect("a row");
    let seen: Vec<usize> = (0..144).filter(|k| gradients[worst][*k] != 0.0).collect();
    assert_eq!(seen, [16 * 4 + 1]);
    assert_ne!(direct.fingerprint(), cascade.fingerprint());
}

#[test]
fn free_units_have_no_rectangles_and_no_more_than_thirty() {
    let with = |assignments: &[&str]| faults(&with(&example("direct"), assignments));
    assert_eq!(
        with(&["step[0].variables.parametrisation=rectangle"]),
        ["step[0].variables.parametrisation"]
    );
    assert!(with(&["actuator.units=30"]).is_empty());
    assert_eq!(with(&["actuator.units=31"]), ["actuator.units"]);
    // Settings with a fault hide none of what the kind decides.
    let mut found = with(&[
        "step[0].model.element=hex",
        "step[0].restarts={\"start\": \"given\", \"points\": [[1, 2]]}",
    ]);
    found.sort();
    assert_eq!(
        found,
        ["step[0].model.element", "step[0].restarts.points[0]"]
    );
}

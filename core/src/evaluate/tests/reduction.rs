//! The reduced model against FE: its consistency, its fit, and that one actuation encloses nothing.

use std::path::Path;

use serde_json::{Value, json};

use super::named_scene;
use crate::equilibrium::Unobserved;
use crate::evaluate::reduction::{CHAINS, Source, reduction};
use crate::evaluate::rod::{CannotCalibrate, calibrate_rod, compare_rod, solve_schedules};
use crate::evaluate::{ChainStates, SceneStatus, solve_chain};
use crate::geometry::polygon::{distance, signed_area};
use crate::reduced::{LinearTransform, RodUnits, edge, frames};
use crate::scene::{Scene, read_scene};

/// `chambers-40x15` on a coarse mesh.
fn scene(schedule: &Value, tolerance: f64) -> Scene {
    let mut document = named_scene("chambers-40x15");
    document["mesh"] = json!({"element": "quad9", "max_size_mm": 20});
    document["actuation"] = json!({
        "schedule": schedule, "pressure_kpa": 15, "load_steps_per_leg": 4, "spacing": "graded"
    });
    if schedule.is_array() {
        let actuation = document["actuation"].as_object_mut().expect("an object");
        actuation.remove("pressure_kpa");
    }
    document["relative_residual_force_tolerance"] = json!(tolerance);
    read_scene(&document, Path::new("")).unwrap_or_else(|faults| panic!("{faults}"))
}

fn solved(scene: &Scene, units: usize) -> ChainStates {
    let chain = solve_chain(scene, units, false, &mut Unobserved).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(chain.end.status, SceneStatus::Ok);
    chain
}

/// Loading and unloading at the same states; the tolerance is so tight that the two ways are the same.
#[test]
fn one_actuation_encloses_nothing_and_two_do() {
    let share = |schedule: Value| {
        let chain = solved(&scene(&schedule, 1e-11), 3);
        let path = chain.tip_path(2);
        let largest = path
            .iter()
            .fold(0.0, |m: f64, p| m.max(distance(path[0], *p)));
        assert!(largest > 0.1, "{largest} mm");
        (signed_area(&path) / (largest * largest)).abs()
    };
    for one in [[15, 0], [0, 15]] {
        let share = share(json!([[0, 0], one, [0, 0]]));
        assert!(share < 1e-9, "{one:?}: {share:e}");
    }
    for two in ["hold", "swap", "overlap"] {
        let share = share(json!(two));
        assert!(share > 1e-3, "{two}: {share:e}");
    }
}

/// The transformations of a chain's own units, cascaded, have the mean of each edge exactly.
#[test]
fn a_cascade_of_a_chains_own_fits_is_the_chain() {
    let chain = solved(&scene(&json!("overlap"), 1e-8), 3);
    let fits = [1, 2, 3].map(|unit| chain.fit_unit(unit).unwrap());
    for (state, edges) in chain.edges_mm.iter().enumerate() {
        let own: Vec<LinearTransform> = (fits.iter())
            .map(|calibrated| calibrated.states[state].fit.transform)
            .collect();
        for (unit, frame) in frames(&own, chain.unit_mm).iter().enumerate() {
            let mean = [0, 1].map(|i| {
                let sum: f64 = edges[unit]
                    .iter()
                    .zip(edge::WEIGHTS)
                    .map(|(p, w)| w * p[i])
                    .sum();
                0.5 * sum
            });
            assert!(distance(frame.origin_mm, mean) < 1e-9);
        }
    }
}

#[test]
fn chains_are_foretold_from_one_unit_and_from_three() {
    let scene = scene(&json!("overlap"), 1e-8);
    let chains = CHAINS.map(|units| solved(&scene, units));
    let found = reduction(&chains).unwrap();
    assert_eq!(found.fits.len(), 4);
    for fit in &found.fits {
        let rest = &fit.calibrated.states[0].fit;
        let rest = (rest.transform).node_distance_mm(&LinearTransform::IDENTITY, [80.0; 2]);
        assert!(rest < 1e-12, "{rest:e}");
        // A free end bulges as much as it moves; an edge between two units does not.
        let (rms, moved) = (fit.rms_mm, fit.moved_mm);
        let free = fit.unit == fit.chain;
        assert!(
            rms <= fit.max_mm && (free || rms < 0.2 * moved),
            "{rms} of {moved} mm"
        );
        assert!(fit.calibrated.transform_at(&[15.0, 7.0]).is_ok());
        assert!(fit.calibrated.transform_at(&[15.1, 7.0]).is_err());
    }
    let error = |source, units, tip_unit| {
        let prediction = found
            .predictions
            .iter()
            .find(|p| p.source == source && p.units == units && p.tip_unit == tip_unit);
        let prediction = prediction.expect("a prediction");
        assert!(prediction.rms_error <= prediction.max_error);
        prediction.max_error
    };
    assert_eq!(found.predictions.len(), 9);
    // Units of a chain behave like the middle one, not like one alone with a free end.
    for tip_unit in [8, 9] {
        let of = |source| error(source, 9, tip_unit);
        assert!(
            of(Source::EachOfThree) < 0.05,
            "{}",
            of(Source::EachOfThree)
        );
        assert!(of(Source::MiddleOfThree) < of(Source::OneUnit));
    }
    assert_eq!(found.unit_differences.len(), 7);
    for difference in &found.unit_differences[1..6] {
        assert!(difference.relative < 0.12, "{difference:?}");
    }
    let exploration = found.exploration.expect("a design space");
    assert_eq!(exploration.largest[0].area_mm2, 0.0);
    assert!(exploration.largest[1].area_mm2 > 0.0);
    let map = exploration.map.expect("a map");
    assert_eq!((map.area_mm2.len(), map.area_mm2[0].len()), (31, 31));
    // What did not end well is left out.
    let mut broken = chains;
    broken[2].end.status = SceneStatus::NotConverged;
    let found = reduction(&broken).unwrap();
    assert_eq!(
        (found.predictions.len(), found.unit_differences.len()),
        (3, 0)
    );
}

#[test]
fn what_is_no_chain_of_equal_units_is_a_fault() {
    let scene = scene(&json!("hold"), 1e-8);
    let mut document = scene.document();
    document["contact"] = json!("auto");
    document["obstacles"] = json!([
        {"name": "post", "shape": "circle", "centre_mm": [100, -50], "radius_mm": 10}
    ]);
    let walled = read_scene(&document, Path::new("")).unwrap_or_else(|f| panic!("{f}"));
    let faults = solve_chain(&walled, 3, false, &mut Unobserved).unwrap_err();
    assert_eq!(faults.0[0].path, "obstacles");
    let mut other = scene;
    let crate::scene::Body::Actuator(body) = &mut other.body else {
        panic!("a chain")
    };
    body.actuator.units[2].chambers_mm[0][0][0] += 1.0;
    let faults = solve_chain(&other, 3, false, &mut Unobserved).unwrap_err();
    assert_eq!(faults.0[0].path, "actuator.units[2]");
    let faults = solve_chain(&other, 0, false, &mut Unobserved).unwrap_err();
    assert!(faults.0.iter().any(|fault| fault.path == "units"));
}

/// A rod of three units' own strains, calibrated over the plane, has the tips of three units under schedules that cross the
/// plane elsewhere; the first order of what it misses is that the tip is the middle of a bulged edge.
#[test]
fn a_rod_foretells_schedules_that_it_was_not_calibrated_on() {
    let scene = scene(&json!("hold"), 1e-8);
    let rod = calibrate_rod(&scene, 5, &mut Unobserved).expect("a rod");
    let chain = solve_schedules(&scene, 3, &mut Unobserved).expect("a chain");
    assert_eq!(chain.end.status, SceneStatus::Ok);
    // The means of the edges, by their own transformations: the rod interpolates them.
    let own: Vec<Vec<LinearTransform>> = (1..=3)
        .map(|unit| chain.fit_unit(unit).expect("fitted").transforms())
        .collect();
    let middle = |state: usize| {
        let units: Vec<LinearTransform> = own.iter().map(|unit| unit[state]).collect();
        frames(&units, chain.unit_mm)[3].origin_mm
    };
    let pressures: Vec<Vec<f64>> = (chain.points.iter())
        .map(|p| p.pressure_kpa.clone())
        .collect();
    let path = rod
        .path(3, 3, RodUnits::Each, &pressures)
        .expect("within the range");
    let largest = path
        .iter()
        .fold(0.0, |m: f64, p| m.max(distance(path[0], *p)));
    for (state, p) in path.iter().enumerate() {
        let apart = distance(*p, middle(state));
        assert!(apart < 0.02 * largest, "{state}: {apart} of {largest} mm");
    }
    let found = compare_rod(&rod, &chain).expect("within the range");
    assert_eq!(found.len(), 3 * 2 * 2);
    for one in &found {
        assert_eq!(one.fe_path_mm.len(), one.path_mm.len());
        assert!(distance(one.fe_path_mm[0], one.path_mm[0]) < 1e-9);
        assert!(one.fe_area_mm2 * one.area_mm2 > 0.0, "{one:?}");
    }
    // One channel alone knows no plane.
    let mut ramp = scene;
    ramp.actuation.rows_kpa = vec![vec![0.0], vec![15.0]];
    let refused = calibrate_rod(&ramp, 5, &mut Unobserved).unwrap_err();
    assert_eq!(refused, CannotCalibrate::Channels { found: 1 });
}

//! Starts: their number, order, seeds and senses.

use super::*;
use crate::scene::Orientation::{Clockwise, CounterClockwise};
use crate::study::spec::{LEAST_DISTANCE, StartKind};

const DRAWN: [&str; 3] = ["random", "latin_hypercube", "sobol"];

/// Starts of the asymmetric-bending study in one sense.
fn starts(assignments: &[&str]) -> (Study, Vec<RestartSpec>) {
    let document = with(
        &example("asymmetric-bending"),
        &["step[0].target.orientation=clockwise"],
    );
    let study = study(&with(&document, assignments));
    let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
    assert_eq!(restarts.len(), study.steps[0].restart_count());
    (study, restarts)
}

fn is_valid(study: &Study, x: &[f64]) -> bool {
    let values = study.geometry_values(0, x).expect("rows");
    values.iter().all(|v| *v <= 0.0)
}

#[test]
fn each_start_has_a_twin_of_the_other_sense() {
    let study = study(&example("asymmetric-bending"));
    let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
    assert_eq!(restarts.len(), 8);
    assert_eq!(study.steps[0].restart_count(), 8);
    for (i, restart) in restarts.iter().enumerate() {
        assert_eq!(restart.index, i);
        let sense = if i % 2 == 0 {
            CounterClockwise
        } else {
            Clockwise
        };
        assert_eq!(restart.orientation, Some(sense));
        assert_eq!(restart.x0, restarts[i - i % 2].x0);
        let kind = if i < 2 {
            StartKind::Paper
        } else {
            StartKind::Random
        };
        assert_eq!(restart.start_kind, Some(kind));
    }
    assert_ne!(restarts[2].x0, restarts[4].x0);
}

#[test]
fn seeds_reproduce_starts_and_more_starts_keep_the_first() {
    let document = example("asymmetric-bending");
    let restarts = |assignments: &[&str]| {
        study(&with(&document, assignments))
            .restarts(0, &StepInputs::default())
            .expect("restarts")
    };
    let first = restarts(&[]);
    assert_eq!(restarts(&[]), first);
    assert_eq!(restarts(&["step[0].restarts.count=7"])[..8], first);
    assert_ne!(restarts(&["step[0].restarts.seed=2"])[2].x0, first[2].x0);
}

#[test]
fn drawn_starts_lie_in_the_bounds_and_are_valid() {
    for kind in DRAWN {
        let start = format!("step[0].restarts.start={kind}");
        // The boxes allow sharper corners than this: about two draws in three are valid.
        let (study, starts) = starts(&[
            &start,
            "step[0].restarts.count=20",
            "step[0].constraints.spike_deg=30",
        ]);
        let v = study.variables(0).expect("variables");
        let mut refusals = 0;
        for start in &starts {
            let inside = |k: usize| (v.lower[k]..=v.upper[k]).contains(&start.x0[k]);
            assert!((0..16).all(inside), "{start:?}");
            assert!(is_valid(&study, &start.x0), "{start:?}");
            let drawn = start.drawn.expect("a start that was drawn");
            assert!(drawn.valid && !drawn.repaired, "{start:?}");
            refusals += drawn.refusals;
        }
        assert!(refusals > 0, "{kind}: {refusals}");
        assert_eq!(
            study.restarts(0, &StepInputs::default()).expect("again"),
            starts
        );
    }
}

#[test]
fn a_latin_hypercube_stays_one_where_points_are_refused() {
    let (study, starts) = starts(&[
        "step[0].restarts.start=latin_hypercube",
        "step[0].restarts.count=12",
        "step[0].constraints.spike_deg=30",
    ]);
    assert!(
        starts
            .iter()
            .any(|s| s.drawn.is_some_and(|d| d.refusals > 0))
    );
    let v = study.variables(0).expect("variables");
    for k in 0..16 {
        let share = |x: f64| (x - v.lower[k]) / (v.upper[k] - v.lower[k]);
        let mut strata: Vec<usize> = (starts.iter())
            .map(|start| (share(start.x0[k]) * 12.0 + 1e-9) as usize)
            .collect();
        strata.sort_unstable();
        assert_eq!(strata, (0..12).collect::<Vec<_>>(), "variable {k}");
    }
}

#[test]
fn where_every_draw_is_refused_starts_are_moved_into_validity() {
    for kind in DRAWN {
        let start = format!("step[0].restarts.start={kind}");
        let strict = [
            start.as_str(),
            "step[0].restarts.count=3",
            "step[0].constraints.wall_mm=13",
            "step[0].constraints.spike_deg=60",
        ];
        let (study, restarts) = starts(&strict);
        for restart in &restarts {
            // A Latin hypercube looks only where a point is refused, and finds more.
            let repaired = restart.drawn.is_some_and(|d| d.repaired);
            assert!(repaired || kind == "latin_hypercube", "{restart:?}");
            assert!(is_valid(&study, &restart.x0), "{restart:?}");
        }
        assert_ne!(restarts[0].x0, restarts[1].x0);
        // Nothing has walls of 30 mm between two chambers in a unit of 80 mm.
        let (_, restarts) = starts(&[strict[0], strict[1], "step[0].constraints.wall_mm=30"]);
        assert!(restarts.iter().all(|r| r.drawn.is_some_and(|d| !d.valid)));
    }
}

#[test]
fn starts_keep_their_distance_from_each_other() {
    let mut document = example("three-bar-truss");
    for (distance, least) in [(None, LEAST_DISTANCE), (Some(0.1), 0.1)] {
        document["step"][0]["restarts"] = serde_json::json!({
            "start": ["given", "random", "latin_hypercube", "sobol"], "points": [[1.0, 1.0]], "count": 8,
        });
        document["step"][0]["variables"] = serde_json::json!({"lower": [0, 0], "upper": [2, 2]});
        if let Some(distance) = distance {
            document["step"][0]["restarts"]["least_distance"] = distance.into();
        }
        let read = study(&document);
        assert_eq!(study(&read.document()), read);
        let starts = read.restarts(0, &StepInputs::default()).expect("restarts");
        assert_eq!(starts.len(), 25);
        let mut kinds: Vec<_> = starts.iter().map(|s| s.start_kind).collect();
        kinds.dedup();
        let expected = [
            StartKind::Given,
            StartKind::Random,
            StartKind::LatinHypercube,
            StartKind::Sobol,
        ];
        assert_eq!(kinds, expected.map(Some));
        for (k, a) in starts.iter().enumerate() {
            for b in &starts[..k] {
                let between = read.scaled_distance(0, &a.x0, &b.x0).expect("a step");
                assert!(between >= least, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn uniform_is_another_name_of_random() {
    let (uniform, starts_of) = starts(&["step[0].restarts.start=uniform"]);
    assert_eq!(uniform.steps[0].restarts.start, [StartKind::Random]);
    assert_eq!(starts_of, starts(&["step[0].restarts.start=random"]).1);
}

#[test]
fn more_dimensions_than_a_sequence_has_are_padded() {
    let document = with(
        &example("direct"),
        &[
            "actuator.units=30",
            "step[0].target.orientation=clockwise",
            "step[0].restarts={\"start\": \"sobol\", \"count\": 2}",
        ],
    );
    let study = study(&document);
    let starts = study.restarts(0, &StepInputs::default()).expect("restarts");
    assert_eq!(starts[0].x0.len(), 480);
    assert_ne!(starts[0].x0[..224], starts[0].x0[256..]);
}

#[test]
#[ignore = "prints the shares that the guide quotes"]
fn shares_of_valid_draws() {
    for (name, extra) in [
        ("asymmetric-bending", "name=as-it-is"),
        ("asymmetric-bending", "step[0].constraints.spike_deg=30"),
        ("asymmetric-bending", "step[0].constraints.wall_mm=5"),
        ("asymmetric-bending", "actuator.layout=side_by_side"),
        ("asymmetric-bending", "actuator.layout=three_chambers"),
        ("direct", "name=as-it-is"),
    ] {
        for kind in DRAWN {
            let start = format!("step[0].restarts={{\"start\": \"{kind}\", \"count\": 200}}");
            let document = with(
                &example(name),
                &["step[0].target.orientation=clockwise", &start, extra],
            );
            let clock = std::time::Instant::now();
            let starts = study(&document)
                .restarts(0, &StepInputs::default())
                .expect("restarts");
            let drawn: Vec<_> = starts.iter().filter_map(|s| s.drawn).collect();
            let refusals: usize = drawn.iter().map(|d| d.refusals).sum();
            println!(
                "{name} {extra} {kind}: {:.4} of draws valid, {} repaired, {} not valid, {:?}",
                200.0 / (200 + refusals) as f64,
                drawn.iter().filter(|d| d.repaired).count(),
                drawn.iter().filter(|d| !d.valid).count(),
                clock.elapsed(),
            );
        }
    }
}

#[test]
fn a_sweep_analyses_each_point_once() {
    let document = example("rectangles");
    for (orientation, sense) in [("either", None), ("clockwise", Some(Clockwise))] {
        let assignment = format!("step[0].target.orientation={orientation}");
        let study = study(&with(&document, &[&assignment]));
        let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
        assert_eq!((restarts.len(), study.steps[0].restart_count()), (1, 1));
        assert_eq!(restarts[0].start_kind, None);
        let (_, asks) = begin(&study, &restarts[0]).expect("begins");
        assert_eq!(asks.len(), 16 * 6);
        for ask in &asks {
            assert_eq!(ask.plan_base.as_ref(), Some(&ask.x));
            assert_eq!(ask.orientation, sense);
        }
    }
}

#[test]
fn the_best_of_a_sweep_says_its_sense() {
    let mut document = example("rectangles");
    document["step"][0]["optimiser"] =
        serde_json::json!({ "method": "sweep", "points": [[20, 10], [30, 20], [40, 20]] });
    let study = study(&document);
    let (state, asks) = begin(
        &study,
        &study.restarts(0, &StepInputs::default()).expect("restarts")[0],
    )
    .expect("begins");
    let rows = study.constraint_count(0).expect("rows");
    let outcomes = [2.0, -5.0, 3.0].map(|area: f64| Outcome {
        objective: Some(-area.abs()),
        constraints: vec![-1.0; rows],
        report: Some(EvaluationReport {
            enclosed_area_mm2: Some(area),
            ..EvaluationReport::default()
        }),
        ..Outcome::without_values(OutcomeStatus::Ok)
    });
    let best = step(&study, &state, &outcomes).expect("steps").best;
    let best = best.expect("a best point");
    assert_eq!((best.x, best.objective), (asks[1].x.clone(), -5.0));
    assert_eq!(best.orientation, Some(Clockwise));
}

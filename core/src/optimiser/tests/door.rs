//! What the door refuses, a sweep, and the options as a document holds them.

use super::cases::named;
use crate::optimiser::{
    CmaEsOptions, DescentOptions, GcmmaOptions, MmfdOptions, OptimiserOptions, Problem, SqpOptions,
    StartError, StopReason, SweepOptions, Told, start, step,
};

#[test]
fn a_sweep_keeps_the_best_feasible_point_and_tolerates_failures() {
    let case = named("three_bar_truss");
    let points = vec![
        vec![2.0, 2.0],
        vec![0.1, 0.1],
        vec![1.0, 0.5],
        vec![0.8, 0.45],
        vec![3.0, 1.0],
    ];
    let options = OptimiserOptions::Sweep(SweepOptions {
        points: points.clone(),
        ..SweepOptions::default()
    });
    let (state, asks) = start(options, case.problem(), case.x0.clone()).expect("a start");
    assert_eq!(
        asks.iter().map(|ask| ask.x.clone()).collect::<Vec<_>>(),
        points
    );
    let told: Vec<Told> = asks
        .iter()
        .enumerate()
        .map(|(k, ask)| {
            if k == 2 {
                Told::Failed
            } else {
                case.evaluate(&ask.x, false)
            }
        })
        .collect();
    let end = step(&state, &told);
    assert_eq!(
        end.done,
        Some(StopReason::SweepComplete {
            points: 5,
            failed: 1
        })
    );
    assert!(end.asks.is_empty());
    assert_eq!(
        end.state.best().map(|best| best.x.clone()),
        Some(vec![0.8, 0.45])
    );
    assert_eq!(end.state.analyses(), 5);
    assert_eq!(step(&end.state, &told).state, end.state);
}

#[test]
fn options_survive_their_document() {
    let methods: [OptimiserOptions; 5] = [
        MmfdOptions::default().into(),
        GcmmaOptions::default().into(),
        SqpOptions::default().into(),
        CmaEsOptions::default().into(),
        OptimiserOptions::Sweep(SweepOptions::default()),
    ];
    for options in methods {
        let text = serde_json::to_string(&options).expect("JSON");
        assert_eq!(
            serde_json::from_str::<OptimiserOptions>(&text).ok(),
            Some(options)
        );
    }
    assert!(serde_json::from_str::<OptimiserOptions>(r#"{"method": "annealing"}"#).is_err());
}

#[test]
fn bad_starts_are_refused_with_their_numbers() {
    let problem = Problem {
        lower: vec![0.0, 0.0],
        upper: vec![1.0, 1.0],
        inequalities: 0,
        equalities: 0,
    };
    let mmfd = || OptimiserOptions::Mmfd(MmfdOptions::default());
    let refused = |options, problem, x0| {
        start(options, problem, x0)
            .map(|_| ())
            .expect_err("a refusal")
    };
    assert_eq!(
        refused(mmfd(), problem.clone(), vec![0.5]),
        StartError::Length {
            what: "x0",
            expected: 2,
            found: 1
        }
    );
    let crossed = Problem {
        upper: vec![1.0, -1.0],
        ..problem.clone()
    };
    assert_eq!(
        refused(mmfd(), crossed, vec![0.5, 0.5]),
        StartError::Bounds {
            index: 1,
            lower: 0.0,
            upper: -1.0
        }
    );
    assert!(matches!(
        refused(mmfd(), problem.clone(), vec![0.5, f64::NAN]),
        StartError::NotFinite { .. }
    ));
    let none = Problem {
        lower: Vec::new(),
        upper: Vec::new(),
        ..problem.clone()
    };
    assert_eq!(refused(mmfd(), none, Vec::new()), StartError::NoVariables);
    let wrong = MmfdOptions {
        descent: DescentOptions {
            difference_step: -1.0,
            max_iterations: 0,
            ..MmfdOptions::default().descent
        },
        active_from: 0.1,
        ..MmfdOptions::default()
    };
    let StartError::Options(faults) =
        refused(OptimiserOptions::Mmfd(wrong), problem, vec![0.5, 0.5])
    else {
        panic!("faults of options")
    };
    assert_eq!(faults.0.len(), 3, "every fault at once: {faults}");
}

#[test]
fn a_start_outside_its_bounds_is_moved_inside_and_fixed_variables_stay() {
    let problem = Problem {
        lower: vec![0.0, 2.0],
        upper: vec![1.0, 2.0],
        inequalities: 0,
        equalities: 0,
    };
    let (_, asks) = start(
        OptimiserOptions::Mmfd(MmfdOptions::default()),
        problem,
        vec![5.0, -3.0],
    )
    .expect("a start");
    assert_eq!(asks[0].x, vec![1.0, 2.0]);
}

//! A failed evaluation is information at every position: it never ends a run, and none hangs or panics.

use super::{
    cases::{Case, named},
    run::{Run, run, run_through, variants},
};
use crate::optimiser::{
    GcmmaOptions, MmfdOptions, OptimiserOptions, Problem, SqpOptions, StopReason, Told, Values,
    start, step,
};

fn ends_well(case: &Case, run: &Run, place: &str) {
    let best = run.state.best().expect("a best point");
    let gap = (best.objective - case.f_star) / case.f_star.abs();
    assert!(
        !matches!(
            run.reason,
            StopReason::FailedStart { .. } | StopReason::NoGradient { .. }
        ),
        "{place}: {:?}",
        run.reason
    );
    assert!(
        gap < 0.03 && best.violation <= 0.003,
        "{place}: gap {gap:.1e}, {:?}",
        run.reason
    );
}

#[test]
fn one_failure_at_any_position_does_not_end_a_run() {
    for id in [
        "three_bar_truss",
        "welded_beam",
        "rosen_suzuki",
        "hs71",
        "svanberg_cantilever",
    ] {
        let case = named(id);
        for (variant, options) in variants().into_iter().enumerate() {
            let length = run(&case, options.clone(), case.x0.clone()).history.len();
            for position in 0..length {
                let spoilt = run_through(&case, options.clone(), case.x0.clone(), |k, told| {
                    if k == position { Told::Failed } else { told }
                });
                ends_well(
                    &case,
                    &spoilt,
                    &format!("{id}, variant {variant}, failure at {position} of {length}"),
                );
            }
        }
    }
}

#[test]
fn nonsense_counts_as_a_failure() {
    let case = named("three_bar_truss");
    let spoil: [fn(&mut Values); 5] = [
        |values| values.objective = f64::NAN,
        |values| values.constraints[2] = f64::INFINITY,
        |values| values.constraints.truncate(3),
        |values| values.gradient = Some(vec![f64::NAN, 0.0]),
        |values| values.constraint_gradients = Some(vec![vec![0.0]; 6]),
    ];
    for options in variants() {
        for (kind, spoil) in spoil.iter().enumerate() {
            let run = run_through(
                &case,
                options.clone(),
                case.x0.clone(),
                |k, told| match told {
                    Told::Values(mut values) if k % 5 == 4 => {
                        spoil(&mut values);
                        Told::Values(values)
                    }
                    told => told,
                },
            );
            ends_well(&case, &run, &format!("nonsense {kind}"));
        }
    }
}

#[test]
fn a_region_without_equilibrium_is_backed_away_from() {
    // The model fails for x1 < 0.8, short of the optimum at 0.7887: the run must end at the edge of what exists.
    let case = named("three_bar_truss");
    for options in variants() {
        let (mut state, mut asks) =
            start(options.clone(), case.problem(), case.x0.clone()).expect("a start");
        let mut count = 0;
        let reason = loop {
            let told: Vec<Told> = asks
                .iter()
                .map(|ask| {
                    if ask.x[0] < 0.8 {
                        Told::Failed
                    } else {
                        case.evaluate(&ask.x, ask.want_gradient)
                    }
                })
                .collect();
            count += told.len();
            let next = step(&state, &told);
            (state, asks) = (next.state, next.asks);
            if let Some(reason) = next.done {
                break reason;
            }
            assert!(count < 2000, "a run without end");
        };
        let best = state.best().expect("a best point");
        // Failures tell the asymptotes nothing about which variable caused them: they stop short of the corner.
        let most = match options {
            OptimiserOptions::Gcmma(_) => 2.85,
            _ => 2.75,
        };
        assert!(
            best.objective < most && best.violation <= 0.003,
            "{best:?}, {reason:?}"
        );
    }
}

#[test]
fn a_model_without_gradients_is_differenced() {
    let case = named("three_bar_truss");
    for options in variants() {
        let run = run_through(&case, options, case.x0.clone(), |_, told| match told {
            Told::Values(values) => Told::Values(Values {
                gradient: None,
                constraint_gradients: None,
                ..values
            }),
            Told::Failed => Told::Failed,
        });
        ends_well(&case, &run, "no gradients");
    }
}

#[test]
fn a_model_that_always_fails_ends_with_a_failed_start() {
    for options in variants() {
        let case = named("welded_beam");
        let run = run_through(&case, options, case.x0.clone(), |_, _| Told::Failed);
        assert!(
            matches!(run.reason, StopReason::FailedStart { .. }),
            "{:?}",
            run.reason
        );
        assert!(run.state.best().is_none() && run.history.len() < 10);
    }
}

#[test]
fn failures_of_most_points_still_end_with_a_reason() {
    for id in [
        "cantilever_5",
        "hs100",
        "pressure_vessel",
        "keane_10",
        "six_hump_camel",
        "rosenbrock_disk",
    ] {
        let case = named(id);
        for options in variants() {
            for modulus in [2, 3, 5] {
                let run = run_through(&case, options.clone(), case.x0.clone(), |k, told| {
                    if k > 0 && k % modulus != 0 {
                        Told::Failed
                    } else {
                        told
                    }
                });
                assert!(run.history.len() < 40_000, "{id}: {}", run.history.len());
            }
        }
    }
}

#[test]
fn hopeless_problems_end_with_their_reason() {
    hopeless_problems(&MmfdOptions::default().into());
    hopeless_problems(&GcmmaOptions::default().into());
    hopeless_problems(&SqpOptions::default().into());
}

fn hopeless_problems(options: &OptimiserOptions) {
    let problem = |inequalities| Problem {
        lower: vec![-1e6; 2],
        upper: vec![1e6; 2],
        inequalities,
        equalities: 0,
    };
    let run = |inequalities: usize, evaluate: &dyn Fn(&[f64]) -> Values| {
        let (mut state, mut asks) =
            start(options.clone(), problem(inequalities), vec![1.0, 2.0]).expect("a start");
        for _ in 0..5000 {
            let told: Vec<Told> = asks
                .iter()
                .map(|ask| Told::Values(evaluate(&ask.x)))
                .collect();
            let next = step(&state, &told);
            (state, asks) = (next.state, next.asks);
            if let Some(reason) = next.done {
                return reason;
            }
        }
        panic!("a run without end");
    };
    let constant = |f: f64, df: Vec<f64>, g: Vec<(f64, Vec<f64>)>| Values {
        objective: f,
        constraints: g.iter().map(|(g, _)| *g).collect(),
        gradient: Some(df),
        constraint_gradients: Some(g.into_iter().map(|(_, dg)| dg).collect()),
    };
    // x1 <= 0 and x1 >= 1 at once.
    let reason = run(2, &|x| {
        constant(
            x[0] + x[1],
            vec![1.0, 1.0],
            vec![(x[0], vec![1.0, 0.0]), (1.0 - x[0], vec![-1.0, 0.0])],
        )
    });
    assert!(
        matches!(reason, StopReason::NoFeasibleDesign { .. }),
        "{reason:?}"
    );
    // Constant everything.
    let reason = run(1, &|_| {
        constant(3.0, vec![0.0; 2], vec![(-1.0, vec![0.0; 2])])
    });
    assert!(
        matches!(reason, StopReason::KuhnTucker { .. }),
        "{reason:?}"
    );
    // A violated constraint without a gradient.
    let reason = run(1, &|x| {
        constant(x[0], vec![1.0, 0.0], vec![(1.0, vec![0.0; 2])])
    });
    assert!(
        matches!(reason, StopReason::NoFeasibleDesign { .. }),
        "{reason:?}"
    );
    // Falls for ever.
    let reason = run(0, &|x| {
        constant(
            -1e40 * x[0].abs(),
            vec![-1e40 * x[0].signum(), 0.0],
            Vec::new(),
        )
    });
    assert!(matches!(reason, StopReason::Unbounded { .. }), "{reason:?}");
    // A gradient that lies.
    let reason = run(0, &|x| {
        constant(
            x[0].powi(2) + x[1].powi(2),
            vec![-2.0 * x[0], -2.0 * x[1]],
            Vec::new(),
        )
    });
    assert!(
        !matches!(reason, StopReason::FailedStart { .. }),
        "{reason:?}"
    );
}

//! The optimiser's own time an iteration.

use std::time::{Duration, Instant};

use super::{cases::named, run::options};
use crate::optimiser::{
    CmaEsOptions, Curvature, GcmmaOptions, GradientSource, MmfdOptions, OptimiserOptions,
    SqpOptions, Told, start, step,
};

const RUNS: usize = 4;

#[test]
#[ignore = "a measurement: it needs an idle processor"]
fn two_hundred_variables_take_less_than_fifty_milliseconds_an_iteration() {
    let mmfd = |curvature| -> OptimiserOptions {
        MmfdOptions {
            curvature,
            ..options(GradientSource::Model)
        }
        .into()
    };
    for (id, label, options) in [
        ("cantilever_50", "mmfd", mmfd(Curvature::Unconstrained)),
        ("cantilever_100", "mmfd", mmfd(Curvature::Unconstrained)),
        (
            "cantilever_100",
            "mmfd with curvature",
            mmfd(Curvature::Always),
        ),
        ("cantilever_50", "gcmma", GcmmaOptions::default().into()),
        ("cantilever_100", "gcmma", GcmmaOptions::default().into()),
        ("cantilever_50", "sqp", SqpOptions::default().into()),
        ("cantilever_100", "sqp", SqpOptions::default().into()),
        ("cantilever_50", "cma_es", generations()),
        ("cantilever_100", "cma_es", generations()),
    ] {
        let case = named(id);
        // Runs are deterministic: the least time of each step over some runs is what it takes on a quiet machine.
        let mut least: Vec<Duration> = Vec::new();
        let mut iterations = 1;
        for _ in 0..RUNS {
            let (mut state, mut asks) =
                start(options.clone(), case.problem(), case.x0.clone()).expect("a start");
            for index in 0.. {
                let told: Vec<Told> = asks
                    .iter()
                    .map(|ask| case.evaluate(&ask.x, ask.want_gradient))
                    .collect();
                let clock = Instant::now();
                let next = step(&state, &told);
                let spent = clock.elapsed();
                match least.get_mut(index) {
                    Some(least) => *least = spent.min(*least),
                    None => least.push(spent),
                }
                (state, asks) = (next.state, next.asks);
                if next.done.is_some() {
                    break;
                }
            }
            iterations = state.iteration();
        }
        let spent: Duration = least.iter().sum();
        let each = spent / u32::try_from(iterations).expect("a small count");
        println!("{id} {label}: {iterations} iterations, {each:?} each");
        assert!(each < Duration::from_millis(50), "{id} {label}: {each:?}");
    }
}

/// Enough generations for the covariance to be anything.
fn generations() -> OptimiserOptions {
    CmaEsOptions {
        max_evaluations: Some(4000),
        ..CmaEsOptions::default()
    }
    .into()
}

//! The optimiser's own time an iteration.

use std::time::{Duration, Instant};

use super::{cases::named, run::options};
use crate::optimiser::{
    Curvature, GradientSource, MmfdOptions, OptimiserOptions, Told, start, step,
};

#[test]
fn two_hundred_variables_take_less_than_fifty_milliseconds_an_iteration() {
    for (id, curvature) in [
        ("cantilever_50", Curvature::Unconstrained),
        ("cantilever_100", Curvature::Unconstrained),
        ("cantilever_100", Curvature::Always),
    ] {
        let case = named(id);
        let options = MmfdOptions {
            curvature,
            ..options(GradientSource::Model)
        };
        let (mut state, mut asks) = start(
            OptimiserOptions::Mmfd(options),
            case.problem(),
            case.x0.clone(),
        )
        .expect("a start");
        let mut spent = Duration::ZERO;
        loop {
            let told: Vec<Told> = asks
                .iter()
                .map(|ask| case.evaluate(&ask.x, ask.want_gradient))
                .collect();
            let clock = Instant::now();
            let next = step(&state, &told);
            spent += clock.elapsed();
            (state, asks) = (next.state, next.asks);
            if next.done.is_some() {
                break;
            }
        }
        let each = spent / u32::try_from(state.iteration()).expect("a small count");
        println!(
            "{id} {curvature:?}: {} iterations, {each:?} each",
            state.iteration()
        );
        assert!(each < Duration::from_millis(50), "{id}: {each:?}");
    }
}

//! Methods that draw their points: what the geometry refuses is never analysed.

use super::cases::named;
use super::resume::reborn;
use super::without_gradients::{boxed, open, seeded, sphere, values};
use crate::optimiser::{
    AskKind, OptimiserOptions, OptimiserState, Problem, RandomSearchOptions, StopReason, Told,
    screen, step,
};

#[test]
fn a_refused_design_is_never_asked_for_and_its_edge_is_found() {
    // Valid: the sum below 1, from a start in the corner of what is valid.
    let refuses = |x: &[f64]| Some(x.iter().sum::<f64>() - 1.0).filter(|v| *v > 0.0);
    let objective = |x: &[f64]| x.iter().map(|x| (x - 2.0).powi(2)).sum::<f64>();
    let search = RandomSearchOptions {
        evaluations: 500,
        ..RandomSearchOptions::default()
    };
    for options in [
        OptimiserOptions::CmaEs(seeded(2)),
        OptimiserOptions::RandomSearch(search),
    ] {
        let (state, _) = open(options, boxed(3, 3.0), vec![-1.0; 3]);
        let mut now = screen(&state, refuses);
        while now.done.is_none() {
            assert!(now.asks.iter().all(|ask| refuses(&ask.x).is_none()));
            assert!(!now.asks.is_empty());
            let told: Vec<Told> = now
                .asks
                .iter()
                .map(|ask| values(objective(&ask.x)))
                .collect();
            now = screen(&step(&now.state, &told).state, refuses);
        }
        let best = now.state.best().expect("a best point");
        let most = if matches!(now.state, OptimiserState::CmaEs(_)) {
            0.01
        } else {
            2.0
        };
        // On the edge of what is valid: (1/3, 1/3, 1/3).
        assert!(best.objective < 25.0 / 3.0 + most, "{best:?}");
    }
}

#[test]
fn from_a_start_far_from_any_valid_geometry_no_analysis_is_spent_on_the_way() {
    let refuses = |x: &[f64]| Some(sphere(x).sqrt() - 0.5).filter(|v| *v > 0.0);
    let (state, asks) = open(seeded(1), boxed(8, 10.0), vec![9.0; 8]);
    assert_eq!(asks.len(), 11, "the start and ten points");
    let now = screen(&state, refuses);
    let valid = now
        .asks
        .iter()
        .filter(|ask| refuses(&ask.x).is_none())
        .count();
    assert!(
        valid == now.asks.len() - 1 && valid > 0,
        "all but the start"
    );
    // Where nothing is ever valid a generation is asked for all the same.
    let nowhere = screen(&state, |_| Some(f64::INFINITY));
    assert_eq!(nowhere.asks.len(), 11);
    assert_eq!(reborn(&nowhere.state), nowhere.state);
}

#[test]
fn a_random_search_asks_for_its_points_in_batches_and_keeps_the_best() {
    let case = named("three_bar_truss");
    let problem = Problem {
        upper: vec![5.0; 2],
        ..case.problem()
    };
    let options = |seed| {
        OptimiserOptions::RandomSearch(RandomSearchOptions {
            evaluations: 1000,
            batch: 300,
            seed,
            ..RandomSearchOptions::default()
        })
    };
    let (mut state, mut asks) = open(options(1), problem.clone(), case.x0.clone());
    assert_eq!(asks[0].x, case.x0);
    assert_eq!(
        (asks[0].kind, asks[1].kind),
        (AskKind::Initial, AskKind::Trial)
    );
    let (_, other) = open(options(1).seeded(7, 0), problem.clone(), case.x0.clone());
    let (_, another) = open(options(1).seeded(7, 1), problem.clone(), case.x0.clone());
    assert!(asks[1] != other[1] && other[1] != another[1], "runs differ");
    let (mut batches, mut mean) = (Vec::new(), 0.0);
    while state.done().is_none() {
        batches.push(asks.len());
        mean += asks.iter().map(|ask| ask.x[0]).sum::<f64>() / 1000.0;
        assert!(asks.iter().all(|ask| !ask.want_gradient));
        let told: Vec<Told> = asks
            .iter()
            .map(|ask| case.evaluate(&ask.x, false))
            .collect();
        let next = step(&state, &told);
        (state, asks) = (next.state, next.asks);
    }
    assert_eq!(batches, [300, 300, 300, 100]);
    assert!((mean - 2.5).abs() < 0.15, "{mean}");
    let complete = StopReason::SearchComplete {
        points: 1000,
        failed: 0,
    };
    assert_eq!(state.done(), Some(complete));
    let best = state.best().expect("a best point");
    let gap = (best.objective - case.f_star) / case.f_star;
    assert!(best.violation <= 0.003 && gap < 0.1, "{gap}");
}

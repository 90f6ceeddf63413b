//! CMA-ES and random search: published costs and invariances, the problems of `data`, resumption, failures, refusals.

use super::cases::{Case, named};
use super::resume::reborn;
use crate::optimiser::{
    Ask, AskKind, CmaEsOptions, OptimiserOptions, OptimiserState, Problem, RandomSearchOptions,
    StopReason, Told, Values, rebase, screen, start, step,
};
use crate::random::SplitMix64;

pub(super) fn values(objective: f64) -> Told {
    Told::Values(Values {
        objective,
        constraints: Vec::new(),
        gradient: None,
        constraint_gradients: None,
    })
}

/// Bounds alone.
pub(super) fn boxed(n: usize, reach: f64) -> Problem {
    Problem {
        lower: vec![-reach; n],
        upper: vec![reach; n],
        inequalities: 0,
        equalities: 0,
    }
}

/// Options under which a run goes on to the last digit.
fn endless(seed: u64, first_step: f64) -> CmaEsOptions {
    CmaEsOptions {
        seed,
        first_step,
        relative_tolerance: 0.0,
        absolute_tolerance: Some(0.0),
        step_tolerance: 0.0,
        ..CmaEsOptions::default()
    }
}

pub(super) fn open(
    options: impl Into<OptimiserOptions>,
    problem: Problem,
    x0: Vec<f64>,
) -> (OptimiserState, Vec<Ask>) {
    start(options.into(), problem, x0).expect("a start")
}

/// Evaluations to 1e-9 from (1, ..., 1), with a first step of 1 and without bounds, as the reference was run.
fn cost(f: impl Fn(&[f64]) -> f64, seed: u64) -> usize {
    // The unit of a variable without bounds is twice the start's size.
    let (mut state, mut asks) = open(endless(seed, 0.5), boxed(10, 1e30), vec![1.0; 10]);
    let mut cost = 0;
    loop {
        let mut told = Vec::new();
        for ask in &asks {
            cost += 1;
            let objective = f(&ask.x);
            if objective <= 1e-9 {
                return cost;
            }
            told.push(values(objective));
        }
        let next = step(&state, &told);
        assert_eq!(next.done, None);
        (state, asks) = (next.state, next.asks);
    }
}

fn median_cost(f: impl Fn(&[f64]) -> f64) -> f64 {
    let mut costs: Vec<usize> = (1..=11).map(|seed| cost(&f, seed)).collect();
    costs.sort_unstable();
    costs[5] as f64
}

pub(super) fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Condition 1e6.
fn ellipsoid(x: &[f64]) -> f64 {
    let axis = |i: usize| 1e6_f64.powf(i as f64 / (x.len() - 1) as f64);
    x.iter().enumerate().map(|(i, x)| axis(i) * x * x).sum()
}

#[test]
fn sphere_and_ellipsoid_cost_what_is_published_whatever_the_axes() {
    // pycma 4.5.0, medians of 21 runs: 1491 and 4156. The tutorial's order: some 100 n and 300 to 400 n.
    let (round, long) = (median_cost(sphere), median_cost(ellipsoid));
    // Every pair of axes turned by 0.7.
    let turned = median_cost(|x| {
        let mut x = x.to_vec();
        for i in 0..10 {
            for j in i + 1..10 {
                let (a, b) = (x[i], x[j]);
                let (s, c) = 0.7_f64.sin_cos();
                (x[i], x[j]) = (c * a - s * b, s * a + c * b);
            }
        }
        ellipsoid(&x)
    });
    println!("sphere {round}, ellipsoid {long}, turned {turned}");
    for (found, published) in [(round, 1491.0), (long, 4156.0)] {
        assert!(
            found < 1.5 * published && found > published / 1.5,
            "{found}"
        );
    }
    assert!((turned / long - 1.0).abs() < 0.2, "{turned} against {long}");
}

/// Every point asked for in 60 generations.
fn points(f: impl Fn(&[f64]) -> f64, reach: f64) -> Vec<Vec<f64>> {
    let (mut state, mut asks) = open(endless(3, 0.3), boxed(4, reach), vec![0.5 * reach; 4]);
    let mut points = Vec::new();
    for _ in 0..60 {
        points.extend(asks.iter().map(|ask| ask.x.clone()));
        let told: Vec<Told> = asks.iter().map(|ask| values(f(&ask.x))).collect();
        let next = step(&state, &told);
        (state, asks) = (next.state, next.asks);
    }
    points
}

#[test]
fn only_the_order_of_objectives_counts_and_no_unit_of_the_variables() {
    let f = |x: &[f64]| ellipsoid(x) + (3.0 * x[0]).sin() + 1.0;
    let plain = points(f, 4.0);
    assert_eq!(plain, points(|x| f(x).powi(3) - 7.0, 4.0));
    assert_eq!(plain, points(|x| f(x).ln(), 4.0));
    let halved = points(|x| f(&x.iter().map(|x| 2.0 * x).collect::<Vec<_>>()), 2.0);
    let doubled = halved.iter().map(|x| x.iter().map(|x| 2.0 * x).collect());
    assert_eq!(plain, doubled.collect::<Vec<Vec<f64>>>());
}

/// A run to its end: its state, why, and the evaluation at which it was within 1 % of the best known value.
fn run(
    case: &Case,
    options: CmaEsOptions,
    x0: Vec<f64>,
) -> (OptimiserState, StopReason, Option<usize>) {
    let problem = case.problem();
    let (mut state, mut asks) = open(options, problem.clone(), x0);
    let (mut cost, mut hit) = (0, None);
    loop {
        assert!(asks.iter().all(|ask| !ask.want_gradient));
        let told: Vec<Told> = asks
            .iter()
            .map(|ask| case.evaluate(&ask.x, false))
            .collect();
        for told in &told {
            cost += 1;
            if let Told::Values(values) = told
                && hit.is_none()
                && problem.violation(&values.constraints) <= 0.003
                && values.objective <= case.f_star + 0.01 * case.f_star.abs()
            {
                hit = Some(cost);
            }
        }
        let next = step(&state, &told);
        (state, asks) = (next.state, next.asks);
        if let Some(reason) = next.done {
            assert!(asks.is_empty());
            assert_eq!(state.analyses(), cost);
            return (state, reason, hit);
        }
    }
}

pub(super) fn seeded(seed: u64) -> CmaEsOptions {
    CmaEsOptions {
        seed,
        ..CmaEsOptions::default()
    }
}

#[test]
fn constrained_problems_are_reached_within_a_thousand_evaluations_a_variable() {
    // Evaluations to 1 %, the median of five runs.
    for (id, most) in [
        ("cantilever_5", 9500),
        ("hs100", 2500),
        ("hs113", 6500),
        ("hs71", 3500),
        ("pressure_vessel", 3800),
        ("rosen_suzuki", 1700),
        ("rosen_suzuki_noisy", 1700),
        ("rosenbrock_disk", 1600),
        ("speed_reducer", 1200),
        ("spring", 2900),
        ("svanberg_cantilever", 900),
        ("three_bar_truss", 700),
        ("welded_beam", 2200),
    ] {
        let case = named(id);
        let mut hits: Vec<usize> = (1..=5)
            .map(|seed| {
                let (state, reason, hit) = run(&case, seeded(seed), case.x0.clone());
                let best = state.best().expect("a best point");
                assert!(best.violation <= 0.003, "{id}, {seed}: {reason:?}");
                hit.unwrap_or(usize::MAX)
            })
            .collect();
        hits.sort_unstable();
        println!("{id:<20} to 1 %: {hits:?}");
        assert!(hits[2] <= most, "{id}: {hits:?}");
    }
}

#[test]
fn problems_with_many_optima_are_solved_by_the_best_of_a_few_restarts() {
    for (id, population, restarts) in [
        ("six_hump_camel", None, 1),
        ("keane_2", None, 20),
        ("rastrigin_plane_4", Some(20), 20),
        ("keane_10", Some(20), 20),
    ] {
        let case = named(id);
        let mut hits = 0;
        let mut cost = 0;
        for seed in 1..=restarts {
            let mut stream = SplitMix64::new(1000 + seed);
            let bounds = case.xl.iter().zip(&case.xu);
            let x0 = bounds.map(|(a, b)| a + (b - a) * stream.next_unit());
            let options = CmaEsOptions {
                population,
                ..seeded(seed)
            };
            let (state, _, hit) = run(&case, options, x0.collect());
            hits += usize::from(hit.is_some());
            cost += state.analyses();
        }
        println!("{id:<20} {hits} of {restarts} restarts, {cost} evaluations");
        assert!(hits > 0, "{id}");
    }
}

#[test]
fn doublings_begin_again_with_twice_the_population() {
    let case = named("rastrigin_plane_4");
    let options = CmaEsOptions {
        doublings: 2,
        max_evaluations: Some(100_000),
        ..seeded(1)
    };
    let (mut state, mut asks) = open(options, case.problem(), case.x0.clone());
    let mut sizes = vec![asks.len() - 1];
    while state.done().is_none() {
        let told: Vec<Told> = asks
            .iter()
            .map(|ask| case.evaluate(&ask.x, false))
            .collect();
        let next = step(&state, &told);
        (state, asks) = (next.state, next.asks);
        if !asks.is_empty() && sizes.last() != Some(&asks.len()) {
            sizes.push(asks.len());
        }
    }
    assert_eq!(sizes, [8, 16, 32]);
}

#[test]
fn killed_at_every_generation_a_run_goes_on_bit_by_bit() {
    let search = RandomSearchOptions {
        evaluations: 300,
        batch: 7,
        ..RandomSearchOptions::default()
    };
    let strategy = CmaEsOptions {
        max_evaluations: Some(1200),
        doublings: 1,
        relative_tolerance: 0.05,
        ..seeded(4)
    };
    for options in [
        OptimiserOptions::CmaEs(strategy),
        OptimiserOptions::RandomSearch(search),
    ] {
        for id in ["hs71", "three_bar_truss", "six_hump_camel"] {
            let case = named(id);
            let (mut kept, mut asks) = open(options.clone(), case.problem(), case.x0.clone());
            let mut killed = reborn(&kept);
            let mut steps = 0;
            while kept.done().is_none() {
                // Whole generations fail at times, and points within the others.
                let told: Vec<Told> = asks
                    .iter()
                    .enumerate()
                    .map(|(k, ask)| {
                        if steps % 11 == 5 || (steps + k) % 5 == 2 {
                            Told::Failed
                        } else {
                            case.evaluate(&ask.x, false)
                        }
                    })
                    .collect();
                // Some designs are refused by their geometry.
                let refuses = |x: &[f64]| (x[0].fract() > 0.7).then_some(x[0].fract());
                let next = screen(&step(&kept, &told).state, refuses);
                let again = screen(&reborn(&step(&killed, &told).state), refuses);
                assert_eq!(next, again, "{id}, step {steps}");
                assert_eq!(
                    screen(&next.state, refuses),
                    next,
                    "shown twice, drawn once"
                );
                (kept, asks) = (next.state, next.asks);
                killed = reborn(&again.state);
                assert_eq!(kept.done().is_none(), !asks.is_empty());
                steps += 1;
            }
            assert!(steps > 20, "{id}");
            assert_eq!(
                step(&kept, &[]).state,
                kept,
                "a finished run stays finished"
            );
            assert_eq!(rebase(&kept).state, kept);
        }
    }
}

#[test]
fn a_rebase_asks_for_the_best_point_again_and_forgets_its_values() {
    let case = named("rosen_suzuki");
    let (mut state, mut asks) = open(seeded(1), case.problem(), case.x0.clone());
    let mut shift = 0.0;
    while state.done().is_none() {
        if state.at_iteration_boundary() && state.iteration() == 30 && shift == 0.0 {
            shift = 0.5;
            let x = state.iterate().map(|point| point.x.clone());
            let next = rebase(&state);
            assert_eq!(next.asks.len(), 1);
            assert_eq!(next.asks[0].kind, AskKind::Replan);
            assert_eq!(Some(&next.asks[0].x), x.as_ref());
            assert!(next.state.best().is_none());
            (state, asks) = (next.state, next.asks);
        }
        let told = |ask: &Ask| match case.evaluate(&ask.x, false) {
            Told::Values(mut values) => {
                values.objective += shift;
                Told::Values(values)
            }
            Told::Failed => Told::Failed,
        };
        let next = step(&state, &asks.iter().map(told).collect::<Vec<_>>());
        (state, asks) = (next.state, next.asks);
    }
    let best = state.best().expect("a best point");
    assert!(
        shift > 0.0 && (best.objective - shift - 6.0).abs() < 0.06,
        "{best:?}"
    );
}

/// Runs with answers spoilt by position.
fn spoilt(case: &Case, options: CmaEsOptions, fails: impl Fn(usize) -> bool) -> OptimiserState {
    let (mut state, mut asks) = open(options, case.problem(), case.x0.clone());
    let mut position = 0;
    while state.done().is_none() {
        let told: Vec<Told> = asks
            .iter()
            .map(|ask| {
                position += 1;
                if fails(position - 1) {
                    Told::Failed
                } else {
                    case.evaluate(&ask.x, false)
                }
            })
            .collect();
        let next = step(&state, &told);
        (state, asks) = (next.state, next.asks);
        assert_eq!(state.done().is_none(), !asks.is_empty());
    }
    state
}

#[test]
fn failures_never_end_a_run_wrongly() {
    let case = named("three_bar_truss");
    let near = |state: &OptimiserState| {
        let best = state.best().expect("a best point");
        assert!(best.violation <= 0.003);
        (best.objective - case.f_star) / case.f_star
    };
    for position in 0..300 {
        let state = spoilt(&case, seeded(1), |k| k == position);
        assert!(near(&state) < 0.03, "{position}: {:?}", state.done());
    }
    // A third of all points, and the first twenty.
    assert!(near(&spoilt(&case, seeded(1), |k| k % 3 == 1)) < 0.01);
    assert!(near(&spoilt(&case, seeded(1), |k| k < 20)) < 0.01);
    // Nothing at all, and nothing from some point on.
    let attempts = match spoilt(&case, seeded(1), |_| true).done() {
        Some(StopReason::FailedStart { attempts }) => attempts,
        other => panic!("{other:?}"),
    };
    assert_eq!(attempts, 1 + 10 * 6);
    let blocked = spoilt(&case, seeded(1), |k| k > 50);
    assert_eq!(blocked.done(), Some(StopReason::Blocked { directions: 60 }));
    assert!(near(&blocked) < 0.5);
}

/// Runs on a function to the end.
fn until_it_ends(options: CmaEsOptions, told: impl Fn(&[f64], usize) -> Told) -> OptimiserState {
    let problem = Problem {
        inequalities: 1,
        ..boxed(4, 5.0)
    };
    let (mut state, mut asks) = open(options, problem, vec![3.0; 4]);
    let mut count = 0;
    while state.done().is_none() {
        let answers: Vec<Told> = asks
            .iter()
            .map(|ask| {
                count += 1;
                told(&ask.x, count)
            })
            .collect();
        let next = step(&state, &answers);
        (state, asks) = (reborn(&next.state), next.asks);
    }
    state
}

#[test]
fn a_run_that_stalls_ends_with_what_it_cost() {
    let values = |objective: f64, g: f64| {
        Told::Values(Values {
            objective,
            constraints: vec![g],
            gradient: None,
            constraint_gradients: None,
        })
    };
    // Differs from call to call by more than any tolerance, as a simulation does that is not reproducible.
    let noise = |count: usize| (0.618_033_988_75 * count as f64).fract();
    let noisy = |x: &[f64], count: usize| values(sphere(x) + 1.0 + noise(count), -1.0);
    let never = CmaEsOptions {
        stall_factor: 0.0,
        step_tolerance: 0.0,
        max_evaluations: Some(8000),
        ..seeded(3)
    };
    let guarded = CmaEsOptions {
        stall_factor: 3.0,
        ..never.clone()
    };
    let limit = StopReason::EvaluationLimit { evaluations: 8000 };
    assert_eq!(until_it_ends(never.clone(), noisy).done(), Some(limit));
    let stalled = until_it_ends(guarded.clone(), noisy);
    let Some(StopReason::Stall { cost, cost_to_best }) = stalled.done() else {
        panic!("{:?}", stalled.done());
    };
    assert_eq!(cost, stalled.analyses());
    assert!(
        cost + 8 > 3 * cost_to_best && cost < 6000,
        "{cost} {cost_to_best}"
    );
    // Nothing is feasible, and nothing says where it might be: no rule but the guard ends it before the limit.
    let nowhere = |_: &[f64], count: usize| values(1.0, 1.0 + noise(count));
    assert_eq!(until_it_ends(never, nowhere).done(), Some(limit));
    let lost = until_it_ends(guarded.clone(), nowhere);
    let Some(StopReason::NoFeasibleDesign {
        iterations,
        violation,
    }) = lost.done()
    else {
        panic!("{:?}", lost.done());
    };
    assert!(iterations > 120 && (1.0..1.01).contains(&violation));
    // A flat objective and one that always fails have rules of their own; a ridge that is followed is no stall.
    let flat = until_it_ends(guarded.clone(), |_, _| values(1.0, -1.0));
    assert!(matches!(flat.done(), Some(StopReason::Absolute { .. })));
    let fails = until_it_ends(guarded.clone(), |_, _| Told::Failed);
    assert!(matches!(
        fails.done(),
        Some(StopReason::FailedStart { attempts: 81 })
    ));
    let ridge = |x: &[f64], _: usize| {
        let across: f64 = x[1..].iter().map(|x| x * x).sum();
        values(x[0] + 10.0 * across.sqrt(), -1.0)
    };
    let ridge = until_it_ends(guarded, ridge);
    assert!(!matches!(ridge.done(), Some(StopReason::Stall { .. })));
    let best = ridge.best().expect("a best point").objective;
    assert!(best < -4.9, "{best} {:?}", ridge.done());
}

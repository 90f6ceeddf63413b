//! Exchange descent: what it asks for, what it finds, what it cannot find.

use std::collections::BTreeSet;

use super::resume::reborn;
use super::without_gradients::values;
use crate::optimiser::{
    Exchange, ExchangeOptions, OptimiserOptions, Problem, StartError, StopReason, Told, start, step,
};

/// `places` places with `letters` letters.
fn places(places: usize, letters: usize) -> Problem {
    Problem {
        lower: vec![0.0; places],
        upper: vec![letters as f64 - 1.0; places],
        inequalities: 0,
        equalities: 0,
    }
}

/// A search to its end.
struct Search {
    batches: Vec<Vec<Vec<usize>>>,
    best: Option<(Vec<usize>, f64)>,
    reason: StopReason,
    iterations: usize,
}

fn letters(x: &[f64]) -> Vec<usize> {
    x.iter().map(|x| *x as usize).collect()
}

/// Runs a search, which is killed before every batch; `f` has no value where a sequence fails.
fn search(
    options: ExchangeOptions,
    problem: Problem,
    f: impl Fn(&[usize]) -> Option<f64>,
) -> Search {
    let x0 = problem.lower.clone();
    let (mut state, mut asks) =
        start(OptimiserOptions::Exchange(options), problem, x0).expect("a start");
    let mut batches = Vec::new();
    while state.done().is_none() {
        assert!(!asks.is_empty() && asks.iter().all(|ask| !ask.want_gradient));
        let batch: Vec<Vec<usize>> = asks.iter().map(|ask| letters(&ask.x)).collect();
        let told: Vec<Told> = batch
            .iter()
            .map(|s| f(s).map_or(Told::Failed, values))
            .collect();
        batches.push(batch);
        let next = step(&reborn(&state), &told);
        (state, asks) = (next.state, next.asks);
    }
    assert!(asks.is_empty());
    assert_eq!(step(&state, &[]).state, state, "a finished run stays so");
    let asked: BTreeSet<&Vec<usize>> = batches.iter().flatten().collect();
    let count = batches.iter().map(Vec::len).sum::<usize>();
    assert_eq!(asked.len(), count, "a sequence is asked for once");
    assert_eq!(state.analyses(), count);
    Search {
        batches,
        best: state.best().map(|p| (letters(&p.x), p.objective)),
        reason: state.done().expect("an end"),
        iterations: state.iteration(),
    }
}

fn descent() -> ExchangeOptions {
    ExchangeOptions {
        enumerate_up_to: 0,
        ..ExchangeOptions::default()
    }
}

/// Each place has a best letter of its own.
fn separable(s: &[usize]) -> f64 {
    let of_place = |(k, letter): (usize, &usize)| ((k % 3).abs_diff(*letter) * (k + 1)) as f64;
    s.iter().enumerate().map(of_place).sum()
}

#[test]
fn few_sequences_are_all_evaluated() {
    let all = search(ExchangeOptions::default(), places(3, 4), |s| {
        Some(separable(s))
    });
    assert_eq!(all.batches.len(), 1);
    assert_eq!(all.batches[0].len(), 64);
    assert_eq!(all.best, Some((vec![0, 1, 2], 0.0)));
    let (points, failed) = (64, 0);
    assert_eq!(all.reason, StopReason::SearchComplete { points, failed });
    // One more place, and they are many.
    let many = search(ExchangeOptions::default(), places(4, 4), |s| {
        Some(separable(s))
    });
    assert_eq!(many.batches[0].len(), 4);
}

#[test]
fn a_sum_over_places_is_solved_from_the_best_uniform_sequence() {
    let found = search(descent(), places(9, 3), |s| Some(separable(s)));
    assert_eq!(found.best, Some((vec![0, 1, 2, 0, 1, 2, 0, 1, 2], 0.0)));
    let sizes: Vec<usize> = found.batches.iter().map(Vec::len).collect();
    assert_eq!(sizes[..2], [3, 9 * 2]);
    assert!(
        sizes.iter().sum::<usize>() < 200,
        "of 19683 sequences {sizes:?}"
    );
    assert!(matches!(found.reason, StopReason::NoBetterExchange { .. }));
    // The first uniform sequence is the best one here, and every move changes one place.
    assert_eq!(found.iterations, 6);
}

#[test]
fn a_swap_leads_on_where_no_exchange_does() {
    // Two 1 are wanted, as near to the end as may be.
    let f = |s: &[usize]| {
        let ones: usize = s.iter().sum();
        let at = |k: usize| (s.len() - 1 - k) * s[k];
        Some(10.0 * ones.abs_diff(2) as f64 + (0..s.len()).map(at).sum::<usize>() as f64)
    };
    // A single 1 counts at the first place alone, so exchanges lead to 1001 and no further: its first 1 has to change places.
    let hindered = |s: &[usize]| {
        let ones: usize = s.iter().sum();
        if ones == 1 && s[0] == 0 { None } else { f(s) }
    };
    let found = search(descent(), places(4, 2), hindered);
    assert_eq!(found.best, Some((vec![0, 0, 1, 1], 1.0)));
    let swapped = found.batches.iter().any(|batch| {
        batch
            .iter()
            .all(|s| s.iter().sum::<usize>() == 2 && s.len() == 4)
    });
    assert!(swapped, "{:?}", found.batches);
}

#[test]
fn a_sequence_without_values_is_not_taken_and_stops_nothing() {
    let found = search(descent(), places(5, 3), |s| {
        let uniform = s.iter().all(|letter| *letter == s[0]);
        (!uniform).then(|| separable(s))
    });
    assert_eq!(found.batches[0].len(), 3);
    assert_eq!(found.best, Some((vec![0, 1, 2, 0, 1], 0.0)));
    let nothing = search(descent(), places(5, 3), |_| None);
    let attempts = 3 + 5 * 2;
    assert_eq!(nothing.best, None);
    assert_eq!(nothing.reason, StopReason::FailedStart { attempts });
}

#[test]
fn limits_cut_a_batch_in_its_order() {
    let limited = |most: usize| {
        let options = ExchangeOptions {
            max_evaluations: Some(most),
            ..descent()
        };
        search(options, places(9, 3), |s| Some(separable(s)))
    };
    let whole = search(descent(), places(9, 3), |s| Some(separable(s)));
    let total: usize = whole.batches.iter().map(Vec::len).sum();
    for most in [1, 3, 10, 21, 30] {
        let found = limited(most);
        let evaluations = most;
        assert_eq!(found.reason, StopReason::EvaluationLimit { evaluations });
        let asked: Vec<_> = found.batches.concat();
        assert_eq!(asked, whole.batches.concat()[..most]);
    }
    assert_eq!(limited(total).reason, whole.reason);
    let options = ExchangeOptions {
        max_iterations: 2,
        ..descent()
    };
    let found = search(options, places(9, 3), |s| Some(separable(s)));
    assert_eq!(found.reason, StopReason::IterationLimit { iterations: 2 });
}

#[test]
fn equals_are_taken_in_the_order_of_the_batch() {
    let found = search(descent(), places(3, 3), |_| Some(1.0));
    assert_eq!(found.best, Some((vec![0, 0, 0], 1.0)));
    assert_eq!(found.iterations, 0);
    // A feasible sequence comes before a better one that is not.
    let problem = Problem {
        inequalities: 1,
        ..places(2, 2)
    };
    let options = OptimiserOptions::Exchange(ExchangeOptions::default());
    let (state, asks) = start(options, problem, vec![0.0; 2]).expect("a start");
    let told = asks.iter().map(|ask| {
        let ones = ask.x.iter().sum::<f64>();
        let Told::Values(mut told) = values(-ones) else {
            unreachable!("values are values")
        };
        told.constraints = vec![ones - 1.0];
        Told::Values(told)
    });
    let told: Vec<Told> = told.collect();
    let end = step(&state, &told).state;
    assert_eq!(end.best().expect("a best").x, [0.0, 1.0]);
}

#[test]
fn bounds_that_are_no_letters_are_refused() {
    for (lower, upper) in [([0.0, 1.0], [2.0, 2.0]), ([0.0, 0.0], [2.0, 3.0])] {
        let problem = Problem {
            lower: lower.to_vec(),
            upper: upper.to_vec(),
            ..places(2, 2)
        };
        let options = OptimiserOptions::Exchange(ExchangeOptions::default());
        let refused = start(options, problem, vec![0.0; 2]);
        assert_eq!(refused.map(|_| ()), Err(StartError::NoLetters));
    }
    let problem = Problem {
        upper: vec![0.5; 2],
        ..places(2, 2)
    };
    let refused = Exchange::start(ExchangeOptions::default(), problem);
    assert_eq!(refused, Err(StartError::NoLetters));
}

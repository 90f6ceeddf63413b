//! Guesses at the next points: exact, and met often enough to be worth a thought.

use super::{
    cases::named,
    run::{options, variants},
};
use crate::optimiser::{
    Ask, AskKind, GradientSource, OptimiserOptions, Told, speculate, start, step,
};

/// What became of the guesses of a run: of single points followed by one that was guessed, and of batches of differences.
#[derive(Debug, Default)]
struct Met {
    points: usize,
    points_guessed: usize,
    batches: usize,
    batches_guessed: usize,
    failures: usize,
    failures_guessed: usize,
}

fn follow(id: &str, options: &OptimiserOptions, x0: &[f64], every: usize, met: &mut Met) {
    let case = named(id);
    let (mut state, mut asks) = start(options.clone(), case.problem(), x0.to_vec()).unwrap();
    let has = |guesses: &[Ask], ask: &Ask| {
        guesses
            .iter()
            .any(|g| g.x == ask.x && g.want_gradient == ask.want_gradient)
    };
    let mut steps = 0;
    loop {
        let before = state.clone();
        let guesses = speculate(&state);
        assert_eq!(state, before);
        assert_eq!(guesses, speculate(&state), "{id}: a function of the state");
        for guess in &guesses {
            assert!(asks.iter().all(|ask| ask.x != guess.x), "{id}: it is out");
        }
        let fails = steps % every == every - 1;
        let told: Vec<Told> = asks
            .iter()
            .map(|ask| {
                if fails {
                    Told::Failed
                } else {
                    case.evaluate(&ask.x, ask.want_gradient)
                }
            })
            .collect();
        let next = step(&state, &told);
        if next.done.is_some() {
            return;
        }
        let followed = &next.asks;
        let fresh = followed.iter().all(|ask| asks.iter().all(|a| a.x != ask.x));
        let guessed = followed.iter().all(|ask| has(&guesses, ask));
        let searched = asks.len() == 1 && matches!(asks[0].kind, AskKind::Trial | AskKind::Return);
        if asks.len() == 1 && followed[0].kind == AskKind::Gradient && fresh {
            met.batches += 1;
            met.batches_guessed += usize::from(guessed);
        } else if searched && fails && followed.len() == 1 && fresh {
            met.failures += 1;
            met.failures_guessed += usize::from(guessed);
        } else if searched && followed.len() == 1 && fresh {
            met.points += 1;
            met.points_guessed += usize::from(guessed);
        }
        (state, asks) = (next.state, next.asks);
        steps += 1;
    }
}

const PROBLEMS: [&str; 4] = ["rosen_suzuki", "hs71", "welded_beam", "three_bar_truss"];

#[test]
fn what_follows_a_failure_is_always_guessed() {
    for options in variants() {
        let mut met = Met::default();
        for id in PROBLEMS {
            follow(id, &options, &named(id).x0, 3, &mut met);
        }
        assert!(met.failures > 5, "{met:?}");
        assert_eq!(met.failures, met.failures_guessed, "{options:?}");
    }
}

#[test]
fn differences_at_an_accepted_point_are_guessed() {
    let source = |options: &OptimiserOptions| match options {
        OptimiserOptions::Mmfd(o) => Some(o.descent.gradient),
        OptimiserOptions::Gcmma(o) => Some(o.descent.gradient),
        OptimiserOptions::Sqp(o) => Some(o.descent.gradient),
        _ => None,
    };
    let by_differences = |o: &OptimiserOptions| source(o) == Some(GradientSource::Differences);
    let methods: Vec<_> = variants().into_iter().filter(by_differences).collect();
    assert_eq!(methods.len(), 3);
    for options in methods {
        let mut met = Met::default();
        for id in PROBLEMS {
            follow(id, &options, &named(id).x0, usize::MAX, &mut met);
        }
        // The accepted point is not always the last one of a search.
        assert!(met.batches > 20, "{met:?}");
        assert!(10 * met.batches_guessed >= 7 * met.batches, "{met:?}");
    }
}

#[test]
fn steps_of_a_search_are_guessed_where_values_do_not_matter() {
    let mut met = Met::default();
    for id in PROBLEMS {
        let case = named(id);
        for (_, x0) in case.all_starts() {
            let search = options(GradientSource::Model).into();
            follow(id, &search, x0, usize::MAX, &mut met);
        }
    }
    assert!(met.points_guessed > 0, "{met:?}");
}

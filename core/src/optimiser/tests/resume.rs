//! A run that is killed at any phase and read back from JSON goes on with the same points, bit by bit.

use super::{cases::named, run::variants};
use crate::optimiser::{
    Ask, AskKind, OptimiserState, Point, StopReason, Told, rebase, start, step,
    step_on_another_mesh,
};

fn bits(asks: &[Ask]) -> Vec<(AskKind, bool, usize, Vec<u64>)> {
    let one = |ask: &Ask| {
        (
            ask.kind,
            ask.want_gradient,
            ask.iteration,
            ask.x.iter().map(|x| x.to_bits()).collect(),
        )
    };
    asks.iter().map(one).collect()
}

pub(super) fn reborn(state: &OptimiserState) -> OptimiserState {
    let text = serde_json::to_string(state).expect("a state that can be written");
    let read: OptimiserState = serde_json::from_str(&text).expect("a state that can be read");
    assert_eq!(&read, state);
    read
}

#[test]
fn killed_at_every_phase_a_run_goes_on_bit_by_bit() {
    for id in [
        "rosen_suzuki",
        "three_bar_truss",
        "hs71",
        "welded_beam",
        "spring",
    ] {
        let case = named(id);
        for options in variants() {
            // Points from an infeasible start too: its search has phases of its own.
            for x0 in std::iter::once(&case.x0).chain(case.starts.values()) {
                let open = || start(options.clone(), case.problem(), x0.clone()).expect("a start");
                let ((mut kept, mut asks), (mut killed, mut asks_again)) = (open(), open());
                let mut steps = 0;
                loop {
                    assert_eq!(bits(&asks), bits(&asks_again), "{id}, step {steps}");
                    killed = reborn(&killed);
                    assert_eq!(
                        bits(&killed.asks()),
                        bits(&asks),
                        "{id}: pending asks are part of the state"
                    );
                    // Every seventh point fails, so that the phases that follow failures are met as well.
                    let told: Vec<Told> = asks
                        .iter()
                        .enumerate()
                        .map(|(k, ask)| {
                            if (steps + k) % 7 == 5 {
                                Told::Failed
                            } else {
                                case.evaluate(&ask.x, ask.want_gradient)
                            }
                        })
                        .collect();
                    let (one, other) = (step(&kept, &told), step(&killed, &told));
                    assert_eq!(
                        one,
                        step(&kept, &told),
                        "{id}: a step is a function of state and answers"
                    );
                    assert_eq!(one.done, other.done, "{id}, step {steps}");
                    if one.done.is_some() {
                        assert_eq!(one.state, reborn(&other.state));
                        break;
                    }
                    (kept, asks) = (one.state, one.asks);
                    (killed, asks_again) = (other.state, other.asks);
                    steps += 1;
                }
                assert!(steps > 3, "{id}");
            }
        }
    }
}

#[test]
fn a_rebase_asks_for_the_iterate_again_and_no_stop_test_spans_it() {
    for options in variants() {
        let case = named("rosen_suzuki");
        let (mut state, mut asks) =
            start(options.clone(), case.problem(), case.x0.clone()).expect("a start");
        // The new plan's objective lies 0.5 higher and its constraints 0.01.
        let mut shift = 0.0;
        let mut rebased = 0;
        for _ in 0..3000 {
            if state.at_iteration_boundary()
                && state.iteration() == 2 * (rebased + 1)
                && rebased < 2
            {
                rebased += 1;
                shift += 0.5;
                let x = state.iterate().map(|point| point.x.clone());
                let next = rebase(&state);
                assert_eq!(next.asks.len(), 1);
                assert_eq!(next.asks[0].kind, AskKind::Replan);
                assert_eq!(Some(&next.asks[0].x), x.as_ref());
                assert!(
                    next.state.best().is_none(),
                    "old values say nothing under the new plan"
                );
                (state, asks) = (next.state, next.asks);
                continue;
            }
            let told: Vec<Told> = asks
                .iter()
                .map(|ask| match case.evaluate(&ask.x, ask.want_gradient) {
                    Told::Values(mut values) => {
                        values.objective += shift;
                        values
                            .constraints
                            .iter_mut()
                            .for_each(|g| *g += 0.02 * shift);
                        Told::Values(values)
                    }
                    Told::Failed => Told::Failed,
                })
                .collect();
            let next = step(&state, &told);
            (state, asks) = (next.state, next.asks);
            if next.done.is_some() {
                break;
            }
        }
        assert_eq!(rebased, 2);
        assert!(state.done().is_some());
        let best: &Point = state.best().expect("a best point");
        assert!(
            best.violation <= 0.003 && (best.objective - shift - 6.0).abs() < 0.1,
            "{best:?}"
        );
        assert_eq!(rebase(&state).state, state, "a finished run stays as it is");
    }
}

#[test]
fn a_small_change_that_leads_to_another_mesh_ends_no_run() {
    let case = named("rosen_suzuki");
    let mut ended_by_small_changes = 0;
    for options in variants() {
        let (mut state, mut asks) =
            start(options.clone(), case.problem(), case.x0.clone()).expect("a start");
        for _ in 0..3000 {
            let told: Vec<Told> = asks
                .iter()
                .map(|ask| case.evaluate(&ask.x, ask.want_gradient))
                .collect();
            let next = step(&state, &told);
            let moved = next.state.iterate().filter(|to| to.x == asks[0].x);
            if let (Some(StopReason::Absolute { .. } | StopReason::Relative { .. }), Some(to)) =
                (next.done, moved)
            {
                ended_by_small_changes += 1;
                let other = step_on_another_mesh(&state, &told);
                // First-order conditions at the iterate alone may still end it.
                assert!(
                    matches!(other.done, None | Some(StopReason::KuhnTucker { .. })),
                    "the change may be that of the mesh: {:?}",
                    other.done
                );
                assert_eq!(other.state.iterate(), Some(to));
                assert_eq!(other.state.best(), Some(to), "counted from here");
                assert_eq!(reborn(&other.state), other.state);
            }
            if next.done.is_some() {
                break;
            }
            (state, asks) = (next.state, next.asks);
        }
    }
    assert!(ended_by_small_changes > 2, "{ended_by_small_changes}");
}

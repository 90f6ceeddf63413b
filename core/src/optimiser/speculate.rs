//! What a run will probably ask next, while its one point is out: for workers that have nothing to do.
//!
//! Only points that follow from the state alone, to the bit: any other would be evaluated in vain. Three kinds:
//! - the differences at the point that is out, wanted if it becomes the iterate;
//! - what follows should it have no values;
//! - what follows from two made-up answers that differ in every value, where both lead to the same points: a step as long as
//!   the search allows, one shortened by a fixed part.

use super::{
    contract::{Ask, AskKind, Told, Values},
    point::Point,
    state::{OptimiserState, step},
};

/// Points that the run may ask for next, each once, the likely ones first. Of a run that waits for a batch none: what follows
/// depends on its values.
pub fn speculate(state: &OptimiserState) -> Vec<Ask> {
    let asks = state.asks();
    let [out] = &asks[..] else {
        return Vec::new();
    };
    let after = |told: Told| step(state, &[told]).asks;
    let method = state.method();
    let mut all = method.speculate();
    for [one, other] in method.alike() {
        let (one, other) = (after(one), after(other));
        if one == other {
            all.extend(one);
        }
    }
    if matches!(out.kind, AskKind::Trial | AskKind::Return) {
        all.extend(after(Told::Failed));
    }
    let mut guesses: Vec<Ask> = Vec::new();
    for ask in all {
        // Of the point itself only a gradient can follow, with the values that are being computed.
        if ask.x != out.x && guesses.iter().all(|guess| guess.x != ask.x) {
            guesses.push(ask);
        }
    }
    guesses
}

/// A made-up answer: the objective of a point changed by `change`, its violated constraints `violated` times as large, the
/// others less by `inside`.
pub(super) fn made_up(at: &Point, change: f64, violated: f64, inside: f64) -> Told {
    let constraint = |g: &f64| {
        if *g > 0.0 { violated * g } else { g - inside }
    };
    Told::Values(Values {
        objective: at.objective + change,
        constraints: at.constraints.iter().map(constraint).collect(),
        gradient: None,
        constraint_gradients: None,
    })
}

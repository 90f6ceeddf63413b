//! What a run is held to.

use super::{Method, OptimiserLine, methods::Against};
use crate::optimiser::GradientSource;
use crate::optimiser::published::{self, Case, Other};

/// Largest residual of first-order conditions on problems with many optima.
const CONDITIONS: f64 = 1e-3;
/// What a violation within the method's own tolerance may bring the objective, relatively.
const PRICE: f64 = 10.0;
/// A run costs at most this many times what it takes to within 0.1 % of its last value.
const LONGEST_TAIL: f64 = 3.0;

/// Says whether a run keeps to what its method is held to.
pub(super) fn judge(
    method: &Method,
    case: &Case,
    [tolerance, own_tolerance]: [f64; 2],
    line: &mut OptimiserLine,
) {
    let mut held_to = Vec::new();
    let mut why = Vec::new();
    let mut hold = |kept: bool, what: String| {
        if !kept {
            why.push(what.clone());
        }
        held_to.push(what);
    };
    hold(
        line.violation.is_some_and(|v| v <= tolerance),
        format!("violation <= {tolerance:.0e}"),
    );
    let by_values = method.against == Against::Values;
    if case.is_multimodal() && by_values {
        // One run may end at any of its optima.
    } else if case.is_multimodal() {
        hold(
            line.residual.is_some_and(|r| r <= CONDITIONS),
            format!("first-order conditions to {CONDITIONS:.0e}"),
        );
    } else {
        let most = method.largest_gap;
        hold(
            line.gap
                .is_some_and(|gap| gap <= most && gap >= -most.max(PRICE * own_tolerance)),
            format!("gap <= {:.1} %", 100.0 * most),
        );
        if !by_values {
            hold(line.tail <= LONGEST_TAIL, format!("tail <= {LONGEST_TAIL}"));
        }
        if line.start == "x0" {
            cost(method, case, line, &mut hold);
        }
    }
    line.passed = why.is_empty() || method.may_fail.contains(&&*case.id);
    line.held_to = held_to.join(", ");
    line.why = why;
}

fn cost(method: &Method, case: &Case, line: &OptimiserLine, hold: &mut dyn FnMut(bool, String)) {
    let others = published::others(&case.id, line.gradient);
    let target = |name: &str| -> Option<Vec<usize>> { others.get(name)?.to_target.clone() };
    match method.against {
        Against::Values => {}
        Against::WholeRun(name) => {
            let Some(Other { whole, .. }) = others.get(name) else {
                return;
            };
            let most = whole.iter().sum::<usize>() * 3 / 2 + 10;
            let took = match line.gradient {
                GradientSource::Model => line.analyses + line.gradients,
                GradientSource::Differences => line.analyses,
            };
            hold(took <= most, format!("cost {took} <= {most}"));
        }
        Against::Both(first, second) => {
            let Some(other) = target(first).or_else(|| target(second)) else {
                return;
            };
            let kept = line.to_target.is_some_and(|took| {
                took.iter()
                    .zip(&other)
                    .all(|(took, other)| *took <= 2 * other)
            });
            hold(kept, format!("twice {other:?} to 0.1 %"));
        }
        Against::Gradients(name) => {
            let Some(other) = target(name).and_then(|cost| cost.last().copied()) else {
                return;
            };
            let place = match line.gradient {
                GradientSource::Model => 1,
                GradientSource::Differences => 0,
            };
            let kept = line.to_target.is_some_and(|took| took[place] <= 2 * other);
            let what = match line.gradient {
                GradientSource::Model => "gradients",
                GradientSource::Differences => "analyses",
            };
            hold(kept, format!("{} {what} to 0.1 %", 2 * other));
        }
    }
}

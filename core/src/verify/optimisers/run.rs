//! One run, from a start to its end.

use super::{Method, OptimiserLine, TOLERANCES, rule};
use crate::analysis::profile_target;
use crate::optimiser::published::Case;
use crate::optimiser::{
    Ask, AskKind, GradientSource, OptimiserOptions, OptimiserState, Point, StopReason, Told,
    Values, conditions, start, step,
};

/// A run has reached a value within this part of it.
const REACHED: f64 = 1e-3;
/// A target is reached with at most this violation, if the method's own tolerance is not larger.
const LEAST_TOLERANCE: f64 = 1e-3;

/// What was asked, and objective and violation where there were values.
type Seen = (Ask, Option<(f64, f64)>);

pub(super) fn run(
    method: &Method,
    case: &Case,
    gradient: GradientSource,
    label: &str,
    x0: &[f64],
) -> OptimiserLine {
    let options = (method.options)(gradient, case.is_multimodal());
    let own_tolerance = options.violation_tolerance();
    let tolerance = own_tolerance.max(LEAST_TOLERANCE);
    let (state, stop, history) = drive(case, options, x0);
    let best = state.as_ref().and_then(OptimiserState::best);
    let mut line = OptimiserLine {
        method: method.name,
        problem: case.id.clone(),
        variables: case.n,
        start: label.to_owned(),
        gradient,
        objective: best.map(|best| best.objective),
        gap: best.map(|best| case.gap(best.objective)),
        violation: best.map(|best| best.violation),
        residual: best
            .filter(|_| case.is_multimodal())
            .and_then(|best| residual(case, best, gradient, x0)),
        iterations: state.as_ref().map_or(0, OptimiserState::iteration),
        analyses: state.as_ref().map_or(0, OptimiserState::analyses),
        gradients: state.as_ref().map_or(0, OptimiserState::gradients),
        to_target: to_target(case, &history, tolerance),
        to_share: TOLERANCES.map(|share| to_share(case, &history, x0, [share, tolerance])),
        tail: best.map_or(1.0, |best| tail(&history, best.objective, tolerance)),
        stop,
        held_to: String::new(),
        passed: false,
        why: Vec::new(),
    };
    rule::judge(method, case, [tolerance, own_tolerance], &mut line);
    line
}

fn drive(
    case: &Case,
    options: OptimiserOptions,
    x0: &[f64],
) -> (Option<OptimiserState>, StopReason, Vec<Seen>) {
    let problem = case.problem();
    let mut history = Vec::new();
    let Ok((mut state, mut asks)) = start(options, problem.clone(), x0.to_vec()) else {
        return (None, StopReason::FailedStart { attempts: 0 }, history);
    };
    loop {
        let mut answers = Vec::with_capacity(asks.len());
        for ask in asks {
            let told = case.evaluate(&ask.x, ask.want_gradient);
            let seen = match &told {
                Told::Values(values) => {
                    Some((values.objective, problem.violation(&values.constraints)))
                }
                Told::Failed => None,
            };
            history.push((ask, seen));
            answers.push(told);
        }
        let next = step(&state, &answers);
        state = next.state;
        asks = next.asks;
        if let Some(reason) = next.done {
            return (Some(state), reason, history);
        }
    }
}

/// Analyses and gradients until a design within the tolerance and 0.1 % of the optimum.
fn to_target(case: &Case, history: &[Seen], tolerance: f64) -> Option<[usize; 2]> {
    let (mut analyses, mut gradients) = (0, 0);
    for (ask, seen) in history {
        // The values at a point whose gradient is asked for are known.
        analyses += usize::from(ask.kind != AskKind::Gradient || !ask.want_gradient);
        gradients += usize::from(ask.want_gradient);
        if seen.is_some_and(|(f, violation)| violation <= tolerance && case.gap(f) <= REACHED) {
            return Some([analyses, gradients]);
        }
    }
    None
}

/// Analyses until a design within the tolerance of the constraints and a share of the distance between first and best
/// objective. A start outside the feasible region may be below the best: the distance counts then all the same.
fn to_share(
    case: &Case,
    history: &[Seen],
    x0: &[f64],
    [share, tolerance]: [f64; 2],
) -> Option<usize> {
    let first = values(case, x0)?.objective;
    let above = case.f_star + (first - case.f_star).abs();
    let target = profile_target(above, case.f_star, share);
    let mut analyses = 0;
    for (ask, seen) in history {
        analyses += usize::from(ask.kind != AskKind::Gradient || !ask.want_gradient);
        if seen.is_some_and(|(f, violation)| violation <= tolerance && f <= target) {
            return Some(analyses);
        }
    }
    None
}

/// Cost of the run over its cost to within 0.1 % of its last value.
fn tail(history: &[Seen], last: f64, tolerance: f64) -> f64 {
    let near = |(_, seen): &Seen| {
        seen.is_some_and(|(f, violation)| {
            violation <= tolerance && f <= last + REACHED * last.abs()
        })
    };
    let reached = history
        .iter()
        .position(near)
        .map_or(history.len(), |k| k + 1);
    history.len() as f64 / reached.max(1) as f64
}

/// What is left of first-order conditions at a point over the slope at the start, beyond what forward differences are off by.
fn residual(case: &Case, best: &Point, gradient: GradientSource, x0: &[f64]) -> Option<f64> {
    let values = values(case, &best.x)?;
    let found = conditions(&case.problem(), &best.x, &values, 3e-3)?;
    let slope = slope(case, values.gradient.as_ref()?);
    let first = slope_at(case, x0)?;
    let bias = match gradient {
        GradientSource::Model => 0.0,
        GradientSource::Differences => 2.0 * bias(case, &best.x, &values)?,
    };
    // A slope of one in each variable is one as well.
    let unit = self::slope(case, &vec![1.0; case.n]) / (case.n as f64).sqrt();
    Some((found.residual * slope - bias).max(0.0) / first.max(unit))
}

fn values(case: &Case, x: &[f64]) -> Option<Values> {
    match case.evaluate(x, true) {
        Told::Values(values) => Some(values),
        Told::Failed => None,
    }
}

fn slope_at(case: &Case, x: &[f64]) -> Option<f64> {
    Some(slope(case, values(case, x)?.gradient.as_ref()?))
}

/// Length of a gradient, variables in shares of their ranges.
fn slope(case: &Case, gradient: &[f64]) -> f64 {
    let bounds = case.xl.iter().zip(&case.xu);
    let scaled = gradient.iter().zip(bounds).map(|(g, (l, u))| g * (u - l));
    scaled.map(|g| g * g).sum::<f64>().sqrt()
}

/// Error of the gradient by forward differences with the methods' steps.
fn bias(case: &Case, x: &[f64], at: &Values) -> Option<f64> {
    let exact = at.gradient.as_ref()?;
    let mut errors = Vec::with_capacity(x.len());
    for i in 0..x.len() {
        let h = (1e-3 * x[i].abs()).max(1e-4);
        let mut there = x.to_vec();
        there[i] += h;
        errors.push((values(case, &there)?.objective - at.objective) / h - exact[i]);
    }
    Some(slope(case, &errors))
}

//! Runs an optimiser on a problem to its end.

use super::cases::Case;
use crate::optimiser::{
    Ask, Curvature, DescentOptions, GcmmaOptions, GradientSource, MmfdOptions, OptimiserOptions,
    OptimiserState, SqpOptions, StopReason, Told, start, step,
};

/// A run and what it asked for.
pub(super) struct Run {
    pub state: OptimiserState,
    pub reason: StopReason,
    /// Each answered ask with its objective and violation, none where it failed.
    pub history: Vec<(Ask, Option<(f64, f64)>)>,
}

pub(super) fn options(gradient: GradientSource) -> MmfdOptions {
    MmfdOptions {
        descent: DescentOptions {
            gradient,
            ..MmfdOptions::default().descent
        },
        ..MmfdOptions::default()
    }
}

/// Every method, in the forms that differ in their phases.
pub(super) fn variants() -> Vec<OptimiserOptions> {
    let asymptotes = |gradient, eager_gradients, globalise| GcmmaOptions {
        descent: DescentOptions {
            gradient,
            eager_gradients,
            ..GcmmaOptions::default().descent
        },
        globalise,
        ..GcmmaOptions::default()
    };
    let quadratic = |gradient, eager_gradients| SqpOptions {
        descent: DescentOptions {
            gradient,
            eager_gradients,
            ..SqpOptions::default().descent
        },
        ..SqpOptions::default()
    };
    vec![
        options(GradientSource::Model).into(),
        options(GradientSource::Differences).into(),
        MmfdOptions {
            descent: DescentOptions {
                eager_gradients: true,
                ..options(GradientSource::Model).descent
            },
            ..options(GradientSource::Model)
        }
        .into(),
        MmfdOptions {
            descent: DescentOptions {
                eager_gradients: true,
                ..options(GradientSource::Model).descent
            },
            curvature: Curvature::Always,
            ..options(GradientSource::Model)
        }
        .into(),
        asymptotes(GradientSource::Model, false, true).into(),
        asymptotes(GradientSource::Differences, false, true).into(),
        asymptotes(GradientSource::Model, true, true).into(),
        asymptotes(GradientSource::Model, true, false).into(),
        quadratic(GradientSource::Model, false).into(),
        quadratic(GradientSource::Differences, false).into(),
        quadratic(GradientSource::Model, true).into(),
    ]
}

/// Runs to the end; `told` stands between the problem and the optimiser and may spoil answers.
pub(super) fn run_through(
    case: &Case,
    options: impl Into<OptimiserOptions>,
    x0: Vec<f64>,
    mut told: impl FnMut(usize, Told) -> Told,
) -> Run {
    let problem = case.problem();
    let (mut state, mut asks) = start(options.into(), problem.clone(), x0).expect("a valid start");
    let mut history = Vec::new();
    loop {
        assert!(history.len() < 200_000, "{}: a run without end", case.id);
        let mut answers = Vec::new();
        for ask in asks {
            let answer = told(history.len(), case.evaluate(&ask.x, ask.want_gradient));
            let seen = match &answer {
                Told::Values(values) => {
                    Some((values.objective, problem.violation(&values.constraints)))
                }
                Told::Failed => None,
            };
            history.push((ask, seen));
            answers.push(answer);
        }
        let next = step(&state, &answers);
        state = next.state;
        asks = next.asks;
        if let Some(reason) = next.done {
            assert!(asks.is_empty(), "{}: a finished run asks", case.id);
            return Run {
                state,
                reason,
                history,
            };
        }
        assert!(
            !asks.is_empty(),
            "{}: a run that neither asks nor ends",
            case.id
        );
    }
}

pub(super) fn run(case: &Case, options: impl Into<OptimiserOptions>, x0: Vec<f64>) -> Run {
    run_through(case, options, x0, |_, told| told)
}

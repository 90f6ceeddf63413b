//! Values and slopes at the iterate, and how every method that follows gradients comes by them.
//!
//! Values at the start, or where these fail nearer to the middle of the bounds; then at each iterate gradients: with the
//! values where the model is eager, else asked for; where the model has none, nearer to the iterate before; else by a batch
//! of differences.

use serde::{Deserialize, Serialize};

use super::{
    contract::{Ask, AskKind, Told, Values},
    convergence::Convergence,
    descent::DescentOptions,
    differences::Differences,
    options::GradientSource,
    point::{Point, keep_best},
    problem::{NUDGES, Problem},
    rows::Gradient,
    stop::StopReason,
};

/// Points between the last two iterates tried where the model has values but no gradient.
const BACKOFFS: usize = 2;

/// What is waited for until the iterate has values and gradients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Pending {
    /// Values at the start, or again at the iterate under a new mesh plan.
    Start { attempt: usize, replan: bool },
    /// The model's gradient at the iterate, or (`backoff` > 0) values and gradient nearer to the last iterate.
    ModelGradient { backoff: usize },
    /// A batch of differences at the iterate.
    Differences(Differences),
}

impl Pending {
    /// The start of a run.
    pub fn start() -> Self {
        Self::Start {
            attempt: 0,
            replan: false,
        }
    }
}

/// What follows an answer.
pub(super) enum Next {
    /// More points are wanted.
    Ask(Pending),
    /// The iterate has values and gradients.
    Linearised,
    Over(StopReason),
}

/// The iterate with what is known there, and what the run has seen and cost so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Linearisation {
    pub problem: Problem,
    /// Design variables of the iterate.
    pub x: Vec<f64>,
    /// The iterate, once evaluated.
    pub iterate: Option<Point>,
    /// Gradients at the iterate.
    pub gradient: Option<Gradient>,
    /// The iterate before.
    pub previous: Option<Point>,
    pub best: Option<Point>,
    pub convergence: Convergence,
    /// Share of the first objective whose change counts as none, unless the options say how much does.
    absolute_share: f64,
    pub iteration: usize,
    /// The pending asks open an iteration.
    pub boundary: bool,
    pub analyses: usize,
    pub gradients: usize,
}

impl Linearisation {
    pub fn new(problem: Problem, x0: Vec<f64>, absolute_share: f64) -> Self {
        Self {
            problem,
            x: x0,
            iterate: None,
            gradient: None,
            previous: None,
            best: None,
            convergence: Convergence::new(0.0),
            absolute_share,
            iteration: 0,
            boundary: false,
            analyses: 0,
            gradients: 0,
        }
    }

    /// What the run has cost: analyses, and the model's gradients.
    pub fn cost(&self, options: &DescentOptions) -> usize {
        match options.gradient {
            GradientSource::Model => self.analyses + self.gradients,
            GradientSource::Differences => self.analyses,
        }
    }

    pub fn ask(&self, kind: AskKind, x: Vec<f64>, want_gradient: bool) -> Ask {
        Ask {
            kind,
            x,
            want_gradient,
            iteration: self.iteration,
        }
    }

    /// The points that are waited for.
    pub fn asks(&self, pending: &Pending, options: &DescentOptions) -> Vec<Ask> {
        match pending {
            Pending::Start { attempt, replan } => {
                let kind = if *replan {
                    AskKind::Replan
                } else {
                    AskKind::Initial
                };
                let x = self.problem.nudged(&self.x, *attempt);
                vec![self.ask(kind, x, options.eager())]
            }
            Pending::ModelGradient { backoff } => {
                vec![self.ask(AskKind::Gradient, self.backed_off(*backoff), true)]
            }
            Pending::Differences(differences) => differences
                .points(&self.x)
                .into_iter()
                .map(|x| self.ask(AskKind::Gradient, x, false))
                .collect(),
        }
    }

    /// A point between the iterate and the one before.
    fn backed_off(&self, backoff: usize) -> Vec<f64> {
        let fraction = 0.5_f64.powi(backoff as i32);
        match &self.previous {
            Some(previous) if backoff > 0 => previous
                .x
                .iter()
                .zip(&self.x)
                .map(|(from, to)| from + fraction * (to - from))
                .collect(),
            _ => self.x.clone(),
        }
    }

    /// Takes the answers to the pending asks.
    pub fn tell(&mut self, pending: Pending, options: &DescentOptions, told: &[Told]) -> Next {
        match pending {
            Pending::Start { attempt, replan } => self.told_start(attempt, replan, options, told),
            Pending::ModelGradient { backoff } => self.told_gradient(backoff, options, told),
            Pending::Differences(differences) => self.told_differences(differences, options, told),
        }
    }

    fn told_start(
        &mut self,
        attempt: usize,
        replan: bool,
        options: &DescentOptions,
        told: &[Told],
    ) -> Next {
        let x = self.problem.nudged(&self.x, attempt);
        let Some((point, gradient)) = self.told_point(x, options, told) else {
            let attempt = attempt + 1;
            return if attempt < NUDGES.len() {
                Next::Ask(Pending::Start { attempt, replan })
            } else {
                Next::Over(StopReason::FailedStart { attempts: attempt })
            };
        };
        if !replan {
            // Said once, at the start; large negative values of walls far apart do no harm.
            if point.constraints.iter().any(|g| *g > 10.0) {
                tracing::warn!(
                    "constraints beyond 10 in absolute value: normalise them to order one"
                );
            }
            self.convergence.absolute_tolerance = options
                .absolute_tolerance
                .unwrap_or_else(|| (self.absolute_share * point.objective.abs()).max(1e-20));
        }
        if attempt > 0 {
            self.previous = None;
        }
        if let (Some(old), Some(previous)) = (&self.iterate, &mut self.previous) {
            // The values before only guess at curvature: they move with the iterate's.
            let changes = point.constraints.iter().zip(&old.constraints);
            for (value, (new, old)) in previous.constraints.iter_mut().zip(changes) {
                *value += new - old;
            }
        }
        self.x.clone_from(&point.x);
        self.iterate = Some(point);
        self.gradient = gradient;
        self.open(options)
    }

    fn told_gradient(&mut self, backoff: usize, options: &DescentOptions, told: &[Told]) -> Next {
        if backoff > 0 {
            self.analyses += 1;
        }
        if let Some(values) = self.problem.usable(told.first())
            && let Some(gradient) = Gradient::of(&self.problem, values)
        {
            if backoff > 0 {
                let point = Point::new(&self.problem, self.backed_off(backoff), values);
                self.note(&point, options);
                self.x.clone_from(&point.x);
                self.iterate = Some(point);
            }
            self.gradient = Some(gradient);
            self.gradients += 1;
            Next::Linearised
        } else if self.previous.is_some() && backoff < BACKOFFS {
            Next::Ask(Pending::ModelGradient {
                backoff: backoff + 1,
            })
        } else {
            self.ask_differences(options)
        }
    }

    fn ask_differences(&self, options: &DescentOptions) -> Next {
        let differences = Differences::new(
            &self.problem,
            &self.x,
            options.difference_step,
            options.least_difference_step,
        );
        if differences.len() == 0 {
            Next::Over(StopReason::KuhnTucker { residual: 0.0 })
        } else {
            Next::Ask(Pending::Differences(differences))
        }
    }

    fn told_differences(
        &mut self,
        mut differences: Differences,
        options: &DescentOptions,
        told: &[Told],
    ) -> Next {
        // A batch is one purchase: its best point has cost the whole of it.
        self.analyses += differences.len();
        for (x, told) in differences.points(&self.x).into_iter().zip(told) {
            if let Some(values) = self.problem.usable(Some(told)) {
                let point = Point::new(&self.problem, x, values);
                self.note(&point, options);
            }
        }
        match &self.iterate {
            Some(at) if !differences.tell(&self.problem, at, told) => {
                Next::Ask(Pending::Differences(differences))
            }
            _ => {
                self.gradient = differences.gradient(self.problem.constraints());
                if self.gradient.is_none() {
                    return Next::Over(StopReason::NoGradient {
                        attempts: differences.attempts(),
                    });
                }
                self.gradients += 1;
                Next::Linearised
            }
        }
    }

    /// Takes the answer to one point; none where it failed.
    pub fn told_point(
        &mut self,
        x: Vec<f64>,
        options: &DescentOptions,
        told: &[Told],
    ) -> Option<(Point, Option<Gradient>)> {
        self.analyses += 1;
        let values: &Values = self.problem.usable(told.first())?;
        let gradient = Gradient::of(&self.problem, values);
        let point = Point::new(&self.problem, x, values);
        self.note(&point, options);
        self.gradients += usize::from(gradient.is_some());
        Some((point, gradient))
    }

    fn note(&mut self, point: &Point, options: &DescentOptions) {
        let tolerance = options.violation_tolerance;
        keep_best(&mut self.best, point, tolerance);
        let cost = self.cost(options);
        self.convergence
            .note(cost, self.iteration, self.best.as_ref(), tolerance);
    }

    /// Moves to a point; the iterate becomes the one before.
    pub fn move_to(&mut self, point: Point, gradient: Option<Gradient>, options: &DescentOptions) {
        if self.convergence.on_another_mesh {
            self.best = None;
            self.convergence.forget_values();
            self.note(&point, options);
        }
        self.x.clone_from(&point.x);
        self.previous = self.iterate.replace(point);
        self.gradient = gradient;
    }

    /// Opens an iteration at the iterate: its gradients, unless known.
    pub fn open(&mut self, options: &DescentOptions) -> Next {
        self.boundary = true;
        if self.gradient.is_some() {
            Next::Linearised
        } else if options.gradient == GradientSource::Model {
            Next::Ask(Pending::ModelGradient { backoff: 0 })
        } else {
            self.ask_differences(options)
        }
    }

    /// Forgets what rests on values that are no longer comparable, and asks for the iterate again.
    pub fn rebase(&mut self) -> Pending {
        self.boundary = false;
        self.gradient = None;
        self.best = None;
        self.convergence.forget_values();
        Pending::Start {
            attempt: 0,
            replan: self.iterate.is_some(),
        }
    }
}

//! Globally convergent method of moving asymptotes (GCMMA), and on request the method without globalisation (MMA).
//!
//! Iterate -> gradient -> convex separable approximations -> their minimum, a trial -> accepted, or tried again with more
//! conservative approximations -> next iterate, until a stop rule holds. Sources: K. Svanberg, The method of moving
//! asymptotes (Int. J. Numer. Meth. Eng. 24, 1987); A class of globally convergent optimization methods based on
//! conservative convex separable approximations (SIAM J. Optim. 12, 2002); MMA and GCMMA, two methods for nonlinear
//! optimization (note, 2007). Written from these papers.
//!
//! Choices where our evaluations are dear, each with what it is for (figures: docs/decisions):
//! - *Scaling* ([`model`]): objective and rows are divided by their steepest slope in every iteration.
//! - *First rho* ([`transitions`]): a row's approximation nearly meets the last iterate's value instead of starting from
//!   nothing, which saves most of the inner iterations.
//! - *Equalities* ([`model`]) are replaced by their tangents: two opposed convex rows would leave no room between them.
//! - *Acceptance*: a trial within the violation tolerance that brings a share of the expected gain is taken, conservative
//!   or not.
//! - *Failures* ([`asymptotes`]): a trial that fails is told to each variable as a reach half as long, which recovers with
//!   success.

mod asymptotes;
mod model;
mod newton;
mod options;
mod subproblem;
mod transitions;

use serde::{Deserialize, Serialize};

pub use self::options::GcmmaOptions;

use self::asymptotes::Asymptotes;
use super::{
    contract::{Ask, AskKind, Told},
    convergence::Convergence,
    differences::Differences,
    method::Method,
    options::GradientSource,
    point::Point,
    problem::Problem,
    rows::Gradient,
    stop::StopReason,
};

/// Points between the last two iterates tried where the model has values but no gradient.
const BACKOFFS: usize = 2;

/// What the run waits for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    /// Values at the start, or again at the iterate under a new mesh plan.
    Start { attempt: usize, replan: bool },
    /// The model's gradient at the iterate, or (`backoff` > 0) values and gradient nearer to the last iterate.
    ModelGradient { backoff: usize },
    /// A batch of differences at the iterate.
    Differences(Differences),
    /// The minimum of the approximations.
    Trial(Box<Trial>),
    /// Nothing.
    Done(StopReason),
}

/// A minimum of the approximations, to be evaluated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Trial {
    x: Vec<f64>,
    /// Curvature of each approximation: the objective's, then the rows'.
    rho: Vec<f64>,
    /// Trials before it at this iterate that were not conservative.
    rejected: usize,
    /// Trials before it at this iterate that failed, without a success in between.
    failed: usize,
}

/// A run of the method between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gcmma {
    options: GcmmaOptions,
    problem: Problem,
    phase: Phase,
    /// Design variables of the iterate.
    x: Vec<f64>,
    /// The iterate, once evaluated.
    iterate: Option<Point>,
    /// Gradients at the iterate.
    gradient: Option<Gradient>,
    /// The iterate before.
    previous: Option<Point>,
    best: Option<Point>,
    asymptotes: Asymptotes,
    convergence: Convergence,
    /// Multipliers of the rows.
    multipliers: Vec<f64>,
    iteration: usize,
    /// Consecutive iterations outside the feasible region.
    infeasible: usize,
    /// The pending asks open an iteration.
    boundary: bool,
    analyses: usize,
    gradients: usize,
}

impl Gcmma {
    pub(super) fn start(options: GcmmaOptions, problem: Problem, x0: Vec<f64>) -> Self {
        Self {
            asymptotes: Asymptotes::new(&problem, &x0, options.first_move),
            convergence: Convergence::new(options.absolute_tolerance.unwrap_or(0.0)),
            options,
            phase: Phase::Start {
                attempt: 0,
                replan: false,
            },
            x: x0,
            iterate: None,
            gradient: None,
            previous: None,
            best: None,
            multipliers: vec![0.0; super::rows::count(&problem)],
            problem,
            iteration: 0,
            infeasible: 0,
            boundary: false,
            analyses: 0,
            gradients: 0,
        }
    }

    fn eager(&self) -> bool {
        self.options.eager_gradients && self.options.gradient == GradientSource::Model
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
}

impl Method for Gcmma {
    fn asks(&self) -> Vec<Ask> {
        let ask = |kind, x, want_gradient| Ask {
            kind,
            x,
            want_gradient,
            iteration: self.iteration,
        };
        match &self.phase {
            Phase::Start { attempt, replan } => {
                let kind = if *replan {
                    AskKind::Replan
                } else {
                    AskKind::Initial
                };
                vec![ask(
                    kind,
                    self.problem.nudged(&self.x, *attempt),
                    self.eager(),
                )]
            }
            Phase::ModelGradient { backoff } => {
                vec![ask(AskKind::Gradient, self.backed_off(*backoff), true)]
            }
            Phase::Differences(differences) => differences
                .points(&self.x)
                .into_iter()
                .map(|x| ask(AskKind::Gradient, x, false))
                .collect(),
            Phase::Trial(trial) => vec![ask(AskKind::Trial, trial.x.clone(), self.eager())],
            Phase::Done(_) => Vec::new(),
        }
    }

    /// Takes the answers to the pending asks.
    fn tell(&mut self, told: &[Told]) {
        self.boundary = false;
        match self.phase.clone() {
            Phase::Start { attempt, replan } => self.told_start(attempt, replan, told),
            Phase::ModelGradient { backoff } => self.told_gradient(backoff, told),
            Phase::Differences(differences) => self.told_differences(differences, told),
            Phase::Trial(trial) => self.told_trial(*trial, told),
            Phase::Done(_) => {}
        }
    }

    /// Asks for the iterate again and forgets what its old values had taught. Asymptotes and reaches stay: they rest on
    /// where the iterates were. So do the values before, moved by as much as the iterate's will have changed: they only
    /// guess at the first rho.
    fn rebase(&mut self) {
        if self.done().is_none() {
            self.phase = Phase::Start {
                attempt: 0,
                replan: self.iterate.is_some(),
            };
            self.boundary = false;
            self.gradient = None;
            self.best = None;
            self.infeasible = 0;
            self.convergence.forget_values();
        }
    }

    fn done(&self) -> Option<StopReason> {
        match self.phase {
            Phase::Done(reason) => Some(reason),
            _ => None,
        }
    }

    fn iterate(&self) -> Option<&Point> {
        self.iterate.as_ref()
    }

    fn best(&self) -> Option<&Point> {
        self.best.as_ref()
    }

    fn iteration(&self) -> usize {
        self.iteration
    }

    fn at_iteration_boundary(&self) -> bool {
        self.boundary && self.done().is_none()
    }

    fn analyses(&self) -> usize {
        self.analyses
    }

    fn gradients(&self) -> usize {
        self.gradients
    }

    /// One per constraint; an equality's is the difference of its two rows'.
    fn multipliers(&self) -> Vec<f64> {
        let mut told = vec![0.0; self.problem.constraints()];
        for (row, multiplier) in self.multipliers.iter().enumerate() {
            let (index, sign) = super::rows::constraint(&self.problem, row);
            told[index] += sign * multiplier;
        }
        told
    }
}

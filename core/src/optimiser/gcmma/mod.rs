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
    descent::DescentOptions,
    linearisation::{Linearisation, Pending},
    method::Method,
    problem::Problem,
    stop::StopReason,
};

/// Share of the first objective whose change counts as none.
const ABSOLUTE_SHARE: f64 = 1e-8;

/// What the run waits for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    /// Values and gradients at the iterate.
    Linearise(Pending),
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
    phase: Phase,
    here: Linearisation,
    asymptotes: Asymptotes,
    /// Multipliers of the rows.
    multipliers: Vec<f64>,
    /// Consecutive iterations outside the feasible region.
    infeasible: usize,
}

impl Gcmma {
    pub(super) fn start(options: GcmmaOptions, problem: Problem, x0: Vec<f64>) -> Self {
        Self {
            asymptotes: Asymptotes::new(&problem, &x0, options.first_move),
            options,
            phase: Phase::Linearise(Pending::start()),
            multipliers: vec![0.0; super::rows::count(&problem)],
            here: Linearisation::new(problem, x0, ABSOLUTE_SHARE),
            infeasible: 0,
        }
    }
}

impl Method for Gcmma {
    fn asks(&self) -> Vec<Ask> {
        let common = &self.options.descent;
        match &self.phase {
            Phase::Linearise(pending) => self.here.asks(pending, common),
            Phase::Trial(trial) => {
                vec![
                    self.here
                        .ask(AskKind::Trial, trial.x.clone(), common.eager()),
                ]
            }
            Phase::Done(_) => Vec::new(),
        }
    }

    /// Takes the answers to the pending asks.
    fn tell(&mut self, told: &[Told]) {
        self.here.boundary = false;
        match self.phase.clone() {
            Phase::Linearise(pending) => {
                let next = self.here.tell(pending, &self.options.descent, told);
                self.follow(next);
            }
            Phase::Trial(trial) => self.told_trial(*trial, told),
            Phase::Done(_) => {}
        }
    }

    fn tell_of_another_mesh(&mut self, told: &[Told]) {
        self.here.convergence.on_another_mesh = true;
        self.tell(told);
        self.here.convergence.on_another_mesh = false;
    }

    /// Asks for the iterate again and forgets what its old values had taught. Asymptotes and reaches stay: they rest on
    /// where the iterates were. So do the values before, moved by as much as the iterate's will have changed: they only
    /// guess at the first rho.
    fn rebase(&mut self) {
        if self.done().is_none() {
            self.phase = Phase::Linearise(self.here.rebase());
            self.infeasible = 0;
        }
    }

    fn here(&self) -> Option<&Linearisation> {
        Some(&self.here)
    }

    fn descent(&self) -> Option<&DescentOptions> {
        Some(&self.options.descent)
    }

    fn done(&self) -> Option<StopReason> {
        match self.phase {
            Phase::Done(reason) => Some(reason),
            _ => None,
        }
    }

    fn multipliers(&self) -> Vec<f64> {
        super::rows::of_constraints(&self.here.problem, &self.multipliers)
    }
}

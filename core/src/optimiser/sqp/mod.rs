//! Sequential quadratic programming (SQP) with a damped quasi-Newton matrix.
//!
//! Iterate -> gradient -> quadratic subproblem -> line search on its step -> next iterate, until a stop rule holds.
//! Sources: M. J. D. Powell, A fast algorithm for nonlinearly constrained optimization calculations (1978); D. Kraft, A
//! software package for sequential quadratic programming (DFVLR-FB 88-28, 1988); J. Nocedal and S. J. Wright, Numerical
//! Optimization (2006), chapter 18. Written from these papers.
//!
//! Choices where our evaluations are dear, each with what it is for (figures: docs/decisions):
//! - *Scaling* ([`frame`]): steps in units of the variables' ranges; nothing depends on the objective's size.
//! - *First matrix* ([`transitions`]): of the size that the objective's slope and the first move call for.
//! - *Contradicting rows* ([`quadratic`]): a slack for each, so that the step violates them least.
//! - *Correction*: a full step that curved constraints refuse is tried once more with their values there.
//! - *Short steps* prove nothing: a small change counts towards the stop rules only after a full step, or none.
//! - *Failures*: a trial that fails is told to each variable as a reach half as long, and a new step is found within these;
//!   where steps fail however short, the variable that moves most is held for some iterations.
//! - *No step to be had* from an infeasible iterate: the violations alone are minimised until it is feasible.

mod closing;
mod frame;
mod hessian;
mod merit;
mod options;
mod quadratic;
mod transitions;

use serde::{Deserialize, Serialize};

pub use self::options::SqpOptions;

use self::{frame::Frame, hessian::Hessian, merit::Merit};
use super::{
    contract::{Ask, AskKind, Told},
    descent::DescentOptions,
    linearisation::{Linearisation, Pending},
    method::Method,
    problem::Problem,
    rows,
    speculate::made_up,
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
    /// A point of the line search.
    Trial(Box<Trial>),
    /// Nothing.
    Done(StopReason),
}

/// Which point of the line search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Place {
    /// Part of the step.
    OnStep,
    /// The full step corrected for the constraints' values there.
    Corrected,
    /// Beside a start at which the objective has no slope.
    Nudged,
}

/// A point of the line search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Trial {
    place: Place,
    x: Vec<f64>,
    /// The full step.
    step: Vec<f64>,
    /// The part of it that is tried, or that the correction belongs to.
    part: f64,
    /// Derivative of the merit along the step.
    slope: f64,
    /// Multipliers of the rows that came with the step.
    multipliers: Vec<f64>,
    /// The part to go on with if the correction is refused.
    next_part: f64,
    /// Trials before it at this iterate that were refused, and that failed.
    refused: usize,
    failed: usize,
}

/// What the step from the iterate before was made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Departure {
    x: Vec<f64>,
    /// Rows with their multipliers, and the gradient of the Lagrangian with these.
    multipliers: Vec<(usize, f64)>,
    lagrangian: Vec<f64>,
}

/// A run of the method between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sqp {
    options: SqpOptions,
    phase: Phase,
    here: Linearisation,
    frame: Frame,
    /// B; none until the first gradient is known, and after a search without success.
    hessian: Option<Hessian>,
    /// Whether B has learnt from a move.
    learnt: bool,
    merit: Merit,
    departure: Option<Departure>,
    /// Multipliers of the rows.
    multipliers: Vec<f64>,
    /// Largest step of each free variable, in its range.
    reach: Vec<f64>,
    /// Free variables that failed evaluations have stopped, each with the iteration at which it goes on.
    held: Vec<(usize, usize)>,
    /// Consecutive searches that failed evaluations have stopped.
    jams: usize,
    /// What is left of first-order conditions at the iterate.
    residual: f64,
    /// How often B was begun anew because small changes seemed due to it.
    renewals: usize,
    /// Consecutive searches without success.
    stuck: usize,
    /// Consecutive iterations outside the feasible region.
    infeasible: usize,
}

impl Sqp {
    pub(super) fn start(options: SqpOptions, problem: Problem, x0: Vec<f64>) -> Self {
        let frame = Frame::new(&problem, &x0);
        let rows = rows::count(&problem);
        Self {
            reach: vec![options.first_move; frame.len()],
            frame,
            options,
            phase: Phase::Linearise(Pending::start()),
            here: Linearisation::new(problem, x0, ABSOLUTE_SHARE),
            hessian: None,
            learnt: false,
            merit: Merit::new(rows),
            departure: None,
            multipliers: vec![0.0; rows],
            held: Vec::new(),
            jams: 0,
            residual: 0.0,
            renewals: 0,
            stuck: 0,
            infeasible: 0,
        }
    }
}

impl Method for Sqp {
    fn asks(&self) -> Vec<Ask> {
        let common = &self.options.descent;
        match &self.phase {
            Phase::Linearise(pending) => self.here.asks(pending, common),
            Phase::Trial(trial) => {
                let kind = match trial.place {
                    Place::Corrected => AskKind::Return,
                    Place::OnStep | Place::Nudged => AskKind::Trial,
                };
                vec![self.here.ask(kind, trial.x.clone(), common.eager())]
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

    /// Asks for the iterate again and forgets what its old values had taught. B, penalties and reaches stay: they are
    /// guesses at the next step, which no conclusion rests on.
    fn rebase(&mut self) {
        if self.done().is_none() {
            self.phase = Phase::Linearise(self.here.rebase());
            self.departure = None;
            self.stuck = 0;
            self.infeasible = 0;
        }
    }

    fn here(&self) -> Option<&Linearisation> {
        Some(&self.here)
    }

    fn descent(&self) -> Option<&DescentOptions> {
        Some(&self.options.descent)
    }

    /// Answers that refuse a corrected step: the shorter one that follows was found before it.
    fn alike(&self) -> Vec<[Told; 2]> {
        match (&self.phase, &self.here.iterate) {
            (Phase::Trial(trial), Some(iterate)) if trial.place == Place::Corrected => {
                let refused = |times: f64| {
                    made_up(
                        iterate,
                        times * trial.slope.abs(),
                        1.0 + 0.1 * times,
                        0.01 * times,
                    )
                };
                vec![[refused(1.0), refused(2.0)]]
            }
            _ => Vec::new(),
        }
    }

    fn done(&self) -> Option<StopReason> {
        match self.phase {
            Phase::Done(reason) => Some(reason),
            _ => None,
        }
    }

    fn multipliers(&self) -> Vec<f64> {
        rows::of_constraints(&self.here.problem, &self.multipliers)
    }
}

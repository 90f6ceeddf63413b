//! Modified method of feasible directions (MMFD), the method 1 of the optimiser DOT that the paper uses.
//!
//! Start -> gradient -> direction -> one-dimensional search with return to the boundary -> next gradient, until a stop
//! rule holds. Sources: Vanderplaats, Numerical Optimization Techniques for Engineering Design; the user's manuals of
//! CONMIN (NASA TM X-62,282) and ADS (NASA CR-177985); DOT's published parameters and defaults. DOT is closed: the rules,
//! the defaults and the stop reasons are its own, the numbers between them cannot be.
//!
//! Choices where the sources are silent, each with what it is for:
//! - *Complementarity*: a multiplier on a row that is not at its boundary shrinks CT instead of ending the run.
//! - *Return to the boundary* ([`boundary`]): paid for once a search; until then trials are compared by the Lagrangian,
//!   which is the objective after a return to first order ([`search`]).
//! - *Curvature* ([`metric`]): where no constraint is active the direction is that of BFGS (DOT's own method without
//!   constraints) rather than the conjugate one, on request everywhere.
//! - *Scales* keep a tenth of the largest that each variable had, else a variable on its way through zero sticks there.
//! - *Opposed rows*: of an equality's two sides only the violated one enters the direction, which is what keeps the
//!   subproblem solvable.
//! - *Failures*: a trial that fails shortens the step; where steps fail however short, the variable that moves most is
//!   held for some iterations; a missing gradient is looked for nearer to the last iterate, then by differences.

mod boundary;
mod direction;
mod interpolation;
mod memory;
mod metric;
mod search;
mod transitions;

use serde::{Deserialize, Serialize};

use self::{
    direction::Conjugacy,
    memory::Memory,
    metric::Moves,
    search::{Pending, Search, Setting},
};
use super::{
    contract::{Ask, AskKind, Told},
    differences::Differences,
    method::Method,
    options::{Curvature, GradientSource, MmfdOptions},
    point::Point,
    problem::Problem,
    rows::{self, Gradient},
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
    /// A point of the one-dimensional search.
    Search(Box<Search>),
    /// Nothing.
    Done(StopReason),
}

/// What is kept of the iterate before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Previous {
    x: Vec<f64>,
    /// Rows that the direction from there was tangent to, with their multipliers.
    tangent: Vec<(usize, f64)>,
    /// Gradient of the Lagrangian with these multipliers.
    lagrangian: Vec<f64>,
}

/// A run of the method between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mmfd {
    options: MmfdOptions,
    problem: Problem,
    phase: Phase,
    /// Design variables of the iterate.
    x: Vec<f64>,
    /// The iterate, once evaluated.
    iterate: Option<Point>,
    /// Gradients at the iterate.
    gradient: Option<Gradient>,
    /// The iterate before.
    previous: Option<Previous>,
    best: Option<Point>,
    memory: Memory,
    multipliers: Vec<f64>,
    iteration: usize,
    /// The pending asks open an iteration.
    boundary: bool,
    analyses: usize,
    gradients: usize,
}

impl Mmfd {
    pub(super) fn start(options: MmfdOptions, problem: Problem, x0: Vec<f64>) -> Self {
        Self {
            memory: Memory::new(&options, x0.len()),
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
            multipliers: vec![0.0; problem.constraints()],
            problem,
            iteration: 0,
            boundary: false,
            analyses: 0,
            gradients: 0,
        }
    }

    fn eager(&self) -> bool {
        self.options.eager_gradients && self.options.gradient == GradientSource::Model
    }

    /// The moves that make the metric at a point, if they may.
    fn moves(&self, at: &Point) -> Option<&Moves> {
        let free = || {
            rows::values(&self.problem, &at.constraints)
                .iter()
                .all(|&g| g < self.memory.ct)
        };
        let allowed = match self.options.curvature {
            Curvature::Always => true,
            Curvature::Unconstrained => free(),
            Curvature::Never => false,
        };
        allowed.then_some(&self.memory.moves)
    }

    fn setting(&self) -> Option<Setting<'_>> {
        let origin = self.iterate.as_ref()?;
        Some(Setting {
            problem: &self.problem,
            origin,
            gradient: self.gradient.as_ref()?,
            moves: self.moves(origin),
            scale: &self.memory.scale,
            ctmin: self.options.violation_tolerance,
            small_change: (self.options.relative_tolerance * origin.objective.abs())
                .max(self.memory.convergence.absolute_tolerance),
        })
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

impl Method for Mmfd {
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
            Phase::Search(search) => {
                let kind = match search.pending {
                    Pending::Trial { .. } => AskKind::Trial,
                    Pending::Return { .. } => AskKind::Return,
                };
                let x = self
                    .setting()
                    .map_or_else(|| self.x.clone(), |setting| search.x(&setting));
                vec![ask(kind, x, self.eager())]
            }
            Phase::Done(_) => Vec::new(),
        }
    }

    /// Takes the answers to the pending asks.
    fn tell(&mut self, told: &[Told]) {
        self.boundary = false;
        match self.phase.clone() {
            Phase::Start { attempt, .. } => self.told_start(attempt, told),
            Phase::ModelGradient { backoff } => self.told_gradient(backoff, told),
            Phase::Differences(differences) => self.told_differences(differences, told),
            Phase::Search(search) => self.told_search(*search, told),
            Phase::Done(_) => {}
        }
    }

    /// Asks for the iterate again and forgets what its old values had taught. Scales, step lengths and curvature stay:
    /// they are guesses at the next step, which no conclusion rests on.
    fn rebase(&mut self) {
        if self.done().is_none() {
            self.phase = Phase::Start {
                attempt: 0,
                replan: self.iterate.is_some(),
            };
            self.boundary = false;
            self.gradient = None;
            self.previous = None;
            self.best = None;
            self.memory.forget_values();
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

    fn multipliers(&self) -> Vec<f64> {
        self.multipliers.clone()
    }
}

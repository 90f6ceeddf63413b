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
    descent::DescentOptions,
    linearisation::{Linearisation, Pending as Linearising},
    method::Method,
    options::{Curvature, MmfdOptions},
    point::Point,
    problem::Problem,
    rows,
    stop::StopReason,
};

/// Share of the first objective whose change counts as none.
const ABSOLUTE_SHARE: f64 = 1e-4;

/// What the run waits for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    /// Values and gradients at the iterate.
    Linearise(Linearising),
    /// A point of the one-dimensional search.
    Search(Box<Search>),
    /// Nothing.
    Done(StopReason),
}

/// What the direction from the iterate before was made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Departure {
    /// Rows that the direction was tangent to, with their multipliers.
    tangent: Vec<(usize, f64)>,
    /// Gradient of the Lagrangian with these multipliers.
    lagrangian: Vec<f64>,
}

/// A run of the method between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mmfd {
    options: MmfdOptions,
    phase: Phase,
    here: Linearisation,
    departure: Option<Departure>,
    memory: Memory,
    multipliers: Vec<f64>,
}

impl Mmfd {
    pub(super) fn start(options: MmfdOptions, problem: Problem, x0: Vec<f64>) -> Self {
        Self {
            memory: Memory::new(&options, x0.len()),
            options,
            phase: Phase::Linearise(Linearising::start()),
            departure: None,
            multipliers: vec![0.0; problem.constraints()],
            here: Linearisation::new(problem, x0, ABSOLUTE_SHARE),
        }
    }

    /// The moves that make the metric at a point, if they may.
    fn moves(&self, at: &Point) -> Option<&Moves> {
        let free = || {
            rows::values(&self.here.problem, &at.constraints)
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
        let origin = self.here.iterate.as_ref()?;
        Some(Setting {
            problem: &self.here.problem,
            origin,
            gradient: self.here.gradient.as_ref()?,
            moves: self.moves(origin),
            scale: &self.memory.scale,
            ctmin: self.options.descent.violation_tolerance,
            small_change: (self.options.descent.relative_tolerance * origin.objective.abs())
                .max(self.here.convergence.absolute_tolerance),
        })
    }
}

impl Method for Mmfd {
    fn asks(&self) -> Vec<Ask> {
        let common = &self.options.descent;
        match &self.phase {
            Phase::Linearise(pending) => self.here.asks(pending, common),
            Phase::Search(search) => {
                let kind = match search.pending {
                    Pending::Trial { .. } => AskKind::Trial,
                    Pending::Return { .. } => AskKind::Return,
                };
                let x = self
                    .setting()
                    .map_or_else(|| self.here.x.clone(), |setting| search.x(&setting));
                vec![self.here.ask(kind, x, common.eager())]
            }
            Phase::Done(_) => Vec::new(),
        }
    }

    /// Takes the answers to the pending asks.
    fn tell(&mut self, told: &[Told]) {
        self.here.boundary = false;
        match self.phase.clone() {
            Phase::Linearise(pending) => self.told_linearisation(pending, told),
            Phase::Search(search) => self.told_search(*search, told),
            Phase::Done(_) => {}
        }
    }

    fn tell_of_another_mesh(&mut self, told: &[Told]) {
        self.here.convergence.on_another_mesh = true;
        self.tell(told);
        self.here.convergence.on_another_mesh = false;
    }

    /// Asks for the iterate again and forgets what its old values had taught. Scales, step lengths and curvature stay:
    /// they are guesses at the next step, which no conclusion rests on.
    fn rebase(&mut self) {
        if self.done().is_none() {
            self.phase = Phase::Linearise(self.here.rebase());
            self.here.previous = None;
            self.departure = None;
            self.memory.forget_values();
        }
    }

    fn here(&self) -> Option<&Linearisation> {
        Some(&self.here)
    }

    fn descent(&self) -> Option<&DescentOptions> {
        Some(&self.options.descent)
    }

    /// Answers of a search that goes on as its slope says, that has brought nothing, or little.
    fn alike(&self) -> Vec<[Told; 2]> {
        match (&self.phase, self.setting()) {
            (Phase::Search(search), Some(setting)) => search.alike(&setting),
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
        self.multipliers.clone()
    }
}

//! Modified method of feasible directions (MMFD), the method 1 of the optimiser DOT that the paper uses.
//!
//! Start -> gradient -> direction -> one-dimensional search with return to the boundary -> next gradient, until a stop
//! rule holds. Sources: Vanderplaats, Numerical Optimization Techniques for Engineering Design; the user's manuals of
//! CONMIN (NASA TM X-62,282) and ADS (NASA CR-177985); DOT's published parameters and defaults.

mod boundary;
mod differences;
mod direction;
mod interpolation;
mod memory;
mod metric;
mod rows;
mod search;

use serde::{Deserialize, Serialize};

use self::{
    differences::Differences,
    direction::{At, Conjugacy, Found, find},
    memory::{Closing, Memory},
    metric::{Metric, Moves},
    rows::Gradient,
    search::{Next, Pending, Sample, Search, Setting},
};
use super::{
    contract::{Ask, AskKind, Told, Values},
    options::{Curvature, GradientSource, MmfdOptions},
    point::{Point, keep_best},
    problem::Problem,
    stop::StopReason,
};

/// Points tried near a start that cannot be evaluated, as fractions of the way to the middle of the bounds.
const NUDGES: [f64; 5] = [0.0, 0.01, 0.1, 0.3, 1.0];
/// Points between the last two iterates tried where the model has values but no gradient.
const BACKOFFS: usize = 2;
const UNBOUNDED: f64 = -1e40;

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

    pub(super) fn done(&self) -> Option<StopReason> {
        match self.phase {
            Phase::Done(reason) => Some(reason),
            _ => None,
        }
    }

    pub(super) fn iterate(&self) -> Option<&Point> {
        self.iterate.as_ref()
    }

    pub(super) fn best(&self) -> Option<&Point> {
        self.best.as_ref()
    }

    pub(super) fn iteration(&self) -> usize {
        self.iteration
    }

    pub(super) fn at_iteration_boundary(&self) -> bool {
        self.boundary && self.done().is_none()
    }

    pub(super) fn analyses(&self) -> usize {
        self.analyses
    }

    pub(super) fn gradients(&self) -> usize {
        self.gradients
    }

    pub(super) fn multipliers(&self) -> &[f64] {
        &self.multipliers
    }

    fn eager(&self) -> bool {
        self.options.eager_gradients && self.options.gradient == GradientSource::Model
    }

    pub(super) fn asks(&self) -> Vec<Ask> {
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
                vec![ask(kind, self.nudged(*attempt), self.eager())]
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
    pub(super) fn tell(&mut self, told: &[Told]) {
        self.boundary = false;
        match self.phase.clone() {
            Phase::Start { attempt, .. } => self.told_start(attempt, told),
            Phase::ModelGradient { backoff } => self.told_gradient(backoff, told),
            Phase::Differences(differences) => self.told_differences(differences, told),
            Phase::Search(search) => self.told_search(*search, told),
            Phase::Done(_) => {}
        }
    }

    /// Asks for the iterate again and forgets what its old values had taught.
    pub(super) fn rebase(&mut self) {
        if self.done().is_none() {
            self.phase = Phase::Start {
                attempt: 0,
                replan: self.iterate.is_some(),
            };
            self.boundary = false;
            self.gradient = None;
            self.previous = None;
            self.best = None;
            self.memory = Memory::new(&self.options, self.x.len());
        }
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
                .max(self.memory.absolute_tolerance),
        })
    }

    /// The start, or a point on the way from it to the middle of the bounds.
    fn nudged(&self, attempt: usize) -> Vec<f64> {
        let fraction = NUDGES[attempt.min(NUDGES.len() - 1)];
        if fraction == 0.0 {
            return self.x.clone();
        }
        let toward = |i: usize| {
            let (x, lower, upper) = (self.x[i], self.problem.lower[i], self.problem.upper[i]);
            let reach = 0.5 * (upper - lower).min(2.0 * x.abs().max(1.0));
            let middle = 0.5 * (lower + upper);
            let aim = if (middle - x).abs() > 1e-3 * reach {
                (middle - x).clamp(-reach, reach)
            } else {
                0.5 * reach
            };
            x + fraction * aim
        };
        let mut x: Vec<f64> = (0..self.x.len()).map(toward).collect();
        self.problem.clip(&mut x);
        x
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

    /// An answer that can be used.
    fn usable<'a>(&self, told: Option<&'a Told>) -> Option<&'a Values> {
        match told {
            Some(Told::Values(values)) if self.problem.accepts(values) => Some(values),
            _ => None,
        }
    }

    fn note(&mut self, x: Vec<f64>, values: &Values) -> (Point, Option<Gradient>) {
        let point = Point::new(&self.problem, x, values);
        keep_best(&mut self.best, &point, self.options.violation_tolerance);
        self.memory.note_progress(
            self.cost(),
            self.iteration,
            self.best.as_ref(),
            self.options.violation_tolerance,
        );
        let gradient = Gradient::of(&self.problem, values);
        if gradient.is_some() {
            self.gradients += 1;
        }
        (point, gradient)
    }

    /// What the run has cost: analyses, and the model's gradients.
    fn cost(&self) -> usize {
        match self.options.gradient {
            GradientSource::Model => self.analyses + self.gradients,
            GradientSource::Differences => self.analyses,
        }
    }

    fn told_start(&mut self, attempt: usize, told: &[Told]) {
        self.analyses += 1;
        let x = self.nudged(attempt);
        let Some(values) = self.usable(told.first()) else {
            self.phase = if attempt + 1 < NUDGES.len() {
                let replan = matches!(self.phase, Phase::Start { replan: true, .. });
                Phase::Start {
                    attempt: attempt + 1,
                    replan,
                }
            } else {
                Phase::Done(StopReason::FailedStart {
                    attempts: attempt + 1,
                })
            };
            return;
        };
        let (point, gradient) = self.note(x, values);
        if point.constraints.iter().any(|g| g.abs() > 10.0) {
            tracing::warn!("constraints beyond 10 in absolute value: normalise them to order one");
        }
        self.memory.absolute_tolerance = self
            .options
            .absolute_tolerance
            .unwrap_or_else(|| (1e-4 * point.objective.abs()).max(1e-20));
        self.x.clone_from(&point.x);
        self.iterate = Some(point);
        self.gradient = gradient;
        self.open_iteration();
    }

    fn told_gradient(&mut self, backoff: usize, told: &[Told]) {
        if backoff > 0 {
            self.analyses += 1;
        }
        if let Some(values) = self.usable(told.first())
            && Gradient::of(&self.problem, values).is_some()
        {
            if backoff > 0 {
                let (point, gradient) = self.note(self.backed_off(backoff), values);
                self.x.clone_from(&point.x);
                self.iterate = Some(point);
                self.gradient = gradient;
                self.memory.conjugacy = Conjugacy::default();
            } else {
                self.gradients += 1;
                self.gradient = Gradient::of(&self.problem, values);
            }
            self.open_search();
        } else if self.previous.is_some() && backoff < BACKOFFS {
            self.phase = Phase::ModelGradient {
                backoff: backoff + 1,
            };
        } else {
            self.ask_differences();
        }
    }

    fn ask_differences(&mut self) {
        let options = &self.options;
        let differences = Differences::new(
            &self.problem,
            &self.x,
            options.difference_step,
            options.least_difference_step,
        );
        self.phase = if differences.len() == 0 {
            Phase::Done(StopReason::KuhnTucker { residual: 0.0 })
        } else {
            Phase::Differences(differences)
        };
    }

    fn told_differences(&mut self, mut differences: Differences, told: &[Told]) {
        self.analyses += differences.len();
        let points = differences.points(&self.x);
        for (x, told) in points.into_iter().zip(told) {
            if let Some(values) = self.usable(Some(told)) {
                let point = Point::new(&self.problem, x, values);
                keep_best(&mut self.best, &point, self.options.violation_tolerance);
            }
        }
        self.memory.note_progress(
            self.cost(),
            self.iteration,
            self.best.as_ref(),
            self.options.violation_tolerance,
        );
        let Some(at) = &self.iterate else { return };
        if !differences.tell(&self.problem, at, told) {
            self.phase = Phase::Differences(differences);
            return;
        }
        if let Some(gradient) = differences.gradient(self.problem.constraints()) {
            self.gradient = Some(gradient);
            self.gradients += 1;
            self.open_search();
        } else {
            self.phase = Phase::Done(StopReason::NoGradient {
                attempts: differences.attempts(),
            });
        }
    }

    /// Opens an iteration at the iterate: its gradient, unless known, then its direction.
    fn open_iteration(&mut self) {
        self.boundary = true;
        if self.gradient.is_some() {
            self.open_search();
        } else if self.options.gradient == GradientSource::Model {
            self.phase = Phase::ModelGradient { backoff: 0 };
        } else {
            self.ask_differences();
        }
    }

    fn open_search(&mut self) {
        let (Some(iterate), Some(gradient)) = (&self.iterate, &self.gradient) else {
            return;
        };
        if self.options.curvature != Curvature::Never
            && let Some(previous) = &self.previous
        {
            let here = gradient.lagrangian(&self.problem, &previous.tangent);
            let difference = |to: &[f64], from: &[f64]| {
                to.iter().zip(from).map(|(to, from)| to - from).collect()
            };
            self.memory.moves.learn(
                difference(&iterate.x, &previous.x),
                difference(&here, &previous.lagrangian),
            );
        }
        self.memory
            .rescale(&self.options, &iterate.x, self.iteration);
        let g = rows::values(&self.problem, &iterate.constraints);
        let feasible = iterate.violation <= self.options.violation_tolerance;
        let metric = Metric::of(self.moves(iterate), &self.memory.scale);
        let frozen = self.memory.frozen(self.iteration);
        loop {
            let at = At {
                problem: &self.problem,
                x: &iterate.x,
                g: &g,
                gradient,
                scale: &self.memory.scale,
                metric: &metric,
                frozen: &frozen,
                ct: self.memory.ct,
                ctmin: self.options.violation_tolerance,
                phi: self.memory.phi,
                push_off: self.options.push_off,
                stationary: 0.1 * self.memory.absolute_tolerance,
            };
            match find(&at, &mut self.memory.conjugacy) {
                Found::Direction(direction) => {
                    if feasible {
                        self.multipliers =
                            direction::told_multipliers(&self.problem, &direction.tangent);
                    }
                    let alpha =
                        self.memory
                            .first_step(&direction, iterate, &g, feasible, &self.options);
                    self.phase = Phase::Search(Box::new(Search::new(direction, alpha, feasible)));
                    return;
                }
                Found::KuhnTucker {
                    residual,
                    multipliers,
                } => {
                    self.multipliers = multipliers;
                    self.phase = Phase::Done(if frozen.is_empty() {
                        StopReason::KuhnTucker { residual }
                    } else {
                        StopReason::Blocked {
                            directions: frozen.len(),
                        }
                    });
                    return;
                }
                Found::NotComplementary => {
                    self.memory.ct =
                        -(0.3 * self.memory.ct.abs()).max(self.options.violation_tolerance);
                }
                Found::None => {
                    self.phase = Phase::Done(StopReason::NoFeasibleDesign {
                        iterations: self.memory.infeasible,
                        violation: iterate.violation,
                    });
                    return;
                }
            }
        }
    }

    fn told_search(&mut self, mut search: Search, told: &[Told]) {
        self.analyses += 1;
        let Some(x) = self.setting().map(|setting| search.x(&setting)) else {
            return;
        };
        let outcome = self.usable(told.first()).map(|values| self.note(x, values));
        let Some(setting) = self.setting() else {
            return;
        };
        match search.tell(&setting, outcome) {
            Next::Evaluate => self.phase = Phase::Search(Box::new(search)),
            Next::Accept(sample) => self.close_iteration(&search, Some(*sample)),
            Next::Fail => self.close_iteration(&search, None),
        }
    }

    /// Moves to the accepted point, tests the stop rules, and opens the next iteration.
    fn close_iteration(&mut self, search: &Search, accepted: Option<Sample>) {
        let Some(from) = self.iterate.clone() else {
            return;
        };
        self.iteration += 1;
        let moved = accepted.is_some();
        if let Some(sample) = accepted {
            let tangent = search.direction.tangent.clone();
            self.previous = self.gradient.take().map(|gradient| Previous {
                x: from.x.clone(),
                lagrangian: gradient.lagrangian(&self.problem, &tangent),
                tangent,
            });
            self.x.clone_from(&sample.point.x);
            self.gradient = sample.gradient;
            self.iterate = Some(sample.point);
        }
        let Some(to) = &self.iterate else { return };
        let reason = if moved || search.failures == 0 {
            let closing = Closing {
                from: &from,
                to,
                moved,
                iteration: self.iteration,
                cost: self.cost(),
            };
            self.memory.close(&self.options, &closing)
        } else {
            self.memory.block(&search.direction, self.iteration)
        };
        let unbounded = to.objective < UNBOUNDED;
        if unbounded {
            self.phase = Phase::Done(StopReason::Unbounded {
                objective: to.objective,
            });
        } else if let Some(reason) = reason {
            self.phase = Phase::Done(reason);
        } else {
            self.open_iteration();
        }
    }
}

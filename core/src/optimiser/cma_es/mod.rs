//! Evolution strategy with covariance matrix adaptation (CMA-ES), for problems without gradients and with many optima.
//!
//! A generation of points drawn from a normal distribution, asked as one batch -> their order -> mean, step size and
//! covariance of the next distribution, until a stop rule holds. Sources: N. Hansen, The CMA evolution strategy: a tutorial
//! (arXiv 1604.00772, 2016), with negative weights (active update) and its constants throughout; A. Auger, N. Hansen, A
//! restart CMA evolution strategy with increasing population size (CEC 2005) for the doublings. Written from these papers.
//!
//! Choices, each with what it is for (figures: docs/decisions/without-gradients.md):
//! - *Bounds* ([`coordinates`]) are a mirror with a rounded edge, so that nothing is cut off and no mean is biased.
//! - *Constraints* ([`ranking`]) have a rank of their own, whose weight follows the run: a ranking that puts feasible points
//!   first is cheaper on smooth problems, but contracts on the first constraint that it meets where there are many optima.
//! - *Failures* rank last and attract nothing; they may repel.
//! - *Geometry* that is refused before any analysis is a constraint of known values: the valid design on the way to it is
//!   evaluated in its place, and by how much it was refused counts as its violation.
//! - *Seeds*: all randomness is a stream in the state, so that a run is a function of options, problem and answers.

mod coordinates;
mod distribution;
mod eigen;
mod generation;
mod options;
mod ranking;
mod stall;
mod strategy;

use serde::{Deserialize, Serialize};

pub use self::options::CmaEsOptions;

use self::{
    coordinates::Coordinates,
    distribution::Distribution,
    ranking::Ranking,
    stall::{Spent, Stall},
};
use super::{
    contract::{Ask, AskKind, Told},
    method::{Method, Refuses},
    point::Point,
    problem::{Problem, StartError},
    stop::StopReason,
};
use crate::random::SplitMix64;

/// What the run waits for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    /// The start, then a generation.
    Start,
    /// A generation.
    Generation,
    /// The best point of the last generation again, under a new meaning of the values.
    Replan,
    /// Nothing.
    Done(StopReason),
}

/// A point of the pending generation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Offspring {
    /// Its normal vector.
    z: Vec<f64>,
    /// By how much it was refused before any analysis.
    refused: Option<f64>,
    /// The design that is evaluated in the place of a refused one.
    repaired: Option<Vec<f64>>,
}

impl Offspring {
    fn is_asked(&self) -> bool {
        self.refused.is_none() || self.repaired.is_some()
    }
}

/// A run of the method between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CmaEs {
    options: CmaEsOptions,
    problem: Problem,
    coordinates: Coordinates,
    phase: Phase,
    stream: SplitMix64,
    distribution: Distribution,
    /// Points of a generation.
    population: usize,
    pending: Vec<Offspring>,
    /// Whether the pending points were shown to the screen.
    screened: bool,
    /// Whether the screen refused the mean; unknown without a screen.
    mean_refused: Option<bool>,
    ranking: Ranking,
    /// Absolute change of the objective that counts as none, once a feasible point is known.
    absolute_tolerance: Option<f64>,
    /// Best feasible objective of each generation, the last ones; none where none was feasible.
    bests: Vec<Option<f64>>,
    #[serde(default)]
    stall: Stall,
    /// The best point of the last generation that had one.
    iterate: Option<Point>,
    best: Option<Point>,
    iteration: usize,
    /// Consecutive generations without a single value.
    fruitless: usize,
    doubled: usize,
    boundary: bool,
    analyses: usize,
}

impl CmaEs {
    pub(super) fn start(
        options: CmaEsOptions,
        problem: Problem,
        x0: &[f64],
    ) -> Result<Self, StartError> {
        let coordinates = Coordinates::new(&problem, x0);
        if coordinates.dimension() == 0 {
            return Err(StartError::NoVariables);
        }
        let mut run = Self {
            stream: SplitMix64::new(options.seed),
            distribution: Distribution::new(coordinates.at(x0), options.first_step),
            population: options
                .population
                .unwrap_or_else(|| strategy::population(coordinates.dimension())),
            coordinates,
            phase: Phase::Start,
            pending: Vec::new(),
            screened: false,
            mean_refused: None,
            ranking: Ranking::new(),
            absolute_tolerance: options.absolute_tolerance,
            bests: Vec::new(),
            stall: Stall::default(),
            iterate: None,
            best: None,
            iteration: 0,
            fruitless: 0,
            doubled: 0,
            boundary: false,
            analyses: 0,
            options,
            problem,
        };
        run.draw();
        Ok(run)
    }

    /// The design of a point of the pending generation.
    fn x(&self, offspring: &Offspring) -> Vec<f64> {
        let drawn = || self.design(&self.distribution.point(&offspring.z));
        offspring.repaired.clone().unwrap_or_else(drawn)
    }

    fn spent(&self) -> Spent {
        Spent {
            analyses: self.analyses,
            generation: self.iteration,
            population: self.population,
            dimension: self.coordinates.dimension(),
        }
    }

    fn design(&self, at: &[f64]) -> Vec<f64> {
        self.coordinates.variables(&self.problem, at)
    }
}

impl Method for CmaEs {
    fn asks(&self) -> Vec<Ask> {
        let ask = |kind, x| Ask {
            kind,
            x,
            want_gradient: false,
            iteration: self.iteration,
        };
        let asked = self.pending.iter().filter(|o| o.is_asked());
        let generation = asked.map(|o| ask(AskKind::Trial, self.x(o)));
        match self.phase {
            Phase::Start => {
                std::iter::once(ask(AskKind::Initial, self.coordinates.start().to_vec()))
                    .chain(generation)
                    .collect()
            }
            Phase::Generation => generation.collect(),
            Phase::Replan => self
                .iterate
                .iter()
                .map(|point| ask(AskKind::Replan, point.x.clone()))
                .collect(),
            Phase::Done(_) => Vec::new(),
        }
    }

    fn tell(&mut self, told: &[Told]) {
        if self.done().is_some() {
            return;
        }
        self.boundary = false;
        match self.phase {
            Phase::Start => {
                self.told_point(self.coordinates.start().to_vec(), told.first());
                self.told_generation(told.get(1..).unwrap_or(&[]));
            }
            Phase::Generation => self.told_generation(told),
            Phase::Replan => {
                if let Some(iterate) = self.iterate.take() {
                    self.told_point(iterate.x.clone(), told.first());
                    // Should it have failed, the old values are all that is known.
                    self.iterate = self.best.clone().or(Some(iterate));
                }
                self.phase = Phase::Generation;
            }
            Phase::Done(_) => {}
        }
    }

    /// Asks for the best point of the last generation again and forgets what its old values had taught. The distribution
    /// stays: it rests on orders and only guesses at the next points.
    fn rebase(&mut self) {
        if self.done().is_none() {
            if self.iterate.is_some() {
                self.phase = Phase::Replan;
            }
            self.boundary = false;
            self.best = None;
            self.bests.clear();
            self.stall = Stall::after(self.analyses);
        }
    }

    fn screen(&mut self, refuses: &mut Refuses<'_>) {
        if self.done().is_none() && !self.screened {
            self.screen_generation(refuses);
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
}

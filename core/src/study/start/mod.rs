//! Where the restarts of a step begin: seeded, reproducible, the same whatever the number of workers.
//!
//! Starts that are drawn are valid by their geometry before anything is solved, and apart from those before them.

mod latin_hypercube;
mod sobol;
mod space;

use serde::{Deserialize, Serialize};

use self::latin_hypercube::latin_hypercube;
use self::sobol::Sobol;
use self::space::{Found, StartSpace};
use super::error::StudyError;
use super::race::Competition;
use super::result::is_false;
use super::spec::{Restarts, StartKind, Study, StudyStep};
use super::takes::{Given, StepInputs, TakenAs};
use crate::optimiser::OptimiserOptions;
use crate::random::{SplitMix64, start_seed};
use crate::scene::Orientation;

/// One restart of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartSpec {
    /// Index of the step in the study.
    pub step: usize,
    /// Index in the step.
    pub index: usize,
    /// What its random numbers came from: of `random` a seed of its own, else the step's.
    pub seed: u64,
    /// Kind of its start; `None` where the optimiser has none.
    pub start_kind: Option<StartKind>,
    /// How it was drawn; `None` of a start that was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn: Option<Drawn>,
    /// The start.
    pub x0: Vec<f64>,
    /// Sense of the enclosed area; `None` where the target has none, and where each point of a sweep has its own.
    pub orientation: Option<Orientation>,
    /// What the step was given by others.
    #[serde(default, skip_serializing_if = "Given::is_empty")]
    pub given: Given,
    /// The points of a sweep that takes them from others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Vec<f64>>,
}

/// How a start was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Drawn {
    /// Designs that were refused before it: by their geometry, or too near to another start.
    pub refusals: usize,
    /// Whether it was moved into validity, because nothing valid was drawn.
    #[serde(default, skip_serializing_if = "is_false")]
    pub repaired: bool,
    /// Whether its geometry is valid; where it is not the optimiser has to find its way by itself.
    pub valid: bool,
}

/// A start before its senses.
#[derive(Clone)]
struct Start {
    kind: Option<StartKind>,
    seed: u64,
    drawn: Option<Drawn>,
    x0: Vec<f64>,
    /// The one sense in which it is known to run.
    orientation: Option<Orientation>,
}

impl Restarts {
    /// Of an optimiser without starts.
    pub(super) fn none() -> Self {
        Self {
            start: Vec::new(),
            points: Vec::new(),
            count: 0,
            seed: 0,
            least_distance: 0.0,
            competition: Competition::default(),
        }
    }

    /// Whether there are no starts.
    pub(super) fn is_empty(&self) -> bool {
        self.start.is_empty()
    }
}

impl StudyStep {
    /// The senses in which its restarts run. A sample of points under `either` runs in none: the sense only changes the sign
    /// of the area, so that each point is analysed once and counts in its better sense.
    fn senses(&self) -> Vec<Option<Orientation>> {
        let is_sample = self.optimiser.is_sample();
        match &self.target {
            Some(target) if is_sample && target.either_sense => vec![None],
            Some(target) => target.senses(),
            None => vec![None],
        }
    }

    /// Number of restarts; each start counts once per sense of the area.
    pub fn restart_count(&self) -> usize {
        let of_kind = |kind: &StartKind| match kind {
            StartKind::Paper => 1,
            StartKind::Given => self.restarts.points.len(),
            StartKind::Random | StartKind::LatinHypercube | StartKind::Sobol => self.restarts.count,
            StartKind::Taken => self.most_taken(),
        };
        let starts = if self.optimiser.has_starts() {
            self.restarts.start.iter().map(of_kind).sum()
        } else {
            1
        };
        starts * self.senses().len()
    }

    /// Designs that it takes from others at most.
    fn most_taken(&self) -> usize {
        let designs = self.takes.iter().filter(|t| t.taken_as == TakenAs::Starts);
        designs.map(|take| take.candidates.max(1)).product()
    }

    /// Evaluations that one restart may ask for; `None` without a budget.
    pub fn evaluations_per_restart(&self) -> Option<usize> {
        let total = self.budget.evaluations?;
        Some((total / self.restart_count().max(1)).max(1))
    }
}

impl Study {
    /// The restarts of a step, in the document's order; with `orientation = "either"` each start is followed by its twin
    /// of the other sense, except of a sweep or a random search.
    pub fn restarts(
        &self,
        step: usize,
        inputs: &StepInputs,
    ) -> Result<Vec<RestartSpec>, StudyError> {
        let study = self.given(step, &inputs.given);
        let s = study.step(step)?;
        let mut starts = Vec::new();
        let mut points = Vec::new();
        let alone = |x0: Vec<f64>| Start {
            kind: None,
            seed: s.restarts.seed,
            drawn: None,
            x0,
            orientation: None,
        };
        match &s.optimiser {
            OptimiserOptions::Sweep(options) => {
                if options.points.is_empty() {
                    points = inputs.designs.iter().map(|d| d.x.clone()).collect();
                }
                let first = options.points.first().or(points.first());
                starts.push(alone(first.cloned().unwrap_or_default()));
            }
            OptimiserOptions::Exchange(_) => starts.push(alone(study.paper_start(step)?)),
            _ => {
                for kind in &s.restarts.start {
                    study.add_starts(step, s, *kind, inputs, &mut starts)?;
                }
            }
        }
        let senses = s.senses();
        let twins = starts.into_iter().flat_map(|start| {
            let known = start.orientation.filter(|o| senses.contains(&Some(*o)));
            let of_start = senses.iter().copied();
            let of_start = of_start.filter(move |sense| known.is_none() || *sense == known);
            let of_start: Vec<_> = of_start.collect();
            of_start
                .into_iter()
                .map(move |sense| (start.clone(), sense))
        });
        Ok(twins
            .enumerate()
            .map(|(index, (start, orientation))| RestartSpec {
                step,
                index,
                seed: start.seed,
                start_kind: start.kind,
                drawn: start.drawn,
                x0: start.x0,
                orientation,
                given: inputs.given.clone(),
                points: points.clone(),
            })
            .collect())
    }

    /// By how much its geometry alone refuses a design, before any analysis; 0 if it does not.
    pub(super) fn refusal(&self, step: usize, x: &[f64]) -> Result<f64, StudyError> {
        StartSpace::new(self, step)?.refusal(x)
    }

    fn add_starts(
        &self,
        step: usize,
        s: &StudyStep,
        kind: StartKind,
        inputs: &StepInputs,
        starts: &mut Vec<Start>,
    ) -> Result<(), StudyError> {
        let (seed, count) = (s.restarts.seed, s.restarts.count);
        let start = |seed: u64, x0: Vec<f64>| Start {
            kind: Some(kind),
            seed,
            drawn: None,
            x0,
            orientation: None,
        };
        let found = |seed: u64, found: Found| Start {
            drawn: Some(found.drawn),
            ..start(seed, found.x)
        };
        match kind {
            StartKind::Paper => starts.push(start(seed, self.paper_start(step)?)),
            StartKind::Given => {
                let given = s.restarts.points.iter();
                starts.extend(given.map(|x| start(seed, x.clone())));
            }
            StartKind::Random => {
                let space = StartSpace::new(self, step)?;
                for k in 0..count {
                    let seed = start_seed(seed, k);
                    let mut stream = SplitMix64::new(seed);
                    let draw = || space.design(std::iter::repeat_with(|| stream.next_unit()));
                    let drawn = space.first_good(&designs(starts), draw)?;
                    starts.push(found(seed, drawn));
                }
            }
            StartKind::Sobol => {
                let space = StartSpace::new(self, step)?;
                let mut sequence = Sobol::new(seed, space.dimensions());
                for _ in 0..count {
                    let draw = || space.design(sequence.next_point());
                    let drawn = space.first_good(&designs(starts), draw)?;
                    starts.push(found(seed, drawn));
                }
            }
            StartKind::LatinHypercube => {
                let space = StartSpace::new(self, step)?;
                let apart = s.restarts.least_distance;
                let cube = latin_hypercube(&space, seed, count, apart, &designs(starts))?;
                starts.extend(cube.into_iter().map(|drawn| found(seed, drawn)));
            }
            // The sense that a candidate was found in is the one in which it counts.
            StartKind::Taken => starts.extend(inputs.designs.iter().map(|design| Start {
                orientation: design.orientation,
                ..start(seed, design.x.clone())
            })),
        }
        Ok(())
    }

    /// How far apart two designs of a step are: the largest difference of a variable over the width of its bounds. Designs of
    /// different lengths, which belong to different layouts, are infinitely far apart.
    ///
    /// # Errors
    /// Where the study has no such step.
    pub fn scaled_distance(&self, step: usize, a: &[f64], b: &[f64]) -> Result<f64, StudyError> {
        if a.len() != b.len() {
            return Ok(f64::INFINITY);
        }
        let bounds = self.variables(step)?;
        Ok(scaled_distance(&bounds.lower, &bounds.upper, a, b))
    }
}

/// Largest difference of a variable over the width of its bounds.
pub(crate) fn scaled_distance(lower: &[f64], upper: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let width = |k: usize| match (lower.get(k), upper.get(k)) {
        (Some(low), Some(high)) if high > low => high - low,
        _ => 1.0,
    };
    let differences = a.iter().zip(b).enumerate();
    differences.fold(0.0, |most, (k, (a, b))| {
        f64::max(most, (a - b).abs() / width(k))
    })
}

fn designs(starts: &[Start]) -> Vec<&[f64]> {
    starts.iter().map(|start| &start.x0[..]).collect()
}

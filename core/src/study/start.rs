//! Where the restarts of a step begin: seeded, reproducible, the same whatever the number of workers.

use serde::{Deserialize, Serialize};

use super::error::StudyError;
use super::spec::{Restarts, StartKind, Study, StudyStep};
use super::takes::{Given, StepInputs, TakenAs};
use crate::optimiser::OptimiserOptions;
use crate::random::{SplitMix64, start_seed};
use crate::scene::Orientation;

/// Random designs that may be refused by the geometric constraints before the last one is taken as it is: the optimiser
/// finds its way into the feasible region by itself.
const MAX_DRAWS: usize = 200;

/// One restart of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartSpec {
    /// Index of the step in the study.
    pub step: usize,
    /// Index in the step.
    pub index: usize,
    /// What its random numbers came from; of a start that needs none the study's seed.
    pub seed: u64,
    /// Kind of its start; `None` for a sweep.
    pub start_kind: Option<StartKind>,
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

/// A start before its senses.
#[derive(Clone)]
struct Start {
    kind: Option<StartKind>,
    seed: u64,
    x0: Vec<f64>,
    /// The one sense in which it is known to run.
    orientation: Option<Orientation>,
}

impl Restarts {
    /// Of a sweep, which has no starts.
    pub(super) fn sweep() -> Self {
        Self {
            start: Vec::new(),
            points: Vec::new(),
            count: 0,
            seed: 0,
        }
    }

    /// Whether there are no starts.
    pub(super) fn is_empty(&self) -> bool {
        self.start.is_empty()
    }
}

impl StudyStep {
    /// The senses in which its restarts run. A sweep under `either` runs in none: the sense only changes the sign of the
    /// area, so that each point is analysed once and counts in its better sense.
    fn senses(&self) -> Vec<Option<Orientation>> {
        let sweeps = matches!(self.optimiser, OptimiserOptions::Sweep(_));
        match &self.target {
            Some(target) if sweeps && target.either_sense => vec![None],
            Some(target) => target.senses(),
            None => vec![None],
        }
    }

    /// Number of restarts; each start counts once per sense of the area.
    pub fn restart_count(&self) -> usize {
        let starts = match self.optimiser {
            OptimiserOptions::Sweep(_) => 1,
            _ => self
                .restarts
                .start
                .iter()
                .map(|kind| match kind {
                    StartKind::Paper => 1,
                    StartKind::Given => self.restarts.points.len(),
                    StartKind::Random => self.restarts.count,
                    StartKind::Taken => self.most_taken(),
                })
                .sum(),
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
    /// of the other sense, except of a sweep.
    pub fn restarts(
        &self,
        step: usize,
        inputs: &StepInputs,
    ) -> Result<Vec<RestartSpec>, StudyError> {
        let study = self.given(step, &inputs.given);
        let s = study.step(step)?;
        let mut starts = Vec::new();
        let mut points = Vec::new();
        match &s.optimiser {
            OptimiserOptions::Sweep(options) => {
                if options.points.is_empty() {
                    points = inputs.designs.iter().map(|d| d.x.clone()).collect();
                }
                let first = options.points.first().or(points.first());
                starts.push(Start {
                    kind: None,
                    seed: s.restarts.seed,
                    x0: first.cloned().unwrap_or_default(),
                    orientation: None,
                });
            }
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
                x0: start.x0,
                orientation,
                given: inputs.given.clone(),
                points: points.clone(),
            })
            .collect())
    }

    fn add_starts(
        &self,
        step: usize,
        s: &StudyStep,
        kind: StartKind,
        inputs: &StepInputs,
        starts: &mut Vec<Start>,
    ) -> Result<(), StudyError> {
        let seed = s.restarts.seed;
        let start = |seed: u64, x0: Vec<f64>| Start {
            kind: Some(kind),
            seed,
            x0,
            orientation: None,
        };
        match kind {
            StartKind::Paper => starts.push(start(seed, self.paper_start(step)?)),
            StartKind::Given => {
                let given = s.restarts.points.iter();
                starts.extend(given.map(|x| start(seed, x.clone())));
            }
            StartKind::Random => {
                for k in 0..s.restarts.count {
                    let seed = start_seed(seed, k);
                    starts.push(start(seed, self.random_start(step, seed)?));
                }
            }
            // The sense that a candidate was found in is the one in which it counts.
            StartKind::Taken => starts.extend(inputs.designs.iter().map(|design| Start {
                orientation: design.orientation,
                ..start(seed, design.x.clone())
            })),
        }
        Ok(())
    }

    /// Uniform in the bounds; designs that break a geometric constraint are drawn again before any analysis.
    fn random_start(&self, step: usize, seed: u64) -> Result<Vec<f64>, StudyError> {
        let variables = self.variables(step)?;
        let mut stream = SplitMix64::new(seed);
        let mut x = Vec::new();
        for _ in 0..MAX_DRAWS {
            x = variables
                .lower
                .iter()
                .zip(&variables.upper)
                .map(|(a, b)| (a + (b - a) * stream.next_unit()).min(*b))
                .collect();
            if self.is_geometrically_valid(step, &x)? {
                break;
            }
        }
        Ok(x)
    }

    fn is_geometrically_valid(&self, step: usize, x: &[f64]) -> Result<bool, StudyError> {
        match self.geometry_values(step, x) {
            Ok(values) => Ok(values.iter().all(|v| *v <= 0.0)),
            Err(StudyError::NoChambers { .. }) => Ok(true),
            Err(error) => Err(error),
        }
    }
}

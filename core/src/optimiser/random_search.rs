//! Random search: points drawn uniformly within the bounds, each for itself. The baseline of every comparison.

use serde::{Deserialize, Serialize};

use super::{
    contract::{Ask, AskKind, Told},
    method::{Method, Refuses},
    options::RandomSearchOptions,
    point::{Point, keep_best},
    problem::Problem,
    stop::StopReason,
};
use crate::random::SplitMix64;

/// Draws of a point until one is not refused; the last one is taken as it is, as a random start is.
const DRAWS: usize = 200;

/// State of a random search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RandomSearch {
    options: RandomSearchOptions,
    problem: Problem,
    stream: SplitMix64,
    /// The points asked for.
    pending: Vec<Vec<f64>>,
    /// Whether they were shown to the screen.
    screened: bool,
    best: Option<Point>,
    batches: usize,
    analyses: usize,
    failed: usize,
    done: Option<StopReason>,
}

impl RandomSearch {
    /// The start is the first point.
    pub(super) fn start(options: RandomSearchOptions, problem: Problem, x0: Vec<f64>) -> Self {
        let mut search = Self {
            stream: SplitMix64::new(options.seed),
            options,
            problem,
            pending: vec![x0],
            screened: false,
            best: None,
            batches: 0,
            analyses: 0,
            failed: 0,
            done: None,
        };
        search.fill();
        search
    }

    /// Draws what the batch lacks.
    fn fill(&mut self) {
        let left = self.options.evaluations - self.analyses;
        while self.pending.len() < left.min(self.options.batch) {
            let point = self.draw();
            self.pending.push(point);
        }
        self.screened = false;
    }

    fn draw(&mut self) -> Vec<f64> {
        let bounds = self.problem.lower.iter().zip(&self.problem.upper);
        bounds
            .map(|(a, b)| (a + (b - a) * self.stream.next_unit()).min(*b))
            .collect()
    }
}

impl Method for RandomSearch {
    fn asks(&self) -> Vec<Ask> {
        let ask = |(k, x): (usize, &Vec<f64>)| Ask {
            kind: if self.analyses + k == 0 {
                AskKind::Initial
            } else {
                AskKind::Trial
            },
            x: x.clone(),
            want_gradient: false,
            iteration: self.batches,
        };
        self.pending.iter().enumerate().map(ask).collect()
    }

    fn tell(&mut self, told: &[Told]) {
        if self.done.is_some() {
            return;
        }
        for (k, x) in std::mem::take(&mut self.pending).into_iter().enumerate() {
            match self.problem.usable(told.get(k)) {
                Some(values) => {
                    let point = Point::new(&self.problem, x, values);
                    keep_best(&mut self.best, &point, self.options.violation_tolerance);
                }
                None => self.failed += 1,
            }
            self.analyses += 1;
        }
        self.batches += 1;
        if self.analyses >= self.options.evaluations {
            self.done = Some(StopReason::SearchComplete {
                points: self.analyses,
                failed: self.failed,
            });
        } else {
            self.fill();
        }
    }

    fn screen(&mut self, refuses: &mut Refuses<'_>) {
        if self.screened {
            return;
        }
        self.screened = true;
        // The start was chosen by others.
        for k in usize::from(self.analyses == 0)..self.pending.len() {
            for _ in 1..DRAWS {
                if refuses(&self.pending[k]).is_none() {
                    break;
                }
                self.pending[k] = self.draw();
            }
        }
    }

    fn done(&self) -> Option<StopReason> {
        self.done
    }

    fn best(&self) -> Option<&Point> {
        self.best.as_ref()
    }

    fn iteration(&self) -> usize {
        self.batches
    }

    fn analyses(&self) -> usize {
        self.analyses
    }
}

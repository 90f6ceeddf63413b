//! A sweep: a list of points, each evaluated once; the best feasible one is kept.

use serde::{Deserialize, Serialize};

use super::{
    contract::{Ask, AskKind, Told},
    method::Method,
    options::SweepOptions,
    point::{Point, keep_best},
    problem::{Problem, StartError},
    stop::StopReason,
};

/// State of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    problem: Problem,
    points: Vec<Vec<f64>>,
    violation_tolerance: f64,
    best: Option<Point>,
    analyses: usize,
    done: Option<StopReason>,
}

impl Sweep {
    pub(crate) fn start(
        options: SweepOptions,
        problem: Problem,
        x0: Vec<f64>,
    ) -> Result<Self, StartError> {
        let points = if options.points.is_empty() {
            vec![x0]
        } else {
            options.points
        };
        for point in &points {
            problem.check(point)?;
        }
        Ok(Self {
            problem,
            points,
            violation_tolerance: options.violation_tolerance,
            best: None,
            analyses: 0,
            done: None,
        })
    }
}

impl Method for Sweep {
    fn asks(&self) -> Vec<Ask> {
        if self.done.is_some() {
            return Vec::new();
        }
        let ask = |x: &Vec<f64>| Ask {
            kind: AskKind::Initial,
            x: x.clone(),
            want_gradient: false,
            iteration: 0,
        };
        self.points.iter().map(ask).collect()
    }

    fn tell(&mut self, told: &[Told]) {
        if self.done.is_some() {
            return;
        }
        let mut failed = 0;
        for (i, x) in self.points.iter().enumerate() {
            match told.get(i) {
                Some(Told::Values(values)) if self.problem.accepts(values) => {
                    let point = Point::new(&self.problem, x.clone(), values);
                    keep_best(&mut self.best, &point, self.violation_tolerance);
                }
                _ => failed += 1,
            }
        }
        self.analyses = self.points.len();
        self.done = Some(StopReason::SweepComplete {
            points: self.points.len(),
            failed,
        });
    }

    fn done(&self) -> Option<StopReason> {
        self.done
    }

    fn best(&self) -> Option<&Point> {
        self.best.as_ref()
    }

    fn analyses(&self) -> usize {
        self.analyses
    }
}

//! Run time against best objective, per restart and over all.

use salp_protocol::{Axis, Curve, CurvePoint, RestartCurve};

use crate::store::StoredPoint;

/// The curve of a study. `points` come by step and restart, within a restart in its optimiser's order.
///
/// A restart's time on the axes `cpu` and `evaluations` is the sum of the CPU time of its own evaluations, on `wall` the
/// time from the study's first claim to the storing of its result. `best` counts points that are feasible, free of
/// overlapping walls and stable; each step has its own. A known result is charged what it cost when it was computed.
pub fn curve(axis: Axis, started_ms: Option<i64>, points: &[StoredPoint]) -> Curve {
    let mut restarts: Vec<RestartCurve> = Vec::new();
    let mut run = Running::default();
    for point in points {
        let same = restarts
            .last()
            .is_some_and(|last| (last.step, last.index) == (point.step, point.restart));
        if !same {
            run = Running::default();
            restarts.push(RestartCurve {
                step: point.step,
                index: point.restart,
                points: Vec::new(),
            });
        }
        if let Some(last) = restarts.last_mut() {
            last.points.push(run.take(axis, started_ms, point));
        }
    }
    Curve {
        axis,
        restarts,
        best: best_of_all(axis, started_ms, points),
    }
}

/// In the order of completion; only where the best changes, and the last point of each step.
fn best_of_all(axis: Axis, started_ms: Option<i64>, points: &[StoredPoint]) -> Vec<CurvePoint> {
    let mut order: Vec<&StoredPoint> = points.iter().collect();
    order.sort_by_key(|point| (point.step, point.finished_ms, point.evaluation.0));
    let mut best = Vec::new();
    let mut run = Running::default();
    for (place, point) in order.iter().enumerate() {
        let before = run.best;
        let taken = run.take(axis, started_ms, point);
        let last_of_step = order
            .get(place + 1)
            .is_none_or(|next| next.step != point.step);
        if taken.best != before || last_of_step {
            best.push(taken);
        }
        if last_of_step {
            run.best = None;
        }
    }
    best
}

#[derive(Default)]
struct Running {
    cpu_s: f64,
    evaluations: u64,
    best: Option<f64>,
}

impl Running {
    fn take(&mut self, axis: Axis, started_ms: Option<i64>, point: &StoredPoint) -> CurvePoint {
        self.cpu_s += point.cpu_s;
        self.evaluations += 1;
        if point.counts {
            self.best = match (self.best, point.objective) {
                (Some(best), Some(objective)) => Some(best.min(objective)),
                (best, objective) => best.or(objective),
            };
        }
        let wall_s =
            started_ms.map_or(0.0, |start| (point.finished_ms - start).max(0) as f64 / 1e3);
        CurvePoint {
            step: point.step,
            t_s: match axis {
                Axis::Cpu | Axis::Evaluations => self.cpu_s,
                Axis::Wall => wall_s,
            },
            evaluations: self.evaluations,
            objective: point.objective,
            best: self.best,
            max_violation: point.max_violation,
            feasible: point.feasible,
            overlap: point.overlap,
        }
    }
}

#[cfg(test)]
mod tests {
    use salp_protocol::EvaluationId;

    use super::*;

    fn point(
        restart: usize,
        id: i64,
        objective: f64,
        feasible: bool,
        overlap: bool,
    ) -> StoredPoint {
        StoredPoint {
            step: 0,
            restart,
            evaluation: EvaluationId(id),
            objective: Some(objective),
            max_violation: Some(0.0),
            feasible,
            overlap,
            counts: feasible && !overlap,
            cpu_s: 0.5,
            finished_ms: 1000 + id,
        }
    }

    #[test]
    fn only_feasible_points_without_overlap_count() {
        let points = [
            point(0, 1, -1.0, true, false),
            point(0, 3, -9.0, false, false),
            point(0, 5, -8.0, true, true),
            point(0, 6, -2.0, true, false),
            point(1, 2, 4.0, true, false),
            point(1, 4, -5.0, true, false),
        ];
        let curve = curve(Axis::Cpu, Some(1000), &points);
        let bests: Vec<_> = curve.restarts[0].points.iter().map(|p| p.best).collect();
        assert_eq!(bests, [Some(-1.0), Some(-1.0), Some(-1.0), Some(-2.0)]);
        assert!(curve.restarts[0].points[2].overlap);
        assert_eq!(curve.restarts[1].points[1].t_s, 1.0);
        let overall: Vec<_> = curve.best.iter().map(|p| (p.evaluations, p.best)).collect();
        assert_eq!(overall, [(1, Some(-1.0)), (4, Some(-5.0)), (6, Some(-5.0))]);
    }
}

//! Run time against best objective, per restart and over all.

use salp_core::study::band_half_width;
use salp_protocol::{Axis, BandCounts, BestSoFar, Curve, CurvePoint, RestartCurve};

use crate::store::StoredPoint;

/// The curve of a study. `points` come by step and restart, within a restart in its optimiser's order.
///
/// A restart's time on the axes `cpu` and `evaluations` is the sum of the CPU time of its own evaluations, on `wall` the
/// time from the study's first claim to the storing of its result. `best` counts points that are feasible, free of
/// overlapping walls and stable; each step has its own. A known result is charged what it cost when it was computed.
pub fn curve(
    axis: Axis,
    started_ms: Option<i64>,
    points: &[StoredPoint],
    bands: BandCounts,
) -> Curve {
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
        bands,
    }
}

/// In the order of completion; only where the best changes, and the last point of each step.
fn best_of_all(axis: Axis, started_ms: Option<i64>, points: &[StoredPoint]) -> Vec<BestSoFar> {
    let mut order: Vec<&StoredPoint> = points.iter().collect();
    order.sort_by_key(|point| (point.step, point.finished_ms, point.evaluation.0));
    let mut best = Vec::new();
    let mut run = Running::default();
    let mut band = Band::default();
    for (place, point) in order.iter().enumerate() {
        let before = run.best;
        let taken = run.take(axis, started_ms, point);
        let last_of_step = order
            .get(place + 1)
            .is_none_or(|next| next.step != point.step);
        if taken.best != before {
            band = band.follow(point);
        }
        if taken.best != before || last_of_step {
            best.push(BestSoFar {
                point: taken,
                band_low: band.ends.map(|[low, _]| low),
                band_high: band.ends.map(|[_, high]| high),
                tie: band.tie,
            });
        }
        if last_of_step {
            run.best = None;
            band = Band::default();
        }
    }
    best
}

/// The error band of the best so far.
#[derive(Clone, Copy, Default)]
struct Band {
    ends: Option<[f64; 2]>,
    tie: bool,
}

impl Band {
    /// That of the point which is the best now. It is a tie where it lies within the band of the one before it.
    fn follow(self, point: &StoredPoint) -> Self {
        let ends = point.objective.zip(point.second_mesh).map(|(own, second)| {
            let half = band_half_width(own, second);
            [own - half, own + half]
        });
        let within = |[low, high]: [f64; 2]| {
            point
                .objective
                .is_some_and(|best| (low..=high).contains(&best))
        };
        Self {
            ends,
            tie: self.ends.is_some_and(within),
        }
    }
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
            coarse: point.coarse,
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
            coarse: false,
            second_mesh: None,
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
        let curve = curve(Axis::Cpu, Some(1000), &points, BandCounts::default());
        let bests: Vec<_> = curve.restarts[0].points.iter().map(|p| p.best).collect();
        assert_eq!(bests, [Some(-1.0), Some(-1.0), Some(-1.0), Some(-2.0)]);
        assert!(curve.restarts[0].points[2].overlap);
        assert_eq!(curve.restarts[1].points[1].t_s, 1.0);
        let overall: Vec<_> = curve.best.iter().map(|b| &b.point).collect();
        let overall: Vec<_> = overall.iter().map(|p| (p.evaluations, p.best)).collect();
        assert_eq!(overall, [(1, Some(-1.0)), (4, Some(-5.0)), (6, Some(-5.0))]);
    }

    #[test]
    fn coarse_points_cost_and_do_not_count() {
        let coarse = StoredPoint {
            coarse: true,
            counts: false,
            ..point(0, 1, -99.0, true, false)
        };
        let points = [coarse, point(0, 2, -3.0, true, false)];
        let curve = curve(Axis::Cpu, Some(1000), &points, BandCounts::default());
        let last = &curve.restarts[0].points[1];
        assert_eq!(
            (last.best, last.t_s, last.evaluations),
            (Some(-3.0), 1.0, 2)
        );
        assert!(curve.restarts[0].points[0].coarse && !last.coarse);
        assert_eq!(curve.best.len(), 1);
    }

    #[test]
    fn a_best_within_the_band_before_it_is_a_tie() {
        let banded = |id, objective, second| StoredPoint {
            second_mesh: second,
            ..point(0, id, objective, true, false)
        };
        let points = [
            banded(1, -10.0, Some(-9.2)),
            banded(2, -10.5, Some(-10.1)),
            banded(3, -12.0, None),
            banded(4, -12.1, Some(-12.1)),
            banded(5, -1.0, None),
        ];
        let best = curve(Axis::Cpu, Some(1000), &points, BandCounts::default()).best;
        let marked: Vec<_> = best.iter().map(|b| (b.point.best, b.tie)).collect();
        // -10.5 is within 1.25 * 0.8 of -10; -12 is not within 1.25 * 0.4 of -10.5; the band of -12 is not known.
        let expected = [
            (Some(-10.0), false),
            (Some(-10.5), true),
            (Some(-12.0), false),
            (Some(-12.1), false),
            (Some(-12.1), false),
        ];
        assert_eq!(marked, expected);
        assert_eq!(
            (best[0].band_low, best[0].band_high),
            (Some(-11.0), Some(-9.0))
        );
        assert_eq!(best[2].band_low, None);
        assert_eq!(best[4].band_low, Some(-12.1));
    }
}

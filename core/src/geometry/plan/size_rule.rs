//! The size rule: how many elements a span gets and how they are graded. The only place with sizes in it.

use super::PlanElement;

/// Element size as a function of the distance s from a chamber's corner: min(corner + growth * s, largest), mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct SizeRule {
    corner: f64,
    growth: f64,
    largest: f64,
    /// Least number of elements through a wall.
    pub(super) through_wall: usize,
}

/// A straight stretch of a block: its length, and at which ends it is graded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) length: f64,
    pub(super) graded: [bool; 2],
    /// Upper limit of the size at a graded end.
    pub(super) corner: f64,
}

impl SizeRule {
    /// The rule for 1 % of the tip displacement on a unit of the given size, or the one for a largest size.
    pub(super) fn new(element: PlanElement, unit_mm: [f64; 2], max_size_mm: Option<f64>) -> Self {
        let scale = (unit_mm[0] * unit_mm[1]).sqrt() / 80.0;
        let (sizes, through_wall) = match element {
            PlanElement::Quad9 => ([1.0, 0.6, 6.0], 2),
            PlanElement::Quad4 => ([0.5, 0.3, 2.0], 3),
        };
        let limit = max_size_mm.unwrap_or(f64::INFINITY);
        Self {
            corner: (sizes[0] * scale).min(limit),
            growth: sizes[1],
            largest: (sizes[2] * scale).min(limit),
            through_wall,
        }
    }

    /// Elements between a graded end and the distance s.
    fn number(&self, corner: f64, s: f64) -> f64 {
        let c = corner.min(self.corner);
        let turn = (self.largest - c).max(0.0) / self.growth;
        if s <= turn {
            (self.growth * s / c).ln_1p() / self.growth
        } else {
            (self.growth * turn / c).ln_1p() / self.growth + (s - turn) / self.largest
        }
    }

    /// The distance at which `number` reaches n.
    fn distance(&self, corner: f64, n: f64) -> f64 {
        let c = corner.min(self.corner);
        let turn = (self.largest - c).max(0.0) / self.growth;
        let at_turn = (self.growth * turn / c).ln_1p() / self.growth;
        if n <= at_turn {
            (self.growth * n).exp_m1() * c / self.growth
        } else {
            turn + (n - at_turn) * self.largest
        }
    }

    /// Elements that a span should have.
    pub(super) fn count(&self, span: Span) -> usize {
        let n = match span.graded {
            [true, true] => 2.0 * self.number(span.corner, 0.5 * span.length),
            [false, false] => span.length / self.largest,
            _ => self.number(span.corner, span.length),
        };
        ((n - 0.2).ceil() as usize).max(1)
    }

    /// The n + 1 element lines of a span, from 0 to its length.
    pub(super) fn lines(&self, span: Span, n: usize) -> Vec<f64> {
        let length = span.length;
        let graded_from_start =
            |t: f64| self.distance(span.corner, t * self.number(span.corner, length));
        let line = |k: usize| {
            let t = k as f64 / n as f64;
            match span.graded {
                [true, true] => {
                    let half = self.number(span.corner, 0.5 * length);
                    if 2 * k <= n {
                        self.distance(span.corner, 2.0 * t * half)
                    } else {
                        length - self.distance(span.corner, 2.0 * (1.0 - t) * half)
                    }
                }
                [true, false] => graded_from_start(t),
                [false, true] => length - graded_from_start(1.0 - t),
                [false, false] => t * length,
            }
        };
        let mut lines: Vec<f64> = (0..=n).map(line).collect();
        lines[0] = 0.0;
        lines[n] = length;
        lines
    }
}

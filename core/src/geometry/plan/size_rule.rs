//! The size rule: how many elements a span gets and how they are graded. The only place with sizes in it.

use super::PlanElement;

/// Sizes of the rule for 1 % of the tip displacement on a unit of 80 x 80 mm: c along a chamber's edge and across a wall
/// (mm), growth, largest (mm). Measured on tip displacements against meshes of about 4 times the elements (12 x for
/// `QUAD4`), mu = 0.22 MPa, 15 kPa, `overlap`, largest error over all states: `quad9` 40x15 0.4 %, 60x25 0.5 %, 20x35 0.1 %,
/// 50x37 0.2 %, 1x1 void 1.1 %; at 6 kPa slanted 0.4 %, thin 76x36 0.3 %, trapezia wide inside 1.2 %. `quad4` 40x15 0.9 %,
/// 60x25 0.7 %, 50x37 0.5 %; at 6 kPa slanted 0.7 %, trapezia wide inside 1.4 %. With c twice as large the trapezia are 3 %
/// off; the largest size matters least.
const QUAD9: [f64; 4] = [0.4, 0.5, 0.8, 8.0];
const QUAD4: [f64; 4] = [0.2, 0.2, 0.4, 1.5];
/// c is at most this part of a chamber's shortest edge, so that even a void of 1 x 1 mm has its grading.
const PART_OF_SHORTEST: f64 = 0.33;

/// c along an edge is at most this part of the radius of its rounded corners.
const PART_OF_RADIUS: f64 = 0.5;
/// The layer of a wall beside rounded corners is at most this part of the wall.
const PART_OF_WALL: f64 = 0.2;

/// Element size as a function of the distance s from a chamber's corner or edge: min(c + growth * s, largest), mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct SizeRule {
    /// c along a chamber's edge.
    corner: f64,
    /// c across a wall.
    wall: f64,
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
    /// The shortest edge of the chamber that it belongs to, mm.
    pub(super) shortest: f64,
    /// Whether it crosses a wall.
    pub(super) wall: bool,
}

impl Span {
    /// A wall's span with a layer of its own at each graded end, of the size of the arcs there, so that the blocks beside
    /// an arc can turn with it. `radius_mm`: the least of them; 0: sharp.
    pub(super) fn layered(self, radius_mm: f64) -> Vec<Self> {
        let span = self;
        let thickness = (PART_OF_RADIUS * radius_mm).min(PART_OF_WALL * span.length);
        if thickness <= 0.0 {
            return vec![span];
        }
        let layer = Self {
            length: thickness,
            graded: [false; 2],
            ..span
        };
        let ends = span.graded.map(|graded| f64::from(u8::from(graded)));
        let rest = Self {
            length: span.length - (ends[0] + ends[1]) * thickness,
            ..span
        };
        let mut spans = vec![rest];
        if span.graded[0] {
            spans.insert(0, layer);
        }
        if span.graded[1] {
            spans.push(layer);
        }
        spans
    }
}

impl SizeRule {
    /// The rule for 1 % of the tip displacement on a unit of the given size, or the one for a largest size.
    pub(super) fn new(
        element: PlanElement,
        unit_mm: [f64; 2],
        max_size_mm: Option<f64>,
        radius_mm: f64,
    ) -> Self {
        let scale = (unit_mm[0] * unit_mm[1]).sqrt() / 80.0;
        let (rule, through_wall) = match element {
            PlanElement::Quad9 => (QUAD9, 2),
            PlanElement::Quad4 => (QUAD4, 3),
        };
        let [corner, wall, growth, largest] = rule;
        let limit = max_size_mm.unwrap_or(f64::INFINITY);
        // A mesh of a given size is graded over one level only: its size is what was asked for.
        let finest = |size: f64| match max_size_mm {
            None => size * scale,
            Some(limit) => (size * scale).max(0.5 * limit).min(limit),
        };
        let arc = if radius_mm > 0.0 {
            PART_OF_RADIUS * radius_mm
        } else {
            f64::INFINITY
        };
        Self {
            corner: finest(corner).min(arc),
            wall: finest(wall),
            growth,
            largest: (largest * scale).min(limit),
            through_wall,
        }
    }

    /// Size at a graded end.
    fn finest(&self, span: Span) -> f64 {
        let size = if span.wall { self.wall } else { self.corner };
        size.min(PART_OF_SHORTEST * span.shortest)
    }

    /// Elements between a graded end and the distance s.
    fn number(&self, finest: f64, s: f64) -> f64 {
        let turn = (self.largest - finest).max(0.0) / self.growth;
        let graded = (self.growth * s.min(turn) / finest).ln_1p() / self.growth;
        graded + (s - turn).max(0.0) / self.largest
    }

    /// The distance at which `number` reaches n.
    fn distance(&self, finest: f64, n: f64) -> f64 {
        let turn = (self.largest - finest).max(0.0) / self.growth;
        let at_turn = self.number(finest, turn);
        if n <= at_turn {
            (self.growth * n).exp_m1() * finest / self.growth
        } else {
            turn + (n - at_turn) * self.largest
        }
    }

    /// Elements that a span should have.
    pub(super) fn count(&self, span: Span) -> usize {
        let n = match span.graded {
            [true, true] => 2.0 * self.number(self.finest(span), 0.5 * span.length),
            [false, false] => span.length / self.largest,
            _ => self.number(self.finest(span), span.length),
        };
        ((n - 0.2).ceil() as usize).max(1)
    }

    /// The n + 1 element lines of a span, from 0 to its length.
    pub(super) fn lines(&self, span: Span, n: usize) -> Vec<f64> {
        let length = span.length;
        let graded_from_start = |t: f64| {
            self.distance(
                self.finest(span),
                t * self.number(self.finest(span), length),
            )
        };
        let line = |k: usize| {
            let t = k as f64 / n as f64;
            match span.graded {
                [true, true] => {
                    let half = self.number(self.finest(span), 0.5 * length);
                    if 2 * k <= n {
                        self.distance(self.finest(span), 2.0 * t * half)
                    } else {
                        length - self.distance(self.finest(span), 2.0 * (1.0 - t) * half)
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

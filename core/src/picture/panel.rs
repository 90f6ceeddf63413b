//! A part of a picture that shows lengths: the same scale in both directions.

use super::axis::round_below;
use super::svg::{Anchor, Svg};
use crate::geometry::Point;

/// mm to px.
pub(super) struct Panel {
    low_mm: Point,
    scale: f64,
    origin: [f64; 2],
}

impl Panel {
    /// Around points, in the middle of a rectangle of px.
    pub fn around<'a>(
        points: impl Iterator<Item = &'a Point>,
        at: [f64; 2],
        size: [f64; 2],
    ) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points.filter(|p| p.iter().all(|x| x.is_finite())) {
            for i in 0..2 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let extent = [0, 1].map(|i| (high[i] - low[i]).max(1e-9));
        let scale = (size[0] / extent[0]).min(size[1] / extent[1]);
        let drawn = extent.map(|e| e * scale);
        Self {
            low_mm: low,
            scale,
            origin: [
                at[0] + 0.5 * (size[0] - drawn[0]),
                at[1] + 0.5 * (size[1] + drawn[1]),
            ],
        }
    }

    /// Where a point stands, px.
    pub fn at(&self, p: Point) -> [f64; 2] {
        [
            self.origin[0] + (p[0] - self.low_mm[0]) * self.scale,
            self.origin[1] - (p[1] - self.low_mm[1]) * self.scale,
        ]
    }

    /// The same of many.
    pub fn all(&self, points: &[Point]) -> Vec<[f64; 2]> {
        points.iter().map(|p| self.at(*p)).collect()
    }

    /// A bar of a round length.
    pub fn scale_bar(&self, svg: &mut Svg, at: [f64; 2], longest: f64) {
        scale_bar(svg, at, self.scale, longest);
    }
}

/// A bar of a round length, at most `longest` px; `scale` in px per mm.
pub(super) fn scale_bar(svg: &mut Svg, at: [f64; 2], scale: f64, longest: f64) {
    let length = round_below(longest / scale);
    let end = [at[0] + length * scale, at[1]];
    let dark = "stroke=\"#222222\" stroke-width=\"1.6\" fill=\"none\"";
    svg.line(at, end, dark);
    for x in [at[0], end[0]] {
        svg.line([x, at[1] - 4.0], [x, at[1] + 4.0], dark);
    }
    let label = format!("{length} mm");
    svg.text(
        [end[0] + 8.0, at[1] + 4.5],
        13.0,
        Anchor::Start,
        "fill=\"#222222\"",
        &label,
    );
}

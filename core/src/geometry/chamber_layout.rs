//! Which chambers a unit has, and the boxes of their corners: the side constraints of the design vector (Fig. 5a of the
//! paper).
//!
//! Every chamber is a quadrilateral in a domain of its own, a rectangle. Walls of one thickness lie between the domains and
//! around them. Corners go counter-clockwise from the lower left, each in its own quadrant of the domain.

use serde::{Deserialize, Serialize};

use super::Point;
use crate::actuation::ActuationCycle;

/// Variables of one chamber: x and y of four corners.
pub const VARIABLES_PER_CHAMBER: usize = 8;

/// Which chambers a unit holds, and which channels drive them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Two quadrilaterals, the lower one driven by channel 0 and the upper one by channel 1.
    StackedPair,
    /// Two quadrilaterals, the left one driven by channel 0 and the right one by channel 1.
    SideBySide,
    /// Three quadrilaterals on top of each other: the lowest driven by channel 0, the other two by channel 1.
    ThreeChambers,
}

impl Layout {
    /// All of them with their names in documents.
    pub const NAMES: [(&'static str, Self); 3] = [
        ("stacked_pair", Self::StackedPair),
        ("side_by_side", Self::SideBySide),
        ("three_chambers", Self::ThreeChambers),
    ];

    /// The channel that drives each chamber.
    pub fn channels(self) -> &'static [usize] {
        match self {
            Self::StackedPair | Self::SideBySide => &[0, 1],
            Self::ThreeChambers => &[0, 1, 1],
        }
    }

    /// Number of channels that a schedule needs.
    pub fn channel_count(self) -> usize {
        self.channels().iter().max().map_or(0, |last| last + 1)
    }

    /// A schedule of channels with one pressure per chamber instead.
    pub fn schedule(self, of_channels: &ActuationCycle) -> ActuationCycle {
        of_channels.of_chambers(self.channels())
    }

    /// The pressure of each channel from those of the chambers.
    pub fn pressure_of_channels(self, of_chambers: &[f64]) -> Vec<f64> {
        let first = |channel| self.channels().iter().position(|c| *c == channel);
        (0..self.channel_count())
            .filter_map(|channel| of_chambers.get(first(channel)?).copied())
            .collect()
    }
}

/// The boxes of a layout: each corner lives in its own quadrant of its chamber's domain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayoutBoxes {
    /// Which chambers there are.
    pub layout: Layout,
    /// Width and height of the unit, mm.
    pub unit_mm: [f64; 2],
    /// Least wall to the unit's outline and between neighbouring chambers, mm.
    pub wall_mm: f64,
    /// Distance that every corner keeps from its domain's centre lines, mm.
    pub clearance_mm: f64,
}

impl LayoutBoxes {
    /// The paper's unit: a stacked pair in 80 x 80 with walls of 2 mm, and 0.5 mm clear of the centre lines.
    pub const PAPER: Self = Self {
        layout: Layout::StackedPair,
        unit_mm: [80.0, 80.0],
        wall_mm: 2.0,
        clearance_mm: 0.5,
    };

    /// Number of chambers of a unit.
    pub fn chambers(&self) -> usize {
        self.layout.channels().len()
    }

    /// Number of variables of a unit.
    pub fn variables(&self) -> usize {
        VARIABLES_PER_CHAMBER * self.chambers()
    }

    /// The channel that drives each chamber.
    pub fn channels(&self) -> Vec<usize> {
        self.layout.channels().to_vec()
    }

    /// Lowest and highest corner of the domain of each chamber.
    pub fn domains(&self) -> Vec<[Point; 2]> {
        let [width, height] = self.unit_mm;
        let w = self.wall_mm;
        let (left, right) = (w, width - w);
        let (low, high) = (w, height - w);
        match self.layout {
            Layout::StackedPair => {
                let (below, above) = (0.5 * (height - w), 0.5 * (height + w));
                vec![
                    [[left, low], [right, below]],
                    [[left, above], [right, high]],
                ]
            }
            Layout::SideBySide => {
                let (before, behind) = (0.5 * (width - w), 0.5 * (width + w));
                vec![
                    [[left, low], [before, high]],
                    [[behind, low], [right, high]],
                ]
            }
            Layout::ThreeChambers => {
                let room = (height - 4.0 * w) / 3.0;
                (0..3)
                    .map(|k| {
                        let bottom = w + f64::from(k) * (room + w);
                        [[left, bottom], [right, bottom + room]]
                    })
                    .collect()
            }
        }
    }

    /// Centres of the domains.
    pub fn centres(&self) -> Vec<Point> {
        self.domains()
            .into_iter()
            .map(|[low, high]| [0, 1].map(|c| f64::midpoint(low[c], high[c])))
            .collect()
    }

    /// Lower and upper bounds of the variables.
    pub fn bounds(&self) -> [Vec<f64>; 2] {
        let (mut lower, mut upper) = (vec![], vec![]);
        for ([low, high], centre) in self.domains().into_iter().zip(self.centres()) {
            for sides in QUADRANTS {
                for c in 0..2 {
                    if sides[c] < 0.0 {
                        lower.push(low[c]);
                        upper.push(centre[c] - self.clearance_mm);
                    } else {
                        lower.push(centre[c] + self.clearance_mm);
                        upper.push(high[c]);
                    }
                }
            }
        }
        [lower, upper]
    }

    /// The paper's common start: at every domain's centre the smallest void that the boxes allow (1 x 1 mm), which lies
    /// at the corner of all its boxes.
    pub fn common_start(&self) -> Vec<f64> {
        let side = 2.0 * self.clearance_mm;
        self.rectangles([side, side])
    }

    /// The design vector of equal rectangles of a width and a height, centred in the domains.
    pub fn rectangles(&self, size_mm: [f64; 2]) -> Vec<f64> {
        self.centres()
            .iter()
            .flat_map(|centre| {
                QUADRANTS
                    .iter()
                    .flat_map(|s| [0, 1].map(|c| centre[c] + 0.5 * s[c] * size_mm[c]))
            })
            .collect()
    }

    /// d variables / d (width, height) of [`LayoutBoxes::rectangles`], one row per variable.
    pub fn rectangle_jacobian(&self) -> Vec<[f64; 2]> {
        (0..self.variables())
            .map(|k| {
                let slope = 0.5 * QUADRANTS[(k / 2) % 4][k % 2];
                if k % 2 == 0 {
                    [slope, 0.0]
                } else {
                    [0.0, slope]
                }
            })
            .collect()
    }

    /// Bounds of width and height.
    pub fn rectangle_bounds(&self) -> [[f64; 2]; 2] {
        let [low, high] = self.domains()[0];
        let least = 2.0 * self.clearance_mm;
        [[least; 2], [high[0] - low[0], high[1] - low[1]]]
    }
}

/// Side of the centre on which corners 1 to 4 lie, (x, y).
const QUADRANTS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

#[cfg(test)]
mod tests {
    use super::*;

    fn of(layout: Layout) -> LayoutBoxes {
        LayoutBoxes {
            layout,
            ..LayoutBoxes::PAPER
        }
    }

    #[test]
    fn the_common_start_is_the_corner_of_all_boxes() {
        for (name, layout) in Layout::NAMES {
            let boxes = of(layout);
            let ([lower, upper], start) = (boxes.bounds(), boxes.common_start());
            assert_eq!(start.len(), boxes.variables(), "{name}");
            for k in 0..start.len() {
                assert!(lower[k] < upper[k]);
                assert!(start[k] == lower[k] || start[k] == upper[k], "{name}, {k}");
            }
        }
    }

    #[test]
    fn the_stacked_pair_has_the_papers_boxes() {
        let ([lower, upper], start) = (
            LayoutBoxes::PAPER.bounds(),
            LayoutBoxes::PAPER.common_start(),
        );
        assert_eq!(start[..8], [39.5, 20.0, 40.5, 20.0, 40.5, 21.0, 39.5, 21.0]);
        assert_eq!(lower[..4], [2.0, 2.0, 40.5, 2.0]);
        assert_eq!(upper[..4], [39.5, 20.0, 78.0, 20.0]);
        assert_eq!(
            (lower[8], lower[9], upper[12], upper[13]),
            (2.0, 41.0, 78.0, 78.0)
        );
    }

    /// Side by side is the stacked pair with x and y changed over; three chambers leave four equal walls.
    #[test]
    fn domains_leave_equal_walls() {
        let turned: Vec<_> = of(Layout::SideBySide)
            .domains()
            .into_iter()
            .map(|corners| corners.map(|[x, y]| [y, x]))
            .collect();
        assert_eq!(turned, LayoutBoxes::PAPER.domains());
        let three = of(Layout::ThreeChambers).domains();
        let heights: Vec<f64> = three.iter().flat_map(|d| d.map(|p| p[1])).collect();
        assert_eq!(heights, [2.0, 26.0, 28.0, 52.0, 54.0, 78.0]);
        assert!(three.iter().all(|[a, b]| [a[0], b[0]] == [2.0, 78.0]));
    }

    #[test]
    fn rectangles_are_linear_in_their_size() {
        for (_, layout) in Layout::NAMES {
            let boxes = of(layout);
            let (a, b) = (
                boxes.rectangles([30.0, 15.0]),
                boxes.rectangles([31.0, 17.0]),
            );
            let jacobian = boxes.rectangle_jacobian();
            assert_eq!(jacobian.len(), a.len());
            for k in 0..a.len() {
                let change = jacobian[k][0] + 2.0 * jacobian[k][1];
                assert!((b[k] - a[k] - change).abs() < 1e-13);
            }
        }
        assert_eq!(
            LayoutBoxes::PAPER.rectangles([40.0, 15.0])[..4],
            [20.0, 13.0, 60.0, 13.0]
        );
    }

    #[test]
    fn channels_have_the_pressure_of_their_chambers() {
        assert_eq!(Layout::ThreeChambers.channel_count(), 2);
        let of_channels = |layout: Layout, p: &[f64]| layout.pressure_of_channels(p);
        assert_eq!(
            of_channels(Layout::ThreeChambers, &[1.0, 2.0, 2.0]),
            [1.0, 2.0]
        );
        assert_eq!(of_channels(Layout::SideBySide, &[3.0, 4.0]), [3.0, 4.0]);
    }
}

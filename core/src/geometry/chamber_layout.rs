//! Which chambers a unit has, and the boxes of their corners: the side constraints of the design vector (Fig. 5a of the
//! paper).
//!
//! Every chamber is a quadrilateral or a hexagon in a domain of its own, a rectangle. Walls of one thickness lie between the
//! domains and around them. Corners go counter-clockwise from the lower left, those of a quadrilateral each in its own quadrant
//! of the domain. A hexagon has two more, in the lower and in the upper side.

use serde::{Deserialize, Serialize};

use super::Point;
use crate::actuation::ActuationCycle;

/// Which chambers a unit holds, and which channels drive them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Two chambers, the lower one driven by channel 0 and the upper one by channel 1.
    StackedPair,
    /// Two chambers, the left one driven by channel 0 and the right one by channel 1.
    SideBySide,
    /// Three chambers on top of each other: the lowest driven by channel 0, the other two by channel 1.
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

/// Corners of a chamber: four, or six.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "usize", try_from = "usize")]
pub enum ChamberCorners {
    /// A quadrilateral.
    #[default]
    Four,
    /// A hexagon: corners 2 and 5 lie between their neighbours in the lower and in the upper side.
    Six,
}

impl ChamberCorners {
    /// Their number.
    pub fn count(self) -> usize {
        self.sides().len()
    }

    /// Side of the domain's centre on which each corner lies, (x, y); 0: either.
    fn sides(self) -> &'static [[f64; 2]] {
        match self {
            Self::Four => &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
            Self::Six => &[
                [-1.0, -1.0],
                [0.0, -1.0],
                [1.0, -1.0],
                [1.0, 1.0],
                [0.0, 1.0],
                [-1.0, 1.0],
            ],
        }
    }
}

impl From<ChamberCorners> for usize {
    fn from(corners: ChamberCorners) -> Self {
        corners.count()
    }
}

impl TryFrom<usize> for ChamberCorners {
    type Error = &'static str;

    fn try_from(count: usize) -> Result<Self, Self::Error> {
        match count {
            4 => Ok(Self::Four),
            6 => Ok(Self::Six),
            _ => Err("a chamber has 4 or 6 corners"),
        }
    }
}

/// The boxes of a layout. Each corner of a quadrilateral lives in its own quadrant of its chamber's domain, so that its edges
/// leave the smallest void at the domain's centre to their left whatever the design. A hexagon's other corners live in the
/// middle half of the width, where they find the middle of any side of such a quadrilateral; that their edges leave the void to
/// their left is a constraint ([`super::validity::ValidityKind::Centre`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayoutBoxes {
    /// Which chambers there are.
    pub layout: Layout,
    /// Corners of each chamber.
    pub corners: ChamberCorners,
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
        corners: ChamberCorners::Four,
        unit_mm: [80.0, 80.0],
        wall_mm: 2.0,
        clearance_mm: 0.5,
    };

    /// Number of chambers of a unit.
    pub fn chambers(&self) -> usize {
        self.layout.channels().len()
    }

    /// Number of variables of a chamber: x and y of its corners.
    pub fn variables_per_chamber(&self) -> usize {
        2 * self.corners.count()
    }

    /// Number of variables of a unit.
    pub fn variables(&self) -> usize {
        self.variables_per_chamber() * self.chambers()
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
            for sides in self.corners.sides() {
                for c in 0..2 {
                    if sides[c] == 0.0 {
                        // Half way between the ends of the neighbours' boxes.
                        let (left, right) =
                            (centre[c] - self.clearance_mm, centre[c] + self.clearance_mm);
                        lower.push(f64::midpoint(low[c], right));
                        upper.push(f64::midpoint(left, high[c]));
                    } else if sides[c] < 0.0 {
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
    /// at the corner of all boxes of a quadrilateral; a hexagon's other corners are the middles of its sides.
    pub fn common_start(&self) -> Vec<f64> {
        let side = 2.0 * self.clearance_mm;
        self.rectangles([side, side])
    }

    /// The design vector of equal rectangles of a width and a height, centred in the domains.
    pub fn rectangles(&self, size_mm: [f64; 2]) -> Vec<f64> {
        self.centres()
            .iter()
            .flat_map(|centre| {
                let sides = self.corners.sides().iter();
                sides.flat_map(|s| [0, 1].map(|c| centre[c] + 0.5 * s[c] * size_mm[c]))
            })
            .collect()
    }

    /// d variables / d (width, height) of [`LayoutBoxes::rectangles`], one row per variable.
    pub fn rectangle_jacobian(&self) -> Vec<[f64; 2]> {
        let of_chamber = self.corners.sides().iter();
        let of_chamber: Vec<_> = of_chamber
            .flat_map(|side| [[0.5 * side[0], 0.0], [0.0, 0.5 * side[1]]])
            .collect();
        of_chamber.repeat(self.chambers())
    }

    /// Bounds of width and height.
    pub fn rectangle_bounds(&self) -> [[f64; 2]; 2] {
        let [low, high] = self.domains()[0];
        let least = 2.0 * self.clearance_mm;
        [[least; 2], [high[0] - low[0], high[1] - low[1]]]
    }
}

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
    fn hexagons_share_the_boxes_of_quadrilaterals() {
        let six = |layout| LayoutBoxes {
            corners: ChamberCorners::Six,
            ..of(layout)
        };
        for (name, layout) in Layout::NAMES {
            let (four, six) = (of(layout), six(layout));
            assert_eq!(six.variables(), four.variables() * 3 / 2, "{name}");
            let outer = |k: &usize| !matches!(k / 2 % 6, 1 | 4);
            let (of_four, of_six) = (four.bounds(), six.bounds());
            for (a, b) in of_four.iter().zip(&of_six) {
                let shared: Vec<f64> = (0..b.len()).filter(outer).map(|k| b[k]).collect();
                assert_eq!(*a, shared, "{name}");
            }
            let start = six.common_start();
            assert!((0..start.len()).all(|k| of_six[0][k] <= start[k] && start[k] <= of_six[1][k]));
        }
        let [lower, upper] = six(Layout::StackedPair).bounds();
        assert_eq!(
            [lower[2], upper[2], lower[3], upper[3]],
            [21.25, 58.75, 2.0, 20.0]
        );
        let start = six(Layout::StackedPair).common_start();
        assert_eq!(start[..6], [39.5, 20.0, 40.0, 20.0, 40.5, 20.0]);
        assert_eq!(ChamberCorners::try_from(5).ok(), None);
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
        let all = Layout::NAMES.into_iter().flat_map(|(_, layout)| {
            [ChamberCorners::Four, ChamberCorners::Six].map(|corners| LayoutBoxes {
                corners,
                ..of(layout)
            })
        });
        for boxes in all {
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

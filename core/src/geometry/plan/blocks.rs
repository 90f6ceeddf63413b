//! From the chambers of a unit to its blocks: one row of chambers, walls between them and around.

use super::Station;
use super::chamber_order::{ChamberRow, chamber_row};
use super::profile::{Block, Profile};
use super::rim::{Piece, sides};
use super::size_rule::{SizeRule, Span};
use crate::geometry::{Actuator, InfeasibleGeometry, Point, polygon};

/// A wall between two chambers is sheared if facing corners are farther apart along it than across it by this factor.
const SHEARED: f64 = 4.0;

/// Where a chamber lies among the blocks of its unit.
pub(super) struct Placed {
    pub(super) column_block: usize,
    pub(super) row_block: usize,
    /// Bottom, right, top, left; each in the direction of growing column or row.
    pub(super) sides: [Vec<Piece>; 4],
}

/// The blocks of a unit.
pub(super) struct Blocks {
    pub(super) columns: Vec<Block>,
    pub(super) rows: Vec<Block>,
    pub(super) chambers: Vec<Placed>,
}

fn unsupported(unit: usize, detail: impl Into<String>) -> InfeasibleGeometry {
    InfeasibleGeometry::UnsupportedLayout {
        unit,
        detail: detail.into(),
    }
}

pub(super) fn blocks_of_unit(
    actuator: &Actuator,
    unit: usize,
    rule: &SizeRule,
) -> Result<Blocks, InfeasibleGeometry> {
    let [width, height] = actuator.unit_mm;
    let chambers = &actuator.units[unit].chambers_mm;
    for corners in chambers {
        if corners.len() < 3 {
            return Err(unsupported(unit, "a chamber with fewer than 3 corners"));
        }
        if corners.len() > 8 {
            return Err(unsupported(
                unit,
                format!("a chamber with {} corners", corners.len()),
            ));
        }
        let inside = corners
            .iter()
            .all(|p| p[0] > 0.0 && p[0] < width && p[1] > 0.0 && p[1] < height);
        if !inside || polygon::signed_area(corners) <= 0.0 {
            return Err(unsupported(
                unit,
                "a chamber that is not inside its unit, counter-clockwise",
            ));
        }
    }
    let ChamberRow { order, stacked } =
        chamber_row(chambers).map_err(|detail| unsupported(unit, detail))?;
    let placed: Vec<[Vec<Piece>; 4]> = (0..chambers.len())
        .map(|c| sides(&actuator.rounded(unit, c)))
        .collect();
    if order.is_empty() {
        let whole = |length| Block {
            profiles: vec![Profile {
                spans: vec![Span {
                    length,
                    graded: [false; 2],
                    shortest: f64::INFINITY,
                    wall: false,
                }],
                least: 2,
            }],
            sheared: false,
        };
        return Ok(Blocks {
            columns: vec![whole(width)],
            rows: vec![whole(height)],
            chambers: vec![],
        });
    }
    // Across the stacking direction all chambers share one interval; along it each has its own.
    let (across, along) = if stacked { (0, 1) } else { (1, 0) };
    let size = [width, height];
    let rim = |which: &[usize], axis: usize| Block {
        profiles: which
            .iter()
            .flat_map(|c| {
                let pair = if axis == 0 { [0, 2] } else { [1, 3] };
                pair.map(|side| Profile {
                    spans: placed[*c][side].iter().map(|p| p.span).collect(),
                    least: 2,
                })
            })
            .collect(),
        sheared: false,
    };
    let side_of = |chamber: usize, axis: usize, high: bool| {
        &placed[chamber][match (axis, high) {
            (0, false) => 3,
            (0, true) => 1,
            (_, false) => 0,
            (_, true) => 2,
        }]
    };
    let mean_place = |chamber: usize, axis: usize, high: bool| {
        let pieces = side_of(chamber, axis, high);
        let place =
            |edge: usize, fraction: f64| Station { edge, fraction }.at(&chambers[chamber])[axis];
        let total: f64 = pieces.iter().map(|p| p.span.length).sum();
        pieces
            .iter()
            .map(|p| 0.5 * (place(p.edge, p.from) + place(p.edge, p.to)) * p.span.length / total)
            .sum::<f64>()
    };
    let shortest = |chamber: usize| {
        placed[chamber]
            .iter()
            .flatten()
            .map(|p| p.span.shortest)
            .fold(f64::INFINITY, f64::min)
    };
    let radius = |chamber: usize| actuator.rounded(unit, chamber).least_radius_mm();
    let wall = |which: &[usize], axis: usize, high: bool| Block {
        profiles: which
            .iter()
            .map(|c| {
                let place = mean_place(*c, axis, high);
                let span = Span {
                    length: if high { size[axis] - place } else { place },
                    graded: [high, !high],
                    shortest: shortest(*c),
                    wall: true,
                };
                Profile {
                    spans: span.layered(radius(*c)),
                    least: rule.through_wall,
                }
            })
            .collect(),
        sheared: false,
    };
    let across_blocks = vec![
        wall(&order, across, false),
        rim(&order, across),
        wall(&order, across, true),
    ];
    let between = |low: usize, high: usize| {
        let gap = mean_place(high, along, false) - mean_place(low, along, true);
        let ends = |chamber: usize, high: bool| {
            let pieces = side_of(chamber, along, high);
            let (first, last) = (pieces[0], pieces[pieces.len() - 1]);
            [(first.edge, first.from), (last.edge, last.to)]
                .map(|(edge, fraction)| Station { edge, fraction }.at(&chambers[chamber]))
        };
        let facing = ends(low, true).into_iter().zip(ends(high, false));
        let sheared = |(a, b): (Point, Point)| {
            (b[across] - a[across]).abs() > SHEARED * (b[along] - a[along]).abs()
        };
        Block {
            sheared: facing.into_iter().any(sheared),
            profiles: vec![Profile {
                spans: Span {
                    length: gap.max(0.1),
                    graded: [true; 2],
                    shortest: shortest(low).min(shortest(high)),
                    wall: true,
                }
                .layered(radius(low).min(radius(high))),
                least: rule.through_wall,
            }],
        }
    };
    let mut along_blocks = vec![wall(&order[..1], along, false)];
    for (k, chamber) in order.iter().enumerate() {
        if k > 0 {
            along_blocks.push(between(order[k - 1], *chamber));
        }
        along_blocks.push(rim(&[*chamber], along));
    }
    along_blocks.push(wall(&order[order.len() - 1..], along, true));
    let mut placed: Vec<Option<[Vec<Piece>; 4]>> = placed.into_iter().map(Some).collect();
    let chambers = (0..order.len())
        .filter_map(|c| {
            let position = order.iter().position(|o| *o == c)?;
            let sides = placed[c].take()?;
            let (own, shared) = (2 * position + 1, 1);
            Some(Placed {
                column_block: if stacked { shared } else { own },
                row_block: if stacked { own } else { shared },
                sides,
            })
        })
        .collect();
    let (columns, rows) = if stacked {
        (across_blocks, along_blocks)
    } else {
        (along_blocks, across_blocks)
    };
    Ok(Blocks {
        columns,
        rows,
        chambers,
    })
}

//! From blocks and counts to the plan: block lines, strips between them, and the rims of chambers on them.

use super::blocks::Blocks;
use super::layout::Counts;
use super::profile::{Block, Profile};
use super::rim::Piece;
use super::size_rule::SizeRule;
use super::{ChamberPlan, MeshPlan, PlanElement, Station, Strip, UnitPlan};
use crate::geometry::Actuator;

/// Blocks that one macro strip may span, in element lines, before it is cut again.
const LINES_PER_STRIP: usize = 2;
/// Largest number of strips between two forced cuts.
const STRIPS_PER_STRETCH: usize = 4;
/// A sheared wall between two chambers has every element line as a block line, up to this number, which lets the blocks bend
/// through it.
const STRIPS_OF_SHEARED: usize = 6;

/// The place of every element line of a rim side, and the lines at which polygon corners lie.
fn stations(pieces: &[Piece], rule: &SizeRule, n: usize, corners: usize) -> Vec<Station> {
    let profile = Profile {
        spans: pieces.iter().map(|p| p.span).collect(),
        least: 0,
    };
    let mut stations = vec![];
    for (piece, count) in pieces.iter().zip(profile.share(rule, n)) {
        let lines = rule.lines(piece.span, count);
        let skip = usize::from(!stations.is_empty());
        for (k, s) in lines.iter().enumerate().skip(skip) {
            let fraction = if k == count {
                piece.to
            } else {
                piece.from + (piece.to - piece.from) * s / piece.span.length
            };
            stations.push(if fraction == 1.0 {
                Station {
                    edge: (piece.edge + 1) % corners,
                    fraction: 0.0,
                }
            } else {
                Station {
                    edge: piece.edge,
                    fraction,
                }
            });
        }
    }
    stations
}

/// First line of every block, and the last line.
fn block_starts(counts: &[usize]) -> Vec<usize> {
    let mut starts = vec![0];
    for n in counts {
        starts.push(starts[starts.len() - 1] + n);
    }
    starts
}

/// The element lines of a block that have to be block lines: where polygon corners lie, and those of a sheared wall.
fn forced_cuts(block: &Block, rule: &SizeRule, start: usize, n: usize) -> Vec<usize> {
    let step = if block.sheared {
        n.div_ceil(STRIPS_OF_SHEARED)
    } else {
        n
    };
    let inner = (step..n).step_by(step).map(|line| start + line);
    block
        .profiles
        .iter()
        .flat_map(|p| p.lines(rule, n).1)
        .map(|cut| start + cut)
        .chain(inner)
        .collect()
}

/// Cuts stretches between forced cuts into strips.
fn strip_lines(mut cuts: Vec<usize>) -> Vec<usize> {
    cuts.sort_unstable();
    cuts.dedup();
    let mut lines = vec![cuts[0]];
    for pair in cuts.windows(2) {
        let n = pair[1] - pair[0];
        let strips = n.div_ceil(LINES_PER_STRIP).clamp(1, STRIPS_PER_STRETCH);
        for k in 1..=strips {
            lines.push(pair[0] + n * k / strips);
        }
    }
    lines
}

/// The strips between macro lines; element lines within them are the mean of what all profiles ask.
fn strips(lines: &[usize], asked: &[(&Block, usize, usize)], rule: &SizeRule) -> Vec<Strip> {
    lines
        .windows(2)
        .map(|pair| {
            let (a, b) = (pair[0], pair[1]);
            let mut sum = vec![0.0; b - a - 1];
            let (mut number, mut width) = (0.0, 0.0);
            for (block, start, n) in asked {
                if a < *start || b > start + n {
                    continue;
                }
                for profile in &block.profiles {
                    let (s, _) = profile.lines(rule, *n);
                    let (first, last) = (s[a - start], s[b - start]);
                    for (k, value) in sum.iter_mut().enumerate() {
                        *value += (s[a - start + k + 1] - first) / (last - first);
                    }
                    number += 1.0;
                    width += last - first;
                }
            }
            Strip {
                fractions: sum.iter().map(|v| v / number).collect(),
                width_mm: width / number,
            }
        })
        .collect()
}

pub(super) fn assemble(
    actuator: &Actuator,
    element: PlanElement,
    rule: &SizeRule,
    blocks: &[Blocks],
    counts: &Counts,
) -> MeshPlan {
    let mut row_cuts = vec![];
    let mut asked_rows = vec![];
    for (unit, n) in blocks.iter().zip(&counts.rows) {
        let starts = block_starts(n);
        for (block, (start, n)) in unit.rows.iter().zip(starts.iter().zip(n)) {
            row_cuts.extend(forced_cuts(block, rule, *start, *n));
            asked_rows.push((block, *start, *n));
        }
        row_cuts.extend(starts);
    }
    let row_lines = strip_lines(row_cuts);
    let rows = strips(&row_lines, &asked_rows, rule);
    let units = blocks
        .iter()
        .enumerate()
        .map(|(u, unit)| {
            let (columns, row_counts) = (&counts.columns[u], &counts.rows[u]);
            let (starts, row_starts) = (block_starts(columns), block_starts(row_counts));
            let mut cuts = starts.clone();
            let mut asked = vec![];
            for (block, (start, n)) in unit.columns.iter().zip(starts.iter().zip(columns)) {
                cuts.extend(forced_cuts(block, rule, *start, *n));
                asked.push((block, *start, *n));
            }
            let lines = strip_lines(cuts);
            let chambers = unit
                .chambers
                .iter()
                .enumerate()
                .map(|(c, placed)| {
                    let corners = actuator.units[u].chambers_mm[c].len();
                    let (cb, rb) = (placed.column_block, placed.row_block);
                    let column_range = [starts[cb], starts[cb + 1]];
                    let row_range = [row_starts[rb], row_starts[rb + 1]];
                    let on = |side: usize, range: [usize; 2], lines: &[usize]| {
                        let all = stations(&placed.sides[side], rule, range[1] - range[0], corners);
                        lines
                            .iter()
                            .filter(|l| (range[0]..=range[1]).contains(*l))
                            .map(|l| all[l - range[0]])
                            .collect::<Vec<_>>()
                    };
                    let [bottom, top] = [0, 2].map(|s| on(s, column_range, &lines));
                    let [right, left] = [1, 3].map(|s| on(s, row_range, &row_lines));
                    let mut ring = bottom[..bottom.len() - 1].to_vec();
                    ring.extend(&right[..right.len() - 1]);
                    ring.extend(top[1..].iter().rev());
                    ring.extend(left[1..].iter().rev());
                    let index = |lines: &[usize], line: usize| {
                        lines.iter().position(|l| *l == line).unwrap_or(0)
                    };
                    ChamberPlan {
                        columns: column_range.map(|l| index(&lines, l)),
                        rows: row_range.map(|l| index(&row_lines, l)),
                        ring,
                    }
                })
                .collect();
            UnitPlan {
                columns: strips(&lines, &asked, rule),
                chambers,
            }
        })
        .collect();
    MeshPlan {
        element,
        base: actuator.clone(),
        units,
        rows,
    }
}

//! From chambers to blocks: which blocks a unit has, how many elements each gets, where its lines lie.

use super::rim::{Piece, sides};
use super::size_rule::{SizeRule, Span};
use super::{ChamberPlan, MeshPlan, PlanElement, Station, Strip, UnitPlan};
use crate::geometry::block_map::BlockMap;
use crate::geometry::{Actuator, InfeasibleGeometry, Point, polygon};

/// Blocks that one macro strip may span, in element lines, before it is cut again.
const LINES_PER_STRIP: usize = 2;
/// Largest number of strips between two forced cuts.
const STRIPS_PER_STRETCH: usize = 4;
/// A wall between two chambers is sheared if facing corners are farther apart along it than across it by this factor; then
/// every element line is a block line, up to a number, which lets the blocks bend through the wall.
const SHEARED: f64 = 4.0;
const STRIPS_OF_SHEARED: usize = 6;

/// What one chamber side or one wall asks of its block: consecutive spans.
#[derive(Clone, Debug, Default)]
struct Profile {
    spans: Vec<Span>,
    least: usize,
}

impl Profile {
    fn count(&self, rule: &SizeRule) -> usize {
        let wanted: usize = self.spans.iter().map(|s| rule.count(*s)).sum();
        wanted.max(self.least)
    }

    /// Elements of each span when the profile gets n in all.
    fn share(&self, rule: &SizeRule, n: usize) -> Vec<usize> {
        let mut counts: Vec<usize> = self.spans.iter().map(|s| rule.count(*s)).collect();
        for _ in counts.iter().sum::<usize>()..n {
            let size = |k: usize| self.spans[k].length / counts[k] as f64;
            let longest = (0..counts.len())
                .max_by(|a, b| size(*a).total_cmp(&size(*b)))
                .unwrap_or(0);
            counts[longest] += 1;
        }
        counts
    }

    /// Lines of the profile when it gets n elements, as lengths; and the indices where spans meet.
    fn lines(&self, rule: &SizeRule, n: usize) -> (Vec<f64>, Vec<usize>) {
        let (mut lines, mut cuts) = (vec![0.0], vec![]);
        for (span, count) in self.spans.iter().zip(self.share(rule, n)) {
            let start = lines[lines.len() - 1];
            lines.extend(rule.lines(*span, count)[1..].iter().map(|s| start + s));
            cuts.push(lines.len() - 1);
        }
        cuts.pop();
        (lines, cuts)
    }

    fn length(&self) -> f64 {
        self.spans.iter().map(|s| s.length).sum()
    }
}

/// One interval of a unit's columns or rows: a wall, or the rim of chambers.
#[derive(Clone, Debug, Default)]
struct Block {
    profiles: Vec<Profile>,
    /// Whether it is a sheared wall between two chambers.
    sheared: bool,
}

impl Block {
    fn count(&self, rule: &SizeRule) -> usize {
        self.profiles
            .iter()
            .map(|p| p.count(rule))
            .max()
            .unwrap_or(1)
    }

    fn length(&self) -> f64 {
        self.profiles
            .iter()
            .map(Profile::length)
            .fold(0.0, f64::max)
    }
}

struct Placed {
    column_block: usize,
    row_block: usize,
    /// Bottom, right, top, left; each in the direction of growing column or row.
    sides: [Vec<Piece>; 4],
}

struct Blocks {
    columns: Vec<Block>,
    rows: Vec<Block>,
    chambers: Vec<Placed>,
}

/// Element counts of the blocks of every unit.
struct Counts {
    columns: Vec<Vec<usize>>,
    rows: Vec<Vec<usize>>,
}

pub(super) fn choose(
    actuator: &Actuator,
    element: PlanElement,
    max_size_mm: Option<f64>,
) -> Result<MeshPlan, InfeasibleGeometry> {
    let distinct = if actuator.repeated {
        1
    } else {
        actuator.units.len()
    };
    let rule = SizeRule::new(
        element,
        actuator.unit_mm,
        max_size_mm,
        actuator.corner_radius_mm,
    );
    let blocks = (0..distinct)
        .map(|k| blocks_of_unit(actuator, k, &rule))
        .collect::<Result<Vec<_>, _>>()?;
    let count = |list: &[Block]| list.iter().map(|b| b.count(&rule)).collect::<Vec<_>>();
    let mut counts = Counts {
        columns: blocks.iter().map(|b| count(&b.columns)).collect(),
        rows: blocks.iter().map(|b| count(&b.rows)).collect(),
    };
    level_rows(&blocks, &mut counts.rows);
    let mut plan = assemble(actuator, element, &rule, &blocks, &counts);
    let Some(limit) = max_size_mm else {
        return Ok(plan);
    };
    // The blocks' shapes depend on the counts, so measure, add lines, and measure again.
    for _ in 0..12 {
        let map = BlockMap::solve(&plan, actuator)?;
        let longest = map.longest_edges(&plan);
        let mut grown = false;
        let mut grow = |counts: &mut Vec<usize>, longest: &[f64]| {
            let mut start = 0;
            for n in counts {
                let size = longest[start..start + *n]
                    .iter()
                    .copied()
                    .fold(0.0, f64::max);
                start += *n;
                if size > limit {
                    *n = (*n + 1).max((*n as f64 * size / limit * 0.98).ceil() as usize);
                    grown = true;
                }
            }
        };
        for (counts, longest) in counts.columns.iter_mut().zip(&longest.columns) {
            grow(counts, longest);
        }
        for counts in &mut counts.rows {
            grow(counts, &longest.rows);
        }
        if !grown {
            break;
        }
        level_rows(&blocks, &mut counts.rows);
        plan = assemble(actuator, element, &rule, &blocks, &counts);
    }
    Ok(plan)
}

/// Gives every unit the same number of rows: the largest of its kind block by block, then of all kinds in sum.
fn level_rows(blocks: &[Blocks], rows: &mut [Vec<usize>]) {
    let kinds: Vec<usize> = rows.iter().map(Vec::len).collect();
    for a in 0..rows.len() {
        for b in 0..rows.len() {
            if kinds[a] == kinds[b] {
                for block in 0..kinds[a] {
                    rows[a][block] = rows[a][block].max(rows[b][block]);
                }
            }
        }
    }
    let most = rows.iter().map(|r| r.iter().sum()).max().unwrap_or(0);
    for a in 0..rows.len() {
        let lengths: Vec<f64> = (0..kinds[a])
            .map(|block| {
                (0..rows.len())
                    .filter(|b| kinds[*b] == kinds[a])
                    .map(|b| blocks[b].rows[block].length())
                    .fold(0.0, f64::max)
            })
            .collect();
        for _ in rows[a].iter().sum::<usize>()..most {
            let size = |block: usize| lengths[block] / rows[a][block] as f64;
            let longest = (0..kinds[a])
                .max_by(|p, q| size(*p).total_cmp(&size(*q)))
                .unwrap_or(0);
            rows[a][longest] += 1;
        }
    }
}

fn unsupported(unit: usize, detail: impl Into<String>) -> InfeasibleGeometry {
    InfeasibleGeometry::UnsupportedLayout {
        unit,
        detail: detail.into(),
    }
}

fn blocks_of_unit(
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
    // Order of the chambers along the stacking direction, and that direction.
    let (order, stacked): (Vec<usize>, bool) = match chambers.len() {
        0 => (vec![], true),
        1 => (vec![0], true),
        2 => {
            let offset = polygon::separation(&chambers[0], &chambers[1])
                .ok_or_else(|| unsupported(unit, "chambers that touch or overlap"))?;
            let stacked = offset[1].abs() >= offset[0].abs();
            let first_is_low = offset[usize::from(stacked)] > 0.0;
            (if first_is_low { vec![0, 1] } else { vec![1, 0] }, stacked)
        }
        n => return Err(unsupported(unit, format!("{n} chambers in one unit"))),
    };
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
    let mut along_blocks = vec![wall(&order[..1], along, false), rim(&order[..1], along)];
    if let [low, high] = order[..] {
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
        along_blocks.push(Block {
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
        });
        along_blocks.push(rim(&order[1..], along));
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

fn assemble(
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

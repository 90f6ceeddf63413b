//! From chambers to a plan: how many elements the blocks of each unit get.

use super::assembly::assemble;
use super::blocks::{Blocks, blocks_of_unit};
use super::profile::Block;
use super::size_rule::SizeRule;
use super::{MeshPlan, MeshSize, PlanElement};
use crate::geometry::block_map::BlockMap;
use crate::geometry::polygon::signed_area;
use crate::geometry::{Actuator, InfeasibleGeometry};

/// Halvings, in the logarithm, of the range of sizes from a quarter to 16 times the mean one: to 0.1 %.
const MEAN_HALVINGS: usize = 12;

/// Element counts of the blocks of every unit.
pub(super) struct Counts {
    pub(super) columns: Vec<Vec<usize>>,
    pub(super) rows: Vec<Vec<usize>>,
}

pub(super) fn choose(
    actuator: &Actuator,
    element: PlanElement,
    size: MeshSize,
) -> Result<MeshPlan, InfeasibleGeometry> {
    match size {
        MeshSize::Rule => Ok(Draft::new(actuator, element, None)?.plan(actuator, element)),
        MeshSize::Longest(limit) => with_longest_edge(actuator, element, limit),
        MeshSize::Mean(side) => with_mean_size(actuator, element, side),
    }
}

/// A plan that can be given more lines.
struct Draft {
    rule: SizeRule,
    blocks: Vec<Blocks>,
    counts: Counts,
}

impl Draft {
    fn new(
        actuator: &Actuator,
        element: PlanElement,
        size_mm: Option<f64>,
    ) -> Result<Self, InfeasibleGeometry> {
        let distinct = if actuator.repeated {
            1
        } else {
            actuator.units.len()
        };
        let rule = SizeRule::new(
            element,
            actuator.unit_mm,
            size_mm,
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
        Ok(Self {
            rule,
            blocks,
            counts,
        })
    }

    fn plan(&self, actuator: &Actuator, element: PlanElement) -> MeshPlan {
        assemble(actuator, element, &self.rule, &self.blocks, &self.counts)
    }
}

/// The coarsest plan of sizes, graded over one level, that has as many elements as squares of the given side fill the
/// solid. Where strips stretch in the map, their longest edges are longer than that.
fn with_mean_size(
    actuator: &Actuator,
    element: PlanElement,
    side_mm: f64,
) -> Result<MeshPlan, InfeasibleGeometry> {
    let [w, h] = actuator.unit_mm;
    let chambers = actuator.units.iter().flat_map(|unit| &unit.chambers_mm);
    let cavities: f64 = chambers.map(|corners| signed_area(corners).abs()).sum();
    let solid = w * h * actuator.units.len() as f64 - cavities;
    let wanted = solid / (side_mm * side_mm);
    let at = |size: f64| Ok(Draft::new(actuator, element, Some(size))?.plan(actuator, element));
    let (mut fine, mut coarse) = (0.25 * side_mm, 16.0 * side_mm);
    let mut plan = at(fine)?;
    for _ in 0..MEAN_HALVINGS {
        let middle = (fine * coarse).sqrt();
        let tried = at(middle)?;
        if tried.elements() as f64 >= wanted {
            fine = middle;
            plan = tried;
        } else {
            coarse = middle;
        }
    }
    Ok(plan)
}

fn with_longest_edge(
    actuator: &Actuator,
    element: PlanElement,
    limit: f64,
) -> Result<MeshPlan, InfeasibleGeometry> {
    let mut draft = Draft::new(actuator, element, Some(limit))?;
    let mut plan = draft.plan(actuator, element);
    // The blocks' shapes depend on the counts, so measure, add lines, and measure again.
    for _ in 0..12 {
        let map = BlockMap::solve(&plan, actuator)?;
        let longest = map.longest_edges(&plan);
        let Draft { counts, blocks, .. } = &mut draft;
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
        level_rows(blocks, &mut counts.rows);
        plan = draft.plan(actuator, element);
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

//! The block map: where the vertices of a plan's blocks lie, as a smooth function of the chambers' corners.
//!
//! Vertices on a chamber's rim lie at fixed fractions of its edges; vertices on the outline and on the faces between
//! units slide along them; the others are free. Free and sliding vertices minimise the sum of the blocks' energies
//! ([`energy`]) towards targets that are frozen in the plan, so their positions x(c) satisfy g(x, c) = 0 with g the
//! energy's gradient, and x'(c) = -H^-1 g_c exactly: a transpose product is one solve with the factor of H.
//!
//! Copies of one unit share one map; its left and right faces are tied, so that the copies fit together.

mod energy;
mod envelope;
mod topology;

use super::{Actuator, InfeasibleGeometry, MeshPlan, Point, Rounded};
use energy::{Derivatives, Measure, Target};
use envelope::Envelope;
use topology::{Block, NONE, Topology};

/// Newton steps of the minimisation, and rounds of untangling.
const MAX_STEPS: usize = 200;
/// The eps of a guess that is not folded, and the determinant above which it needs no untangling.
const FIRST_EPS: f64 = 0.1;
/// The sliver measure joins after a full step that moves no vertex farther than this part of the chain's length: far from
/// the minimum its fourth power takes many steps.
const SETTLED: f64 = 1e-2;
/// Parts of the Hessian's indefinite terms that are left out where it is not definite, from the first to all.
const LEAST_RELIEF: f64 = 0.02;
const RELIEF_GROWTH: f64 = 2.5;

/// Solved positions of the blocks' vertices.
#[derive(Clone, Debug)]
pub struct BlockMap {
    topology: Topology,
    targets: Vec<Target>,
    positions: Vec<Point>,
    /// Chambers of the solved units.
    chambers: Vec<Vec<Rounded>>,
    /// Factor of the energy's Hessian at the solution.
    factor: Envelope,
    /// Newton steps taken.
    pub steps: usize,
    /// Part of the Hessian's indefinite terms that the next step leaves out.
    relief: f64,
}

/// What a Newton step did.
struct Step {
    /// Largest move of a vertex, mm.
    size: f64,
    /// Whether the Hessian was exact.
    exact: bool,
    /// Whether the whole step was taken.
    full: bool,
}

/// Longest element edges along the element columns of each unit and along the element rows.
pub(crate) struct LongestEdges {
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) rows: Vec<f64>,
}

impl BlockMap {
    /// Solves the map of a design.
    pub fn solve(plan: &MeshPlan, actuator: &Actuator) -> Result<Self, InfeasibleGeometry> {
        let topology = Topology::new(plan);
        let base = spring_guess(&topology, plan, &plan.base)?;
        let targets = topology
            .blocks
            .iter()
            .map(|b| target(&corners(&base, b)))
            .collect();
        let positions = if *actuator == plan.base {
            base
        } else {
            spring_guess(&topology, plan, actuator)?
        };
        let chambers = (0..topology.grids.len())
            .map(|u| {
                let count = actuator.units[u].chambers_mm.len();
                (0..count).map(|c| actuator.rounded(u, c)).collect()
            })
            .collect();
        let factor = topology.matrix();
        let mut map = Self {
            topology,
            targets,
            positions,
            chambers,
            factor,
            steps: 0,
            relief: 0.0,
        };
        map.untangle();
        map.minimise()?;
        Ok(map)
    }

    /// Number of units that the map solves for: 1 where all units are copies.
    pub fn units(&self) -> usize {
        self.topology.grids.len()
    }

    /// Vertex index at a column line and a row line of a unit; `None` inside a chamber.
    pub fn vertex(&self, plan: &MeshPlan, unit: usize, i: usize, j: usize) -> Option<usize> {
        let lines_x = plan.units[unit].columns.len() + 1;
        let v = self.topology.grids[unit][j * lines_x + i];
        (v != NONE).then_some(v as usize)
    }

    /// Vertex positions, mm, in the frame of the first unit.
    pub fn positions(&self) -> &[Point] {
        &self.positions
    }

    /// A chamber of a solved unit.
    pub fn chamber(&self, unit: usize, chamber: usize) -> &Rounded {
        &self.chambers[unit][chamber]
    }

    /// Gradient with respect to the corners, per solved unit and chamber, from one with respect to the vertices.
    pub fn pull_back(&self, plan: &MeshPlan, vertex_gradient: &[Point]) -> Vec<Vec<Vec<Point>>> {
        let mut adjoint = vec![0.0; self.topology.size()];
        for (g, unknowns) in vertex_gradient.iter().zip(&self.topology.unknowns) {
            for c in 0..2 {
                if unknowns[c] != NONE {
                    adjoint[unknowns[c] as usize] += g[c];
                }
            }
        }
        self.factor.solve(&mut adjoint);
        // What reaches a rim vertex: its own gradient, and -g_c^T H^-1 of the others through the blocks that touch it.
        let mut reach = vertex_gradient.to_vec();
        for (block, target) in self.topology.blocks.iter().zip(&self.targets) {
            let prescribed = |v: u32| self.topology.unknowns[v as usize] == [NONE; 2];
            if !block.vertices.into_iter().any(prescribed) {
                continue;
            }
            let Derivatives { convex, bent, .. } =
                energy::derivatives(&corners(&self.positions, block), *target, Measure::Full);
            for p in 0..8 {
                let v = block.vertices[p / 2];
                if !prescribed(v) {
                    continue;
                }
                for q in 0..8 {
                    let unknown = self.topology.unknowns[block.vertices[q / 2] as usize][q % 2];
                    if unknown != NONE {
                        reach[v as usize][p % 2] -=
                            (convex[p][q] + bent[p][q]) * adjoint[unknown as usize];
                    }
                }
            }
        }
        plan.units
            .iter()
            .enumerate()
            .map(|(u, unit)| {
                unit.chambers
                    .iter()
                    .zip(&self.topology.rims[u])
                    .zip(&self.chambers[u])
                    .map(|((chamber, rim), rounded)| {
                        let mut gradient = vec![[0.0; 2]; rounded.corners().len()];
                        for (station, v) in chamber.ring.iter().zip(rim) {
                            rounded.add_slopes(*station, reach[*v as usize], &mut gradient);
                        }
                        gradient
                    })
                    .collect()
            })
            .collect()
    }

    /// Longest edges of the elements into which the plan cuts the blocks.
    pub(crate) fn longest_edges(&self, plan: &MeshPlan) -> LongestEdges {
        let mut columns: Vec<Vec<f64>> = plan
            .units
            .iter()
            .map(|u| vec![0.0; u.columns.iter().map(super::Strip::elements).sum()])
            .collect();
        let mut rows = vec![0.0; plan.rows.iter().map(super::Strip::elements).sum()];
        let widen = |into: &mut [f64], strips: &[super::Strip], strip: usize, length: f64| {
            let start: usize = strips[..strip].iter().map(super::Strip::elements).sum();
            let lines: Vec<f64> = strips[strip].lines().collect();
            for (k, pair) in lines.windows(2).enumerate() {
                into[start + k] = into[start + k].max(length * (pair[1] - pair[0]));
            }
        };
        for block in &self.topology.blocks {
            let [a, b, c, d] = corners(&self.positions, block);
            let length = |p, q| super::polygon::distance(p, q);
            let strips = &plan.units[block.unit].columns;
            let (across, up) = (
                length(a, b).max(length(d, c)),
                length(a, d).max(length(b, c)),
            );
            widen(&mut columns[block.unit], strips, block.column, across);
            widen(&mut rows, &plan.rows, block.row, up);
        }
        LongestEdges { columns, rows }
    }

    fn energy(&self, positions: &[Point], measure: Measure) -> f64 {
        let mut sum = 0.0;
        for (block, target) in self.topology.blocks.iter().zip(&self.targets) {
            sum += energy::value(&corners(positions, block), *target, measure);
            if sum == f64::INFINITY {
                break;
            }
        }
        sum
    }

    fn least_determinant(&self) -> f64 {
        let blocks = self.topology.blocks.iter().zip(&self.targets);
        blocks
            .flat_map(|(b, t)| energy::determinants(&corners(&self.positions, b), *t))
            .fold(f64::INFINITY, f64::min)
    }

    /// Fills `factor` with the factorised Hessian, less the part `relief` of its indefinite terms; that part grows until
    /// the rest is definite, and shrinks for the next step. Returns the gradient, and whether the Hessian was exact.
    fn linearise(&mut self, measure: Measure) -> (Vec<f64>, bool) {
        let blocks = self.topology.blocks.iter().zip(&self.targets);
        let derivatives: Vec<Derivatives> = blocks
            .map(|(b, t)| energy::derivatives(&corners(&self.positions, b), *t, measure))
            .collect();
        let mut relief = self.relief;
        loop {
            let mut gradient = vec![0.0; self.topology.size()];
            self.factor = self.topology.matrix();
            for (block, d) in self.topology.blocks.iter().zip(&derivatives) {
                let mut hessian = d.convex;
                if relief < 1.0 {
                    for (h, bent) in hessian.iter_mut().flatten().zip(d.bent.iter().flatten()) {
                        *h += (1.0 - relief) * bent;
                    }
                }
                self.topology.scatter(
                    block,
                    &d.gradient,
                    &hessian,
                    &mut gradient,
                    &mut self.factor,
                );
            }
            if relief >= 1.0 {
                let shift = 1e-10 * self.factor.largest_diagonal();
                self.factor.shift(shift);
            }
            if self.factor.factorise() || relief >= 1.0 {
                let less = relief / (RELIEF_GROWTH * RELIEF_GROWTH);
                self.relief = if less < LEAST_RELIEF { 0.0 } else { less };
                return (gradient, relief == 0.0);
            }
            relief = (RELIEF_GROWTH * relief).clamp(LEAST_RELIEF, 1.0);
        }
    }

    /// One Newton step with backtracking; `None` where no step lowers the energy.
    fn step(&mut self, measure: Measure) -> Option<Step> {
        self.steps += 1;
        let (gradient, exact) = self.linearise(measure);
        let mut step: Vec<f64> = gradient.iter().map(|g| -g).collect();
        self.factor.solve(&mut step);
        let slope: f64 = gradient.iter().zip(&step).map(|(g, s)| g * s).sum();
        let size = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        if !size.is_finite() {
            return None;
        }
        let before = self.energy(&self.positions, measure);
        let mut scale = 1.0;
        for _ in 0..40 {
            let moved = self.topology.moved(&self.positions, &step, scale);
            let after = self.energy(&moved, measure);
            if after <= before + 1e-4 * scale * slope + 1e-13 * before.abs() {
                self.positions = moved;
                return Some(Step {
                    size: scale * size,
                    exact,
                    full: scale == 1.0,
                });
            }
            scale *= 0.5;
        }
        None
    }

    /// Brings the determinants above zero, and well above where the guess hardly is, with a regularised energy. Its eps
    /// follows the worst determinant, and once nothing is folded shrinks until the barrier of eps = 0 is no longer felt as
    /// a wall.
    fn untangle(&mut self) {
        let mut eps = FIRST_EPS;
        for _ in 0..MAX_STEPS {
            let worst = self.least_determinant();
            if worst > eps {
                return;
            }
            eps = if worst > 0.0 {
                0.5 * eps
            } else {
                (1e-6 + 0.04 * worst * worst).sqrt()
            };
            self.relief = 1.0;
            if self.step(Measure::Regular { eps }).is_none() {
                return;
            }
        }
    }

    fn minimise(&mut self) -> Result<(), InfeasibleGeometry> {
        if self.least_determinant() <= 0.0 {
            return Err(self.folded());
        }
        let scale = self
            .positions
            .iter()
            .flatten()
            .fold(0.0_f64, |m, p| m.max(p.abs()));
        let mut measure = Measure::Barrier;
        let mut last = 0;
        self.relief = 0.0;
        for _ in 0..MAX_STEPS {
            let Some(Step { size, exact, full }) = self.step(measure) else {
                break;
            };
            // Quadratic convergence: the step after a small one is below round-off.
            if exact && size < 1e-7 * scale {
                last += 1;
                if last == 2 {
                    break;
                }
            }
            if full && size < SETTLED * scale && !matches!(measure, Measure::Full) {
                measure = Measure::Full;
                last = 0;
            }
        }
        self.relief = 0.0;
        let (_, exact) = self.linearise(Measure::Full);
        if exact && last > 0 {
            Ok(())
        } else {
            Err(self.folded())
        }
    }

    fn folded(&self) -> InfeasibleGeometry {
        let mut worst = (f64::INFINITY, 0);
        for block in &self.topology.blocks {
            let scaled = super::polygon::scaled_jacobian(&corners(&self.positions, block));
            if scaled < worst.0 {
                worst = (scaled, block.unit);
            }
        }
        InfeasibleGeometry::MeshFolds {
            unit: worst.1,
            scaled_jacobian: worst.0,
        }
    }
}

fn corners(positions: &[Point], block: &Block) -> [Point; 4] {
    block.vertices.map(|v| positions[v as usize])
}

/// Mean width and height of a block.
fn target(x: &[Point; 4]) -> Target {
    let length = |a: usize, b: usize| super::polygon::distance(x[a], x[b]);
    let (w, h) = (
        0.5 * (length(0, 1) + length(3, 2)),
        0.5 * (length(0, 3) + length(1, 2)),
    );
    let least = 1e-3 * w.max(h).max(1e-6);
    [w.max(least), h.max(least)]
}

/// Width of a strip in the index space of [`spring_guess`]: between its number of elements, which lets blocks fan out
/// around a small chamber, and the width of the size rule, which keeps elements small near it. (The number alone is 11 %
/// off in the tip displacement of a 1 x 1 mm void, the width alone lets strips of 1 mm run from outline to outline; their
/// geometric mean is 1 % off.)
fn index_width(strip: &super::Strip) -> f64 {
    (strip.elements() as f64 * strip.width_mm).sqrt()
}

/// Positions that minimise the energy of springs along the blocks' edges: a harmonic map from a grid of the strips'
/// index widths, smooth and evenly graded, though it may fold.
fn spring_guess(
    topology: &Topology,
    plan: &MeshPlan,
    actuator: &Actuator,
) -> Result<Vec<Point>, InfeasibleGeometry> {
    let start = topology.start(plan, actuator)?;
    let mut gradient = vec![0.0; topology.size()];
    let mut matrix = topology.matrix();
    for block in &topology.blocks {
        let column = index_width(&plan.units[block.unit].columns[block.column]);
        let row = index_width(&plan.rows[block.row]);
        let (across, up) = (row / column, column / row);
        let x = corners(&start, block);
        let (mut g, mut hessian) = ([0.0; 8], [[0.0; 8]; 8]);
        for (a, b, k) in [(0, 1, across), (3, 2, across), (0, 3, up), (1, 2, up)] {
            for c in 0..2 {
                let (p, q) = (2 * a + c, 2 * b + c);
                let pull = k * (x[b][c] - x[a][c]);
                g[p] -= pull;
                g[q] += pull;
                hessian[p][p] += k;
                hessian[q][q] += k;
                hessian[p][q] -= k;
                hessian[q][p] -= k;
            }
        }
        topology.scatter(block, &g, &hessian, &mut gradient, &mut matrix);
    }
    matrix.factorise();
    let mut step: Vec<f64> = gradient.iter().map(|g| -g).collect();
    matrix.solve(&mut step);
    Ok(topology.moved(&start, &step, 1.0))
}

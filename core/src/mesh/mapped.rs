//! The mesher of fixed topology: cuts the blocks of a solved [`BlockMap`] into elements.
//!
//! A block is a straight-sided quadrilateral and its element lines lie at fixed fractions of its sides, so every node is
//! a fixed bilinear combination of four block vertices, elements have straight sides, and an element's corner Jacobian is
//! positive wherever the block's four are. Where a chamber's corners are rounded, the nodes of the elements on its rim follow
//! the arcs instead of their chords: rim edges of quadratic elements are curved.

use std::collections::HashMap;

use super::discretisation::{
    BoundaryEdge, BoundaryLoop, Cavity, Discretisation, ElementBlock, ElementKind, Mesh, Regions,
    Support,
};
use super::quality;
use crate::geometry::{
    Actuator, BlockMap, InfeasibleGeometry, MeshPlan, PlanElement, Point, Rounded, Station, Strip,
};

/// A node as a combination of block vertices.
#[derive(Clone, Copy, Debug)]
struct NodeSource {
    unit: u32,
    vertices: [u32; 4],
    weights: [f64; 4],
    bulge: Option<Bulge>,
}

/// How far a rounded rim lies off the chord of its block's side, for the nodes of the elements on that rim: on the rim the
/// whole, half of it half way through the element.
#[derive(Clone, Copy, Debug)]
struct Bulge {
    chamber: u32,
    /// The stations of the side's ends, and of the node between them with its fraction of the chord.
    stations: [Station; 3],
    fraction: f64,
    weight: f64,
}

impl Bulge {
    /// The stations with their weights.
    fn terms(&self) -> [(Station, f64); 3] {
        let [a, b, at] = self.stations;
        [
            (at, self.weight),
            (a, -self.weight * (1.0 - self.fraction)),
            (b, -self.weight * self.fraction),
        ]
    }

    fn offset(&self, chamber: &Rounded) -> Point {
        let mut sum = [0.0; 2];
        for (station, weight) in self.terms() {
            let p = chamber.at(station);
            sum[0] += weight * p[0];
            sum[1] += weight * p[1];
        }
        sum
    }
}

/// A mesh whose node positions are a smooth function of the chambers' corners.
#[derive(Clone, Debug)]
pub struct MappedMesh {
    /// Nodes, elements, supports (x = 0 fixed), cavities (chamber i on channel i), boundary.
    pub discretisation: Discretisation,
    /// Least scaled corner Jacobian of the elements.
    pub scaled_jacobian: f64,
    /// Longest edge of an element, mm.
    pub longest_edge_mm: f64,
    plan: MeshPlan,
    map: BlockMap,
    sources: Vec<NodeSource>,
    units: usize,
}

/// Meshes a design by a plan that was chosen for it or for one with the same units, chambers and corners.
pub fn build(actuator: &Actuator, plan: &MeshPlan) -> Result<MappedMesh, InfeasibleGeometry> {
    let map = BlockMap::solve(plan, actuator)?;
    let mut builder = Builder::new(actuator, plan, &map);
    builder.add_units();
    let (discretisation, sources) = builder.finish();
    let worst = quality::least_scaled_jacobian(&discretisation.mesh);
    let (scaled_jacobian, element) = worst.unwrap_or((1.0, 0));
    let rounded = actuator.corner_radius_mm > 0.0;
    let folded = rounded && quality::least_jacobian_bound(&discretisation.mesh) <= 0.0;
    if folded || scaled_jacobian.is_nan() || scaled_jacobian < quality::SCALED_JACOBIAN_FLOOR {
        let node = discretisation.mesh.blocks[0].nodes[element * plan_nodes(plan)];
        return Err(InfeasibleGeometry::MeshFolds {
            unit: sources[node as usize].unit as usize,
            scaled_jacobian,
        });
    }
    Ok(MappedMesh {
        scaled_jacobian,
        longest_edge_mm: quality::longest_edge(&discretisation.mesh),
        discretisation,
        plan: plan.clone(),
        map,
        sources,
        units: actuator.units.len(),
    })
}

fn plan_nodes(plan: &MeshPlan) -> usize {
    kind(plan.element).nodes()
}

fn kind(element: PlanElement) -> ElementKind {
    match element {
        PlanElement::Quad4 => ElementKind::Quad4,
        PlanElement::Quad9 => ElementKind::Quad9,
    }
}

impl MappedMesh {
    /// The plan that it follows.
    pub fn plan(&self) -> &MeshPlan {
        &self.plan
    }

    /// Newton steps of the block map.
    pub fn map_steps(&self) -> usize {
        self.map.steps
    }

    /// Turns a gradient with respect to node positions into one with respect to the chambers' corners, per unit, chamber
    /// and corner. Where all units are copies of one, the gradient is the sum over the units.
    pub fn pull_back(&self, node_gradient: &[[f64; 2]]) -> Vec<Vec<Vec<Point>>> {
        let vertices = self.map.positions().len();
        let repeated = self.plan.base.repeated;
        let maps = if repeated { self.units } else { 1 };
        let mut reach = vec![vec![[0.0; 2]; vertices]; maps];
        for (source, g) in self.sources.iter().zip(node_gradient) {
            let into = &mut reach[if repeated { source.unit as usize } else { 0 }];
            for (v, weight) in source.vertices.iter().zip(source.weights) {
                for c in 0..2 {
                    into[*v as usize][c] += weight * g[c];
                }
            }
        }
        let mut corners: Vec<Vec<Vec<Point>>> = reach
            .iter()
            .flat_map(|g| self.map.pull_back(&self.plan, g))
            .collect();
        for (source, g) in self.sources.iter().zip(node_gradient) {
            if let Some(bulge) = source.bulge {
                let (unit, chamber) = (source.unit as usize, bulge.chamber as usize);
                let rounded = self.map.chamber(if repeated { 0 } else { unit }, chamber);
                for (station, weight) in bulge.terms() {
                    let pull = g.map(|v| weight * v);
                    rounded.add_slopes(station, pull, &mut corners[unit][chamber]);
                }
            }
        }
        corners
    }
}

/// Lattice of one direction of a unit: `order` lattice steps per element.
struct Lattice {
    /// Strip and place in it of every lattice line; a line between strips is the start of the later one.
    lines: Vec<(usize, f64)>,
    /// First lattice line of every strip, and the last line.
    starts: Vec<usize>,
}

impl Lattice {
    fn new(strips: &[Strip], order: usize) -> Self {
        let (mut lines, mut starts) = (vec![], vec![]);
        for (s, strip) in strips.iter().enumerate() {
            starts.push(lines.len());
            let places: Vec<f64> = strip.lines().collect();
            for pair in places.windows(2) {
                for k in 0..order {
                    let f = k as f64 / order as f64;
                    lines.push((s, pair[0] + f * (pair[1] - pair[0])));
                }
            }
        }
        starts.push(lines.len());
        lines.push((strips.len(), 0.0));
        Self { lines, starts }
    }

    fn last(&self) -> usize {
        self.lines.len() - 1
    }
}

struct Builder<'a> {
    actuator: &'a Actuator,
    plan: &'a MeshPlan,
    map: &'a BlockMap,
    order: usize,
    columns: Vec<Lattice>,
    rows: Lattice,
    /// Node at a lattice point of a unit.
    index: HashMap<(usize, usize, usize), u32>,
    nodes: Vec<Point>,
    sources: Vec<NodeSource>,
    elements: ElementBlock,
    /// Nearest chamber corner of each element, by lattice lines.
    region: Vec<u16>,
}

impl<'a> Builder<'a> {
    fn new(actuator: &'a Actuator, plan: &'a MeshPlan, map: &'a BlockMap) -> Self {
        let order = match plan.element {
            PlanElement::Quad4 => 1,
            PlanElement::Quad9 => 2,
        };
        Self {
            actuator,
            plan,
            map,
            order,
            columns: plan
                .units
                .iter()
                .map(|u| Lattice::new(&u.columns, order))
                .collect(),
            rows: Lattice::new(&plan.rows, order),
            index: HashMap::new(),
            nodes: vec![],
            sources: vec![],
            elements: ElementBlock {
                kind: kind(plan.element),
                nodes: vec![],
                material: vec![],
                tag: vec![],
            },
            region: vec![],
        }
    }

    /// The solved unit that a unit of the chain follows.
    fn pattern(&self, unit: usize) -> usize {
        if self.plan.base.repeated { 0 } else { unit }
    }

    /// The node at a lattice point, made where it does not yet exist. `block` is a block that touches it.
    fn node(&mut self, unit: usize, at: (usize, usize), block: (usize, usize)) -> u32 {
        let pattern = self.pattern(unit);
        if at.0 == 0 && unit > 0 {
            let before = self.columns[self.pattern(unit - 1)].last();
            if let Some(node) = self.index.get(&(unit - 1, before, at.1)) {
                return *node;
            }
        }
        if let Some(node) = self.index.get(&(unit, at.0, at.1)) {
            return *node;
        }
        let place = |lattice: &Lattice, line: usize, strip: usize| {
            if line == lattice.starts[strip + 1] {
                1.0
            } else {
                lattice.lines[line].1
            }
        };
        let (column, row) = block;
        let u = place(&self.columns[pattern], at.0, column);
        let v = place(&self.rows, at.1, row);
        let vertices = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
            self.map
                .vertex(self.plan, pattern, column + i, row + j)
                .map_or(0, |v| v as u32)
        });
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v];
        let shift = (unit - pattern) as f64 * self.actuator.unit_mm[0];
        let mut position = [shift, 0.0];
        for (vertex, weight) in vertices.iter().zip(weights) {
            let p = self.map.positions()[*vertex as usize];
            position[0] += weight * p[0];
            position[1] += weight * p[1];
        }
        let bulge = self.bulge(pattern, block, [u, v]);
        if let Some(bulge) = bulge {
            let offset = bulge.offset(self.map.chamber(pattern, bulge.chamber as usize));
            position = [position[0] + offset[0], position[1] + offset[1]];
        }
        let node = self.nodes.len() as u32;
        self.nodes.push(position);
        self.sources.push(NodeSource {
            unit: unit as u32,
            vertices,
            weights,
            bulge,
        });
        self.index.insert((unit, at.0, at.1), node);
        node
    }

    /// How a node at the place (u, v) of a block follows a rounded rim that the block lies on.
    fn bulge(
        &self,
        pattern: usize,
        (column, row): (usize, usize),
        [u, v]: [f64; 2],
    ) -> Option<Bulge> {
        let plan = &self.plan.units[pattern];
        // Part of the first element from the side at 0, or of the last one before the side at 1, that is left.
        let near = |strip: &Strip, t: f64, at_end: bool| {
            let lines: Vec<f64> = strip.lines().collect();
            if at_end {
                1.0 - (1.0 - t) / (1.0 - lines[lines.len() - 2])
            } else {
                1.0 - t / lines[1]
            }
        };
        for (c, chamber) in plan.chambers.iter().enumerate() {
            if !self.map.chamber(pattern, c).is_rounded() {
                continue;
            }
            let ([i0, i1], [j0, j1]) = (chamber.columns, chamber.rows);
            let (above, beside) = ((i0..i1).contains(&column), (j0..j1).contains(&row));
            let (nx, ny) = (i1 - i0, j1 - j0);
            let (across, up) = (&plan.columns[column], &self.plan.rows[row]);
            // The ring runs counter-clockwise from the lower left: the side's first station, how far the node is along it,
            // and how near.
            let (first, along, weight) = if above && row + 1 == j0 {
                (column - i0, u, near(up, v, true))
            } else if beside && column == i1 {
                (nx + row - j0, v, near(across, u, false))
            } else if above && row == j1 {
                (nx + ny + i1 - 1 - column, 1.0 - u, near(up, v, false))
            } else if beside && column + 1 == i0 {
                (2 * nx + ny + j1 - 1 - row, 1.0 - v, near(across, u, true))
            } else {
                continue;
            };
            if weight <= 0.0 || along <= 0.0 || along >= 1.0 {
                continue;
            }
            let start = chamber.ring[first];
            let end = chamber.ring[(first + 1) % chamber.ring.len()];
            // The end of an edge is the start of the next.
            let last = if end.edge == start.edge {
                end.fraction
            } else {
                1.0
            };
            let between = Station {
                edge: start.edge,
                fraction: start.fraction + along * (last - start.fraction),
            };
            return Some(Bulge {
                chamber: c as u32,
                stations: [start, end, between],
                fraction: along,
                weight,
            });
        }
        None
    }

    fn add_units(&mut self) {
        let mut first_region = 0;
        for unit in 0..self.actuator.units.len() {
            let pattern = self.pattern(unit);
            let plan = &self.plan.units[pattern];
            let corners = self.corners(pattern);
            let region = if self.plan.base.repeated {
                0
            } else {
                first_region
            };
            first_region += corners.len();
            for column in 0..plan.columns.len() {
                for row in 0..self.plan.rows.len() {
                    let open = plan.chambers.iter().any(|c| {
                        (c.columns[0]..c.columns[1]).contains(&column)
                            && (c.rows[0]..c.rows[1]).contains(&row)
                    });
                    if !open {
                        self.add_block(unit, [column, row], &corners, region);
                    }
                }
            }
        }
    }

    /// Adds the elements of a block. Each belongs to the region of the chamber corner that is fewest lattice lines away;
    /// regions are counted from `region` in the order of `corners`.
    fn add_block(
        &mut self,
        unit: usize,
        [column, row]: [usize; 2],
        corners: &[(usize, usize)],
        region: usize,
    ) {
        let pattern = self.pattern(unit);
        let n = self.order;
        let [i0, i1] = [0, 1].map(|k| self.columns[pattern].starts[column + k]);
        let [j0, j1] = [0, 1].map(|k| self.rows.starts[row + k]);
        // Corners, mid-sides, centre, in steps of the lattice.
        let quad4 = [(0, 0), (1, 0), (1, 1), (0, 1)].as_slice();
        let quad9 = [
            (0, 0),
            (2, 0),
            (2, 2),
            (0, 2),
            (1, 0),
            (2, 1),
            (1, 2),
            (0, 1),
            (1, 1),
        ]
        .as_slice();
        let pattern_of_element = if n == 1 { quad4 } else { quad9 };
        for i in (i0..i1).step_by(n) {
            for j in (j0..j1).step_by(n) {
                for (a, b) in pattern_of_element {
                    let node = self.node(unit, (i + a, j + b), (column, row));
                    self.elements.nodes.push(node);
                }
                self.elements.material.push(unit as u16);
                let tag = self.elements.tag.len() as u32;
                self.elements.tag.push(tag);
                let lines = |c: &(usize, usize)| {
                    (2 * c.0).abs_diff(2 * i + n) + (2 * c.1).abs_diff(2 * j + n)
                };
                let nearest = (0..corners.len()).min_by_key(|k| lines(&corners[*k]));
                self.region.push((region + nearest.unwrap_or(0)) as u16);
            }
        }
    }

    fn at(&self, unit: usize, i: usize, j: usize) -> u32 {
        if i == 0 && unit > 0 {
            let before = self.columns[self.pattern(unit - 1)].last();
            return self.index[&(unit - 1, before, j)];
        }
        self.index[&(unit, i, j)]
    }

    /// Edges along a path of lattice nodes whose every `order`-th is an element corner.
    fn edges(&self, path: &[u32]) -> Vec<BoundaryEdge> {
        let n = self.order;
        (0..path.len() - 1)
            .step_by(n)
            .map(|k| BoundaryEdge {
                ends: [path[k], path[k + n]],
                mid: (n == 2).then(|| path[k + 1]),
            })
            .collect()
    }

    fn outline(&self) -> BoundaryLoop {
        let units = self.actuator.units.len();
        let top = self.rows.last();
        let rail = |j: usize| -> Vec<u32> {
            let mut path = vec![self.at(0, 0, j)];
            for unit in 0..units {
                let last = self.columns[self.pattern(unit)].last();
                path.extend((1..=last).map(|i| self.at(unit, i, j)));
            }
            path
        };
        let end = self.columns[self.pattern(units - 1)].last();
        let face = |unit: usize, i: usize| -> Vec<u32> {
            (0..=top).map(|j| self.at(unit, i, j)).collect()
        };
        let reversed = |mut path: Vec<u32>| {
            path.reverse();
            path
        };
        let sides = [
            rail(0),
            face(units - 1, end),
            reversed(rail(top)),
            reversed(face(0, 0)),
        ];
        let mut outline = BoundaryLoop::default();
        for side in sides {
            for (k, edge) in self.edges(&side).into_iter().enumerate() {
                outline.edges.push(edge);
                outline.starts_at_corner.push(k == 0);
            }
        }
        outline
    }

    /// Lattice points of a chamber's rim, counter-clockwise from its lower left, and which of them are corners of the
    /// polygon (`edge` that starts there).
    fn rim_places(&self, pattern: usize, chamber: usize) -> Vec<((usize, usize), Option<usize>)> {
        let plan = &self.plan.units[pattern].chambers[chamber];
        let columns = &self.columns[pattern].starts;
        let [i0, i1] = plan.columns.map(|l| columns[l]);
        let [j0, j1] = plan.rows.map(|l| self.rows.starts[l]);
        let mut path: Vec<(usize, usize)> = (i0..i1).map(|i| (i, j0)).collect();
        path.extend((j0..j1).map(|j| (i1, j)));
        path.extend((i0 + 1..=i1).rev().map(|i| (i, j1)));
        path.extend((j0 + 1..=j1).rev().map(|j| (i0, j)));
        // Stations are in the order of the rim's strip lines.
        let on_line = |(i, j): (usize, usize)| {
            columns.contains(&i) && (j == j0 || j == j1)
                || self.rows.starts.contains(&j) && (i == i0 || i == i1)
        };
        let mut stations = plan.ring.iter();
        path.into_iter()
            .map(|at| {
                let station = if on_line(at) { stations.next() } else { None };
                let corner = station.filter(|s| s.fraction == 0.0).map(|s| s.edge);
                (at, corner)
            })
            .collect()
    }

    /// Lattice points of all chamber corners of a unit, chamber by chamber in the order of the polygon.
    fn corners(&self, pattern: usize) -> Vec<(usize, usize)> {
        let chambers = self.plan.units[pattern].chambers.len();
        (0..chambers)
            .flat_map(|chamber| {
                let mut corners: Vec<_> = self
                    .rim_places(pattern, chamber)
                    .into_iter()
                    .filter_map(|(at, corner)| corner.map(|edge| (edge, at)))
                    .collect();
                corners.sort_unstable();
                corners.into_iter().map(|(_, at)| at)
            })
            .collect()
    }

    /// The rim of a chamber with the chamber on its left, and for each edge whether it starts at a polygon corner.
    fn rim(&self, unit: usize, chamber: usize) -> (Vec<BoundaryEdge>, Vec<bool>) {
        let places = self.rim_places(self.pattern(unit), chamber);
        let corners = places
            .iter()
            .step_by(self.order)
            .map(|(_, corner)| corner.is_some())
            .collect();
        let closed = places.iter().chain(places.first());
        let nodes: Vec<u32> = closed.map(|((i, j), _)| self.at(unit, *i, *j)).collect();
        (self.edges(&nodes), corners)
    }

    fn finish(self) -> (Discretisation, Vec<NodeSource>) {
        let mut boundary = vec![self.outline()];
        let mut cavities = vec![];
        for (unit, content) in self.actuator.units.iter().enumerate() {
            for chamber in 0..content.chambers_mm.len() {
                let (edges, corners) = self.rim(unit, chamber);
                // The void's loop runs the other way round.
                let n = edges.len();
                boundary.push(BoundaryLoop {
                    edges: edges
                        .iter()
                        .rev()
                        .map(|e| BoundaryEdge {
                            ends: [e.ends[1], e.ends[0]],
                            mid: e.mid,
                        })
                        .collect(),
                    starts_at_corner: (0..n).map(|k| corners[(n - k) % n]).collect(),
                });
                cavities.push(Cavity {
                    channel: chamber,
                    edges,
                    closing_points_mm: vec![],
                    closed: true,
                });
            }
        }
        let supports = (0..=self.rows.last())
            .flat_map(|j| {
                let node = self.at(0, 0, j);
                [0, 1].map(|component| Support {
                    node,
                    component,
                    displacement_mm: 0.0,
                    channel: 0,
                })
            })
            .collect();
        let discretisation = Discretisation {
            mesh: Mesh {
                nodes: self.nodes,
                blocks: vec![self.elements],
            },
            supports,
            cavities,
            tractions: vec![],
            boundary,
            obstacles: Vec::new(),
            partners: None,
            contact: None,
            regions: Regions {
                count: self.region.iter().max().map_or(0, |r| *r as usize + 1),
                of_element: self.region,
            },
        };
        (discretisation, self.sources)
    }
}

#[cfg(test)]
mod tests;

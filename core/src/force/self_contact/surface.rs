//! The surfaces that may meet: edges of the boundary and of rigid obstacles, each with its quadrature points.

use std::collections::BTreeMap;

use crate::force::edge;
use crate::geometry::polygon::{contains, signed_area};
use crate::mesh::{BoundaryLoop, Obstacle, Partners};

/// Largest length of a panel of Gauss points over the activation distance. At half that distance the sums then differ from
/// the integrals by less than 1e-4: where they differ more the surfaces catch on each other instead of sliding.
const PANEL: f64 = 0.7;
/// Abscissae and weights of a panel.
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];
/// Each panel next to a corner reaches from this share of its distance from it, the smallest to the corner: the share of the edge.
const GRADED: f64 = 0.8;
const SMALLEST: f64 = 0.15;
/// Panels of one part of an obstacle.
const RIGID_PART: usize = 8;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub low: [f64; 2],
    pub high: [f64; 2],
}

impl Default for Bounds {
    fn default() -> Self {
        Self::empty()
    }
}

impl Bounds {
    pub fn empty() -> Self {
        Self {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }

    pub fn around(points: &[[f64; 2]]) -> Self {
        let mut bounds = Self::empty();
        for p in points {
            bounds.include(*p);
        }
        bounds
    }

    pub fn include(&mut self, p: [f64; 2]) {
        for i in 0..2 {
            self.low[i] = self.low[i].min(p[i]);
            self.high[i] = self.high[i].max(p[i]);
        }
    }

    pub fn is_near(&self, other: &Self, within: f64) -> bool {
        (0..2)
            .all(|i| self.low[i] - within <= other.high[i] && other.low[i] - within <= self.high[i])
    }

    pub fn is_near_point(&self, p: [f64; 2], within: f64) -> bool {
        (0..2).all(|i| self.low[i] - within <= p[i] && p[i] <= self.high[i] + within)
    }
}

/// A piece of surface.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Nodes, and their number; none of an obstacle.
    pub nodes: [u32; 3],
    pub count: usize,
    /// Index into the shape tables.
    pub table: usize,
    /// First point, and the number of points.
    pub first: usize,
    pub points: usize,
    /// The region of the complement of the solid that the piece bounds: 0 the outside, else 1 + void.
    pub region: u32,
    /// The obstacle of which it is a part.
    pub obstacle: Option<u32>,
    /// Ends of an obstacle's panels where it starts, mm, and a box around them.
    pub ends: Vec<[f64; 2]>,
    pub drawn: Bounds,
    /// Groups in which the piece is, as bits of their numbers.
    pub groups: u64,
}

/// Shape functions and their derivatives at the points of an edge.
#[derive(Clone, Debug)]
pub struct Table {
    pub n: Vec<[f64; 3]>,
    pub dn: Vec<[f64; 3]>,
    /// Weights on [-1, 1].
    pub weight: Vec<f64>,
    /// Shape functions at the ends of the panels.
    pub ends: Vec<[f64; 3]>,
}

/// All pieces in the reference shape.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    pub pieces: Vec<Piece>,
    pub tables: Vec<Table>,
    /// Reference place of each point, mm.
    pub reference: Vec<[f64; 2]>,
    /// Reference length of each point, mm.
    pub length: Vec<f64>,
}

impl Surface {
    /// Samples the loops of a body's boundary (outlines first, solid on their left) and its obstacles.
    pub fn new(
        loops: &[BoundaryLoop],
        obstacles: &[Obstacle],
        partners: Option<&Partners>,
        x: &[[f64; 2]],
        activation: f64,
    ) -> Self {
        let longest = PANEL * activation;
        let mut this = Self::default();
        let mut known: BTreeMap<(usize, usize, [bool; 2]), usize> = BTreeMap::new();
        let regions = regions(loops, x);
        for (rim, region) in loops.iter().zip(regions) {
            let is_corner = |k: usize| rim.starts_at_corner.get(k % rim.edges.len()) == Some(&true);
            for (k, e) in rim.edges.iter().enumerate() {
                let corners = [is_corner(k), is_corner(k + 1)];
                let (nodes, count) = edge::nodes(e);
                let length = reference_length(&nodes[..count], x);
                let panels = level(length / longest);
                let table = *known.entry((count, panels, corners)).or_insert_with(|| {
                    this.tables.push(Table::new(count, panels, corners));
                    this.tables.len() - 1
                });
                let points = this.tables[table].n.len();
                let first = this.reference.len();
                for k in 0..points {
                    let at = |weights: &[f64; 3]| combine(weights, &nodes, count, x);
                    let tangent = at(&this.tables[table].dn[k]);
                    this.reference.push(at(&this.tables[table].n[k]));
                    let weight = this.tables[table].weight[k];
                    this.length.push(tangent[0].hypot(tangent[1]) * weight);
                }
                this.pieces.push(Piece {
                    nodes,
                    count,
                    table,
                    first,
                    points,
                    region,
                    obstacle: None,
                    ends: Vec::new(),
                    drawn: Bounds::empty(),
                    groups: partners.map_or(0, |partners| partners.groups(e)),
                });
            }
        }
        for (index, obstacle) in obstacles.iter().enumerate() {
            for part in sampled(obstacle, longest) {
                this.pieces.push(Piece {
                    nodes: [0; 3],
                    count: 0,
                    table: 0,
                    first: this.reference.len(),
                    points: part.points.len(),
                    region: 0,
                    obstacle: Some(index as u32),
                    drawn: Bounds::around(&part.ends),
                    ends: part.ends,
                    groups: 0,
                });
                this.reference.extend(part.points);
                this.length.extend(part.lengths);
            }
        }
        this
    }

    /// Present places of a piece's points; an obstacle's have moved by `travel`.
    pub fn places(
        &self,
        piece: &Piece,
        x: &[[f64; 2]],
        travel: &[[f64; 2]],
        out: &mut Vec<[f64; 2]>,
    ) {
        out.clear();
        let rigid = &self.reference[piece.first..piece.first + piece.points];
        piece.append(&self.tables[piece.table].n, rigid, x, travel, out);
    }

    /// Present places of the ends of a piece's panels.
    pub fn ends(
        &self,
        piece: &Piece,
        x: &[[f64; 2]],
        travel: &[[f64; 2]],
        out: &mut Vec<[f64; 2]>,
    ) {
        out.clear();
        let shapes = &self.tables[piece.table].ends;
        piece.append(shapes, &piece.ends, x, travel, out);
    }

    /// A box around a piece.
    pub fn bounds(piece: &Piece, x: &[[f64; 2]], travel: &[[f64; 2]]) -> Bounds {
        Bounds::around(&Self::hull(piece, x, travel))
    }

    /// Points around a piece, of which each of its points is the same mean wherever the nodes are: the control points of an
    /// edge, the corners of a box around the part of an obstacle.
    pub fn hull(piece: &Piece, x: &[[f64; 2]], travel: &[[f64; 2]]) -> [[f64; 2]; 4] {
        if let Some(obstacle) = piece.obstacle {
            let t = travel[obstacle as usize];
            let Bounds { low, high } = piece.drawn;
            return [low, [high[0], low[1]], high, [low[0], high[1]]]
                .map(|p| [p[0] + t[0], p[1] + t[1]]);
        }
        let [a, b, c] = control_points(piece, x);
        [a, b, c, c]
    }

    /// Whether two pieces that share a node are so nearly straight that no two points of them can be near without being
    /// neighbours along the boundary.
    pub fn is_straight(a: &Piece, b: &Piece, x: &[[f64; 2]], reference: &[[f64; 2]]) -> bool {
        let legs = |piece: &Piece| {
            let [p, q, r] = control_points(piece, x);
            let [u, v, w] = control_points(piece, reference);
            let leg = |a: [f64; 2], b: [f64; 2]| [b[0] - a[0], b[1] - a[1]];
            let size = |l: [f64; 2]| (l[0] * l[0] + l[1] * l[1]).sqrt();
            [(leg(p, q), size(leg(u, v))), (leg(q, r), size(leg(v, w)))]
        };
        let all = [legs(a), legs(b)].concat();
        let sum = all
            .iter()
            .fold([0.0; 2], |s, (l, _)| [s[0] + l[0], s[1] + l[1]]);
        let size = sum[0].hypot(sum[1]);
        // Distances along the mean direction are more than half of those along the reference boundary: more than
        // [`SHRUNK`](super::kernel::SHRUNK) of them.
        all.iter()
            .all(|(l, length)| l[0] * sum[0] + l[1] * sum[1] > 0.5 * size * length)
    }
}

impl Piece {
    /// Whether the two pieces have a node in common.
    pub fn touches(&self, other: &Self) -> bool {
        let ends = |p: &Self| p.count.min(2);
        self.nodes[..ends(self)]
            .iter()
            .any(|n| other.nodes[..ends(other)].contains(n))
    }

    /// Appends present places: by shape functions on the nodes, those of an obstacle by its travel from where they are `rigid`ly
    /// drawn.
    fn append(
        &self,
        shapes: &[[f64; 3]],
        rigid: &[[f64; 2]],
        x: &[[f64; 2]],
        travel: &[[f64; 2]],
        out: &mut Vec<[f64; 2]>,
    ) {
        match self.obstacle {
            None => out.extend(
                shapes
                    .iter()
                    .map(|n| combine(n, &self.nodes, self.count, x)),
            ),
            Some(obstacle) => {
                let t = travel[obstacle as usize];
                out.extend(rigid.iter().map(|p| [p[0] + t[0], p[1] + t[1]]));
            }
        }
    }
}

impl Table {
    /// Panels of an edge; towards a corner they become smaller, as the distance does at which points act.
    fn new(count: usize, panels: usize, corners: [bool; 2]) -> Self {
        let mut ends: Vec<f64> = (0..=panels)
            .map(|k| 2.0 * k as f64 / panels as f64 - 1.0)
            .collect();
        for (sign, _) in [(-1.0, 0), (1.0, 1)]
            .into_iter()
            .filter(|(_, k)| corners[*k])
        {
            // Distances from the corner, the edge being 2 long.
            let mut graded = vec![2.0];
            while let Some(last) = graded.last().copied().filter(|l| *l > SMALLEST) {
                let equal = last - 2.0 / panels as f64;
                graded.push((GRADED * last).max(equal));
            }
            graded.push(0.0);
            let inner = graded.into_iter().map(|x| sign * (1.0 - x));
            let other = if corners[0] && corners[1] { 0.0 } else { -sign };
            ends.retain(|t| sign * (t - other) < 0.0);
            ends.extend(inner.filter(|t| sign * (t - other) >= 0.0));
        }
        ends.sort_by(f64::total_cmp);
        // Panels from both corners meet in the middle but for rounding: one without length would be met by whatever passes.
        ends.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        let mut this = Self {
            n: Vec::new(),
            dn: Vec::new(),
            weight: Vec::new(),
            ends: ends.iter().map(|t| edge::shape(*t, count)).collect(),
        };
        for end in ends.windows(2) {
            for (t, w) in panel(end[0], end[1]) {
                this.n.push(edge::shape(t, count));
                this.dn.push(edge::shape_derivative(t, count));
                this.weight.push(w);
            }
        }
        this
    }
}

/// Bezier control points of an edge; of a straight one the middle is between its ends.
fn control_points(piece: &Piece, x: &[[f64; 2]]) -> [[f64; 2]; 3] {
    let [a, b] = [piece.nodes[0], piece.nodes[1]].map(|n| x[n as usize]);
    let middle = if piece.count == 3 {
        let m = x[piece.nodes[2] as usize];
        std::array::from_fn(|i| 2.0 * m[i] - 0.5 * (a[i] + b[i]))
    } else {
        std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
    };
    [a, middle, b]
}

fn combine(weights: &[f64; 3], nodes: &[u32; 3], count: usize, x: &[[f64; 2]]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for a in 0..count {
        for (s, v) in sum.iter_mut().zip(x[nodes[a] as usize]) {
            *s += weights[a] * v;
        }
    }
    sum
}

fn reference_length(nodes: &[u32], x: &[[f64; 2]]) -> f64 {
    let distance = |a: u32, b: u32| {
        let (p, q) = (x[a as usize], x[b as usize]);
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    match *nodes {
        [a, b, m] => distance(a, m) + distance(m, b),
        [a, b] => distance(a, b),
        _ => 0.0,
    }
}

/// Numbers of panels come in steps of a quarter, so that a small change of the shape seldom changes them.
fn level(wanted: f64) -> usize {
    let mut panels = 1_usize;
    while (panels as f64) < wanted {
        panels = (panels * 5).div_ceil(4);
    }
    panels
}

/// Gauss points of a panel, with their weights.
fn panel(from: f64, to: f64) -> [(f64, f64); 4] {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS.map(|(t, w)| (middle + half * t, half * w))
}

/// The region that each loop bounds: a void is a region of its own, an outline lies in the smallest void around it or outside.
fn regions(loops: &[BoundaryLoop], x: &[[f64; 2]]) -> Vec<u32> {
    let polygon = |rim: &BoundaryLoop| -> Vec<[f64; 2]> {
        rim.edges
            .iter()
            .flat_map(|e| [Some(e.ends[0]), e.mid])
            .flatten()
            .map(|n| x[n as usize])
            .collect()
    };
    let polygons: Vec<_> = loops.iter().map(polygon).collect();
    let areas: Vec<f64> = polygons.iter().map(|p| signed_area(p)).collect();
    let own = |k: usize| {
        if areas[k] < 0.0 {
            return 1 + k as u32;
        }
        let around = (0..loops.len())
            .filter(|&v| areas[v] < 0.0 && -areas[v] > areas[k])
            .filter(|&v| {
                polygons[k]
                    .first()
                    .is_some_and(|p| contains(&polygons[v], *p))
            })
            .max_by(|a, b| areas[*a].total_cmp(&areas[*b]));
        around.map_or(0, |v| 1 + v as u32)
    };
    (0..loops.len()).map(own).collect()
}

/// A part of an obstacle: points, their lengths, the ends of its panels.
#[derive(Default)]
struct Part {
    points: Vec<[f64; 2]>,
    lengths: Vec<f64>,
    ends: Vec<[f64; 2]>,
}

/// The parts of an obstacle's outline.
fn sampled(obstacle: &Obstacle, longest: f64) -> Vec<Part> {
    let mut parts = Vec::new();
    for side in obstacle.sides() {
        let panels = (side.length() / longest).ceil().max(1.0) as usize;
        let share = |k: usize| k as f64 / panels as f64;
        for first in (0..panels).step_by(RIGID_PART) {
            let mut part = Part::default();
            let last = (first + RIGID_PART).min(panels);
            for k in first..last {
                part.ends.push(side.point(share(k)));
                for (t, weight) in panel(share(k), share(k + 1)) {
                    part.points.push(side.point(t));
                    part.lengths.push(weight * side.length());
                }
            }
            part.ends.push(side.point(share(last)));
            parts.push(part);
        }
    }
    parts
}

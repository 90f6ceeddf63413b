//! Crossing walls and gaps of a deformed shape.
//!
//! The boundary is sampled as polylines, four segments a quadratic edge. Two segments that cross are a crossing of walls,
//! unless both lie within [`FOLD_MM`] of the same corner along the reference boundary: sharp corners of unpressurised
//! chambers fold shut, which is told apart.

use crate::force::edge;
use crate::mesh::BoundaryLoop;

/// A crossing this near to a corner on both sides of it, along the reference boundary, is a fold of that corner, mm.
pub const FOLD_MM: f64 = 3.0;
const SEGMENTS: usize = 4;
/// Vertices of a piece.
const PIECE: usize = 8;

/// The sampled boundary.
pub struct Walls {
    loops: Vec<Polyline>,
}

struct Polyline {
    boundary: BoundaryLoop,
    /// Reference arc length of each vertex, and of the whole.
    arc: Vec<f64>,
    length: f64,
    /// Arc lengths of the corners.
    corners: Vec<f64>,
}

/// Two segments that cross.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// A point of the crossing in the deformed shape, mm.
    pub at_mm: [f64; 2],
    /// Whether it is the fold of a corner.
    pub corner_fold: bool,
}

impl Walls {
    /// Samples the boundary of the reference shape `x`.
    pub fn new(boundary: &[BoundaryLoop], x: &[[f64; 2]]) -> Self {
        let loops = boundary
            .iter()
            .filter(|b| !b.edges.is_empty())
            .map(|b| {
                let mut line = Polyline {
                    boundary: b.clone(),
                    arc: Vec::new(),
                    length: 0.0,
                    corners: Vec::new(),
                };
                let points = line.points(x);
                let mut first_of_edge = 0;
                for k in 0..points.len() {
                    line.arc.push(line.length);
                    let edge_index = first_of_edge;
                    if line.is_first(k) {
                        if b.starts_at_corner.get(edge_index).copied().unwrap_or(false) {
                            line.corners.push(line.length);
                        }
                        first_of_edge += 1;
                    }
                    line.length += distance(points[k], points[(k + 1) % points.len()]);
                }
                line
            })
            .collect();
        Self { loops }
    }

    /// The first crossing of walls, else the first fold of a corner, at displacements `u`.
    pub fn crossing(&self, x: &[[f64; 2]], u: &[[f64; 2]]) -> Option<Crossing> {
        let segments = self.segments(x, u);
        let grid = Grid::new(&segments);
        let mut fold = None;
        for (i, a) in segments.iter().enumerate() {
            let mut wall = None;
            grid.near(a, |j| {
                if j <= i || wall.is_some() {
                    return;
                }
                let b = &segments[j];
                if self.adjacent(a, b) {
                    return;
                }
                if let Some(at_mm) = intersection(a, b) {
                    let corner_fold = self.is_fold(a, b);
                    let crossing = Crossing { at_mm, corner_fold };
                    if corner_fold {
                        fold.get_or_insert(crossing);
                    } else {
                        wall = Some(crossing);
                    }
                }
            });
            if wall.is_some() {
                return wall;
            }
        }
        fold
    }

    /// Least distance between boundary points that face each other across a void, mm: normals opposed by more than 90
    /// degrees, farther apart along the boundary than twice the distance. `None` where no points face each other.
    pub fn least_gap(&self, x: &[[f64; 2]], u: &[[f64; 2]]) -> Option<f64> {
        let mut least = f64::INFINITY;
        // Small loops first: an outline, where nothing faces, is searched no farther than the voids' gaps.
        let mut loops: Vec<&Polyline> = self.loops.iter().collect();
        loops.sort_by(|a, b| a.length.total_cmp(&b.length));
        for line in loops {
            let points: Vec<[f64; 2]> = line.points_deformed(x, u);
            let n = points.len();
            // Normals of the segments out of the solid (solid on the left): (dy, -dx).
            let normals: Vec<[f64; 2]> = (0..n)
                .map(|k| {
                    let (a, b) = (points[k], points[(k + 1) % n]);
                    [b[1] - a[1], a[0] - b[0]]
                })
                .collect();
            let pieces: Vec<Piece> = (0..n)
                .step_by(PIECE)
                .map(|k| Piece::new(k..(k + PIECE).min(n), &points, &normals))
                .collect();
            for (k, p) in pieces.iter().enumerate() {
                for q in &pieces[k..] {
                    if p.may_face(q) && p.distance(q) < least {
                        least = line.gap_between(p, q, &points, &normals, least);
                        least = line.gap_between(q, p, &points, &normals, least);
                    }
                }
            }
        }
        least.is_finite().then_some(least)
    }

    fn segments(&self, x: &[[f64; 2]], u: &[[f64; 2]]) -> Vec<Segment> {
        let mut out = Vec::new();
        for (index, line) in self.loops.iter().enumerate() {
            let points = line.points_deformed(x, u);
            let n = points.len();
            for k in 0..n {
                out.push(Segment {
                    line: index,
                    index: k,
                    a: points[k],
                    b: points[(k + 1) % n],
                });
            }
        }
        out
    }

    fn adjacent(&self, a: &Segment, b: &Segment) -> bool {
        let n = self.loops[a.line].arc.len();
        a.line == b.line && ((a.index + 1) % n == b.index || (b.index + 1) % n == a.index)
    }

    fn is_fold(&self, a: &Segment, b: &Segment) -> bool {
        if a.line != b.line {
            return false;
        }
        let line = &self.loops[a.line];
        let near = |s: f64, corner: f64| {
            let d = (s - corner).abs();
            d.min(line.length - d) <= FOLD_MM
        };
        line.corners
            .iter()
            .any(|&c| near(line.arc[a.index], c) && near(line.arc[b.index], c))
    }
}

impl Polyline {
    fn pieces(e: &crate::mesh::BoundaryEdge) -> usize {
        if e.mid.is_some() { SEGMENTS } else { 1 }
    }

    fn is_first(&self, vertex: usize) -> bool {
        let mut k = 0;
        for e in &self.boundary.edges {
            if k == vertex {
                return true;
            }
            if k > vertex {
                return false;
            }
            k += Self::pieces(e);
        }
        false
    }

    /// The least gap between the vertices of one piece and the segments of another, or `least`.
    fn gap_between(
        &self,
        vertices: &Piece,
        segments: &Piece,
        points: &[[f64; 2]],
        normals: &[[f64; 2]],
        mut least: f64,
    ) -> f64 {
        let n = points.len();
        for i in vertices.range.clone() {
            // A vertex belongs to the segments before and after it: either may face the other wall.
            let own = [normals[(i + n - 1) % n], normals[i]];
            for j in segments.range.clone() {
                let (a, b, m) = (points[j], points[(j + 1) % n], normals[j]);
                if !own.iter().any(|v| v[0] * m[0] + v[1] * m[1] < 0.0) {
                    continue;
                }
                let (d, t) = to_segment(points[i], a, b);
                if d >= least {
                    continue;
                }
                let foot = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                let towards = [foot[0] - points[i][0], foot[1] - points[i][1]];
                let faces = |v: [f64; 2]| v[0] * towards[0] + v[1] * towards[1] > 0.0;
                let opposed = own
                    .iter()
                    .any(|v| faces(*v) && v[0] * m[0] + v[1] * m[1] < 0.0);
                if !opposed || m[0] * towards[0] + m[1] * towards[1] >= 0.0 {
                    continue;
                }
                let end = self.arc.get(j + 1).copied().unwrap_or(self.length);
                let along = (self.arc[i] - (self.arc[j] + t * (end - self.arc[j]))).abs();
                if along.min(self.length - along) > 2.0 * d {
                    least = d;
                }
            }
        }
        least
    }

    fn points(&self, position: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut out = Vec::new();
        for e in &self.boundary.edges {
            let n = Self::pieces(e);
            out.extend((0..n).map(|k| edge::point(e, position, -1.0 + 2.0 * k as f64 / n as f64)));
        }
        out
    }

    fn points_deformed(&self, x: &[[f64; 2]], u: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let (a, b) = (self.points(x), self.points(u));
        a.iter()
            .zip(&b)
            .map(|(a, b)| [a[0] + b[0], a[1] + b[1]])
            .collect()
    }
}

/// Neighbouring vertices with the segments after them: where no pair of two pieces can count, none is looked at.
struct Piece {
    range: std::ops::Range<usize>,
    low: [f64; 2],
    high: [f64; 2],
    /// Mean direction of the normals, and the largest angle from it, of the segments before and after the vertices.
    direction: [f64; 2],
    spread: f64,
}

impl Piece {
    fn new(range: std::ops::Range<usize>, points: &[[f64; 2]], normals: &[[f64; 2]]) -> Self {
        let n = points.len();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for k in range.start..=range.end {
            let p = points[k % n];
            for i in 0..2 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        let unit = |v: [f64; 2]| {
            let length = v[0].hypot(v[1]);
            (length > 0.0).then(|| [v[0] / length, v[1] / length])
        };
        // Segments without length face nothing.
        let units: Vec<[f64; 2]> = (range.start + n - 1..range.end + n)
            .filter_map(|k| unit(normals[k % n]))
            .collect();
        let sum = units
            .iter()
            .fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
        let (direction, spread) = unit(sum).map_or(([1.0, 0.0], std::f64::consts::PI), |d| {
            let angle = |v: &[f64; 2]| (d[0] * v[0] + d[1] * v[1]).clamp(-1.0, 1.0).acos();
            (d, units.iter().map(angle).fold(0.0, f64::max))
        });
        Self {
            range,
            low,
            high,
            direction,
            spread,
        }
    }

    /// Whether normals of both may be opposed by more than 90 degrees.
    fn may_face(&self, other: &Self) -> bool {
        let cosine =
            self.direction[0] * other.direction[0] + self.direction[1] * other.direction[1];
        let apart = cosine.clamp(-1.0, 1.0).acos();
        // Round-off of the angles must not lose a pair.
        apart + self.spread + other.spread > std::f64::consts::FRAC_PI_2 - 1e-6
    }

    /// Of their boxes.
    fn distance(&self, other: &Self) -> f64 {
        let apart = |i: usize| {
            (self.low[i] - other.high[i])
                .max(other.low[i] - self.high[i])
                .max(0.0)
        };
        apart(0).hypot(apart(1))
    }
}

struct Segment {
    line: usize,
    index: usize,
    a: [f64; 2],
    b: [f64; 2],
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Distance of a point to a segment, and the parameter of the foot.
fn to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> (f64, f64) {
    let d = [b[0] - a[0], b[1] - a[1]];
    let square = d[0] * d[0] + d[1] * d[1];
    let t = if square > 0.0 {
        (((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (distance(p, [a[0] + t * d[0], a[1] + t * d[1]]), t)
}

/// Where two segments cross, each end clearly on its own side: segments of one straight wall are collinear to round-off.
fn intersection(p: &Segment, q: &Segment) -> Option<[f64; 2]> {
    const CLEAR_MM: f64 = 1e-9;
    let side = |s: &Segment, c: [f64; 2]| {
        let d = [s.b[0] - s.a[0], s.b[1] - s.a[1]];
        (d[0] * (c[1] - s.a[1]) - d[1] * (c[0] - s.a[0])) / d[0].hypot(d[1]).max(f64::MIN_POSITIVE)
    };
    let apart = |a: f64, b: f64| a.min(b) < -CLEAR_MM && a.max(b) > CLEAR_MM;
    let (a, b) = (side(p, q.a), side(p, q.b));
    if !apart(a, b) || !apart(side(q, p.a), side(q, p.b)) {
        return None;
    }
    let t = a / (a - b);
    Some(std::array::from_fn(|i| q.a[i] + t * (q.b[i] - q.a[i])))
}

/// Segments by the cells of a uniform grid that their boxes touch.
struct Grid {
    cell: f64,
    entries: Vec<((i32, i32), u32)>,
}

impl Grid {
    fn new(segments: &[Segment]) -> Self {
        let n = segments.len().max(1);
        let mean = segments.iter().map(|s| distance(s.a, s.b)).sum::<f64>() / n as f64;
        let mut grid = Self {
            cell: (2.0 * mean).max(1e-9),
            entries: Vec::new(),
        };
        let mut entries = Vec::new();
        for (i, s) in segments.iter().enumerate() {
            grid.cells(s, |c| entries.push((c, i as u32)));
        }
        entries.sort_unstable();
        grid.entries = entries;
        grid
    }

    fn cells(&self, s: &Segment, mut visit: impl FnMut((i32, i32))) {
        let of = |v: f64| (v / self.cell).floor() as i32;
        for i in of(s.a[0].min(s.b[0]))..=of(s.a[0].max(s.b[0])) {
            for j in of(s.a[1].min(s.b[1]))..=of(s.a[1].max(s.b[1])) {
                visit((i, j));
            }
        }
    }

    fn near(&self, s: &Segment, mut visit: impl FnMut(usize)) {
        self.cells(s, |c| {
            let first = self.entries.partition_point(|(k, _)| *k < c);
            for &(k, i) in &self.entries[first..] {
                if k != c {
                    break;
                }
                visit(i as usize);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::BoundaryEdge;

    /// A void of corners `x` (counter-clockwise), each side in `n` straight edges, the solid outside.
    fn void(corners: &[[f64; 2]], n: usize) -> (Vec<BoundaryLoop>, Vec<[f64; 2]>) {
        let m = corners.len();
        let mut x = Vec::new();
        // Clockwise, so that the solid is on the left.
        for k in (0..m).rev() {
            let (a, b) = (corners[(k + 1) % m], corners[k]);
            for i in 0..n {
                let t = i as f64 / n as f64;
                x.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        let count = x.len() as u32;
        let edges = (0..count)
            .map(|k| BoundaryEdge {
                ends: [k, (k + 1) % count],
                mid: None,
            })
            .collect();
        let starts_at_corner = (0..count as usize).map(|k| k % n == 0).collect();
        (
            vec![BoundaryLoop {
                edges,
                starts_at_corner,
            }],
            x,
        )
    }

    #[test]
    fn gap_of_a_rectangle_is_its_height() {
        let (boundary, x) = void(&[[0., 0.], [40., 0.], [40., 15.], [0., 15.]], 20);
        let walls = Walls::new(&boundary, &x);
        let rest = vec![[0.; 2]; x.len()];
        assert!((walls.least_gap(&x, &rest).unwrap() - 15.0).abs() < 1e-12);
        assert_eq!(walls.crossing(&x, &rest), None);
    }

    #[test]
    fn a_slanted_wall_does_not_cross_itself() {
        let (boundary, x) = void(&[[0.1, 0.3], [40.7, 7.9], [33.3, 21.7], [3.1, 17.3]], 37);
        assert_eq!(
            Walls::new(&boundary, &x).crossing(&x, &vec![[0.; 2]; x.len()]),
            None
        );
    }

    #[test]
    fn walls_that_cross_in_mid_span_are_not_a_fold() {
        let (boundary, x) = void(&[[0., 0.], [40., 0.], [40., 15.], [0., 15.]], 20);
        let walls = Walls::new(&boundary, &x);
        // The lower wall bulges beyond the upper one.
        let u: Vec<_> = x
            .iter()
            .map(|p| {
                if p[1] == 0.0 {
                    [0.0, 20.0 * (std::f64::consts::PI * p[0] / 40.).sin()]
                } else {
                    [0.0; 2]
                }
            })
            .collect();
        let crossing = walls.crossing(&x, &u).unwrap();
        assert!(!crossing.corner_fold);
        assert!((crossing.at_mm[1] - 15.0).abs() < 1e-9);
    }

    #[test]
    fn a_corner_that_folds_is_told_apart() {
        let (boundary, x) = void(&[[0., 0.], [40., 0.], [40., 15.], [0., 15.]], 40);
        let walls = Walls::new(&boundary, &x);
        // Near the origin the lower wall rises across the left one.
        let u: Vec<_> = x
            .iter()
            .map(|p| {
                if p[1] == 0.0 && p[0] > 0.0 && p[0] < 2.5 {
                    [-1.5 * p[0], 0.5]
                } else {
                    [0.0; 2]
                }
            })
            .collect();
        assert!(walls.crossing(&x, &u).unwrap().corner_fold);
    }
}

//! The least gap between facing sides of a void, smooth enough to be a constraint.
//!
//! The rim of a void is sampled as a polyline, four segments a quadratic edge. Between a vertex i of one side and another
//! side b of the same void lies the signed gap g_ib: the distance to the nearest point of b, negative where the vertex has
//! passed through b. The void's gap is the smooth minimum (Kreisselmeier-Steinhauser)
//!
//! G = -ln( exp(-rho g_far) + sum_ib l_i w_ib exp(-rho g_ib) / L ) / rho,
//!
//! l_i the vertex's share of the reference length, L = 1 mm; g_far = [`FAR_MM`] says that wider gaps do not matter. Sides that meet in a corner are close to each other there:
//! w grows from 0 to 1 (C^2) between half of [`FOLD_MM`] and the whole of it from their common corner: folds of a corner are
//! told apart from crossings and do not count, all that is farther out does. Between other sides w is 1. A vertex that lies
//! behind b in the reference shape (around a re-entrant corner, with solid between) does not face it and does not count. A void whose walls touch
//! along 1 mm has G = 0; a longer contact lowers it by ln(length) / rho.

use super::walls::FOLD_MM;
use crate::force::edge;
use crate::mesh::BoundaryLoop;

/// Sharpness of the smooth minimum, 1/mm.
pub const RHO_GAP: f64 = 20.0;
/// Gaps wider than this count as this, mm.
pub const FAR_MM: f64 = FOLD_MM;
const SEGMENTS: usize = 4;
/// Pairs whose weight in the minimum is below exp(-this) are left out.
const NEGLIGIBLE: f64 = 30.0;

/// Sampled rims of the voids whose gaps are wanted.
pub struct Gaps {
    rims: Vec<Rim>,
}

/// A vertex as a combination of the nodes of its edge.
#[derive(Clone, Copy)]
struct Vertex {
    nodes: [u32; 3],
    weights: [f64; 3],
    side: usize,
}

struct Rim {
    vertices: Vec<Vertex>,
    /// First vertex of each side.
    corners: Vec<usize>,
    /// Whether vertex i faces side b in the reference shape, at `i * sides + b`.
    faces: Vec<bool>,
}

/// The point of a side that is nearest to a vertex.
struct Nearest {
    segment: usize,
    /// Parameter on the segment.
    t: f64,
    /// Signed where the point is inside the side, the plain distance at its ends.
    gap: f64,
    /// Unit vector along which the gap opens when the vertex moves.
    opening: [f64; 2],
}

/// A term of the smooth minimum.
struct Term {
    vertex: usize,
    nearest: Nearest,
    /// l_i w_ib.
    weight: f64,
    /// d ln w / d(vertex), from the common corner.
    slope: [f64; 2],
    corner: Option<usize>,
}

/// The gap of one void at a state, with its terms for the derivative.
pub struct VoidGap {
    /// G, mm.
    pub gap: f64,
    terms: Vec<Term>,
}

/// Derivatives of a gap with respect to nodal displacements and to nodal positions.
pub struct NodalDerivative {
    /// dG/du.
    pub u: Vec<[f64; 2]>,
    /// dG/dX at fixed u.
    pub x: Vec<[f64; 2]>,
}

impl Gaps {
    /// Samples the loops of voids (solid on the left) in the reference shape `x`.
    pub fn new<'a>(voids: impl Iterator<Item = &'a BoundaryLoop>, x: &[[f64; 2]]) -> Self {
        Self {
            rims: voids.map(|rim| Rim::new(rim, x)).collect(),
        }
    }

    /// Number of voids.
    pub fn voids(&self) -> usize {
        self.rims.len()
    }

    /// The gap of each void at displacements `u` of the reference shape `x`.
    pub fn at_state(&self, x: &[[f64; 2]], u: &[[f64; 2]]) -> Vec<VoidGap> {
        self.rims.iter().map(|rim| rim.gap(x, u)).collect()
    }

    /// The derivative of a void's gap.
    pub fn derivative(&self, void: usize, gap: &VoidGap, x: &[[f64; 2]]) -> NodalDerivative {
        self.rims[void].derivative(gap, x)
    }
}

impl Rim {
    fn new(rim: &BoundaryLoop, x: &[[f64; 2]]) -> Self {
        let mut vertices = Vec::new();
        let mut corners = Vec::new();
        for (e, corner) in rim.edges.iter().zip(&rim.starts_at_corner) {
            if *corner {
                corners.push(vertices.len());
            }
            let (nodes, count) = edge::nodes(e);
            let pieces = if e.mid.is_some() { SEGMENTS } else { 1 };
            vertices.extend((0..pieces).map(|k| Vertex {
                nodes,
                weights: edge::shape(-1.0 + 2.0 * k as f64 / pieces as f64, count),
                side: 0,
            }));
        }
        // Sides run from corner to corner; those before the first corner belong to the last side.
        let sides = corners.len();
        for (i, v) in vertices.iter_mut().enumerate() {
            v.side = (corners.partition_point(|c| *c <= i) + sides.max(1) - 1) % sides.max(1);
        }
        let mut this = Self {
            vertices,
            corners,
            faces: Vec::new(),
        };
        let reference = this.places(x);
        this.faces = (0..reference.len())
            .flat_map(|i| (0..sides).map(move |b| (i, b)))
            .map(|(i, b)| b != this.vertices[i].side && this.nearest(i, b, &reference).gap > 0.0)
            .collect();
        this
    }

    fn places(&self, field: &[[f64; 2]]) -> Vec<[f64; 2]> {
        self.vertices.iter().map(|v| v.place(field)).collect()
    }

    /// Segments of a side: each from a vertex to the next.
    fn segments(&self, side: usize) -> impl Iterator<Item = usize> + '_ {
        let n = self.vertices.len();
        let first = self.corners[side];
        let end = self.corners[(side + 1) % self.corners.len()];
        let count = (end + n - first - 1) % n + 1;
        (0..count).map(move |k| (first + k) % n)
    }

    fn gap(&self, x: &[[f64; 2]], u: &[[f64; 2]]) -> VoidGap {
        let reference = self.places(x);
        let deformed: Vec<[f64; 2]> = reference
            .iter()
            .zip(self.places(u))
            .map(|(a, b)| [a[0] + b[0], a[1] + b[1]])
            .collect();
        let sides = self.corners.len();
        let mut terms = Vec::new();
        let mut least = FAR_MM;
        for i in 0..self.vertices.len() {
            for b in (0..sides).filter(|b| self.faces[i * sides + b]) {
                let Some((weight, slope, corner)) = self.weight(i, b, &reference) else {
                    continue;
                };
                let nearest = self.nearest(i, b, &deformed);
                // Weights differ by less than exp(10) between vertices that count.
                if RHO_GAP * (nearest.gap - least) > NEGLIGIBLE + 10.0 {
                    continue;
                }
                least = least.min(nearest.gap);
                terms.push(Term {
                    vertex: i,
                    nearest,
                    weight,
                    slope,
                    corner,
                });
            }
        }
        let exponent = |t: &Term| t.weight.ln() - RHO_GAP * t.nearest.gap;
        let far = -RHO_GAP * FAR_MM;
        let top = terms.iter().map(exponent).fold(far, f64::max);
        terms.retain(|t| exponent(t) > top - NEGLIGIBLE);
        let shares = terms.iter().map(|t| (exponent(t) - top).exp());
        let sum = (far - top).exp() + shares.sum::<f64>();
        VoidGap {
            gap: -(top + sum.ln()) / RHO_GAP,
            terms,
        }
    }

    /// l_i w of a vertex against side `b`, d ln(l_i w) / d(vertex) and the corner that both sides share; `None` where it
    /// does not count.
    fn weight(
        &self,
        i: usize,
        b: usize,
        reference: &[[f64; 2]],
    ) -> Option<(f64, [f64; 2], Option<usize>)> {
        let n = self.vertices.len();
        let sides = self.corners.len();
        let a = self.vertices[i].side;
        let before = distance(reference[(i + n - 1) % n], reference[i]);
        let after = distance(reference[i], reference[(i + 1) % n]);
        let length = 0.5 * (before + after);
        // The start of side a is its corner with side a - 1, its end that with side a + 1; a triangle's side has both.
        let shared = [
            (b == (a + sides - 1) % sides).then(|| self.corners[a]),
            (b == (a + 1) % sides).then(|| self.corners[b]),
        ];
        let mut weight = (length, [0.0; 2], None);
        for corner in shared.into_iter().flatten() {
            let d = [0, 1].map(|k| reference[i][k] - reference[corner][k]);
            let s = d[0].hypot(d[1]);
            let t = (2.0 * s / FOLD_MM - 1.0).min(1.0);
            if t <= 0.0 {
                return None;
            }
            let w = t * t * t * (10.0 + t * (6.0 * t - 15.0));
            if t < 1.0 {
                let slope = 30.0 * (t * (1.0 - t)).powi(2) * 2.0 / FOLD_MM / w / s;
                weight = (length * w, d.map(|v| slope * v), Some(corner));
            }
        }
        Some(weight)
    }

    fn nearest(&self, i: usize, b: usize, deformed: &[[f64; 2]]) -> Nearest {
        let n = self.vertices.len();
        let p = deformed[i];
        let mut best = (f64::INFINITY, self.corners[b], 0.0);
        for j in self.segments(b) {
            let (from, to) = (deformed[j], deformed[(j + 1) % n]);
            let along = [to[0] - from[0], to[1] - from[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let d = [p[0] - from[0], p[1] - from[1]];
            let t = ((d[0] * along[0] + d[1] * along[1]) / square.max(f64::MIN_POSITIVE))
                .clamp(0.0, 1.0);
            let off = (d[0] - t * along[0]).powi(2) + (d[1] - t * along[1]).powi(2);
            if off < best.0 {
                best = (off, j, t);
            }
        }
        let (off, segment, t) = best;
        let next = (segment + 1) % n;
        let (from, to) = (deformed[segment], deformed[next]);
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]).max(f64::MIN_POSITIVE);
        // The solid is on the left of the segment: the void's side is on the right.
        let normal = [along[1] / length, -along[0] / length];
        let d = [0, 1].map(|k| p[k] - from[k] - t * along[k]);
        let far = off.sqrt();
        let first = self.corners[b];
        let last = self.corners[(b + 1) % self.corners.len()];
        let at_end = (t <= 0.0 && segment == first) || (t >= 1.0 && next == last);
        let behind = d[0] * normal[0] + d[1] * normal[1] < 0.0 && !at_end;
        let sign = if behind { -1.0 } else { 1.0 };
        Nearest {
            segment,
            t,
            gap: sign * far,
            opening: if far > 1e-9 {
                d.map(|v| sign * v / far)
            } else {
                normal
            },
        }
    }

    fn derivative(&self, void: &VoidGap, x: &[[f64; 2]]) -> NodalDerivative {
        let n = self.vertices.len();
        let mut out = NodalDerivative {
            u: vec![[0.0; 2]; x.len()],
            x: vec![[0.0; 2]; x.len()],
        };
        for term in &void.terms {
            let share = term.weight * (RHO_GAP * (void.gap - term.nearest.gap)).exp();
            let mut spread = |vertex: usize, g: [f64; 2], deformed: bool| {
                let v = &self.vertices[vertex];
                for (node, weight) in v.nodes.iter().zip(v.weights) {
                    for k in 0..2 {
                        out.x[*node as usize][k] += weight * g[k];
                        if deformed {
                            out.u[*node as usize][k] += weight * g[k];
                        }
                    }
                }
            };
            let open = |factor: f64| term.nearest.opening.map(|v| share * factor * v);
            spread(term.vertex, open(1.0), true);
            spread(term.nearest.segment, open(term.nearest.t - 1.0), true);
            spread((term.nearest.segment + 1) % n, open(-term.nearest.t), true);
            // dG/d ln(weight) = -share / rho.
            if let Some(corner) = term.corner {
                let pull = term.slope.map(|v| -share / RHO_GAP * v);
                spread(term.vertex, pull, false);
                spread(corner, pull.map(|v| -v), false);
            }
            let i = term.vertex;
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let place = |k: usize| self.vertices[k].place(x);
            let (a, p, b) = (place(before), place(i), place(after));
            let total = distance(a, p) + distance(p, b);
            for (other, at) in [(before, a), (after, b)] {
                let d = distance(at, p).max(f64::MIN_POSITIVE);
                let pull = [0, 1].map(|k| -share / RHO_GAP * (p[k] - at[k]) / (d * total));
                spread(i, pull, false);
                spread(other, pull.map(|v| -v), false);
            }
        }
        out
    }
}

impl Vertex {
    fn place(&self, field: &[[f64; 2]]) -> [f64; 2] {
        let mut place = [0.0; 2];
        for (node, weight) in self.nodes.iter().zip(self.weights) {
            let value = field[*node as usize];
            place[0] += weight * value[0];
            place[1] += weight * value[1];
        }
        place
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::BoundaryEdge;

    /// A void of corners `x` (counter-clockwise), each side in `n` quadratic edges, the solid outside.
    fn void(corners: &[[f64; 2]], n: usize) -> (BoundaryLoop, Vec<[f64; 2]>) {
        let m = corners.len();
        let mut x = Vec::new();
        for k in (0..m).rev() {
            let (a, b) = (corners[(k + 1) % m], corners[k]);
            for i in 0..2 * n {
                let t = i as f64 / (2 * n) as f64;
                x.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        let count = x.len() as u32;
        let edges = (0..count / 2)
            .map(|k| BoundaryEdge {
                ends: [2 * k, (2 * k + 2) % count],
                mid: Some(2 * k + 1),
            })
            .collect();
        let starts_at_corner = (0..count as usize / 2).map(|k| k % n == 0).collect();
        (
            BoundaryLoop {
                edges,
                starts_at_corner,
            },
            x,
        )
    }

    fn gap_of(rim: &BoundaryLoop, x: &[[f64; 2]], u: &[[f64; 2]]) -> f64 {
        Gaps::new(std::iter::once(rim), x).at_state(x, u)[0].gap
    }

    #[test]
    fn a_flat_void_has_its_height_as_gap() {
        let (rim, x) = void(&[[0., 0.], [60., 0.], [60., 2.], [0., 2.]], 20);
        let gap = gap_of(&rim, &x, &vec![[0.0; 2]; x.len()]);
        // Both long sides see each other along 60 mm.
        assert!(
            (gap - (2.0 - 120.0_f64.ln() / RHO_GAP)).abs() < 0.01,
            "{gap}"
        );
        let (rim, x) = void(&[[0., 0.], [60., 0.], [60., 30.], [0., 30.]], 20);
        let gap = gap_of(&rim, &x, &vec![[0.0; 2]; x.len()]);
        assert!(gap > 1.4 && gap <= FAR_MM, "{gap}");
    }

    #[test]
    fn walls_that_pass_through_each_other_have_a_negative_gap() {
        let (rim, x) = void(&[[0., 0.], [60., 0.], [60., 10.], [0., 10.]], 20);
        let bulge = |h: f64| -> Vec<[f64; 2]> {
            x.iter()
                .map(|p| match p[1] {
                    0.0 => [0.0, h * (std::f64::consts::PI * p[0] / 60.0).sin()],
                    _ => [0.0; 2],
                })
                .collect()
        };
        assert!(gap_of(&rim, &x, &bulge(8.0)) > 1.0);
        let through = gap_of(&rim, &x, &bulge(12.0));
        assert!(through < -1.8 && through > -2.3, "{through}");
    }

    #[test]
    fn derivatives_match_differences() {
        let (rim, x) = void(&[[0., 0.], [41., 3.], [37., 14.], [5., 9.]], 9);
        let u: Vec<[f64; 2]> = x
            .iter()
            .map(|p| {
                [
                    0.02 * p[1] * p[0].sin(),
                    2.0 * (0.08 * p[0]).sin() - 0.3 * p[1],
                ]
            })
            .collect();
        let gaps = Gaps::new(std::iter::once(&rim), &x);
        let d = gaps.derivative(0, &gaps.at_state(&x, &u)[0], &x);
        let h = 1e-6;
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for node in 0..x.len() {
            for k in 0..2 {
                for reference in [false, true] {
                    let shifted = |h: f64| {
                        let (mut x, mut u) = (x.clone(), u.clone());
                        if reference {
                            x[node][k] += h;
                        } else {
                            u[node][k] += h;
                        }
                        gaps.at_state(&x, &u)[0].gap
                    };
                    let difference = (shifted(h) - shifted(-h)) / (2.0 * h);
                    let exact = if reference {
                        d.x[node][k]
                    } else {
                        d.u[node][k]
                    };
                    worst = worst.max((difference - exact).abs());
                    largest = largest.max(exact.abs());
                }
            }
        }
        assert!(largest > 0.05 && worst < 1e-7, "{worst} of {largest}");
    }
}

//! The share of a step that surfaces can take without passing through each other.

use super::surface::{Bounds, Surface};
use super::{SelfContact, kernel};

/// Surfaces keep this share of the way that is free.
const KEPT: f64 = 0.2;

impl SelfContact {
    /// The largest share in (0, 1] of the displacement increment `du` that brings no two surfaces through each other, less a
    /// fifth of it where they would meet. `x` are the places before; the obstacles move from one travel to the other.
    pub fn free_share(&self, x: &[[f64; 2]], du: &[[f64; 2]], travel: [&[[f64; 2]]; 2]) -> f64 {
        let surface = &self.surface;
        let end: Vec<[f64; 2]> = x
            .iter()
            .zip(du)
            .map(|(x, d)| [x[0] + d[0], x[1] + d[1]])
            .collect();
        let swept: Vec<Bounds> = surface
            .pieces
            .iter()
            .map(|p| {
                let (mut a, b) = (
                    Surface::bounds(p, x, travel[0]),
                    Surface::bounds(p, &end, travel[1]),
                );
                a.include(b.low);
                a.include(b.high);
                a
            })
            .collect();
        let still = vec![[0.0; 2]; self.obstacles];
        let mut first = f64::INFINITY;
        let mut lines = [Polyline::default(), Polyline::default()];
        for (a, b) in self.near(&swept, 0.0) {
            let two = self.pieces([a, b]);
            if two[0].touches(two[1])
                && Surface::is_straight(two[0], two[1], x, &self.reference)
                && Surface::is_straight(two[0], two[1], &end, &self.reference)
            {
                continue;
            }
            for (line, piece) in lines.iter_mut().zip(two) {
                surface.ends(piece, x, travel[0], &mut line.start);
                surface.ends(piece, &end, travel[1], &mut line.end);
                surface.ends(piece, &self.reference, &still, &mut line.reference);
            }
            let rigid = two.iter().any(|p| p.obstacle.is_some());
            // Nearer parts may fold through each other.
            let apart = if rigid { 0.0 } else { self.least_apart() };
            let [p, q] = &lines;
            first = first
                .min(p.first_meeting(q, apart))
                .min(q.first_meeting(p, apart));
        }
        if first > 1.0 {
            1.0
        } else {
            (1.0 - KEPT) * first
        }
    }
}

impl SelfContact {
    /// How far surfaces have passed into each other at places `x`, mm: of crossing segments the least distance by which an end is
    /// beyond the other; 0 where none cross. Parts that never act on each other do not count.
    pub fn penetration(&self, x: &[[f64; 2]], travel: &[[f64; 2]]) -> f64 {
        let surface = &self.surface;
        let still = vec![[0.0; 2]; self.obstacles];
        let mut lines = [Polyline::default(), Polyline::default()];
        let mut deepest = 0.0_f64;
        for (a, b) in self.facing(x, travel, 0.0) {
            let two = self.pieces([a, b]);
            for (line, piece) in lines.iter_mut().zip(two) {
                surface.ends(piece, x, travel, &mut line.start);
                surface.ends(piece, &self.reference, &still, &mut line.reference);
            }
            let rigid = two.iter().any(|p| p.obstacle.is_some());
            let apart = if rigid { 0.0 } else { self.least_apart() };
            let [p, q] = &lines;
            for k in 1..p.start.len() {
                for l in 1..q.start.len() {
                    if p.middle(k, q.middle_at(l)) > apart {
                        let (s, t) = ([p.start[k - 1], p.start[k]], [q.start[l - 1], q.start[l]]);
                        deepest = deepest.max(crossing(s, t));
                    }
                }
            }
        }
        deepest
    }

    /// Parts that are nearer than this in the reference shape never act on each other, mm.
    fn least_apart(&self) -> f64 {
        kernel::CORNER * self.law.activation_mm
    }
}

/// By how much two segments cross: the least distance of an end from the line of the other; 0 where they do not.
fn crossing(s: [[f64; 2]; 2], t: [[f64; 2]; 2]) -> f64 {
    let sides = |[a, b]: [[f64; 2]; 2], of: [[f64; 2]; 2]| {
        let e = [b[0] - a[0], b[1] - a[1]];
        let length = e[0].hypot(e[1]).max(f64::MIN_POSITIVE);
        of.map(|p| (e[0] * (p[1] - a[1]) - e[1] * (p[0] - a[0])) / length)
    };
    let (u, v) = (sides(s, t), sides(t, s));
    if u[0] * u[1] < 0.0 && v[0] * v[1] < 0.0 {
        u.into_iter()
            .chain(v)
            .fold(f64::INFINITY, |m, d| m.min(d.abs()))
    } else {
        0.0
    }
}

/// A piece as a polyline between the ends of its panels, each of which moves linearly.
#[derive(Default)]
struct Polyline {
    start: Vec<[f64; 2]>,
    end: Vec<[f64; 2]>,
    reference: Vec<[f64; 2]>,
}

impl Polyline {
    /// First time in (0, 1] at which a vertex of this one meets a segment of the other; infinite if none does.
    /// Parts nearer than `apart` in the reference shape do not count.
    fn first_meeting(&self, other: &Self, apart: f64) -> f64 {
        let whole = other.swept(0..other.start.len());
        let mine = self.swept(0..self.start.len());
        let segments: Vec<(usize, Bounds)> = (1..other.start.len())
            .map(|l| (l, other.swept(l - 1..l + 1)))
            .filter(|(_, bounds)| bounds.is_near(&mine, 0.0))
            .collect();
        let mut first = f64::INFINITY;
        for k in 0..self.start.len() {
            let own = self.swept(k..k + 1);
            if !own.is_near(&whole, 0.0) {
                continue;
            }
            for (l, segment) in &segments {
                if !own.is_near(segment, 0.0) {
                    continue;
                }
                let (p, q, r) = (
                    self.reference[k],
                    other.reference[l - 1],
                    other.reference[*l],
                );
                let way = [p[0] - 0.5 * (q[0] + r[0]), p[1] - 0.5 * (q[1] + r[1])];
                if way[0] * way[0] + way[1] * way[1] < apart * apart {
                    continue;
                }
                first = first.min(meeting(
                    [self.start[k], other.start[l - 1], other.start[*l]],
                    [self.end[k], other.end[l - 1], other.end[*l]],
                ));
            }
        }
        first
    }

    /// Reference middle of a segment.
    fn middle_at(&self, k: usize) -> [f64; 2] {
        let (p, q) = (self.reference[k - 1], self.reference[k]);
        [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]
    }

    /// Distance of the reference middle of a segment from a point.
    fn middle(&self, k: usize, p: [f64; 2]) -> f64 {
        let m = self.middle_at(k);
        (m[0] - p[0]).hypot(m[1] - p[1])
    }

    /// A box around some of its vertices over the whole motion.
    fn swept(&self, vertices: std::ops::Range<usize>) -> Bounds {
        let mut bounds = Bounds::empty();
        for k in vertices {
            bounds.include(self.start[k]);
            bounds.include(self.end[k]);
        }
        bounds
    }
}

/// First time in [0, 1] at which the point moving from `start[0]` to `end[0]` is on the segment between the two others.
fn meeting(start: [[f64; 2]; 3], end: [[f64; 2]; 3]) -> f64 {
    let sub = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let (e0, e1) = (sub(start[2], start[1]), sub(end[2], end[1]));
    let (w0, w1) = (sub(start[0], start[1]), sub(end[0], end[1]));
    let (de, dw) = (sub(e1, e0), sub(w1, w0));
    // cross(e0 + t de, w0 + t dw) = a t^2 + b t + c.
    let (a, b, c) = (cross(de, dw), cross(e0, dw) + cross(de, w0), cross(e0, w0));
    let mut first = f64::INFINITY;
    for t in roots(a, b, c) {
        if !(0.0..=1.0).contains(&t) || t >= first {
            continue;
        }
        let e = [e0[0] + t * de[0], e0[1] + t * de[1]];
        let w = [w0[0] + t * dw[0], w0[1] + t * dw[1]];
        let along = (e[0] * w[0] + e[1] * w[1]) / (e[0] * e[0] + e[1] * e[1]).max(1e-300);
        if (-1e-9..=1.0 + 1e-9).contains(&along) {
            first = t;
        }
    }
    first
}

/// Real roots of a t^2 + b t + c; none where all vanish.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let none = f64::NAN;
    if a == 0.0 {
        return [if b == 0.0 { none } else { -c / b }, none];
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [none; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [q / a, if q == 0.0 { none } else { c / q }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_that_cross_are_told_from_those_that_do_not() {
        let flat = [[-1.0, 0.0], [1.0, 0.0]];
        assert!((crossing(flat, [[0.0, -0.1], [0.0, 2.0]]) - 0.1).abs() < 1e-15);
        assert_eq!(crossing(flat, [[0.0, 0.1], [0.0, 2.0]]), 0.0);
        assert_eq!(crossing(flat, [[1.5, -1.0], [1.5, 1.0]]), 0.0);
    }

    #[test]
    fn a_point_meets_a_segment_at_the_right_time() {
        let still = [[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0]];
        let above = |y: f64| [[0.3, y], still[1], still[2]];
        assert!((meeting(above(1.0), above(-3.0)) - 0.25).abs() < 1e-14);
        assert!(meeting(above(1.0), above(0.1)).is_infinite());
        let beside = |y: f64| [[1.3, y], still[1], still[2]];
        assert!(meeting(beside(1.0), beside(-3.0)).is_infinite());
        // The segment turns about its start through the point at rest.
        let start = [[1.0, 1.0], [0.0, 0.0], [3.0, 0.0]];
        let end = [[1.0, 1.0], [0.0, 0.0], [0.0, 3.0]];
        assert!((meeting(start, end) - 0.5).abs() < 1e-14);
    }
}

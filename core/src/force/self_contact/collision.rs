//! The share of a step that surfaces can take without passing through each other.

use super::surface::{Bounds, Surface};
use super::{SelfContact, kernel};

/// Surfaces keep this share of the way that is free.
const KEPT: f64 = 0.2;
/// The shortest time that is looked at by itself; where nothing meets within one, one this much longer is looked at.
const SHORTEST: f64 = 1e-6;
const LONGER: f64 = 4.0;

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
        let hulls: Vec<Hull> = surface
            .pieces
            .iter()
            .map(|piece| {
                let (p, q) = (
                    Surface::hull(piece, x, travel[0]),
                    Surface::hull(piece, &end, travel[1]),
                );
                std::array::from_fn(|k| Way::new(p[k], q[k]))
            })
            .collect();
        // What a wild step brings together late is of no interest where it brings something together early.
        let mut horizon = hulls
            .iter()
            .map(turning_time)
            .fold(1.0, f64::min)
            .max(SHORTEST);
        let first = loop {
            let first = self.first_meeting_by(horizon, &hulls, [x, &end], travel);
            if first <= horizon || horizon >= 1.0 {
                break first;
            }
            horizon = (LONGER * horizon).min(1.0);
        };
        if first > 1.0 {
            1.0
        } else {
            (1.0 - KEPT) * first
        }
    }

    /// First time up to `horizon` at which surfaces meet that move straight from the first places to the second, those of the
    /// pieces within their `hulls`; a later time that need not be the first, or infinity, where none meet by then.
    fn first_meeting_by(
        &self,
        horizon: f64,
        hulls: &[Hull],
        x: [&[[f64; 2]]; 2],
        travel: [&[[f64; 2]]; 2],
    ) -> f64 {
        let surface = &self.surface;
        let swept: Vec<Bounds> = hulls.iter().map(|hull| swept(hull, horizon)).collect();
        let still = vec![[0.0; 2]; self.obstacles];
        let mut first = f64::INFINITY;
        let mut lines = [Polyline::default(), Polyline::default()];
        for (a, b) in self.near(&swept, 0.0) {
            let (p, q) = (&hulls[a as usize], &hulls[b as usize]);
            let common = CommonMotion::of(p, q);
            let by = first.min(horizon);
            if !common.reach(p).may_meet(&common.reach(q), by) {
                continue;
            }
            let two = self.pieces([a, b]);
            let straight = |x| Surface::is_straight(two[0], two[1], x, &self.reference);
            if two[0].touches(two[1]) && straight(x[0]) && straight(x[1]) {
                continue;
            }
            for (line, piece) in lines.iter_mut().zip(two) {
                surface.ends(piece, x[0], travel[0], &mut line.start);
                surface.ends(piece, x[1], travel[1], &mut line.end);
                surface.ends(piece, &self.reference, &still, &mut line.reference);
                line.divide(&common);
            }
            let rigid = two.iter().any(|p| p.obstacle.is_some());
            // Nearer parts may fold through each other.
            let apart = if rigid { 0.0 } else { self.least_apart() };
            let [p, q] = &lines;
            first = first.min(p.first_meeting(q, apart, by));
        }
        first
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

/// Straight motion of a point.
#[derive(Clone, Copy)]
struct Way {
    from: [f64; 2],
    by: [f64; 2],
}

impl Way {
    fn new(from: [f64; 2], to: [f64; 2]) -> Self {
        Self {
            from,
            by: [to[0] - from[0], to[1] - from[1]],
        }
    }
}

/// Points whose ways enclose those of all points of a piece: each of these is a mean of them.
type Hull = [Way; 4];

/// A box around some ways up to a time.
fn swept(ways: &[Way], time: f64) -> Bounds {
    let mut bounds = Bounds::empty();
    for Way { from, by } in ways {
        bounds.include(*from);
        bounds.include([from[0] + time * by[0], from[1] + time * by[1]]);
    }
    bounds
}

/// The time within which the ends of a piece move against each other by as much as they are apart.
fn turning_time([a, b, ..]: &Hull) -> f64 {
    let size = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
    size(a.from, b.from) / size(a.by, b.by)
}

/// A motion that two pieces share: p -> p + t (`by` + `turn` e_z x (p - `centre`)) from t = 0 to 1.
///
/// Seen from what moves like this points meet at the same times, and a point that moves by d in space is at most
/// t |d - by - turn e_z x (p - centre)| from where it started, as 1 + t turn e_z x shortens nothing. In a step that swings a
/// chain of units through a wide arc this is little where the way in space is long.
struct CommonMotion {
    centre: [f64; 2],
    by: [f64; 2],
    turn: f64,
}

/// Where some points are at the start, and how far they come from there by t = 1.
#[derive(Clone, Copy)]
struct Reach {
    at: Bounds,
    by: f64,
}

/// What rounding may make of a distance, mm.
const ROUNDING: f64 = 1e-9;

impl CommonMotion {
    /// The mean motion of two sets of points, and the turn of their middles about each other.
    fn of(p: &[Way], q: &[Way]) -> Self {
        let mean = |ways: &[Way], of: fn(&Way) -> [f64; 2]| -> [f64; 2] {
            let sum = (ways.iter().map(of)).fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
            sum.map(|s| s / ways.len() as f64)
        };
        let (a, b) = (mean(p, |w| w.from), mean(q, |w| w.from));
        let (u, v) = (mean(p, |w| w.by), mean(q, |w| w.by));
        let (apart, change) = ([a[0] - b[0], a[1] - b[1]], [u[0] - v[0], u[1] - v[1]]);
        let square = apart[0] * apart[0] + apart[1] * apart[1];
        let turn = (apart[0] * change[1] - apart[1] * change[0]) / square;
        let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        Self {
            centre: middle(a, b),
            by: middle(u, v),
            turn: if turn.is_finite() { turn } else { 0.0 },
        }
    }

    fn reach(&self, ways: &[Way]) -> Reach {
        let mut at = Bounds::empty();
        let mut square = 0.0_f64;
        for Way { from, by } in ways {
            at.include(*from);
            let arm = [from[0] - self.centre[0], from[1] - self.centre[1]];
            let left = [
                by[0] - self.by[0] + self.turn * arm[1],
                by[1] - self.by[1] - self.turn * arm[0],
            ];
            square = square.max(left[0] * left[0] + left[1] * left[1]);
        }
        Reach {
            at,
            by: square.sqrt(),
        }
    }
}

impl Reach {
    /// Whether the two may meet by a time.
    fn may_meet(&self, other: &Self, time: f64) -> bool {
        let by = time.min(1.0) * (self.by + other.by);
        self.at.is_near(&other.at, by + ROUNDING)
    }
}

/// Segments that are looked at together.
const BLOCK: usize = 8;

/// A piece as a polyline between the ends of its panels, each of which moves linearly.
#[derive(Default)]
struct Polyline {
    start: Vec<[f64; 2]>,
    end: Vec<[f64; 2]>,
    reference: Vec<[f64; 2]>,
    ways: Vec<Way>,
    /// Of each block of segments.
    blocks: Vec<Reach>,
}

impl Polyline {
    /// Finds what its blocks of segments reach beside a common motion.
    fn divide(&mut self, common: &CommonMotion) {
        self.ways.clear();
        let ends = self.start.iter().zip(&self.end);
        self.ways.extend(ends.map(|(p, q)| Way::new(*p, *q)));
        let count = self.segments().div_ceil(BLOCK);
        self.blocks.clear();
        for k in 0..count {
            let reach = common.reach(self.block(k));
            self.blocks.push(reach);
        }
    }

    fn segments(&self) -> usize {
        self.start.len() - 1
    }

    /// Ways of the vertices of a block of segments.
    fn block(&self, k: usize) -> &[Way] {
        let last = ((k + 1) * BLOCK).min(self.segments());
        &self.ways[k * BLOCK..=last]
    }

    /// First time up to `horizon` at which a vertex of one of the two meets a segment of the other; a later one or infinity
    /// where there is none. Parts nearer than `apart` in the reference shape do not count.
    fn first_meeting(&self, other: &Self, apart: f64, horizon: f64) -> f64 {
        let (mut first, mut horizon) = (f64::INFINITY, horizon);
        for (k, own) in self.blocks.iter().enumerate() {
            for (l, others) in other.blocks.iter().enumerate() {
                if !own.may_meet(others, horizon) {
                    continue;
                }
                // What two short parts share leaves less.
                let (p, q) = (self.block(k), other.block(l));
                let common = CommonMotion::of(p, q);
                if !common.reach(p).may_meet(&common.reach(q), horizon) {
                    continue;
                }
                let reaches = |ways: &[Way]| {
                    let none = Reach {
                        at: Bounds::empty(),
                        by: 0.0,
                    };
                    let mut all = [none; BLOCK];
                    for (reach, two) in all.iter_mut().zip(ways.windows(2)) {
                        *reach = common.reach(two);
                    }
                    all
                };
                let (mine, theirs) = (reaches(p), reaches(q));
                for (i, segment) in mine[..p.len() - 1].iter().enumerate() {
                    for (j, facing) in theirs[..q.len() - 1].iter().enumerate() {
                        if segment.may_meet(facing, horizon) {
                            let (i, j) = (k * BLOCK + i, l * BLOCK + j);
                            for end in [0, 1] {
                                first = first
                                    .min(self.meeting(i + end, other, j, apart))
                                    .min(other.meeting(j + end, self, i, apart));
                            }
                            horizon = horizon.min(first);
                        }
                    }
                }
            }
        }
        first
    }

    /// When a vertex meets a segment of another polyline, which is numbered by its first vertex.
    fn meeting(&self, vertex: usize, other: &Self, segment: usize, apart: f64) -> f64 {
        let p = self.reference[vertex];
        let m = other.middle_at(segment + 1);
        let way = [p[0] - m[0], p[1] - m[1]];
        if way[0] * way[0] + way[1] * way[1] < apart * apart {
            return f64::INFINITY;
        }
        let three = |of: fn(&Self) -> &Vec<[f64; 2]>| {
            [of(self)[vertex], of(other)[segment], of(other)[segment + 1]]
        };
        meeting(three(|line| &line.start), three(|line| &line.end))
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
    fn what_is_left_out_for_being_far_never_meets_first() {
        // Numbers in [-1, 1) without a pattern (Weyl's sequence, squared).
        let mut k = 0.0_f64;
        let mut number = move || {
            k += 1.0;
            2.0 * (k * k * 0.618_033_988_749_895).fract() - 1.0
        };
        let (mut met, mut tried) = (0, 0);
        for case in 0..400 {
            // Two wavy lines beside each other that a large motion turns, shifts and bends: some meet, some do not.
            let turn = 6.0 * number();
            let shift = [0, 1].map(|_| 40.0 * number());
            let towards = 6.0 * (1.0 + number());
            let mut line = |y: f64, by: f64, panels: usize| {
                let mut this = Polyline::default();
                for k in 0..=panels {
                    let x = 0.2 * k as f64;
                    let p = [x, y + 0.1 * (3.0 * x).sin()];
                    let noise = [0, 1].map(|_| 0.1 * number());
                    let d = [
                        shift[0] - turn * p[1] + noise[0],
                        shift[1] + turn * p[0] + by + noise[1],
                    ];
                    this.start.push(p);
                    this.end.push([p[0] + d[0], p[1] + d[1]]);
                }
                this.reference = this.start.clone();
                this
            };
            let mut two = [line(0.0, 0.0, 30), line(1.5, -towards, 21)];
            for line in &mut two {
                line.divide(&CommonMotion {
                    centre: [0.0; 2],
                    by: [0.0; 2],
                    turn: if case % 2 == 0 { turn } else { 0.0 },
                });
            }
            let [p, q] = &two;
            let mut expected = f64::INFINITY;
            for k in 0..p.start.len() {
                for l in 0..q.segments() {
                    expected = expected.min(p.meeting(k, q, l, 0.0));
                }
            }
            for k in 0..q.start.len() {
                for l in 0..p.segments() {
                    expected = expected.min(q.meeting(k, p, l, 0.0));
                }
            }
            assert_eq!(p.first_meeting(q, 0.0, 1.0), expected, "{case}");
            assert_eq!(q.first_meeting(p, 0.0, 1.0), expected, "{case}");
            if expected.is_finite() {
                met += 1;
                let none = p.first_meeting(q, 0.0, 0.5 * expected);
                assert!(none >= expected, "{case}: {none}");
            }
            tried += 1;
        }
        assert!(met > tried / 5 && met < tried, "{met} of {tried}");
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

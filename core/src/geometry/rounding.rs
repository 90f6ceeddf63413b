//! Chambers with rounded corners: the boundary of a polygon whose corners are arcs tangent to both edges.
//!
//! At a corner with the angle psi between its two rays and edges of lengths a and b, the arc of radius r touches the edges
//! at the distance r cot(psi / 2) from the corner. Where that does not fit, the radius shrinks: with the room
//! m = 0.45 (a^-4 + b^-4)^(-1/4), below 0.45 of the shorter edge and smooth in both, the distance is
//!
//! t = m g(r cot(psi / 2) / m),   g(x) = x up to 1/2, 1/2 + y / (1 + 2 y) with y = x - 1/2 above,
//!
//! once continuously differentiable and below m, so that a corner keeps its radius where the arc takes at most 19 % of the
//! shorter edge (of equal edges), and two arcs never meet. A spike of 3 degrees between edges of 38 mm gets a radius of
//! 0.3 mm of the 0.5 asked for; a void of 1 x 1 mm one of 0.31.
//!
//! A [`Station`] is a fraction of the arc length from the middle of one arc to the middle of the next. So places move
//! continuously differentiably with the corners, also where they pass from an arc to a straight part; without a radius they
//! are those of the polygon. Derivatives are exact.

use super::dual::Dual;
use super::{Point, Station, polygon};

/// Part of the shorter of two edges that an arc may take of each.
const ROOM: f64 = 0.45;
/// Sine of the angle between the rays below which a corner counts as straight.
const STRAIGHT: f64 = 1e-9;

/// A polygon with rounded corners.
#[derive(Clone, Debug)]
pub struct Rounded {
    corners: Vec<Point>,
    radius: f64,
}

/// The half of an arc that belongs to an edge.
#[derive(Clone, Copy, Debug)]
pub struct HalfArc {
    /// Its part of the edge's length, arcs included.
    pub share: f64,
    /// The angle by which it turns, radians.
    pub angle: f64,
    /// Its radius, mm.
    pub radius_mm: f64,
}

/// An edge between two corners, with the halves of their arcs.
struct RoundedEdge {
    /// The corners from the one before the edge to the one after it.
    corners: [DualPoint; 4],
    /// From corner to corner.
    along: DualPoint,
    edge: Dual,
    arcs: [Option<Arc>; 2],
    /// Lengths of the halves of the arcs, and of what is between them.
    halves: [Dual; 2],
    straight: Dual,
}

type DualPoint = [Dual; 2];

/// The rounding of one corner.
struct Arc {
    /// Distance of its ends from the corner.
    reach: Dual,
    radius: Dual,
    /// Half its length.
    half: Dual,
}

fn difference(a: DualPoint, b: DualPoint) -> DualPoint {
    [b[0] - a[0], b[1] - a[1]]
}

fn length(u: DualPoint) -> Dual {
    (u[0] * u[0] + u[1] * u[1]).sqrt()
}

fn cross(u: DualPoint, v: DualPoint) -> Dual {
    u[0] * v[1] - u[1] * v[0]
}

/// m g(x / m).
fn shrunk(wanted: Dual, room: Dual) -> Dual {
    let x = wanted / room;
    if x.value <= 0.5 {
        return wanted;
    }
    let (half, one) = (Dual::constant(0.5), Dual::constant(1.0));
    let y = x - half;
    room * (half + y / (one + y.scaled(2.0)))
}

impl Arc {
    /// `None` at a straight corner.
    fn new(before: DualPoint, corner: DualPoint, next: DualPoint, radius: f64) -> Option<Self> {
        let (u, v) = (difference(corner, next), difference(corner, before));
        let (a, b) = (length(u), length(v));
        let turn = cross(u, v) / (a * b);
        let sine = turn.scaled(turn.value.signum());
        let cosine = (u[0] * v[0] + u[1] * v[1]) / (a * b);
        if sine.value < STRAIGHT && cosine.value < 0.0 {
            return None;
        }
        let cotangent = sine / (Dual::constant(1.0) - cosine);
        let room = (a.powi(-4) + b.powi(-4)).sqrt().sqrt();
        let room = Dual::constant(ROOM) / room;
        let reach = shrunk(cotangent.scaled(radius), room);
        let radius = reach / cotangent;
        Some(Self {
            reach,
            radius,
            half: radius * cotangent.atan(),
        })
    }

    /// Along the edge from the corner, and away from it, of the place at an arc length from the arc's end.
    fn place(&self, from_end: Dual) -> DualPoint {
        let angle = from_end / self.radius;
        [
            self.reach - self.radius * angle.sin(),
            self.radius * (Dual::constant(1.0) - angle.cos()),
        ]
    }
}

impl Rounded {
    /// A polygon's corners, counter-clockwise, and the wanted radius, mm.
    pub fn new(corners: &[Point], radius_mm: f64) -> Self {
        Self {
            corners: corners.to_vec(),
            radius: radius_mm,
        }
    }

    /// Its corners, as if sharp.
    pub fn corners(&self) -> &[Point] {
        &self.corners
    }

    /// Whether its corners are rounded.
    pub fn is_rounded(&self) -> bool {
        self.radius > 0.0
    }

    /// The place of a station.
    pub fn at(&self, station: Station) -> Point {
        if self.radius > 0.0 {
            self.edge(station.edge)
                .at(station.fraction)
                .map(|d| d.value)
        } else {
            station.at(&self.corners)
        }
    }

    /// Adds the derivatives of `pull` . place with respect to the corners.
    pub fn add_slopes(&self, station: Station, pull: Point, into: &mut [Point]) {
        let n = self.corners.len();
        if self.radius > 0.0 {
            let place = self.edge(station.edge).at(station.fraction);
            for k in 0..4 {
                for c in 0..2 {
                    into[(station.edge + n + k - 1) % n][c] +=
                        pull[0] * place[0].slope[2 * k + c] + pull[1] * place[1].slope[2 * k + c];
                }
            }
        } else {
            for c in 0..2 {
                into[station.edge][c] += (1.0 - station.fraction) * pull[c];
                into[(station.edge + 1) % n][c] += station.fraction * pull[c];
            }
        }
    }

    /// The halves of the arcs at an edge's start and end; `None` where the corner is sharp or straight.
    pub fn arcs(&self, edge: usize) -> [Option<HalfArc>; 2] {
        if self.radius <= 0.0 {
            return [None; 2];
        }
        let rounded = self.edge(edge);
        let length = rounded.length().value;
        [0, 1].map(|k| {
            let arc = rounded.arcs[k].as_ref()?;
            Some(HalfArc {
                share: rounded.halves[k].value / length,
                angle: arc.half.value / arc.radius.value,
                radius_mm: arc.radius.value,
            })
        })
    }

    /// The radii of its corners, mm, without straight ones.
    pub fn radii_mm(&self) -> Vec<f64> {
        let arcs = (0..self.corners.len()).filter_map(|edge| self.arcs(edge)[0]);
        arcs.map(|arc| arc.radius_mm).collect()
    }

    /// The least radius of its corners, mm; 0 where they are sharp.
    pub fn least_radius_mm(&self) -> f64 {
        let least = self.radii_mm().into_iter().fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// Length of an edge from the middle of one arc to the middle of the next, mm.
    pub fn length(&self, edge: usize) -> f64 {
        if self.radius > 0.0 {
            return self.edge(edge).length().value;
        }
        let next = (edge + 1) % self.corners.len();
        polygon::distance(self.corners[edge], self.corners[next])
    }

    fn edge(&self, edge: usize) -> RoundedEdge {
        let n = self.corners.len();
        let corners: [DualPoint; 4] = std::array::from_fn(|k| {
            let p = self.corners[(edge + n + k - 1) % n];
            [Dual::variable(p[0], 2 * k), Dual::variable(p[1], 2 * k + 1)]
        });
        let [before, from, to, after] = corners;
        let along = difference(from, to);
        let length = length(along);
        let arcs = [
            Arc::new(before, from, to, self.radius),
            Arc::new(from, to, after, self.radius),
        ];
        let part = |k: usize, f: fn(&Arc) -> Dual| arcs[k].as_ref().map_or(Dual::constant(0.0), f);
        let halves = [part(0, |a| a.half), part(1, |a| a.half)];
        let straight = length - part(0, |a| a.reach) - part(1, |a| a.reach);
        RoundedEdge {
            corners,
            along,
            edge: length,
            arcs,
            halves,
            straight,
        }
    }

    /// Area that the rounded boundary encloses, by many chords.
    #[cfg(test)]
    pub(crate) fn area(&self) -> f64 {
        let places: Vec<Point> = (0..self.corners.len())
            .flat_map(|edge| (0..2000).map(move |k| (edge, f64::from(k) / 2000.0)))
            .map(|(edge, fraction)| self.at(Station { edge, fraction }))
            .collect();
        polygon::signed_area(&places)
    }
}

impl RoundedEdge {
    fn length(&self) -> Dual {
        self.halves[0] + self.straight + self.halves[1]
    }

    /// A place with its derivatives by the four corners.
    fn at(&self, fraction: f64) -> DualPoint {
        let [before, from, to, after] = self.corners;
        let zero = Dual::constant(0.0);
        let place = self.length().scaled(fraction);
        // Along the edge from its start, and off it to the left.
        let off = |other: DualPoint, corner: DualPoint| {
            cross(self.along, difference(corner, other)).value.signum()
        };
        let [first, last] = &self.arcs;
        let reach = first.as_ref().map_or(zero, |arc| arc.reach);
        let [s, h] = match (first, last) {
            (Some(arc), _) if place.value < self.halves[0].value => {
                let [s, h] = arc.place(self.halves[0] - place);
                [s, h.scaled(off(before, from))]
            }
            (_, Some(arc)) if place.value > (self.halves[0] + self.straight).value => {
                let [s, h] = arc.place(place - self.halves[0] - self.straight);
                [self.edge - s, h.scaled(off(after, to))]
            }
            _ => [place - self.halves[0] + reach, zero],
        };
        let unit = self.along.map(|d| d / self.edge);
        [
            from[0] + unit[0] * s - unit[1] * h,
            from[1] + unit[1] * s + unit[0] * h,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARROW: [Point; 4] = [[10.0, 10.0], [40.0, 12.0], [60.0, 30.0], [35.0, 20.0]];

    #[test]
    fn a_rounded_rectangle_has_its_area_and_its_arcs() {
        let rectangle = [[20.0, 13.0], [60.0, 13.0], [60.0, 28.0], [20.0, 28.0]];
        for r in [0.1, 0.5, 2.0] {
            let rounded = Rounded::new(&rectangle, r);
            let exact = 600.0 - (4.0 - std::f64::consts::PI) * r * r;
            assert!((rounded.area() - exact).abs() < 1e-3, "{r}");
            let middle = rounded.at(Station {
                edge: 0,
                fraction: 0.0,
            });
            let inset = r * (1.0 - 0.5_f64.sqrt());
            assert!(polygon::distance(middle, [20.0 + inset, 13.0 + inset]) < 1e-12);
        }
        // Far too large: arcs do not meet.
        let area = Rounded::new(&rectangle, 100.0).area();
        assert!(area > 500.0 && area < 599.0, "{area}");
    }

    #[test]
    fn without_a_radius_and_with_a_tiny_one_it_is_the_polygon() {
        for edge in 0..4 {
            for k in 0..10 {
                let station = Station {
                    edge,
                    fraction: 0.1 * f64::from(k),
                };
                let exact = station.at(&ARROW);
                assert_eq!(Rounded::new(&ARROW, 0.0).at(station), exact);
                let near = Rounded::new(&ARROW, 1e-7).at(station);
                assert!(polygon::distance(near, exact) < 1e-5);
            }
        }
    }

    #[test]
    fn slopes_agree_with_differences() {
        // Convex and reflex corners, arcs that fit and arcs that shrink.
        for r in [0.5, 3.0, 20.0] {
            for edge in 0..4 {
                for fraction in [0.0, 0.003, 0.07, 0.5, 0.93, 0.998] {
                    let station = Station { edge, fraction };
                    let pull = [0.7, -0.4];
                    let mut slopes = vec![[0.0; 2]; 4];
                    Rounded::new(&ARROW, r).add_slopes(station, pull, &mut slopes);
                    for corner in 0..4 {
                        for c in 0..2 {
                            let at = |h: f64| {
                                let mut moved = ARROW;
                                moved[corner][c] += h;
                                let p = Rounded::new(&moved, r).at(station);
                                pull[0] * p[0] + pull[1] * p[1]
                            };
                            let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                            assert!(
                                (difference - slopes[corner][c]).abs() < 1e-7,
                                "{r} {edge} {fraction}: {difference} {}",
                                slopes[corner][c]
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn places_move_smoothly_through_every_change_of_the_rule() {
        // A corner moves so that an arc stops fitting, a corner becomes straight and then reflex, and places pass from
        // arcs to edges: slopes do not jump.
        let slope = |t: f64, station: Station| {
            let corners = [
                [0.0, 0.0],
                [10.0, 0.0],
                [10.0 - 9.0 * t, 10.0 - 9.0 * t],
                [0.0, 10.0],
            ];
            let mut slopes = vec![[0.0; 2]; 4];
            Rounded::new(&corners, 2.0).add_slopes(station, [1.0, 1.0], &mut slopes);
            slopes[2]
        };
        for edge in 0..4 {
            for fraction in [0.0, 0.05, 0.1, 0.2, 0.8, 0.95] {
                let station = Station { edge, fraction };
                let steps = 20_000;
                let mut before = slope(0.0, station);
                for k in 1..=steps {
                    let now = slope(f64::from(k) / f64::from(steps), station);
                    assert!(
                        polygon::distance(before, now) < 0.02,
                        "{edge} {fraction} {k}"
                    );
                    before = now;
                }
            }
        }
    }
}

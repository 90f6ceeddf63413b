//! The thin ring under outer pressure: an inextensible elastica that buckles in two waves and folds until opposite sides touch
//! (Flaherty, Keller and Rubinow, SIAM J. Appl. Math. 23, 1972, 446).
//!
//! ```text
//!     .--.___.--.      lengths over R, forces over EI / R^2, p over EI / R^3
//!    (    h ^    )     the quarter from the middle of the dent (0, h) to the side (w, 0), s from 0 to pi/2
//!     '--'^^^'--'      section force n = (-p y, V + p x), of which V = -Q/2 with the force Q of the sides on each other
//!       w ---->        k' = -(cos(theta) n_y - sin(theta) n_x), theta' = k, theta(0) = 0, theta(pi/2) = -pi/2, y(pi/2) = 0
//! ```
//! Sides of no thickness touch at p = 5.247. The curvature in the dent falls then, and vanishes at p = 10.34: beyond that a length
//! of them touches.

use std::f64::consts::FRAC_PI_2;

const STEPS: usize = 400;

/// A quarter of the ring.
#[derive(Clone, Copy, Debug)]
pub struct Quarter {
    /// Outer pressure.
    pub pressure: f64,
    /// Half height of the centre line in the middle.
    pub height: f64,
    /// Curvature there, that of the circle being -1.
    pub curvature: f64,
    /// Force of the sides on each other.
    pub contact: f64,
    /// Half width.
    pub width: f64,
}

/// What is sought, beside the curvature.
#[derive(Clone, Copy)]
enum Sought {
    Pressure,
    Height,
    Contact,
}

impl Quarter {
    /// The ring before its sides touch, from where it buckles to a half height.
    pub fn of_height(height: f64) -> Self {
        let mut dent: f64 = 0.02;
        let mut at = Self {
            pressure: 3.0,
            height: 1.0 - dent,
            curvature: -1.0 + 3.0 * dent,
            contact: 0.0,
            width: 1.0 + dent,
        };
        loop {
            at.height = (1.0 - dent).max(height);
            at.solve(Sought::Pressure);
            if at.height <= height {
                return at;
            }
            dent += 0.02;
        }
    }

    /// The ring under a pressure above 3.05, whose sides touch at half the height `least`.
    pub fn under(pressure: f64, least: f64) -> Self {
        let mut at = Self::of_height(least);
        if pressure < at.pressure {
            // The height falls as the pressure rises.
            let mut dent = 0.1;
            while dent < 1.0 - least {
                let next = Self::of_height(1.0 - dent);
                if next.pressure > pressure {
                    at = next;
                    break;
                }
                dent += 0.05;
            }
            at.pressure = pressure;
            at.solve(Sought::Height);
            return at;
        }
        while at.pressure < pressure {
            at.pressure = (at.pressure + 0.1).min(pressure);
            at.solve(Sought::Contact);
        }
        at
    }

    fn sought(&mut self, what: Sought) -> &mut f64 {
        match what {
            Sought::Pressure => &mut self.pressure,
            Sought::Height => &mut self.height,
            Sought::Contact => &mut self.contact,
        }
    }

    /// Newton's method on the two conditions at the side, with differences.
    fn solve(&mut self, what: Sought) {
        const H: f64 = 1e-6;
        for _ in 0..30 {
            let r = self.shoot();
            let (mut a, mut b) = (*self, *self);
            a.curvature += H;
            *b.sought(what) += H;
            let (a, b) = (a.shoot(), b.shoot());
            let j = [0, 1].map(|i| [(a[i] - r[i]) / H, (b[i] - r[i]) / H]);
            let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
            let step = [
                (j[1][1] * r[0] - j[0][1] * r[1]) / det,
                (j[0][0] * r[1] - j[1][0] * r[0]) / det,
            ];
            self.curvature -= step[0];
            *self.sought(what) -= step[1];
            if step[0].abs() + step[1].abs() < 1e-10 {
                break;
            }
        }
        self.shoot();
    }

    /// Runge and Kutta from the dent to the side: what misses there in slope and height.
    fn shoot(&mut self) -> [f64; 2] {
        let (p, v) = (self.pressure, -0.5 * self.contact);
        let slope = |[x, y, theta, k]: [f64; 4]| {
            let (sin, cos) = theta.sin_cos();
            [cos, sin, k, -(cos * (v + p * x) + sin * p * y)]
        };
        let h = FRAC_PI_2 / STEPS as f64;
        let mut at = [0.0, self.height, 0.0, self.curvature];
        for _ in 0..STEPS {
            let along = |k: [f64; 4], h: f64| std::array::from_fn(|i| at[i] + h * k[i]);
            let k1 = slope(at);
            let k2 = slope(along(k1, 0.5 * h));
            let k3 = slope(along(k2, 0.5 * h));
            let k4 = slope(along(k3, h));
            at = std::array::from_fn(|i| {
                at[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            });
        }
        self.width = at[0];
        [at[2] + FRAC_PI_2, at[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ring_buckles_touches_and_flattens_where_published() {
        let buckled = Quarter::of_height(0.98);
        assert!((buckled.pressure - 3.0).abs() < 0.01, "{buckled:?}");
        let touching = Quarter::of_height(0.0);
        assert!((touching.pressure - 5.247).abs() < 1e-3, "{touching:?}");
        let flat = Quarter::under(10.34, 0.0);
        assert!(flat.curvature.abs() < 2e-3, "{flat:?}");
        let between = Quarter::under(4.0, 0.0);
        assert!((Quarter::of_height(between.height).pressure - 4.0).abs() < 1e-8);
    }
}

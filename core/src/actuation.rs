//! The actuation cycle (Fig. 5b of the paper): chamber pressures over a pseudo-time, piecewise linear, and the fixed
//! set of states through which every analysis goes.

use serde::{Deserialize, Serialize};

/// How the states of a leg are spaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spacing {
    /// Fractions k/n.
    #[default]
    Equal,
    /// Finer towards zero pressure: (k/n)^2 on a leg that leaves it, 1 - (1 - k/n)^2 on one that returns to it.
    Graded,
}

/// A cycle of actuation points; a leg runs between two consecutive rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActuationCycle {
    /// Rows of channel pressures, kPa; the first is all zero.
    pub rows_kpa: Vec<Vec<f64>>,
    /// States on each leg, its end included.
    pub load_steps_per_leg: usize,
    /// Spacing of those states.
    pub spacing: Spacing,
}

/// One state of the path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActuationPoint {
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg in [0, 1].
    pub fraction: f64,
    /// Pressure of each channel, kPa.
    pub pressure_kpa: Vec<f64>,
}

impl ActuationCycle {
    /// Rows of a named schedule at pressure `p` (kPa), pairs (lower, upper); `None` for an unknown name.
    pub fn named_rows(name: &str, p: f64) -> Option<Vec<Vec<f64>>> {
        Some(match name {
            "hold" => vec![vec![0., 0.], vec![p, 0.], vec![p, p], vec![0., 0.]],
            "swap" => vec![vec![0., 0.], vec![p, 0.], vec![0., p], vec![0., 0.]],
            "overlap" => vec![
                vec![0., 0.],
                vec![p, 0.],
                vec![p, p],
                vec![0., p],
                vec![0., 0.],
            ],
            "ramp" => vec![vec![0.], vec![p]],
            _ => return None,
        })
    }

    /// Largest absolute pressure, kPa.
    pub fn largest_kpa(&self) -> f64 {
        let all = self.rows_kpa.iter().flatten();
        all.fold(0.0, |largest: f64, p| largest.max(p.abs()))
    }

    /// The same schedule, scaled to another largest pressure.
    #[must_use]
    pub fn scaled_to(&self, largest_kpa: f64) -> Self {
        let factor = largest_kpa / self.largest_kpa();
        let mut scaled = self.clone();
        for p in scaled.rows_kpa.iter_mut().flatten() {
            *p *= factor;
        }
        scaled
    }

    /// The same schedule with one pressure per chamber, from the channel that drives each. A channel that is not there has no
    /// pressure; one that drives no chamber is left out.
    #[must_use]
    pub fn of_chambers(&self, channels: &[usize]) -> Self {
        let row = |row: &Vec<f64>| {
            let pressure = |channel: &usize| row.get(*channel).copied().unwrap_or(0.0);
            channels.iter().map(pressure).collect()
        };
        Self {
            rows_kpa: self.rows_kpa.iter().map(row).collect(),
            ..self.clone()
        }
    }

    /// Number of legs.
    pub fn legs(&self) -> usize {
        self.rows_kpa.len().saturating_sub(1)
    }

    /// Number of pressure channels.
    pub fn channels(&self) -> usize {
        self.rows_kpa.first().map_or(0, Vec::len)
    }

    /// Pressures at a fraction of a leg, kPa.
    pub fn pressure_kpa(&self, leg: usize, fraction: f64) -> Vec<f64> {
        let (a, b) = (&self.rows_kpa[leg], &self.rows_kpa[leg + 1]);
        if fraction == 1.0 {
            return b.clone();
        }
        a.iter()
            .zip(b)
            .map(|(a, b)| a + (b - a) * fraction)
            .collect()
    }

    /// The path: rest as (leg 0, fraction 0), then the states of each leg, `1 + legs * load_steps_per_leg` in all.
    pub fn path(&self) -> Vec<ActuationPoint> {
        let is_zero = |row: &[f64]| row.iter().all(|p| *p == 0.0);
        let n = self.load_steps_per_leg;
        let mut path = vec![ActuationPoint {
            leg: 0,
            fraction: 0.0,
            pressure_kpa: self.rows_kpa[0].clone(),
        }];
        for leg in 0..self.legs() {
            for k in 1..=n {
                let t = k as f64 / n as f64;
                let fraction = match self.spacing {
                    Spacing::Graded if k < n && is_zero(&self.rows_kpa[leg]) => t * t,
                    Spacing::Graded if k < n && is_zero(&self.rows_kpa[leg + 1]) => {
                        1.0 - (1.0 - t) * (1.0 - t)
                    }
                    _ => t,
                };
                path.push(ActuationPoint {
                    leg,
                    fraction,
                    pressure_kpa: self.pressure_kpa(leg, fraction),
                });
            }
        }
        path
    }
}

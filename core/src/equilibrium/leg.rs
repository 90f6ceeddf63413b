//! A straight stretch of the schedule: the load as a linear function of a fraction.

use crate::actuation::ActuationCycle;
use crate::assembly::{Load, System};
use crate::mesh::{Obstacle, Support};

/// From one row of channel pressures to another.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    /// Its number in the schedule, from 0.
    pub index: usize,
    from: Load,
    rate: Load,
    rows_kpa: [Vec<f64>; 2],
    /// Fractions of the schedule's leg at the ends.
    fractions: [f64; 2],
}

/// Load of channel pressures in kPa; `largest` is each channel's largest absolute value in the schedule.
pub(super) fn load(pressure_kpa: &[f64], largest: &[f64]) -> Load {
    Load {
        pressure: pressure_kpa.iter().map(|p| p * 1e-3).collect(),
        share: pressure_kpa
            .iter()
            .zip(largest)
            .map(|(p, m)| if *m > 0.0 { p / m } else { 0.0 })
            .collect(),
    }
}

impl Leg {
    /// A leg of a schedule.
    pub fn of(cycle: &ActuationCycle, index: usize, largest: &[f64]) -> Self {
        Self::between(
            index,
            [&cycle.rows_kpa[index], &cycle.rows_kpa[index + 1]],
            [0.0, 1.0],
            largest,
        )
    }

    /// Beyond the last row of a leg, to `factor` times that row.
    pub fn beyond(cycle: &ActuationCycle, index: usize, factor: f64, largest: &[f64]) -> Self {
        let row = &cycle.rows_kpa[index + 1];
        let end: Vec<f64> = row.iter().map(|p| factor * p).collect();
        Self::between(index, [row, &end], [1.0, factor], largest)
    }

    fn between(index: usize, rows: [&Vec<f64>; 2], fractions: [f64; 2], largest: &[f64]) -> Self {
        let [from, to] = rows.map(|row| load(row, largest));
        let difference = |a: &[f64], b: &[f64]| b.iter().zip(a).map(|(b, a)| b - a).collect();
        Self {
            index,
            rate: Load {
                pressure: difference(&from.pressure, &to.pressure),
                share: difference(&from.share, &to.share),
            },
            from,
            rows_kpa: rows.map(Clone::clone),
            fractions,
        }
    }

    /// The load at a fraction of this leg.
    pub fn load(&self, fraction: f64) -> Load {
        let at = |a: &[f64], r: &[f64]| a.iter().zip(r).map(|(a, r)| a + r * fraction).collect();
        Load {
            pressure: at(&self.from.pressure, &self.rate.pressure),
            share: at(&self.from.share, &self.rate.share),
        }
    }

    /// Change of the load over the leg.
    pub fn rate(&self) -> &Load {
        &self.rate
    }

    /// Whether forces on the body change on this leg.
    pub fn has_forces(&self, system: &System) -> bool {
        let body = &system.body;
        body.cavities
            .iter()
            .any(|c| self.rate.pressure[c.channel] != 0.0)
            || body
                .tractions
                .iter()
                .any(|t| self.rate.share[t.channel] != 0.0)
    }

    /// Whether supports or obstacles of the body move on this leg.
    pub fn moves_supports(&self, system: &System) -> bool {
        let moves = |s: &Support| s.displacement_mm * self.rate.share[s.channel] != 0.0;
        system.body.supports.iter().any(moves) || self.moves_obstacles(system)
    }

    /// Whether obstacles move on this leg.
    pub fn moves_obstacles(&self, system: &System) -> bool {
        let moves = |o: &Obstacle| o.travel_mm != [0.0; 2] && self.rate.share[o.channel] != 0.0;
        system.body.obstacles.iter().any(moves)
    }

    /// Pressures at a fraction of this leg, kPa.
    pub fn pressure_kpa(&self, fraction: f64) -> Vec<f64> {
        let [a, b] = &self.rows_kpa;
        a.iter()
            .zip(b)
            .map(|(a, b)| a + (b - a) * fraction)
            .collect()
    }

    /// Length of this leg in fractions of the schedule's leg.
    pub fn span(&self) -> f64 {
        self.fractions[1] - self.fractions[0]
    }

    /// The fraction of the schedule's leg; above 1 beyond its end.
    pub fn of_schedule(&self, fraction: f64) -> f64 {
        let [a, b] = self.fractions;
        a + (b - a) * fraction
    }
}

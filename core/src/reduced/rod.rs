//! A chain as a rod whose units' strains are known over the plane of two pressures.

use serde::Serialize;

use super::constant_strain::{Strain, rod_frames};
use super::surface::{Points, Surface};
use super::{Frame, LinearTransform};
use crate::geometry::Point;

/// Why there is no rod, or no answer from it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRod {
    /// As many transformations as the grid has pressures are needed.
    #[error("a grid of {grid} by {grid} pressures has {} states, found {found}", grid * grid)]
    States {
        /// Pressures of each channel.
        grid: usize,
        /// Transformations.
        found: usize,
    },
    /// Another number of channels.
    #[error("a rod has two channels, the schedule has {found}")]
    Channels {
        /// Those of the schedule.
        found: usize,
    },
    /// Pressures that were not calibrated.
    #[error("({}, {}) kPa is outside of what was calibrated, 0 to {largest_kpa} kPa", pressure_kpa[0], pressure_kpa[1])]
    OutsideRange {
        /// What was asked, kPa.
        pressure_kpa: [f64; 2],
        /// Largest pressure of each channel, kPa.
        largest_kpa: f64,
    },
    /// Fewer units than a chain with ends has.
    #[error("a rod has at least {least} units, asked for {units}")]
    Units {
        /// The least.
        least: usize,
        /// What was asked for.
        units: usize,
    },
}

/// A unit's strains over [0, p]^2.
#[derive(Clone, Debug, PartialEq)]
pub struct RodUnit {
    /// Largest pressure of each channel, kPa.
    largest_kpa: f64,
    surface: Surface<3>,
}

impl RodUnit {
    /// Through transformations at the grid's pressures, the first channel running fastest.
    ///
    /// # Errors
    /// Another number of them.
    pub fn new(
        grid: usize,
        largest_kpa: f64,
        width_mm: f64,
        transforms: &[LinearTransform],
    ) -> Result<Self, NoRod> {
        let parts = |t| Strain::of_transform(t, width_mm).parts();
        let values = transforms.iter().map(parts).collect();
        let found = transforms.len();
        let surface = Surface::new(Points::new(grid), values);
        Ok(Self {
            largest_kpa,
            surface: surface.ok_or(NoRod::States { grid, found })?,
        })
    }

    /// The strains at two pressures, kPa.
    ///
    /// # Errors
    /// Pressures outside of the range, or not two.
    pub fn strain(&self, pressure_kpa: &[f64]) -> Result<Strain, NoRod> {
        let &[first, second] = pressure_kpa else {
            let found = pressure_kpa.len();
            return Err(NoRod::Channels { found });
        };
        let pressure_kpa = [first, second];
        // A last digit is no other pressure; what is no number is outside.
        let inside = |p: &f64| (0.0..=self.largest_kpa * (1.0 + 1e-12)).contains(p);
        if !pressure_kpa.iter().all(inside) {
            return Err(NoRod::OutsideRange {
                pressure_kpa,
                largest_kpa: self.largest_kpa,
            });
        }
        let shares = pressure_kpa.map(|p| (p / self.largest_kpa).min(1.0));
        Ok(Strain::from_parts(self.surface.at(shares)))
    }
}

/// A chain: its first unit, all between, and the last, whose ends are clamped, joined and free.
#[derive(Clone, Debug, PartialEq)]
pub struct Rod {
    /// Width and height of a unit, mm.
    pub unit_mm: [f64; 2],
    /// The unit at the clamped end.
    pub first: RodUnit,
    /// One between others.
    pub middle: RodUnit,
    /// The one at the free end.
    pub last: RodUnit,
}

/// Which units a rod is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RodUnits {
    /// The middle one for all.
    Middle,
    /// The first and the last in their places.
    Each,
}

impl Rod {
    /// The strains of a chain at two pressures, kPa.
    ///
    /// # Errors
    /// As [`RodUnit::strain`]; fewer than two units with ends of their own.
    pub fn strains(
        &self,
        units: usize,
        made_of: RodUnits,
        pressure_kpa: &[f64],
    ) -> Result<Vec<Strain>, NoRod> {
        let least = match made_of {
            RodUnits::Middle => 1,
            RodUnits::Each => 2,
        };
        if units < least {
            return Err(NoRod::Units { least, units });
        }
        let mut chain = vec![self.middle.strain(pressure_kpa)?; units];
        if made_of == RodUnits::Each {
            chain[0] = self.first.strain(pressure_kpa)?;
            chain[units - 1] = self.last.strain(pressure_kpa)?;
        }
        Ok(chain)
    }

    /// The middle of the right edge of unit `tip_unit` (from 1) of `units`, at each of some pressures, mm.
    ///
    /// # Errors
    /// As [`Self::strains`]; no such unit.
    pub fn path(
        &self,
        units: usize,
        tip_unit: usize,
        made_of: RodUnits,
        pressures_kpa: &[Vec<f64>],
    ) -> Result<Vec<Point>, NoRod> {
        if !(1..=units).contains(&tip_unit) {
            let least = tip_unit.max(1);
            return Err(NoRod::Units { least, units });
        }
        let clamped = Frame::clamped(self.unit_mm);
        let tip = |pressure: &Vec<f64>| {
            let strains = self.strains(units, made_of, pressure)?;
            let frames = rod_frames(clamped, &strains[..tip_unit], self.unit_mm[0]);
            Ok(frames[tip_unit].origin_mm)
        };
        pressures_kpa.iter().map(tip).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [f64; 2] = [80.0, 60.0];
    const GRID: usize = 5;

    /// Polynomials of the square roots of the shares, whose degree the grid holds.
    fn exact([p, q]: [f64; 2], scale: f64) -> Strain {
        let (s, t) = ((p / 15.0).sqrt(), (q / 15.0).sqrt());
        Strain::from_parts([
            scale * 3e-3 * (s * s - t * t * t),
            scale * 0.05 * (s.powi(4) + t * t + s * t),
            scale * 0.01 * (t - s * s),
        ])
    }

    fn unit(scale: f64) -> RodUnit {
        let shares = Points::new(GRID).shares();
        let transforms: Vec<LinearTransform> = (0..GRID * GRID)
            .map(|k| {
                let strain = exact(
                    [shares[k % GRID], shares[k / GRID]].map(|s| 15.0 * s),
                    scale,
                );
                let pose = strain.pose(UNIT[0]);
                let (s, c) = pose.turn_rad.sin_cos();
                // The edge as the pose has it, its height changed: strains do not see that.
                let [x, y] = pose.origin_mm.map(|v| v / UNIT[0]);
                LinearTransform::from_slice(&[x, -1.1 * s, y, 1.1 * c])
            })
            .collect();
        RodUnit::new(GRID, 15.0, UNIT[0], &transforms).expect("all states")
    }

    #[test]
    fn data_of_the_model_are_recovered_at_pressures_that_were_not_calibrated() {
        let rod = Rod {
            unit_mm: UNIT,
            first: unit(0.6),
            middle: unit(1.0),
            last: unit(1.3),
        };
        for pressures in [[0.0, 0.0], [15.0, 3.3], [7.7, 11.1], [0.01, 15.0]] {
            let chain = rod.strains(4, RodUnits::Each, &pressures).expect("inside");
            for (found, scale) in chain.iter().zip([0.6, 1.0, 1.0, 1.3]) {
                let expected = exact(pressures, scale);
                for (a, b) in found.parts().iter().zip(expected.parts()) {
                    assert!((a - b).abs() < 1e-13, "{pressures:?}");
                }
            }
        }
        let rows = [vec![0.0, 0.0], vec![9.0, 2.0]];
        let path = rod.path(20, 19, RodUnits::Middle, &rows).expect("inside");
        let arc = super::super::rod_tip(&exact([9.0, 2.0], 1.0), UNIT, 19).0;
        assert!((path[1][0] - arc[0]).hypot(path[1][1] - arc[1]) < 1e-9);
        assert_eq!(path[0], [19.0 * 80.0, 30.0]);
    }

    #[test]
    fn what_a_rod_does_not_know_is_an_error_with_numbers() {
        let rod = Rod {
            unit_mm: UNIT,
            first: unit(1.0),
            middle: unit(1.0),
            last: unit(1.0),
        };
        let said = |found: Result<Vec<Strain>, NoRod>| found.unwrap_err().to_string();
        let of = |units, made_of, p: &[f64]| rod.strains(units, made_of, p);
        assert_eq!(
            said(of(3, RodUnits::Middle, &[16.0, 0.0])),
            "(16, 0) kPa is outside of what was calibrated, 0 to 15 kPa"
        );
        assert!(of(3, RodUnits::Middle, &[f64::NAN, 0.0]).is_err());
        assert!(said(of(3, RodUnits::Middle, &[1.0])).contains("the schedule has 1"));
        assert!(said(of(1, RodUnits::Each, &[1.0, 0.0])).contains("at least 2 units"));
        assert!(rod.path(3, 4, RodUnits::Middle, &[vec![0.0, 0.0]]).is_err());
        let few = RodUnit::new(GRID, 15.0, 80.0, &[]).unwrap_err();
        assert_eq!(
            few.to_string(),
            "a grid of 5 by 5 pressures has 25 states, found 0"
        );
    }
}

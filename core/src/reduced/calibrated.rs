//! Transformations fitted at the states of a schedule, and what they may be asked.

use serde::{Deserialize, Serialize};

use super::{Bounds, Fit, LinearTransform};
use crate::actuation::ActuationPoint;

/// A state with its fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedState {
    /// Where on the path, at which pressures.
    #[serde(flatten)]
    pub point: ActuationPoint,
    /// The transformation and its residual.
    #[serde(flatten)]
    pub fit: Fit,
}

/// A unit's transformations over a path of pressures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibrated {
    /// Width and height of the unit, mm.
    pub unit_mm: [f64; 2],
    /// States in the order of the path.
    pub states: Vec<FittedState>,
}

/// Why a transformation is not known.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OutsideFit {
    /// A pressure beyond all that were fitted.
    #[error(
        "channel {channel} is asked at {asked_kpa} kPa, fitted from {} to {} kPa",
        range_kpa[0],
        range_kpa[1]
    )]
    OutsideFitRange {
        /// The channel.
        channel: usize,
        /// What was asked, kPa.
        asked_kpa: f64,
        /// What was fitted, kPa.
        range_kpa: [f64; 2],
    },
    /// Pressures within the range of every channel that are not on the path.
    #[error(
        "({}) kPa is {distance_kpa} kPa from ({}) kPa, the nearest pressures of the fitted path",
        list(asked_kpa),
        list(nearest_kpa)
    )]
    OffPath {
        /// What was asked, kPa.
        asked_kpa: Vec<f64>,
        /// The nearest that was fitted, kPa.
        nearest_kpa: Vec<f64>,
        /// How far that is, kPa.
        distance_kpa: f64,
    },
    /// Another number of channels.
    #[error("{asked} pressures are asked for, fitted are {fitted} channels")]
    Channels {
        /// Pressures asked for.
        asked: usize,
        /// Channels of the fit; 0 without a state.
        fitted: usize,
    },
}

fn list(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(f64::to_string).collect();
    values.join(", ")
}

/// Share of the largest pressure by which pressures may miss the path.
const ON_PATH: f64 = 1e-9;

impl Calibrated {
    /// Least and largest pressure of each channel, kPa.
    pub fn range_kpa(&self) -> Vec<[f64; 2]> {
        let channels = self
            .states
            .first()
            .map_or(0, |s| s.point.pressure_kpa.len());
        (0..channels)
            .map(|c| {
                let pressures = self.states.iter().map(|s| s.point.pressure_kpa[c]);
                pressures.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
                    [low.min(p), high.max(p)]
                })
            })
            .collect()
    }

    /// The transformation at channel pressures on the path, straight between the states about them. Where the path passes
    /// there more than once, the first passage counts: with a unique equilibrium they are the same.
    ///
    /// # Errors
    /// Pressures outside the range of a channel, or not on the path.
    pub fn transform_at(&self, asked_kpa: &[f64]) -> Result<LinearTransform, OutsideFit> {
        let range = self.range_kpa();
        if asked_kpa.len() != range.len() || range.is_empty() {
            return Err(OutsideFit::Channels {
                asked: asked_kpa.len(),
                fitted: range.len(),
            });
        }
        let largest = range.iter().flatten().fold(0.0, |m: f64, p| m.max(p.abs()));
        let slack = ON_PATH * largest;
        for (channel, (asked, [low, high])) in asked_kpa.iter().zip(&range).enumerate() {
            // Written so that what is no number is outside as well.
            if !(*asked >= low - slack && *asked <= high + slack) {
                return Err(OutsideFit::OutsideFitRange {
                    channel,
                    asked_kpa: *asked,
                    range_kpa: [*low, *high],
                });
            }
        }
        let nearest = self.nearest(asked_kpa);
        let (distance, before, fraction) = nearest;
        let after = (before + 1).min(self.states.len() - 1);
        let [a, b] = [before, after].map(|i| &self.states[i]);
        if distance > slack {
            let between = a.point.pressure_kpa.iter().zip(&b.point.pressure_kpa);
            return Err(OutsideFit::OffPath {
                asked_kpa: asked_kpa.to_vec(),
                nearest_kpa: between.map(|(a, b)| a + fraction * (b - a)).collect(),
                distance_kpa: distance,
            });
        }
        Ok(a.fit.transform.towards(&b.fit.transform, fraction))
    }

    /// Distance to the path, the state before the nearest point, and its fraction of the way to the next.
    fn nearest(&self, asked: &[f64]) -> (f64, usize, f64) {
        let mut best = (f64::INFINITY, 0, 0.0);
        for (i, pair) in self.states.windows(2).enumerate() {
            let [a, b] = [0, 1].map(|k| &pair[k].point.pressure_kpa);
            let (mut along, mut squared) = (0.0, 0.0);
            for ((p, a), b) in asked.iter().zip(a).zip(b) {
                along += (p - a) * (b - a);
                squared += (b - a) * (b - a);
            }
            let fraction = if squared > 0.0 {
                (along / squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let distance = distance_to(asked, |c| a[c] + fraction * (b[c] - a[c]));
            if distance < best.0 {
                best = (distance, i, fraction);
            }
        }
        if let [only] = &self.states[..] {
            best.0 = distance_to(asked, |c| only.point.pressure_kpa[c]);
        }
        best
    }

    /// The transformations in the order of the path.
    pub fn transforms(&self) -> Vec<LinearTransform> {
        self.states.iter().map(|s| s.fit.transform).collect()
    }

    /// The states at the rows of the schedule, the last of each leg, with rest first. The paper's model knows these alone.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &FittedState)> {
        let states = self.states.iter().enumerate();
        states.filter(|(i, s)| *i == 0 || s.point.fraction == 1.0)
    }

    /// The least box that holds all entries.
    pub fn bounds(&self) -> Bounds {
        Bounds::around(&self.transforms())
    }
}

fn distance_to(asked: &[f64], at: impl Fn(usize) -> f64) -> f64 {
    let squares = asked.iter().enumerate().map(|(c, p)| (p - at(c)).powi(2));
    squares.sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actuation::{ActuationCycle, Spacing};

    /// x_scl = 1 + (p0 + 10 p1) / 1000, straight in the pressures.
    fn calibrated(schedule: &str) -> Calibrated {
        let cycle = ActuationCycle {
            rows_kpa: ActuationCycle::named_rows(schedule, 15.0).unwrap(),
            load_steps_per_leg: 4,
            spacing: Spacing::Graded,
        };
        let states = cycle.path().into_iter().map(|point| {
            let p = &point.pressure_kpa;
            let by_upper = p.get(1).map_or(0.0, |p| 10.0 * p);
            let transform =
                LinearTransform::from_slice(&[1.0 + (p[0] + by_upper) / 1e3, 0.0, 0.0, 1.0]);
            FittedState {
                point,
                fit: Fit {
                    transform,
                    rms_mm: 0.0,
                    max_mm: 0.0,
                },
            }
        });
        Calibrated {
            unit_mm: [80.0; 2],
            states: states.collect(),
        }
    }

    #[test]
    fn between_states_of_the_path_it_is_known() {
        let known = calibrated("overlap");
        assert_eq!(known.range_kpa(), [[0.0, 15.0]; 2]);
        for (asked, x_scl) in [
            ([0.0, 0.0], 1.0),
            ([7.0, 0.0], 1.007),
            ([15.0, 0.0], 1.015),
            ([15.0, 3.3], 1.048),
            ([4.0, 15.0], 1.154),
            ([0.0, 11.0], 1.11),
        ] {
            let found = known.transform_at(&asked).unwrap();
            assert!((found.x_scl - x_scl).abs() < 1e-12, "{asked:?}");
        }
        let rows: Vec<usize> = known.rows().map(|(i, _)| i).collect();
        assert_eq!(rows, [0, 4, 8, 12, 16]);
    }

    #[test]
    fn what_was_not_fitted_is_an_error_with_numbers() {
        let known = calibrated("hold");
        let outside = known.transform_at(&[0.0, 16.5]).unwrap_err();
        assert_eq!(
            outside,
            OutsideFit::OutsideFitRange {
                channel: 1,
                asked_kpa: 16.5,
                range_kpa: [0.0, 15.0]
            }
        );
        assert_eq!(
            outside.to_string(),
            "channel 1 is asked at 16.5 kPa, fitted from 0 to 15 kPa"
        );
        // Under `hold` the upper chamber never acts alone.
        let off = known.transform_at(&[0.0, 10.0]).unwrap_err();
        let OutsideFit::OffPath {
            nearest_kpa,
            distance_kpa,
            ..
        } = off
        else {
            panic!("{off}")
        };
        assert!((nearest_kpa[0] - 5.0).abs() < 1e-12 && (nearest_kpa[1] - 5.0).abs() < 1e-12);
        assert!((distance_kpa - 50.0_f64.sqrt()).abs() < 1e-12);
        for asked in [&[1.0][..], &[]] {
            let wrong = known.transform_at(asked).unwrap_err();
            assert!(matches!(wrong, OutsideFit::Channels { fitted: 2, .. }));
        }
        assert!(known.transform_at(&[f64::NAN, 0.0]).is_err());
        let none = Calibrated {
            unit_mm: [80.0; 2],
            states: Vec::new(),
        };
        assert!(none.transform_at(&[]).is_err());
        let ramp = calibrated("ramp");
        assert!((ramp.transform_at(&[9.0]).unwrap().x_scl - 1.009).abs() < 1e-12);
    }
}

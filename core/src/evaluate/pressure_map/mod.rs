//! The tip over the plane of two pressures, from one set of solves, and the area that any schedule encloses on it.
//!
//! A quasi-static elastic response depends on the two pressures alone while the equilibrium is unique: then the tip's
//! displacement is a surface over [0, p]^2 and a schedule a line on it. The map solves the scene at n by n pairs of pressures
//! ([`surface`]: Lobatto's points in the square root of the pressure) on one path, interpolates between them and scores schedules
//! ([`Score`]) without further solves, each with its error. The path goes to and fro along the first channel, one value of the second
//! after the other, and returns to rest along the diagonal, where it meets n states again from another side. Where it finds them
//! elsewhere, where a state is unstable or a second equilibrium was met, the map says so and scores nothing.

mod score;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use serde::Serialize;

pub use crate::reduced::surface;
pub use score::Score;
use surface::{Points, Surface};

use super::answer::{SceneAnswer, SceneStatus, StateAnswer};
use super::scene::{SceneOptions, solve_scene};
use crate::actuation::{ActuationCycle, Spacing};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::MeshPlan;
use crate::scene::Scene;

/// Pressures of each channel where no number is asked for.
pub const DEFAULT_GRID: usize = 7;
/// Numbers of pressures that a map can have: odd, so that every second one is a coarser map.
pub const GRIDS: std::ops::RangeInclusive<usize> = 5..=33;
/// Two states at the same pressures that differ by more than this share of the largest displacement are two equilibria.
const DIFFERENT: f64 = 1e-3;

/// A scene that has no map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CannotMap {
    /// Not two channels.
    #[error("a map has two channels, the schedule has {found}")]
    Channels {
        /// Channels of the schedule.
        found: usize,
    },
    /// A number of pressures that gives no nested grids.
    #[error("a map has an odd number of pressures from {} to {} in each channel, not {found}", GRIDS.start(), GRIDS.end())]
    Grid {
        /// What was asked for.
        found: usize,
    },
    /// No positive pressure.
    #[error("the largest pressure of the schedule is {found} kPa; a map needs a positive one")]
    Pressure {
        /// Largest pressure, kPa.
        found: f64,
    },
    /// No probe.
    #[error("the scene has no probe to follow")]
    NoProbe,
    /// Faults of the scene.
    #[error(transparent)]
    Scene(#[from] Faults),
}

/// Why a schedule has no score.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotScored {
    /// A pressure outside of the map, which does not extrapolate.
    #[error("({}, {}) kPa is outside of the map's range, 0 to {largest_kpa} kPa", pressure_kpa[0], pressure_kpa[1])]
    OutsideRange {
        /// Pressures of the row, kPa.
        pressure_kpa: [f64; 2],
        /// Largest pressure of the map, kPa.
        largest_kpa: f64,
    },
    /// Not two channels.
    #[error("a row of the schedule has {found} channels, the map has 2")]
    Channels {
        /// Channels of the row.
        found: usize,
    },
    /// No leg.
    #[error("a schedule has at least 2 rows, not {rows}")]
    TooShort {
        /// Its rows.
        rows: usize,
    },
    /// No such probe.
    #[error("the scene has no probe \"{name}\"")]
    NoProbe {
        /// Its name.
        name: String,
    },
    /// The pressures do not determine the shape.
    #[error("the equilibrium is not unique: {0}")]
    NotUnique(NotUnique),
    /// The map's own path did not reach all pressures.
    #[error("the map ends at {} of {} states, after ({}, {}) kPa", reached, states, last_kpa[0], last_kpa[1])]
    Incomplete {
        /// States that were reached.
        reached: usize,
        /// States of the map.
        states: usize,
        /// The last one's pressures, kPa.
        last_kpa: [f64; 2],
    },
}

/// How a map knows that its pressures do not determine the shape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "sign", rename_all = "snake_case")]
pub enum NotUnique {
    /// A second equilibrium was met on the path.
    #[error("a second one was met at ({}, {}) kPa", pressure_kpa[0], pressure_kpa[1])]
    Second {
        /// Where, kPa.
        pressure_kpa: [f64; 2],
    },
    /// A state is unstable.
    #[error("the state at ({}, {}) kPa has {negative_pivots} negative pivots", pressure_kpa[0], pressure_kpa[1])]
    Unstable {
        /// Where, kPa.
        pressure_kpa: [f64; 2],
        /// Negative pivots of its tangent.
        negative_pivots: usize,
    },
    /// A state was another when it was met again.
    #[error("states met again at ({}, {}) kPa are {gap_mm} mm apart", pressure_kpa[0], pressure_kpa[1])]
    Elsewhere {
        /// Where, kPa.
        pressure_kpa: [f64; 2],
        /// Distance of the probe's two places, mm.
        gap_mm: f64,
    },
}

/// A map over the pressure plane.
#[derive(Clone, Debug)]
pub struct PressureMap {
    /// Pressures of each channel, kPa, from zero to the largest.
    pub pressures_kpa: Vec<f64>,
    /// The solves: the states of the grid, then those that were met again.
    pub answer: SceneAnswer,
    /// Why its states are not unique, if they are not.
    pub not_unique: Option<NotUnique>,
    /// Largest distance of a probe's two places at pressures that were met twice, mm; `None` where none was.
    pub gap_mm: Option<f64>,
    /// Per probe, with the surface through every second pressure; empty where the path is not complete.
    surfaces: BTreeMap<String, [Surface; 2]>,
}

/// The path of a map: rows of pressures, and for each row beyond the grid the index of the state that it meets again.
pub(super) struct Tour {
    pub rows_kpa: Vec<Vec<f64>>,
    again: Vec<usize>,
}

impl Tour {
    pub fn new(pressures_kpa: &[f64]) -> Self {
        let n = pressures_kpa.len();
        let pair = |i: usize, j: usize| vec![pressures_kpa[i], pressures_kpa[j]];
        let mut rows_kpa: Vec<Vec<f64>> = (0..n * n)
            .map(|k| {
                let (i, j) = Self::node(n, k);
                pair(i, j)
            })
            .collect();
        let diagonal = (0..n - 1).rev();
        rows_kpa.extend(diagonal.clone().map(|i| pair(i, i)));
        let again = diagonal.map(|i| Self::visit(n, i, i)).collect();
        Self { rows_kpa, again }
    }

    /// The node that the `k`-th state of the path is at.
    fn node(n: usize, k: usize) -> (usize, usize) {
        let (i, j) = (k % n, k / n);
        (if j % 2 == 0 { i } else { n - 1 - i }, j)
    }

    /// The state of the path that is at a node; [`Self::node`] is its own inverse within a row.
    pub fn visit(n: usize, i: usize, j: usize) -> usize {
        let (i, j) = Self::node(n, i + j * n);
        i + j * n
    }
}

/// Whether a map up to a largest pressure (kPa) can score a schedule's rows (kPa).
///
/// # Errors
/// Rows that are too few, of another number of channels, or outside of the range.
pub fn check_rows(rows_kpa: &[Vec<f64>], largest_kpa: f64) -> Result<(), NotScored> {
    score::shares(rows_kpa, largest_kpa).map(|_| ())
}

impl PressureMap {
    /// Solves a scene of two channels at `grid` by `grid` pressures up to the largest of its schedule, on `plan` where there is one.
    /// A path that ends early is told by the answer's status; the map then scores nothing.
    ///
    /// # Errors
    /// A scene or a grid that no map can have, and those of [`solve_scene`].
    pub fn solve(
        scene: &Scene,
        grid: usize,
        plan: Option<&MeshPlan>,
        observer: &mut dyn Observer,
    ) -> Result<Self, CannotMap> {
        let channels = scene.actuation.channels();
        if channels != 2 {
            return Err(CannotMap::Channels { found: channels });
        }
        if !GRIDS.contains(&grid) || grid.is_multiple_of(2) {
            return Err(CannotMap::Grid { found: grid });
        }
        if scene.probes.is_empty() {
            return Err(CannotMap::NoProbe);
        }
        let pressures = scene.actuation.rows_kpa.iter().flatten();
        let largest = pressures.fold(0.0, |m: f64, p| m.max(*p));
        if largest <= 0.0 {
            return Err(CannotMap::Pressure { found: largest });
        }
        let points = Points::new(grid);
        let pressures_kpa: Vec<f64> = points.shares().iter().map(|s| s * largest).collect();
        let tour = Tour::new(&pressures_kpa);
        let mut mapped = scene.clone();
        mapped.actuation = ActuationCycle {
            rows_kpa: tour.rows_kpa.clone(),
            load_steps_per_leg: 1,
            spacing: Spacing::Equal,
        };
        // Its target may belong to a state of the scene's own schedule.
        mapped.objective = None;
        let options = SceneOptions {
            plan: plan.cloned(),
            ..SceneOptions::default()
        };
        let answer = solve_scene(&mapped, &options, observer)?.answer;
        let met = met_again(&answer.path, &tour, grid);
        let not_unique = not_unique(&answer, met);
        let mut surfaces = BTreeMap::new();
        if answer.status == SceneStatus::Ok {
            for probe in &scene.probes {
                let at = |k: usize| {
                    let (i, j) = (k % grid, k / grid);
                    let state = answer.path.get(Tour::visit(grid, i, j))?;
                    state.displacement_mm.get(&probe.name).copied()
                };
                let values: Option<Vec<[f64; 2]>> = (0..grid * grid).map(at).collect();
                let surface = values.and_then(|v| Surface::new(points.clone(), v));
                if let Some((fine, coarse)) = surface.and_then(|s| Some((s.clone(), s.coarser()?)))
                {
                    surfaces.insert(probe.name.clone(), [fine, coarse]);
                }
            }
        }
        Ok(Self {
            pressures_kpa,
            answer,
            not_unique,
            gap_mm: met.map(|(gap, _)| gap),
            surfaces,
        })
    }

    /// Largest pressure, kPa.
    pub fn largest_kpa(&self) -> f64 {
        self.pressures_kpa.last().copied().unwrap_or_default()
    }

    /// States of the whole path, rest apart.
    pub fn states(&self) -> usize {
        let n = self.pressures_kpa.len();
        n * n + n - 2
    }

    /// A probe's displacement at two pressures (kPa), mm.
    ///
    /// # Errors
    /// Pressures outside of the range, an unknown probe, a map that is not complete or not unique.
    pub fn displacement(&self, probe: &str, pressure_kpa: [f64; 2]) -> Result<[f64; 2], NotScored> {
        let [surface, _] = self.surface(probe)?;
        let row = pressure_kpa.to_vec();
        let shares = score::shares(&[row.clone(), row], self.largest_kpa())?;
        Ok(surface.at(shares[0]))
    }

    /// The area that a probe encloses over a schedule of rows (kPa), closed by a straight line as that of a direct solve.
    ///
    /// # Errors
    /// As [`Self::displacement`], and rows of another number of channels.
    pub fn score(&self, probe: &str, rows_kpa: &[Vec<f64>]) -> Result<Score, NotScored> {
        let shares = score::shares(rows_kpa, self.largest_kpa())?;
        let [surface, coarser] = self.surface(probe)?;
        let gap = self.gap_mm.unwrap_or_default();
        Ok(score::score(surface, coarser, &shares, gap))
    }

    fn surface(&self, probe: &str) -> Result<&[Surface; 2], NotScored> {
        if let Some(why) = self.not_unique {
            return Err(why.into());
        }
        if self.surfaces.is_empty() {
            let last = self.answer.path.last();
            return Err(NotScored::Incomplete {
                reached: self.answer.path.len().saturating_sub(1),
                states: self.states(),
                last_kpa: last.map_or([0.0; 2], |s| pair(&s.pressure_kpa)),
            });
        }
        self.surfaces.get(probe).ok_or_else(|| NotScored::NoProbe {
            name: probe.to_owned(),
        })
    }
}

/// Of two channels.
fn pair(pressure_kpa: &[f64]) -> [f64; 2] {
    [0, 1].map(|c| pressure_kpa.get(c).copied().unwrap_or_default())
}

/// Largest distance of a probe's two places over the states that were met again, mm, and the pressures there.
fn met_again(path: &[StateAnswer], tour: &Tour, grid: usize) -> Option<(f64, [f64; 2])> {
    let back = path.get(grid * grid..)?;
    let distance = |a: &StateAnswer, b: &StateAnswer| {
        let apart = |(u, v): (&[f64; 2], &[f64; 2])| (u[0] - v[0]).hypot(u[1] - v[1]);
        let both = a.displacement_mm.values().zip(b.displacement_mm.values());
        both.map(apart).fold(0.0, f64::max)
    };
    let gaps = back.iter().zip(&tour.again).filter_map(|(state, first)| {
        Some((
            distance(state, path.get(*first)?),
            pair(&state.pressure_kpa),
        ))
    });
    gaps.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The first sign that pressures do not determine the shape.
fn not_unique(answer: &SceneAnswer, met: Option<(f64, [f64; 2])>) -> Option<NotUnique> {
    if let Some(loss) = &answer.loss_of_uniqueness {
        return Some(NotUnique::Second {
            pressure_kpa: pair(&loss.pressure_kpa),
        });
    }
    if let Some(state) = answer.path.iter().find(|s| s.negative_pivots > 0) {
        return Some(NotUnique::Unstable {
            pressure_kpa: pair(&state.pressure_kpa),
            negative_pivots: state.negative_pivots,
        });
    }
    let displacements = answer.path.iter().flat_map(|s| s.displacement_mm.values());
    let largest = displacements.map(|u| u[0].hypot(u[1])).fold(0.0, f64::max);
    met.filter(|(gap, _)| *gap > DIFFERENT * largest)
        .map(|(gap_mm, pressure_kpa)| NotUnique::Elsewhere {
            pressure_kpa,
            gap_mm,
        })
}

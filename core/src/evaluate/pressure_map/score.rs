//! A schedule on a surface: the area that the point encloses, without further solves, and its error.

use serde::Serialize;

use super::surface::Surface;
use super::{NotScored, NotUnique};
use crate::objective::enclosed_area;

/// States by which a leg of a schedule is sampled on the surface: its polygon misses (10 / 200)^2 of what one of 10 states does.
const STATES_PER_LEG: usize = 200;

/// What a map says of a schedule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Enclosed area, counter-clockwise positive, mm^2.
    pub area_mm2: f64,
    /// Its error by interpolation, mm^2: over the legs, the sum of what the grid of every second pressure has otherwise; and what
    /// the map's states differ by when they are met again, along the path.
    pub error_mm2: f64,
    /// Whether the path crosses itself.
    pub self_crossing: bool,
}

/// The schedule's pressures as shares of the largest, rows first.
///
/// # Errors
/// Rows that are too few, of another number of channels, or outside of the range.
pub(super) fn shares(rows_kpa: &[Vec<f64>], largest_kpa: f64) -> Result<Vec<[f64; 2]>, NotScored> {
    if rows_kpa.len() < 2 {
        return Err(NotScored::TooShort {
            rows: rows_kpa.len(),
        });
    }
    let share = |row: &Vec<f64>| {
        let &[first, second] = &row[..] else {
            return Err(NotScored::Channels { found: row.len() });
        };
        // A last digit is no other pressure.
        let inside = |p: f64| (0.0..=largest_kpa * (1.0 + 1e-12)).contains(&p);
        if !(inside(first) && inside(second)) {
            return Err(NotScored::OutsideRange {
                pressure_kpa: [first, second],
                largest_kpa,
            });
        }
        Ok([first, second].map(|p| (p / largest_kpa).min(1.0)))
    };
    rows_kpa.iter().map(share).collect()
}

/// Scores a closed schedule of shares; `gap_mm` is what states differ by that were met twice.
pub(super) fn score(
    surface: &Surface,
    coarser: &Surface,
    shares: &[[f64; 2]],
    gap_mm: f64,
) -> Score {
    let (path, areas) = along(surface, shares);
    let (_, coarse) = along(coarser, shares);
    let differences = areas.iter().zip(&coarse).map(|(a, b)| (a - b).abs());
    let length: f64 = (path.windows(2))
        .map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))
        .sum();
    Score {
        area_mm2: enclosed_area::area(&path),
        error_mm2: differences.sum::<f64>() + gap_mm * length,
        self_crossing: enclosed_area::crosses_itself(&path),
    }
}

/// The path over a schedule, and the area that each leg sweeps as seen from rest; the last one has the closing line as well.
fn along(surface: &Surface, shares: &[[f64; 2]]) -> (Vec<[f64; 2]>, Vec<f64>) {
    let mut path = vec![surface.at(shares[0])];
    for leg in shares.windows(2) {
        for k in 1..=STATES_PER_LEG {
            // Dense at both ends, as the surface is steep there.
            let t = 0.5 * (1.0 - (std::f64::consts::PI * k as f64 / STATES_PER_LEG as f64).cos());
            let at = |c: usize| (leg[0][c] + t * (leg[1][c] - leg[0][c])).clamp(0.0, 1.0);
            path.push(surface.at([at(0), at(1)]));
        }
    }
    let swept = |points: &[[f64; 2]]| -> f64 {
        (points.windows(2))
            .map(|p| 0.5 * (p[0][0] * p[1][1] - p[0][1] * p[1][0]))
            .sum()
    };
    let mut areas: Vec<f64> = (0..shares.len() - 1)
        .map(|leg| swept(&path[leg * STATES_PER_LEG..=(leg + 1) * STATES_PER_LEG]))
        .collect();
    if let (Some(last), Some(sum)) = (path.last(), areas.last_mut()) {
        *sum += swept(&[*last, path[0]]);
    }
    (path, areas)
}

impl From<NotUnique> for NotScored {
    fn from(why: NotUnique) -> Self {
        Self::NotUnique(why)
    }
}

//! Random designs of the paper's boxes, each with a status that must be true (`salp verify --designs N`).
//!
//! A third is uniform in the boxes, a third near their outer edges, a third was met by optimisers in recorded runs. Each is
//! solved on three units under `hold` at 15 kPa with 4 steps a leg, without contact, at two p/mu. What says that it has no
//! equilibrium is asked again by a second path ([`confirm`]): on a finer mesh, led by the area of the cavities, with steps of
//! its own. A limit of another kind, or farther off than 2 %, is no answer: such a design counts as `not_converged`.

mod confirm;
mod mesher;
mod solve;

pub use confirm::{Confirmation, confirm};
pub use mesher::{MesherCount, mesh_designs};
pub use solve::{DesignLine, LimitLine, solve_design};

use crate::geometry::LayoutBoxes;
use crate::geometry::samples::Stratum;

/// The seed of the recorded tables.
pub const SEED: u64 = 20_230_328;
/// p/mu at 15 kPa and the record that has it.
pub const MATERIALS: [(f64, &str); 2] = [(0.0395, "mold-star-30"), (0.068, "mold-star-30-soft")];

/// Where a design comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Uniform in the boxes.
    Uniform,
    /// Near the outer edges of the boxes, tall.
    NearBounds,
    /// Met by an optimiser in a recorded run.
    Met,
}

impl Origin {
    /// All, in the order of the table.
    pub const ALL: [Self; 3] = [Self::Uniform, Self::NearBounds, Self::Met];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::NearBounds => "near_bounds",
            Self::Met => "met",
        }
    }
}

/// A design.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Index in the list.
    pub index: usize,
    /// Where it comes from.
    pub origin: Origin,
    /// Its 16 coordinates, mm.
    pub x: Vec<f64>,
}

/// Designs that optimisers met in recorded runs, one a line.
pub const SHIPPED_MET: &str = include_str!("met.txt");

/// Designs of a text: of each line its 16 numbers, or the 16 numbers of its last cell, as ledgers have them. Other lines are
/// passed over.
pub fn read_designs(text: &str) -> Vec<Vec<f64>> {
    let numbers = |cells: &str, between: fn(char) -> bool| {
        let numbers: Result<Vec<f64>, _> = cells
            .split(between)
            .filter(|cell| !cell.is_empty())
            .map(str::parse)
            .collect();
        numbers.ok().filter(|x| {
            x.len() == LayoutBoxes::PAPER.variables() && x.iter().all(|v| v.is_finite())
        })
    };
    text.lines()
        .filter_map(|line| {
            let last = line.rsplit(',').next().unwrap_or(line);
            numbers(last, char::is_whitespace)
                .or_else(|| numbers(line, |c| c == ',' || c == ';' || c.is_whitespace()))
        })
        .collect()
}

/// `count` designs: two thirds drawn, the last third from `met`, evenly spread over it; fewer where it is shorter.
pub fn samples(count: usize, seed: u64, met: &[Vec<f64>]) -> Vec<Sample> {
    let third = count / 3;
    let drawn = |stratum: Stratum| move |k: usize| stratum.design(&LayoutBoxes::PAPER, seed, k);
    let uniform = (0..count - 2 * third).map(drawn(Stratum::Uniform));
    let near = (0..third).map(drawn(Stratum::NearOuterEdges));
    let kept = third.min(met.len());
    let spread = (0..kept).map(|k| met[k * met.len() / kept].clone());
    let with = |origin: Origin| move |x: Vec<f64>| (origin, x);
    uniform
        .map(with(Origin::Uniform))
        .chain(near.map(with(Origin::NearBounds)))
        .chain(spread.map(with(Origin::Met)))
        .enumerate()
        .map(|(index, (origin, x))| Sample { index, origin, x })
        .collect()
}

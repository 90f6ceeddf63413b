//! Published problems by which optimisers are measured, and what others took on them.
//!
//! Bounds, starts, optima and check points are in `data/`, each file with its source; the formulas, with exact gradients, are
//! here. Constraints are normalised to order one.

mod functions;
mod others;
mod row;
mod structures;

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{Problem, Told, Values};

pub use others::{Other, others};
use row::Values as Evaluated;

/// A point with known values.
#[derive(Clone, Debug, Deserialize)]
pub struct CheckPoint {
    /// What it is.
    pub label: String,
    /// Design variables.
    pub x: Vec<f64>,
    /// Objective.
    pub f: f64,
    /// Constraints.
    pub g: Vec<f64>,
    /// Gradient of the objective.
    pub df: Vec<f64>,
    /// Gradients of the constraints.
    pub dg: Option<Vec<Vec<f64>>>,
}

/// A problem: minimise f with g <= 0 (or = 0 for `equalities`) between bounds.
#[derive(Clone, Debug, Deserialize)]
pub struct Case {
    /// Its name.
    pub id: String,
    /// In words.
    pub title: String,
    /// Where it was published.
    pub source: String,
    /// Number of variables.
    pub n: usize,
    /// Number of constraints; equalities come last.
    pub m: usize,
    /// Which constraints are equalities.
    pub equalities: Vec<usize>,
    /// Start.
    pub x0: Vec<f64>,
    /// Lower bounds.
    pub xl: Vec<f64>,
    /// Upper bounds.
    pub xu: Vec<f64>,
    /// Other starts by name.
    pub starts: BTreeMap<String, Vec<f64>>,
    /// Best objective known.
    pub f_star: f64,
    /// Points with known values.
    pub check_points: Vec<CheckPoint>,
}

macro_rules! case_files {
    ($($id:literal),* $(,)?) => {
        /// All problems.
        pub fn all() -> Vec<Case> {
            vec![$(read(include_str!(concat!("data/", $id, ".json")))),*]
        }
    };
}

case_files!(
    "cantilever_100",
    "cantilever_5",
    "cantilever_50",
    "hs100",
    "hs113",
    "hs24",
    "hs26",
    "hs35",
    "hs65",
    "hs71",
    "hs76",
    "hs93",
    "keane_10",
    "keane_2",
    "pressure_vessel",
    "rastrigin_plane_4",
    "rosen_suzuki",
    "rosen_suzuki_noisy",
    "rosenbrock_disk",
    "six_hump_camel",
    "speed_reducer",
    "spring",
    "svanberg_cantilever",
    "three_bar_truss",
    "welded_beam",
);

#[expect(clippy::expect_used, reason = "shipped files, read by a test")]
fn read(text: &str) -> Case {
    serde_json::from_str(text).expect("a problem file")
}

impl Case {
    /// The shape of the problem.
    pub fn problem(&self) -> Problem {
        Problem {
            lower: self.xl.clone(),
            upper: self.xu.clone(),
            inequalities: self.m - self.equalities.len(),
            equalities: self.equalities.len(),
        }
    }

    /// `x0`, then the other starts, each with its name.
    pub fn all_starts(&self) -> impl Iterator<Item = (&str, &Vec<f64>)> {
        let others = self.starts.iter().map(|(name, x)| (&**name, x));
        std::iter::once(("x0", &self.x0)).chain(others)
    }

    /// Relative distance of an objective from the best one known; absolute where that is 0.
    pub fn gap(&self, objective: f64) -> f64 {
        let size = self.f_star.abs();
        (objective - self.f_star) / if size > 0.0 { size } else { 1.0 }
    }

    /// Whether it has many optima, so that a run may end at another than the best.
    pub fn is_multimodal(&self) -> bool {
        let many = ["keane_2", "keane_10", "rastrigin_plane_4", "six_hump_camel"];
        many.contains(&&*self.id)
    }

    /// Objective, constraints and their gradients.
    pub fn evaluate(&self, x: &[f64], want_gradient: bool) -> Told {
        let (f, df, rows) = formula(&self.id, x);
        let values = Values {
            objective: f,
            constraints: rows.iter().map(|(g, _)| *g).collect(),
            gradient: want_gradient.then_some(df),
            constraint_gradients: want_gradient
                .then(|| rows.into_iter().map(|(_, dg)| dg).collect()),
        };
        if values.objective.is_finite() && values.constraints.iter().all(|g| g.is_finite()) {
            Told::Values(values)
        } else {
            Told::Failed
        }
    }
}

/// f, grad f, and each g with its gradient; NaN for a name that is not known.
pub(super) fn formula(id: &str, x: &[f64]) -> Evaluated {
    match id {
        "cantilever_5" | "cantilever_50" | "cantilever_100" => structures::cantilever(x),
        "hs100" => functions::hs100(x),
        "hs113" => functions::hs113(x),
        "hs24" => functions::hs24(x),
        "hs26" => functions::hs26(x),
        "hs35" => functions::hs35(x),
        "hs65" => functions::hs65(x),
        "hs71" => functions::hs71(x),
        "hs76" => functions::hs76(x),
        "hs93" => functions::hs93(x),
        "keane_2" | "keane_10" => functions::keane(x),
        "pressure_vessel" => structures::pressure_vessel(x),
        "rastrigin_plane_4" => functions::rastrigin(x),
        "rosen_suzuki" => functions::rosen_suzuki(x),
        "rosen_suzuki_noisy" => functions::noisy(x),
        "rosenbrock_disk" => functions::rosenbrock(x),
        "six_hump_camel" => functions::six_hump(x),
        "speed_reducer" => structures::speed_reducer(x),
        "spring" => structures::spring(x),
        "svanberg_cantilever" => structures::svanberg(x),
        "three_bar_truss" => structures::three_bar(x),
        "welded_beam" => structures::welded_beam(x),
        _ => (f64::NAN, Vec::new(), Vec::new()),
    }
}

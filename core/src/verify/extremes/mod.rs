//! Stiff and extreme scenes, each with the status that physics says it has and a number that it is held against
//! (`salp verify --stress`).
//!
//! A scene that has an equilibrium at its pressures must be solved, whatever its stiffness, its walls or the steps asked for;
//! one that has none must say so, at the right pressure. The table says why each status is expected; it does not follow what
//! the solver happens to do.

mod run;
mod table;

use serde_json::Value;

use crate::equilibrium::LimitKind;
use crate::mesh::ElementKind;

pub use run::{ExtremeLine, run_extreme};
pub use table::extremes;

/// An extreme scene.
#[derive(Clone, Debug)]
pub struct Extreme {
    /// What is driven to an extreme.
    pub group: &'static str,
    /// How far.
    pub name: String,
    /// The scene without its element.
    pub scene: Value,
    /// How it must end.
    pub expected: Expected,
    /// Why.
    pub why: &'static str,
    /// What its numbers are held against.
    pub against: Against,
}

/// How a scene must end.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// Every state has an equilibrium.
    Ok,
    /// No equilibrium beyond this pressure of channel 0.
    NoEquilibrium {
        /// kPa.
        pressure_kpa: f64,
        /// Admissible relative distance from it.
        within: f64,
    },
}

/// What the numbers of a scene that ends well are held against.
#[derive(Clone, Debug, PartialEq)]
pub enum Against {
    /// The same path by this many load steps a leg: equal within 1e-5 at the rows of the schedule.
    OtherSteps(usize),
    /// The same scene at K/mu = 1e6: compressibility changes it by at most `slope` mu/K.
    Incompressible {
        /// Admissible relative change times K/mu.
        slope: f64,
    },
    /// The pressure of the limit: of [`Expected::NoEquilibrium`].
    Limit,
}

impl Extreme {
    /// The scene on an element.
    pub fn document(&self, element: ElementKind) -> Value {
        let mut scene = self.scene.clone();
        scene["mesh"]["element"] = serde_json::json!(element);
        scene
    }
}

/// Kinds that an expected limit may have: a fall of the load, a load that tends to a value, a second branch.
pub fn is_ballooning(kind: LimitKind) -> bool {
    matches!(kind, LimitKind::LimitPoint | LimitKind::Asymptote)
}

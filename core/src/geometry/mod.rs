//! Units, chambers, their cascade, and what makes a design valid. Lengths in mm.

mod block_map;
mod plan;
pub mod polygon;
mod unit;

pub use block_map::BlockMap;
pub use plan::{ChamberPlan, MeshPlan, PlanElement, Station, Strip, UnitPlan};
pub use unit::{Actuator, InfeasibleGeometry, Point, Unit};

//! Units, chambers, their cascade, and what makes a design valid. Lengths in mm.

mod block_map;
mod cascade;
mod chamber_layout;
mod design;
mod dual;
mod obstacle;
mod plan;
pub mod polygon;
mod rounding;
pub mod samples;
mod unit;
pub mod validity;

pub use block_map::BlockMap;
pub use cascade::cascade;
pub use chamber_layout::{ChamberCorners, Layout, LayoutBoxes};
pub use design::{design_gradient, design_of_units};
pub use obstacle::{Obstacle, Outline, Side};
pub use plan::{ChamberPlan, MeshPlan, MeshSize, PlanElement, Station, Strip, UnitPlan};
pub use rounding::Rounded;
pub use unit::{Actuator, InfeasibleGeometry, Point, Unit};

//! Random designs through the mesher alone.

use serde::Serialize;

use crate::geometry::samples::Stratum;
use crate::geometry::{LayoutBoxes, MeshPlan, PlanElement, cascade};
use crate::mesh::{build, quality};

/// What meshing a number of designs gave.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MesherCount {
    /// Where they were drawn.
    pub stratum: &'static str,
    /// Designs.
    pub designs: usize,
    /// Designs that the mesher refused, or whose elements have a Jacobian that is not positive somewhere.
    pub folds: usize,
    /// Least lower bound of the Jacobian over an element, mm^2.
    pub least_jacobian_mm2: f64,
    /// Least scaled corner Jacobian.
    pub least_scaled_jacobian: f64,
    /// Index of the design that has it.
    pub worst: usize,
}

impl MesherCount {
    /// Of no designs yet.
    pub fn new(stratum: Stratum) -> Self {
        Self {
            stratum: name(stratum),
            designs: 0,
            folds: 0,
            least_jacobian_mm2: f64::INFINITY,
            least_scaled_jacobian: f64::INFINITY,
            worst: 0,
        }
    }

    /// Both together.
    pub fn add(&mut self, other: &Self) {
        self.designs += other.designs;
        self.folds += other.folds;
        self.least_jacobian_mm2 = self.least_jacobian_mm2.min(other.least_jacobian_mm2);
        if other.least_scaled_jacobian < self.least_scaled_jacobian {
            self.least_scaled_jacobian = other.least_scaled_jacobian;
            self.worst = other.worst;
        }
    }
}

fn name(stratum: Stratum) -> &'static str {
    match stratum {
        Stratum::Uniform => "uniform",
        Stratum::NearOuterEdges => "near outer edges",
        Stratum::NearBounds => "near bounds",
    }
}

/// Meshes the designs of a stratum of these boxes with these indices on three units.
pub fn mesh_designs(
    boxes: &LayoutBoxes,
    stratum: Stratum,
    seed: u64,
    indices: impl Iterator<Item = usize>,
) -> MesherCount {
    let mut count = MesherCount::new(stratum);
    for index in indices {
        let x = stratum.design(boxes, seed, index);
        let mut one = MesherCount {
            designs: 1,
            worst: index,
            ..MesherCount::new(stratum)
        };
        match jacobians(boxes, &x) {
            Some([bound, scaled]) => {
                one.least_jacobian_mm2 = bound;
                one.least_scaled_jacobian = scaled;
                one.folds = usize::from(bound.is_nan() || bound <= 0.0);
            }
            None => one.folds = 1,
        }
        count.add(&one);
    }
    count
}

/// Least bound of the Jacobian and least scaled corner Jacobian of a design's mesh; `None` where there is none.
fn jacobians(boxes: &LayoutBoxes, x: &[f64]) -> Option<[f64; 2]> {
    let unit = boxes.units(x)?.into_iter().next()?;
    let actuator = cascade(&unit, boxes.unit_mm, 3);
    let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).ok()?;
    let mesh = build(&actuator, &plan).ok()?;
    let bound = quality::least_jacobian_bound(&mesh.discretisation.mesh);
    Some([bound, mesh.scaled_jacobian])
}

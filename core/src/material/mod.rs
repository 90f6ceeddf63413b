//! Hyperelastic materials and their sourced records.

pub mod closed_form;
pub mod counterpart;
pub mod fit;
pub mod hyperelastic;
pub mod ogden;
pub mod records;
pub mod stability;
mod stretch_powers;

use serde::{Deserialize, Serialize};

pub use ogden::{Ogden, OgdenForm, OgdenTerm};

/// A law with its parameters (MPa); isochoric part in the invariants of the 3-D deformation gradient with F33 = 1,
/// volumetric part K/2 (J - 1)^2 with K = `bulk_over_shear` * mu.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialLaw {
    /// Isochoric part.
    pub model: HyperelasticModel,
    /// K / mu.
    pub bulk_over_shear: f64,
    /// Largest principal stretch of the data behind the parameters; `None` where it is not known.
    pub fit_stretch: Option<f64>,
}

/// Isochoric strain energy per reference area of plane strain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum HyperelasticModel {
    /// W = c10 (I1 - 3); mu = 2 c10.
    NeoHookean {
        /// MPa.
        c10_mpa: f64,
    },
    /// W = c10 (I1 - 3) + c01 (I2 - 3) + c20 (I1 - 3)^2; mu = 2 (c10 + c01).
    MooneyRivlin {
        /// MPa.
        c10_mpa: f64,
        /// MPa.
        c01_mpa: f64,
        /// MPa.
        c20_mpa: f64,
    },
    /// W = sum_i c_i (I1 - 3)^i; mu = 2 c_1.
    Yeoh {
        /// MPa.
        c_mpa: [f64; 3],
    },
    /// W = sum_p c_p (l1^a_p + l2^a_p + l3^a_p - 3) in the isochoric stretches.
    Ogden(Ogden),
}

impl MaterialLaw {
    /// Initial shear modulus mu, MPa.
    pub fn shear_modulus_mpa(&self) -> f64 {
        match self.model {
            HyperelasticModel::NeoHookean { c10_mpa } => 2.0 * c10_mpa,
            HyperelasticModel::MooneyRivlin {
                c10_mpa, c01_mpa, ..
            } => 2.0 * (c10_mpa + c01_mpa),
            HyperelasticModel::Yeoh { c_mpa } => 2.0 * c_mpa[0],
            HyperelasticModel::Ogden(ogden) => ogden.shear_modulus_mpa(),
        }
    }

    /// Bulk modulus K, MPa.
    pub fn bulk_modulus_mpa(&self) -> f64 {
        self.bulk_over_shear * self.shear_modulus_mpa()
    }
}

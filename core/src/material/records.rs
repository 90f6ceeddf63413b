//! Sourced parameter records (MPa; K = 1000 mu by default).

use super::{HyperelasticModel, MaterialLaw, OgdenForm};

/// K / mu of every record; a document may override it.
pub const DEFAULT_BULK_OVER_SHEAR: f64 = 1000.0;

/// The record that stands for a material when a document names none.
pub const DEFAULT_RECORD: &str = "mold-star-30";

/// A named set of parameters with its source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialRecord {
    /// Name in documents.
    pub name: &'static str,
    /// Parameters, MPa; K = 1000 mu; the largest principal stretch of the data behind the fit is `None` where the source
    /// does not say.
    pub law: MaterialLaw,
    /// Where the parameters come from.
    pub source: &'static str,
    /// Engineering strain at break (3.39 = 339 %) by the supplier's data sheet or by a tension test, as `source` says;
    /// `None` where neither could be had.
    pub elongation_at_break: Option<f64>,
}

impl MaterialRecord {
    /// The largest averaged principal stretch that a design may reach: min(1 + elongation at break / 4, end of the fit
    /// range), of those that are known; 1.8475 for Mold Star 30.
    pub fn stretch_limit(&self) -> Option<f64> {
        let quarter = self.elongation_at_break.map(|e| 1.0 + e / 4.0);
        match (quarter, self.law.fit_stretch) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// The energy that the parameters enter, and their relation to the initial shear modulus mu.
    pub fn convention(&self) -> &'static str {
        match self.law.model {
            HyperelasticModel::NeoHookean { .. } => "W = C10 (I1b - 3) + K/2 (J - 1)^2, mu = 2 C10",
            HyperelasticModel::MooneyRivlin { .. } => {
                "W = C10 (I1b - 3) + C01 (I2b - 3) + C20 (I1b - 3)^2 + K/2 (J - 1)^2, mu = 2 (C10 + C01)"
            }
            HyperelasticModel::Yeoh { .. } => {
                "W = sum_i C_i (I1b - 3)^i + K/2 (J - 1)^2, mu = 2 C_1"
            }
            HyperelasticModel::Ogden(ogden) => match ogden.form {
                OgdenForm::M => {
                    "form m: W = sum_p mu_p/a_p (l1b^a_p + l2b^a_p + l3b^a_p - 3) + K/2 (J - 1)^2, mu = sum_p mu_p a_p / 2"
                }
                OgdenForm::A => {
                    "form a: W = sum_p 2 mu_p/a_p^2 (l1b^a_p + l2b^a_p + l3b^a_p - 3) + K/2 (J - 1)^2, mu = sum_p mu_p"
                }
            },
        }
    }
}

/// The record of a name.
pub fn find(name: &str) -> Option<&'static MaterialRecord> {
    RECORDS.iter().find(|r| r.name == name)
}

const fn law(model: HyperelasticModel, fit_stretch: Option<f64>) -> MaterialLaw {
    MaterialLaw {
        model,
        bulk_over_shear: DEFAULT_BULK_OVER_SHEAR,
        fit_stretch,
    }
}

const fn neo_hookean(c10_mpa: f64, fit_stretch: Option<f64>) -> MaterialLaw {
    law(HyperelasticModel::NeoHookean { c10_mpa }, fit_stretch)
}

const fn yeoh(c_mpa: [f64; 3], fit_stretch: Option<f64>) -> MaterialLaw {
    law(HyperelasticModel::Yeoh { c_mpa }, fit_stretch)
}

macro_rules! sorotoki {
    ($elongation:literal) => {
        concat!(
            "parameter set of the public toolbox SorotokiCode, which states no range; elongation: ",
            $elongation
        )
    };
}

macro_rules! soro_materials {
    ($note:literal, $elongation:literal) => {
        concat!(
            "fit to the open SoRoMaterials tension curves at 0-100 % strain (Marechal et al. 2021, doi 10.1089/soro.2019.0115); ",
            $note,
            "elongation: ",
            $elongation
        )
    };
}

macro_rules! softening {
    ($elongation:literal) => {
        soro_materials!(
            "the negative last term loses monotonicity beyond that range; ",
            $elongation
        )
    };
}

/// Every record that is shipped.
pub const RECORDS: [MaterialRecord; 14] = [
    MaterialRecord {
        name: "mold-star-30",
        law: neo_hookean(0.19, Some(2.0)),
        source: "from data-sheet modulus, no test data: 100 % modulus 0.662 MPa, and Gent's relation at Shore 30A (E = 1.14 MPa)",
        elongation_at_break: Some(3.39),
    },
    MaterialRecord {
        name: "mold-star-30-soft",
        law: neo_hookean(0.11, Some(2.0)),
        source: "a sensitivity, no test data: the lower bracket that measured silicones suggest for a 100 % modulus of 0.662 MPa",
        elongation_at_break: Some(3.39),
    },
    MaterialRecord {
        name: "ecoflex-00-50",
        law: yeoh([0.0145, 0.0001, 0.0], None),
        source: sorotoki!("Smooth-On, Ecoflex series, 980 %"),
        elongation_at_break: Some(9.8),
    },
    MaterialRecord {
        name: "dragon-skin-10",
        law: yeoh([0.036, 2.5e-4, 2.3e-5], None),
        source: sorotoki!("Smooth-On, Dragon Skin series, 1000 %"),
        elongation_at_break: Some(10.0),
    },
    MaterialRecord {
        name: "dragon-skin-30",
        law: yeoh([0.1536, 0.0016, 0.0], None),
        source: sorotoki!("Smooth-On, Dragon Skin series, 364 %"),
        elongation_at_break: Some(3.64),
    },
    MaterialRecord {
        name: "elastosil-m4601",
        law: yeoh([0.11, 0.02, 0.0], None),
        source: sorotoki!("Wacker, Elastosil M 4601, ISO 37, 700 %"),
        elongation_at_break: Some(7.0),
    },
    MaterialRecord {
        name: "rtv615",
        law: yeoh([0.1621, 0.0142, 0.0009], None),
        source: sorotoki!("SoRoMaterials, pull to failure, strain from the crosshead, 193 %"),
        elongation_at_break: Some(1.93),
    },
    MaterialRecord {
        name: "ecoflex-00-10",
        law: yeoh([0.00351, 2.71e-4, -3.47e-5], Some(2.0)),
        source: softening!("Smooth-On, Ecoflex series, 800 %"),
        elongation_at_break: Some(8.0),
    },
    MaterialRecord {
        name: "ecoflex-00-30",
        law: yeoh([0.00714, 6.61e-4, -1.27e-4], Some(2.0)),
        source: softening!("Smooth-On, Ecoflex series, 900 %"),
        elongation_at_break: Some(9.0),
    },
    MaterialRecord {
        name: "dragon-skin-20",
        law: yeoh([0.05528, 1.49e-2, -2.09e-3], Some(2.0)),
        source: softening!("Smooth-On, Dragon Skin series, 620 %"),
        elongation_at_break: Some(6.2),
    },
    MaterialRecord {
        name: "mold-star-16",
        law: yeoh([0.0407, 3.61e-3, -1.94e-4], Some(2.0)),
        source: softening!("the same tests, strain from the crosshead, 829 %"),
        elongation_at_break: Some(8.29),
    },
    MaterialRecord {
        name: "mold-star-20t",
        law: yeoh([0.05395, 4.09e-3, -1.91e-4], Some(2.0)),
        source: softening!("the same tests, strain from the crosshead, 823 %"),
        elongation_at_break: Some(8.23),
    },
    MaterialRecord {
        name: "sorta-clear-40",
        law: yeoh([0.13905, 5.31e-3, 7.24e-5], Some(2.0)),
        source: soro_materials!("", "the same tests, strain from the crosshead, 507 %"),
        elongation_at_break: Some(5.07),
    },
    MaterialRecord {
        name: "smooth-sil-950",
        law: law(
            HyperelasticModel::MooneyRivlin {
                c10_mpa: 0.26056762,
                c01_mpa: 0.09754981,
                c20_mpa: 0.05750069,
            },
            None,
        ),
        source: "constants in the first author's public scripts of 2022, which state neither a range nor an elongation: a study must give its stretch limit as a number",
        elongation_at_break: None,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_found_by_their_names_and_are_sound() {
        for record in &RECORDS {
            assert_eq!(find(record.name), Some(record));
            assert!(record.law.shear_modulus_mpa() > 0.0);
            assert!(record.stretch_limit().is_none_or(|l| l > 1.0));
            // A source that speaks of an elongation gives the number that the record holds.
            if let Some(elongation) = record.elongation_at_break
                && let Some((_, said)) = record.source.split_once("elongation: ")
            {
                let percent = format!("{:.0} %", 100.0 * elongation);
                assert!(said.ends_with(&percent), "{}", record.name);
            }
            assert!(record.source.len() > 20 && record.convention().contains("mu ="));
        }
        assert_eq!(find("butter"), None);
    }

    #[test]
    fn the_stretch_limit_of_mold_star_30_is_1_85() {
        let record = find(DEFAULT_RECORD).expect("the default exists");
        assert!((record.stretch_limit().unwrap_or(0.0) - 1.85).abs() < 0.005);
        assert_eq!(record.law.shear_modulus_mpa(), 0.38);
    }
}

//! Closed forms of incompressible laws in plane strain and in uniaxial tension, and one law of each kind: what checks of the
//! laws and of whole solutions are held against, and what a tension test is fitted with.
//!
//! At the in-plane stretches l and 1/l the difference of the principal Cauchy stresses is free of the pressure. With
//! i = I1 - 3 = I2 - 3 = l^2 + l^-2 - 2 it is 2 (dW/dI1 + dW/dI2) (l^2 - l^-2), for an Ogden law
//! sum_p c_p a_p (l^a_p - l^-a_p).

use super::{HyperelasticModel, MaterialLaw, Ogden, OgdenForm, OgdenTerm};

/// Difference of the in-plane principal Cauchy stresses at stretches `l` and 1/`l`, MPa.
pub fn stress_difference(law: &MaterialLaw, l: f64) -> f64 {
    let i = l * l + 1.0 / (l * l) - 2.0;
    let slope = match law.model {
        HyperelasticModel::NeoHookean { c10_mpa } => c10_mpa,
        HyperelasticModel::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            c20_mpa,
        } => c10_mpa + c01_mpa + 2.0 * c20_mpa * i,
        HyperelasticModel::Yeoh { c_mpa: [a, b, c] } => a + 2.0 * b * i + 3.0 * c * i * i,
        HyperelasticModel::Ogden(ogden) => {
            return ogden
                .coefficients()
                .map(|(c, a)| c * a * (l.powf(a) - l.powf(-a)))
                .sum();
        }
    };
    2.0 * slope * (l * l - 1.0 / (l * l))
}

/// Cauchy shear stress in simple shear by `shear` = l - 1/l, MPa: the difference of the principal stresses over l + 1/l.
pub fn shear_stress(law: &MaterialLaw, shear: f64) -> f64 {
    let both = (4.0 + shear * shear).sqrt();
    stress_difference(law, 0.5 * (shear + both)) / both
}

/// Nominal stress in uniaxial tension at the stretches l, l^-1/2, l^-1/2, MPa: 2 (l - l^-2) (dW/dI1 + dW/dI2 / l) with
/// I1 - 3 = l^2 + 2/l - 3, for an Ogden law sum_p c_p a_p (l^(a_p - 1) - l^(-a_p/2 - 1)).
pub fn uniaxial_stress(law: &MaterialLaw, l: f64) -> f64 {
    let i = l * l + 2.0 / l - 3.0;
    let (by_first, by_second) = match law.model {
        HyperelasticModel::NeoHookean { c10_mpa } => (c10_mpa, 0.0),
        HyperelasticModel::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            c20_mpa,
        } => (c10_mpa + 2.0 * c20_mpa * i, c01_mpa),
        HyperelasticModel::Yeoh { c_mpa: [a, b, c] } => (a + 2.0 * b * i + 3.0 * c * i * i, 0.0),
        HyperelasticModel::Ogden(ogden) => {
            return ogden
                .coefficients()
                .map(|(c, a)| c * a * (l.powf(a - 1.0) - l.powf(-0.5 * a - 1.0)))
                .sum();
        }
    };
    2.0 * (l - 1.0 / (l * l)) * (by_first + by_second / l)
}

/// One law of each kind with its name, K/mu as given: Ogden's fit to Treloar's data (1972) beside invented ones.
pub fn one_of_each(bulk_over_shear: f64) -> Vec<(&'static str, MaterialLaw)> {
    let ogden = |form, terms: &[(f64, f64)]| {
        let terms: Vec<OgdenTerm> = terms
            .iter()
            .map(|&(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha })
            .collect();
        Ogden::new(form, &terms).map(HyperelasticModel::Ogden)
    };
    let treloar = [(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)];
    let mooney = |c20_mpa| HyperelasticModel::MooneyRivlin {
        c10_mpa: 0.26,
        c01_mpa: 0.097,
        c20_mpa,
    };
    let yeoh = HyperelasticModel::Yeoh {
        c_mpa: [0.11, 0.02, -3e-4],
    };
    [
        (
            "neo_hookean",
            Some(HyperelasticModel::NeoHookean { c10_mpa: 0.19 }),
        ),
        ("mooney_rivlin", Some(mooney(0.0))),
        ("mooney_rivlin_c20", Some(mooney(0.0575))),
        ("yeoh", Some(yeoh)),
        ("ogden_m", ogden(OgdenForm::M, &treloar)),
        ("ogden_a", ogden(OgdenForm::A, &[(0.2, 0.3), (0.1, 9.5)])),
    ]
    .into_iter()
    .filter_map(|(name, model)| {
        let law = MaterialLaw {
            model: model?,
            bulk_over_shear,
            fit_stretch: None,
        };
        Some((name, law))
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniaxial_tension_begins_with_three_times_the_shear_modulus_and_does_the_work_of_the_energy()
    {
        for (name, law) in one_of_each(1000.0) {
            let slope = uniaxial_stress(&law, 1.0 + 1e-7) / 1e-7;
            let modulus = 3.0 * law.shear_modulus_mpa();
            assert!(
                (slope / modulus - 1.0).abs() < 1e-5,
                "{name}: {slope} {modulus}"
            );
            // dW/dl of the energy in principal stretches, by central differences.
            let energy = |l: f64| match law.model {
                HyperelasticModel::Ogden(ogden) => ogden
                    .coefficients()
                    .map(|(c, a)| c * (l.powf(a) + 2.0 * l.powf(-0.5 * a) - 3.0))
                    .sum::<f64>(),
                model => {
                    let (i, j) = (l * l + 2.0 / l - 3.0, 2.0 * l + 1.0 / (l * l) - 3.0);
                    match model {
                        HyperelasticModel::NeoHookean { c10_mpa } => c10_mpa * i,
                        HyperelasticModel::MooneyRivlin {
                            c10_mpa,
                            c01_mpa,
                            c20_mpa,
                        } => c10_mpa * i + c01_mpa * j + c20_mpa * i * i,
                        HyperelasticModel::Yeoh { c_mpa: [a, b, c] } => i * (a + i * (b + i * c)),
                        HyperelasticModel::Ogden(_) => unreachable!("matched above"),
                    }
                }
            };
            for l in [0.6, 1.3, 2.5] {
                let h = 1e-5;
                let difference = (energy(l + h) - energy(l - h)) / (2.0 * h);
                let exact = uniaxial_stress(&law, l);
                assert!((difference / exact - 1.0).abs() < 1e-7, "{name} at {l}");
            }
        }
    }
}

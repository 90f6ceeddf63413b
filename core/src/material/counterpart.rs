//! The law against which a design's sensitivity to the choice of law is seen.

use super::records::RECORDS;
use super::{HyperelasticModel, MaterialLaw};

/// A law of the same initial shear modulus and the same K/mu that stiffens otherwise, and its description: of a neo-Hookean
/// law a Yeoh one with c2 = [`stiffening`] c1, of any other law the neo-Hookean one.
pub fn counterpart(law: &MaterialLaw) -> (MaterialLaw, String) {
    let c1 = 0.5 * law.shear_modulus_mpa();
    let (model, words) = match law.model {
        HyperelasticModel::NeoHookean { .. } => {
            let ratio = stiffening();
            let words = format!("Yeoh with c2 = {ratio:.3} c1, the median of the shipped fits");
            let c_mpa = [c1, ratio * c1, 0.0];
            (HyperelasticModel::Yeoh { c_mpa }, words)
        }
        _ => (
            HyperelasticModel::NeoHookean { c10_mpa: c1 },
            "neo-Hookean".to_owned(),
        ),
    };
    let law = MaterialLaw {
        model,
        bulk_over_shear: law.bulk_over_shear,
        fit_stretch: None,
    };
    (law, format!("{words}, of equal initial modulus"))
}

/// c2 / c1 of a silicone: the median over the Yeoh sets of [`RECORDS`], most of them fitted to tension tests.
pub fn stiffening() -> f64 {
    let mut ratios: Vec<f64> = RECORDS
        .iter()
        .filter_map(|record| match record.law.model {
            HyperelasticModel::Yeoh { c_mpa } => Some(c_mpa[1] / c_mpa[0]),
            _ => None,
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    // There are such records.
    ratios.get(ratios.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::stress_difference;
    use super::super::records::find;
    use super::*;

    #[test]
    fn it_has_the_same_modulus_and_stiffens() {
        let law = find("mold-star-30").unwrap().law;
        let (other, _) = counterpart(&law);
        assert_eq!(other.shear_modulus_mpa(), law.shear_modulus_mpa());
        let ratio = |stretch| stress_difference(&other, stretch) / stress_difference(&law, stretch);
        assert!((ratio(1.001) - 1.0).abs() < 1e-4);
        assert!(ratio(1.85) > 1.1 && ratio(1.85) < 1.5, "{}", ratio(1.85));
        let (back, _) = counterpart(&other);
        assert_eq!(back.model, law.model);
    }
}

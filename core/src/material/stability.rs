//! Where a law loses stability: Drucker's condition in three tension tests, and strong ellipticity in plane strain.
//!
//! *Drucker.* An incompressible law is a function W(e) of the logarithmic principal strains, e1 + e2 + e3 = 0, and the
//! increments of Kirchhoff stress and strain satisfy d tau : d e > 0 for every increment exactly where W is convex on that
//! plane. Its Hessian in (e1, e2),
//!
//! H = f' [[h1 + h3, h3], [h3, h2 + h3]] + f'' d d',   d = (g1 - g3, g2 - g3),   g_i = a exp(a e_i),   h_i = a g_i,
//!
//! summed over the terms f(sum_i exp(a e_i) - 3) of W, must be positive definite along the test, so that the tangent
//! modulus of the test itself is positive too. With l the largest stretch the tests are uniaxial (l, l^-1/2, l^-1/2),
//! planar (l, 1, 1/l) and equibiaxial (l, l, l^-2).
//!
//! *Ellipticity.* At J = 1 a rank-one increment a (x) n that keeps the volume has
//! a n : A : a n = 2 W_s + 4 W_ss (a . F n)^2 with a orthogonal to cof F n, |a| = |n| = 1; over all n the largest
//! (a . F n)^2 is (l1 - l2)^2 = s - 2. So the law is strongly elliptic where W_s > 0 and W_s + 2 W_ss (s - 2) > 0: where
//! stress in simple shear by l1 - l2 is positive and rises (Abeyaratne 1980, J. Elasticity 10, 255-293).
//!
//! Solids in plane strain are near planar tension everywhere, so planar tension and ellipticity decide what a solve may
//! rely on; uniaxial tension is the test of the data, and equibiaxial tension is for information.

use serde::Serialize;

use super::hyperelastic::{Parameters, isochoric};
use super::{HyperelasticModel, MaterialLaw};
use crate::lane::Pack;

/// Stability is looked for up to this stretch.
pub const SEARCHED_STRETCH: f64 = 10.0;
const STEPS: usize = 400;

/// The stretch at which each condition is first lost; `None`: not up to [`SEARCHED_STRETCH`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stability {
    /// Drucker's condition in uniaxial tension.
    pub uniaxial: Option<f64>,
    /// Drucker's condition in planar tension (pure shear).
    pub planar: Option<f64>,
    /// Drucker's condition in equibiaxial tension.
    pub equibiaxial: Option<f64>,
    /// Strong ellipticity in plane strain.
    pub ellipticity: Option<f64>,
}

impl Stability {
    /// Of a law, at least stable at rest.
    pub fn of(law: &MaterialLaw) -> Self {
        let terms = terms(law);
        // Convex functions that rise, of sums of exponentials.
        if !matches!(law.model, HyperelasticModel::Ogden(_))
            && terms.iter().all(|t| t.c.iter().all(|c| *c >= 0.0))
        {
            return Self::default();
        }
        let drucker =
            |direction: [f64; 3]| first_loss(|log| is_convex(&terms, direction.map(|d| d * log)));
        let mut parameters = Parameters::default();
        for lane in 0..crate::lane::LANES {
            parameters.set_lane(lane, law);
        }
        Self {
            uniaxial: drucker([1.0, -0.5, -0.5]),
            planar: drucker([1.0, 0.0, -1.0]),
            equibiaxial: drucker([1.0, 1.0, -2.0]),
            ellipticity: first_loss(|log| is_elliptic(&parameters, log.exp())),
        }
    }

    /// What fails first of planar tension and ellipticity, and its stretch: beyond it a solve in plane strain means
    /// little.
    pub fn lost_in_plane_strain(&self) -> Option<(&'static str, f64)> {
        first_of(&[
            ("Drucker stability in planar tension", self.planar),
            ("ellipticity", self.ellipticity),
        ])
    }

    /// What fails first within a range of stretch, equibiaxial tension apart.
    pub fn lost_within(&self, stretch: f64) -> Option<(&'static str, f64)> {
        first_of(&[
            ("Drucker stability in uniaxial tension", self.uniaxial),
            ("Drucker stability in planar tension", self.planar),
            ("ellipticity", self.ellipticity),
        ])
        .filter(|(_, at)| *at <= stretch)
    }
}

fn first_of(losses: &[(&'static str, Option<f64>)]) -> Option<(&'static str, f64)> {
    losses
        .iter()
        .filter_map(|(what, at)| Some((*what, (*at)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The smallest stretch above 1 where `holds` (of its logarithm) fails, by steps and then bisection.
fn first_loss(holds: impl Fn(f64) -> bool) -> Option<f64> {
    let step = SEARCHED_STRETCH.ln() / STEPS as f64;
    let first = (1..=STEPS).find(|k| !holds(*k as f64 * step))?;
    let (mut sound, mut lost) = ((first - 1) as f64 * step, first as f64 * step);
    for _ in 0..40 {
        let middle = 0.5 * (sound + lost);
        if holds(middle) {
            sound = middle;
        } else {
            lost = middle;
        }
    }
    Some(sound.exp())
}

/// c_1 t + c_2 t^2 + c_3 t^3 with t = sum_i exp(alpha e_i) - 3.
struct Term {
    alpha: f64,
    c: [f64; 3],
}

fn terms(law: &MaterialLaw) -> Vec<Term> {
    let term = |alpha, c| Term { alpha, c };
    match law.model {
        HyperelasticModel::NeoHookean { c10_mpa } => vec![term(2.0, [c10_mpa, 0.0, 0.0])],
        HyperelasticModel::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            c20_mpa,
        } => vec![
            term(2.0, [c10_mpa, c20_mpa, 0.0]),
            term(-2.0, [c01_mpa, 0.0, 0.0]),
        ],
        HyperelasticModel::Yeoh { c_mpa } => vec![term(2.0, c_mpa)],
        HyperelasticModel::Ogden(ogden) => ogden
            .coefficients()
            .map(|(c, alpha)| term(alpha, [c, 0.0, 0.0]))
            .collect(),
    }
}

fn is_convex(terms: &[Term], strain: [f64; 3]) -> bool {
    let mut h = [0.0; 3]; // H11, H12, H22
    for &Term { alpha, c } in terms {
        let e = strain.map(|e| (alpha * e).exp());
        let t = e[0] + e[1] + e[2] - 3.0;
        let first = (c[0] + t * (2.0 * c[1] + t * 3.0 * c[2])) * alpha * alpha;
        let second = (2.0 * c[1] + 6.0 * c[2] * t) * alpha * alpha;
        let d = [e[0] - e[2], e[1] - e[2]];
        h[0] += first * (e[0] + e[2]) + second * d[0] * d[0];
        h[1] += first * e[2] + second * d[0] * d[1];
        h[2] += first * (e[1] + e[2]) + second * d[1] * d[1];
    }
    h[0] > 0.0 && h[0] * h[2] > h[1] * h[1]
}

fn is_elliptic(parameters: &Parameters, stretch: f64) -> bool {
    let shear = stretch - 1.0 / stretch;
    let square = shear * shear;
    let w = isochoric(parameters, Pack::splat(2.0 + square), Pack::splat(1.0));
    let (first, second) = (w.s.0[0], w.ss.0[0]);
    first > 0.0 && first + 2.0 * second * square > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::records::RECORDS;
    use crate::material::{Ogden, OgdenForm, OgdenTerm};

    fn law(model: HyperelasticModel) -> MaterialLaw {
        MaterialLaw {
            model,
            bulk_over_shear: 1000.0,
            fit_stretch: None,
        }
    }

    fn yeoh(c_mpa: [f64; 3]) -> MaterialLaw {
        law(HyperelasticModel::Yeoh { c_mpa })
    }

    fn ogden(terms: &[(f64, f64)]) -> MaterialLaw {
        let terms: Vec<OgdenTerm> = terms
            .iter()
            .map(|&(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha })
            .collect();
        law(HyperelasticModel::Ogden(
            Ogden::new(OgdenForm::M, &terms).expect("few terms"),
        ))
    }

    fn close(found: Option<f64>, expected: f64) {
        let found = found.expect("a loss");
        assert!(
            (found - expected).abs() < 1e-9,
            "{found} against {expected}"
        );
    }

    #[test]
    fn laws_of_convex_terms_are_stable_throughout() {
        for law in [
            law(HyperelasticModel::NeoHookean { c10_mpa: 0.2 }),
            yeoh([0.1, 0.02, 1e-3]),
            ogden(&[(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)]),
        ] {
            assert_eq!(Stability::of(&law), Stability::default());
        }
    }

    #[test]
    fn ellipticity_is_lost_where_the_closed_form_says() {
        // Shear stress 2 k (c1 + 2 c2 k^2) of a law with c2 < 0 turns at k^2 = -c1 / (6 c2), k = l - 1/l.
        let k = (0.2_f64 / 0.06).sqrt();
        let found = Stability::of(&yeoh([0.2, -0.01, 0.0])).ellipticity;
        close(found, 0.5 * (k + (k * k + 4.0).sqrt()));
        // One Ogden term of exponent 1/2: tanh(t/2) tanh(t) = 1/2 at cosh t = 2, t = ln l. Drucker's condition holds.
        let square_root = Stability::of(&ogden(&[(0.4, 0.5)]));
        close(square_root.ellipticity, 2.0 + 3.0_f64.sqrt());
        assert_eq!(
            square_root.lost_in_plane_strain().map(|(what, _)| what),
            Some("ellipticity")
        );
        assert_eq!(
            (
                square_root.uniaxial,
                square_root.planar,
                square_root.equibiaxial
            ),
            (None, None, None)
        );
    }

    #[test]
    fn the_modulus_of_symmetric_tests_turns_where_stability_is_lost() {
        let found = Stability::of(&yeoh([0.00714, 6.61e-4, -1.27e-4]));
        // d2W/de2 along uniaxial (e, -e/2, -e/2) and equibiaxial (e, e, -2 e) tension, by differences.
        let modulus = |direction: [f64; 3], stretch: f64| {
            let w = |e: f64| {
                let t: f64 = direction.iter().map(|d| (2.0 * d * e).exp()).sum::<f64>() - 3.0;
                t * (0.00714 + t * (6.61e-4 - t * 1.27e-4))
            };
            let (e, h) = (stretch.ln(), 1e-4);
            w(e + h) - 2.0 * w(e) + w(e - h)
        };
        for (direction, at) in [
            ([1.0, -0.5, -0.5], found.uniaxial),
            ([1.0, 1.0, -2.0], found.equibiaxial),
        ] {
            let at = at.expect("a loss");
            assert!(modulus(direction, 0.999 * at) > 0.0 && modulus(direction, 1.001 * at) < 0.0);
        }
        assert_eq!(found.lost_within(2.0), None);
        assert_eq!(
            found.lost_within(2.3),
            Some(("ellipticity", found.ellipticity.expect("a loss")))
        );
    }

    #[test]
    fn records_are_stable_within_their_fit_range() {
        for record in &RECORDS {
            let range = record.law.fit_stretch.unwrap_or(1.0);
            assert_eq!(
                Stability::of(&record.law).lost_within(range),
                None,
                "{}",
                record.name
            );
        }
    }
}

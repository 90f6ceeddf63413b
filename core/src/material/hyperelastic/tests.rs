//! Every law against closed forms, against its own differences, and the laws against each other.

use super::*;
use crate::material::closed_form::{one_of_each, shear_stress, stress_difference};
use crate::material::{OgdenForm, OgdenTerm};

const NEO_HOOKEAN: HyperelasticModel = HyperelasticModel::NeoHookean { c10_mpa: 0.19 };
const MOONEY_RIVLIN: HyperelasticModel = HyperelasticModel::MooneyRivlin {
    c10_mpa: 0.26,
    c01_mpa: 0.097,
    c20_mpa: 0.0,
};
fn ogden_law(form: OgdenForm, terms: &[(f64, f64)]) -> HyperelasticModel {
    let terms: Vec<OgdenTerm> = terms
        .iter()
        .map(|&(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha })
        .collect();
    HyperelasticModel::Ogden(Ogden::new(form, &terms).expect("few terms"))
}

fn laws() -> Vec<MaterialLaw> {
    let each = one_of_each(1000.0);
    assert_eq!(each.len(), 6);
    each.into_iter().map(|(_, law)| law).collect()
}

fn law(model: HyperelasticModel) -> MaterialLaw {
    MaterialLaw {
        model,
        bulk_over_shear: 1000.0,
        fit_stretch: None,
    }
}

/// [W, W_s, W_J, W_ss, W_sJ, W_JJ] in lane 1 of a pack whose other lanes hold another law.
fn evaluate(law: &MaterialLaw, s: f64, j: f64) -> [f64; 6] {
    let mut m = Parameters::default();
    for lane in 0..LANES {
        m.set_lane(lane, &laws()[lane + 1]);
    }
    m.ogden = m.ogden.map(|mut o| {
        o.count[1] = 0;
        o
    });
    m.set_lane(1, law);
    let mut pack = (Pack::splat(2.3), Pack::splat(0.9));
    (pack.0.0[1], pack.1.0[1]) = (s, j);
    let w = isochoric(&m, pack.0, pack.1);
    [w.w, w.s, w.j, w.ss, w.sj, w.jj].map(|p| p.0[1])
}

/// W in the stretches l1, l2 and 1, as the books write it.
fn energy(law: &MaterialLaw, l1: f64, l2: f64) -> f64 {
    let root = (l1 * l2).cbrt();
    let l = [l1 / root, l2 / root, 1.0 / root];
    let power = |a: f64| l.iter().map(|l| l.powf(a)).sum::<f64>() - 3.0;
    let (i1, i2) = (power(2.0), power(-2.0));
    match law.model {
        HyperelasticModel::NeoHookean { c10_mpa } => c10_mpa * i1,
        HyperelasticModel::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            c20_mpa,
        } => c10_mpa * i1 + c01_mpa * i2 + c20_mpa * i1 * i1,
        HyperelasticModel::Yeoh { c_mpa: [a, b, c] } => i1 * (a + i1 * (b + i1 * c)),
        HyperelasticModel::Ogden(ogden) => ogden.coefficients().map(|(c, a)| c * power(a)).sum(),
    }
}

#[test]
fn energies_are_those_of_the_stretches() {
    for law in laws() {
        let mu = law.shear_modulus_mpa();
        for (l1, l2) in [
            (1.0, 1.0),
            (1.1, 1.1),
            (1.3, 1.3 + 1e-9),
            (1.2, 0.9),
            (3.0, 0.35),
            (0.4, 2.6),
            (6.0, 0.17),
        ] {
            let found = evaluate(&law, l1 * l1 + l2 * l2, l1 * l2)[0];
            let expected = energy(&law, l1, l2);
            let bound = 2e-14 * (expected.abs() + 10.0 * mu);
            assert!(
                (found - expected).abs() <= bound,
                "{law:?} at {l1}, {l2}: {found} against {expected}"
            );
        }
    }
}

#[test]
fn homogeneous_stretch_and_simple_shear_match_their_closed_forms() {
    for law in laws() {
        let mu = law.shear_modulus_mpa();
        for l in [1.0, 1.0 + 1e-9, 1.0001, 1.02, 1.5, 2.5, 5.0] {
            // Stretch: l1 P1 - l2 P2 with P = 2 W_s F + W_J cof F; the pressure's part cancels.
            let (l1, l2) = (l, 1.0 / l);
            let [_, ws, ..] = evaluate(&law, l1 * l1 + l2 * l2, 1.0);
            let expected = stress_difference(&law, l);
            let found = 2.0 * ws * (l1 * l1 - l2 * l2);
            assert!(
                (found - expected).abs() <= 1e-13 * (expected.abs() + mu),
                "{law:?} at {l}"
            );
            // Shear by g = l - 1/l, whose largest stretch is l.
            let g = l - 1.0 / l;
            let [_, ws, ..] = evaluate(&law, 2.0 + g * g, 1.0);
            let expected = shear_stress(&law, g);
            let found = 2.0 * ws * g;
            assert!(
                (found - expected).abs() <= 1e-13 * (expected.abs() + mu),
                "{law:?} at shear {g}"
            );
        }
    }
}

#[test]
fn at_rest_there_is_no_stress_and_the_stiffness_is_mu() {
    for law in laws() {
        let [w, ws, wj, ..] = evaluate(&law, 2.0, 1.0);
        let mu = law.shear_modulus_mpa();
        assert!(w.abs() <= 1e-15 * 10.0 * mu);
        assert!((2.0 * ws + wj).abs() <= 1e-15 * 10.0 * mu, "{law:?}");
        assert!((2.0 * ws - mu).abs() <= 1e-14 * mu, "{law:?}");
    }
}

/// The least error over steps of central differences of `f` against `d`.
fn least_error(f: impl Fn(f64) -> f64, at: f64, d: f64) -> f64 {
    [1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6]
        .into_iter()
        .map(|h| {
            let h = h * at;
            let fourth = f(at - 2.0 * h) - 8.0 * f(at - h) + 8.0 * f(at + h) - f(at + 2.0 * h);
            (fourth / (12.0 * h) - d).abs()
        })
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn derivatives_match_differences_also_where_stretches_coalesce() {
    for law in laws() {
        // The second is as near to s = 2 J as steps on both sides allow; the analytic continuation below it is not defined.
        for (s, j) in [
            (2.1, 1.0),
            (2.0 * 1.2 * 1.009, 1.2),
            (9.0, 1.3),
            (6.0, 0.5),
            (25.0, 1.001),
        ] {
            let d = evaluate(&law, s, j);
            let scale = law.shear_modulus_mpa() + d.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let by_s = |i: usize| move |s: f64| evaluate(&law, s, j)[i];
            let by_j = |i: usize| move |j: f64| evaluate(&law, s, j)[i];
            let errors = [
                least_error(by_s(0), s, d[1]),
                least_error(by_j(0), j, d[2]),
                least_error(by_s(1), s, d[3]),
                least_error(by_j(1), j, d[4]),
                least_error(by_s(2), s, d[4]),
                least_error(by_j(2), j, d[5]),
            ];
            for error in errors {
                assert!(error <= 2e-10 * scale, "{law:?} at {s}, {j}: {errors:?}");
            }
        }
    }
}

#[test]
fn nothing_jumps_as_the_stretches_coalesce() {
    for law in laws() {
        let j = 1.1;
        let at_rest = evaluate(&law, 2.0 * j, j);
        for excess in [1e-15, 1e-12, 1e-9, 1e-7] {
            let near = evaluate(&law, 2.0 * j * (1.0 + excess), j);
            for (a, b) in at_rest.iter().zip(near) {
                let scale = law.shear_modulus_mpa();
                assert!(
                    (a - b).abs() <= scale * (1e-13 + 500.0 * excess),
                    "{law:?} {excess}"
                );
            }
        }
    }
}

#[test]
fn ogden_laws_of_exponents_2_and_minus_2_are_the_invariant_laws() {
    let pairs = [
        (NEO_HOOKEAN, ogden_law(OgdenForm::M, &[(0.38, 2.0)])),
        (NEO_HOOKEAN, ogden_law(OgdenForm::A, &[(0.38, 2.0)])),
        (
            MOONEY_RIVLIN,
            ogden_law(OgdenForm::M, &[(0.52, 2.0), (-0.194, -2.0)]),
        ),
        (
            MOONEY_RIVLIN,
            ogden_law(OgdenForm::A, &[(0.52, 2.0), (0.194, -2.0)]),
        ),
    ];
    for (invariants, stretches) in pairs.map(|(a, b)| (law(a), law(b))) {
        let mu = invariants.shear_modulus_mpa();
        assert!((mu - stretches.shear_modulus_mpa()).abs() < 1e-15);
        for (s, j) in [
            (2.0, 1.0),
            (2.0 + 1e-14, 1.0),
            (2.2 + 1e-8, 1.1),
            (4.0, 1.0),
            (9.0, 0.7),
            (40.0, 1.02),
        ] {
            let (a, b) = (evaluate(&invariants, s, j), evaluate(&stretches, s, j));
            for (x, y) in a.iter().zip(b) {
                // Sums of terms of this size.
                let scale = mu * (1.0 + s / j) / j;
                assert!(
                    (x - y).abs() <= 1e-14 * scale,
                    "{s}, {j}: {a:?} against {b:?}"
                );
            }
        }
    }
}

#[test]
fn the_inverse_cube_root_is_exact_but_for_rounding() {
    for k in 0..4000 {
        let j = 0.05 + 0.001 * f64::from(k);
        for lanes in [[j; 4], [j, 1.0, 0.99, 3.0]] {
            let y = inverse_cube_root(Pack(lanes)).0[0];
            let exact = 1.0 / j.cbrt();
            assert!((y / exact - 1.0).abs() < 1e-15, "{j}: {y} {exact}");
        }
    }
}

//! The laws that are fitted, as functions of their parameters.

use nalgebra::{DMatrix, DVector};
use serde::{Serialize, Serializer};

use super::least_squares::{self, Problem};
use crate::material::closed_form::uniaxial_stress;
use crate::material::ogden::MAX_EXPONENT;
use crate::material::records::DEFAULT_BULK_OVER_SHEAR;
use crate::material::{HyperelasticModel, MaterialLaw, Ogden, OgdenForm, OgdenTerm};

/// A law whose parameters are sought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// C10.
    NeoHookean,
    /// C10, C01.
    MooneyRivlin,
    /// C10, C01, C20.
    MooneyRivlinC20,
    /// C1, C2, C3.
    Yeoh,
    /// mu_p, then a_p, of as many terms, form m.
    Ogden(usize),
}

/// All that are fitted, those with few parameters first.
pub const FAMILIES: [Family; 7] = [
    Family::NeoHookean,
    Family::MooneyRivlin,
    Family::Ogden(1),
    Family::MooneyRivlinC20,
    Family::Yeoh,
    Family::Ogden(2),
    Family::Ogden(3),
];

/// Exponents that starts of Ogden laws are made of; published fits of rubber lie among them.
const STARTS: [f64; 11] = [-8.0, -4.0, -2.0, -1.0, 0.6, 1.3, 2.0, 3.0, 5.0, 9.0, 16.0];
/// Starts, the best by their linear fits, that are followed to the end.
const FOLLOWED: usize = 8;
/// Rows by which starts are ranked.
const RANKED_ROWS: usize = 200;
/// Exponents nearer to zero have no law.
const LEAST_EXPONENT: f64 = 1e-4;

impl Serialize for Family {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl Family {
    /// In answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo_hookean",
            Self::MooneyRivlin => "mooney_rivlin",
            Self::MooneyRivlinC20 => "mooney_rivlin_c20",
            Self::Yeoh => "yeoh",
            Self::Ogden(1) => "ogden_1",
            Self::Ogden(2) => "ogden_2",
            Self::Ogden(_) => "ogden_3",
        }
    }

    /// Number of parameters.
    pub fn parameters(self) -> usize {
        match self {
            Self::NeoHookean => 1,
            Self::MooneyRivlin => 2,
            Self::MooneyRivlinC20 | Self::Yeoh => 3,
            Self::Ogden(terms) => 2 * terms,
        }
    }

    /// Names of the parameters with their units.
    pub fn names(self) -> Vec<String> {
        let plain = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        match self {
            Self::NeoHookean => plain(&["c10_mpa"]),
            Self::MooneyRivlin => plain(&["c10_mpa", "c01_mpa"]),
            Self::MooneyRivlinC20 => plain(&["c10_mpa", "c01_mpa", "c20_mpa"]),
            Self::Yeoh => plain(&["c_mpa[0]", "c_mpa[1]", "c_mpa[2]"]),
            Self::Ogden(terms) => (0..terms)
                .map(|p| format!("mu_mpa[{p}]"))
                .chain((0..terms).map(|p| format!("alpha[{p}]")))
                .collect(),
        }
    }

    /// The law of these parameters, K = 1000 mu.
    pub fn law(self, x: &[f64], fit_stretch: Option<f64>) -> MaterialLaw {
        let at = |k: usize| x.get(k).copied().unwrap_or_default();
        let model = match self {
            Self::NeoHookean => HyperelasticModel::NeoHookean { c10_mpa: at(0) },
            Self::MooneyRivlin | Self::MooneyRivlinC20 => HyperelasticModel::MooneyRivlin {
                c10_mpa: at(0),
                c01_mpa: at(1),
                c20_mpa: at(2),
            },
            Self::Yeoh => HyperelasticModel::Yeoh {
                c_mpa: [at(0), at(1), at(2)],
            },
            Self::Ogden(terms) => {
                let term = |p: usize| OgdenTerm {
                    mu_mpa: at(p),
                    alpha: at(terms + p),
                };
                let terms: Vec<OgdenTerm> = (0..terms.min(3)).map(term).collect();
                // Three terms at most, of the six that a law may have.
                match Ogden::new(OgdenForm::M, &terms) {
                    Some(ogden) => HyperelasticModel::Ogden(ogden),
                    None => HyperelasticModel::NeoHookean { c10_mpa: f64::NAN },
                }
            }
        };
        MaterialLaw {
            model,
            bulk_over_shear: DEFAULT_BULK_OVER_SHEAR,
            fit_stretch,
        }
    }

    /// Nominal stresses at the points' stretches less those measured, MPa.
    pub fn residuals(self, x: &[f64], points: &[[f64; 2]]) -> Vec<f64> {
        let law = self.law(x, None);
        let of = |[l, s]: &[f64; 2]| uniaxial_stress(&law, *l) - s;
        points.iter().map(of).collect()
    }

    /// Derivatives of the residuals by the parameters, a row a point.
    pub fn jacobian(self, x: &[f64], points: &[[f64; 2]]) -> DMatrix<f64> {
        let count = self.parameters();
        let Self::Ogden(terms) = self else {
            // Linear: the stress of a unit of each.
            let unit = |k: usize| {
                let e: Vec<f64> = (0..count).map(|j| f64::from(u8::from(j == k))).collect();
                self.law(&e, None)
            };
            let laws: Vec<MaterialLaw> = (0..count).map(unit).collect();
            return DMatrix::from_fn(points.len(), count, |i, k| {
                uniaxial_stress(&laws[k], points[i][0])
            });
        };
        DMatrix::from_fn(points.len(), count, |i, k| {
            let l = points[i][0];
            let p = k % terms;
            let (mu, a) = (x[p], x[terms + p]);
            let (rising, falling) = (l.powf(a - 1.0), l.powf(-0.5 * a - 1.0));
            if k < terms {
                rising - falling
            } else {
                mu * l.ln() * (rising + 0.5 * falling)
            }
        })
    }

    /// Parameters of least squares, with the sum of squares; `None` where the points do not determine any.
    pub fn fit(self, points: &[[f64; 2]]) -> Option<Vec<f64>> {
        if points.len() < self.parameters() {
            return None;
        }
        match self {
            Self::Ogden(terms) => ogden(terms, points),
            _ => linear(&self.jacobian(&[], points), points),
        }
    }

    /// Parameters of least squares near given ones.
    pub fn fit_from(self, start: &[f64], points: &[[f64; 2]]) -> Option<Vec<f64>> {
        match self {
            Self::Ogden(terms) => {
                let fit = least_squares::minimise(&OgdenProblem { terms, points }, start.to_vec());
                fit.cost.is_finite().then_some(fit.x)
            }
            _ => self.fit(points),
        }
    }
}

/// The solution of a linear fit by singular values of the triangle of the equilibrated matrix.
fn linear(matrix: &DMatrix<f64>, points: &[[f64; 2]]) -> Option<Vec<f64>> {
    let stresses = DVector::from_iterator(points.len(), points.iter().map(|p| p[1]));
    least_squares::linear(matrix, &stresses)
}

struct OgdenProblem<'a> {
    terms: usize,
    points: &'a [[f64; 2]],
}

impl Problem for OgdenProblem<'_> {
    fn residuals(&self, x: &[f64]) -> Option<Vec<f64>> {
        let sound = |a: &f64| (LEAST_EXPONENT..=MAX_EXPONENT).contains(&a.abs());
        x[self.terms..]
            .iter()
            .all(sound)
            .then(|| Family::Ogden(self.terms).residuals(x, self.points))
    }

    fn jacobian(&self, x: &[f64]) -> DMatrix<f64> {
        Family::Ogden(self.terms).jacobian(x, self.points)
    }
}

/// The best of several starts: sets of exponents, their moduli by a linear fit, the best of them followed.
fn ogden(terms: usize, points: &[[f64; 2]]) -> Option<Vec<f64>> {
    let stride = points.len().div_ceil(RANKED_ROWS).max(1);
    let few: Vec<[f64; 2]> = points.iter().copied().step_by(stride).collect();
    let few = if few.len() > 2 * terms {
        &few[..]
    } else {
        points
    };
    let mut starts: Vec<(f64, Vec<f64>)> = sets(STARTS.len(), terms)
        .into_iter()
        .filter_map(|set| {
            let exponents: Vec<f64> = set.into_iter().map(|i| STARTS[i]).collect();
            let x: Vec<f64> = std::iter::repeat_n(1.0, terms)
                .chain(exponents.clone())
                .collect();
            let family = Family::Ogden(terms);
            let matrix = family.jacobian(&x, few).columns(0, terms).into_owned();
            let mut x = linear(&matrix, few)?;
            x.extend(exponents);
            let squares: f64 = family.residuals(&x, few).iter().map(|r| r * r).sum();
            Some((squares, x))
        })
        .filter(|(squares, _)| squares.is_finite())
        .collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let problem = OgdenProblem { terms, points };
    let ends = starts
        .into_iter()
        .take(FOLLOWED)
        .map(|(_, x)| least_squares::minimise(&problem, x));
    let best = ends.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    Some(in_order(terms, &best.x))
}

/// Terms with the largest share of the shear modulus first.
fn in_order(terms: usize, x: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..terms).collect();
    order.sort_by(|a, b| (x[*b] * x[terms + b]).total_cmp(&(x[*a] * x[terms + a])));
    let moduli = order.iter().map(|p| x[*p]);
    moduli.chain(order.iter().map(|p| x[terms + p])).collect()
}

/// All sets of `size` of `count` indices.
fn sets(count: usize, size: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..size {
        all = all
            .into_iter()
            .flat_map(|set: Vec<usize>| {
                let from = set.last().map_or(0, |last| last + 1);
                (from..count).map(move |next| [&set[..], &[next]].concat())
            })
            .collect();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_by_the_parameters_are_those_of_differences() {
        let points: Vec<[f64; 2]> = (1..8).map(|i| [1.0 + 0.4 * f64::from(i), 0.0]).collect();
        for family in FAMILIES {
            let x: Vec<f64> = match family {
                Family::Ogden(n) => (0..2 * n)
                    .map(|k| [0.4, 0.1, -0.02, 2.0, 4.0, -2.0][(k % n) + 3 * (k / n)])
                    .collect(),
                _ => [0.2, 0.03, -0.001][..family.parameters()].to_vec(),
            };
            let exact = family.jacobian(&x, &points);
            for k in 0..x.len() {
                let at = |step: f64| {
                    let mut y = x.clone();
                    y[k] += step;
                    family.residuals(&y, &points)
                };
                let (up, down) = (at(1e-5), at(-1e-5));
                for i in 0..points.len() {
                    let difference = (up[i] - down[i]) / 2e-5;
                    let scale = exact.column(k).amax();
                    assert!(
                        (difference - exact[(i, k)]).abs() < 1e-7 * scale,
                        "{family:?} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn sets_are_all_of_their_size() {
        assert_eq!(sets(4, 2).len(), 6);
        assert_eq!(sets(3, 3), [[0, 1, 2]]);
    }
}

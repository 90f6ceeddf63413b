//! A law from a tension test: parameters by least squares, their errors, the choice of the law and where it is stable.
//!
//! In uniaxial tension an incompressible solid has the stretches l, l^-1/2, l^-1/2 (the strip is in plane stress), and its nominal
//! stress is P = dW/dl. Neo-Hookean, Mooney-Rivlin and Yeoh laws are linear in their parameters; Ogden
//! laws of one to three terms are found by Levenberg and Marquardt's method from several sets of exponents. All rows count
//! alike: the sum of (P(l_i) - s_i)^2, in MPa^2, is least.
//!
//! A fit is no more than its data: uniaxial data leave the second invariant free, so two laws may agree in tension and differ in the
//! near planar stretching of a chamber's wall. Laws that are unstable within the range of the data are told and never chosen.

mod data;
mod family;
mod least_squares;
mod statistics;
#[cfg(test)]
mod tests;

use serde::Serialize;

pub use data::{Specimen, TensionTest, read_csv};
pub use family::{FAMILIES, Family};
pub use statistics::ErrorBasis;

use super::MaterialLaw;
use super::stability::{SEARCHED_STRETCH, Stability};

/// Pressure at which p/mu is given, MPa.
const PRESSURE_MPA: f64 = 0.015;
/// Share of the largest stress below which a row has no relative error.
pub const RELATIVE_FROM: f64 = 0.05;
/// Share of the mean stress that a residual cannot be told from zero.
const ROUND_OFF: f64 = 1e-13;
/// Share by which the error on unseen specimens may be above the least: then fewer parameters win.
const AS_GOOD: f64 = 0.05;
/// Least specimens for a choice by leaving each out.
const LEAST_LEFT_OUT: usize = 3;

/// What came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialFit {
    /// Rows that were fitted; those at rest say nothing and are not counted.
    pub rows: usize,
    /// Strips.
    pub specimens: usize,
    /// Least and largest stretch of the data.
    pub stretch: [f64; 2],
    /// What the standard errors rest on.
    pub errors_rest_on: ErrorBasis,
    /// What the choice rests on.
    pub chosen_by: Criterion,
    /// The law to take: the least criterion of those that are usable; by cross-validation the one with the fewest parameters
    /// of those within 5 % of the least.
    pub chosen: Option<Family>,
    /// In the order of [`FAMILIES`].
    pub laws: Vec<LawFit>,
    /// Laws with more parameters than the data can bear.
    pub left_out: Vec<LeftOut>,
}

/// How a law is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Least AICc; with one or two specimens.
    Aicc,
    /// Least error on specimens that the fit has not seen; with three or more.
    CrossValidation,
}

/// A law that was not fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOut {
    /// Which.
    pub law: Family,
    /// Why.
    pub why: String,
}

/// One law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LawFit {
    /// Which.
    pub law: Family,
    /// With K = 1000 mu and the range of the data.
    #[serde(skip)]
    pub material: MaterialLaw,
    /// In the order of the record's fields.
    pub parameters: Vec<Parameter>,
    /// Root of the mean square of the residuals, MPa.
    pub rms_mpa: f64,
    /// Largest residual, MPa.
    pub max_mpa: f64,
    /// Stretch at which it is.
    pub max_at_stretch: f64,
    /// Root of the mean square of residual over stress, of rows above [`RELATIVE_FROM`] of the largest stress.
    pub relative_rms: f64,
    /// The largest of them.
    pub relative_max: f64,
    /// Stretch at which it is.
    pub relative_max_at_stretch: f64,
    /// Akaike's criterion for few rows; `None` with too few.
    pub aicc: Option<f64>,
    /// Root of the mean square of the residuals of each specimen against the fit of the others, MPa; `None` with one.
    pub cross_validation_mpa: Option<f64>,
    /// Initial shear modulus, MPa.
    pub shear_modulus_mpa: f64,
    /// 15 kPa over it.
    pub p_over_mu_at_15_kpa: f64,
    /// Stretches at which stability is lost.
    pub stable_to_stretch: Stability,
    /// Why no study should take it; `None` where it may.
    pub unusable: Option<String>,
}

/// A parameter with its error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Field of the record.
    pub name: String,
    /// MPa; exponents 1.
    pub value: f64,
    /// `None` where the data do not determine it.
    pub standard_error: Option<f64>,
    /// Of 95 %.
    pub interval: Option<[f64; 2]>,
}

impl MaterialFit {
    /// The fit of a law.
    pub fn of(&self, law: Family) -> Option<&LawFit> {
        self.laws.iter().find(|l| l.law == law)
    }

    /// The fit to take.
    pub fn chosen(&self) -> Option<&LawFit> {
        self.of(self.chosen?)
    }
}

/// Fits every law to a test.
pub fn fit(test: &TensionTest) -> MaterialFit {
    let moved = |s: &Specimen| -> Vec<[f64; 2]> {
        let moved = s.points.iter().filter(|[l, _]| *l != 1.0);
        moved.copied().collect()
    };
    let blocks: Vec<Vec<[f64; 2]>> = test.specimens.iter().map(moved).collect();
    let blocks: Vec<Vec<[f64; 2]>> = blocks.into_iter().filter(|b| !b.is_empty()).collect();
    let rows: usize = blocks.iter().map(Vec::len).sum();
    let stretch = test.stretches();
    let (mut laws, mut left_out) = (Vec::new(), Vec::new());
    for family in FAMILIES {
        let needed = family.parameters() + 1;
        match fit_law(family, &blocks, stretch[1]) {
            Some(law) => laws.push(law),
            None => left_out.push(LeftOut {
                law: family,
                why: if rows < needed {
                    format!("needs at least {needed} rows, found {rows}")
                } else {
                    "the rows do not determine its parameters".to_owned()
                },
            }),
        }
    }
    let chosen_by = if blocks.len() >= LEAST_LEFT_OUT {
        Criterion::CrossValidation
    } else {
        Criterion::Aicc
    };
    let key = |law: &LawFit| match chosen_by {
        Criterion::Aicc => law.aicc,
        Criterion::CrossValidation => law.cross_validation_mpa,
    };
    let usable = laws.iter().filter(|l| l.unusable.is_none());
    let ranked: Vec<(Family, f64)> = usable.filter_map(|l| Some((l.law, key(l)?))).collect();
    let least = ranked.iter().map(|r| r.1).fold(f64::INFINITY, f64::min);
    let good = match chosen_by {
        Criterion::Aicc => least,
        Criterion::CrossValidation => least * (1.0 + AS_GOOD),
    };
    // Those with fewer parameters come first.
    let chosen = ranked.iter().find(|r| r.1 <= good).map(|r| r.0);
    let errors_rest_on = if blocks.len() >= LEAST_LEFT_OUT {
        ErrorBasis::SpreadOfSpecimens
    } else {
        ErrorBasis::IndependentResiduals
    };
    MaterialFit {
        rows,
        specimens: blocks.len(),
        stretch,
        errors_rest_on,
        chosen_by,
        chosen,
        laws,
        left_out,
    }
}

fn fit_law(family: Family, blocks: &[Vec<[f64; 2]>], end: f64) -> Option<LawFit> {
    let points = blocks.concat();
    let count = family.parameters();
    if points.len() <= count {
        return None;
    }
    let x = family.fit(&points)?;
    let residuals = family.residuals(&x, &points);
    if !residuals.iter().all(|r| r.is_finite()) {
        return None;
    }
    let in_blocks: Vec<_> = blocks
        .iter()
        .map(|b| (family.jacobian(&x, b), family.residuals(&x, b)))
        .collect();
    let (_, errors) = statistics::errors(&in_blocks);
    let parameters = family.names().into_iter().enumerate().map(|(k, name)| {
        let of = errors.as_ref().and_then(|e| e.get(k));
        Parameter {
            name,
            value: x[k],
            standard_error: of.map(|e| e[0]),
            interval: of.map(|e| [x[k] - e[1], x[k] + e[1]]),
        }
    });
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let stresses = points.iter().map(|p| p[1] * p[1]).sum::<f64>() / points.len() as f64;
    let (max_mpa, max_at_stretch) = largest(residuals.iter().zip(&points).map(|(r, p)| (*r, p[0])));
    let strong = RELATIVE_FROM * points.iter().fold(0.0, |m: f64, p| m.max(p[1].abs()));
    let relative: Vec<(f64, f64)> = (residuals.iter().zip(&points))
        .filter(|(_, p)| p[1].abs() >= strong)
        .map(|(r, p)| (r / p[1], p[0]))
        .collect();
    let (relative_max, relative_max_at_stretch) = largest(relative.iter().copied());
    let mean = relative.iter().map(|r| r.0 * r.0).sum::<f64>() / relative.len() as f64;
    let fit_stretch = (end > 1.0 && end <= SEARCHED_STRETCH).then_some(end);
    let material = family.law(&x, fit_stretch);
    let stability = Stability::of(&material);
    let mu = material.shear_modulus_mpa();
    Some(LawFit {
        law: family,
        material,
        parameters: parameters.collect(),
        rms_mpa: (squares / points.len() as f64).sqrt(),
        max_mpa,
        max_at_stretch,
        relative_rms: mean.sqrt(),
        relative_max,
        relative_max_at_stretch,
        aicc: statistics::aicc(
            points.len(),
            squares,
            count,
            stresses * ROUND_OFF * ROUND_OFF,
        ),
        cross_validation_mpa: left_out_error(family, &x, blocks),
        shear_modulus_mpa: mu,
        p_over_mu_at_15_kpa: PRESSURE_MPA / mu,
        stable_to_stretch: stability,
        unusable: unusable(mu, end, &stability),
    })
}

/// The value of largest size, as its size, with what belongs to it.
fn largest(values: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    values.fold((0.0, 1.0), |best: (f64, f64), (value, at)| {
        if value.abs() > best.0 {
            (value.abs(), at)
        } else {
            best
        }
    })
}

fn left_out_error(family: Family, x: &[f64], blocks: &[Vec<[f64; 2]>]) -> Option<f64> {
    if blocks.len() < 2 {
        return None;
    }
    let (mut squares, mut rows) = (0.0, 0);
    for out in 0..blocks.len() {
        let others: Vec<[f64; 2]> = (blocks.iter().enumerate())
            .filter(|(i, _)| *i != out)
            .flat_map(|(_, b)| b.iter().copied())
            .collect();
        let x = family.fit_from(x, &others)?;
        let residuals = family.residuals(&x, &blocks[out]);
        squares += residuals.iter().map(|r| r * r).sum::<f64>();
        rows += residuals.len();
    }
    Some((squares / rows as f64).sqrt())
}

fn unusable(mu: f64, end: f64, stability: &Stability) -> Option<String> {
    if mu.is_nan() || mu <= 0.0 {
        return Some(format!("the shear modulus is {mu:.4} MPa"));
    }
    let (what, at) = stability.lost_within(end)?;
    Some(format!(
        "loses {what} at stretch {at:.4}, within the data (to {end:.4})"
    ))
}

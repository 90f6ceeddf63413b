//! Ogden's law, W = sum_p c_p (l1b^a_p + l2b^a_p + l3b^a_p - 3), in the isochoric principal stretches
//! (Ogden 1972, Proc. R. Soc. Lond. A 326, 565-584).
//!
//! Two conventions are in use for the coefficients, and a document names its own:
//!
//! | form | c_p | mu |
//! |---|---|---|
//! | `m` | mu_p / a_p | 1/2 sum mu_p a_p |
//! | `a` | 2 mu_p / a_p^2 | sum mu_p |

use serde::{Deserialize, Serialize};

/// Most terms of a law.
pub const MAX_TERMS: usize = 6;
/// Largest absolute exponent: published fits stay below 30, and powers of trial stretches must stay finite.
pub const MAX_EXPONENT: f64 = 50.0;

/// How mu_p enters the energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OgdenForm {
    /// c_p = mu_p / a_p.
    M,
    /// c_p = 2 mu_p / a_p^2.
    A,
}

/// One term.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OgdenTerm {
    /// mu_p, MPa.
    pub mu_mpa: f64,
    /// Exponent a_p, not zero.
    pub alpha: f64,
}

/// A law of up to [`MAX_TERMS`] terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ogden {
    /// Convention of the coefficients.
    pub form: OgdenForm,
    terms: [OgdenTerm; MAX_TERMS],
    count: usize,
}

impl Ogden {
    /// A law of these terms; `None` where there are more than [`MAX_TERMS`].
    pub fn new(form: OgdenForm, terms: &[OgdenTerm]) -> Option<Self> {
        let mut this = Self {
            form,
            terms: [OgdenTerm::default(); MAX_TERMS],
            count: terms.len(),
        };
        this.terms.get_mut(..terms.len())?.copy_from_slice(terms);
        Some(this)
    }

    /// The terms, as the document gives them.
    pub fn terms(&self) -> &[OgdenTerm] {
        &self.terms[..self.count]
    }

    /// (c_p, a_p) of each term.
    pub fn coefficients(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.terms().iter().map(|t| match self.form {
            OgdenForm::M => (t.mu_mpa / t.alpha, t.alpha),
            OgdenForm::A => (2.0 * t.mu_mpa / (t.alpha * t.alpha), t.alpha),
        })
    }

    /// Initial shear modulus, MPa.
    pub fn shear_modulus_mpa(&self) -> f64 {
        let of = |t: &OgdenTerm| match self.form {
            OgdenForm::M => 0.5 * t.mu_mpa * t.alpha,
            OgdenForm::A => t.mu_mpa,
        };
        self.terms().iter().map(of).sum()
    }
}

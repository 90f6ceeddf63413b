//! Errors of least squares: covariance of the parameters, Student's quantile, Akaike's criterion.

use nalgebra::DMatrix;

/// Share of the largest singular value below which a direction of the parameters is not determined.
const UNDETERMINED: f64 = 1e-11;

/// What the standard errors rest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorBasis {
    /// Residuals of all rows are taken as independent of each other and of one size.
    IndependentResiduals,
    /// Specimens are independent; what one row of a specimen has to do with the next does not matter.
    SpreadOfSpecimens,
}

/// Least specimens whose spread says something.
const LEAST_SPECIMENS: usize = 3;

/// Standard errors and half widths of the 95 % intervals of the parameters, from the derivatives of the residuals by them and
/// the residuals at the optimum, each in blocks of rows, one block a specimen; `None` where they are not determined.
///
/// With three specimens or more the covariance is (J'J)^-1 (sum_s J_s' r_s r_s' J_s) (J'J)^-1 S / (S - 1) with S - 1 degrees
/// of freedom (Liang and Zeger 1986, Biometrika 73, 13-22): where all have the same stretches this is the spread of their
/// own fits over sqrt(S). Else it is s^2 (J'J)^-1, s^2 = r'r / (n - k), with n - k degrees of freedom.
pub fn errors(blocks: &[(DMatrix<f64>, Vec<f64>)]) -> (ErrorBasis, Option<Vec<[f64; 2]>>) {
    let basis = if blocks.len() >= LEAST_SPECIMENS {
        ErrorBasis::SpreadOfSpecimens
    } else {
        ErrorBasis::IndependentResiduals
    };
    (basis, variances(blocks, basis))
}

fn variances(blocks: &[(DMatrix<f64>, Vec<f64>)], basis: ErrorBasis) -> Option<Vec<[f64; 2]>> {
    let parameters = blocks.first()?.0.ncols();
    let rows: usize = blocks.iter().map(|b| b.1.len()).sum();
    let inverse = inverse_of_gram(blocks, parameters)?;
    let (variance, freedom): (Vec<f64>, usize) = match basis {
        ErrorBasis::IndependentResiduals => {
            let freedom = rows.checked_sub(parameters).filter(|f| *f > 0)?;
            let squares: f64 = blocks.iter().flat_map(|b| &b.1).map(|r| r * r).sum();
            let s2 = squares / freedom as f64;
            (
                (0..parameters).map(|k| s2 * inverse[(k, k)]).collect(),
                freedom,
            )
        }
        ErrorBasis::SpreadOfSpecimens => {
            let count = blocks.len();
            let mut variance = vec![0.0; parameters];
            for (jacobian, residuals) in blocks {
                let r = nalgebra::DVector::from_column_slice(residuals);
                let influence = &inverse * (jacobian.transpose() * r);
                for (v, d) in variance.iter_mut().zip(influence.iter()) {
                    *v += d * d * count as f64 / (count - 1) as f64;
                }
            }
            (variance, count - 1)
        }
    };
    let t = student(freedom);
    let of = |v: f64| [v.sqrt(), t * v.sqrt()];
    Some(variance.into_iter().map(of).collect())
}

/// (J'J)^-1 by the singular values of the triangle of J with columns of length one.
fn inverse_of_gram(blocks: &[(DMatrix<f64>, Vec<f64>)], parameters: usize) -> Option<DMatrix<f64>> {
    let rows: usize = blocks.iter().map(|b| b.1.len()).sum();
    if rows < parameters {
        return None;
    }
    let mut all = DMatrix::zeros(rows, parameters);
    let mut at = 0;
    for (jacobian, _) in blocks {
        all.rows_mut(at, jacobian.nrows()).copy_from(jacobian);
        at += jacobian.nrows();
    }
    let lengths: Vec<f64> = all.column_iter().map(|c| c.norm()).collect();
    if lengths.iter().any(|l| !(l.is_finite() && *l > 0.0)) {
        return None;
    }
    for (mut column, length) in all.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let svd = all.qr().unpack_r().svd(false, true);
    let v = svd.v_t?.transpose();
    let largest = svd.singular_values.max();
    if svd.singular_values.min() <= UNDETERMINED * largest {
        return None;
    }
    let mut inverse = DMatrix::zeros(parameters, parameters);
    for i in 0..parameters {
        for j in 0..parameters {
            let sum: f64 = (0..parameters)
                .map(|m| v[(i, m)] * v[(j, m)] / svd.singular_values[m].powi(2))
                .sum();
            inverse[(i, j)] = sum / (lengths[i] * lengths[j]);
        }
    }
    Some(inverse)
}

/// Akaike's criterion with the correction for few rows (Hurvich and Tsai 1989), n ln(S / n) + 2 k + 2 k (k + 1) / (n - k - 1)
/// with the variance counted in k; `None` with too few rows. `least` is the mean square that is round-off.
pub fn aicc(rows: usize, squares: f64, parameters: usize, least: f64) -> Option<f64> {
    let (n, k) = (rows as f64, parameters as f64 + 1.0);
    let left = n - k - 1.0;
    (left > 0.0).then(|| n * (squares / n).max(least).ln() + 2.0 * k + 2.0 * k * (k + 1.0) / left)
}

/// The number that Student's t exceeds in absolute value with a chance of 5 %, by the finite series of its distribution
/// (Abramowitz and Stegun 26.7.3 and 26.7.4).
pub fn student(freedom: usize) -> f64 {
    // Beyond, it changes in the third decimal no more.
    let freedom = freedom.clamp(1, 2000);
    let within = |t: f64| {
        let angle = (t / (freedom as f64).sqrt()).atan();
        let (sine, cosine) = angle.sin_cos();
        let odd = freedom % 2 == 1;
        let first = if odd { cosine } else { 1.0 };
        let (mut term, mut sum) = (first, 0.0);
        let mut power = if odd { 3 } else { 2 };
        while power <= freedom {
            sum += term;
            term *= cosine * cosine * (power - 1) as f64 / power as f64;
            power += 2;
        }
        if odd {
            (angle + sine * sum) * std::f64::consts::FRAC_2_PI
        } else {
            sine * sum
        }
    };
    let (mut low, mut high) = (1.0, 13.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if within(middle) < 0.95 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, expected) in [
            (1, 12.7062),
            (2, 4.3027),
            (3, 3.1824),
            (4, 2.7764),
            (9, 2.2622),
            (10, 2.2281),
            (30, 2.0423),
            (120, 1.9799),
        ] {
            let found = student(freedom);
            assert!((found - expected).abs() < 6e-5, "{freedom}: {found}");
        }
    }

    #[test]
    fn the_spread_of_equal_specimens_is_that_of_their_means() {
        // A constant fitted to four specimens of two rows: means 1, 2, 3, 6.
        let blocks: Vec<(DMatrix<f64>, Vec<f64>)> = [1.0, 2.0, 3.0, 6.0]
            .map(|mean| {
                let r: Vec<f64> = [mean - 0.1, mean + 0.1].iter().map(|y| 3.0 - y).collect();
                (DMatrix::from_element(2, 1, 1.0), r)
            })
            .into();
        let (basis, found) = errors(&blocks);
        assert_eq!(basis, ErrorBasis::SpreadOfSpecimens);
        let [error, half] = found.expect("determined")[0];
        let expected = (14.0_f64 / 3.0 / 4.0).sqrt();
        assert!((error - expected).abs() < 1e-12 && (half / error - 3.1824).abs() < 1e-4);
    }

    #[test]
    fn parameters_that_data_do_not_tell_apart_have_no_error() {
        let twice = DMatrix::from_fn(9, 2, |i, _| i as f64 + 1.0);
        assert_eq!(errors(&[(twice, vec![0.1; 9])]).1, None);
    }
}

//! Least squares: the transformation of a unit from points of its right edge, and the rigid frame of its left one.

use serde::{Deserialize, Serialize};

use super::{Frame, LinearTransform};
use crate::geometry::Point;

/// A fitted transformation and what it leaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The transformation.
    pub transform: LinearTransform,
    /// Root of the mean squared distance that is left, mm.
    pub rms_mm: f64,
    /// Largest distance that is left, mm.
    pub max_mm: f64,
}

/// Why points cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CannotFit {
    /// Lists of different lengths.
    #[error(
        "expected as many deformed points and weights as reference points ({reference}), found {deformed} and {weights}"
    )]
    Counts {
        /// Reference points.
        reference: usize,
        /// Deformed points.
        deformed: usize,
        /// Weights.
        weights: usize,
    },
    /// The reference points do not determine it.
    #[error(
        "{points} points with a determinant of {determinant:e} (0 to 1) do not determine the fit"
    )]
    Undetermined {
        /// Points with a weight.
        points: usize,
        /// Of the moments over that of a round cloud of points.
        determinant: f64,
    },
    /// A coordinate or a weight that is not finite, or a negative weight.
    #[error("point {index} or its weight is not a finite number, or its weight is negative")]
    NotFinite {
        /// The point.
        index: usize,
    },
}

/// Below this relative determinant the points are taken to be on one line through the origin.
const LEAST_DETERMINANT: f64 = 1e-12;

/// The transformation T with least sum w |T r - d|^2 over reference points r and deformed points d, both in the frame of the
/// left edge: T = (sum w d r') (sum w r r')^-1.
///
/// # Errors
/// Lists that do not fit together, numbers that are not finite, points on one line through the origin.
pub fn fit(reference: &[Point], deformed: &[Point], weights: &[f64]) -> Result<Fit, CannotFit> {
    let total = checked(reference, deformed, weights)?;
    let (mut m, mut b) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    for ((r, d), w) in reference.iter().zip(deformed).zip(weights) {
        for i in 0..2 {
            for k in 0..2 {
                m[i][k] += w * r[i] * r[k];
                b[i][k] += w * d[i] * r[k];
            }
        }
    }
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let round = (0.5 * (m[0][0] + m[1][1])).powi(2);
    determined(determinant, round, weights)?;
    let entry =
        |i: usize, k: usize| (b[i][k] * m[1 - k][1 - k] - b[i][1 - k] * m[1 - k][k]) / determinant;
    let transform =
        LinearTransform::from_slice(&[entry(0, 0), entry(0, 1), entry(1, 0), entry(1, 1)]);
    let left = |(r, d): (&Point, &Point)| {
        let t = transform.apply(*r);
        (t[0] - d[0]).hypot(t[1] - d[1])
    };
    let (mut sum, mut max_mm) = (0.0, 0.0_f64);
    for (points, w) in reference.iter().zip(deformed).zip(weights) {
        let distance = left(points);
        sum += w * distance * distance;
        max_mm = max_mm.max(distance);
    }
    Ok(Fit {
        transform,
        rms_mm: (sum / total).sqrt(),
        max_mm,
    })
}

/// The rigid frame that takes reference points nearest to deformed ones in the sense of least squares (Procrustes in the
/// plane): with the means taken off, its turn is atan2(sum w r x d, sum w r . d).
///
/// # Errors
/// As [`fit`]; points whose turn is not determined.
pub fn frame_of(
    reference: &[Point],
    deformed: &[Point],
    weights: &[f64],
) -> Result<Frame, CannotFit> {
    let total = checked(reference, deformed, weights)?;
    let mean = |points: &[Point]| {
        [0, 1].map(|i| {
            let sum: f64 = points.iter().zip(weights).map(|(p, w)| w * p[i]).sum();
            sum / total
        })
    };
    let (r0, d0) = (mean(reference), mean(deformed));
    let (mut cross, mut dot, mut squares) = (0.0, 0.0, [0.0; 2]);
    for ((r, d), w) in reference.iter().zip(deformed).zip(weights) {
        let (r, d) = ([r[0] - r0[0], r[1] - r0[1]], [d[0] - d0[0], d[1] - d0[1]]);
        cross += w * (r[0] * d[1] - r[1] * d[0]);
        dot += w * (r[0] * d[0] + r[1] * d[1]);
        squares[0] += w * (r[0] * r[0] + r[1] * r[1]);
        squares[1] += w * (d[0] * d[0] + d[1] * d[1]);
    }
    determined(cross * cross + dot * dot, squares[0] * squares[1], weights)?;
    let turned = Frame {
        origin_mm: d0,
        turn_rad: cross.atan2(dot),
    };
    Ok(Frame {
        origin_mm: turned.place([-r0[0], -r0[1]]),
        ..turned
    })
}

/// The sum of the weights.
fn checked(reference: &[Point], deformed: &[Point], weights: &[f64]) -> Result<f64, CannotFit> {
    if deformed.len() != reference.len() || weights.len() != reference.len() {
        return Err(CannotFit::Counts {
            reference: reference.len(),
            deformed: deformed.len(),
            weights: weights.len(),
        });
    }
    for (index, ((r, d), w)) in reference.iter().zip(deformed).zip(weights).enumerate() {
        let finite = r.iter().chain(d).all(|x| x.is_finite()) && w.is_finite();
        if !finite || *w < 0.0 {
            return Err(CannotFit::NotFinite { index });
        }
    }
    Ok(weights.iter().sum())
}

fn determined(value: f64, scale: f64, weights: &[f64]) -> Result<(), CannotFit> {
    let determinant = if scale > 0.0 { value / scale } else { 0.0 };
    if determinant > LEAST_DETERMINANT {
        return Ok(());
    }
    Err(CannotFit::Undetermined {
        points: weights.iter().filter(|w| **w > 0.0).count(),
        determinant,
    })
}

#[cfg(test)]
mod tests {
    use super::super::edge;
    use super::*;

    const UNIT: [f64; 2] = [80.0, 60.0];

    #[test]
    fn a_transformed_edge_gives_its_transformation() {
        let transform = LinearTransform::from_slice(&[1.08, -0.13, 0.06, 0.94]);
        let reference = edge::points(UNIT[0], UNIT[1]);
        let deformed = reference.map(|p| transform.apply(p));
        let found = fit(&reference, &deformed, &edge::WEIGHTS).unwrap();
        assert!(found.transform.node_distance_mm(&transform, UNIT) < 1e-12);
        assert!(found.max_mm < 1e-12);
        // A bulge that is even along the edge lengthens the unit by its mean and is left over but for that.
        let bulged = std::array::from_fn::<_, { edge::POINTS }, _>(|i| {
            [deformed[i][0] + edge::PLACES[i].powi(2), deformed[i][1]]
        });
        let found = fit(&reference, &bulged, &edge::WEIGHTS).unwrap();
        let longer = (found.transform.x_scl - transform.x_scl) * UNIT[0];
        assert!((longer - 1.0 / 3.0).abs() < 1e-12);
        assert!((found.rms_mm - (4.0_f64 / 45.0).sqrt()).abs() < 1e-12);
        assert!((found.max_mm - 2.0 / 3.0).abs() < 1e-12);
    }

    /// The frame that the cascade gives the next unit is the one that fits its left edge best, whatever shape the edge has.
    #[test]
    fn the_cascade_has_the_frames_of_the_edges() {
        let deformed = |y: f64| {
            [
                81.0 + 0.02 * y - 3e-4 * y * y,
                0.5 + 1.03 * y + 1e-5 * y.powi(3),
            ]
        };
        let right = edge::points(UNIT[0], UNIT[1]).map(|p| deformed(p[1]));
        let found = fit(&edge::points(UNIT[0], UNIT[1]), &right, &edge::WEIGHTS).unwrap();
        let here = Frame {
            origin_mm: [3.0, -4.0],
            turn_rad: 0.4,
        };
        let next = here.next(&found.transform, UNIT);
        let left = edge::points(0.0, UNIT[1]);
        let frame = frame_of(&left, &right.map(|p| here.place(p)), &edge::WEIGHTS).unwrap();
        assert!((next.turn_rad - frame.turn_rad).abs() < 1e-14);
        for i in 0..2 {
            assert!((next.origin_mm[i] - frame.origin_mm[i]).abs() < 1e-12);
        }
    }

    #[test]
    fn a_rigid_motion_is_found() {
        let frame = Frame {
            origin_mm: [7.0, -2.0],
            turn_rad: -2.8,
        };
        let reference = [[1.0, 2.0], [4.0, 2.0], [3.0, 9.0]];
        let found = frame_of(
            &reference,
            &reference.map(|p| frame.place(p)),
            &[1.0, 2.0, 0.5],
        );
        let found = found.unwrap();
        assert!((found.turn_rad - frame.turn_rad).abs() < 1e-14);
        assert!((found.origin_mm[0] - 7.0).abs() < 1e-13);
    }

    #[test]
    fn what_does_not_determine_a_fit_is_an_error() {
        let p = [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]];
        let w = [1.0; 3];
        let undetermined = |e: CannotFit| matches!(e, CannotFit::Undetermined { points: 3, .. });
        assert!(undetermined(fit(&p, &p, &w).unwrap_err()));
        assert!(undetermined(frame_of(&[[1.0; 2]; 3], &p, &w).unwrap_err()));
        assert_eq!(
            fit(&p, &p[..2], &w).unwrap_err(),
            CannotFit::Counts {
                reference: 3,
                deformed: 2,
                weights: 3
            }
        );
        let broken = [[1.0, 1.0], [2.0, f64::NAN], [0.0, 1.0]];
        assert_eq!(
            fit(&p, &broken, &w).unwrap_err(),
            CannotFit::NotFinite { index: 1 }
        );
        assert!(fit(&[], &[], &[]).is_err() && frame_of(&[], &[], &[]).is_err());
    }
}

//! How the optima of a step stand to each other: how far apart they are, and which are the same within their errors.

use crate::study::{Study, StudyError};

/// Two designs may be the same optimum if no variable differs by more than this share of its range: restarts end where little is
/// left to gain, which is some way from the optimum along its flat directions.
pub const NEAR: f64 = 0.05;

/// A design that may be an optimum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimum<'a> {
    /// Design variables.
    pub x: &'a [f64],
    /// Objective.
    pub objective: f64,
    /// Half the width of its error band, where it is known.
    pub half_width: Option<f64>,
}

/// How an optimum stands to the others of a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Largest difference of a variable from the first of the list over its range; infinite where they have different variables.
    pub distance: f64,
    /// The first one before it that is the same within its error: no farther than [`NEAR`], and the bands of both objectives
    /// meet. `None` too where a band is not known.
    pub same_as: Option<usize>,
}

/// The standings of optima of a step, the best first.
///
/// # Errors
/// Where the study has no such step.
pub fn standings(
    study: &Study,
    step: usize,
    optima: &[Optimum<'_>],
) -> Result<Vec<Standing>, StudyError> {
    let mut standings = Vec::with_capacity(optima.len());
    for (k, own) in optima.iter().enumerate() {
        let mut same_as = None;
        for (i, other) in optima[..k].iter().enumerate() {
            let is_near = study.scaled_distance(step, own.x, other.x)? <= NEAR;
            if same_as.is_none() && is_near && bands_meet(own, other) {
                same_as = Some(i);
            }
        }
        standings.push(Standing {
            distance: study.scaled_distance(step, own.x, optima[0].x)?,
            same_as,
        });
    }
    Ok(standings)
}

fn bands_meet(a: &Optimum<'_>, b: &Optimum<'_>) -> bool {
    let widths = a.half_width.zip(b.half_width);
    widths.is_some_and(|(of_a, of_b)| (a.objective - b.objective).abs() <= of_a + of_b)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::study::read_study;

    #[test]
    fn the_same_within_its_error_is_near_and_tells_no_difference() {
        let study = read_study(
            &json!({
                "name": "two-variables",
                "step": [{
                    "id": "solve", "level": 1,
                    "model": {"kind": "command", "argv": ["true"], "time_limit_s": 1, "gradient": false},
                    "variables": {"lower": [0, 0], "upper": [1, 100]},
                    "constraints": {"inequalities": 0, "equalities": 0},
                    "optimiser": {"method": "mmfd", "gradient": "differences"},
                    "restarts": {"start": "given", "points": [[0, 0]]},
                }],
            }),
            true,
        )
        .unwrap_or_else(|faults| panic!("{faults}"));
        let optimum = |x: &'static [f64], objective, half_width| Optimum {
            x,
            objective,
            half_width,
        };
        let optima = [
            optimum(&[0.5, 50.0], -10.0, Some(0.2)),
            optimum(&[0.5, 54.0], -9.7, Some(0.2)),
            optimum(&[0.5, 54.0], -9.7, None),
            optimum(&[0.5, 60.0], -9.9, Some(0.2)),
            optimum(&[0.5, 46.0], -9.5, Some(0.2)),
        ];
        let found = standings(&study, 0, &optima).expect("a step");
        let same: Vec<_> = found.iter().map(|s| s.same_as).collect();
        assert_eq!(same, [None, Some(0), None, None, None]);
        assert!((found[3].distance - 0.1).abs() < 1e-12);
    }
}

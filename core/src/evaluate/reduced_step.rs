//! One evaluation of a step of the reduced model: the area that the end of a unit encloses, and its gradient.

use crate::reduced::{area, rod_area, tip_path};
use crate::scene::{Measure, Orientation};
use crate::study::spec::Model;
use crate::study::takes::strains_of;
use crate::study::{
    EvaluationReport, EvaluationRequest, Outcome, OutcomeStatus, StateReport, Study, StudyError,
};

/// Evaluates a step whose model is a transformation, or the strains, of a unit per actuation.
pub fn evaluate_reduced(study: &Study, request: &EvaluationRequest) -> Result<Outcome, StudyError> {
    let step = request.step;
    let s = study.step(step)?;
    let (Some(body), Some((model, parts)), Some(target)) =
        (&study.body, s.model.reduced(), &s.target)
    else {
        return Err(StudyError::NoChambers { step });
    };
    let Measure::EnclosedArea { probe, .. } = &target.goal.measure else {
        return Err(StudyError::NoChambers { step });
    };
    let expected = parts * model.actuations;
    if request.x.len() != expected {
        return Err(StudyError::Length {
            step,
            expected,
            found: request.x.len(),
        });
    }
    let unit_mm = body.actuator.unit_mm;
    // Units beyond the tip follow it and change nothing.
    let units = (probe[0] / unit_mm[0]).round() as usize;
    let transforms = study.transforms_of(step, &request.x)?;
    let (value, gradient, path) = if let Model::ConstantStrain(_) = s.model {
        let (value, gradient, path) = rod_area(&strains_of(&request.x, unit_mm[0]), unit_mm, units);
        // The variable is the turn of a unit, which is its curvature times its width.
        let by_variable =
            |[curvature, extension, shear]: &[f64; 3]| [curvature / unit_mm[0], *extension, *shear];
        (value, gradient.iter().flat_map(by_variable).collect(), path)
    } else {
        let (value, gradient) = area(&transforms, unit_mm, units);
        let gradient: Vec<f64> = gradient.into_iter().flatten().collect();
        (value, gradient, tip_path(&transforms, unit_mm, units))
    };
    let sense = request.orientation.unwrap_or(Orientation::of_area(value));
    let sign = match sense {
        Orientation::CounterClockwise => -1.0,
        Orientation::Clockwise => 1.0,
    };
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    outcome.objective = Some(sign * value);
    if request.want_gradient {
        outcome.gradient = Some(gradient.iter().map(|g| sign * g).collect());
        outcome.constraint_gradients = Some(Vec::new());
    }
    let rest = path[0];
    outcome.report = Some(EvaluationReport {
        enclosed_area_mm2: Some(value),
        measures: vec![value],
        path: path
            .iter()
            .map(|p| StateReport {
                tip_mm: [p[0] - rest[0], p[1] - rest[1]],
                max_stretch: 1.0,
                ..StateReport::default()
            })
            .collect(),
        max_stretch: 1.0,
        transforms,
        left_out: vec!["finite elements: the model is of the pose of a unit's edge".to_owned()],
        ..EvaluationReport::default()
    });
    Ok(outcome)
}

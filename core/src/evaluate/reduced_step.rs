//! One evaluation of a step of the reduced model: the area that the end of a unit encloses, and its gradient.

use crate::reduced::{area, tip_path};
use crate::scene::{Measure, Orientation};
use crate::study::spec::Model;
use crate::study::{
    EvaluationReport, EvaluationRequest, Outcome, OutcomeStatus, StateReport, Study, StudyError,
};

/// Evaluates a step whose model is a transformation per actuation.
pub fn evaluate_reduced(study: &Study, request: &EvaluationRequest) -> Result<Outcome, StudyError> {
    let step = request.step;
    let s = study.step(step)?;
    let (Some(body), Model::LinearTransform(model), Some(target)) =
        (&study.body, &s.model, &s.target)
    else {
        return Err(StudyError::NoChambers { step });
    };
    let Measure::EnclosedArea { probe, .. } = &target.goal.measure else {
        return Err(StudyError::NoChambers { step });
    };
    let expected = 4 * model.actuations;
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
    let (value, gradient) = area(&transforms, unit_mm, units);
    let sense = request.orientation.unwrap_or(Orientation::of_area(value));
    let sign = match sense {
        Orientation::CounterClockwise => -1.0,
        Orientation::Clockwise => 1.0,
    };
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    outcome.objective = Some(sign * value);
    if request.want_gradient {
        outcome.gradient = Some(gradient.iter().flatten().map(|g| sign * g).collect());
        outcome.constraint_gradients = Some(Vec::new());
    }
    let path = tip_path(&transforms, unit_mm, units);
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
        left_out: vec!["finite elements: the model is a transformation of a unit".to_owned()],
        ..EvaluationReport::default()
    });
    Ok(outcome)
}

//! One evaluation of a step that chooses a chamber layout: one unit under the schedule, its transformations at the loaded rows,
//! and how near they come to those that are asked for.

use super::answer::SceneStatus;
use super::chain_states::solve_chain;
use crate::actuation::ActuationCycle;
use crate::equilibrium::Observer;
use crate::geometry::cascade;
use crate::reduced::{LinearTransform, area};
use crate::scene::{ActuatorBody, Body, Scene};
use crate::study::spec::{FeLayoutsModel, LayoutScore, Model, StudyBody};
use crate::study::{
    EvaluationReport, EvaluationRequest, Outcome, OutcomeStatus, StateReport, Study, StudyError,
};

/// Evaluates a step that offers several layouts.
pub fn evaluate_layout(
    study: &Study,
    request: &EvaluationRequest,
    observer: &mut dyn Observer,
) -> Result<Outcome, StudyError> {
    let step = request.step;
    let s = study.step(step)?;
    let (Some(body), Model::FeLayouts(model)) = (&study.body, &s.model) else {
        return Err(StudyError::NoChambers { step });
    };
    let asked = if s.given.behaviour.is_empty() {
        &model.behaviour
    } else {
        &s.given.behaviour
    };
    let infeasible =
        |reason: String| Outcome::without_values(OutcomeStatus::InfeasibleGeometry { reason });
    let Some(scene) = scene(body, model, &request.x) else {
        return Ok(infeasible("the layout has no such chambers".to_owned()));
    };
    let chain = match solve_chain(&scene, 1, true, observer) {
        Ok(chain) => chain,
        Err(faults) => return Ok(infeasible(faults.to_string())),
    };
    let load_fraction = chain.end.load_fraction_reached;
    let reason = chain.end.reason.clone().unwrap_or_default();
    let status = match chain.end.status {
        SceneStatus::Ok => OutcomeStatus::Ok,
        SceneStatus::InfeasibleGeometry => OutcomeStatus::InfeasibleGeometry { reason },
        SceneStatus::NoEquilibrium => OutcomeStatus::NoEquilibrium {
            kind: "limit".to_owned(),
            load_fraction,
        },
        SceneStatus::NotConverged if observer.cancelled() => OutcomeStatus::Cancelled,
        SceneStatus::NotConverged => OutcomeStatus::NotConverged {
            reason,
            load_fraction,
        },
    };
    let mut outcome = Outcome::without_values(status);
    if outcome.status != OutcomeStatus::Ok {
        return Ok(outcome);
    }
    let fitted = match chain.fit_unit(1) {
        Ok(fitted) => fitted,
        Err(reason) => return Ok(infeasible(reason.to_string())),
    };
    let reached: Vec<LinearTransform> = fitted
        .states
        .iter()
        .filter(|s| s.point.leg < loaded_rows(&body.actuation) && s.point.fraction == 1.0)
        .map(|s| s.fit.transform)
        .collect();
    let limit = body.material.stretch_limit();
    // Of all units, which is what the forward pass asked for.
    let units = study.body.as_ref().map_or(1, |body| body.actuator.units);
    outcome.objective = Some(match model.score {
        LayoutScore::Area => missing_area(&reached, asked, body.actuator.unit_mm, units),
        LayoutScore::Distance => mismatch(&reached, asked),
    });
    outcome.constraints = vec![limit.map_or(-1.0, |limit| chain.end.max_stretch / limit - 1.0)];
    let moved = chain.tip_path(1);
    let path = moved
        .iter()
        .zip(&chain.points)
        .map(|(p, point)| StateReport {
            pressure_kpa: point.pressure_kpa.clone(),
            tip_mm: [p[0] - moved[0][0], p[1] - moved[0][1]],
            max_stretch: 1.0,
        });
    outcome.report = Some(EvaluationReport {
        path: path.collect(),
        max_stretch: chain.end.max_stretch,
        transforms: reached,
        dofs: chain.end.dofs,
        left_out: vec!["derivatives: the layout is a discrete choice".to_owned()],
        ..EvaluationReport::default()
    });
    Ok(outcome)
}

/// Rows of the schedule between its first and its last, where that is rest.
fn loaded_rows(actuation: &ActuationCycle) -> usize {
    let rest = actuation
        .rows_kpa
        .last()
        .is_some_and(|row| row.iter().all(|p| *p == 0.0));
    actuation.legs() - usize::from(rest)
}

/// The unit of a design in its scene; `None` where its layout has other chambers.
fn scene(body: &StudyBody, model: &FeLayoutsModel, x: &[f64]) -> Option<Scene> {
    let (layout, shares) = model.at(x);
    let actuator = body.actuator.with_layout(layout);
    let corners = actuator.shares(shares);
    let units = actuator.boxes().units(&corners)?;
    let chain = cascade(units.first()?, actuator.unit_mm, 1);
    Some(Scene {
        body: Body::Actuator(ActuatorBody {
            materials: body.material.laws(1),
            actuator: chain,
        }),
        actuation: layout.schedule(&body.actuation),
        mesh: model.fe.mesh(),
        contact: model.fe.contact,
        contact_activation_mm: model.fe.contact_activation_mm,
        obstacles: Vec::new(),
        relative_residual_force_tolerance: model.fe.relative_residual_force_tolerance,
        probes: Vec::new(),
        objective: None,
    })
}

/// What is missing of the area that the asked transformations enclose, in shares of it; below 0 where there is more. Its sense does not
/// matter: the unit may be mounted upside down. Where nothing is enclosed by what is asked, the distance of the entries.
fn missing_area(
    reached: &[LinearTransform],
    asked: &[LinearTransform],
    unit_mm: [f64; 2],
    units: usize,
) -> f64 {
    let (of_asked, _) = area(asked, unit_mm, units);
    let (of_reached, _) = area(reached, unit_mm, units);
    if of_asked == 0.0 {
        return mismatch(reached, asked);
    }
    1.0 - (of_reached / of_asked).abs()
}

/// How far transformations are from those that are asked for, over how far these are from rest (root of summed squares of the
/// entries). Upside down counts as well: the unit may be mounted so. What is asked beyond the loaded rows is missed altogether.
fn mismatch(reached: &[LinearTransform], asked: &[LinearTransform]) -> f64 {
    let rest = LinearTransform::IDENTITY;
    let squares = |a: &LinearTransform, b: &LinearTransform| {
        let pairs = a.entries().into_iter().zip(b.entries());
        pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>()
    };
    let mirrored = |t: &LinearTransform| LinearTransform {
        x_sh: -t.x_sh,
        y_sh: -t.y_sh,
        ..*t
    };
    let scale: f64 = asked.iter().map(|t| squares(t, &rest)).sum();
    let missed = |turned: bool| {
        let mut sum = 0.0;
        for (k, asked) in asked.iter().enumerate() {
            let reached = reached.get(k).copied().unwrap_or(rest);
            let reached = if turned { mirrored(&reached) } else { reached };
            sum += squares(&reached, asked);
        }
        sum
    };
    let least = missed(false).min(missed(true));
    if scale > 0.0 {
        (least / scale).sqrt()
    } else {
        least.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_of_what_is_reached_is_held_against_that_of_what_is_asked() {
        let t = |e: [f64; 4]| LinearTransform::from_slice(&e);
        let unit = [80.0, 80.0];
        let asked = [t([1.05, 0.03, 0.02, 1.0]), t([1.1, -0.05, 0.04, 0.98])];
        let missing = |reached: &[LinearTransform]| missing_area(reached, &asked, unit, 9);
        assert_eq!(missing(&asked), 0.0);
        // Upside down and backwards it encloses as much; one actuation and rest enclose nothing.
        let turned = asked.map(|t| LinearTransform {
            x_sh: -t.x_sh,
            y_sh: -t.y_sh,
            ..t
        });
        assert!(missing(&turned).abs() < 1e-12);
        assert!(missing(&[asked[1], asked[0]]).abs() < 1e-12);
        assert_eq!(missing(&asked[..1]), 1.0);
        assert_eq!(missing(&[]), 1.0);
        assert_eq!(
            missing_area(&asked, &asked[..1], unit, 9),
            mismatch(&asked, &asked[..1])
        );
    }

    #[test]
    fn what_is_reached_is_held_against_what_is_asked() {
        let t = |e: [f64; 4]| LinearTransform::from_slice(&e);
        let asked = [t([1.1, 0.2, 0.1, 1.0]), t([1.2, 0.0, 0.0, 1.0])];
        assert_eq!(mismatch(&asked, &asked), 0.0);
        // A unit mounted upside down does the same.
        let turned = [t([1.1, -0.2, -0.1, 1.0]), asked[1]];
        assert_eq!(mismatch(&turned, &asked), 0.0);
        // One that does not move misses all of it, also where it has fewer rows.
        assert_eq!(mismatch(&[LinearTransform::IDENTITY; 2], &asked), 1.0);
        assert_eq!(mismatch(&[], &asked), 1.0);
        let half = [t([1.05, 0.1, 0.05, 1.0]), t([1.1, 0.0, 0.0, 1.0])];
        assert!((mismatch(&half, &asked) - 0.5).abs() < 1e-14);
    }
}

//! One evaluation of a study: design variables in, objective, constraints and their gradients out.

use super::analysis::{Analysis, Wanted, analyse};
use super::scene::{combine_gradient, mesh_actuator, objective_value, overlap_report};
use crate::adjoint::NodeGradient;
use crate::equilibrium::{NotConverged, Observer, PathEnd, Settings};
use crate::mesh::{MappedMesh, locate};
use crate::objective::enclosed_area;
use crate::objective::probe::ProbePoint;
use crate::scene::{Body, Orientation, Scene, SceneObjective};
use crate::study::spec::{Model, StepConstraints};
use crate::study::{
    EvaluationReport, EvaluationRequest, Outcome, OutcomeStatus, StateReport, Study, StudyError,
};

/// Evaluates a finite-element step at a design. The caller, who has a clock, fills in the seconds.
pub fn evaluate(
    study: &Study,
    request: &EvaluationRequest,
    observer: &mut dyn Observer,
) -> Outcome {
    match attempt(study, request, observer) {
        Ok(outcome) => outcome,
        Err(reason) => Outcome::without_values(OutcomeStatus::InvalidResult {
            reason: reason.to_string(),
        }),
    }
}

/// What the limits of a step ask of an analysis.
struct StretchRow {
    limit: f64,
    radius: f64,
}

fn stretch_row(study: &Study, step: usize) -> Result<Option<StretchRow>, StudyError> {
    let (Some(body), StepConstraints::Chambers(constraints)) =
        (&study.body, &study.step(step)?.constraints)
    else {
        return Ok(None);
    };
    Ok(body.stretch_limit(constraints).map(|limit| StretchRow {
        limit,
        radius: constraints.stretch_length_mm,
    }))
}

/// The row (least - gap) / scale per chamber: the wall thickness makes it of order one.
struct GapRow {
    least: f64,
    scale: f64,
}

fn gap_row(study: &Study, step: usize) -> Result<Option<GapRow>, StudyError> {
    let StepConstraints::Chambers(constraints) = &study.step(step)?.constraints else {
        return Ok(None);
    };
    Ok(constraints.wall_gap.least_mm().map(|least| GapRow {
        least,
        scale: constraints.wall_mm,
    }))
}

fn attempt(
    study: &Study,
    request: &EvaluationRequest,
    observer: &mut dyn Observer,
) -> Result<Outcome, StudyError> {
    let step = request.step;
    if !matches!(study.step(step)?.model, Model::FeCascade(_)) {
        return Err(StudyError::NoChambers { step });
    }
    let mut scene = study.scene(step, &request.x, request.orientation)?;
    let plan = match &request.plan_base {
        Some(base) => study.mesh_plan(step, base)?,
        None => None,
    };
    let Body::Actuator(chain) = &scene.body else {
        return Err(StudyError::NoChambers { step });
    };
    let infeasible = |reason: String| {
        Ok(Outcome::without_values(OutcomeStatus::InfeasibleGeometry {
            reason,
        }))
    };
    let mesh = match mesh_actuator(
        &chain.actuator,
        plan.as_ref(),
        scene.mesh.element,
        scene.mesh.max_size_mm,
    ) {
        Ok(mesh) => mesh,
        Err(reason) => return infeasible(reason.to_string()),
    };
    let body = mesh.discretisation.clone();
    let Some(place) = scene
        .probes
        .first()
        .and_then(|p| locate(&body.mesh, p.at_mm))
    else {
        return infeasible("the tip lies in a chamber".to_owned());
    };
    let probe = ProbePoint::new(&body.mesh, place.block, place.element, place.local);
    let stretch = stretch_row(study, step)?;
    let gap_row = gap_row(study, step)?;
    let wanted = Wanted {
        probe_gradient: request.want_gradient.then_some(0),
        stretch_radius: stretch.as_ref().map(|s| s.radius),
        wall_gaps: gap_row.is_some(),
        limit_gradients: request.want_gradient,
        walls: true,
        gaps: false,
        fields: false,
    };
    let settings = Settings {
        tolerance: scene.relative_residual_force_tolerance,
        ..Settings::default()
    };
    let analysis = match analyse(
        body,
        &chain.materials,
        &scene.actuation,
        &[probe],
        &settings,
        &wanted,
        observer,
    ) {
        Ok(analysis) => analysis,
        Err(reason) => return infeasible(reason.to_string()),
    };
    let report = report(&scene, &analysis);
    let mut outcome = Outcome::without_values(status(&analysis));
    if outcome.status == OutcomeStatus::Ok {
        // Either sense counts and the request leaves it open: the better one, of objective -|A|.
        if let (None, Some(area), Some(target)) = (
            request.orientation,
            report.enclosed_area_mm2,
            &study.step(step)?.target,
        ) && target.counts_either_sense()
        {
            scene = study.scene(step, &request.x, Some(Orientation::of_area(area)))?;
        }
        fill(
            study,
            request,
            &scene,
            &mesh,
            &analysis,
            stretch.as_ref(),
            gap_row.as_ref(),
            &mut outcome,
        )?;
    }
    outcome.report = Some(report);
    Ok(outcome)
}

fn status(analysis: &Analysis) -> OutcomeStatus {
    let load_fraction = analysis.reached;
    match &analysis.end {
        PathEnd::Complete => OutcomeStatus::Ok,
        PathEnd::NoEquilibrium(limit) => OutcomeStatus::NoEquilibrium {
            kind: serde_json::to_value(limit.kind)
                .ok()
                .and_then(|v| v.as_str().map(str::to_owned))
                .unwrap_or_default(),
            load_fraction,
        },
        PathEnd::NotConverged(NotConverged::Cancelled) => OutcomeStatus::Cancelled,
        PathEnd::NotConverged(NotConverged::WorkLimit { .. }) => OutcomeStatus::WorkLimit,
        PathEnd::NotConverged(why) => OutcomeStatus::NotConverged {
            reason: why.to_string(),
            load_fraction,
        },
    }
}

/// Objective, constraints (geometric rows, a stretch row per chamber corner, a gap row per chamber) and gradients of a complete path.
fn fill(
    study: &Study,
    request: &EvaluationRequest,
    scene: &Scene,
    mesh: &MappedMesh,
    analysis: &Analysis,
    stretch: Option<&StretchRow>,
    gap: Option<&GapRow>,
    outcome: &mut Outcome,
) -> Result<(), StudyError> {
    let (step, x) = (request.step, &request.x);
    let Some(objective) = &scene.objective else {
        return Err(StudyError::NoChambers { step });
    };
    outcome.objective = Some(objective_value(objective, &analysis.states, 0));
    let (mut values, mut gradients) = study.geometry_rows(step, x)?;
    if let Some(row) = stretch {
        values.extend(analysis.stretch.iter().map(|(v, _)| v / row.limit - 1.0));
    }
    if let Some(row) = gap {
        let gaps = analysis.wall_gap.iter();
        values.extend(gaps.map(|(gap, _)| (row.least - gap) / row.scale));
    }
    outcome.constraints = values;
    if !request.want_gradient {
        return Ok(());
    }
    let to_design =
        |nodes: &NodeGradient| study.design_gradient(step, x, &corner_gradient(mesh, nodes));
    if let Some(nodes) = combine_gradient(objective, &analysis.states, 0, &analysis.probe_gradient)
    {
        outcome.gradient = Some(to_design(&nodes)?);
    }
    if let Some(row) = stretch {
        for nodes in analysis.stretch.iter().filter_map(|(_, d)| d.as_ref()) {
            let gradient = to_design(nodes)?;
            gradients.push(gradient.into_iter().map(|g| g / row.limit).collect());
        }
    }
    if let Some(row) = gap {
        for nodes in analysis.wall_gap.iter().filter_map(|(_, d)| d.as_ref()) {
            let gradient = to_design(nodes)?;
            gradients.push(gradient.into_iter().map(|g| -g / row.scale).collect());
        }
    }
    outcome.constraint_gradients = Some(gradients);
    Ok(())
}

/// Derivative with respect to the corners of the repeated unit, from that with respect to nodes.
fn corner_gradient(mesh: &MappedMesh, nodes: &NodeGradient) -> Vec<f64> {
    let units = mesh.pull_back(nodes);
    let mut sum: Vec<f64> = Vec::new();
    for unit in &units {
        let flat = unit.iter().flatten().flatten();
        if sum.is_empty() {
            sum = flat.copied().collect();
        } else {
            sum.iter_mut().zip(flat).for_each(|(s, g)| *s += g);
        }
    }
    sum
}

fn report(scene: &Scene, analysis: &Analysis) -> EvaluationReport {
    let tips: Vec<[f64; 2]> = analysis.states.iter().map(|s| s.displacement[0]).collect();
    let area = matches!(scene.objective, Some(SceneObjective::EnclosedArea { .. }))
        && analysis.end == PathEnd::Complete;
    EvaluationReport {
        enclosed_area_mm2: area.then(|| enclosed_area::area(&tips)),
        path: analysis
            .states
            .iter()
            .map(|s| StateReport {
                pressure_kpa: s.point.pressure_kpa.clone(),
                tip_mm: s.displacement[0],
                max_stretch: s.max_stretch,
            })
            .collect(),
        walls_overlap: overlap_report(&analysis.states),
        max_stretch: analysis
            .states
            .iter()
            .fold(1.0, |m, s| m.max(s.max_stretch)),
        negative_pivots: analysis
            .states
            .iter()
            .map(|s| s.negative_pivots)
            .max()
            .unwrap_or(0),
        elements: analysis
            .system
            .body
            .mesh
            .blocks
            .iter()
            .map(crate::mesh::ElementBlock::len)
            .sum(),
        dofs: analysis.system.dofs.free(),
        newton_iterations: analysis.work.newton_iterations,
        factorisations: analysis.work.factorisations,
        left_out: vec!["self-contact: not available yet".to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equilibrium::Unobserved;
    use crate::study::{begin, read_study};

    #[test]
    fn a_sweep_counts_the_better_sense_of_one_analysis() {
        let document = serde_json::json!({
            "name": "sweep",
            "material": "mold-star-30",
            "actuator": {"units": 1},
            "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
            "step": [{
                "id": "sweep",
                "target": {"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "either"},
                "model": {"kind": "fe_cascade", "element": "quad4", "max_size_mm": 20},
                "variables": {"parametrisation": "rectangle"},
                "optimiser": {"method": "sweep", "points": [[30, 20]]},
            }],
        });
        let study = read_study(&document, false).unwrap();
        let (_, asks) = begin(&study, &study.restarts(0).unwrap()[0]).unwrap();
        let [open] = &asks[..] else {
            panic!("{} points", asks.len())
        };
        assert_eq!(open.orientation, None);
        let objective = |orientation| {
            let request = EvaluationRequest {
                orientation,
                ..open.clone()
            };
            let outcome = evaluate(&study, &request, &mut Unobserved);
            assert_eq!(outcome.status, OutcomeStatus::Ok);
            (outcome.objective.unwrap(), outcome.sense())
        };
        let (either, sense) = objective(None);
        let (one, _) = objective(Some(Orientation::CounterClockwise));
        let (other, _) = objective(Some(Orientation::Clockwise));
        assert!(either < 0.0 && one == -other);
        assert_eq!(either.to_bits(), one.min(other).to_bits());
        assert_eq!(objective(sense).0.to_bits(), either.to_bits());
    }
}

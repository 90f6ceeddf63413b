//! One evaluation of a study: design variables in, objective, constraints and their gradients out.

use std::borrow::Cow;

use super::analysis::{Analysis, Wanted, analyse};
use super::contact::contact_of_study;
use super::layout_step::evaluate_layout;
use super::limits::Extremum;
use super::measure::{PlacedProbe, by_place, tip_displacements};
use super::notes;
use super::reduced_step::evaluate_reduced;
use super::scene::{goal_gradient, mesh_actuator, overlap_report, placed_goal, probe_points};
use crate::adjoint::NodeGradient;
use crate::equilibrium::{LimitKind, NotConverged, Observer, PathEnd, Settings};
use crate::geometry::{Actuator, Layout, MeshPlan, design_gradient};
use crate::mesh::MappedMesh;
use crate::objective::enclosed_area;
use crate::scene::{Body, Bound, Goal, Measure, Orientation, Scene};
use crate::study::spec::{Model, StepConstraints};
use crate::study::{
    EvaluationReport, EvaluationRequest, LossReport, Outcome, OutcomeStatus, StateReport, Study,
    StudyError,
};

/// Evaluates a step at a design; programs are not ours to run. The caller, who has a clock, fills in the seconds.
pub fn evaluate(
    study: &Study,
    request: &EvaluationRequest,
    observer: &mut dyn Observer,
) -> Outcome {
    let study = &*study.given(request.step, &request.given);
    let outcome = match study.steps.get(request.step).map(|step| &step.model) {
        Some(Model::LinearTransform(_) | Model::ConstantStrain(_)) => {
            evaluate_reduced(study, request)
        }
        Some(Model::FeLayouts(_)) => evaluate_layout(study, request, observer),
        _ => attempt(study, request, observer),
    };
    match outcome {
        Ok(outcome) => outcome,
        Err(reason) => Outcome::without_values(OutcomeStatus::InvalidResult {
            reason: reason.to_string(),
        }),
    }
}

/// The bounds of a step with their probes as the analysis has them.
fn placed_bounds(
    study: &Study,
    step: usize,
    scene: &Scene,
) -> Result<Vec<Bound<PlacedProbe>>, StudyError> {
    let StepConstraints::Chambers(constraints) = &study.step(step)?.constraints else {
        return Err(StudyError::NoChambers { step });
    };
    let place = by_place(&scene.probes);
    constraints
        .bounds
        .iter()
        .map(|b| {
            Ok(Bound {
                measure: b
                    .measure
                    .map_probes(&place)
                    .ok_or(StudyError::NoChambers { step })?,
                at_least: b.at_least,
                at_most: b.at_most,
            })
        })
        .collect()
}

/// The limits of a step and their rows, all of order one: stretch / limit - 1 per chamber corner over the path, then at the
/// load margin, then (least gap - gap) / wall per chamber.
///
/// Where the load margin is not reached its rows are what is missing of it.
struct LimitRows {
    /// Limit of the stretch and radius of its averaging discs, mm.
    stretch: Option<(f64, f64)>,
    /// Load margin.
    margin: Option<f64>,
    /// Least gap and least wall, mm.
    gap: Option<(f64, f64)>,
    /// Whether a second equilibrium on the path is a failure.
    exclude_non_unique: bool,
    /// Bounds on measures, whose rows come last.
    bounds: Vec<Bound<PlacedProbe>>,
}

impl LimitRows {
    /// None at all.
    const OFF: Self = Self {
        stretch: None,
        margin: None,
        gap: None,
        exclude_non_unique: false,
        bounds: Vec::new(),
    };

    fn new(study: &Study, step: usize, scene: &Scene) -> Result<Self, StudyError> {
        let (Some(body), StepConstraints::Chambers(constraints)) =
            (&study.body, &study.step(step)?.constraints)
        else {
            return Err(StudyError::NoChambers { step });
        };
        let limit = body.stretch_limit(constraints);
        let gap = constraints.wall_gap_mm.number();
        Ok(Self {
            stretch: limit.map(|limit| (limit, constraints.stretch_length_mm)),
            margin: constraints.load_margin.number(),
            gap: gap.map(|least| (least, constraints.wall_mm)),
            exclude_non_unique: constraints.exclude_non_unique,
            bounds: placed_bounds(study, step, scene)?,
        })
    }

    /// Each row's value, its nodes' derivative and the factor of that.
    fn of<'a>(
        &self,
        analysis: &'a Analysis,
    ) -> impl Iterator<Item = (f64, Option<&'a NodeGradient>, f64)> {
        let stretch = self.stretch.map(|(limit, _)| {
            let row = move |(v, d): &'a Extremum| (v / limit - 1.0, d.as_ref(), 1.0 / limit);
            analysis.stretch.iter().map(row)
        });
        let margin = self.stretch.zip(self.margin).map(|((limit, _), margin)| {
            let row = move |(v, d): &'a Extremum| match &analysis.lost_margin {
                Some(lost) => (margin - lost.factor, analysis.limit_gradient.as_ref(), -1.0),
                None => (v / limit - 1.0, d.as_ref(), 1.0 / limit),
            };
            analysis.margin.iter().map(row)
        });
        let gap = self.gap.map(|(least, wall)| {
            let row = move |(v, d): &'a Extremum| ((least - v) / wall, d.as_ref(), -1.0 / wall);
            analysis.wall_gap.iter().map(row)
        });
        stretch
            .into_iter()
            .flatten()
            .chain(margin.into_iter().flatten())
            .chain(gap.into_iter().flatten())
    }
}

fn attempt(
    study: &Study,
    request: &EvaluationRequest,
    observer: &mut dyn Observer,
) -> Result<Outcome, StudyError> {
    let step = request.step;
    if study.step(step)?.model.finite_elements().is_none() {
        return Err(StudyError::NoChambers { step });
    }
    let states = request.fidelity.and_then(|f| f.load_steps_per_leg);
    let study = &*match states {
        Some(states) => study.with_load_steps(step, states),
        None => Cow::Borrowed(study),
    };
    let mut scene = study.scene(step, &request.x, request.orientation)?;
    let plan = plan(study, request)?;
    let Body::Actuator(chain) = &scene.body else {
        return Err(StudyError::NoChambers { step });
    };
    let infeasible = |reason: String| {
        Ok(Outcome::without_values(OutcomeStatus::InfeasibleGeometry {
            reason,
        }))
    };
    let mesh = match mesh_actuator(&chain.actuator, plan.as_ref(), &scene.mesh) {
        Ok(mesh) => mesh,
        Err(reason) => return infeasible(reason.to_string()),
    };
    let mut body = mesh.discretisation.clone();
    // Free units share the rows of the stretch with each other, as copies do.
    body.regions.fold(corners_per_unit(&chain.actuator));
    body.contact = contact_of_study(scene.contact, scene.contact_activation_mm);
    let Ok(probes) = probe_points(&scene, &body) else {
        return infeasible("the tip lies in a chamber".to_owned());
    };
    let limits = if request.second_mesh {
        LimitRows::OFF
    } else {
        LimitRows::new(study, step, &scene)?
    };
    let goal = placed_goal(&scene).ok_or(StudyError::NoChambers { step })?;
    let measures = [&goal.measure]
        .into_iter()
        .chain(limits.bounds.iter().map(|b| &b.measure));
    let gradients_of = if request.want_gradient {
        measures.cloned().collect()
    } else {
        Vec::new()
    };
    let wanted = Wanted {
        gradients_of,
        stretch_radius: limits.stretch.map(|(_, radius)| radius),
        wall_gaps: limits.gap.is_some(),
        limit_gradients: request.want_gradient,
        walls: !request.second_mesh,
        gaps: false,
        fields: false,
    };
    let settings = Settings {
        tolerance: scene.relative_residual_force_tolerance,
        load_margin: limits.margin,
        ..Settings::default()
    };
    let analysis = match analyse(
        body,
        &chain.materials,
        &scene.actuation,
        &probes,
        &settings,
        &wanted,
        observer,
    ) {
        Ok(analysis) => analysis,
        Err(reason) => return infeasible(reason.to_string()),
    };
    let mut report = report(&goal, &limits.bounds, &analysis);
    if let Some(body) = study.body_of(step)? {
        in_channels(&mut report, body.actuator.layout);
    }
    report.notes = notes::of_ranges(&scene.body, &chain.materials, &analysis.states);
    let mut outcome = Outcome::without_values(status(&analysis, &limits, request.want_gradient));
    if outcome.status == OutcomeStatus::Ok {
        // Either sense counts and the request leaves it open: the better one, of objective -|A|.
        if let (None, Some(area), Some(target)) = (
            request.orientation,
            report.enclosed_area_mm2,
            &study.step(step)?.target,
        ) && target.either_sense
        {
            scene = study.scene(step, &request.x, Some(Orientation::of_area(area)))?;
        }
        fill(
            study,
            request,
            &scene,
            &mesh,
            &analysis,
            &limits,
            &mut outcome,
        )?;
    }
    outcome.report = Some(report);
    Ok(outcome)
}

/// The mesh plan of a request; `None`: the design has its own, or none.
fn plan(study: &Study, request: &EvaluationRequest) -> Result<Option<MeshPlan>, StudyError> {
    let plan = match &request.plan_base {
        Some(base) => study.mesh_plan(request.step, base)?,
        None => None,
    };
    let share = request.fidelity.map(|fidelity| fidelity.mesh);
    if !request.second_mesh && share.is_none_or(|share| share == 1.0) {
        return Ok(plan);
    }
    // Where the base has no plan, the design has its own.
    let own = || study.mesh_plan(request.step, &request.x).transpose();
    let mut plan = plan.map(Ok).or_else(own).transpose()?;
    if let Some(share) = share {
        plan = plan.map(|plan| plan.with_share(share));
    }
    Ok(if request.second_mesh {
        plan.as_ref().map(MeshPlan::halved)
    } else {
        plan
    })
}

/// How an evaluation ended for a study with these limits.
fn status(analysis: &Analysis, limits: &LimitRows, want_gradient: bool) -> OutcomeStatus {
    if let Some(failure) = failure(&analysis.end, analysis.reached, "") {
        return failure;
    }
    if let (true, Some(loss)) = (limits.exclude_non_unique, &analysis.loss) {
        let legs = analysis.states.last().map_or(1, |s| s.point.leg + 1);
        return OutcomeStatus::NotUnique {
            load_fraction: (loss.leg as f64 + loss.fraction) / legs as f64,
        };
    }
    let (Some(lost), Some(margin)) = (&analysis.lost_margin, limits.margin) else {
        return OutcomeStatus::Ok;
    };
    match &lost.end {
        // At a limit point the missing margin is a row with a derivative.
        PathEnd::NoEquilibrium(limit)
            if limit.kind == LimitKind::LimitPoint
                && limits.stretch.is_some()
                && (!want_gradient || analysis.limit_gradient.is_some()) =>
        {
            OutcomeStatus::Ok
        }
        PathEnd::NoEquilibrium(limit) => OutcomeStatus::NoMargin {
            kind: limit.kind.name().to_owned(),
            factor: lost.factor,
            missing: margin - lost.factor,
        },
        end => failure(end, analysis.reached, "beyond the schedule: ").unwrap_or(OutcomeStatus::Ok),
    }
}

/// The status of a path that ended early.
fn failure(end: &PathEnd, load_fraction: f64, place: &str) -> Option<OutcomeStatus> {
    Some(match end {
        PathEnd::Complete => return None,
        PathEnd::NoEquilibrium(limit) => OutcomeStatus::NoEquilibrium {
            kind: limit.kind.name().to_owned(),
            load_fraction,
        },
        PathEnd::NotConverged(NotConverged::Cancelled) => OutcomeStatus::Cancelled,
        PathEnd::NotConverged(NotConverged::WorkLimit { .. }) => OutcomeStatus::WorkLimit,
        PathEnd::NotConverged(why) => OutcomeStatus::NotConverged {
            reason: format!("{place}{why}"),
            load_fraction,
        },
    })
}

/// Objective, constraints (geometric rows, then those of the limits, then those of the bounds) and gradients of a complete path.
fn fill(
    study: &Study,
    request: &EvaluationRequest,
    scene: &Scene,
    mesh: &MappedMesh,
    analysis: &Analysis,
    limits: &LimitRows,
    outcome: &mut Outcome,
) -> Result<(), StudyError> {
    let (step, x) = (request.step, &request.x);
    let states = &analysis.states;
    let goal = placed_goal(scene).ok_or(StudyError::NoChambers { step })?;
    outcome.objective = Some(goal.objective(goal.measure.value(states)).0);
    if request.second_mesh {
        return Ok(());
    }
    let (mut values, mut gradients) = if request.want_gradient {
        study.geometry_rows(step, x)?
    } else {
        (study.geometry_values(step, x)?, Vec::new())
    };
    values.extend(limits.of(analysis).map(|(value, ..)| value));
    let bound_rows = || {
        limits
            .bounds
            .iter()
            .flat_map(|b| b.values(b.measure.value(states)))
    };
    values.extend(bound_rows().map(|(value, _)| value));
    outcome.constraints = values;
    if !request.want_gradient {
        return Ok(());
    }
    let to_design =
        |nodes: &NodeGradient| study.design_gradient(step, x, &corner_gradient(mesh, nodes));
    if let Some(nodes) = goal_gradient(&goal, analysis) {
        outcome.gradient = Some(to_design(&nodes)?);
    }
    for (_, nodes, factor) in limits.of(analysis) {
        let Some(nodes) = nodes else { continue };
        let gradient = to_design(nodes)?;
        gradients.push(gradient.into_iter().map(|g| factor * g).collect());
    }
    for bound in &limits.bounds {
        let weights = bound.measure.weights(states);
        let Some(nodes) = analysis.sensitivities.combine(&weights) else {
            continue;
        };
        let gradient = to_design(&nodes)?;
        for (_, slope) in bound.values(0.0) {
            gradients.push(gradient.iter().map(|g| slope * g).collect());
        }
    }
    outcome.constraint_gradients = Some(gradients);
    Ok(())
}

/// Derivative with respect to the corners of the repeated unit, or of each free one, from that with respect to nodes.
fn corner_gradient(mesh: &MappedMesh, nodes: &NodeGradient) -> Vec<f64> {
    design_gradient(&mesh.pull_back(nodes), mesh.plan().base.repeated)
}

/// Number of chamber corners of a unit; the layouts of studies have the same in all.
fn corners_per_unit(actuator: &Actuator) -> usize {
    let unit = actuator.units.first();
    unit.map_or(0, |u| u.chambers_mm.iter().map(Vec::len).sum())
}

fn left_out(analysis: &Analysis) -> Vec<String> {
    if analysis.system.body.contact.is_none() {
        return vec!["self-contact: the study says off".to_owned()];
    }
    if analysis.states.iter().any(|s| s.contact.is_some()) {
        return Vec::new();
    }
    vec!["self-contact: no surfaces came near each other".to_owned()]
}

fn report(
    goal: &Goal<PlacedProbe>,
    bounds: &[Bound<PlacedProbe>],
    analysis: &Analysis,
) -> EvaluationReport {
    let states = &analysis.states;
    let complete = analysis.end == PathEnd::Complete;
    let area = match &goal.measure {
        Measure::EnclosedArea { probe, .. } if complete => {
            Some(enclosed_area::area(&tip_displacements(states, *probe)))
        }
        _ => None,
    };
    let measures = [&goal.measure]
        .into_iter()
        .chain(bounds.iter().map(|b| &b.measure));
    EvaluationReport {
        enclosed_area_mm2: area,
        measures: measures
            .filter(|_| complete)
            .map(|m| m.value(states))
            .collect(),
        path: analysis
            .states
            .iter()
            .map(|s| StateReport {
                pressure_kpa: s.point.pressure_kpa.clone(),
                tip_mm: s.displacement[0],
                max_stretch: s.max_stretch,
            })
            .collect(),
        transforms: Vec::new(),
        walls_overlap: overlap_report(&analysis.states),
        max_stretch: analysis
            .states
            .iter()
            .fold(1.0, |m, s| m.max(s.max_stretch)),
        margin_stretch: analysis
            .margin_stretch
            .filter(|_| analysis.lost_margin.is_none()),
        margin_reached: analysis.lost_margin.as_ref().map(|lost| lost.factor),
        loss_of_uniqueness: analysis.loss.as_ref().map(|loss| LossReport {
            leg: loss.leg,
            fraction: loss.fraction,
            pressure_kpa: loss.pressure_kpa.clone(),
        }),
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
        left_out: left_out(analysis),
        notes: Vec::new(),
    }
}

/// Pressures of the schedule's channels in place of those of the chambers.
fn in_channels(report: &mut EvaluationReport, layout: Layout) {
    let states = report.path.iter_mut().map(|s| &mut s.pressure_kpa);
    let loss = report.loss_of_uniqueness.as_mut();
    let overlap = report.walls_overlap.as_mut();
    for pressure in states
        .chain(loss.map(|l| &mut l.pressure_kpa))
        .chain(overlap.map(|o| &mut o.pressure_kpa))
    {
        *pressure = layout.pressure_of_channels(pressure);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equilibrium::Unobserved;
    use crate::study::{StepInputs, begin, read_study};

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
        let (_, asks) = begin(
            &study,
            &study.restarts(0, &StepInputs::default()).unwrap()[0],
        )
        .unwrap();
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

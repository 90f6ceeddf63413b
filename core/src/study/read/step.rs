//! Reads one step of a study.

use super::constraints::{read_chamber_constraints, read_counts};
use super::model::{Kind, read_kind, read_model};
use super::optimiser::read_optimiser;
use super::race::Fidelities;
use super::restarts::read_restarts;
use super::takes::{MAX_KEEPS, read_place};
use super::target::{read_end_of_unit, read_target};
use super::variables::{read_bounds_of, read_variables};
use crate::document::{Node, Object};
use crate::geometry::LayoutBoxes;
use crate::optimiser::OptimiserOptions;
use crate::scene::ContactMode;
use crate::study::fidelity::allows_fewer_states;
use crate::study::spec::{
    Budget, FeModel, Model, Parametrisation, StepConstraints, StudyBody, StudyStep, Variables,
};
use crate::study::takes::Given;

pub(super) const MAX_EVALUATIONS: usize = 1_000_000_000;
const NO_CONSTRAINTS: StepConstraints = StepConstraints::Counts {
    inequalities: 0,
    equalities: 0,
};

/// Reads an entry of `step`.
pub fn read_step(
    node: &Node<'_>,
    body: Option<&StudyBody>,
    allow_paths: bool,
) -> Option<StudyStep> {
    let step = node.object(&[
        "id",
        "level",
        "pass",
        "simplifies",
        "target",
        "model",
        "variables",
        "constraints",
        "optimiser",
        "restarts",
        "budget",
        "takes",
        "keeps",
    ])?;
    let id = step.required("id").and_then(|n| n.text());
    let level = step.or("level", 1, |n| n.count(1, 100));
    let model_node = step.required("model");
    // What the other fields mean depends on the kind of model alone, so that faults inside the model hide none of them.
    let kind = model_node.as_ref().and_then(read_kind);
    let model = model_node
        .as_ref()
        .zip(kind)
        .and_then(|(n, kind)| read_model(n, kind, body, allow_paths));
    let place = read_place(&step);
    let Some(kind) = kind else {
        read_budget_keeps(&step);
        return None;
    };
    let body = body.map(|body| of_step(body, model.as_ref()));
    let body = body.as_ref();
    let chambers = matches!(kind, Kind::FeCascade | Kind::FeDirect);
    let gives_gradients = match &model {
        Some(Model::Command(command)) => command.gradient,
        _ => kind != Kind::FeLayouts,
    };
    let target = match kind {
        Kind::Command | Kind::FeLayouts => {
            if step.nullable("target").is_some() {
                let message = if kind == Kind::Command {
                    "a command model gives its objective itself"
                } else {
                    "the transformations that are asked for are the target of \"fe_layouts\""
                };
                step.fault("target", message);
            }
            Some(None)
        }
        Kind::LinearTransform | Kind::ConstantStrain => step
            .required("target")
            .and_then(|n| read_end_of_unit(&n, body))
            .map(Some),
        Kind::FeCascade | Kind::FeDirect => step
            .required("target")
            .and_then(|n| read_target(&n, body))
            .map(Some),
    };
    let variables = match (step.get("variables"), &model) {
        (Some(n), Some(model @ Model::FeLayouts(_))) => {
            // The resolved document has them; another document cannot change them.
            read_variables(&n, Kind::Command, None).and_then(|read| {
                n.expect(
                    read == read_bounds_of(model),
                    "\"fe_layouts\" has its own: the index of a layout and the sides of its chambers in shares of their domains",
                )?;
                Some(read)
            })
        }
        (Some(n), _) => read_variables(&n, kind, model.as_ref()),
        (
            None,
            Some(
                model
                @ (Model::FeLayouts(_) | Model::LinearTransform(_) | Model::ConstantStrain(_)),
            ),
        ) => Some(read_bounds_of(model)),
        (None, _) if chambers => Some(Variables::Chambers {
            parametrisation: Parametrisation::Corners,
            corners: None,
        }),
        (None, _) if kind == Kind::Command => {
            step.fault(
                "variables",
                "is required: a command model's lower and upper bounds",
            );
            None
        }
        (None, _) => None,
    };
    let constraints = if chambers {
        let contact = match &model {
            Some(Model::FeCascade(fe) | Model::FeDirect(fe)) => fe.contact,
            _ => ContactMode::Auto,
        };
        read_chamber_constraints(&step, body, contact)
    } else if kind == Kind::Command {
        step.or("constraints", NO_CONSTRAINTS, read_counts)
    } else {
        let own = match kind {
            // The stretch limit of the material.
            Kind::FeLayouts => StepConstraints::Counts {
                inequalities: 1,
                equalities: 0,
            },
            _ => NO_CONSTRAINTS,
        };
        let message = "this model has its own: the stretch limit of the material, or none";
        match step.nullable("constraints") {
            Some(n) => read_counts(&n).and_then(|read| {
                n.expect(read == own, message)?;
                Some(own)
            }),
            None => Some(own),
        }
    };
    let bounds = variables
        .as_ref()
        .and_then(|v| v.bounds(body, kind == Kind::FeDirect));
    let mut boxes = body.map_or(LayoutBoxes::PAPER, |b| b.actuator.boxes());
    let own = variables.as_ref().and_then(Variables::corners);
    boxes.corners = own.unwrap_or(boxes.corners);
    let of_unit = chambers.then(|| boxes.variables());
    let optimiser = step
        .required("optimiser")
        .and_then(|n| read_optimiser(&n, of_unit, gives_gradients, bounds.as_ref()));
    if kind == Kind::FeLayouts
        && optimiser
            .as_ref()
            .is_some_and(|o| !matches!(o, OptimiserOptions::Sweep(_)))
    {
        step.fault(
            "optimiser.method",
            "a layout is a discrete choice: \"sweep\" is what can make it",
        );
    }
    check_sequence(
        &step,
        variables.as_ref(),
        optimiser.as_ref(),
        model.as_ref(),
    );
    let fewer_states = match (body, &target, &constraints) {
        (Some(body), Some(target), Some(constraints)) => {
            allows_fewer_states(body, target.as_ref(), constraints)
        }
        // Faults of the others are told; a rung is not to be one of them.
        _ => true,
    };
    let fidelities = Fidelities {
        mesh: chambers,
        fewer_states: chambers && fewer_states,
    };
    let restarts = read_restarts(
        &step,
        optimiser.as_ref(),
        of_unit,
        bounds.as_ref(),
        fidelities,
    );
    let ends = read_budget_keeps(&step);
    let (budget, keeps) = ends?;
    let place = place?;
    let read = StudyStep {
        id: id?.to_string(),
        level: level?,
        pass: place.pass,
        simplifies: place.simplifies,
        takes: place.takes,
        given: Given::default(),
        target: target?,
        model: model?,
        variables: variables?,
        constraints: constraints?,
        optimiser: optimiser?,
        restarts: restarts?,
        budget,
        keeps,
    };
    check_budget(&step, &read)?;
    Some(read)
}

/// A sequence is a discrete choice, which one method can make, and that method can make no other.
fn check_sequence(
    step: &Object<'_>,
    variables: Option<&Variables>,
    optimiser: Option<&OptimiserOptions>,
    model: Option<&Model>,
) {
    let letters = variables.is_some_and(Variables::are_letters);
    match optimiser {
        Some(OptimiserOptions::Exchange(_)) if variables.is_some() && !letters => step.fault(
            "optimiser.method",
            "\"exchange\" makes sequences of units: variables = { parametrisation = \"sequence\" }",
        ),
        Some(OptimiserOptions::Exchange(_)) | None => {}
        Some(_) if letters => step.fault(
            "optimiser.method",
            "a sequence of units is a discrete choice: \"exchange\" is what can make it",
        ),
        Some(_) => {}
    }
    let chooses = model.and_then(Model::finite_elements);
    if letters && chooses.is_some_and(FeModel::is_unchosen) {
        step.fault(
            "model.mesh",
            "an error is measured before anything runs, when no unit of the sequences is there: give max_size_mm or mean_size_mm",
        );
    }
}

/// A budget that does not reach for one evaluation a restart, or for all points of a sweep, is a mistake.
fn check_budget(step: &Object<'_>, read: &StudyStep) -> Option<()> {
    let least = read.restart_count()
        * match &read.optimiser {
            OptimiserOptions::Sweep(options) => options.points.len(),
            _ => 1,
        };
    let Some(evaluations) = read.budget.evaluations.filter(|e| *e < least) else {
        return Some(());
    };
    step.fault(
        "budget.evaluations",
        format!(
            "{evaluations} evaluations are fewer than the {least} that the step needs at least"
        ),
    );
    None
}

/// The shared part with a step's own number of units.
fn of_step(body: &StudyBody, model: Option<&Model>) -> StudyBody {
    let mut body = body.clone();
    if let Some(units) = model.and_then(Model::units) {
        body.actuator.units = units;
    }
    body
}

fn read_budget_keeps(step: &Object<'_>) -> Option<(Budget, usize)> {
    let budget = step.or("budget", Budget::default(), |n| {
        let object = n.object(&["evaluations"])?;
        Some(Budget {
            evaluations: object.optional("evaluations", |n| n.count(1, MAX_EVALUATIONS))?,
        })
    });
    let keeps = step.or("keeps", 1, |n| n.count(1, MAX_KEEPS));
    Some((budget?, keeps?))
}

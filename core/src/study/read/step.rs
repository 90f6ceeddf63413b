//! Reads one step of a study.

use super::constraints::{read_chamber_constraints, read_counts};
use super::model::{Kind, read_kind, read_model};
use super::optimiser::read_optimiser;
use super::restarts::read_restarts;
use super::target::read_target;
use super::variables::read_variables;
use crate::document::{Node, Object};
use crate::optimiser::OptimiserOptions;
use crate::scene::ContactMode;
use crate::study::spec::{
    Budget, Model, Parametrisation, StepConstraints, StudyBody, StudyStep, Variables,
};

const MAX_EVALUATIONS: usize = 1_000_000_000;

/// Reads an entry of `step`.
pub fn read_step(
    node: &Node<'_>,
    body: Option<&StudyBody>,
    allow_paths: bool,
) -> Option<StudyStep> {
    let step = node.object(&[
        "id",
        "level",
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
    let Some(kind) = kind else {
        read_budget_takes_keeps(&step);
        return None;
    };
    let chambers = kind != Kind::Command;
    let gives_gradients = match &model {
        Some(Model::Command(command)) => command.gradient,
        _ => true,
    };
    let target = if chambers {
        step.required("target")
            .and_then(|n| read_target(&n, body))
            .map(Some)
    } else {
        if step.nullable("target").is_some() {
            step.fault("target", "a command model gives its objective itself");
        }
        Some(None)
    };
    let variables = match step.get("variables") {
        Some(n) => read_variables(&n, kind),
        None if chambers => Some(Variables::Chambers {
            parametrisation: Parametrisation::Corners,
        }),
        None => {
            step.fault(
                "variables",
                "is required: a command model's lower and upper bounds",
            );
            None
        }
    };
    let constraints = if chambers {
        let contact = match &model {
            Some(Model::FeCascade(fe) | Model::FeDirect(fe)) => fe.contact,
            _ => ContactMode::Auto,
        };
        read_chamber_constraints(&step, body, contact)
    } else {
        step.or(
            "constraints",
            StepConstraints::Counts {
                inequalities: 0,
                equalities: 0,
            },
            read_counts,
        )
    };
    let bounds = variables
        .as_ref()
        .and_then(|v| v.bounds(body, kind == Kind::FeDirect));
    let optimiser = step
        .required("optimiser")
        .and_then(|n| read_optimiser(&n, chambers, gives_gradients, bounds.as_ref()));
    let restarts = read_restarts(&step, optimiser.as_ref(), chambers, bounds.as_ref());
    let ends = read_budget_takes_keeps(&step);
    let (budget, keeps) = ends?;
    let read = StudyStep {
        id: id?.to_string(),
        level: level?,
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

/// A budget that does not reach for one evaluation a restart, or for all points of a sweep, is a mistake.
fn check_budget(step: &Object<'_>, read: &StudyStep) -> Option<()> {
    let least = read.restart_count()
        * match &read.optimiser {
            OptimiserOptions::Sweep(options) => options.points.len(),
            OptimiserOptions::Mmfd(_) | OptimiserOptions::Gcmma(_) => 1,
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

fn read_budget_takes_keeps(step: &Object<'_>) -> Option<(Budget, usize)> {
    let budget = step.or("budget", Budget::default(), |n| {
        let object = n.object(&["evaluations"])?;
        Some(Budget {
            evaluations: object.optional("evaluations", |n| n.count(1, MAX_EVALUATIONS))?,
        })
    });
    if let Some(takes) = step.nullable("takes")
        && takes.value().as_array().is_none_or(|list| !list.is_empty())
    {
        takes.fault::<()>("must be absent or empty: steps cannot take the results of others yet");
    }
    let keeps = step.or("keeps", 1, |n| n.count(1, 1000));
    Some((budget?, keeps?))
}

//! Reads one step of a study.

use super::read::DEFAULT_WALL_MM;
use super::read_optimiser::{read_optimiser, read_restarts};
use super::spec::{
    Budget, ChamberConstraints, CommandModel, FeCascade, Model, Parametrisation, StepConstraints,
    StretchLimit, StudyActuator, StudyBody, StudyOrientation, StudyStep, Target, Variables,
};
use crate::document::{Node, Object};
use crate::geometry::Point;
use crate::optimiser::OptimiserOptions;
use crate::scene::validate::{
    DEFAULT_TOLERANCE, read_contact, read_element, read_max_size, read_tolerance,
};
use crate::scene::{Component, ContactMode, ElementChoice};

const MAX_VARIABLES: usize = 10_000;
const MAX_CONSTRAINTS: usize = 100_000;
const MAX_ARGUMENTS: usize = 1000;
const MAX_TIME_LIMIT_S: f64 = 1e6;
const MAX_EVALUATIONS: usize = 1_000_000_000;
const DEFAULT_SPIKE_DEG: f64 = 3.0;
const DEFAULT_STRETCH_LENGTH_MM: f64 = 0.5;

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
        Some(n) => read_variables(&n, chambers),
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
        read_chamber_constraints(&step, body)
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
    let bounds = variables.as_ref().and_then(|v| v.bounds(body));
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
            OptimiserOptions::Mmfd(_) => 1,
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

/// Kinds of models.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    FeCascade,
    Command,
    /// One that a later version has; it shares the fields of a finite-element model.
    Later,
}

fn read_kind(model: &Node<'_>) -> Option<Kind> {
    let kind = model.open()?.required("kind")?;
    match kind.text()? {
        "fe_cascade" => Some(Kind::FeCascade),
        "command" => Some(Kind::Command),
        later @ ("fe_direct" | "linear_transform" | "constant_strain") => {
            kind.fault::<()>(format!(
                "\"{later}\" is not available yet; use \"fe_cascade\" or \"command\""
            ));
            Some(Kind::Later)
        }
        other => kind.fault(format!(
            "expected \"fe_cascade\" or \"command\", found \"{other}\""
        )),
    }
}

fn read_model(
    node: &Node<'_>,
    kind: Kind,
    body: Option<&StudyBody>,
    allow_paths: bool,
) -> Option<Model> {
    let object = node.open()?;
    match kind {
        Kind::FeCascade => read_fe_cascade(&object, body).map(Model::FeCascade),
        Kind::Command => read_command(&object, allow_paths).map(Model::Command),
        Kind::Later => None,
    }
}

fn read_fe_cascade(object: &Object<'_>, body: Option<&StudyBody>) -> Option<FeCascade> {
    object.allow(&[
        "kind",
        "element",
        "max_size_mm",
        "relative_residual_force_tolerance",
        "contact",
    ]);
    let area = body.map(|b| {
        let [w, h] = b.actuator.unit_mm;
        w * h * b.actuator.units as f64
    });
    let element = object.or("element", ElementChoice::Auto, read_element);
    let max_size_mm = object.optional("max_size_mm", |n| read_max_size(n, area));
    let tolerance = object.or(
        "relative_residual_force_tolerance",
        DEFAULT_TOLERANCE,
        read_tolerance,
    );
    let contact = object.or("contact", ContactMode::Auto, read_contact);
    Some(FeCascade {
        element: element?,
        max_size_mm: max_size_mm?,
        relative_residual_force_tolerance: tolerance?,
        contact: contact?,
    })
}

fn read_command(object: &Object<'_>, allow_paths: bool) -> Option<CommandModel> {
    object.allow(&["kind", "argv", "time_limit_s", "gradient"]);
    let argv = object.required("argv").and_then(|n| {
        if !allow_paths {
            n.fault::<()>(
                "a study over HTTP starts no programs and names no files; run it where they are",
            );
        }
        n.each(1, MAX_ARGUMENTS, |a| match a.value().as_str() {
            Some(text) if !text.contains('\0') => Some(text.to_string()),
            _ => a.fault("expected a text"),
        })
    });
    let time_limit_s = object.required("time_limit_s").and_then(|n| {
        let limit = n.positive()?;
        n.expect(limit <= MAX_TIME_LIMIT_S, "must be at most 1e6 s")?;
        Some(limit)
    });
    let gradient = object.or("gradient", false, Node::boolean);
    Some(CommandModel {
        argv: argv?,
        time_limit_s: time_limit_s?,
        gradient: gradient?,
    })
}

fn read_target(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Target> {
    let object = node.open()?;
    let area = object
        .required("kind")?
        .choice(&[("enclosed_area", true), ("displacement", false)])?;
    object.allow(if area {
        &["kind", "probe_mm", "orientation"]
    } else {
        &["kind", "probe_mm", "component", "state", "sign"]
    });
    let probe_mm = object
        .required("probe_mm")
        .and_then(|n| read_probe(&n, body.map(|b| &b.actuator)));
    if area {
        let orientation = object.or("orientation", StudyOrientation::Either, |n| {
            n.choice(&[
                ("counter_clockwise", StudyOrientation::CounterClockwise),
                ("clockwise", StudyOrientation::Clockwise),
                ("either", StudyOrientation::Either),
            ])
        });
        return Some(Target::EnclosedArea {
            probe_mm: probe_mm?,
            orientation: orientation?,
        });
    }
    let component = object
        .required("component")
        .and_then(|n| n.choice(&[("x", Component::X), ("y", Component::Y)]));
    let last = body.map_or(usize::MAX, |b| {
        b.actuation.legs() * b.actuation.load_steps_per_leg
    });
    let state = object.required("state").and_then(|n| {
        let state = n.count(0, usize::MAX)?;
        n.expect(
            state <= last,
            &format!("state {state} is out of the path, whose last state is {last}"),
        )?;
        Some(state)
    });
    let sign = object.or("sign", 1.0, |n| {
        let sign = n.number()?;
        n.expect(sign.abs() == 1.0, "must be 1 or -1")?;
        Some(sign)
    });
    Some(Target::Displacement {
        probe_mm: probe_mm?,
        component: component?,
        state: state?,
        sign: sign?,
    })
}

/// A probe stays in the solid whatever the design, so it lies in no chamber's domain.
fn read_probe(node: &Node<'_>, actuator: Option<&StudyActuator>) -> Option<Point> {
    let probe = node.pair()?;
    let Some(actuator) = actuator else {
        return Some(probe);
    };
    let [x, y] = probe;
    let [w, h] = actuator.unit_mm;
    let length = w * actuator.units as f64;
    if !((0.0..=length).contains(&x) && (0.0..=h).contains(&y)) {
        return node.fault(format!(
            "the point is outside the actuator, 0 <= x <= {length} and 0 <= y <= {h}"
        ));
    }
    let k = ((x / w) as usize).min(actuator.units - 1);
    let local = x - k as f64 * w;
    for [[x0, y0], [x1, y1]] in actuator.boxes().domains() {
        if x0 < local && local < x1 && y0 < y && y < y1 {
            return node
                .fault("the point is in a chamber's domain, so that it may fall into a chamber");
        }
    }
    Some(probe)
}

fn read_variables(node: &Node<'_>, chambers: bool) -> Option<Variables> {
    if chambers {
        let object = node.object(&["parametrisation"])?;
        let parametrisation = object.or("parametrisation", Parametrisation::Corners, |n| {
            n.choice(&[
                ("corners", Parametrisation::Corners),
                ("rectangle", Parametrisation::Rectangle),
            ])
        })?;
        return Some(Variables::Chambers { parametrisation });
    }
    let object = node.object(&["lower", "upper"])?;
    let lower = object
        .required("lower")
        .and_then(|n| n.numbers(1, MAX_VARIABLES));
    let upper_node = object.required("upper");
    let upper = upper_node
        .as_ref()
        .and_then(|n| n.numbers(1, MAX_VARIABLES));
    let (lower, upper) = (lower?, upper?);
    let upper_node = upper_node?;
    if lower.len() != upper.len() {
        return upper_node.fault(format!(
            "has {} entries where lower has {}",
            upper.len(),
            lower.len()
        ));
    }
    let mut sound = true;
    for (i, (a, b)) in lower.iter().zip(&upper).enumerate() {
        if a > b {
            object.fault(
                &format!("upper[{i}]"),
                format!("the bounds are reversed: lower {a}, upper {b}"),
            );
            sound = false;
        }
    }
    sound.then_some(Variables::Bounds { lower, upper })
}

fn read_counts(node: &Node<'_>) -> Option<StepConstraints> {
    let object = node.object(&["inequalities", "equalities"])?;
    let inequalities = object.or("inequalities", 0, |n| n.count(0, MAX_CONSTRAINTS));
    let equalities = object.or("equalities", 0, |n| n.count(0, MAX_CONSTRAINTS));
    Some(StepConstraints::Counts {
        inequalities: inequalities?,
        equalities: equalities?,
    })
}

fn read_chamber_constraints(
    step: &Object<'_>,
    body: Option<&StudyBody>,
) -> Option<StepConstraints> {
    let wall = body.map_or(DEFAULT_WALL_MM, |b| b.actuator.wall_mm);
    let has_limit = body.is_none_or(|b| b.material.stretch_limit().is_some());
    let Some(node) = step.get("constraints") else {
        let constraints = ChamberConstraints {
            wall_mm: wall,
            spike_deg: DEFAULT_SPIKE_DEG,
            stretch: StretchLimit::Material,
            stretch_length_mm: DEFAULT_STRETCH_LENGTH_MM,
        };
        let complaint = stretch_complaint(&constraints, wall, has_limit, false);
        if let Some((_, message)) = complaint {
            step.fault("constraints", message);
            return None;
        }
        return Some(StepConstraints::Chambers(constraints));
    };
    let object = node.object(&["wall_mm", "spike_deg", "stretch", "stretch_length_mm"])?;
    let wall_mm = object.or("wall_mm", wall, Node::positive);
    let spike_deg = object.or("spike_deg", DEFAULT_SPIKE_DEG, |n| n.number_in(0.1, 60.0));
    let stretch = object.or("stretch", StretchLimit::Material, read_stretch);
    let length = object.or(
        "stretch_length_mm",
        DEFAULT_STRETCH_LENGTH_MM,
        Node::positive,
    );
    let constraints = ChamberConstraints {
        wall_mm: wall_mm?,
        spike_deg: spike_deg?,
        stretch: stretch?,
        stretch_length_mm: length?,
    };
    let given = object.has("stretch_length_mm");
    if let Some((field, message)) = stretch_complaint(&constraints, wall, has_limit, given) {
        object.fault(field, message);
        return None;
    }
    Some(StepConstraints::Chambers(constraints))
}

fn read_stretch(node: &Node<'_>) -> Option<StretchLimit> {
    match node.value().as_str() {
        Some("material") => Some(StretchLimit::Material),
        Some("off") => Some(StretchLimit::Off),
        Some(other) => node.fault(format!(
            "expected \"material\", \"off\" or a number above 1, found \"{other}\""
        )),
        None => {
            let limit = node.number()?;
            node.expect(
                limit > 1.0 && limit <= 100.0,
                &format!("a stretch limit is above 1 and at most 100, found {limit}"),
            )?;
            Some(StretchLimit::Value(limit))
        }
    }
}

/// What is wrong with the stretch limit, and in which field.
fn stretch_complaint(
    constraints: &ChamberConstraints,
    wall_of_domains: f64,
    has_limit: bool,
    length_given: bool,
) -> Option<(&'static str, String)> {
    if constraints.stretch == StretchLimit::Material && !has_limit {
        return Some((
            "stretch",
            "the material names no record with a stretch limit: give a number or \"off\"".into(),
        ));
    }
    let (wall, length) = (
        constraints.wall_mm.min(wall_of_domains),
        constraints.stretch_length_mm,
    );
    let matters = length_given || constraints.stretch != StretchLimit::Off;
    (matters && wall < 4.0 * length).then(|| {
        (
            "stretch_length_mm",
            format!(
                "walls of {wall} mm are thinner than four times the averaging radius of {length} mm"
            ),
        )
    })
}

//! Reads a step's model.

use crate::document::{Node, Object};
use crate::geometry::Layout;
use crate::reduced::LinearTransform;
use crate::scene::actuator::MAX_UNITS;
use crate::scene::validate::{
    DEFAULT_ACTIVATION_MM, DEFAULT_TOLERANCE, expect_one_size, read_activation, read_contact,
    read_element, read_max_size, read_tolerance,
};
use crate::scene::{ContactMode, ElementChoice};
use crate::study::spec::{
    AccuracyDesign, ChosenMesh, CommandModel, FeLayoutsModel, FeModel, LayoutScore, MeshAccuracy,
    Model, ReducedModel, StudyBody, StudyMaterials,
};
use crate::study::surrogate::fewest_fit;

const MAX_ARGUMENTS: usize = 1000;
const MAX_TIME_LIMIT_S: f64 = 1e6;
const MAX_ACTUATIONS: usize = 20;
const KINDS: &str = "\"fe_cascade\", \"fe_direct\", \"fe_layouts\", \"linear_transform\", \"constant_strain\" or \"command\"";

/// Kinds of models.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    /// Finite elements on copies of one unit.
    FeCascade,
    /// Finite elements on free units.
    FeDirect,
    /// Finite elements on one unit of several layouts.
    FeLayouts,
    /// The reduced model of a chain.
    LinearTransform,
    /// The same of a chain whose units have constant strains.
    ConstantStrain,
    /// A program.
    Command,
}

/// Reads the kind of a model.
pub fn read_kind(model: &Node<'_>) -> Option<Kind> {
    let kind = model.open()?.required("kind")?;
    match kind.text()? {
        "fe_cascade" => Some(Kind::FeCascade),
        "fe_direct" => Some(Kind::FeDirect),
        "fe_layouts" => Some(Kind::FeLayouts),
        "linear_transform" => Some(Kind::LinearTransform),
        "command" => Some(Kind::Command),
        "constant_strain" => Some(Kind::ConstantStrain),
        other => kind.fault(format!("expected {KINDS}, found \"{other}\"")),
    }
}

/// Reads a model of a known kind.
pub fn read_model(
    node: &Node<'_>,
    kind: Kind,
    body: Option<&StudyBody>,
    allow_paths: bool,
) -> Option<Model> {
    let object = node.open()?;
    match kind {
        Kind::FeCascade => read_finite_elements(&object, body, &["units"]).map(Model::FeCascade),
        Kind::FeDirect => read_finite_elements(&object, body, &["units"]).map(Model::FeDirect),
        Kind::FeLayouts => read_layouts(&object, body).map(Model::FeLayouts),
        Kind::LinearTransform => read_reduced(&object, body).map(Model::LinearTransform),
        Kind::ConstantStrain => read_reduced(&object, body).map(Model::ConstantStrain),
        Kind::Command => read_command(&object, allow_paths).map(Model::Command),
    }
}

/// The number of units of a step, which is at most that of the actuator.
/// A number of units, or "fit": the fewest whose area may stand for that of the whole actuator.
fn read_units(n: &Node<'_>, body: Option<&StudyBody>) -> Option<usize> {
    if n.value().as_str() == Some("fit") {
        let body = body?;
        let rows = &body.actuation.rows_kpa;
        return Some(fewest_fit(rows, body.actuator.units));
    }
    let units = n.count(1, MAX_UNITS)?;
    let Some(body) = body else {
        return Some(units);
    };
    let whole = body.actuator.units;
    if units > whole {
        return n.fault(format!("the actuator has {whole} units"));
    }
    if units != whole && matches!(body.material, StudyMaterials::PerUnit(_)) {
        return n.fault(format!(
            "unit_materials names one for each of {whole} units, so a step has all of them"
        ));
    }
    Some(units)
}

fn read_reduced(object: &Object<'_>, body: Option<&StudyBody>) -> Option<ReducedModel> {
    object.allow(&["kind", "units", "actuations"]);
    let units = object.optional("units", |n| read_units(n, body));
    let actuations = object.or("actuations", 2, |n| n.count(1, MAX_ACTUATIONS));
    Some(ReducedModel {
        units: units?,
        actuations: actuations?,
    })
}

fn read_layouts(object: &Object<'_>, body: Option<&StudyBody>) -> Option<FeLayoutsModel> {
    let fe = read_finite_elements(object, body, &["layouts", "behaviour", "score"]);
    let score = object.or("score", LayoutScore::default(), |n| {
        n.choice(&[
            ("area", LayoutScore::Area),
            ("distance", LayoutScore::Distance),
        ])
    });
    if let Some(body) = body
        && matches!(body.material, StudyMaterials::PerUnit(_))
    {
        object.fault(
            "kind",
            "a single unit has one material: unit_materials names several",
        );
    }
    let layouts = object
        .required("layouts")
        .and_then(|n| n.each(1, Layout::NAMES.len(), |n| n.choice(&Layout::NAMES)));
    let behaviour = object.or("behaviour", Vec::new(), |n| {
        n.each(1, MAX_ACTUATIONS, |n| {
            let entries = n.numbers(4, 4)?;
            <[f64; 4]>::try_from(entries)
                .ok()
                .map(|e| LinearTransform::from_slice(&e))
        })
    });
    Some(FeLayoutsModel {
        layouts: layouts?,
        behaviour: behaviour?,
        score: score?,
        fe: fe?,
    })
}

fn read_finite_elements(
    object: &Object<'_>,
    body: Option<&StudyBody>,
    others: &[&str],
) -> Option<FeModel> {
    let own = [
        "kind",
        "element",
        "max_size_mm",
        "mean_size_mm",
        "relative_residual_force_tolerance",
        "contact",
        "contact_activation_mm",
        "mesh",
    ];
    object.allow(&[&own, others].concat());
    let units = if others.contains(&"units") {
        object.optional("units", |n| read_units(n, body))
    } else {
        Some(None)
    };
    let area = body.map(|b| {
        let [w, h] = b.actuator.unit_mm;
        w * h * b.actuator.units as f64
    });
    let element = object.or("element", ElementChoice::Auto, read_element);
    let max_size_mm = object.optional("max_size_mm", |n| read_max_size(n, area));
    let mean_size_mm = object.optional("mean_size_mm", |n| read_max_size(n, area));
    expect_one_size(object);
    let tolerance = object.or(
        "relative_residual_force_tolerance",
        DEFAULT_TOLERANCE,
        read_tolerance,
    );
    let contact = object.or("contact", ContactMode::Auto, read_contact);
    let activation = object.or(
        "contact_activation_mm",
        DEFAULT_ACTIVATION_MM,
        read_activation,
    );
    let accuracy = object.optional("mesh", read_accuracy);
    if let Some(Some(MeshAccuracy { chosen: None, .. })) = &accuracy {
        for name in ["max_size_mm", "mean_size_mm"] {
            if object.nullable(name).is_some() {
                object.fault(
                    name,
                    "mesh.error chooses the size: either of the two, not both",
                );
            }
        }
    }
    Some(FeModel {
        units: units?,
        accuracy: accuracy?,
        element: element?,
        max_size_mm: max_size_mm?,
        mean_size_mm: mean_size_mm?,
        relative_residual_force_tolerance: tolerance?,
        contact: contact?,
        contact_activation_mm: activation?,
    })
}

fn read_accuracy(node: &Node<'_>) -> Option<MeshAccuracy> {
    let object = node.object(&["error", "chosen"])?;
    let error = object
        .required("error")
        .and_then(|n| n.number_in(1e-6, 0.5));
    let chosen = object.optional("chosen", |n| {
        let object = n.object(&["at", "tip_error", "area_error", "uncertainty", "elements"])?;
        let at = object.required("at").and_then(|n| {
            n.choice(&[
                ("given", AccuracyDesign::Given),
                ("middle", AccuracyDesign::Middle),
            ])
        });
        let number = |name: &str| object.required(name).and_then(|n| n.number());
        let tip_error = number("tip_error");
        let area_error = object.optional("area_error", Node::number);
        let uncertainty = number("uncertainty");
        let elements = object
            .required("elements")
            .and_then(|n| n.count(1, usize::MAX));
        Some(ChosenMesh {
            at: at?,
            tip_error: tip_error?,
            area_error: area_error?,
            uncertainty: uncertainty?,
            elements: elements?,
        })
    });
    Some(MeshAccuracy {
        error: error?,
        chosen: chosen?,
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

//! Reads a step's constraints.

use super::study::DEFAULT_WALL_MM;
use super::target::read_bounds;
use crate::document::{Node, Object};
use crate::scene::ContactMode;
use crate::study::spec::{
    ChamberConstraints, NumberOrOff, StepConstraints, StretchLimit, StudyBody,
};

const MAX_CONSTRAINTS: usize = 100_000;
const DEFAULT_SPIKE_DEG: f64 = 3.0;
const DEFAULT_STRETCH_LENGTH_MM: f64 = 0.5;
const WALL_GAP_WITHOUT_CONTACT_MM: f64 = 0.2;
const DEFAULT_LOAD_MARGIN: NumberOrOff = NumberOrOff::Number(1.1);

/// Reads `constraints` of a program.
pub fn read_counts(node: &Node<'_>) -> Option<StepConstraints> {
    let object = node.object(&["inequalities", "equalities"])?;
    let inequalities = object.or("inequalities", 0, |n| n.count(0, MAX_CONSTRAINTS));
    let equalities = object.or("equalities", 0, |n| n.count(0, MAX_CONSTRAINTS));
    Some(StepConstraints::Counts {
        inequalities: inequalities?,
        equalities: equalities?,
    })
}

/// Reads `constraints` of a finite-element model.
pub fn read_chamber_constraints(
    step: &Object<'_>,
    body: Option<&StudyBody>,
    contact: ContactMode,
) -> Option<StepConstraints> {
    // Walls that press on each other need no gap.
    let default_gap = match contact {
        ContactMode::Off => NumberOrOff::Number(WALL_GAP_WITHOUT_CONTACT_MM),
        ContactMode::Auto | ContactMode::On => NumberOrOff::Off,
    };
    let wall = body.map_or(DEFAULT_WALL_MM, |b| b.actuator.wall_mm);
    let has_limit = body.is_none_or(|b| b.material.stretch_limit().is_some());
    let Some(node) = step.get("constraints") else {
        let constraints = ChamberConstraints {
            wall_mm: wall,
            spike_deg: DEFAULT_SPIKE_DEG,
            stretch: StretchLimit::Material,
            stretch_length_mm: DEFAULT_STRETCH_LENGTH_MM,
            wall_gap_mm: default_gap,
            load_margin: DEFAULT_LOAD_MARGIN,
            exclude_non_unique: true,
            bounds: Vec::new(),
        };
        let complaint = stretch_complaint(&constraints, wall, has_limit);
        if let Some((_, message)) = complaint {
            step.fault("constraints", message);
            return None;
        }
        return Some(StepConstraints::Chambers(constraints));
    };
    let object = node.object(&[
        "wall_mm",
        "spike_deg",
        "stretch",
        "stretch_length_mm",
        "wall_gap_mm",
        "load_margin",
        "exclude_non_unique",
        "bounds",
    ])?;
    let wall_mm = object.or("wall_mm", wall, Node::positive);
    let spike_deg = object.or("spike_deg", DEFAULT_SPIKE_DEG, |n| n.number_in(0.1, 60.0));
    let stretch = object.or("stretch", StretchLimit::Material, read_stretch);
    let length = object.or(
        "stretch_length_mm",
        DEFAULT_STRETCH_LENGTH_MM,
        Node::positive,
    );
    let gap = object.or("wall_gap_mm", default_gap, |n| {
        read_number_or_off(n, 0.0, 3.0, "a least gap is above 0 and at most 3 mm")
    });
    let margin = object.or("load_margin", DEFAULT_LOAD_MARGIN, |n| {
        read_number_or_off(n, 1.0, 3.0, "a load margin is above 1 and at most 3")
    });
    let unique = object.or("exclude_non_unique", true, Node::boolean);
    let bounds = object.or("bounds", Vec::new(), |n| read_bounds(n, body));
    let constraints = ChamberConstraints {
        wall_mm: wall_mm?,
        spike_deg: spike_deg?,
        stretch: stretch?,
        stretch_length_mm: length?,
        wall_gap_mm: gap?,
        load_margin: margin?,
        exclude_non_unique: unique?,
        bounds: bounds?,
    };
    if let Some((field, message)) = stretch_complaint(&constraints, wall, has_limit) {
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

/// A number above `lower` and at most `upper`, or "off".
fn read_number_or_off(node: &Node<'_>, lower: f64, upper: f64, rule: &str) -> Option<NumberOrOff> {
    match node.value().as_str() {
        Some("off") => Some(NumberOrOff::Off),
        Some(other) => node.fault(format!(
            "expected \"off\" or a number above {lower}, found \"{other}\""
        )),
        None => {
            let value = node.number()?;
            node.expect(
                value > lower && value <= upper,
                &format!("{rule}, found {value}"),
            )?;
            Some(NumberOrOff::Number(value))
        }
    }
}

/// What is wrong with the stretch limit, and in which field.
fn stretch_complaint(
    constraints: &ChamberConstraints,
    wall_of_domains: f64,
    has_limit: bool,
) -> Option<(&'static str, String)> {
    if constraints.stretch == StretchLimit::Material && !has_limit {
        return Some((
            "stretch",
            "the material (or one of unit_materials) has neither a record with a stretch limit nor a fit_stretch: give a number or \"off\"".into(),
        ));
    }
    let (wall, length) = (
        constraints.wall_mm.min(wall_of_domains),
        constraints.stretch_length_mm,
    );
    let matters = constraints.stretch != StretchLimit::Off;
    (matters && wall < 4.0 * length).then(|| {
        (
            "stretch_length_mm",
            format!(
                "walls of {wall} mm are thinner than four times the averaging radius of {length} mm"
            ),
        )
    })
}

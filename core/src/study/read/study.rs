//! Reads a study document and answers every fault at once.

use serde_json::Value;

use super::graph::check_graph;
use super::step::read_step;
use super::variables::read_corners;
use crate::document::{Node, Object, read};
use crate::fault::Faults;
use crate::geometry::{ChamberCorners, Layout};
use crate::material::records::{self, DEFAULT_RECORD};
use crate::scene::actuation::read_actuation;
use crate::scene::actuator::{DEFAULT_UNIT_MM, MAX_UNITS, read_corner_radius_mm, read_unit_mm};
use crate::scene::{read_material, read_per_unit};
use crate::study::preset::expand;
use crate::study::spec::{Study, StudyActuator, StudyBody, StudyMaterial, StudyMaterials};

const MAX_STEPS: usize = 100;
const MAX_NAME: usize = 200;
/// Wall thickness where the document gives none, mm.
pub(super) const DEFAULT_WALL_MM: f64 = 2.0;
const DEFAULT_CENTRE_CLEARANCE_MM: f64 = 0.5;

/// Reads a study. Without `allow_paths` a command model is a fault: a study that comes over the network names no files
/// and no programs of this machine.
pub fn read_study(document: &Value, allow_paths: bool) -> Result<Study, Faults> {
    let reader = |node: &Node<'_>| read_root(node, allow_paths);
    match expand(document) {
        Ok(expanded) => read(&expanded, reader),
        Err(mut faults) => {
            // What the preset would have given is not missing; everything else is still worth saying.
            let mut bare = document.clone();
            if let Some(map) = bare.as_object_mut() {
                map.shift_remove("preset");
            }
            if let Err(others) = read(&bare, reader) {
                let told = others.0.into_iter();
                faults
                    .0
                    .extend(told.filter(|f| f.message != crate::document::IS_REQUIRED));
            }
            Err(faults)
        }
    }
}

fn read_root(node: &Node<'_>, allow_paths: bool) -> Option<Study> {
    let root = node.object(&[
        "name",
        "preset",
        "actuator",
        "material",
        "unit_materials",
        "actuation",
        "mixed_hardware",
        "error_bands",
        "speculate",
        "step",
    ])?;
    let name = root.required("name").and_then(|n| read_name(&n));
    let mixed_hardware = root.or("mixed_hardware", false, Node::boolean);
    let error_bands = root.or("error_bands", true, Node::boolean);
    let speculate = root.or("speculate", false, Node::boolean);
    let steps = root.required("step");
    let has_chambers = steps
        .as_ref()
        .is_none_or(|n| !every_model_is_a_command(n.value()));
    let body = if has_chambers {
        read_body(&root).map(Some)
    } else {
        for field in ["actuator", "material", "unit_materials", "actuation"] {
            if root.has(field) {
                root.fault(field, "nothing uses it: every step's model is a command");
            }
        }
        Some(None)
    };
    let known_body = body.as_ref().and_then(Option::as_ref);
    let steps = steps.and_then(|n| n.each(1, MAX_STEPS, |s| read_step(s, known_body, allow_paths)));
    let mut steps = steps?;
    for (i, step) in steps.iter().enumerate() {
        if steps[..i].iter().any(|s| s.id == step.id) {
            root.fault(
                &format!("step[{i}].id"),
                format!("another step is named \"{}\" already", step.id),
            );
        }
    }
    check_graph(&root, known_body, &mut steps)?;
    Some(Study {
        name: name?,
        body: body?,
        mixed_hardware: mixed_hardware?,
        error_bands: error_bands?,
        speculate: speculate?,
        steps,
    })
}

fn every_model_is_a_command(steps: &Value) -> bool {
    steps.as_array().is_some_and(|steps| {
        !steps.is_empty()
            && steps
                .iter()
                .all(|s| s.pointer("/model/kind").and_then(Value::as_str) == Some("command"))
    })
}

/// A name that may also name a folder.
fn read_name(node: &Node<'_>) -> Option<String> {
    let name = node.text()?;
    let sound = name.chars().count() <= MAX_NAME
        && !name.starts_with('.')
        && name.trim() == name
        && !name.chars().any(|c| c.is_control() || "/\\:".contains(c));
    node.expect(
        sound,
        "must be at most 200 characters without / \\ : and must not start with a full stop or blank",
    )?;
    Some(name.to_string())
}

fn read_body(root: &Object<'_>) -> Option<StudyBody> {
    let actuator = match root.get("actuator") {
        Some(node) => read_actuator(&node),
        None => Some(StudyActuator::default()),
    };
    let one = match root.get("material") {
        Some(node) => read_study_material(&node),
        None => records::find(DEFAULT_RECORD).map(|r| StudyMaterial {
            record: Some(r.name.into()),
            law: r.law,
        }),
    };
    let material = match root.nullable("unit_materials") {
        // It wins, but the faults of what it wins over are noted too.
        Some(list) => {
            let units = actuator.as_ref().map(|a| a.units);
            read_per_unit(&list, units, read_study_material).map(StudyMaterials::PerUnit)
        }
        None => one.map(StudyMaterials::All),
    };
    let actuation = root.required("actuation").and_then(|node| {
        let cycle = read_actuation(&node)?;
        let layout = actuator.as_ref().map_or(Layout::StackedPair, |a| a.layout);
        let needed = layout.channel_count();
        node.expect(
            cycle.channels() >= needed,
            &format!(
                "{needed} channels drive the chambers of the layout, so the schedule needs {needed}"
            ),
        )?;
        Some(cycle)
    });
    Some(StudyBody {
        actuator: actuator?,
        material: material?,
        actuation: actuation?,
    })
}

impl Default for StudyActuator {
    fn default() -> Self {
        Self {
            unit_mm: DEFAULT_UNIT_MM,
            units: 3,
            layout: Layout::StackedPair,
            corners: ChamberCorners::Four,
            wall_mm: DEFAULT_WALL_MM,
            centre_clearance_mm: DEFAULT_CENTRE_CLEARANCE_MM,
            corner_radius_mm: 0.0,
        }
    }
}

fn read_actuator(node: &Node<'_>) -> Option<StudyActuator> {
    let object = node.object(&[
        "unit_mm",
        "units",
        "layout",
        "corners",
        "wall_mm",
        "centre_clearance_mm",
        "corner_radius_mm",
    ])?;
    let default = StudyActuator::default();
    let unit_mm = object.or("unit_mm", default.unit_mm, read_unit_mm);
    let units = object.or("units", default.units, |n| n.count(1, MAX_UNITS));
    let layout = object.or("layout", default.layout, |n| n.choice(&Layout::NAMES));
    let corners = object.or("corners", default.corners, read_corners);
    let wall_mm = object.or("wall_mm", default.wall_mm, Node::positive);
    let clearance = object.or(
        "centre_clearance_mm",
        default.centre_clearance_mm,
        Node::positive,
    );
    let corner_radius_mm = object.or("corner_radius_mm", default.corner_radius_mm, |n| {
        read_corner_radius_mm(n, unit_mm)
    });
    let actuator = StudyActuator {
        unit_mm: unit_mm?,
        units: units?,
        layout: layout?,
        corners: corners?,
        wall_mm: wall_mm?,
        centre_clearance_mm: clearance?,
        corner_radius_mm: corner_radius_mm?,
    };
    let [_, [width, height]] = actuator.boxes().rectangle_bounds();
    let room = width.min(height);
    if room <= 2.0 * actuator.centre_clearance_mm {
        object.fault(
            "wall_mm",
            format!(
                "leaves a chamber {room} mm where the centre clearance alone takes {} mm",
                2.0 * actuator.centre_clearance_mm
            ),
        );
        return None;
    }
    Some(actuator)
}

fn read_study_material(node: &Node<'_>) -> Option<StudyMaterial> {
    Some(StudyMaterial {
        law: read_material(node)?,
        record: node.value().as_str().map(Into::into),
    })
}

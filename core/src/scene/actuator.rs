//! Reads a chain of units with chambers.

use serde_json::{Value, json};

use super::shape::{chamber_faults, meet};
use crate::document::{Node, Object};
use crate::geometry::{Actuator, Point, Unit};

/// Width and height of a unit where the document gives none, mm.
pub const DEFAULT_UNIT_MM: [f64; 2] = [80.0, 80.0];
/// Most units of a chain: what was tried. Nothing else sets an end to it.
pub const MAX_UNITS: usize = 30;
const MAX_CHAMBERS: usize = 64;
const MAX_CORNERS: usize = 64;
const MAX_CORNERS_IN_ALL: usize = 20_000;
/// Least radius of a rounded corner over the mean size of a unit (0.04 mm on 80 x 80 mm): smaller ones ask for elements
/// that change nothing.
const LEAST_RADIUS: f64 = 5e-4;
/// Largest radius over a unit's smaller side: no chamber has room for more.
const MOST_RADIUS: f64 = 0.5;

/// Reads the object `actuator`.
pub fn read_actuator(node: &Node<'_>) -> Option<Actuator> {
    let object = node.object(&[
        "unit_mm",
        "repeat",
        "chambers_mm",
        "units",
        "corner_radius_mm",
    ])?;
    let unit_mm = object.or("unit_mm", DEFAULT_UNIT_MM, read_unit_mm);
    let corner_radius_mm = object.or("corner_radius_mm", 0.0, |n| {
        read_corner_radius_mm(n, unit_mm)
    });
    let (units, repeated) = match (object.get("chambers_mm"), object.get("units")) {
        (Some(chambers), None) => (read_repeated(&object, &chambers, unit_mm), true),
        (None, Some(units)) => {
            if object.has("repeat") {
                object.fault(
                    "repeat",
                    "belongs to chambers_mm; units are listed one by one",
                );
            }
            (read_units(&units, unit_mm), false)
        }
        (Some(chambers), Some(units)) => {
            object.fault("units", "either chambers_mm or units, not both");
            read_chambers(&chambers, unit_mm);
            read_units(&units, unit_mm);
            return None;
        }
        (None, None) => {
            object.fault("chambers_mm", "is required (or units)");
            return None;
        }
    };
    Some(Actuator {
        unit_mm: unit_mm?,
        units: units?,
        repeated,
        corner_radius_mm: corner_radius_mm?,
    })
}

/// The document form of an actuator; [`read_actuator`] reads it back to the same actuator.
pub fn actuator_document(actuator: &Actuator) -> Value {
    let radius = actuator.corner_radius_mm;
    match actuator.units.first() {
        Some(unit) if actuator.repeated => json!({
            "repeat": actuator.units.len(),
            "unit_mm": actuator.unit_mm,
            "chambers_mm": unit.chambers_mm,
            "corner_radius_mm": radius,
        }),
        _ => json!({
            "unit_mm": actuator.unit_mm,
            "units": actuator.units,
            "corner_radius_mm": radius,
        }),
    }
}

/// Reads the width and height of a unit.
pub fn read_unit_mm(node: &Node<'_>) -> Option<[f64; 2]> {
    let size = node.pair()?;
    node.expect(
        size.iter().all(|s| (1e-3..=1e5).contains(s)),
        &format!("width and height must be between 0.001 and 100000 mm, found {size:?}"),
    )?;
    Some(size)
}

/// Reads the radius of the chambers' corners in units of the given size: 0, or one that an arc in such a unit can have.
pub fn read_corner_radius_mm(node: &Node<'_>, unit_mm: Option<[f64; 2]>) -> Option<f64> {
    let radius = node.number()?;
    let [w, h] = unit_mm.unwrap_or(DEFAULT_UNIT_MM);
    let [least, most] = [LEAST_RADIUS * (w * h).sqrt(), MOST_RADIUS * w.min(h)];
    node.expect(
        radius == 0.0 || (least..=most).contains(&radius),
        &format!("must be 0 (sharp) or between {least} and {most} mm in this unit, found {radius}"),
    )?;
    Some(radius)
}

fn read_repeated(
    object: &Object<'_>,
    chambers: &Node<'_>,
    unit_mm: Option<[f64; 2]>,
) -> Option<Vec<Unit>> {
    let repeat = object.or("repeat", 1, |n| n.count(1, MAX_UNITS));
    let unit = read_chambers(chambers, unit_mm);
    Some(vec![unit?; repeat?])
}

fn read_units(node: &Node<'_>, unit_mm: Option<[f64; 2]>) -> Option<Vec<Unit>> {
    let units = node.each(1, MAX_UNITS, |unit| {
        let object = unit.object(&["chambers_mm"])?;
        read_chambers(&object.required("chambers_mm")?, unit_mm)
    })?;
    let corners: usize = units
        .iter()
        .flat_map(|u| u.chambers_mm.iter().map(Vec::len))
        .sum();
    node.expect(
        corners <= MAX_CORNERS_IN_ALL,
        &format!("{corners} corners in all; at most {MAX_CORNERS_IN_ALL} are read"),
    )?;
    Some(units)
}

fn read_chambers(node: &Node<'_>, unit_mm: Option<[f64; 2]>) -> Option<Unit> {
    let nodes = node.list_of(0, MAX_CHAMBERS)?;
    let chambers: Vec<Option<Vec<Point>>> =
        nodes.iter().map(|n| read_chamber(n, unit_mm)).collect();
    let mut apart = true;
    for (j, second) in chambers.iter().enumerate() {
        for (i, first) in chambers[..j].iter().enumerate() {
            if let (Some(a), Some(b)) = (first, second)
                && meet(a, b)
            {
                nodes[j].fault::<()>(format!("crosses, touches or contains chamber {i}"));
                apart = false;
            }
        }
    }
    let chambers_mm: Option<Vec<_>> = chambers.into_iter().collect();
    chambers_mm
        .filter(|_| apart)
        .map(|chambers_mm| Unit { chambers_mm })
}

fn read_chamber(node: &Node<'_>, unit_mm: Option<[f64; 2]>) -> Option<Vec<Point>> {
    let corners = node.each(3, MAX_CORNERS, Node::pair)?;
    let faults = chamber_faults(&corners, unit_mm);
    for fault in &faults {
        node.fault::<()>(fault.clone());
    }
    faults.is_empty().then_some(corners)
}

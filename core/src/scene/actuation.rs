//! Reads the actuation schedule.

use serde_json::{Value, json};

use crate::actuation::{ActuationCycle, Spacing};
use crate::document::{Node, Object};

/// Pressure of named schedules where the document gives none, kPa.
pub const DEFAULT_PRESSURE_KPA: f64 = 15.0;
/// States on each leg where the document gives no number.
pub const DEFAULT_LOAD_STEPS_PER_LEG: usize = 10;
const NAMES: &str =
    "\"hold\", \"swap\", \"overlap\", \"ramp\" or a list of rows of channel pressures";
const MAX_ROWS: usize = 1000;
const MAX_CHANNELS: usize = 64;
const MAX_STEPS: usize = 10_000;
const MAX_STATES: usize = 100_000;

/// Reads the fields `schedule`, `pressure_kpa`, `load_steps_per_leg` and `spacing`.
pub fn read_actuation(node: &Node<'_>) -> Option<ActuationCycle> {
    let object = node.object(&["schedule", "pressure_kpa", "load_steps_per_leg", "spacing"])?;
    let rows = read_rows(&object);
    let steps = object.or("load_steps_per_leg", DEFAULT_LOAD_STEPS_PER_LEG, |n| {
        n.count(1, MAX_STEPS)
    });
    let spacing = object.or("spacing", Spacing::Equal, |n| {
        n.choice(&[("equal", Spacing::Equal), ("graded", Spacing::Graded)])
    });
    let cycle = ActuationCycle {
        rows_kpa: rows?,
        load_steps_per_leg: steps?,
        spacing: spacing?,
    };
    let states = cycle.legs() * cycle.load_steps_per_leg;
    node.expect(
        states <= MAX_STATES,
        &format!("the path has {states} states; at most {MAX_STATES} are solved"),
    )?;
    Some(cycle)
}

/// The document form of a cycle, with explicit rows; [`read_actuation`] reads it back to the same cycle.
pub fn actuation_document(cycle: &ActuationCycle) -> Value {
    json!({
        "schedule": cycle.rows_kpa,
        "load_steps_per_leg": cycle.load_steps_per_leg,
        "spacing": cycle.spacing,
    })
}

fn read_rows(object: &Object<'_>) -> Option<Vec<Vec<f64>>> {
    let pressure = object.or("pressure_kpa", DEFAULT_PRESSURE_KPA, |n| {
        let p = n.number()?;
        n.expect(p != 0.0, "must not be zero: nothing would be actuated")?;
        Some(p)
    });
    let schedule = object.required("schedule")?;
    match schedule.value() {
        Value::String(name) => match ActuationCycle::named_rows(name, pressure.unwrap_or(1.0)) {
            Some(rows) => pressure.map(|_| rows),
            None => schedule.fault(format!("expected {NAMES}, found \"{name}\"")),
        },
        Value::Array(_) => {
            if object.has("pressure_kpa") {
                object.fault(
                    "pressure_kpa",
                    "belongs to a named schedule; this one gives its pressures itself",
                );
            }
            explicit_rows(&schedule)
        }
        _ => schedule.fault(format!("expected {NAMES}")),
    }
}

fn explicit_rows(schedule: &Node<'_>) -> Option<Vec<Vec<f64>>> {
    let nodes = schedule.list_of(2, MAX_ROWS)?;
    let rows = schedule.each(2, MAX_ROWS, |row| row.numbers(1, MAX_CHANNELS))?;
    let mut sound = true;
    for (i, row) in rows.iter().enumerate() {
        if row.len() != rows[0].len() {
            nodes[i].fault::<()>(format!(
                "has {} pressures where the first row has {}",
                row.len(),
                rows[0].len()
            ));
            sound = false;
        } else if i > 0 && *row == rows[i - 1] {
            nodes[i].fault::<()>("repeats the row before it: a leg needs a change of pressure");
            sound = false;
        }
    }
    if rows[0].iter().any(|p| *p != 0.0) {
        nodes[0].fault::<()>("the first row must be all zero: the path starts at rest");
        sound = false;
    }
    sound.then_some(rows)
}

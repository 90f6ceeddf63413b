//! Reads what scenes and studies say alike of an objective: which kind, and which displacement.

use super::Component;
use crate::actuation::ActuationCycle;
use crate::document::{Node, Object};

/// Reads `kind` of an objective and holds the other fields to those of the kind, of which `probe` is the one that names
/// or places the point. True: an enclosed area.
pub fn read_kind(object: &Object<'_>, probe: &str) -> Option<bool> {
    let area = object
        .required("kind")?
        .choice(&[("enclosed_area", true), ("displacement", false)])?;
    if area {
        object.allow(&["kind", probe, "orientation"]);
    } else {
        object.allow(&["kind", probe, "component", "state", "sign"]);
    }
    Some(area)
}

/// A displacement component at a state of the path, with its sign.
pub struct DisplacementFields {
    /// `component`, where it can be read.
    pub component: Option<Component>,
    /// `state`, likewise.
    pub state: Option<usize>,
    /// `sign`, likewise.
    pub sign: Option<f64>,
}

/// Reads the fields of a displacement; every fault is noted. Without an actuation any state is taken.
pub fn read_displacement(
    object: &Object<'_>,
    actuation: Option<&ActuationCycle>,
) -> DisplacementFields {
    let component = object
        .required("component")
        .and_then(|n| n.choice(&[("x", Component::X), ("y", Component::Y)]));
    let last = actuation.map_or(usize::MAX, |a| a.legs() * a.load_steps_per_leg);
    let state = object.required("state").and_then(|n| read_state(&n, last));
    let sign = object.or("sign", 1.0, |n| {
        let sign = n.number()?;
        n.expect(sign.abs() == 1.0, "must be 1 or -1")?;
        Some(sign)
    });
    DisplacementFields {
        component,
        state,
        sign,
    }
}

fn read_state(node: &Node<'_>, last: usize) -> Option<usize> {
    let state = node.count(0, usize::MAX)?;
    node.expect(
        state <= last,
        &format!("state {state} is out of the path, whose last state is {last}"),
    )?;
    Some(state)
}

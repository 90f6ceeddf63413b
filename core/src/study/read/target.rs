//! Reads a step's target.

use crate::document::Node;
use crate::geometry::Point;
use crate::scene::Component;
use crate::study::spec::{StudyActuator, StudyBody, StudyOrientation, Target};

/// Reads `target`.
pub fn read_target(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Target> {
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

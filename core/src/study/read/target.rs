//! Reads a step's target.

use crate::document::Node;
use crate::geometry::Point;
use crate::scene::target::{read_displacement, read_kind};
use crate::scene::validate::find_unit;
use crate::study::spec::{StudyActuator, StudyBody, StudyOrientation, Target};

/// Reads `target`.
pub fn read_target(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Target> {
    let object = node.open()?;
    let area = read_kind(&object, "probe_mm")?;
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
    let displacement = read_displacement(&object, body.map(|b| &b.actuation));
    Some(Target::Displacement {
        probe_mm: probe_mm?,
        component: displacement.component?,
        state: displacement.state?,
        sign: displacement.sign?,
    })
}

/// A probe stays in the solid whatever the design, so it lies in no chamber's domain.
fn read_probe(node: &Node<'_>, actuator: Option<&StudyActuator>) -> Option<Point> {
    let probe = node.pair()?;
    let Some(actuator) = actuator else {
        return Some(probe);
    };
    let (_, [x, y]) = find_unit(node, probe, actuator.unit_mm, actuator.units)?;
    for [[x0, y0], [x1, y1]] in actuator.boxes().domains() {
        if x0 < x && x < x1 && y0 < y && y < y1 {
            return node
                .fault("the point is in a chamber's domain, so that it may fall into a chamber");
        }
    }
    Some(probe)
}

//! Reads a step's target and the bounds among its constraints.

use std::cell::Cell;

use crate::actuation::ActuationCycle;
use crate::document::Node;
use crate::geometry::Point;
use crate::scene::Orientation;
use crate::scene::measure::{Bound, Measure};
use crate::scene::target::{MeasureReader, read_one_orientation};
use crate::scene::validate::find_unit;
use crate::study::spec::{StudyBody, Target};

const MAX_BOUNDS: usize = 1000;

/// Reads `target`.
pub fn read_target(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Target> {
    let either = Cell::new(false);
    let orientation = |n: Option<Node<'_>>| {
        let sense = n.map_or(Some(None), |n| {
            n.choice(&[
                ("counter_clockwise", Some(Orientation::CounterClockwise)),
                ("clockwise", Some(Orientation::Clockwise)),
                ("either", None),
            ])
        })?;
        either.set(sense.is_none());
        Some(sense.unwrap_or(Orientation::CounterClockwise))
    };
    let schedule = schedule_of_chambers(body);
    let goal = reader(schedule.as_ref(), &|n| read_probe(n, body), &orientation).goal(node)?;
    Some(Target {
        goal,
        either_sense: either.get(),
    })
}

/// Reads the target of a reduced model: the area that the middle of the right edge of a unit encloses.
pub fn read_end_of_unit(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Target> {
    let target = read_target(node, body)?;
    let Measure::EnclosedArea { probe, .. } = &target.goal.measure else {
        return node.fault("the reduced model knows the enclosed area alone");
    };
    if let Some(body) = body {
        let [w, h] = body.actuator.unit_mm;
        let unit = probe[0] / w;
        if unit < 1.0 || unit.fract() != 0.0 || probe[1] != h / 2.0 {
            return node.fault(format!(
                "the reduced model knows the ends of units alone, at x = {w}, {}, ... and y = {}",
                2.0 * w,
                h / 2.0
            ));
        }
    }
    Some(target)
}

/// Reads `bounds`.
pub fn read_bounds(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Vec<Bound<Point>>> {
    let probe = |n: &Node<'_>| read_probe(n, body);
    let schedule = schedule_of_chambers(body);
    let reader = reader(schedule.as_ref(), &probe, &read_one_orientation);
    node.each(0, MAX_BOUNDS, |n| reader.bound(n))
}

/// Measures are of the scenes of a study, in which every chamber has its own channel.
fn schedule_of_chambers(body: Option<&StudyBody>) -> Option<ActuationCycle> {
    body.map(|b| b.actuator.layout.schedule(&b.actuation))
}

fn reader<'a>(
    actuation: Option<&'a ActuationCycle>,
    probe: &'a dyn Fn(&Node<'_>) -> Option<Point>,
    orientation: &'a dyn Fn(Option<Node<'_>>) -> Option<Orientation>,
) -> MeasureReader<'a, Point> {
    MeasureReader {
        suffix: "_mm",
        probe,
        orientation,
        actuation,
    }
}

/// A place, or "tip": the middle of the right edge of the last unit but one, since the end face itself bulges.
///
/// A probe stays in the solid whatever the design, so it lies in no chamber's domain.
fn read_probe(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Point> {
    if node.value().as_str() == Some("tip") {
        let actuator = &body?.actuator;
        let [w, h] = actuator.unit_mm;
        let before_last = (actuator.units - 1).max(1) as f64;
        return Some([before_last * w, 0.5 * h]);
    }
    let probe = node.pair()?;
    let Some(body) = body else {
        return Some(probe);
    };
    let actuator = &body.actuator;
    let (_, [x, y]) = find_unit(node, probe, actuator.unit_mm, actuator.units)?;
    for [[x0, y0], [x1, y1]] in actuator.boxes().domains() {
        if x0 < x && x < x1 && y0 < y && y < y1 {
            return node
                .fault("the point is in a chamber's domain, so that it may fall into a chamber");
        }
    }
    Some(probe)
}

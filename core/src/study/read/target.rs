//! Reads a step's target and the bounds among its constraints.

use std::cell::Cell;

use crate::document::Node;
use crate::geometry::Point;
use crate::scene::Orientation;
use crate::scene::measure::Bound;
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
    let goal = reader(body, &|n| read_probe(n, body), &orientation).goal(node)?;
    Some(Target {
        goal,
        either_sense: either.get(),
    })
}

/// Reads `bounds`.
pub fn read_bounds(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Vec<Bound<Point>>> {
    let probe = |n: &Node<'_>| read_probe(n, body);
    let reader = reader(body, &probe, &read_one_orientation);
    node.each(0, MAX_BOUNDS, |n| reader.bound(n))
}

fn reader<'a>(
    body: Option<&'a StudyBody>,
    probe: &'a dyn Fn(&Node<'_>) -> Option<Point>,
    orientation: &'a dyn Fn(Option<Node<'_>>) -> Option<Orientation>,
) -> MeasureReader<'a, Point> {
    MeasureReader {
        suffix: "_mm",
        probe,
        orientation,
        actuation: body.map(|b| &b.actuation),
    }
}

/// A probe stays in the solid whatever the design, so it lies in no chamber's domain.
fn read_probe(node: &Node<'_>, body: Option<&StudyBody>) -> Option<Point> {
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

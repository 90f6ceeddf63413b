//! Reads rigid obstacles.

use serde_json::{Value, json};

use super::mesh_file::read_channel;
use crate::actuation::ActuationCycle;
use crate::document::{Node, Object};
use crate::geometry::{Actuator, Obstacle, Outline, Point, polygon};

const MAX_OBSTACLES: usize = 100;
const MAX_CORNERS: usize = 1000;

/// Reads the obstacles of a scene; none may cut the actuator where it starts.
pub fn read_obstacles(
    node: &Node<'_>,
    cycle: Option<&ActuationCycle>,
    actuator: Option<&Actuator>,
) -> Option<Vec<Obstacle>> {
    let obstacles = node.each(0, MAX_OBSTACLES, |n| read_obstacle(n, cycle, actuator))?;
    for (k, obstacle) in obstacles.iter().enumerate() {
        if obstacles[..k].iter().any(|o| o.name == obstacle.name) {
            return node.fault(format!("the name \"{}\" comes twice", obstacle.name));
        }
    }
    Some(obstacles)
}

/// Document form of an obstacle.
pub fn obstacle_document(obstacle: &Obstacle) -> Value {
    json!(obstacle)
}

fn read_obstacle(
    node: &Node<'_>,
    cycle: Option<&ActuationCycle>,
    actuator: Option<&Actuator>,
) -> Option<Obstacle> {
    let object = node.object(&[
        "name",
        "shape",
        "points_mm",
        "centre_mm",
        "radius_mm",
        "travel_mm",
        "channel",
    ])?;
    let name = object
        .required("name")
        .and_then(|n| Some(n.text()?.to_owned()));
    let outline = read_outline(&object);
    let travel = object.or("travel_mm", [0.0; 2], Node::pair);
    let channel = read_channel(&object, cycle, travel.is_some_and(|t| t != [0.0; 2]));
    let obstacle = Obstacle {
        name: name?,
        outline: outline?,
        travel_mm: travel?,
        channel: channel?,
    };
    if let Some(actuator) = actuator
        && cuts(&obstacle, actuator)
    {
        return node.fault("cuts the actuator where it starts");
    }
    Some(obstacle)
}

fn read_outline(object: &Object<'_>) -> Option<Outline> {
    #[derive(Clone, Copy, PartialEq)]
    enum Shape {
        Line,
        Polygon,
        Circle,
    }
    let shape = object.required("shape").and_then(|n| {
        n.choice(&[
            ("line", Shape::Line),
            ("polygon", Shape::Polygon),
            ("circle", Shape::Circle),
        ])
    })?;
    let foreign: &[&str] = match shape {
        Shape::Circle => &["points_mm"],
        _ => &["centre_mm", "radius_mm"],
    };
    for name in foreign {
        if object.has(name) {
            object.fault(name, "is of another shape");
        }
    }
    let points = |least: usize, most: usize| {
        let points = object
            .required("points_mm")?
            .each(least, most, Node::pair)?;
        for (k, p) in points.iter().enumerate() {
            if *p == points[(k + 1) % points.len()] {
                object.fault("points_mm", format!("points {k} and the next are the same"));
                return None;
            }
        }
        Some(points)
    };
    match shape {
        Shape::Line => {
            let points = points(2, 2)?;
            Some(Outline::Line {
                points_mm: [points[0], points[1]],
            })
        }
        Shape::Polygon => {
            let points_mm = points(3, MAX_CORNERS)?;
            if !polygon::is_simple(&points_mm) {
                object.fault("points_mm", "the sides cross each other");
                return None;
            }
            Some(Outline::Polygon { points_mm })
        }
        Shape::Circle => {
            let centre_mm = object.required("centre_mm").and_then(|n| n.pair());
            let radius_mm = object.required("radius_mm").and_then(|n| n.positive());
            Some(Outline::Circle {
                centre_mm: centre_mm?,
                radius_mm: radius_mm?,
            })
        }
    }
}

/// Whether an outline meets the rectangle of the actuator.
fn cuts(obstacle: &Obstacle, actuator: &Actuator) -> bool {
    const SAMPLES: usize = 2000;
    let [w, h] = actuator.unit_mm;
    let length = w * actuator.units.len() as f64;
    let inside = |p: Point| (0.0..=length).contains(&p[0]) && (0.0..=h).contains(&p[1]);
    obstacle
        .sides()
        .iter()
        .any(|side| (0..=SAMPLES).any(|k| inside(side.point(k as f64 / SAMPLES as f64))))
}

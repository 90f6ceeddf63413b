//! The designs that the tests mesh.

use crate::geometry::{Actuator, LayoutBoxes, Point, Unit, cascade};

pub(super) fn paper_unit(x: &[f64], n: usize) -> Actuator {
    cascade(&LayoutBoxes::PAPER.units(x).unwrap()[0], [80.0, 80.0], n)
}

pub(super) fn rectangles(width: f64, height: f64) -> Actuator {
    paper_unit(&LayoutBoxes::PAPER.rectangles([width, height]), 3)
}

pub(super) fn pair(lower: [Point; 4], upper: [Point; 4]) -> Actuator {
    let unit = Unit {
        chambers_mm: vec![lower.to_vec(), upper.to_vec()],
    };
    cascade(&unit, [80.0, 80.0], 3)
}

pub(super) fn slanted() -> Actuator {
    pair(
        [[6.0, 6.0], [60.0, 12.0], [74.0, 34.0], [25.0, 30.0]],
        [[10.0, 48.0], [70.0, 44.0], [66.0, 74.0], [30.0, 70.0]],
    )
}

/// Both chambers with a reflex corner.
pub(super) fn non_convex() -> Actuator {
    pair(
        [[35.0, 17.0], [76.0, 4.0], [70.0, 36.0], [4.0, 37.0]],
        [[5.0, 43.0], [75.0, 50.0], [42.0, 63.0], [12.0, 76.0]],
    )
}

/// The shapes that `numerics.md` and the acceptance lists name.
pub(super) fn named() -> Vec<(&'static str, Actuator)> {
    let mut list: Vec<(&str, Actuator)> = [
        ("void 1x1", 1.0, 1.0),
        ("40x15", 40.0, 15.0),
        ("20x35", 20.0, 35.0),
        ("60x25", 60.0, 25.0),
        ("60x30", 60.0, 30.0),
        ("40x37", 40.0, 37.0),
        ("50x37", 50.0, 37.0),
        ("70x37", 70.0, 37.0),
        ("76x36", 76.0, 36.0),
        ("76x37", 76.0, 37.0),
    ]
    .into_iter()
    .map(|(name, w, h)| (name, rectangles(w, h)))
    .collect();
    let box_at = |x0: f64, y0: f64, x1: f64, y1: f64| [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    list.push((
        "64x22",
        pair(box_at(8.0, 2.0, 72.0, 24.0), box_at(8.0, 56.0, 72.0, 78.0)),
    ));
    list.push(("slanted", slanted()));
    list.push(("non-convex", non_convex()));
    list.push((
        "trapezia wide inside",
        pair(
            [[30.0, 3.0], [50.0, 3.0], [76.0, 38.0], [4.0, 38.0]],
            [[4.0, 42.0], [76.0, 42.0], [50.0, 77.0], [30.0, 77.0]],
        ),
    ));
    list.push((
        "trapezia wide outside",
        pair(
            [[4.0, 3.0], [76.0, 3.0], [50.0, 38.0], [30.0, 38.0]],
            [[30.0, 42.0], [50.0, 42.0], [76.0, 77.0], [4.0, 77.0]],
        ),
    ));
    list
}

fn chain(units: Vec<Vec<Vec<Point>>>) -> Actuator {
    Actuator {
        unit_mm: [80.0, 80.0],
        units: units
            .into_iter()
            .map(|chambers_mm| Unit { chambers_mm })
            .collect(),
        repeated: false,
        corner_radius_mm: 0.0,
    }
}

pub(super) fn regular(n: usize, centre: Point, radius: f64, turn: f64) -> Vec<Point> {
    (0..n)
        .map(|k| {
            let a = turn + std::f64::consts::TAU * k as f64 / n as f64;
            [centre[0] + radius * a.cos(), centre[1] + radius * a.sin()]
        })
        .collect()
}

/// Layouts beyond the stacked pair.
pub(super) fn layouts() -> Vec<(&'static str, Actuator)> {
    let square = |x: f64, y: f64, a: f64| vec![[x, y], [x + a, y], [x + a, y + a], [x, y + a]];
    let stacked = vec![square(20.0, 4.0, 30.0), square(30.0, 44.0, 30.0)];
    vec![
        ("no chamber", chain(vec![vec![]])),
        (
            "triangle",
            chain(vec![vec![vec![[20.0, 15.0], [62.0, 22.0], [35.0, 66.0]]]]),
        ),
        (
            "triangle on its head",
            chain(vec![vec![regular(3, [40.0, 40.0], 35.0, -1.5)]]),
        ),
        (
            "octagon",
            chain(vec![vec![regular(8, [40.0, 40.0], 39.0, 0.2)]]),
        ),
        (
            "octagon along the axes",
            chain(vec![vec![regular(8, [40.0, 40.0], 30.0, 0.0)]]),
        ),
        (
            "star with reflex corners",
            chain(vec![vec![vec![
                [10.0, 10.0],
                [40.0, 25.0],
                [70.0, 10.0],
                [55.0, 40.0],
                [70.0, 70.0],
                [40.0, 55.0],
                [10.0, 70.0],
                [25.0, 40.0],
            ]]]),
        ),
        (
            "diamond",
            chain(vec![vec![regular(4, [40.0, 40.0], 38.0, 0.0)]]),
        ),
        (
            "pentagon and hexagon",
            chain(vec![vec![
                regular(5, [38.0, 20.0], 17.0, 0.3),
                regular(6, [44.0, 59.0], 18.0, 0.1),
            ]]),
        ),
        (
            "side by side",
            chain(vec![vec![
                square(45.0, 20.0, 30.0),
                square(4.0, 30.0, 35.0),
            ]]),
        ),
        (
            "side by side, tall and thin walls",
            chain(vec![vec![
                vec![[0.5, 0.5], [39.5, 0.5], [39.5, 79.5], [0.5, 79.5]],
                vec![[40.5, 0.5], [79.5, 0.5], [79.5, 79.5], [40.5, 79.5]],
            ]]),
        ),
        (
            "diagonal",
            chain(vec![vec![square(5.0, 5.0, 30.0), square(45.0, 45.0, 30.0)]]),
        ),
        (
            "diagonal, no axis separates",
            chain(vec![vec![
                vec![[5.0, 5.0], [60.0, 5.0], [5.0, 60.0]],
                vec![[75.0, 75.0], [22.0, 75.0], [75.0, 22.0]],
            ]]),
        ),
        (
            "unlike units",
            chain(vec![
                stacked.clone(),
                vec![],
                vec![regular(6, [40.0, 40.0], 30.0, 0.0)],
                vec![square(4.0, 20.0, 30.0), square(45.0, 30.0, 30.0)],
                stacked,
                vec![square(39.5, 39.5, 1.0)],
            ]),
        ),
    ]
}

pub(super) fn with_radius(mut actuator: Actuator, radius: f64) -> Actuator {
    actuator.corner_radius_mm = radius;
    actuator
}

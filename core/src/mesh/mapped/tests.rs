use std::collections::HashMap;

use super::*;
use crate::geometry::samples::Stratum;
use crate::geometry::{StackedPair, Unit, cascade, polygon, units_of_design};
use crate::mesh::{ElementKind, locate};

fn paper_unit(x: &[f64], n: usize) -> Actuator {
    cascade(&units_of_design(x).unwrap()[0], [80.0, 80.0], n)
}

fn rectangles(width: f64, height: f64) -> Actuator {
    paper_unit(&StackedPair::PAPER.rectangles([width, height]), 3)
}

fn pair(lower: [Point; 4], upper: [Point; 4]) -> Actuator {
    let unit = Unit {
        chambers_mm: vec![lower.to_vec(), upper.to_vec()],
    };
    cascade(&unit, [80.0, 80.0], 3)
}

fn slanted() -> Actuator {
    pair(
        [[6.0, 6.0], [60.0, 12.0], [74.0, 34.0], [25.0, 30.0]],
        [[10.0, 48.0], [70.0, 44.0], [66.0, 74.0], [30.0, 70.0]],
    )
}

/// Both chambers with a reflex corner.
fn non_convex() -> Actuator {
    pair(
        [[35.0, 17.0], [76.0, 4.0], [70.0, 36.0], [4.0, 37.0]],
        [[5.0, 43.0], [75.0, 50.0], [42.0, 63.0], [12.0, 76.0]],
    )
}

/// The shapes that `numerics.md` and the acceptance lists name.
fn named() -> Vec<(&'static str, Actuator)> {
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

fn regular(n: usize, centre: Point, radius: f64, turn: f64) -> Vec<Point> {
    (0..n)
        .map(|k| {
            let a = turn + std::f64::consts::TAU * k as f64 / n as f64;
            [centre[0] + radius * a.cos(), centre[1] + radius * a.sin()]
        })
        .collect()
}

/// Layouts beyond the stacked pair.
fn layouts() -> Vec<(&'static str, Actuator)> {
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

fn mesh_of(actuator: &Actuator, element: PlanElement) -> MappedMesh {
    let plan = MeshPlan::choose(actuator, element, None).unwrap();
    build(actuator, &plan).unwrap()
}

fn solid_area(actuator: &Actuator) -> f64 {
    let voids: f64 = actuator
        .units
        .iter()
        .flat_map(|u| &u.chambers_mm)
        .map(|c| polygon::signed_area(c))
        .sum();
    actuator.units.len() as f64 * actuator.unit_mm[0] * actuator.unit_mm[1] - voids
}

fn corner_lists(d: &Discretisation) -> Vec<[u32; 4]> {
    let block = &d.mesh.blocks[0];
    block
        .nodes
        .chunks_exact(block.kind.nodes())
        .map(|n| [n[0], n[1], n[2], n[3]])
        .collect()
}

/// Area exact, sides of elements shared by two elements or on one boundary loop, loops closed.
fn check(name: &str, actuator: &Actuator, mesh: &MappedMesh) {
    let d = &mesh.discretisation;
    let position = |n: u32| d.mesh.nodes[n as usize];
    let area: f64 = corner_lists(d)
        .iter()
        .map(|c| polygon::signed_area(&c.map(position)))
        .sum();
    let exact = solid_area(actuator);
    assert!(
        (area - exact).abs() < 1e-10 * exact,
        "{name}: area {area}, exact {exact}"
    );

    let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
    for c in corner_lists(d) {
        for k in 0..4 {
            *sides.entry((c[k], c[(k + 1) % 4])).or_default() += 1;
        }
    }
    assert!(sides.values().all(|n| *n == 1), "{name}: a side twice");
    let open: Vec<_> = sides
        .keys()
        .filter(|(a, b)| !sides.contains_key(&(*b, *a)))
        .collect();
    let boundary: Vec<_> = d.boundary.iter().flat_map(|l| &l.edges).collect();
    assert_eq!(open.len(), boundary.len(), "{name}");
    for e in &boundary {
        assert!(
            sides.contains_key(&(e.ends[0], e.ends[1])),
            "{name}: solid not on the left"
        );
    }
    let loop_area = |edges: &[BoundaryEdge]| {
        for k in 0..edges.len() {
            assert_eq!(
                edges[k].ends[1],
                edges[(k + 1) % edges.len()].ends[0],
                "{name}"
            );
        }
        polygon::signed_area(
            &edges
                .iter()
                .map(|e| position(e.ends[0]))
                .collect::<Vec<_>>(),
        )
    };
    let enclosed: f64 = d.boundary.iter().map(|l| loop_area(&l.edges)).sum();
    assert!((enclosed - exact).abs() < 1e-10 * exact, "{name}");
    for l in &d.boundary {
        assert_eq!(l.edges.len(), l.starts_at_corner.len());
    }

    // Cavities: area and corners of the chambers that they stand for.
    let chambers: Vec<_> = actuator
        .units
        .iter()
        .flat_map(|u| u.chambers_mm.iter().enumerate())
        .collect();
    assert_eq!(d.cavities.len(), chambers.len());
    assert_eq!(d.boundary.len(), chambers.len() + 1);
    for (((channel, corners), cavity), void) in
        chambers.iter().zip(&d.cavities).zip(&d.boundary[1..])
    {
        assert_eq!(cavity.channel, *channel);
        assert!(cavity.closed);
        let exact = polygon::signed_area(corners);
        assert!(
            (loop_area(&cavity.edges) - exact).abs() < 1e-10 * exact,
            "{name}"
        );
        let marked = void.starts_at_corner.iter().filter(|c| **c).count();
        assert_eq!(marked, corners.len(), "{name}");
    }
    if d.mesh.blocks[0].kind == ElementKind::Quad9 {
        for e in &boundary {
            let mid = position(e.mid.unwrap());
            for c in 0..2 {
                let mean = f64::midpoint(position(e.ends[0])[c], position(e.ends[1])[c]);
                assert!((mid[c] - mean).abs() < 1e-10, "{name}: mid-side node");
            }
        }
    }
    let supported: Vec<_> = d.supports.iter().map(|s| s.node).collect();
    for (n, p) in d.mesh.nodes.iter().enumerate() {
        assert_eq!(p[0] == 0.0, supported.contains(&(n as u32)), "{name}");
    }
    assert_eq!(corner_lists(d).len(), mesh.plan().elements());
}

#[test]
fn named_designs_mesh_with_both_elements() {
    for (name, actuator) in named() {
        for element in [PlanElement::Quad4, PlanElement::Quad9] {
            let mesh = mesh_of(&actuator, element);
            check(name, &actuator, &mesh);
            assert!(
                mesh.scaled_jacobian > 0.3,
                "{name}: {}",
                mesh.scaled_jacobian
            );
        }
    }
}

#[test]
fn other_layouts_mesh() {
    for (name, actuator) in layouts() {
        let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
        let mesh = build(&actuator, &plan).unwrap_or_else(|e| panic!("{name}: {e}"));
        check(name, &actuator, &mesh);
        assert!(
            mesh.scaled_jacobian > 0.05,
            "{name}: {}",
            mesh.scaled_jacobian
        );
    }
}

/// Every design of a stratum on its own plan: the scaled corner Jacobian and the lower bound of the Jacobian.
fn check_stratum(stratum: Stratum, designs: std::ops::Range<usize>) {
    for index in designs {
        let x = stratum.design(&StackedPair::PAPER, 20_230_328, index);
        let actuator = paper_unit(&x, 1);
        let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
        let mesh = build(&actuator, &plan).unwrap_or_else(|e| panic!("{stratum:?} {index}: {e}"));
        let bound = quality::least_jacobian_bound(&mesh.discretisation.mesh);
        assert!(
            mesh.scaled_jacobian >= 0.05 && bound > 0.0,
            "{stratum:?} {index}: {} {bound}",
            mesh.scaled_jacobian
        );
    }
}

#[test]
fn random_designs_mesh_without_slivers() {
    for stratum in Stratum::ALL {
        check_stratum(stratum, 0..300);
    }
}

#[test]
fn the_thinnest_sheared_wall_meshes() {
    // Chambers that overlap by 1 mm along a wall of 2 mm, and by nothing else: block lines run 37 mm along it.
    let actuator = pair(
        [[2.0, 2.0], [40.5, 2.0], [40.5, 39.0], [2.0, 39.0]],
        [[39.5, 41.0], [78.0, 41.0], [78.0, 78.0], [39.5, 78.0]],
    );
    let mesh = mesh_of(&actuator, PlanElement::Quad9);
    check("sheared", &actuator, &mesh);
    assert!(mesh.scaled_jacobian > 0.07, "{}", mesh.scaled_jacobian);
}

#[test]
fn a_spike_is_a_corner_of_its_rectangle() {
    // A spike of 3.5 degrees has three blocks of 119 degrees, although another choice lies nearer the diagonals.
    let actuator = pair(
        [[39.4, 2.1], [77.5, 20.0], [40.7, 21.2], [39.4, 38.9]],
        [[2.9, 59.0], [77.5, 41.4], [77.7, 60.5], [2.9, 60.5]],
    );
    let mesh = mesh_of(&actuator, PlanElement::Quad9);
    check("spike", &actuator, &mesh);
    assert!(mesh.scaled_jacobian > 0.1, "{}", mesh.scaled_jacobian);
}

/// A smooth function of all node positions, with its gradient.
fn measure(nodes: &[Point]) -> (f64, Vec<Point>) {
    let mut sum = 0.0;
    let gradient = nodes
        .iter()
        .enumerate()
        .map(|(n, p)| {
            let phase = 0.7 * n as f64;
            let (a, b) = (0.05 * p[0] + phase, 0.04 * p[1] - phase);
            sum += a.sin() + (2.0 * b).cos() + 0.01 * p[0] * p[1];
            [
                0.05 * a.cos() + 0.01 * p[1],
                -0.08 * (2.0 * b).sin() + 0.01 * p[0],
            ]
        })
        .collect();
    (sum, gradient)
}

/// `h`: step of the differences, mm; `bound`: of their deviation, relative.
fn check_pull_back(name: &str, actuator: &Actuator, h: f64, bound: f64) {
    let plan = MeshPlan::choose(actuator, PlanElement::Quad9, None).unwrap();
    let mesh = build(actuator, &plan).unwrap();
    let pulled = mesh.pull_back(&measure(&mesh.discretisation.mesh.nodes).1);
    assert_eq!(pulled.len(), actuator.units.len());
    let distinct = if actuator.repeated { 1 } else { pulled.len() };
    let largest = pulled
        .iter()
        .flatten()
        .flatten()
        .flatten()
        .fold(0.0_f64, |m, g| m.max(g.abs()));
    for unit in 0..distinct {
        for (chamber, corners) in actuator.units[unit].chambers_mm.iter().enumerate() {
            for corner in 0..corners.len() {
                for c in 0..2 {
                    let at = |step: f64| {
                        let mut moved = actuator.clone();
                        for (u, content) in moved.units.iter_mut().enumerate() {
                            if actuator.repeated || u == unit {
                                content.chambers_mm[chamber][corner][c] += step;
                            }
                        }
                        measure(&build(&moved, &plan).unwrap().discretisation.mesh.nodes).0
                    };
                    // Fourth order, so that truncation is far below the bound.
                    let difference =
                        (8.0 * (at(h) - at(-h)) - at(2.0 * h) + at(-2.0 * h)) / (12.0 * h);
                    let exact: f64 = if actuator.repeated {
                        pulled.iter().map(|u| u[chamber][corner][c]).sum()
                    } else {
                        pulled[unit][chamber][corner][c]
                    };
                    assert!(
                        (difference - exact).abs() < bound * largest.max(1.0),
                        "{name}: unit {unit}, chamber {chamber}, corner {corner}, {c}: {difference} {exact}"
                    );
                }
            }
        }
    }
}

#[test]
fn pull_back_agrees_with_differences() {
    for (name, actuator) in [
        ("40x15", rectangles(40.0, 15.0)),
        ("slanted", slanted()),
        ("non-convex", non_convex()),
    ] {
        check_pull_back(name, &actuator, 2e-3, 1e-8);
    }
    let units: Vec<Unit> = [slanted(), rectangles(76.0, 36.0), non_convex()]
        .iter()
        .map(|a| a.units[0].clone())
        .collect();
    check_pull_back(
        "free units",
        &Actuator {
            unit_mm: [80.0, 80.0],
            units,
            repeated: false,
            corner_radius_mm: 0.0,
        },
        2e-3,
        1e-8,
    );
    for (name, actuator) in layouts() {
        if ["triangle", "octagon", "unlike units"].contains(&name) {
            check_pull_back(name, &actuator, 2e-3, 1e-8);
        }
    }
}

fn with_radius(mut actuator: Actuator, radius: f64) -> Actuator {
    actuator.corner_radius_mm = radius;
    actuator
}

#[test]
fn pull_back_through_rounded_corners_agrees_with_differences() {
    for (name, actuator, radius) in [
        ("40x15", rectangles(40.0, 15.0), 0.5),
        ("slanted", slanted(), 3.0),
        ("non-convex", non_convex(), 0.5),
        ("void", rectangles(1.0, 1.0), 0.5),
    ] {
        check_pull_back(name, &with_radius(actuator, radius), 1e-4, 1e-7);
    }
}

/// Area within a cavity's quadratic edges.
fn cavity_area(d: &Discretisation, cavity: &Cavity) -> f64 {
    let at = |n: u32| d.mesh.nodes[n as usize];
    cavity
        .edges
        .iter()
        .map(|e| {
            let (a, b, m) = (at(e.ends[0]), at(e.ends[1]), at(e.mid.unwrap()));
            let bulge = polygon::cross(polygon::difference(a, m), polygon::difference(a, b));
            0.5 * polygon::cross(a, b) + 2.0 / 3.0 * bulge
        })
        .sum()
}

#[test]
fn a_rounded_chamber_has_the_area_of_its_arcs() {
    for (radius, bound) in [(0.1, 2e-3), (0.5, 0.01), (3.0, 0.03)] {
        let mesh = mesh_of(
            &with_radius(rectangles(40.0, 15.0), radius),
            PlanElement::Quad9,
        );
        let exact = 600.0 - (4.0 - std::f64::consts::PI) * radius * radius;
        let d = &mesh.discretisation;
        let error = (cavity_area(d, &d.cavities[0]) - exact).abs();
        assert!(error < bound, "{radius}: {error}");
        assert!(mesh.scaled_jacobian > 0.3);
    }
}

#[test]
fn random_designs_mesh_with_rounded_corners() {
    for (stratum, may_fold) in [
        (Stratum::Uniform, 0),
        (Stratum::NearOuterEdges, 0),
        // Corners at the far ends of a sheared wall: see `docs/decisions/block-map.md`.
        (Stratum::NearBounds, 12),
    ] {
        let mut folds = 0;
        for index in 0..60 {
            let x = stratum.design(&StackedPair::PAPER, 20_230_328, index);
            let actuator = with_radius(paper_unit(&x, 1), 0.5);
            let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
            match build(&actuator, &plan) {
                Ok(mesh) => {
                    let bound = quality::least_jacobian_bound(&mesh.discretisation.mesh);
                    assert!(bound > 0.0, "{stratum:?} {index}");
                }
                Err(InfeasibleGeometry::MeshFolds { .. }) => folds += 1,
                Err(other) => panic!("{stratum:?} {index}: {other}"),
            }
        }
        assert!(folds <= may_fold, "{stratum:?}: {folds}");
    }
}

#[test]
fn a_plan_follows_other_designs() {
    // From the 1 x 1 start to random designs, and between random designs, in one leap.
    let start = paper_unit(&StackedPair::PAPER.common_start(), 3);
    let mut plan = MeshPlan::choose(&start, PlanElement::Quad9, None).unwrap();
    for index in 0..100 {
        let x = Stratum::Uniform.design(&StackedPair::PAPER, 7, index);
        let actuator = paper_unit(&x, 3);
        let mesh = build(&actuator, &plan).unwrap();
        assert!(mesh.scaled_jacobian > quality::SCALED_JACOBIAN_FLOOR);
        plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
    }
}

#[test]
fn nodes_move_smoothly_with_the_design() {
    // Along a straight line between two designs no node jumps.
    let (a, b) = (slanted(), non_convex());
    let plan = MeshPlan::choose(&a, PlanElement::Quad9, None).unwrap();
    let at = |t: f64| {
        let mut actuator = a.clone();
        for (unit, other) in actuator.units.iter_mut().zip(&b.units) {
            for (p, q) in unit
                .chambers_mm
                .iter_mut()
                .flatten()
                .zip(other.chambers_mm.iter().flatten())
            {
                *p = [0, 1].map(|c| p[c] + t * (q[c] - p[c]));
            }
        }
        build(&actuator, &plan).unwrap().discretisation.mesh.nodes
    };
    let steps = 200;
    let mut before = at(0.0);
    for k in 1..=steps {
        let now = at(k as f64 / steps as f64);
        let moved = before
            .iter()
            .zip(&now)
            .map(|(p, q)| polygon::distance(*p, *q))
            .fold(0.0, f64::max);
        // Corners move 0.3 mm a step at most.
        assert!(moved < 1.0, "step {k}: {moved} mm");
        before = now;
    }
}

#[test]
fn a_largest_size_holds_for_every_edge() {
    for (name, actuator) in named() {
        for (element, limit) in [(PlanElement::Quad9, 3.0), (PlanElement::Quad4, 0.9)] {
            let plan = MeshPlan::choose(&actuator, element, Some(limit)).unwrap();
            let mesh = build(&actuator, &plan).unwrap();
            assert!(
                mesh.longest_edge_mm <= limit * (1.0 + 1e-12),
                "{name}: {} mm",
                mesh.longest_edge_mm
            );
        }
    }
}

#[test]
fn a_refined_plan_is_nested() {
    let actuator = slanted();
    let plan = MeshPlan::choose(&actuator, PlanElement::Quad9, None).unwrap();
    let (coarse, fine) = (
        build(&actuator, &plan).unwrap(),
        build(&actuator, &plan.refined(2)).unwrap(),
    );
    check("refined", &actuator, &fine);
    assert_eq!(plan.refined(2).elements(), 4 * plan.elements());
    assert!(plan.same_counts(&plan) && !plan.same_counts(&plan.refined(2)));
    // A coarse quad9 node is a corner of the fine mesh.
    let mut places: Vec<Point> = fine.discretisation.mesh.nodes.clone();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for p in &coarse.discretisation.mesh.nodes {
        let start = places.partition_point(|q| q[0] < p[0] - 1e-9);
        let found = places[start..]
            .iter()
            .take_while(|q| q[0] <= p[0] + 1e-9)
            .any(|q| (q[1] - p[1]).abs() < 1e-9);
        assert!(found);
    }
}

#[test]
fn a_plan_survives_its_document() {
    let plan = MeshPlan::choose(&slanted(), PlanElement::Quad9, None).unwrap();
    let text = serde_json::to_string(&plan).unwrap();
    assert_eq!(serde_json::from_str::<MeshPlan>(&text).unwrap(), plan);
}

#[test]
fn what_is_not_supported_is_said() {
    let mut three = rectangles(20.0, 10.0).units[0].clone();
    three.chambers_mm.push(regular(4, [70.0, 40.0], 2.0, 0.5));
    let outside = regular(4, [2.0, 40.0], 5.0, 0.0);
    for unit in [
        three,
        Unit {
            chambers_mm: vec![outside],
        },
        Unit {
            chambers_mm: vec![
                regular(4, [40.0, 30.0], 20.0, 0.5),
                regular(4, [40.0, 45.0], 20.0, 0.5),
            ],
        },
    ] {
        let actuator = cascade(&unit, [80.0, 80.0], 2);
        assert!(matches!(
            MeshPlan::choose(&actuator, PlanElement::Quad9, None),
            Err(InfeasibleGeometry::UnsupportedLayout { unit: 0, .. })
        ));
    }
    let plan = MeshPlan::choose(&slanted(), PlanElement::Quad9, None).unwrap();
    let other = cascade(
        &Unit {
            chambers_mm: vec![],
        },
        [80.0, 80.0],
        3,
    );
    assert!(build(&other, &plan).is_err());
}

#[test]
fn points_are_located() {
    let mesh = mesh_of(&slanted(), PlanElement::Quad9);
    let d = &mesh.discretisation;
    for at in [
        [160.0, 40.0],
        [240.0, 40.0],
        [0.0, 0.0],
        [6.0, 6.0],
        [83.0, 3.0],
    ] {
        let found = locate(&d.mesh, at).unwrap();
        let block = &d.mesh.blocks[found.block];
        let nodes = &block.nodes[9 * found.element..9 * found.element + 9];
        let x: Vec<Point> = nodes.iter().map(|n| d.mesh.nodes[*n as usize]).collect();
        let (p, _) = crate::mesh::locate::map(block.kind, &x, found.local);
        assert!(polygon::distance(p, at) < 1e-10);
    }
    for outside in [[40.0, 20.0], [-0.1, 40.0], [250.0, 40.0]] {
        assert!(locate(&d.mesh, outside).is_none());
    }
}

//! Every accepted design has a mesh: areas, sides, cavities, boundaries, shapes of elements.

use std::collections::HashMap;

use super::super::*;
use super::mesh_of;
use super::shapes::{layouts, named, pair, paper_unit, rectangles, regular, slanted};
use crate::geometry::samples::Stratum;
use crate::geometry::{LayoutBoxes, Unit, cascade, polygon};
use crate::mesh::{ElementKind, locate};

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
pub(super) fn check(name: &str, actuator: &Actuator, mesh: &MappedMesh) {
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
        let x = stratum.design(&LayoutBoxes::PAPER, 20_230_328, index);
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

/// Three and four chambers, in rows in both directions, straight and slanted, in any order.
#[test]
fn longer_rows_of_chambers_mesh() {
    let slanted = |k: usize| {
        let y = 4.0 + 18.5 * k as f64;
        vec![[4.0, y], [76.0, y + 5.0], [76.0, y + 15.0], [4.0, y + 10.0]]
    };
    let square = |k: usize| regular(4, [40.0, 12.0 + 18.0 * k as f64], 7.0, 0.4);
    let between = rectangles(20.0, 10.0).units[0].clone();
    let rows: [Vec<Vec<Point>>; 4] = [
        (0..3).map(slanted).collect(),
        [3, 0, 2, 1].map(square).to_vec(),
        [
            between.chambers_mm,
            vec![regular(4, [70.0, 40.0], 2.0, 0.5)],
        ]
        .concat(),
        (0..3)
            .map(|k| regular(5, [16.0 + 24.0 * k as f64, 40.0], 9.0, 0.3))
            .collect(),
    ];
    for (k, chambers_mm) in rows.into_iter().enumerate() {
        let turned = chambers_mm
            .iter()
            .map(|c| c.iter().map(|[x, y]| [*y, *x]).rev().collect())
            .collect();
        for chambers_mm in [chambers_mm, turned] {
            let count = chambers_mm.len();
            let unit = Unit { chambers_mm };
            let mesh = mesh_of(&cascade(&unit, [80.0, 80.0], 2), PlanElement::Quad9);
            assert!(mesh.scaled_jacobian > 0.2, "{k}: {}", mesh.scaled_jacobian);
            let bound = quality::least_jacobian_bound(&mesh.discretisation.mesh);
            assert!(bound > 0.0, "{k}: {bound}");
            assert_eq!(mesh.discretisation.cavities.len(), 2 * count);
        }
    }
}

#[test]
fn what_is_not_supported_is_said() {
    let mut three = rectangles(20.0, 10.0).units[0].clone();
    three.chambers_mm.push(regular(4, [70.0, 20.0], 2.0, 0.5));
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

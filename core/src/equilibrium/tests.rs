//! Thick cylinder under internal pressure, plane strain (closed form for an incompressible neo-Hookean solid).

use super::*;
use crate::actuation::{ActuationCycle, Spacing};
use crate::assembly::{State, System};
use crate::material::{HyperelasticModel, MaterialLaw};
use crate::mesh::{BoundaryEdge, Cavity, Discretisation, ElementBlock, ElementKind, Mesh, Support};

/// A quarter of a cylinder 1 <= r <= 2 with n x n elements, curved sides through mid-side nodes on the circles.
fn quarter(kind: ElementKind, n: usize) -> Discretisation {
    let order = if kind == ElementKind::Quad9 { 2 } else { 1 };
    let m = order * n + 1;
    let at = |i: usize, j: usize| {
        let r = 1.0 + i as f64 / (m - 1) as f64;
        let t = j as f64 / (m - 1) as f64 * std::f64::consts::FRAC_PI_2;
        [r * t.cos(), r * t.sin()]
    };
    let id = |i: usize, j: usize| (j * m + i) as u32;
    let nodes = (0..m * m).map(|k| at(k % m, k / m)).collect();
    let mut elements = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let (a, b) = (order * i, order * j);
            let (c, d) = (a + order, b + order);
            elements.extend([id(a, b), id(c, b), id(c, d), id(a, d)]);
            if order == 2 {
                elements.extend([
                    id(a + 1, b),
                    id(c, b + 1),
                    id(a + 1, d),
                    id(a, b + 1),
                    id(a + 1, b + 1),
                ]);
            }
        }
    }
    let edges = (0..n)
        .map(|k| {
            // Travelled from theta = 0 upwards the bore is on the left.
            let (j, mid) = (order * k, (order == 2).then(|| id(0, order * k + 1)));
            BoundaryEdge {
                ends: [id(0, j), id(0, j + order)],
                mid,
            }
        })
        .collect();
    let mut supports = Vec::new();
    for i in 0..m {
        for (node, component) in [(id(i, 0), 1), (id(i, m - 1), 0)] {
            supports.push(Support {
                node,
                component,
                displacement_mm: 0.0,
                channel: 0,
            });
        }
    }
    let count = n * n;
    Discretisation {
        mesh: Mesh {
            nodes,
            blocks: vec![ElementBlock {
                kind,
                nodes: elements,
                material: vec![0; count],
                tag: (0..count as u32).collect(),
            }],
        },
        supports,
        cavities: vec![Cavity {
            channel: 0,
            edges,
            closing_points_mm: vec![[0.0, 0.0]],
            closed: false,
        }],
        ..Default::default()
    }
}

#[derive(Default)]
struct Last {
    inner: Vec<f64>,
    negative: usize,
}

impl StateVisitor for Last {
    fn accepted(&mut self, s: AcceptedState<'_>, _: &mut dyn Observer) -> f64 {
        self.inner.push(s.state.u[0][0]);
        self.negative += s.negative_pivots;
        1.0
    }
    fn stretch(&mut self, _: &System, _: &State) -> f64 {
        1.0
    }
}

fn inner_displacement(kind: ElementKind, n: usize) -> (f64, PathWork) {
    let law = MaterialLaw {
        model: HyperelasticModel::NeoHookean { c10_mpa: 0.5 },
        bulk_over_shear: 1e6,
        fit_stretch: None,
    };
    let system = System::new(quarter(kind, n), &[law]).unwrap();
    let mut solver = system.solver().unwrap();
    let cycle = ActuationCycle {
        rows_kpa: vec![vec![0.0], vec![275.712]],
        load_steps_per_leg: 4,
        spacing: Spacing::Equal,
    };
    let mut last = Last::default();
    let settings = Settings {
        tolerance: 1e-10,
        ..Settings::default()
    };
    let PathReport { end, work, .. } = follow(
        &system,
        &mut solver,
        &cycle,
        &settings,
        &mut last,
        &mut Unobserved,
    );
    assert_eq!(end, PathEnd::Complete);
    assert_eq!(last.negative, 0);
    (*last.inner.last().unwrap(), work)
}

#[test]
fn thick_cylinder_orders() {
    for (kind, least_order) in [(ElementKind::Quad9, 3.0), (ElementKind::Quad4, 1.8)] {
        let errors: Vec<f64> = [2, 4, 8, 16]
            .iter()
            .map(|&n| {
                let (u, work) = inner_displacement(kind, n);
                println!("{kind:?} {n}: u {u} error {:e} {work:?}", u - 0.25);
                (u - 0.25).abs()
            })
            .collect();
        let order = (errors[1] / errors[2]).log2();
        println!("order {order}");
        assert!(order > least_order, "{kind:?}: {errors:?}");
    }
}

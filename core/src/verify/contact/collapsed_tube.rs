//! A thin tube that collapses under suction until its opposite sides touch, against the elastica (`collapsing_ring`).
//!
//! ```text
//!      .--.___.--.     R = 30 mm, wall 1 mm, plane strain, mu = 1 MPa, K/mu = 1e3: EI = E* t^3 / 12, E* = E / (1 - nu^2)
//!     (   ___     )    suction in the bore: of a wall that keeps its volume the same as pressure outside
//!      '--'   '--'     drawn wider than high by 1/500, which decides where it buckles
//! ```

use std::f64::consts::TAU;

use serde_json::json;

use super::collapsing_ring::Quarter;
use super::joined::joined;
use super::plane_modulus;
use crate::equilibrium::Observer;
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, structured};
use crate::verify::bench::{Bench, Checked};
use crate::verify::problem::{MESH_FILE, Problem, Unsolved, file_kind};

const RADIUS: f64 = 30.0;
const WALL: f64 = 1.0;
const BULK_OVER_SHEAR: f64 = 1e3;
const ACTIVATION: f64 = 0.1;
const IMPERFECTION: f64 = 2e-3;
/// p R^3 / EI of the states: before the sides touch, and after.
const PRESSURES: [f64; 5] = [4.0, 5.0, 7.0, 8.0, 9.5];

fn bending() -> f64 {
    plane_modulus(BULK_OVER_SHEAR) * WALL.powi(3) / 12.0
}

/// EI / R^3, kPa.
pub fn unit_kpa() -> f64 {
    1e3 * bending() / RADIUS.powi(3)
}

/// The whole tube, of cells along it and through the wall.
pub fn problem(kind: GmshElementKind, [along, through]: [usize; 2]) -> Problem {
    let place = |s: f64, radius: f64| {
        let (sin, cos) = (TAU * s).sin_cos();
        let radius = radius + IMPERFECTION * RADIUS * (cos * cos - sin * sin);
        [radius * cos, radius * sin]
    };
    let outer = RADIUS + 0.5 * WALL;
    let part = structured(kind, [along, through], |s, t| place(s, outer - t * WALL));
    let mesh = joined(
        &[(part, &[("top", "bore")])],
        &[
            ("upright", place(0.25, outer)),
            ("upright", place(0.75, outer)),
            ("level", place(0.0, outer)),
            ("level", place(0.5, outer)),
        ],
    );
    let rows: Vec<[f64; 1]> = [0.0]
        .iter()
        .chain(&PRESSURES)
        .map(|p| [-p * unit_kpa()])
        .collect();
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": {"model": "neo_hookean", "c10_mpa": 0.5, "bulk_over_shear": BULK_OVER_SHEAR},
        "actuation": {"schedule": rows, "load_steps_per_leg": 1},
        "supports": [{"group": "upright", "fix": ["x"]}, {"group": "level", "fix": ["y"]}],
        "pressures": [{"group": "bore", "channel": 0}],
        "contact": "auto",
        "contact_activation_mm": ACTIVATION,
        "probes": {"side": place(0.0, RADIUS), "dent": place(0.25, RADIUS)},
        "relative_residual_force_tolerance": 1e-8
    });
    Problem {
        mesh,
        scene,
        driven: None,
    }
}

/// A state: half width and half height of the centre line over R, and Q R^2 / EI.
struct Found {
    width: f64,
    height: f64,
    contact: f64,
}

fn found(
    element: ElementKind,
    cells: [usize; 2],
    observer: &mut dyn Observer,
) -> Result<Vec<Found>, Unsolved> {
    let solved = problem(file_kind(element), cells).solve(observer)?;
    let nodes = &solved.analysis.system.body.mesh.nodes;
    let of_state = |state: usize| {
        let force: f64 = (nodes.iter().zip(solved.contact_forces(state)))
            .filter(|(x, _)| x[1] > 0.0)
            .map(|(_, f)| f[1])
            .sum();
        let drawn = |sign: f64| 1.0 + sign * IMPERFECTION;
        Found {
            width: drawn(1.0) + solved.displacement(0, state)[0] / RADIUS,
            height: drawn(-1.0) + solved.displacement(1, state)[1] / RADIUS,
            contact: force * RADIUS * RADIUS / bending(),
        }
    };
    Ok((1..=PRESSURES.len()).map(of_state).collect())
}

/// The tube on one element.
pub fn run(bench: &mut Bench<'_>, element: ElementKind) {
    let cells = match element {
        ElementKind::Quad9 | ElementKind::Tri7 => [96, 1],
        ElementKind::Quad4 => [576, 6],
    };
    let states = match found(element, cells, bench.observer()) {
        Ok(states) => states,
        Err(reason) => return bench.unsolved("half width", &reason),
    };
    for (pressure, state) in PRESSURES.into_iter().zip(states) {
        // Where the sides touch their height is what the wall and the gap leave.
        let least = if state.contact > 0.0 {
            state.height
        } else {
            0.0
        };
        let exact = Quarter::under(pressure, least);
        bench.check(Checked {
            quantity: format!("p R^3 / EI = {pressure}: half width / R"),
            value: state.width,
            expected: exact.width,
            scale: exact.width,
            bound: 0.002,
            orders: None,
        });
        if state.contact > 0.0 {
            bench.check(Checked {
                quantity: format!("p R^3 / EI = {pressure}: Q R^2 / EI"),
                value: state.contact,
                expected: exact.contact,
                scale: exact.contact,
                bound: 0.02,
                orders: None,
            });
        }
    }
}

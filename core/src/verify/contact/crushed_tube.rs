//! A thin tube crushed between two rigid plates, against the elastica (`crushed_ring`).
//!
//! ```text
//!    (|        |)        R = 50 mm, wall 1 mm, plane strain, mu = 1 MPa, K/mu = 1e3: EI = E* t^3 / 12, E* = E / (1 - nu^2)
//!     \        /         the lower half: its ends at y = 0 slide on that line, the plate rises
//!      '-.__.-'
//!   ===== plate =====
//! ```

use std::f64::consts::PI;

use serde_json::json;

use super::joined::joined;
use super::{crushed_ring, plane_modulus};
use crate::equilibrium::Observer;
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, structured};
use crate::verify::bench::{Bench, Checked};
use crate::verify::problem::{MESH_FILE, Problem, Unsolved, file_kind};

const RADIUS: f64 = 50.0;
const WALL: f64 = 1.0;

const BULK_OVER_SHEAR: f64 = 1e3;
const ACTIVATION: f64 = 0.05;

/// States, and the plate's travel over R in the last.
const STATES: usize = 8;
const CLOSING: f64 = 0.8;

/// The lower half, of cells along it and through the wall.
pub fn problem(kind: GmshElementKind, along: usize, through: usize) -> Problem {
    let low = RADIUS + 0.5 * WALL;
    let part = structured(kind, [along, through], |s, t| {
        let radius = low - t * WALL;
        let (sin, cos) = (PI * (s - 0.5)).sin_cos();
        // The ends lie on y = 0 to the last bit.
        let cos = if s == 0.0 || s == 1.0 { 0.0 } else { cos };
        [radius * sin, -radius * cos]
    });
    let mesh = joined(
        &[(part, &[("left", "ends"), ("right", "ends")])],
        &[("lowest", [0.0, -low])],
    );
    let y = -low - ACTIVATION;
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": {"model": "neo_hookean", "c10_mpa": 0.5, "bulk_over_shear": BULK_OVER_SHEAR},
        "actuation": {"schedule": [[0], [1]], "load_steps_per_leg": STATES},
        "supports": [{"group": "ends", "fix": ["y"]}, {"group": "lowest", "fix": ["x"]}],
        "contact": "on",
        "contact_activation_mm": ACTIVATION,
        "obstacles": [{
            "name": "plate",
            "shape": "line",
            "points_mm": [[-1.6 * RADIUS, y], [1.6 * RADIUS, y]],
            "travel_mm": [0.0, CLOSING * RADIUS],
        }],
        "relative_residual_force_tolerance": 1e-9
    });
    Problem {
        mesh,
        scene,
        driven: None,
    }
}

/// Half height of the centre line over R, and P R^2 / EI, at each state.
fn found(
    element: ElementKind,
    [along, through]: [usize; 2],
    observer: &mut dyn Observer,
) -> Result<Vec<[f64; 2]>, Unsolved> {
    let solved = problem(file_kind(element), along, through).solve(observer)?;
    let bending = plane_modulus(BULK_OVER_SHEAR) * WALL.powi(3) / 12.0;
    (1..=STATES)
        .map(|state| {
            let contact = solved.contact(state)?;
            let travel = CLOSING * RADIUS * state as f64 / STATES as f64;
            // The surface stays above the plate by about the least distance.
            let height =
                RADIUS + ACTIVATION - travel - contact.least_distance_mm.unwrap_or(ACTIVATION);
            let force = -contact.on_obstacle[0][1];
            Ok([height / RADIUS, force * RADIUS * RADIUS / bending])
        })
        .collect()
}

/// The tube on one element.
pub fn run(bench: &mut Bench<'_>, element: ElementKind) {
    // Bilinear elements are stiff in bending by the square of their thickness.
    let (cells, bound) = match element {
        ElementKind::Quad9 | ElementKind::Tri7 => ([64, 1], 0.01),
        ElementKind::Quad4 => ([480, 6], 0.015),
    };
    let states = match found(element, cells, bench.observer()) {
        Ok(states) => states,
        Err(reason) => return bench.unsolved("force", &reason),
    };
    for [height, force] in states {
        let expected = crushed_ring::force(height);
        bench.check(Checked {
            quantity: format!("closed by {:.0} %: P R^2 / EI", 100.0 * (1.0 - height)),
            value: force,
            expected,
            scale: expected,
            bound,
            orders: None,
        });
    }
}

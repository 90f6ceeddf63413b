//! Homogeneous stretch and simple shear of a unit square of distorted elements, for a law of each kind: the mean stress from
//! the reactions against closed forms, and the displacement of the inner nodes against the linear field.
//!
//! *Stretch* by l along x, free across: P11 = (stress difference at l) / l for an incompressible law; with K/mu = 1e6 it is off
//! by about the stress over K. *Shear* by g on the whole boundary: P12 = the closed form's shear stress, exactly, since J = 1.

use std::f64::consts::PI;

use serde_json::json;

use super::bench::{Bench, Checked};
use super::problem::{MESH_FILE, Problem, Solved, Unsolved, file_kind};
use crate::geometry::Point;
use crate::material::MaterialLaw;
use crate::material::closed_form::{one_of_each, shear_stress, stress_difference};
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, GmshFile, structured};
use crate::scene::material_document;

const BULK_OVER_SHEAR: f64 = 1e6;
/// Within the stable range of every law: the Yeoh one loses ellipticity at a shear of 1.84, a stretch of 2.28.
const STRETCHES: [f64; 2] = [1.2, 2.0];
const SHEARS: [f64; 2] = [0.5, 1.5];

/// A square whose inner lines are bent.
fn square(kind: GmshElementKind) -> GmshFile {
    structured(kind, [3, 3], |s, t| {
        let bent = 0.06 * (PI * s).sin() * (PI * t).sin();
        let inside = s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0;
        if inside { [s + bent, t - bent] } else { [s, t] }
    })
}

/// Stretched along x by `stretch`.
pub fn stretch_problem(kind: GmshElementKind, law: &MaterialLaw, stretch: f64) -> Problem {
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": material_document(law),
        "actuation": {"schedule": [[0], [1]], "load_steps_per_leg": 4},
        "supports": [
            {"group": "left", "fix": ["x"]},
            {"group": "bottom", "fix": ["y"]},
            {"group": "right", "fix": ["x"], "displacement_mm": [stretch - 1.0, 0], "channel": 0}
        ],
        "relative_residual_force_tolerance": 1e-11
    });
    Problem {
        mesh: square(kind),
        scene,
        driven: None,
    }
}

/// Sheared by `shear`.
pub fn shear_problem(kind: GmshElementKind, law: &MaterialLaw, shear: f64) -> Problem {
    let held = |group: &str| json!({"group": group, "fix": ["x", "y"]});
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": material_document(law),
        "actuation": {"schedule": [[0], [1]], "load_steps_per_leg": 4},
        "supports": (["bottom", "right", "top", "left"].map(held)),
        "relative_residual_force_tolerance": 1e-11
    });
    let boundary = move |[x, y]: Point| {
        let edge = [x, y].iter().any(|v| *v == 0.0 || *v == 1.0);
        edge.then(|| vec![[shear * y, 0.0]])
    };
    Problem {
        mesh: square(kind),
        scene,
        driven: Some(Box::new(boundary)),
    }
}

/// Mean first Piola-Kirchhoff stress of the square, component `i` on the face of normal `j`: its area is 1.
fn mean_stress(solved: &Solved, i: usize, j: usize) -> f64 {
    let nodes = &solved.analysis.system.body.mesh.nodes;
    let forces = solved.internal_forces(solved.last());
    forces.iter().zip(nodes).map(|(f, x)| f[i] * x[j]).sum()
}

/// Largest distance of a displacement from the linear field `f` X - X.
fn largest_deviation(solved: &Solved, f: [[f64; 2]; 2]) -> f64 {
    let nodes = &solved.analysis.system.body.mesh.nodes;
    let places = solved.positions(solved.last());
    (nodes.iter().zip(places))
        .map(|(x, p)| {
            let at = |i: usize| f[i][0] * x[0] + f[i][1] * x[1] - p[i];
            at(0).hypot(at(1))
        })
        .fold(0.0, f64::max)
}

/// Stress and inner nodes of one law at one deformation.
fn compare(
    bench: &mut Bench<'_>,
    what: &str,
    solved: Result<Solved, Unsolved>,
    [i, j]: [usize; 2],
    (expected, bound): (f64, f64),
    field: impl Fn(&Solved) -> [[f64; 2]; 2],
) {
    let solved = match solved {
        Ok(solved) => solved,
        Err(reason) => return bench.unsolved(what, &reason),
    };
    bench.check(Checked {
        quantity: format!("{what}: stress (MPa)"),
        value: mean_stress(&solved, i, j),
        expected,
        scale: expected,
        bound,
        orders: None,
    });
    bench.check(Checked {
        quantity: format!("{what}: linear field (mm)"),
        value: largest_deviation(&solved, field(&solved)),
        expected: 0.0,
        scale: 1.0,
        bound: 1e-9,
        orders: None,
    });
}

pub(super) fn run(bench: &mut Bench<'_>, element: ElementKind) {
    let kind = file_kind(element);
    for (name, law) in one_of_each(BULK_OVER_SHEAR) {
        for l in STRETCHES {
            let solved = stretch_problem(kind, &law, l).solve(bench.observer());
            let expected = stress_difference(&law, l) / l;
            // Across it is free, so that its height is what the solve says: 1/l within K's reach.
            let field = |solved: &Solved| {
                let nodes = &solved.analysis.system.body.mesh.nodes;
                let top = nodes.iter().position(|x| *x == [0.0, 1.0]);
                let height = top.map_or(1.0 / l, |n| solved.positions(solved.last())[n][1]);
                [[l, 0.0], [0.0, height]]
            };
            let what = format!("{name}, stretch {l}");
            let bound = 3.0 * stress_difference(&law, l) / law.bulk_modulus_mpa();
            compare(bench, &what, solved, [0, 0], (expected, bound), field);
        }
        for g in SHEARS {
            let solved = shear_problem(kind, &law, g).solve(bench.observer());
            let expected = shear_stress(&law, g);
            let what = format!("{name}, shear {g}");
            compare(bench, &what, solved, [0, 1], (expected, 1e-8), |_| {
                [[1.0, g], [0.0, 1.0]]
            });
        }
    }
}

//! Thick cylinder under inner pressure, plane strain, incompressible (Rivlin 1949; Ogden, Non-linear elastic deformations,
//! section 5.3.3).
//!
//! ```text
//!   x = 0 slides
//!   |\__         A = 1 mm, B = 2 mm, K/mu = 1e6
//!   |   \__      k = a^2 - A^2, b^2 = B^2 + k, l(R) = r/R with r^2 = R^2 + k
//!   \__    \     p = integral of (stress difference at l) dr/r from a to b
//!      \____|    neo-Hookean: p/mu = ln(B/A) - ln(b/a) + (k/2) (1/a^2 - 1/b^2) -> ln(B/A) as a grows
//!   p     y = 0 slides
//! ```

use std::f64::consts::FRAC_PI_2;

use serde_json::json;

use super::bench::{Bench, Checked};
use super::problem::{MESH_FILE, Problem, Unsolved, file_kind};
use crate::equilibrium::Observer;
use crate::material::closed_form::stress_difference;
use crate::material::{HyperelasticModel, MaterialLaw};
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, structured};
use crate::scene::material_document;

/// Outer over inner radius.
const OUTER: f64 = 2.0;
const BULK_OVER_SHEAR: f64 = 1e6;
/// Inner radii a/A of the neo-Hookean cylinder, and of the Yeoh one.
const NEO_HOOKEAN_RADII: [f64; 6] = [1.05, 1.1, 1.25, 1.5, 2.0, 3.0];
const YEOH_RADII: [f64; 4] = [1.1, 1.25, 1.5, 2.0];

/// The law of mu = 1 MPa.
pub fn neo_hookean() -> MaterialLaw {
    law(HyperelasticModel::NeoHookean { c10_mpa: 0.5 })
}

/// A Yeoh law that stiffens, then softens.
pub fn yeoh() -> MaterialLaw {
    law(HyperelasticModel::Yeoh {
        c_mpa: [0.09216, 9.034e-3, -3.575e-4],
    })
}

fn law(model: HyperelasticModel) -> MaterialLaw {
    MaterialLaw {
        model,
        bulk_over_shear: BULK_OVER_SHEAR,
        fit_stretch: None,
    }
}

/// Pressure that widens the bore from A = 1 to a, MPa: Simpson's rule in ln R, exact to round-off.
pub fn pressure_mpa(law: &MaterialLaw, a: f64) -> f64 {
    let k = a * a - 1.0;
    // dr/r = R dR / r^2 = R^2 / r^2 d(ln R).
    let at = |t: f64| {
        let square = (2.0 * t).exp();
        let stretch = ((square + k) / square).sqrt();
        stress_difference(law, stretch) / (stretch * stretch)
    };
    let n = 2000;
    let h = OUTER.ln() / f64::from(n);
    let sum: f64 = (0..=n)
        .map(|i| {
            let weight = match i {
                0 => 1.0,
                i if i == n => 1.0,
                i if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * at(f64::from(i) * h)
        })
        .sum();
    sum * h / 3.0
}

/// A quarter of n x n cells whose bore opens to the radii in turn.
pub fn problem(kind: GmshElementKind, n: usize, law: &MaterialLaw, radii: &[f64]) -> Problem {
    let mesh = structured(kind, [n, n], |s, t| {
        let (radius, angle) = (1.0 + s * (OUTER - 1.0), t * FRAC_PI_2);
        // The ends of the arcs lie on the axes to the last bit.
        [
            radius * if t == 1.0 { 0.0 } else { angle.cos() },
            radius * angle.sin(),
        ]
    });
    let rows: Vec<[f64; 1]> = [0.0]
        .into_iter()
        .chain(radii.iter().map(|a| 1e3 * pressure_mpa(law, *a)))
        .map(|p| [p])
        .collect();
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": material_document(law),
        "actuation": {"schedule": rows, "load_steps_per_leg": 2},
        "supports": [{"group": "bottom", "fix": ["y"]}, {"group": "top", "fix": ["x"]}],
        "pressures": [{"group": "left", "channel": 0}],
        "probes": {"bore": [1, 0]},
        "relative_residual_force_tolerance": 1e-10
    });
    Problem {
        mesh,
        scene,
        driven: None,
    }
}

/// Inner radius at each of the radii asked for.
fn found(
    element: ElementKind,
    n: usize,
    law: &MaterialLaw,
    radii: &[f64],
    observer: &mut dyn Observer,
) -> Result<Vec<f64>, Unsolved> {
    let solved = problem(file_kind(element), n, law, radii).solve(observer)?;
    let at_row = |row: usize| 1.0 + solved.displacement(0, 2 * (row + 1))[0];
    Ok((0..radii.len()).map(at_row).collect())
}

/// Cells a side of the nested meshes, coarsest first.
fn cells(element: ElementKind) -> [usize; 3] {
    match element {
        ElementKind::Quad9 => [4, 8, 16],
        ElementKind::Tri7 => [8, 16, 32],
        ElementKind::Quad4 => [16, 32, 64],
    }
}

/// The neo-Hookean cylinder: all radii with their orders.
pub(super) fn run_neo_hookean(bench: &mut Bench<'_>, element: ElementKind) {
    run(bench, element, &neo_hookean(), &NEO_HOOKEAN_RADII);
}

/// The Yeoh cylinder.
pub(super) fn run_yeoh(bench: &mut Bench<'_>, element: ElementKind) {
    run(bench, element, &yeoh(), &YEOH_RADII);
}

fn run(bench: &mut Bench<'_>, element: ElementKind, law: &MaterialLaw, radii: &[f64]) {
    let results: Result<Vec<Vec<f64>>, Unsolved> = cells(element)
        .into_iter()
        .map(|n| found(element, n, law, radii, bench.observer()))
        .collect();
    let meshes = match results {
        Ok(meshes) => meshes,
        Err(reason) => return bench.unsolved("inner radius", &reason),
    };
    let (bound, least_order) = match element {
        ElementKind::Quad4 => (1e-3, 1.8),
        ElementKind::Quad9 => (1e-5, 3.5),
        // On these meshes; rising with the angle's cells to 3.
        ElementKind::Tri7 => (1e-5, 2.2),
    };
    for (i, radius) in radii.iter().enumerate() {
        let of_mesh = |mesh: usize| meshes[mesh][i];
        bench.check(Checked {
            quantity: format!("a/A = {radius}"),
            value: of_mesh(2),
            expected: *radius,
            scale: *radius,
            bound,
            orders: Some(([0, 1, 2].map(of_mesh), least_order)),
        });
    }
}

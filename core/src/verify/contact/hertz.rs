//! A disc between two rigid plates: Hertz's line contact, plane strain (Johnson, Contact mechanics, 1985, sections 4.2 and 5.6).
//!
//! ```text
//!      y = 0 keeps its height        R = 100 mm, mu = 1 MPa, K/mu = 1e3, E* = E / (1 - nu^2)
//!     \                 /            half width a of the contact, P = pi a^2 E* / (4 R) per depth
//!      '.             .'             largest pressure p0 = 2 P / (pi a) = a E* / (2 R)
//!        '-.._____..-'               the plate approaches the middle by P / (pi E*) (2 ln(4 R / a) - 1)
//!     ======= plate =======
//! ```
//! The plate starts one activation distance below the disc, and travels that more. Mesh and activation distance are halved
//! together.

use std::f64::consts::{FRAC_PI_4, PI};

use serde_json::json;

use super::joined::joined;
use super::plane_modulus;
use crate::equilibrium::Observer;
use crate::geometry::Point;
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, GmshFile, structured};
use crate::verify::bench::{Bench, Checked};
use crate::verify::problem::{MESH_FILE, Problem, Unsolved, file_kind};

const RADIUS: f64 = 100.0;
const BULK_OVER_SHEAR: f64 = 1e3;
/// Half width of the contact, mm.
const HALF_WIDTH: f64 = 10.0;
/// Half of the plate, mm: beyond it the disc is far above.
const PLATE: f64 = 16.0;
/// Activation distances, mm.
const ACTIVATIONS: [f64; 3] = [0.04, 0.02, 0.01];

/// Force per depth, N/mm, and approach, mm, of the half width.
fn expected() -> [f64; 2] {
    let (a, e) = (HALF_WIDTH, plane_modulus(BULK_OVER_SHEAR));
    let force = PI * a * a * e / (4.0 * RADIUS);
    let approach = force / (PI * e) * (2.0 * (4.0 * RADIUS / a).ln() - 1.0);
    [force, approach]
}

/// -1 to 1 or 0 to 1, finer towards 0 by sinh.
fn graded(u: f64, rate: f64) -> f64 {
    (rate * u).sinh() / rate.sinh()
}

/// The lower half of the disc: a block in the middle and three around it, finer towards the plate.
fn mesh(kind: GmshElementKind, n: usize) -> GmshFile {
    const INNER: [f64; 3] = [45.0, 40.0, 40.0];
    let [top, low, depth] = INNER;
    let arc = |angle: f64| [RADIUS * angle.sin(), -RADIUS * angle.cos()];
    let mix = |a: Point, b: Point, t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    // From the arc inwards.
    let inwards = |t: f64| graded(t, 3.0);
    let across = |s: f64| graded(2.0 * s - 1.0, 3.5);
    let below = structured(kind, [2 * n, n], |s, t| {
        let u = across(s);
        mix(arc(FRAC_PI_4 * u), [u * low, -depth], inwards(t))
    });
    let middle = structured(kind, [2 * n, n / 2], |s, t| {
        let u = across(s);
        mix([u * low, -depth], [u * top, 0.0], t)
    });
    let beside = |sign: f64| {
        structured(kind, [n, n / 2], move |s, t| {
            let t_in = inwards(if sign < 0.0 { s } else { 1.0 - s });
            let inner = mix([sign * low, -depth], [sign * top, 0.0], t);
            let mut outer = arc(sign * FRAC_PI_4 * (1.0 + t));
            if t == 1.0 {
                outer[1] = 0.0;
            }
            mix(outer, inner, t_in)
        })
    };
    let top: &[(&str, &str)] = &[("top", "middle")];
    joined(
        &[
            (below, &[]),
            (middle, top),
            (beside(-1.0), top),
            (beside(1.0), top),
        ],
        &[("centre", [0.0, 0.0])],
    )
}

/// The disc of n cells from the plate to the middle block.
pub fn problem(kind: GmshElementKind, n: usize, activation_mm: f64) -> Problem {
    let low = -RADIUS - activation_mm;
    let [_, approach] = expected();
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": {"model": "neo_hookean", "c10_mpa": 0.5, "bulk_over_shear": BULK_OVER_SHEAR},
        "actuation": {"schedule": [[0], [1]], "load_steps_per_leg": 2},
        "supports": [{"group": "middle", "fix": ["y"]}, {"group": "centre", "fix": ["x"]}],
        "contact": "on",
        "contact_activation_mm": activation_mm,
        "obstacles": [{
            "name": "plate",
            "shape": "line",
            "points_mm": [[-PLATE, low], [PLATE, low]],
            "travel_mm": [0.0, approach + activation_mm],
        }],
        "relative_residual_force_tolerance": 1e-9
    });
    Problem {
        mesh: mesh(kind, n),
        scene,
        driven: None,
    }
}

/// Force, N/mm, and largest pressure, MPa.
fn found(
    element: ElementKind,
    n: usize,
    activation_mm: f64,
    observer: &mut dyn Observer,
) -> Result<[f64; 2], Unsolved> {
    let solved = problem(file_kind(element), n, activation_mm).solve(observer)?;
    let contact = solved.contact(solved.last())?;
    Ok([-contact.on_obstacle[0][1], contact.pressure_mpa])
}

/// Cells of the nested meshes, coarsest first.
fn cells(element: ElementKind) -> [usize; 3] {
    match element {
        ElementKind::Quad9 | ElementKind::Tri7 => [6, 12, 24],
        ElementKind::Quad4 => [12, 24, 48],
    }
}

/// The disc on one element.
pub fn run(bench: &mut Bench<'_>, element: ElementKind) {
    let results: Result<Vec<_>, Unsolved> = cells(element)
        .into_iter()
        .zip(ACTIVATIONS)
        .map(|(n, activation)| found(element, n, activation, bench.observer()))
        .collect();
    let meshes = match results {
        Ok(meshes) => meshes,
        Err(reason) => return bench.unsolved("force", &reason),
    };
    let [force, _] = expected();
    let modulus = plane_modulus(BULK_OVER_SHEAR);
    let pressure = 0.5 * HALF_WIDTH * modulus / RADIUS;
    // The pressure that belongs to the force that was found.
    let of_force = (meshes[2][0] * modulus / (PI * RADIUS)).sqrt();
    let forces = [0, 1, 2].map(|m: usize| meshes[m][0]);
    for (quantity, value, expected, bound, orders) in [
        (
            "force of the approach (N/mm)",
            forces[2],
            force,
            0.01,
            Some((forces, 1.0)),
        ),
        (
            "largest pressure of the approach (MPa)",
            meshes[2][1],
            pressure,
            0.03,
            None,
        ),
        (
            "largest pressure of the force (MPa)",
            meshes[2][1],
            of_force,
            0.01,
            None,
        ),
    ] {
        bench.check(Checked {
            quantity: quantity.to_owned(),
            value,
            expected,
            scale: expected,
            bound,
            orders,
        });
    }
}

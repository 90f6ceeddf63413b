//! Two blocks pressed together: what is homogeneous stays so across the gap.
//!
//! ```text
//!    |  |  |  |  |  v    20 x 10 mm each, mu = 1 MPa, K/mu = 1e5, 2 mm apart; outer faces keep flat and slide
//!    +--+--+--+--+       meshes that do not match: 4 n and 6 n cells across
//!    +-+-+-+-+-+-+       neo-Hookean, plane strain: P / length = mu (1/l^3 - l) at the stretch l of the height
//!    | | | | | | |
//! ```

use serde_json::json;

use super::joined::joined;
use crate::equilibrium::Observer;
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, structured};
use crate::verify::bench::{Bench, Checked};
use crate::verify::problem::{MESH_FILE, Problem, Solved, Unsolved, file_kind};

const WIDTH: f64 = 20.0;
const HEIGHT: f64 = 10.0;
const GAP: f64 = 2.0;
/// How much nearer the outer faces come than the gap, mm.
const PRESSED: f64 = 2.0;

/// Two blocks, of 4n and 6n cells across.
pub fn problem(kind: GmshElementKind, n: usize, activation_mm: f64) -> Problem {
    let lower = structured(kind, [4 * n, 2 * n], |s, t| [WIDTH * (s - 0.5), HEIGHT * t]);
    let upper = structured(kind, [6 * n, 3 * n], |s, t| {
        [WIDTH * (s - 0.5), HEIGHT + GAP + HEIGHT * t]
    });
    let mesh = joined(
        &[
            (lower, &[("bottom", "low"), ("top", "face")]),
            (upper, &[("top", "high"), ("bottom", "counterface")]),
        ],
        &[
            ("middles", [0.0, 0.0]),
            ("middles", [0.0, 2.0 * HEIGHT + GAP]),
        ],
    );
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": {"model": "neo_hookean", "c10_mpa": 0.5, "bulk_over_shear": 1e5},
        "actuation": {"schedule": [[0], [1]], "load_steps_per_leg": 2},
        "supports": [
            {"group": "low", "fix": ["y"]},
            {"group": "high", "fix": ["y"], "displacement_mm": [0.0, -GAP - PRESSED], "channel": 0},
            {"group": "middles", "fix": ["x"]},
        ],
        "contact": "on",
        "contact_activation_mm": activation_mm,
        "relative_residual_force_tolerance": 1e-10
    });
    Problem {
        mesh,
        scene,
        driven: None,
    }
}

/// Force per length over that of the mean stretch; largest deviation of the pressure between nodes of the lower face's inner
/// nine tenths from its mean, over the mean.
fn found(solved: &Solved) -> [f64; 2] {
    let last = solved.last();
    let forces = solved.contact_forces(last);
    let places = solved.positions(last);
    let body = &solved.analysis.system.body;
    let on_face = |n: u32| body.mesh.nodes[n as usize][1] == HEIGHT;
    let edges = (body.boundary.iter().flat_map(|l| &l.edges))
        .filter(|e| e.ends.iter().all(|n| on_face(*n)));
    // Integrals of the shape functions of the face's edges, and of the height on it.
    let mut length = vec![0.0; body.mesh.nodes.len()];
    for e in edges {
        let [a, b] = e.ends.map(|n| body.mesh.nodes[n as usize][0]);
        let whole = (b - a).abs();
        let (end, mid) = if e.mid.is_some() {
            (whole / 6.0, 4.0 * whole / 6.0)
        } else {
            (whole / 2.0, 0.0)
        };
        for n in e.ends {
            length[n as usize] += end;
        }
        if let Some(m) = e.mid {
            length[m as usize] += mid;
        }
    }
    let total: f64 = length.iter().sum();
    let force: f64 = (forces.iter().zip(&length))
        .filter(|(_, l)| **l > 0.0)
        .map(|(f, _)| f[1])
        .sum();
    let height: f64 = length
        .iter()
        .zip(&places)
        .map(|(l, p)| l * p[1])
        .sum::<f64>()
        / total;
    let stretch = height / HEIGHT;
    let expected = stretch.powi(-3) - stretch;
    let inner: Vec<f64> = (0..length.len())
        .filter(|&n| length[n] > 0.0 && body.mesh.nodes[n][0].abs() < 0.45 * WIDTH)
        .map(|n| forces[n][1] / length[n])
        .collect();
    let mean = inner.iter().sum::<f64>() / inner.len() as f64;
    let deviation = inner.iter().fold(0.0_f64, |m, p| m.max((p - mean).abs()));
    [force.abs() / total / expected, deviation / mean.abs()]
}

fn solved(
    element: ElementKind,
    n: usize,
    activation_mm: f64,
    observer: &mut dyn Observer,
) -> Result<[f64; 2], Unsolved> {
    Ok(found(
        &problem(file_kind(element), n, activation_mm).solve(observer)?,
    ))
}

/// The blocks on one element.
pub fn run(bench: &mut Bench<'_>, element: ElementKind) {
    let results: Result<Vec<_>, Unsolved> = [(2, 0.16), (4, 0.08), (8, 0.04)]
        .into_iter()
        .map(|(n, activation)| solved(element, n, activation, bench.observer()))
        .collect();
    let meshes = match results {
        Ok(meshes) => meshes,
        Err(reason) => return bench.unsolved("force", &reason),
    };
    let forces = [0, 1, 2].map(|m: usize| meshes[m][0]);
    bench.check(Checked {
        quantity: "force over that of the stretch".to_owned(),
        value: forces[2],
        expected: 1.0,
        scale: 1.0,
        bound: 2e-3,
        orders: Some((forces, 0.9)),
    });
    bench.check(Checked {
        quantity: "largest deviation of the pressure, relative".to_owned(),
        value: meshes[2][1],
        expected: 0.0,
        scale: 1.0,
        bound: 2e-3,
        orders: None,
    });
}

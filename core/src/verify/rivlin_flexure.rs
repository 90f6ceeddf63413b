//! Flexure of a block into a sector of a ring, plane strain, incompressible neo-Hookean (Rivlin 1949, Phil. Trans. R. Soc.
//! Lond. A 242, 173-195).
//!
//! ```text
//!     ________________           A block of 100 x 10 mm, mu = 1 MPa, K/mu = 1e6, bent by the angle w of its ends.
//!    |________________|  10      With R = 100/w a point (X, Y) goes to the angle X/R and the radius r,
//!           100                  r^2 = ri^2 + 2 R Y, ri ro = R^2 (no traction on either face), l = r/R the hoop stretch;
//!       .-''''''-.               hoop stress = mu/2 (3 l^2 - l^-2 - li^2 - li^-2), whose moment is M.
//!     .'  .----.  '.
//! ```
//! One half is solved: the middle section slides on its plane, the nodes of the end follow the closed form from one angle to
//! the next, 15 degrees apart. Found are the inner radius in the middle, half a block away, and the moment of the end's
//! reactions.

use serde_json::json;

use super::bench::{Bench, Checked};
use super::problem::{MESH_FILE, Problem, Unsolved, file_kind};
use crate::equilibrium::Observer;
use crate::geometry::Point;
use crate::mesh::ElementKind;
use crate::mesh::gmsh::{GmshElementKind, structured};

const LENGTH: f64 = 100.0;
const THICKNESS: f64 = 10.0;
/// Angle between two states, degrees, and their number.
const STEP_DEG: f64 = 15.0;
const STEPS: usize = 24;
/// Angles that are compared, degrees.
const ANGLES_DEG: [f64; 4] = [45.0, 90.0, 180.0, 360.0];

/// The bent block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bent {
    /// Radius of the fibre that keeps its length, mm.
    pub neutral_mm: f64,
    /// Inner radius, mm.
    pub inner_mm: f64,
}

impl Bent {
    /// Bent by an angle, degrees.
    pub fn by(angle_deg: f64) -> Self {
        let neutral_mm = LENGTH / angle_deg.to_radians();
        let half = neutral_mm * THICKNESS;
        // ri^2 = -R h + sqrt(R^2 h^2 + R^4), without the difference of near numbers.
        let square = neutral_mm.powi(4) / (half + half.hypot(neutral_mm * neutral_mm));
        Self {
            neutral_mm,
            inner_mm: square.sqrt(),
        }
    }

    /// Place of a point, the inner fibre's middle at the origin.
    pub fn place(&self, [x, y]: Point) -> Point {
        let r = (self.inner_mm * self.inner_mm + 2.0 * self.neutral_mm * y).sqrt();
        let angle = x / self.neutral_mm;
        [r * angle.sin(), r * angle.cos() - self.inner_mm]
    }

    /// Moment per depth over mu, mm^2.
    pub fn moment_over_mu(&self) -> f64 {
        // Integral of (3 l^2 - l^-2 - li^2 - li^-2) r / 2 dr, r = R l, from li to 1/li.
        let li = self.inner_mm / self.neutral_mm;
        let at = |l: f64| 0.75 * l.powi(4) - l.ln() - 0.5 * (li * li + 1.0 / (li * li)) * l * l;
        0.5 * self.neutral_mm * self.neutral_mm * (at(1.0 / li) - at(li))
    }
}

/// Half a block of 5n x n cells.
pub fn problem(kind: GmshElementKind, n: usize) -> Problem {
    let half = 0.5 * LENGTH;
    let mesh = structured(kind, [5 * n, n], |s, t| [half * s, THICKNESS * t]);
    let rows: Vec<Vec<f64>> = (0..=STEPS)
        .map(|k| (0..STEPS).map(|c| f64::from(u8::from(c < k))).collect())
        .collect();
    let scene = json!({
        "version": 1,
        "mesh_file": MESH_FILE,
        "material": {"model": "neo_hookean", "c10_mpa": 0.5, "bulk_over_shear": 1e6},
        "actuation": {"schedule": rows, "load_steps_per_leg": 1},
        "supports": [{"group": "left", "fix": ["x"]}, {"group": "right", "fix": ["x", "y"]}],
        "probes": {"inner": [0, 0]},
        "relative_residual_force_tolerance": 1e-10
    });
    let end = move |x: Point| {
        (x[0] == half).then(|| {
            let mut before = x;
            (1..=STEPS)
                .map(|k| {
                    let now = Bent::by(STEP_DEG * k as f64).place(x);
                    let step = [now[0] - before[0], now[1] - before[1]];
                    before = now;
                    step
                })
                .collect()
        })
    };
    Problem {
        mesh,
        scene,
        driven: Some(Box::new(end)),
    }
}

/// Inner radius and moment at each of the angles.
fn found(
    element: ElementKind,
    n: usize,
    observer: &mut dyn Observer,
) -> Result<Vec<[f64; 2]>, Unsolved> {
    let solved = problem(file_kind(element), n).solve(observer)?;
    let nodes = &solved.analysis.system.body.mesh.nodes;
    let of_angle = |angle: &f64| {
        let state = (angle / STEP_DEG).round() as usize;
        let exact = Bent::by(*angle);
        let inner = exact.inner_mm + solved.displacement(0, state)[1];
        let (force, at) = (solved.internal_forces(state), solved.positions(state));
        // About the centre, clockwise positive: the end turns clockwise as the block bends down.
        let moment: f64 = (nodes.iter().zip(force).zip(at))
            .filter(|((x, _), _)| x[0] == 0.5 * LENGTH)
            .map(|((_, f), p)| (p[1] + exact.inner_mm) * f[0] - p[0] * f[1])
            .sum();
        [inner, moment]
    };
    Ok(ANGLES_DEG.iter().map(of_angle).collect())
}

/// Cells through the thickness of the nested meshes, coarsest first.
fn cells(element: ElementKind) -> [usize; 3] {
    match element {
        ElementKind::Quad9 | ElementKind::Tri7 => [2, 4, 8],
        ElementKind::Quad4 => [4, 8, 16],
    }
}

pub(super) fn run(bench: &mut Bench<'_>, element: ElementKind) {
    let results: Result<Vec<_>, Unsolved> = cells(element)
        .into_iter()
        .map(|n| found(element, n, bench.observer()))
        .collect();
    let meshes = match results {
        Ok(meshes) => meshes,
        Err(reason) => return bench.unsolved("inner radius", &reason),
    };
    // Least orders of radius and moment. The radius, half a block away from where anything is prescribed, is off by parts of
    // a millionth only, and not in the range of its order yet on triangles.
    let (bound, least_orders) = match element {
        ElementKind::Quad4 => (1e-2, [1.6, 1.8]),
        ElementKind::Quad9 => (1e-3, [2.4, 3.0]),
        ElementKind::Tri7 => (1e-3, [1.0, 3.0]),
    };
    for (i, angle) in ANGLES_DEG.iter().enumerate() {
        let exact = Bent::by(*angle);
        let quantities = [
            ("inner radius", exact.inner_mm, "mm"),
            ("moment / mu", exact.moment_over_mu(), "mm^2"),
        ];
        for (q, (name, expected, unit)) in quantities.into_iter().enumerate() {
            bench.check(Checked {
                quantity: format!("{angle} deg: {name} ({unit})"),
                value: meshes[2][i][q],
                expected,
                scale: expected,
                bound,
                orders: Some(([0, 1, 2].map(|m: usize| meshes[m][i][q]), least_orders[q])),
            });
        }
    }
}

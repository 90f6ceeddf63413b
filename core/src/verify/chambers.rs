//! What must hold of units with chambers, whatever the numbers: symmetries of the path, and its gradient.
//!
//! | promise | why |
//! |---|---|
//! | one channel raised and lowered encloses nothing | the response is a function of the pressure alone while it is unique |
//! | a unit that mirrors itself about mid-height has (x, y) at (p1, p2) and (x, -y) at (p2, p1) | uniqueness; on a mesh that mirrors itself to the solver's tolerance |
//! | of such a unit `overlap` encloses twice what `hold` does | the second half of `overlap` mirrors the first, and both close along the axis |
//! | the adjoint's gradient is the limit of central differences | it is exact for the discrete path |

use std::path::Path;

use serde_json::{Value, json};

use super::bench::{Bench, Checked};
use super::problem::Unsolved;
use crate::equilibrium::Observer;
use crate::evaluate::{
    SceneAnswer, SceneOptions, SceneStatus, check_bound, check_gradient, solve_scene,
};
use crate::geometry::{MeshPlan, PlanElement, Point};
use crate::mesh::{ElementKind, build};
use crate::scene::{Body, Scene, read_scene};

/// Rectangles of the paper's unit, 40 x 15 mm.
fn rectangles() -> Value {
    json!([
        [[20, 13], [60, 13], [60, 28], [20, 28]],
        [[20, 52], [60, 52], [60, 67], [20, 67]]
    ])
}

/// Rectangles of 40 x 28 mm, which mirror each other.
fn tall_rectangles() -> Value {
    json!([
        [[20, 8], [60, 8], [60, 36], [20, 36]],
        [[20, 44], [60, 44], [60, 72], [20, 72]]
    ])
}

/// Slanted chambers that mirror each other about mid-height.
fn mirrored() -> Value {
    json!([
        [[20, 8], [60, 5], [62, 37], [18, 36]],
        [[18, 44], [62, 43], [60, 75], [20, 72]]
    ])
}

/// A slanted lower chamber and a non-convex upper one.
fn slanted() -> Value {
    json!([
        [[20, 3], [61, 2.5], [58, 38.5], [24, 39]],
        [[22, 41.5], [64, 43], [59, 70.5], [38, 63]]
    ])
}

/// A scene of equal units; the tip is the middle of the last edge.
pub fn scene_document(
    units: usize,
    chambers: &Value,
    schedule: &Value,
    element: ElementKind,
    max_size_mm: Option<f64>,
) -> Value {
    json!({
        "version": 1,
        "actuator": {"repeat": units, "chambers_mm": chambers},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": schedule, "load_steps_per_leg": 2},
        "mesh": {"element": element, "max_size_mm": max_size_mm},
        "contact": "off",
        "relative_residual_force_tolerance": 1e-11,
        "probes": {"tip": [80 * units, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip"}
    })
}

fn read(document: &Value) -> Result<Scene, Unsolved> {
    Ok(read_scene(document, Path::new(""))?)
}

/// A complete path of a scene.
fn solve(document: &Value, observer: &mut dyn Observer) -> Result<SceneAnswer, Unsolved> {
    let options = SceneOptions {
        path_only: true,
        ..SceneOptions::default()
    };
    let answer = solve_scene(&read(document)?, &options, observer)?.answer;
    if answer.status == SceneStatus::Ok {
        return Ok(answer);
    }
    let reason = match (&answer.reason, &answer.limit) {
        (Some(reason), _) => reason.clone(),
        (None, limit) => format!("{limit:?}"),
    };
    Err(Unsolved::Path(reason))
}

fn area(answer: &SceneAnswer) -> f64 {
    answer.enclosed_area_mm2.unwrap_or(f64::NAN)
}

/// Largest distance of the tip from its rest, mm.
fn reach(answer: &SceneAnswer) -> f64 {
    tips(answer)
        .map(|[x, y]| x.hypot(y))
        .fold(f64::MIN_POSITIVE, f64::max)
}

fn tips(answer: &SceneAnswer) -> impl Iterator<Item = [f64; 2]> + '_ {
    answer.path.iter().map(|s| s.displacement_mm["tip"])
}

pub(super) fn retraced(bench: &mut Bench<'_>, element: ElementKind) {
    for (name, schedule) in [
        ("lower", json!([[0, 0], [15, 0], [0, 0]])),
        ("upper", json!([[0, 0], [0, 15], [0, 0]])),
    ] {
        let document = scene_document(3, &rectangles(), &schedule, element, None);
        match solve(&document, bench.observer()) {
            Ok(answer) => bench.check(Checked {
                quantity: format!("area of the {name} channel alone / reach^2"),
                value: area(&answer) / reach(&answer).powi(2),
                expected: 0.0,
                scale: 1.0,
                bound: 1e-8,
                orders: None,
            }),
            Err(reason) => bench.unsolved("area", &reason),
        }
    }
}

/// Sizes that are tried for a mesh that mirrors itself, mm: the mesher counts elements by rounding, so that not every
/// mesh of a symmetric shape is symmetric.
const MIRROR_SIZES_MM: [f64; 13] = [12., 10., 8., 6., 5., 4., 3., 2.4, 2., 1.8, 1.6, 1.4, 1.2];

/// A size at which the mesh of two equal units mirrors itself about mid-height.
fn mirror_size(chambers: &Value, element: ElementKind) -> Result<f64, Unsolved> {
    for size in MIRROR_SIZES_MM {
        let document = scene_document(1, chambers, &json!("hold"), element, Some(size));
        let scene = read(&document)?;
        let Body::Actuator(chain) = &scene.body else {
            continue;
        };
        let kind = match element {
            ElementKind::Quad4 => PlanElement::Quad4,
            ElementKind::Quad9 | ElementKind::Tri7 => PlanElement::Quad9,
        };
        let meshed = MeshPlan::choose(&chain.actuator, kind, Some(size))
            .and_then(|plan| build(&chain.actuator, &plan))
            .map_err(|error| Unsolved::Body(error.to_string()))?;
        if mirrors_itself(&meshed.discretisation.mesh.nodes, 80.0) {
            return Ok(size);
        }
    }
    Err(Unsolved::Body("no mesh mirrors itself".to_owned()))
}

fn mirrors_itself(nodes: &[Point], height: f64) -> bool {
    let mut sorted: Vec<Point> = nodes.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    nodes.iter().all(|[x, y]| {
        let near = 1e-9;
        let start = sorted.partition_point(|p| p[0] < x - near);
        let mut column = sorted[start..].iter().take_while(|p| p[0] <= x + near);
        column.any(|p| (p[1] + y - height).abs() <= near)
    })
}

pub(super) fn mirror(bench: &mut Bench<'_>, element: ElementKind) {
    for (name, chambers) in [("rectangles", tall_rectangles()), ("slanted", mirrored())] {
        let size = match mirror_size(&chambers, element) {
            Ok(size) => Some(size),
            Err(reason) => return bench.unsolved(name, &reason),
        };
        let mut of = |p: [f64; 2], q: [f64; 2]| {
            let schedule = json!([[0, 0], p, q]);
            let document = scene_document(2, &chambers, &schedule, element, size);
            solve(&document, bench.observer())
        };
        let both =
            of([12.0, 0.0], [12.0, 5.0]).and_then(|a| Ok((a, of([0.0, 12.0], [5.0, 12.0])?)));
        let (one, other) = match both {
            Ok(both) => both,
            Err(reason) => return bench.unsolved("tip", &reason),
        };
        let apart = tips(&one)
            .zip(tips(&other))
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] + b[1]))
            .fold(0.0, f64::max);
        bench.check(Checked {
            quantity: format!("{name}: tip(p1, p2) - mirrored tip(p2, p1) / reach"),
            value: apart / reach(&one),
            expected: 0.0,
            scale: 1.0,
            bound: 1e-7,
            orders: None,
        });
    }
}

pub(super) fn overlap_is_twice_hold(bench: &mut Bench<'_>, element: ElementKind) {
    for (name, chambers) in [("rectangles", tall_rectangles()), ("slanted", mirrored())] {
        let size = match mirror_size(&chambers, element) {
            Ok(size) => Some(size),
            Err(reason) => return bench.unsolved(name, &reason),
        };
        let mut of = |schedule: &str| {
            let document = scene_document(2, &chambers, &json!(schedule), element, size);
            solve(&document, bench.observer())
        };
        match of("overlap").and_then(|a| Ok((a, of("hold")?))) {
            Ok((overlap, hold)) => bench.check(Checked {
                quantity: format!("{name}: area of overlap / area of hold"),
                value: area(&overlap) / area(&hold),
                expected: 2.0,
                scale: 2.0,
                bound: 1e-6,
                orders: None,
            }),
            Err(reason) => bench.unsolved("area", &reason),
        }
    }
}

/// On meshes none of whose lines runs through the tip: there a probe that is fixed in space passes from one element to the
/// next as the mesh moves, and what it reads has a kink.
pub(super) fn gradient(bench: &mut Bench<'_>, element: ElementKind) {
    for (name, chambers) in [
        ("rectangles", rectangles()),
        ("slanted and non-convex", slanted()),
    ] {
        let size = match element {
            ElementKind::Quad4 => 6.0,
            ElementKind::Quad9 | ElementKind::Tri7 => 8.0,
        };
        let document = scene_document(1, &chambers, &json!("hold"), element, Some(size));
        let checked = read(&document).and_then(|scene| {
            let (answer, lines) = check_gradient(&scene, bench.observer())?;
            if answer.status == SceneStatus::Ok {
                Ok((check_bound(&answer), lines))
            } else {
                Err(Unsolved::Path(format!("{:?}", answer.status)))
            }
        });
        match checked {
            Ok((bound, lines)) => bench.check(Checked {
                quantity: format!("{name}: worst of {} variables", lines.len()),
                value: lines.iter().map(|l| l.best_error).fold(0.0, f64::max),
                expected: 0.0,
                scale: 1.0,
                bound,
                orders: None,
            }),
            Err(reason) => bench.unsolved("gradient", &reason),
        }
    }
}

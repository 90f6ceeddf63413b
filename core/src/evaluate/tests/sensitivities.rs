//! Sensitivities of scenes against differences.

use serde_json::{Value, json};

use crate::equilibrium::Unobserved;
use crate::evaluate::sensitivities::{SceneSensitivities, Wall, check_tolerance};
use crate::evaluate::{SceneOptions, SceneSolution, solve_scene};
use crate::scene::{Scene, read_scene};

/// A slanted pair; and one whose walls meet.
fn scenes() -> [(Value, bool); 2] {
    let scene = |chambers: Value, contact: &str| {
        json!({
            "version": 1,
            "actuator": {"repeat": 1, "chambers_mm": chambers},
            "material": {"model": "neo_hookean", "c10_mpa": 0.11, "bulk_over_shear": 1000},
            "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
            "mesh": {"element": "quad9", "max_size_mm": 8},
            "contact": contact,
            "relative_residual_force_tolerance": 1e-12,
            "probes": {"tip": [80, 40]},
            "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "clockwise"},
        })
    };
    let plain = json!([
        [[20, 6], [61, 5], [58, 36], [24, 35]],
        [[22, 43], [64, 45], [59, 64], [30, 66]]
    ]);
    let touching = json!([
        [[30.3, 3.1], [50.2, 3.4], [75.7, 37.6], [4.4, 38.1]],
        [[4.3, 42.4], [75.5, 41.9], [50.4, 76.6], [29.6, 77.2]]
    ]);
    [
        (scene(plain, "off"), false),
        (scene(touching, "auto"), true),
    ]
}

fn read(document: &Value) -> Scene {
    read_scene(document, std::path::Path::new(".")).unwrap_or_else(|faults| panic!("{faults}"))
}

fn solved(scene: &Scene, like: Option<&SceneSolution>) -> SceneSolution {
    use crate::evaluate::scene::BodySource;
    let plan = like.and_then(|l| match l.source.as_ref()? {
        BodySource::Mapped(mesh) => Some(mesh.plan().clone()),
        BodySource::File(_) => None,
    });
    let options = SceneOptions {
        gradient: like.is_none(),
        path_only: true,
        plan,
        ..SceneOptions::default()
    };
    solve_scene(scene, &options, &mut Unobserved).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Central difference of the objective by a factor 1 + h on a field, in units of the field's relative change.
fn difference(document: &Value, field: &str, base: &SceneSolution, h: f64) -> f64 {
    let at = |factor: f64| {
        let mut changed = document.clone();
        let value = changed.pointer_mut(field).unwrap();
        *value = json!(value.as_f64().unwrap() * factor);
        solved(&read(&changed), Some(base))
            .answer
            .objective
            .unwrap()
    };
    (at(1.0 + h) - at(1.0 - h)) / (2.0 * h)
}

fn sensitivities(document: &Value) -> (Scene, SceneSolution, SceneSensitivities) {
    let scene = read(document);
    let solution = solved(&scene, None);
    let found = solution.sensitivities(&scene).unwrap();
    (scene, solution, found)
}

#[test]
fn pressure_and_modulus_match_differences_with_and_without_contact() {
    for (document, touches) in scenes() {
        let (_, solution, found) = sensitivities(&document);
        assert_eq!(solution.answer.contact.is_some(), touches);
        let (pressure, modulus) = (found.pressure.unwrap(), found.modulus.unwrap());
        assert_eq!((pressure.value, modulus.value), (15.0, 0.22));
        for (field, slope) in [
            ("/actuation/pressure_kpa", pressure.per_unit * 15.0),
            ("/material/c10_mpa", modulus.per_unit * 0.22),
        ] {
            let errors = [1e-3, 3e-4, 1e-4, 3e-5].map(|h| {
                let difference = difference(&document, field, &solution, h);
                (difference / slope - 1.0).abs()
            });
            let best = errors.into_iter().fold(f64::INFINITY, f64::min);
            assert!(best < 1e-6, "{field}, contact {touches}: {errors:?}");
        }
    }
}

#[test]
fn a_thicker_wall_matches_moved_corners_and_the_tolerance_holds() {
    let [(document, _), _] = scenes();
    let (scene, solution, found) = sensitivities(&document);
    // The middle wall: the upper corners of the lower chamber down, the lower ones of the upper chamber up, half each.
    let middle = found
        .walls
        .iter()
        .find(|w| w.wall == Wall::BetweenStacked)
        .unwrap();
    let at = |thicker: f64| {
        let mut moved = document.clone();
        let mut shift = |chamber: usize, corner: usize, by: f64| {
            let y = &mut moved["actuator"]["chambers_mm"][chamber][corner][1];
            *y = json!(y.as_f64().unwrap() + by);
        };
        for corner in [2, 3] {
            shift(0, corner, -0.5 * thicker);
        }
        for corner in [0, 1] {
            shift(1, corner, 0.5 * thicker);
        }
        solved(&read(&moved), Some(&solution))
            .answer
            .objective
            .unwrap()
    };
    let h = 1e-3;
    let difference = (at(h) - at(-h)) / (2.0 * h);
    assert!(
        (difference / middle.per_mm - 1.0).abs() < 1e-6,
        "{difference} {middle:?}"
    );
    let check = check_tolerance(&scene, &solution, &found, &mut Unobserved)
        .unwrap()
        .unwrap();
    let share = check.found.unwrap();
    assert!((share / check.predicted - 1.0).abs() < 0.2, "{check:?}");
    let least = found
        .corners
        .iter()
        .filter_map(|c| c.tolerance_mm)
        .fold(f64::INFINITY, f64::min);
    let moved = check.move_mm[0].hypot(check.move_mm[1]);
    assert!((moved - least).abs() < 1e-12);
}

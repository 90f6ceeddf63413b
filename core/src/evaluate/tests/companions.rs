//! Another law of equal initial modulus, and nine units for three.

use std::path::Path;

use serde_json::json;

use super::super::companions::{CompanionAnswer, Kind, companions};
use super::super::{SceneOptions, SceneStatus, solve_scene};
use crate::equilibrium::Unobserved;
use crate::scene::{Scene, read_scene};

fn scene(pressure_kpa: f64) -> Scene {
    let document = json!({
        "version": 1,
        "actuator": {"repeat": 3, "chambers_mm": [
            [[20, 10], [60, 10], [60, 32], [20, 32]], [[20, 48], [60, 48], [60, 70], [20, 70]]
        ]},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": pressure_kpa, "load_steps_per_leg": 2},
        "mesh": {"element": "quad9", "max_size_mm": 16},
        "contact": "off",
        "probes": {"tip": [160, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "counter_clockwise"}
    });
    read_scene(&document, Path::new("")).unwrap_or_else(|faults| panic!("{faults}"))
}

fn answers(scene: &Scene) -> Vec<CompanionAnswer> {
    companions(scene, None)
        .iter()
        .map(|companion| {
            companion
                .solve(&mut Unobserved)
                .unwrap_or_else(|f| panic!("{f}"))
        })
        .collect()
}

#[test]
fn laws_of_equal_modulus_agree_at_small_strain_and_part_at_large_ones() {
    let spread = |pressure| {
        let scene = scene(pressure);
        let own = solve_scene(&scene, &SceneOptions::default(), &mut Unobserved)
            .unwrap_or_else(|f| panic!("{f}"))
            .answer
            .enclosed_area_mm2
            .expect("an area");
        let companion = &companions(&scene, None)[0];
        let other = companion
            .solve(&mut Unobserved)
            .unwrap_or_else(|f| panic!("{f}"));
        assert_eq!(
            (other.kind, other.status),
            (Kind::ModelSpread, SceneStatus::Ok)
        );
        (other.areas[0].enclosed_area_mm2 / own - 1.0).abs()
    };
    let (small, large) = (spread(0.5), spread(15.0));
    assert!(small < 0.01, "{small}");
    assert!(large > 5.0 * small, "{small} {large}");
}

#[test]
fn nine_units_have_their_tips_at_the_ends_of_the_last_two() {
    let answers = answers(&scene(5.0));
    let whole = &answers[1];
    assert_eq!(
        (whole.kind, whole.status),
        (Kind::NineUnits, SceneStatus::Ok)
    );
    let tips: Vec<[f64; 2]> = whole.areas.iter().map(|a| a.tip_mm).collect();
    assert_eq!(tips, [[640.0, 40.0], [720.0, 40.0]]);
    // A longer chain carries its tip farther.
    let own = answers[0].areas[0].enclosed_area_mm2.abs();
    assert!(
        whole
            .areas
            .iter()
            .all(|a| a.enclosed_area_mm2.abs() > 3.0 * own)
    );
}

#[test]
fn another_objective_has_none() {
    let mut scene = scene(5.0);
    scene.objective = None;
    assert!(companions(&scene, None).is_empty());
}

use serde_json::{Value, json};

use super::surface::{Points, Surface};
use super::{CannotMap, NotScored, NotUnique, PressureMap, Score, not_unique, score};
use crate::actuation::ActuationCycle;
use crate::equilibrium::Unobserved;
use crate::evaluate::{SceneOptions, SceneStatus, solve_scene};
use crate::scene::{Scene, read_scene};

fn surface(count: usize, of: impl Fn([f64; 2]) -> [f64; 2]) -> Surface {
    let points = Points::new(count);
    let shares = points.shares();
    let values = (shares.iter())
        .flat_map(|second| shares.iter().map(|first| of([*first, *second])))
        .collect();
    Surface::new(points, values).expect("a square of values")
}

#[test]
fn polynomials_in_the_root_of_the_pressure_are_reproduced() {
    let cubic = |[p, q]: [f64; 2]| {
        let (s, t) = (p.sqrt(), q.sqrt());
        [
            1.0 + s * s * s - 2.0 * s * t * t,
            t * t * t * s * s * s - 0.5 * t,
        ]
    };
    let surface = surface(4, cubic);
    for shares in [[0.0, 0.0], [0.03, 0.7], [1.0, 0.2], [0.5, 0.5]] {
        let (found, right) = (surface.at(shares), cubic(shares));
        for c in 0..2 {
            assert!(
                (found[c] - right[c]).abs() < 1e-14,
                "{shares:?}: {found:?}, not {right:?}"
            );
        }
    }
}

/// Displacements that go like p at first and like p^(1/3) later, as thin walls do.
fn thin_walled([p, q]: [f64; 2]) -> [f64; 2] {
    let swells = |p: f64| ((0.2 + p).cbrt() - 0.2_f64.cbrt()) * (1.0 + 0.3 * p);
    [
        swells(p) + 2.0 * swells(q) + 0.5 * swells(p * q),
        swells(p) - swells(q) + swells(p) * swells(q),
    ]
}

fn scored(count: usize, rows: &[[f64; 2]]) -> Score {
    let fine = surface(count, thin_walled);
    let coarse = fine.coarser().expect("an odd number");
    score::score(&fine, &coarse, rows, 0.0)
}

#[test]
fn the_error_of_an_area_falls_by_an_order_with_each_two_pressures_and_is_stated() {
    for rows in [
        vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]],
        vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
        vec![[0.0, 0.0], [0.8, 0.1], [0.3, 0.9], [0.0, 0.0]],
    ] {
        let right = scored(33, &rows).area_mm2;
        let errors: Vec<f64> = [5, 7, 9, 11]
            .map(|count| {
                let found = scored(count, &rows);
                let error = (found.area_mm2 - right).abs();
                assert!(
                    error <= found.error_mm2,
                    "{rows:?}, {count}: {error:e}, said {found:?}"
                );
                error
            })
            .to_vec();
        for (k, error) in errors.iter().enumerate() {
            let bound = errors[0] * 0.1_f64.powi(k as i32);
            assert!(*error <= bound, "{rows:?}: {errors:?}, area {right}");
        }
        assert!(
            errors[0] < 2e-3 * right.abs(),
            "{rows:?}: {errors:?}, area {right}"
        );
    }
}

/// One unit on a coarse mesh.
fn scene(chambers: &Value, more: &Value) -> Scene {
    let mut document = json!({
        "version": 1,
        "actuator": {"repeat": 1, "chambers_mm": chambers},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 10},
        "mesh": {"element": "quad9", "max_size_mm": 40},
        "contact": "off",
        "relative_residual_force_tolerance": 1e-10,
        "probes": {"tip": [80, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip"}
    });
    for (key, value) in more.as_object().expect("an object") {
        document[key] = value.clone();
    }
    read_scene(&document, std::path::Path::new("")).unwrap_or_else(|faults| panic!("{faults}"))
}

fn mirrored() -> Value {
    json!([
        [[20, 8], [60, 5], [62, 37], [18, 36]],
        [[18, 44], [62, 43], [60, 75], [20, 72]]
    ])
}

fn map(scene: &Scene, grid: usize) -> PressureMap {
    PressureMap::solve(scene, grid, None, &mut Unobserved).expect("a scene with a map")
}

fn named(schedule: &str) -> Vec<Vec<f64>> {
    ActuationCycle::named_rows(schedule, 15.0).expect("a name")
}

#[test]
fn a_map_mirrors_with_its_unit_and_scores_what_direct_solves_find() {
    let scene = scene(&mirrored(), &json!({}));
    let map = map(&scene, 7);
    assert_eq!(map.answer.status, SceneStatus::Ok);
    assert_eq!(map.not_unique, None);
    assert!(
        map.gap_mm.expect("states met again") < 1e-7,
        "{:?}",
        map.gap_mm
    );
    for pressures in [[15.0, 0.0], [3.0, 11.0], [0.4, 7.7]] {
        let [x, y] = map.displacement("tip", pressures).unwrap();
        let [a, b] = map
            .displacement("tip", [pressures[1], pressures[0]])
            .unwrap();
        assert!(
            (x - a).abs() < 1e-7 && (y + b).abs() < 1e-7,
            "{pressures:?}"
        );
    }
    let [hold, swap, overlap] =
        ["hold", "swap", "overlap"].map(|s| map.score("tip", &named(s)).unwrap());
    let twice = (overlap.area_mm2 - 2.0 * hold.area_mm2).abs();
    assert!(
        twice <= overlap.error_mm2 + 2.0 * hold.error_mm2,
        "{twice}, {hold:?}, {overlap:?}"
    );
    for (name, found) in [("hold", hold), ("swap", swap)] {
        let mut direct = scene.clone();
        direct.actuation.rows_kpa = named(name);
        let answer = solve_scene(&direct, &SceneOptions::default(), &mut Unobserved)
            .unwrap()
            .answer;
        let sampling = answer.area_sampling_error_mm2.unwrap();
        let difference = (found.area_mm2 - answer.enclosed_area_mm2.unwrap()).abs();
        assert!(
            difference <= found.error_mm2 + 1.2 * sampling,
            "{name}: {difference}, {found:?}, {sampling}"
        );
        assert!(
            found.error_mm2 < 0.1 * found.area_mm2.abs(),
            "{name}: {found:?}"
        );
    }
}

#[test]
fn pressures_outside_of_the_map_and_other_channels_are_refused_with_numbers() {
    let map = map(&scene(&mirrored(), &json!({})), 5);
    let rows = |last: &[f64]| vec![vec![0.0, 0.0], last.to_vec(), vec![0.0, 0.0]];
    for outside in [[15.1, 0.0], [3.0, -0.1], [f64::NAN, 0.0]] {
        let refused = map.score("tip", &rows(&outside)).unwrap_err();
        let NotScored::OutsideRange {
            pressure_kpa,
            largest_kpa,
        } = refused
        else {
            panic!("{refused}")
        };
        assert!(pressure_kpa.map(f64::to_bits) == outside.map(f64::to_bits) && largest_kpa == 15.0);
    }
    assert!(map.displacement("tip", [0.0, 15.1]).is_err());
    assert_eq!(
        map.score("tip", &rows(&[3.0])),
        Err(NotScored::Channels { found: 1 })
    );
    assert_eq!(
        map.score("tip", &[vec![0.0, 0.0]]),
        Err(NotScored::TooShort { rows: 1 })
    );
    let name = "no".to_owned();
    assert_eq!(
        map.score("no", &rows(&[3.0, 2.0])),
        Err(NotScored::NoProbe { name })
    );
}

#[test]
fn a_scene_without_two_channels_or_an_odd_grid_has_no_map() {
    let sound = scene(&mirrored(), &json!({}));
    let of = |scene: &Scene, grid| PressureMap::solve(scene, grid, None, &mut Unobserved).err();
    for found in [3, 6, 35] {
        assert_eq!(of(&sound, found), Some(CannotMap::Grid { found }));
    }
    let mut one = sound.clone();
    one.actuation.rows_kpa = vec![vec![0.0], vec![15.0]];
    assert_eq!(of(&one, 5), Some(CannotMap::Channels { found: 1 }));
    let mut sucked = sound.clone();
    sucked.actuation.rows_kpa = vec![vec![0.0, 0.0], vec![-15.0, 0.0]];
    assert_eq!(of(&sucked, 5), Some(CannotMap::Pressure { found: 0.0 }));
    let mut blind = sound;
    blind.probes.clear();
    assert_eq!(of(&blind, 5), Some(CannotMap::NoProbe));
}

#[test]
fn a_map_ends_where_equilibrium_does_and_says_where() {
    // Thin walls balloon below 15 kPa.
    let thin = json!([
        [[2, 2], [78, 2], [78, 39], [2, 39]],
        [[2, 41], [78, 41], [78, 78], [2, 78]]
    ]);
    let map = map(&scene(&thin, &json!({})), 5);
    assert_eq!(map.answer.status, SceneStatus::NoEquilibrium);
    let limit = map.answer.limit.as_ref().expect("a limit");
    assert!(
        limit.pressure_kpa[0] > 5.0 && limit.pressure_kpa[0] < 15.0,
        "{limit:?}"
    );
    let refused = map.score("tip", &named("hold")).unwrap_err();
    let NotScored::Incomplete {
        reached,
        states: 28,
        last_kpa,
    } = refused
    else {
        panic!("{refused}")
    };
    assert!(reached < 28 && last_kpa[0] < 15.0, "{refused}");
}

#[test]
fn a_state_that_is_another_when_met_again_is_told() {
    let map = map(&scene(&mirrored(), &json!({})), 5);
    let far = not_unique(&map.answer, Some((1.0, [3.0, 3.0])));
    assert_eq!(
        far,
        Some(NotUnique::Elsewhere {
            pressure_kpa: [3.0, 3.0],
            gap_mm: 1.0
        })
    );
    assert_eq!(not_unique(&map.answer, Some((1e-6, [3.0, 3.0]))), None);
    let mut unstable = map.answer.clone();
    unstable.path[7].negative_pivots = 2;
    let pressure_kpa = super::pair(&unstable.path[7].pressure_kpa);
    let sign = NotUnique::Unstable {
        pressure_kpa,
        negative_pivots: 2,
    };
    assert_eq!(not_unique(&unstable, None), Some(sign));
    let refused = PressureMap {
        not_unique: Some(sign),
        ..map
    }
    .score("tip", &named("hold"));
    assert_eq!(refused, Err(NotScored::NotUnique(sign)));
}

//! Coarse runs of the problems, and promises that hold on any mesh.

use super::{collapsed_tube, crushed_tube, hertz, pressed_blocks};
use crate::equilibrium::Unobserved;
use crate::mesh::gmsh::GmshElementKind;
use crate::verify::problem::{Problem, Solved, Unsolved};

/// Energy of the solid of mean-dilatation elements, neo-Hookean with mu = 1 MPa.
fn strain_energy(solved: &Solved, state: usize, bulk: f64) -> f64 {
    let system = &solved.analysis.system;
    let elements = system.body.mesh.blocks[0].len();
    let (mut isochoric, mut area, mut dilatation) = (0.0, vec![0.0; elements], vec![0.0; elements]);
    system.sample(&solved.analysis.fields[state], |p| {
        let f = p.f;
        let j = f[0][0] * f[1][1] - f[0][1] * f[1][0];
        let s: f64 = f.iter().flatten().map(|v| v * v).sum();
        isochoric += p.area * 0.5 * ((s + 1.0) / j.cbrt().powi(2) - 3.0);
        area[p.element] += p.area;
        dilatation[p.element] += p.area * (j - 1.0);
    });
    let volumetric = (dilatation.iter().zip(&area)).map(|(d, a)| 0.5 * bulk * d * d / a);
    isochoric + volumetric.sum::<f64>()
}

#[test]
fn the_work_of_an_obstacle_is_the_energy_of_solid_and_contact() {
    // Error of the trapezoidal rule over the states, which are four times as many each time.
    let mut errors = Vec::new();
    for steps in [12, 48] {
        let mut problem = hertz::problem(GmshElementKind::Quad4, 6, 0.6);
        problem.scene["actuation"]["load_steps_per_leg"] = steps.into();
        let travel = problem.scene["obstacles"][0]["travel_mm"][1]
            .as_f64()
            .unwrap();
        let solved = problem.solve(&mut Unobserved).unwrap();
        let force = |state: usize| solved.contact(state).map_or(0.0, |c| -c.on_obstacle[0][1]);
        let last = solved.last();
        let work: f64 = (1..=last)
            .map(|k| 0.5 * (force(k - 1) + force(k)) * travel / last as f64)
            .sum();
        let contact = solved.contact(last).unwrap().energy;
        let energy = strain_energy(&solved, last, 1e3) + contact;
        assert!(contact > 0.01 * energy);
        errors.push((work / energy - 1.0).abs());
    }
    assert!(
        errors[0] < 0.05 && errors[1] < errors[0] / 15.0,
        "{errors:?}"
    );
}

#[test]
fn the_work_of_pressure_is_the_energy_and_all_of_it_comes_back() {
    let mut errors = Vec::new();
    for steps in [2, 8] {
        let mut problem = collapsed_tube::problem(GmshElementKind::Quad4, [144, 2]);
        // The sides touch from about 5.3 on.
        let rows = [0.0, -4.0, -7.0, -9.0, 0.0].map(|p| [p * collapsed_tube::unit_kpa()]);
        problem.scene["actuation"]["schedule"] = serde_json::json!(rows);
        problem.scene["actuation"]["load_steps_per_leg"] = steps.into();
        let solved = problem.solve(&mut Unobserved).unwrap();
        let states = &solved.analysis.states;
        let pressure = |k: usize| 1e-3 * states[k].point.pressure_kpa[0];
        let area = |k: usize| states[k].cavity_area[0];
        let work: f64 = (2 * steps..3 * steps)
            .map(|k| 0.5 * (pressure(k) + pressure(k + 1)) * (area(k + 1) - area(k)))
            .sum();
        let energy = |k: usize| {
            strain_energy(&solved, k, 1e3) + states[k].contact.as_ref().map_or(0.0, |c| c.energy)
        };
        assert!(solved.contact(2 * steps).unwrap().energy > 0.0);
        let gained = energy(3 * steps) - energy(2 * steps);
        errors.push((work / gained - 1.0).abs());
        let left = solved.analysis.fields[4 * steps].iter().flatten();
        assert!(left.fold(0.0, |m: f64, u| m.max(u.abs())) < 1e-6);
    }
    assert!(
        errors[0] < 0.05 && errors[1] < errors[0] / 15.0,
        "{errors:?}"
    );
}

#[test]
fn forces_of_an_equilibrium_are_equal_and_opposite() {
    let sum = |forces: &[[f64; 2]], i: usize| forces.iter().map(|f| f[i]).sum::<f64>();
    let of = |problem: Problem| {
        let solved = problem.solve(&mut Unobserved).unwrap();
        let last = solved.last();
        (solved.contact_forces(last), solved)
    };
    let (forces, solved) = of(pressed_blocks::problem(GmshElementKind::Quad9, 2, 0.3));
    let pressed = forces.iter().fold(0.0, |m: f64, f| m + f[1].abs());
    assert!(pressed > 1.0);
    for i in 0..2 {
        assert!(sum(&forces, i).abs() < 1e-13 * pressed, "{i}");
    }
    // On the supports too, to the tolerance.
    let last = solved.last();
    let reactions = solved.internal_forces(last);
    assert!(sum(&reactions, 1).abs() < 1e-8 * pressed);
    let (forces, solved) = of(hertz::problem(GmshElementKind::Quad9, 4, 0.6));
    let last = solved.last();
    let plate = solved.contact(last).unwrap().on_obstacle[0];
    assert!(plate[1] < -1.0);
    for i in 0..2 {
        assert!(
            (sum(&forces, i) + plate[i]).abs() < 1e-13 * plate[1].abs(),
            "{i}"
        );
    }
}

#[test]
fn a_disc_slides_over_a_plate_without_catching() {
    let mut problem = hertz::problem(GmshElementKind::Quad9, 6, 0.3);
    problem.scene["actuation"]["schedule"] = serde_json::json!([[0, 0], [1, 0], [1, 1]]);
    problem.scene["actuation"]["load_steps_per_leg"] = 12.into();
    problem.scene["supports"] = serde_json::json!([
        {"group": "middle", "fix": ["x", "y"], "displacement_mm": [1.7, 0.0], "channel": 1},
    ]);
    let solved = problem.solve(&mut Unobserved).unwrap();
    let forces = |k: usize| solved.contact(k).unwrap().on_obstacle[0];
    let pressed = forces(12)[1];
    for k in 13..=solved.last() {
        let [x, y] = forces(k);
        let [x, y] = [x / pressed, y / pressed - 1.0];
        assert!(x.abs() < 1e-4 && y.abs() < 1e-4, "{k}: {x} {y}");
    }
}

#[test]
fn a_coarse_half_tube_follows_the_elastica() {
    let problem = crushed_tube::problem(GmshElementKind::Quad9, 32, 1);
    let solved = problem.solve(&mut Unobserved).unwrap();
    let state = solved.contact(4).unwrap();
    // Closed by 40 %, P R^2 / EI = 3.99 (`crushed_ring`).
    let force = -state.on_obstacle[0][1] * 2500.0 / (4.0 / 12.0);
    assert!((force / 3.99 - 1.0).abs() < 0.03, "{force}");
}

#[test]
fn pairs_of_groups_say_which_surfaces_act_on_each_other() {
    let paired = |pairs: serde_json::Value| {
        let mut problem = pressed_blocks::problem(GmshElementKind::Quad9, 1, 0.4);
        problem.scene["contact_pairs"] = pairs;
        problem
    };
    let solved = |pairs| paired(pairs).solve(&mut Unobserved).unwrap();
    let all = solved(serde_json::json!([]));
    let last = all.last();
    let energy = |solved: &Solved| solved.contact(last).map_or(0.0, |c| c.energy);
    assert!(energy(&all) > 0.0);
    // The faces meet, in whichever order they are named; but for them only the sides at their ends do.
    let faces = solved(serde_json::json!([["face", "counterface"]]));
    assert!((energy(&faces) / energy(&all) - 1.0).abs() < 5e-3);
    let turned = solved(serde_json::json!([["low", "low"], ["counterface", "face"]]));
    assert_eq!(energy(&turned).to_bits(), energy(&faces).to_bits());
    assert_eq!(turned.analysis.work, faces.analysis.work);
    // Faces that are no partners pass through each other, and nothing presses on them.
    let apart = solved(serde_json::json!([
        ["face", "face"],
        ["low", "counterface"]
    ]));
    assert_eq!(energy(&apart), 0.0);
    let moved = apart.positions(last);
    let lowest = (moved.iter().zip(&apart.analysis.system.body.mesh.nodes))
        .filter(|(_, rest)| rest[1] > 11.0)
        .map(|(now, _)| now[1])
        .fold(f64::INFINITY, f64::min);
    assert!(lowest < 8.5, "{lowest}");
    // A group that the file does not have, and one without edges.
    let faults = paired(serde_json::json!([
        ["face", "nowhere"],
        ["middles", "face"]
    ]));
    let Err(Unsolved::Faults(faults)) = faults.solve(&mut Unobserved) else {
        panic!("faults")
    };
    let paths: Vec<&str> = faults.0.iter().map(|f| f.path.as_str()).collect();
    assert_eq!(paths, ["contact_pairs[0][1]", "contact_pairs[1][0]"]);
}

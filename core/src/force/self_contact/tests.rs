use super::*;
use crate::geometry::Outline;
use crate::mesh::BoundaryEdge;

/// Two squares of 2 mm with quadratic edges, 0.13 mm apart, the upper one a little turned and bulged.
fn two_squares() -> (Vec<BoundaryLoop>, Vec<[f64; 2]>) {
    let mut nodes = Vec::new();
    let mut loops = Vec::new();
    for (low, turn) in [(0.0, 0.0), (6.0, 0.02)] {
        let first = nodes.len() as u32;
        let corner = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        for k in 0..4 {
            let (a, b): ([f64; 2], [f64; 2]) = (corner[k], corner[(k + 1) % 4]);
            for p in [a, [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]] {
                nodes.push([p[0] - turn * p[1] + 0.03, p[1] + low + turn * p[0]]);
            }
        }
        let edge = |k: u32| BoundaryEdge {
            ends: [first + 2 * k, first + (2 * k + 2) % 8],
            mid: Some(first + 2 * k + 1),
        };
        loops.push(BoundaryLoop {
            edges: (0..4).map(edge).collect(),
            starts_at_corner: vec![true; 4],
        });
    }
    (loops, nodes)
}

const LAW: ContactLaw = ContactLaw {
    activation_mm: 0.3,
    pressure_mpa: 0.01,
};

/// The upper square has come down to 0.13 mm above the lower one, and its lower side bulges.
fn pressed(x: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut x = x.to_vec();
    for p in &mut x[8..] {
        p[1] -= 3.87;
    }
    x[9][1] -= 0.04;
    x
}

#[test]
fn forces_and_their_derivatives_agree_with_differences() {
    let (loops, reference) = two_squares();
    let contact = SelfContact::new(LAW, &loops, &[], None, &reference);
    let x = pressed(&reference);
    let at = |x: &[[f64; 2]]| {
        let touches = contact.touches(x, &[], true);
        let mut force = vec![[0.0; 2]; x.len()];
        touches.add_gradient(&contact, &mut force);
        (touches, force)
    };
    let (touches, force) = at(&x);
    assert!(touches.pairs > 20 && touches.energy > 0.0);
    let mut matrix = vec![vec![0.0; 2 * x.len()]; 2 * x.len()];
    for c in touches.couplings(&contact, |node, i| 2 * node + i as u32) {
        let Some(values) = &c.values else { continue };
        for a in 0..12 {
            for b in 0..12 {
                if c.unknowns[a] != Coupling::NONE && c.unknowns[b] != Coupling::NONE {
                    let value = if a >= b { values[a][b] } else { values[b][a] };
                    matrix[c.unknowns[a] as usize][c.unknowns[b] as usize] += value;
                }
            }
        }
    }
    let size = force.iter().flatten().fold(0.0_f64, |m, f| m.max(f.abs()));
    let stiffness = matrix.iter().flatten().fold(0.0_f64, |m, f| m.max(f.abs()));
    let h = 1e-5;
    for node in 0..x.len() {
        for i in 0..2 {
            let mut moved = [x.clone(), x.clone()];
            moved[0][node][i] -= h;
            moved[1][node][i] += h;
            let [a, b] = moved.map(|x| at(&x));
            let slope = (b.0.energy - a.0.energy) / (2.0 * h);
            assert!((slope - force[node][i]).abs() < 1e-6 * size, "{node} {i}");
            for other in 0..x.len() {
                for j in 0..2 {
                    let slope = (b.1[other][j] - a.1[other][j]) / (2.0 * h);
                    let exact = matrix[2 * other + j][2 * node + i];
                    assert!(
                        (slope - exact).abs() < 1e-5 * stiffness,
                        "{node} {i} {other} {j}"
                    );
                }
            }
        }
    }
}

#[test]
fn forces_are_equal_and_opposite_and_have_no_moment() {
    let (loops, reference) = two_squares();
    let contact = SelfContact::new(LAW, &loops, &[], None, &reference);
    let x = pressed(&reference);
    let touches = contact.touches(&x, &[], false);
    let mut force = vec![[0.0; 2]; x.len()];
    touches.add_gradient(&contact, &mut force);
    let sum = |part: &[[f64; 2]], i: usize| part.iter().map(|f| f[i]).sum::<f64>();
    let size = sum(&force[..8], 1).abs();
    assert!(size > 0.0);
    for i in 0..2 {
        assert!((sum(&force[..8], i) + sum(&force[8..], i)).abs() < 1e-13 * size);
    }
    let moment = |(f, x): (&[f64; 2], &[f64; 2])| x[0] * f[1] - x[1] * f[0];
    let moment: f64 = force.iter().zip(&x).map(moment).sum();
    assert!(moment.abs() < 1e-12 * size, "{moment}");
}

#[test]
fn the_shape_derivative_agrees_with_differences() {
    // Near enough in the reference shape for the weight to be between 0 and 1.
    let (loops, mut reference) = two_squares();
    for p in &mut reference[8..] {
        p[1] -= 3.2;
    }
    let displacement: Vec<[f64; 2]> = (0..16)
        .map(|k| [0.0, if k < 8 { 0.0 } else { -0.66 }])
        .collect();
    let lambda: Vec<[f64; 2]> = (0..16)
        .map(|k| [f64::from(k * 7 % 5) - 2.0, f64::from(k * 3 % 7) - 3.0])
        .collect();
    let work = |reference: &[[f64; 2]]| {
        let contact = SelfContact::new(LAW, &loops, &[], None, reference);
        let x: Vec<[f64; 2]> = reference
            .iter()
            .zip(&displacement)
            .map(|(x, u)| [x[0] + u[0], x[1] + u[1]])
            .collect();
        let mut force = vec![[0.0; 2]; x.len()];
        contact
            .touches(&x, &[], false)
            .add_gradient(&contact, &mut force);
        let work: f64 = force
            .iter()
            .zip(&lambda)
            .map(|(f, l)| f[0] * l[0] + f[1] * l[1])
            .sum();
        let mut derivative = vec![[0.0; 2]; x.len()];
        contact.add_shape_derivative(&x, &[], &lambda, &mut derivative);
        (work, derivative)
    };
    let (value, derivative) = work(&reference);
    assert!(value != 0.0);
    let size = derivative
        .iter()
        .flatten()
        .fold(0.0_f64, |m, f| m.max(f.abs()));
    let h = 1e-5;
    for node in 0..16 {
        for i in 0..2 {
            let [a, b] = [-h, h].map(|h| {
                let mut x = reference.clone();
                x[node][i] += h;
                work(&x).0
            });
            let slope = (b - a) / (2.0 * h);
            let error = (slope - derivative[node][i]).abs();
            assert!(
                error < 2e-6 * size,
                "{node} {i}: {slope} {}",
                derivative[node][i]
            );
        }
    }
}

#[test]
fn a_step_ends_before_surfaces_meet() {
    let (loops, reference) = two_squares();
    let contact = SelfContact::new(LAW, &loops, &[], None, &reference);
    // 4 mm apart: a step of 8 mm meets after half of it.
    let down: Vec<[f64; 2]> = (0..16)
        .map(|k| [0.0, if k < 8 { 0.0 } else { -8.0 }])
        .collect();
    let share = contact.free_share(&reference, &down, [&[], &[]]);
    assert!((share - 0.8 * 0.5).abs() < 5e-3, "{share}");
    // A wild step, a thousand times as long, that shears the upper one as well.
    let wild: Vec<[f64; 2]> = (reference.iter().zip(&down))
        .map(|(p, d)| [1e3 * d[1] * (p[1] - 6.0), 1e3 * d[1]])
        .collect();
    let share = contact.free_share(&reference, &wild, [&[], &[]]);
    assert!((share - 0.8 * 0.5e-3).abs() < 5e-6, "{share}");
    let aside: Vec<[f64; 2]> = down.iter().map(|d| [d[1], 0.0]).collect();
    assert_eq!(contact.free_share(&reference, &aside, [&[], &[]]), 1.0);
    assert!(!contact.is_touching(&reference, &[]));
    assert!(contact.is_touching(&pressed(&reference), &[]));
}

#[test]
fn neighbours_along_a_surface_do_not_act() {
    let (loops, reference) = two_squares();
    let contact = SelfContact::new(LAW, &loops, &[], None, &reference);
    assert!(!contact.is_touching(&reference, &[]));
    // Also where the body is squeezed to 60 %, with its corners.
    let squeezed: Vec<[f64; 2]> = reference.iter().map(|p| [0.6 * p[0], 0.6 * p[1]]).collect();
    assert!(!contact.is_touching(&squeezed, &[]));
}

#[test]
fn flat_surfaces_press_evenly_with_the_pressure_of_the_law() {
    let (loops, mut reference) = two_squares();
    // Straight and parallel, wide apart at rest.
    for p in &mut reference[8..] {
        let q = [p[0] - 0.03, p[1] - 6.0];
        *p = [q[0] + 0.02 * q[1] + 0.03, q[1] - 0.02 * q[0] + 6.0];
    }
    let contact = SelfContact::new(LAW, &loops, &[], None, &reference);
    for ratio in [0.4, 0.5, 0.8] {
        let x: Vec<[f64; 2]> = reference
            .iter()
            .enumerate()
            .map(|(k, p)| {
                let down = if k < 8 {
                    0.0
                } else {
                    4.0 - ratio * LAW.activation_mm
                };
                [p[0], p[1] - down]
            })
            .collect();
        let touches = contact.touches(&x, &[], false);
        let mut force = vec![[0.0; 2]; x.len()];
        touches.add_gradient(&contact, &mut force);
        // The ends of the surfaces have neighbours on one side only: the force of 2 mm less one activation distance at most.
        let total: f64 = force[8..].iter().map(|f| -f[1]).sum();
        let p = LAW.pressure_mpa * kernel::flat_pressure(ratio) / kernel::flat_pressure(0.5);
        assert!(
            total > p * 1.7 && total < p * 2.1,
            "{ratio}: {total} of {}",
            2.0 * p
        );
        assert!(
            (touches.pressure_mpa / p - 1.0).abs() < 0.02,
            "{ratio}: {} of {p}",
            touches.pressure_mpa
        );
    }
}

/// Tangential over normal force, at most, as a plate slides below the lower square at a distance.
fn catch(ratio: f64) -> f64 {
    let (loops, reference) = two_squares();
    let plate = Obstacle {
        name: "plate".to_owned(),
        outline: Outline::Line {
            points_mm: [[-5.0, -1.0], [6.0, -1.0]],
        },
        travel_mm: [1.0, 1.0],
        channel: 0,
    };
    let contact = SelfContact::new(LAW, &loops, &[plate], None, &reference);
    let of_shift = |shift: f64| {
        let travel = [shift, 1.0 - ratio * LAW.activation_mm];
        let [x, y] = contact.touches(&reference, &[travel], false).on_obstacle[0];
        (x / y).abs()
    };
    (0..50)
        .map(|k| of_shift(0.005 * f64::from(k)))
        .fold(0.0, f64::max)
}

#[test]
fn surfaces_slide_without_catching() {
    for (ratio, bound) in [(0.7, 1e-4), (0.5, 1e-4), (0.3, 5e-4), (0.2, 3e-3)] {
        let catch = catch(ratio);
        assert!(catch < bound, "{ratio}: {catch}");
    }
}

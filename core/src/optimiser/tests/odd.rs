//! Small problems with something odd about them, whose optima are known in closed form.

use super::run::options;
use crate::optimiser::{
    Ask, DescentOptions, GcmmaOptions, GradientSource, OptimiserOptions, OptimiserState, Problem,
    SqpOptions, StopReason, Told, Values, start, step,
};

type Row = (f64, Vec<f64>);

struct Odd {
    name: &'static str,
    bounds: Vec<[f64; 2]>,
    x0: Vec<f64>,
    equalities: usize,
    optimum: f64,
    /// Objective and its gradient, then the rows.
    values: fn(&[f64]) -> Vec<Row>,
}

fn odd() -> Vec<Odd> {
    vec![
        Odd {
            name: "one variable",
            bounds: vec![[0.0, 10.0]],
            x0: vec![7.0],
            equalities: 0,
            optimum: 2.0,
            values: |x| {
                vec![
                    ((x[0] - 2.0).powi(2) + 1.0, vec![2.0 * (x[0] - 2.0)]),
                    (1.0 - x[0] / 3.0, vec![-1.0 / 3.0]),
                ]
            },
        },
        Odd {
            name: "a variable that cannot move",
            bounds: vec![[0.0, 10.0], [2.0, 2.0], [0.0, 10.0]],
            x0: vec![7.0, 2.0, 1.0],
            equalities: 0,
            optimum: 7.0,
            values: |x| {
                let f = (x[0] - 3.0).powi(2) + x[1] * x[1] + (x[2] - 4.0).powi(2) + 1.0;
                let sum = (x[0] + x[1] + x[2]) / 7.0 - 1.0;
                vec![
                    (f, vec![2.0 * (x[0] - 3.0), 2.0 * x[1], 2.0 * (x[2] - 4.0)]),
                    (sum, vec![1.0 / 7.0; 3]),
                ]
            },
        },
        Odd {
            name: "the same row four times, one of them twice as long",
            bounds: vec![[-10.0, 10.0]; 2],
            x0: vec![5.0, -4.0],
            equalities: 0,
            optimum: 2.0,
            values: |x| {
                let g = 1.0 - 0.5 * (x[0] + x[1]);
                let row = (g, vec![-0.5; 2]);
                vec![
                    (x[0] * x[0] + x[1] * x[1], vec![2.0 * x[0], 2.0 * x[1]]),
                    row.clone(),
                    row.clone(),
                    (2.0 * g, vec![-1.0; 2]),
                    row,
                ]
            },
        },
        Odd {
            name: "more active rows than variables",
            bounds: vec![[0.0, 10.0]; 2],
            x0: vec![8.0, 9.0],
            equalities: 0,
            optimum: 2.0,
            values: |x| {
                vec![
                    (x[0] + x[1], vec![1.0; 2]),
                    (1.0 - x[0], vec![-1.0, 0.0]),
                    (1.0 - x[1], vec![0.0, -1.0]),
                    (1.0 - 0.5 * (x[0] + x[1]), vec![-0.5; 2]),
                    (
                        1.0 - (2.0 * x[0] + x[1]) / 3.0,
                        vec![-2.0 / 3.0, -1.0 / 3.0],
                    ),
                ]
            },
        },
        Odd {
            name: "variables of sizes 1e-6 and 1e6",
            bounds: vec![[1e-7, 1e-5], [1e5, 1e7]],
            x0: vec![8e-6, 2e5],
            equalities: 0,
            optimum: 2.0,
            values: |x| {
                let (a, b) = (x[0] * 1e6, x[1] * 1e-6);
                vec![
                    (a + b, vec![1e6, 1e-6]),
                    (1.0 - a * b, vec![-b * 1e6, -a * 1e-6]),
                ]
            },
        },
        Odd {
            name: "a flat objective from an infeasible start",
            bounds: vec![[-10.0, 10.0]; 2],
            x0: vec![6.0, 7.0],
            equalities: 0,
            optimum: 3.0,
            values: |x| {
                vec![
                    (3.0, vec![0.0; 2]),
                    (
                        0.25 * (x[0] * x[0] + x[1] * x[1]) - 1.0,
                        vec![0.5 * x[0], 0.5 * x[1]],
                    ),
                ]
            },
        },
        Odd {
            name: "an equality far from being met",
            bounds: vec![[-10.0, 10.0]; 2],
            x0: vec![3.0, 4.0],
            equalities: 1,
            optimum: -1.0,
            values: |x| {
                vec![
                    (x[0], vec![1.0, 0.0]),
                    (
                        x[0] * x[0] + x[1] * x[1] - 1.0,
                        vec![2.0 * x[0], 2.0 * x[1]],
                    ),
                ]
            },
        },
        Odd {
            // Full steps increase both objective and violation (Powell 1986, after Maratos).
            name: "the Maratos effect",
            bounds: vec![[-2.0, 2.0]; 2],
            x0: vec![0.8_f64.cos(), 0.8_f64.sin()],
            equalities: 1,
            optimum: -1.0,
            values: |x| {
                let circle = x[0] * x[0] + x[1] * x[1] - 1.0;
                vec![
                    (2.0 * circle - x[0], vec![4.0 * x[0] - 1.0, 4.0 * x[1]]),
                    (circle, vec![2.0 * x[0], 2.0 * x[1]]),
                ]
            },
        },
        Odd {
            name: "tangents that contradict each other at the start",
            bounds: vec![[-4.0, 4.0]; 2],
            x0: vec![0.1, 3.0],
            equalities: 0,
            optimum: 1.0,
            values: |x| {
                // x0 >= 1 by way of a parabola whose tangent at the start asks for x0 >= 5, and x0 <= 2.
                vec![
                    (x[0] + x[1] * x[1], vec![1.0, 2.0 * x[1]]),
                    (1.0 - x[0] * x[0], vec![-2.0 * x[0], 0.0]),
                    (0.5 * x[0] - 1.0, vec![0.5, 0.0]),
                    (-x[0], vec![-1.0, 0.0]),
                ]
            },
        },
    ]
}

fn run(odd: &Odd, options: OptimiserOptions) -> (OptimiserState, StopReason) {
    let rows = (odd.values)(&odd.x0).len() - 1;
    let problem = Problem {
        lower: odd.bounds.iter().map(|bounds| bounds[0]).collect(),
        upper: odd.bounds.iter().map(|bounds| bounds[1]).collect(),
        inequalities: rows - odd.equalities,
        equalities: odd.equalities,
    };
    let (mut state, mut asks) = start(options, problem, odd.x0.clone()).expect("a start");
    for _ in 0..5000 {
        let answer = |ask: &Ask| {
            let mut rows = (odd.values)(&ask.x);
            let (objective, gradient) = rows.remove(0);
            Told::Values(Values {
                objective,
                constraints: rows.iter().map(|(g, _)| *g).collect(),
                gradient: ask.want_gradient.then_some(gradient),
                constraint_gradients: ask
                    .want_gradient
                    .then(|| rows.into_iter().map(|(_, dg)| dg).collect()),
            })
        };
        let told: Vec<Told> = asks.iter().map(answer).collect();
        let next = step(&state, &told);
        (state, asks) = (next.state, next.asks);
        if let Some(reason) = next.done {
            return (state, reason);
        }
    }
    panic!("{}: a run without end", odd.name);
}

#[test]
fn odd_problems_are_solved_by_every_method_with_gradients() {
    let mut failures = Vec::new();
    for odd in odd() {
        for gradient in [GradientSource::Model, GradientSource::Differences] {
            let gcmma = GcmmaOptions {
                descent: DescentOptions {
                    gradient,
                    ..GcmmaOptions::default().descent
                },
                ..GcmmaOptions::default()
            };
            let sqp = SqpOptions {
                descent: DescentOptions {
                    gradient,
                    ..SqpOptions::default().descent
                },
                ..SqpOptions::default()
            };
            let methods: [(&str, OptimiserOptions, f64); 3] = [
                ("mmfd", options(gradient).into(), 0.011),
                ("gcmma", gcmma.into(), 5e-3),
                ("sqp", sqp.into(), 1e-3),
            ];
            for (method, options, most) in methods {
                if gradient == GradientSource::Differences && odd.name.contains("1e-6") {
                    // Differences need a step that suits the variable.
                    continue;
                }
                if (method, gradient) == ("gcmma", GradientSource::Differences)
                    && odd.name.contains("far from being met")
                {
                    // Its steps along an equality's tangent stray, and shorten until it gives up.
                    continue;
                }
                let (state, reason) = run(&odd, options);
                let best = state.best().expect("a best point");
                let gap = (best.objective - odd.optimum) / odd.optimum.abs();
                let text = format!(
                    "{} {method} {gradient:?}: gap {gap:.1e}, violation {:.1e}, cost {}+{}, {reason:?}",
                    odd.name,
                    best.violation,
                    state.analyses(),
                    state.gradients()
                );
                println!("{text}");
                if gap.abs() > most || best.violation > 0.003 {
                    failures.push(text);
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn a_start_on_a_symmetry_without_a_slope_is_left() {
    let odd = Odd {
        name: "a maximum",
        bounds: vec![[-1.0, 1.0]; 2],
        x0: vec![0.0, 0.0],
        equalities: 0,
        optimum: -3.0,
        values: |x| {
            let f = -x[0] * x[0] - 2.0 * x[1] * x[1];
            vec![(f, vec![-2.0 * x[0], -4.0 * x[1]])]
        },
    };
    let (state, reason) = run(&odd, SqpOptions::default().into());
    let best = state.best().expect("a best point");
    assert!(
        (best.objective - odd.optimum).abs() < 1e-6,
        "{best:?}, {reason:?}"
    );
}

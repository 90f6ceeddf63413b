//! Published problems with their gradients. Bounds, starts, optima and check points are in `data/`, each file with its
//! source; the formulas are here.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::Deserialize;

use crate::optimiser::{Problem, Told, Values};

/// A point with known values.
#[derive(Deserialize)]
pub(super) struct CheckPoint {
    pub label: String,
    pub x: Vec<f64>,
    pub f: f64,
    pub g: Vec<f64>,
    pub df: Vec<f64>,
    pub dg: Option<Vec<Vec<f64>>>,
}

/// A problem file.
#[derive(Deserialize)]
pub(super) struct Case {
    pub id: String,
    pub n: usize,
    pub m: usize,
    pub equalities: Vec<usize>,
    pub x0: Vec<f64>,
    pub xl: Vec<f64>,
    pub xu: Vec<f64>,
    pub starts: BTreeMap<String, Vec<f64>>,
    pub f_star: f64,
    pub check_points: Vec<CheckPoint>,
}

macro_rules! case_files {
    ($($id:literal),* $(,)?) => {
        /// All problem files.
        pub(super) fn all() -> Vec<Case> {
            vec![$(read(include_str!(concat!("data/", $id, ".json")))),*]
        }
    };
}

case_files!(
    "cantilever_100",
    "cantilever_5",
    "cantilever_50",
    "hs100",
    "hs113",
    "hs71",
    "keane_10",
    "keane_2",
    "pressure_vessel",
    "rastrigin_plane_4",
    "rosen_suzuki",
    "rosen_suzuki_noisy",
    "rosenbrock_disk",
    "six_hump_camel",
    "speed_reducer",
    "spring",
    "svanberg_cantilever",
    "three_bar_truss",
    "welded_beam",
);

fn read(text: &str) -> Case {
    serde_json::from_str(text).expect("a problem file")
}

/// The problem of this name.
pub(super) fn named(id: &str) -> Case {
    all()
        .into_iter()
        .find(|case| case.id == id)
        .expect("a known problem")
}

impl Case {
    pub fn problem(&self) -> Problem {
        Problem {
            lower: self.xl.clone(),
            upper: self.xu.clone(),
            inequalities: self.m - self.equalities.len(),
            equalities: self.equalities.len(),
        }
    }

    /// Objective, constraints and their gradients.
    pub fn evaluate(&self, x: &[f64], want_gradient: bool) -> Told {
        let (f, df, rows) = formula(&self.id, x);
        let values = Values {
            objective: f,
            constraints: rows.iter().map(|(g, _)| *g).collect(),
            gradient: want_gradient.then_some(df),
            constraint_gradients: want_gradient
                .then(|| rows.into_iter().map(|(_, dg)| dg).collect()),
        };
        if values.objective.is_finite() && values.constraints.iter().all(|g| g.is_finite()) {
            Told::Values(values)
        } else {
            Told::Failed
        }
    }
}

type Row = (f64, Vec<f64>);

/// f, grad f, and each g with its gradient.
pub(super) fn formula(id: &str, x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    match id {
        "cantilever_5" | "cantilever_50" | "cantilever_100" => cantilever(x),
        "hs100" => hs100(x),
        "hs113" => hs113(x),
        "hs71" => hs71(x),
        "keane_2" | "keane_10" => keane(x),
        "pressure_vessel" => pressure_vessel(x),
        "rastrigin_plane_4" => rastrigin(x),
        "rosen_suzuki" => rosen_suzuki(x),
        "rosen_suzuki_noisy" => noisy(x),
        "rosenbrock_disk" => rosenbrock(x),
        "six_hump_camel" => six_hump(x),
        "speed_reducer" => speed_reducer(x),
        "spring" => spring(x),
        "svanberg_cantilever" => svanberg(x),
        "three_bar_truss" => three_bar(x),
        "welded_beam" => welded_beam(x),
        other => panic!("no formula for {other}"),
    }
}

fn cantilever(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let n = x.len() / 2;
    let (load, modulus, span) = (50000.0, 2e7, 500.0);
    let l = span / n as f64;
    let (b, h) = x.split_at(n);
    let f = l * b.iter().zip(h).map(|(b, h)| b * h).sum::<f64>() / 1000.0;
    let df = h.iter().chain(b).map(|other| l * other / 1000.0).collect();
    let mut rows = Vec::new();
    for i in 0..n {
        let moment = load * (span - i as f64 * l);
        let stress = 6.0 * moment / (b[i] * h[i] * h[i]) / 14000.0;
        let mut dg = vec![0.0; 2 * n];
        dg[i] = -stress / b[i];
        dg[n + i] = -2.0 * stress / h[i];
        rows.push((stress - 1.0, dg));
    }
    for i in 0..n {
        let mut dg = vec![0.0; 2 * n];
        dg[i] = -h[i] / (20.0 * b[i] * b[i]);
        dg[n + i] = 1.0 / (20.0 * b[i]);
        rows.push((h[i] / (20.0 * b[i]) - 1.0, dg));
    }
    // The tip's deflection is a sum over segments of weight / I.
    let (mut y, mut slope) = (0.0, 0.0);
    let mut dg = vec![0.0; 2 * n];
    for i in 0..n {
        let inertia = b[i] * h[i].powi(3) / 12.0;
        let at = (i + 1) as f64 * l;
        let rise = load * l * l / (2.0 * modulus * inertia) * (span - at + 2.0 * l / 3.0);
        let turn = load * l / (modulus * inertia) * (span + l / 2.0 - at);
        y += rise + slope * l;
        slope += turn;
        let share = (rise + turn * l * (n - 1 - i) as f64) / 2.5;
        dg[i] = -share / b[i];
        dg[n + i] = -3.0 * share / h[i];
    }
    rows.push((y / 2.5 - 1.0, dg));
    (f, df, rows)
}

fn hs100(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b, c, d, e, p, q] = [x[0], x[1], x[2], x[3], x[4], x[5], x[6]];
    let f = (a - 10.0).powi(2)
        + 5.0 * (b - 12.0).powi(2)
        + c.powi(4)
        + 3.0 * (d - 11.0).powi(2)
        + 10.0 * e.powi(6)
        + 7.0 * p * p
        + q.powi(4)
        - 4.0 * p * q
        - 10.0 * p
        - 8.0 * q;
    let df = vec![
        2.0 * (a - 10.0),
        10.0 * (b - 12.0),
        4.0 * c.powi(3),
        6.0 * (d - 11.0),
        60.0 * e.powi(5),
        14.0 * p - 4.0 * q - 10.0,
        4.0 * q.powi(3) - 4.0 * p - 8.0,
    ];
    let rows = vec![
        scaled(
            2.0 * a * a + 3.0 * b.powi(4) + c + 4.0 * d * d + 5.0 * e - 127.0,
            &[4.0 * a, 12.0 * b.powi(3), 1.0, 8.0 * d, 5.0, 0.0, 0.0],
            127.0,
        ),
        scaled(
            7.0 * a + 3.0 * b + 10.0 * c * c + d - e - 282.0,
            &[7.0, 3.0, 20.0 * c, 1.0, -1.0, 0.0, 0.0],
            282.0,
        ),
        scaled(
            23.0 * a + b * b + 6.0 * p * p - 8.0 * q - 196.0,
            &[23.0, 2.0 * b, 0.0, 0.0, 0.0, 12.0 * p, -8.0],
            196.0,
        ),
        scaled(
            4.0 * a * a + b * b - 3.0 * a * b + 2.0 * c * c + 5.0 * p - 11.0 * q,
            &[
                8.0 * a - 3.0 * b,
                2.0 * b - 3.0 * a,
                4.0 * c,
                0.0,
                0.0,
                5.0,
                -11.0,
            ],
            100.0,
        ),
    ];
    (f, df, rows)
}

fn scaled(g: f64, dg: &[f64], by: f64) -> Row {
    (g / by, dg.iter().map(|value| value / by).collect())
}

/// A row with a few entries.
fn sparse(n: usize, g: f64, entries: &[(usize, f64)], by: f64) -> Row {
    let mut dg = vec![0.0; n];
    for &(i, value) in entries {
        dg[i] = value / by;
    }
    (g / by, dg)
}

fn hs113(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b, c, d, e, p, q, r, s, t] =
        [x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9]];
    let f = a * a + b * b + a * b - 14.0 * a - 16.0 * b
        + (c - 10.0).powi(2)
        + 4.0 * (d - 5.0).powi(2)
        + (e - 3.0).powi(2)
        + 2.0 * (p - 1.0).powi(2)
        + 5.0 * q * q
        + 7.0 * (r - 11.0).powi(2)
        + 2.0 * (s - 10.0).powi(2)
        + (t - 7.0).powi(2)
        + 45.0;
    let df = vec![
        2.0 * a + b - 14.0,
        2.0 * b + a - 16.0,
        2.0 * (c - 10.0),
        8.0 * (d - 5.0),
        2.0 * (e - 3.0),
        4.0 * (p - 1.0),
        10.0 * q,
        14.0 * (r - 11.0),
        4.0 * (s - 10.0),
        2.0 * (t - 7.0),
    ];
    let rows = vec![
        sparse(
            10,
            4.0 * a + 5.0 * b - 3.0 * q + 9.0 * r - 105.0,
            &[(0, 4.0), (1, 5.0), (6, -3.0), (7, 9.0)],
            105.0,
        ),
        sparse(
            10,
            10.0 * a - 8.0 * b - 17.0 * q + 2.0 * r,
            &[(0, 10.0), (1, -8.0), (6, -17.0), (7, 2.0)],
            10.0,
        ),
        sparse(
            10,
            -8.0 * a + 2.0 * b + 5.0 * s - 2.0 * t - 12.0,
            &[(0, -8.0), (1, 2.0), (8, 5.0), (9, -2.0)],
            12.0,
        ),
        sparse(
            10,
            3.0 * (a - 2.0).powi(2) + 4.0 * (b - 3.0).powi(2) + 2.0 * c * c - 7.0 * d - 120.0,
            &[
                (0, 6.0 * (a - 2.0)),
                (1, 8.0 * (b - 3.0)),
                (2, 4.0 * c),
                (3, -7.0),
            ],
            120.0,
        ),
        sparse(
            10,
            5.0 * a * a + 8.0 * b + (c - 6.0).powi(2) - 2.0 * d - 40.0,
            &[(0, 10.0 * a), (1, 8.0), (2, 2.0 * (c - 6.0)), (3, -2.0)],
            40.0,
        ),
        sparse(
            10,
            0.5 * (a - 8.0).powi(2) + 2.0 * (b - 4.0).powi(2) + 3.0 * e * e - p - 30.0,
            &[(0, a - 8.0), (1, 4.0 * (b - 4.0)), (4, 6.0 * e), (5, -1.0)],
            30.0,
        ),
        sparse(
            10,
            a * a + 2.0 * (b - 2.0).powi(2) - 2.0 * a * b + 14.0 * e - 6.0 * p,
            &[
                (0, 2.0 * a - 2.0 * b),
                (1, 4.0 * (b - 2.0) - 2.0 * a),
                (4, 14.0),
                (5, -6.0),
            ],
            10.0,
        ),
        sparse(
            10,
            -3.0 * a + 6.0 * b + 12.0 * (s - 8.0).powi(2) - 7.0 * t,
            &[(0, -3.0), (1, 6.0), (8, 24.0 * (s - 8.0)), (9, -7.0)],
            10.0,
        ),
    ];
    (f, df, rows)
}

fn hs71(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b, c, d] = [x[0], x[1], x[2], x[3]];
    let f = a * d * (a + b + c) + c;
    let df = vec![d * (2.0 * a + b + c), a * d, a * d + 1.0, a * (a + b + c)];
    let rows = vec![
        (
            1.0 - a * b * c * d / 25.0,
            vec![
                -b * c * d / 25.0,
                -a * c * d / 25.0,
                -a * b * d / 25.0,
                -a * b * c / 25.0,
            ],
        ),
        (
            (a * a + b * b + c * c + d * d) / 40.0 - 1.0,
            x.iter().map(|x| x / 20.0).collect(),
        ),
    ];
    (f, df, rows)
}

fn keane(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let n = x.len();
    let sum: f64 = x.iter().map(|x| x.cos().powi(4)).sum();
    let product: f64 = x.iter().map(|x| x.cos().powi(2)).product();
    let weight: f64 = x
        .iter()
        .enumerate()
        .map(|(i, x)| (i + 1) as f64 * x * x)
        .sum();
    let top = sum - 2.0 * product;
    let root = weight.sqrt();
    let sign = if top > 0.0 {
        1.0
    } else if top < 0.0 {
        -1.0
    } else {
        0.0
    };
    let df = (0..n)
        .map(|i| {
            let rest: f64 = (0..n)
                .filter(|j| *j != i)
                .map(|j| x[j].cos().powi(2))
                .product();
            let (sin, cos) = x[i].sin_cos();
            let d_top = -4.0 * cos.powi(3) * sin + 4.0 * cos * sin * rest;
            -sign * (d_top / root - top * (i + 1) as f64 * x[i] / root.powi(3))
        })
        .collect();
    let whole: f64 = x.iter().product();
    let without = |i: usize| -> f64 { (0..n).filter(|j| *j != i).map(|j| x[j]).product() };
    let by = 7.5 * n as f64;
    let rows = vec![
        (0.75 - whole, (0..n).map(|i| -without(i)).collect()),
        (x.iter().sum::<f64>() / by - 1.0, vec![1.0 / by; n]),
    ];
    (-top.abs() / root, df, rows)
}

fn pressure_vessel(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b, r, l] = [x[0], x[1], x[2], x[3]];
    let f = 0.6224 * a * r * l + 1.7781 * b * r * r + 3.1661 * a * a * l + 19.84 * a * a * r;
    let df = vec![
        0.6224 * r * l + 6.3322 * a * l + 39.68 * a * r,
        1.7781 * r * r,
        0.6224 * a * l + 3.5562 * b * r + 19.84 * a * a,
        0.6224 * a * r + 3.1661 * a * a,
    ];
    let volume = 1_296_000.0;
    let rows = vec![
        (
            1.0 - a / (0.0193 * r),
            vec![-1.0 / (0.0193 * r), 0.0, a / (0.0193 * r * r), 0.0],
        ),
        (
            1.0 - b / (0.00954 * r),
            vec![0.0, -1.0 / (0.00954 * r), b / (0.00954 * r * r), 0.0],
        ),
        (
            1.0 - (PI * r * r * l + 4.0 / 3.0 * PI * r.powi(3)) / volume,
            vec![
                0.0,
                0.0,
                -(2.0 * PI * r * l + 4.0 * PI * r * r) / volume,
                -PI * r * r / volume,
            ],
        ),
    ];
    (f, df, rows)
}

fn rastrigin(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let f = 10.0 * x.len() as f64
        + x.iter()
            .map(|x| x * x - 10.0 * (2.0 * PI * x).cos())
            .sum::<f64>();
    let df = x
        .iter()
        .map(|x| 2.0 * x + 20.0 * PI * (2.0 * PI * x).sin())
        .collect();
    (
        f,
        df,
        vec![(1.0 - x.iter().sum::<f64>() / 3.0, vec![-1.0 / 3.0; x.len()])],
    )
}

fn rosen_suzuki(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b, c, d] = [x[0], x[1], x[2], x[3]];
    let f = a * a - 5.0 * a + b * b - 5.0 * b + 2.0 * c * c - 21.0 * c + d * d + 7.0 * d + 50.0;
    let df = vec![2.0 * a - 5.0, 2.0 * b - 5.0, 4.0 * c - 21.0, 2.0 * d + 7.0];
    let rows = vec![
        (
            a * a + a + b * b - b + c * c + c + d * d - d - 8.0,
            vec![2.0 * a + 1.0, 2.0 * b - 1.0, 2.0 * c + 1.0, 2.0 * d - 1.0],
        ),
        (
            a * a - a + 2.0 * b * b + c * c + 2.0 * d * d - d - 10.0,
            vec![2.0 * a - 1.0, 4.0 * b, 2.0 * c, 4.0 * d - 1.0],
        ),
        (
            2.0 * a * a + 2.0 * a + b * b - b + c * c - d - 5.0,
            vec![4.0 * a + 2.0, 2.0 * b - 1.0, 2.0 * c, -1.0],
        ),
    ];
    (f, df, rows)
}

/// Rosen-Suzuki with a ripple that only differences over long steps see through.
fn noisy(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let (f, df, rows) = rosen_suzuki(x);
    let waves = [9173.0, 3911.0, 7717.0, 5273.0];
    let phase: f64 = waves.iter().zip(x).map(|(w, x)| w * x).sum();
    let (z, dz) = phase.sin_cos();
    let df = df
        .iter()
        .zip(waves)
        .map(|(df, w)| df * (1.0 + 2e-6 * z) + f * 2e-6 * dz * w)
        .collect();
    let ripple = |(g, dg): Row| {
        let dg = dg
            .iter()
            .zip(waves)
            .map(|(dg, w)| dg + 1e-5 * dz * w)
            .collect();
        (g + 1e-5 * z, dg)
    };
    (
        f * (1.0 + 2e-6 * z),
        df,
        rows.into_iter().map(ripple).collect(),
    )
}

fn rosenbrock(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b] = [x[0], x[1]];
    let f = 100.0 * (b - a * a).powi(2) + (1.0 - a).powi(2);
    let df = vec![
        -400.0 * a * (b - a * a) - 2.0 * (1.0 - a),
        200.0 * (b - a * a),
    ];
    (f, df, vec![(a * a + b * b - 1.0, vec![2.0 * a, 2.0 * b])])
}

fn six_hump(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b] = [x[0], x[1]];
    let f = (4.0 - 2.1 * a * a + a.powi(4) / 3.0) * a * a + a * b + (-4.0 + 4.0 * b * b) * b * b;
    let df = vec![
        8.0 * a - 8.4 * a.powi(3) + 2.0 * a.powi(5) + b,
        a - 8.0 * b + 16.0 * b.powi(3),
    ];
    (f, df, Vec::new())
}

#[expect(
    clippy::approx_constant,
    reason = "the published problem rounds pi / 4 to 0.7854"
)]
fn speed_reducer(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [a, b, c, d, e, p, q] = [x[0], x[1], x[2], x[3], x[4], x[5], x[6]];
    let teeth = 3.3333 * c * c + 14.9334 * c - 43.0934;
    let f = 0.7854 * a * b * b * teeth - 1.508 * a * (p * p + q * q)
        + 7.4777 * (p.powi(3) + q.powi(3))
        + 0.7854 * (d * p * p + e * q * q);
    let df = vec![
        0.7854 * b * b * teeth - 1.508 * (p * p + q * q),
        1.5708 * a * b * teeth,
        0.7854 * a * b * b * (6.6666 * c + 14.9334),
        0.7854 * p * p,
        0.7854 * q * q,
        -3.016 * a * p + 22.4331 * p * p + 1.5708 * d * p,
        -3.016 * a * q + 22.4331 * q * q + 1.5708 * e * q,
    ];
    // A monomial c x^powers - 1 and its gradient.
    let monomial = |factor: f64, powers: [i32; 7]| -> Row {
        let value = factor
            * x.iter()
                .zip(powers)
                .map(|(x, power)| x.powi(power))
                .product::<f64>();
        (
            value - 1.0,
            x.iter()
                .zip(powers)
                .map(|(x, power)| value * f64::from(power) / x)
                .collect(),
        )
    };
    // Bending stress of a shaft: sqrt((745 l / (m z))^2 + constant) / (limit * diameter^3) - 1.
    let shaft = |length: usize, diameter: usize, constant: f64, limit: f64| -> Row {
        let torque = 745.0 * x[length] / (b * c);
        let root = (torque * torque + constant).sqrt();
        let value = root / (limit * x[diameter].powi(3));
        let share = value * torque * torque / (root * root);
        let mut dg = vec![0.0; 7];
        dg[1] = -share / b;
        dg[2] = -share / c;
        dg[length] = share / x[length];
        dg[diameter] = -3.0 * value / x[diameter];
        (value - 1.0, dg)
    };
    let rows = vec![
        monomial(27.0, [-1, -2, -1, 0, 0, 0, 0]),
        monomial(397.5, [-1, -2, -2, 0, 0, 0, 0]),
        monomial(1.93, [0, -1, -1, 3, 0, -4, 0]),
        monomial(1.93, [0, -1, -1, 0, 3, 0, -4]),
        shaft(3, 5, 16.9e6, 110.0),
        shaft(4, 6, 157.5e6, 85.0),
        monomial(1.0 / 40.0, [0, 1, 1, 0, 0, 0, 0]),
        monomial(5.0, [-1, 1, 0, 0, 0, 0, 0]),
        monomial(1.0 / 12.0, [1, -1, 0, 0, 0, 0, 0]),
        (
            (1.5 * p + 1.9) / d - 1.0,
            vec![0.0, 0.0, 0.0, -(1.5 * p + 1.9) / (d * d), 0.0, 1.5 / d, 0.0],
        ),
        (
            (1.1 * q + 1.9) / e - 1.0,
            vec![0.0, 0.0, 0.0, 0.0, -(1.1 * q + 1.9) / (e * e), 0.0, 1.1 / e],
        ),
    ];
    (f, df, rows)
}

fn spring(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [d, dd, n] = [x[0], x[1], x[2]];
    let f = (n + 2.0) * dd * d * d;
    let df = vec![2.0 * (n + 2.0) * dd * d, (n + 2.0) * d * d, dd * d * d];
    let deflection = dd.powi(3) * n / (71785.0 * d.powi(4));
    let (top, bottom) = (
        4.0 * dd * dd - d * dd,
        12566.0 * (dd * d.powi(3) - d.powi(4)),
    );
    let shear = top / bottom;
    let d_bottom = [
        12566.0 * (3.0 * dd * d * d - 4.0 * d.powi(3)),
        12566.0 * d.powi(3),
    ];
    let frequency = 140.45 * d / (dd * dd * n);
    let rows = vec![
        (
            1.0 - deflection,
            vec![
                4.0 * deflection / d,
                -3.0 * deflection / dd,
                -deflection / n,
            ],
        ),
        (
            shear + 1.0 / (5108.0 * d * d) - 1.0,
            vec![
                (-dd - shear * d_bottom[0]) / bottom - 2.0 / (5108.0 * d.powi(3)),
                (8.0 * dd - d - shear * d_bottom[1]) / bottom,
                0.0,
            ],
        ),
        (
            1.0 - frequency,
            vec![-frequency / d, 2.0 * frequency / dd, frequency / n],
        ),
        ((d + dd) / 1.5 - 1.0, vec![1.0 / 1.5, 1.0 / 1.5, 0.0]),
    ];
    (f, df, rows)
}

fn svanberg(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let loads = [61.0, 37.0, 19.0, 7.0, 1.0];
    let f = 0.0624 * x.iter().sum::<f64>();
    let g = loads.iter().zip(x).map(|(c, x)| c / x.powi(3)).sum::<f64>() - 1.0;
    let dg = loads
        .iter()
        .zip(x)
        .map(|(c, x)| -3.0 * c / x.powi(4))
        .collect();
    (f, vec![0.0624; 5], vec![(g, dg)])
}

fn three_bar(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let root = 2.0_f64.sqrt();
    let [a, b] = [x[0], x[1]];
    let den = 2.0 * a * b + root * a * a;
    let d_den = [2.0 * b + 2.0 * root * a, 2.0 * a];
    let stress = |top: f64, d_top: [f64; 2]| -> Row {
        let value = 20.0 * top / den;
        (
            value,
            (0..2)
                .map(|i| (20.0 * d_top[i] - value * d_den[i]) / den)
                .collect(),
        )
    };
    let limit = |(value, d): &Row, by: f64| -> Row {
        (value / by - 1.0, d.iter().map(|d| d / by).collect())
    };
    let stresses = [
        stress(root * a + b, [root, 1.0]),
        stress(root * a, [root, 0.0]),
        stress(-b, [0.0, -1.0]),
    ];
    let rows = stresses
        .iter()
        .flat_map(|s| [limit(s, -15.0), limit(s, 20.0)])
        .collect();
    (2.0 * root * a + b, vec![2.0 * root, 1.0], rows)
}

/// Ragsdell and Phillips' welded beam; gradients of the weld's shear stress by the chain rule.
fn welded_beam(x: &[f64]) -> (f64, Vec<f64>, Vec<Row>) {
    let [h, l, t, b] = [x[0], x[1], x[2], x[3]];
    let (load, span, young, shear) = (6000.0, 14.0, 30e6, 12e6);
    let f = 1.10471 * h * h * l + 0.04811 * t * b * (14.0 + l);
    let df = vec![
        2.20942 * h * l,
        1.10471 * h * h + 0.04811 * t * b,
        0.04811 * b * (14.0 + l),
        0.04811 * t * (14.0 + l),
    ];
    let root2 = 2.0_f64.sqrt();
    let direct = load / (root2 * h * l);
    let moment = load * (span + l / 2.0);
    let arm = (l * l / 4.0 + f64::midpoint(h, t).powi(2)).sqrt();
    let inner = l * l / 12.0 + f64::midpoint(h, t).powi(2);
    let polar = 2.0 * root2 * h * l * inner;
    let torsion = moment * arm / polar;
    let tau = (direct * direct + direct * torsion * l / arm + torsion * torsion).sqrt();
    // Relative derivatives of direct, moment, arm, polar with respect to (h, l, t).
    let half = f64::midpoint(h, t);
    let d_direct = [-direct / h, -direct / l, 0.0];
    let d_moment = [0.0, load / 2.0, 0.0];
    let d_arm = [half / (2.0 * arm), l / (4.0 * arm), half / (2.0 * arm)];
    let d_inner = [half, l / 6.0, half];
    let d_polar = [
        polar / h + polar * d_inner[0] / inner,
        polar / l + polar * d_inner[1] / inner,
        polar * d_inner[2] / inner,
    ];
    let cosine = l / arm;
    let mut d_tau = vec![0.0; 4];
    for i in 0..3 {
        let d_torsion = torsion * (d_moment[i] / moment + d_arm[i] / arm - d_polar[i] / polar);
        let d_cosine = if i == 1 { 1.0 / arm } else { 0.0 } - cosine * d_arm[i] / arm;
        d_tau[i] = (2.0 * direct * d_direct[i]
            + (d_direct[i] * torsion + direct * d_torsion) * cosine
            + direct * torsion * d_cosine
            + 2.0 * torsion * d_torsion)
            / (2.0 * tau);
    }
    let bending = 6.0 * load * span / (b * t * t);
    let deflection = 4.0 * load * span.powi(3) / (young * t.powi(3) * b);
    let slender = t / (2.0 * span) * (young / (4.0 * shear)).sqrt();
    let base = 4.013 * young / (6.0 * span * span);
    let buckling = base * t * b.powi(3) * (1.0 - slender);
    let cost = 0.10471 * h * h + 0.04811 * t * b * (14.0 + l);
    let rows = vec![
        scaled(tau - 13600.0, &d_tau, 13600.0),
        scaled(
            bending - 30000.0,
            &[0.0, 0.0, -2.0 * bending / t, -bending / b],
            30000.0,
        ),
        scaled(h - b, &[1.0, 0.0, 0.0, -1.0], 2.0),
        scaled(
            cost - 5.0,
            &[
                0.20942 * h,
                0.04811 * t * b,
                0.04811 * b * (14.0 + l),
                0.04811 * t * (14.0 + l),
            ],
            5.0,
        ),
        scaled(0.125 - h, &[-1.0, 0.0, 0.0, 0.0], 0.125),
        scaled(
            deflection - 0.25,
            &[0.0, 0.0, -3.0 * deflection / t, -deflection / b],
            0.25,
        ),
        scaled(
            load - buckling,
            &[
                0.0,
                0.0,
                -base * b.powi(3) * (1.0 - 2.0 * slender),
                -3.0 * buckling / b,
            ],
            load,
        ),
    ];
    (f, df, rows)
}

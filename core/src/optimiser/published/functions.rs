//! Functions, most of them from Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (1981).

use std::f64::consts::PI;

use super::row::{Row, Values, scaled, sparse};

pub(super) fn hs100(x: &[f64]) -> Values {
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

pub(super) fn hs113(x: &[f64]) -> Values {
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

pub(super) fn hs71(x: &[f64]) -> Values {
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

pub(super) fn keane(x: &[f64]) -> Values {
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

pub(super) fn rastrigin(x: &[f64]) -> Values {
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

pub(super) fn rosen_suzuki(x: &[f64]) -> Values {
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
pub(super) fn noisy(x: &[f64]) -> Values {
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

pub(super) fn rosenbrock(x: &[f64]) -> Values {
    let [a, b] = [x[0], x[1]];
    let f = 100.0 * (b - a * a).powi(2) + (1.0 - a).powi(2);
    let df = vec![
        -400.0 * a * (b - a * a) - 2.0 * (1.0 - a),
        200.0 * (b - a * a),
    ];
    (f, df, vec![(a * a + b * b - 1.0, vec![2.0 * a, 2.0 * b])])
}

pub(super) fn six_hump(x: &[f64]) -> Values {
    let [a, b] = [x[0], x[1]];
    let f = (4.0 - 2.1 * a * a + a.powi(4) / 3.0) * a * a + a * b + (-4.0 + 4.0 * b * b) * b * b;
    let df = vec![
        8.0 * a - 8.4 * a.powi(3) + 2.0 * a.powi(5) + b,
        a - 8.0 * b + 16.0 * b.powi(3),
    ];
    (f, df, Vec::new())
}

pub(super) fn hs24(x: &[f64]) -> Values {
    let [a, b] = [x[0], x[1]];
    let root = 3.0_f64.sqrt();
    let by = 27.0 * root;
    let shape = (a - 3.0).powi(2) - 9.0;
    let rows = vec![
        (b - a / root, vec![-1.0 / root, 1.0]),
        (-a - root * b, vec![-1.0, -root]),
        scaled(a + root * b - 6.0, &[1.0, root], 6.0),
    ];
    let df = vec![2.0 * (a - 3.0) * b.powi(3) / by, 3.0 * shape * b * b / by];
    (shape * b.powi(3) / by, df, rows)
}

pub(super) fn hs26(x: &[f64]) -> Values {
    let [a, b, c] = [x[0], x[1], x[2]];
    let f = (a - b).powi(2) + (b - c).powi(4);
    let df = vec![
        2.0 * (a - b),
        4.0 * (b - c).powi(3) - 2.0 * (a - b),
        -4.0 * (b - c).powi(3),
    ];
    let row = scaled(
        (1.0 + b * b) * a + c.powi(4) - 3.0,
        &[1.0 + b * b, 2.0 * a * b, 4.0 * c.powi(3)],
        3.0,
    );
    (f, df, vec![row])
}

pub(super) fn hs35(x: &[f64]) -> Values {
    let [a, b, c] = [x[0], x[1], x[2]];
    let f = 9.0 - 8.0 * a - 6.0 * b - 4.0 * c
        + 2.0 * a * a
        + 2.0 * b * b
        + c * c
        + 2.0 * a * b
        + 2.0 * a * c;
    let df = vec![
        4.0 * a + 2.0 * b + 2.0 * c - 8.0,
        4.0 * b + 2.0 * a - 6.0,
        2.0 * c + 2.0 * a - 4.0,
    ];
    (
        f,
        df,
        vec![scaled(a + b + 2.0 * c - 3.0, &[1.0, 1.0, 2.0], 3.0)],
    )
}

pub(super) fn hs65(x: &[f64]) -> Values {
    let [a, b, c] = [x[0], x[1], x[2]];
    let f = (a - b).powi(2) + (a + b - 10.0).powi(2) / 9.0 + (c - 5.0).powi(2);
    let mean = 2.0 * (a + b - 10.0) / 9.0;
    let df = vec![2.0 * (a - b) + mean, mean - 2.0 * (a - b), 2.0 * (c - 5.0)];
    let row = scaled(
        a * a + b * b + c * c - 48.0,
        &[2.0 * a, 2.0 * b, 2.0 * c],
        48.0,
    );
    (f, df, vec![row])
}

pub(super) fn hs76(x: &[f64]) -> Values {
    let [a, b, c, d] = [x[0], x[1], x[2], x[3]];
    let f = a * a + 0.5 * b * b + c * c + 0.5 * d * d - a * c + c * d - a - 3.0 * b + c - d;
    let df = vec![
        2.0 * a - c - 1.0,
        b - 3.0,
        2.0 * c - a + d + 1.0,
        d + c - 1.0,
    ];
    let rows = vec![
        scaled(a + 2.0 * b + c + d - 5.0, &[1.0, 2.0, 1.0, 1.0], 5.0),
        scaled(3.0 * a + b + 2.0 * c - d - 4.0, &[3.0, 1.0, 2.0, -1.0], 4.0),
        scaled(1.5 - b - 4.0 * c, &[0.0, -1.0, -4.0, 0.0], 1.5),
    ];
    (f, df, rows)
}

/// The terms are p = a d (a + b + c) and q = b c (a + 1.57 b + d).
pub(super) fn hs93(x: &[f64]) -> Values {
    let [a, b, c, d, e, h] = [x[0], x[1], x[2], x[3], x[4], x[5]];
    let (s, t) = (a + b + c, a + 1.57 * b + d);
    let (p, q) = (a * d * s, b * c * t);
    let dp = [d * s + a * d, a * d, a * d, a * s];
    let dq = [b * c, c * t + 1.57 * b * c, b * t, b * c];
    // Both the objective and the second row are u p + v p e^2 + w q + z q h^2.
    let sum = |[u, v, w, z]: [f64; 4]| {
        let (of_p, of_q) = (u + v * e * e, w + z * h * h);
        let mut gradient: Vec<f64> = (0..4).map(|i| of_p * dp[i] + of_q * dq[i]).collect();
        gradient.extend([2.0 * v * p * e, 2.0 * z * q * h]);
        (of_p * p + of_q * q, gradient)
    };
    let (f, df) = sum([0.0204, 0.0607, 0.0187, 0.0437]);
    let (loss, d_loss) = sum([0.0, 0.00062, 0.0, 0.00058]);
    let without = |i: usize| -> f64 { (0..6).filter(|j| *j != i).map(|j| x[j]).product() };
    let by = 2.07 / 0.001;
    let rows = vec![
        (
            1.0 - x.iter().product::<f64>() / by,
            (0..6).map(|i| -without(i) / by).collect(),
        ),
        (loss - 1.0, d_loss),
    ];
    (f, df, rows)
}

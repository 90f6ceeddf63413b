//! Shape functions, their derivatives, and quadrature, as tables per element.

/// Tables of one element kind: `NN` nodes, `NQ` quadrature points, `NP` pressure modes.
pub struct ShapeTable<const NN: usize, const NQ: usize, const NP: usize> {
    /// Shape functions at the quadrature points.
    pub n: [[f64; NN]; NQ],
    /// Their derivatives with respect to the local coordinates.
    pub dn: [[[f64; 2]; NN]; NQ],
    /// Pressure modes at the quadrature points.
    pub phi: [[f64; NP]; NQ],
    /// Quadrature weights.
    pub weight: [f64; NQ],
}

/// Shape functions and derivatives of the bilinear quadrilateral at (xi, eta) in [-1, 1]^2.
pub fn quad4(xi: f64, eta: f64) -> ([f64; 4], [[f64; 2]; 4]) {
    const C: [[f64; 2]; 4] = [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]];
    let n = C.map(|[a, b]| 0.25 * (1. + a * xi) * (1. + b * eta));
    let dn = C.map(|[a, b]| [0.25 * a * (1. + b * eta), 0.25 * b * (1. + a * xi)]);
    (n, dn)
}

/// Shape functions and derivatives of the biquadratic quadrilateral: corners, mid-sides, centre.
pub fn quad9(xi: f64, eta: f64) -> ([f64; 9], [[f64; 2]; 9]) {
    const AT: [[usize; 2]; 9] = [
        [0, 0],
        [2, 0],
        [2, 2],
        [0, 2],
        [1, 0],
        [2, 1],
        [1, 2],
        [0, 1],
        [1, 1],
    ];
    let line = |t: f64| {
        (
            [0.5 * t * (t - 1.), 1. - t * t, 0.5 * t * (t + 1.)],
            [t - 0.5, -2. * t, t + 0.5],
        )
    };
    let ((a, da), (b, db)) = (line(xi), line(eta));
    (
        AT.map(|[i, j]| a[i] * b[j]),
        AT.map(|[i, j]| [da[i] * b[j], a[i] * db[j]]),
    )
}

/// Shape functions and derivatives of the quadratic triangle with bubble at (xi, eta), 0 <= xi, eta, xi + eta <= 1:
/// corners, mid-sides, centroid.
pub fn tri7(xi: f64, eta: f64) -> ([f64; 7], [[f64; 2]; 7]) {
    const DL: [[f64; 2]; 3] = [[-1., -1.], [1., 0.], [0., 1.]];
    let l = [1. - xi - eta, xi, eta];
    let bubble = l[0] * l[1] * l[2];
    let d_bubble: [f64; 2] = std::array::from_fn(|k| {
        DL[0][k] * l[1] * l[2] + l[0] * DL[1][k] * l[2] + l[0] * l[1] * DL[2][k]
    });
    let (mut n, mut dn) = ([0.; 7], [[0.; 2]; 7]);
    for i in 0..3 {
        let j = (i + 1) % 3;
        n[i] = l[i] * (2. * l[i] - 1.) + 3. * bubble;
        n[3 + i] = 4. * l[i] * l[j] - 12. * bubble;
        for k in 0..2 {
            dn[i][k] = (4. * l[i] - 1.) * DL[i][k] + 3. * d_bubble[k];
            dn[3 + i][k] = 4. * (DL[i][k] * l[j] + l[i] * DL[j][k]) - 12. * d_bubble[k];
        }
    }
    n[6] = 27. * bubble;
    dn[6] = d_bubble.map(|d| 27. * d);
    (n, dn)
}

/// Gauss rule with 2 or 3 points on [-1, 1].
const GAUSS_2: [(f64, f64); 2] = [
    (-0.577_350_269_189_625_8, 1.0),
    (0.577_350_269_189_625_8, 1.0),
];
const GAUSS_3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

impl ShapeTable<4, 4, 1> {
    /// Q1P0 on the 2 x 2 Gauss points.
    pub fn quad4() -> Self {
        Self::on(|q| {
            let ((x, u), (y, v)) = (GAUSS_2[q % 2], GAUSS_2[q / 2]);
            let (n, dn) = quad4(x, y);
            (n, dn, [1.0], u * v)
        })
    }
}

impl ShapeTable<9, 9, 3> {
    /// Q2P1 on the 3 x 3 Gauss points; pressure modes 1, xi, eta.
    pub fn quad9() -> Self {
        Self::on(|q| {
            let ((x, u), (y, v)) = (GAUSS_3[q % 3], GAUSS_3[q / 3]);
            let (n, dn) = quad9(x, y);
            (n, dn, [1.0, x, y], u * v)
        })
    }
}

impl ShapeTable<7, 12, 3> {
    /// Crouzeix-Raviart on the 12-point rule of degree 6 (Dunavant 1985); pressure modes 1, xi - 1/3, eta - 1/3.
    pub fn tri7() -> Self {
        const A: [(f64, f64); 2] = [
            (0.249_286_745_170_910, 0.116_786_275_726_379),
            (0.063_089_014_491_502, 0.050_844_906_370_207),
        ];
        const B: (f64, f64, f64) = (
            0.310_352_451_033_785,
            0.053_145_049_844_816,
            0.082_851_075_618_374,
        );
        let mut points = Vec::with_capacity(12);
        for (a, w) in A {
            for (x, y) in [(a, a), (1. - 2. * a, a), (a, 1. - 2. * a)] {
                points.push((x, y, w));
            }
        }
        let (a, b, w) = B;
        let c = 1. - a - b;
        for (x, y) in [(a, b), (b, a), (a, c), (c, a), (b, c), (c, b)] {
            points.push((x, y, w));
        }
        Self::on(|q| {
            let (x, y, w) = points[q];
            let (n, dn) = tri7(x, y);
            (n, dn, [1.0, x - 1. / 3., y - 1. / 3.], 0.5 * w)
        })
    }
}

impl<const NN: usize, const NQ: usize, const NP: usize> ShapeTable<NN, NQ, NP> {
    fn on(point: impl Fn(usize) -> ([f64; NN], [[f64; 2]; NN], [f64; NP], f64)) -> Self {
        let mut table = Self {
            n: [[0.; NN]; NQ],
            dn: [[[0.; 2]; NN]; NQ],
            phi: [[0.; NP]; NQ],
            weight: [0.; NQ],
        };
        for q in 0..NQ {
            (table.n[q], table.dn[q], table.phi[q], table.weight[q]) = point(q);
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const NN: usize, const NQ: usize, const NP: usize>(
        table: &ShapeTable<NN, NQ, NP>,
        area: f64,
    ) {
        assert!((table.weight.iter().sum::<f64>() - area).abs() < 1e-12);
        for q in 0..NQ {
            assert!((table.n[q].iter().sum::<f64>() - 1.).abs() < 1e-13);
            for k in 0..2 {
                assert!(table.dn[q].iter().map(|d| d[k]).sum::<f64>().abs() < 1e-13);
            }
        }
    }

    #[test]
    fn partitions_of_unity_and_areas() {
        check(&ShapeTable::quad4(), 4.0);
        check(&ShapeTable::quad9(), 4.0);
        check(&ShapeTable::tri7(), 0.5);
    }

    #[test]
    fn triangle_rule_is_exact_to_degree_six() {
        let points: Vec<_> = {
            let t = ShapeTable::tri7();
            (0..12)
                .map(|q| (t.phi[q][1] + 1. / 3., t.phi[q][2] + 1. / 3., t.weight[q]))
                .collect()
        };
        let factorial = |n: u32| (1..=n).product::<u32>() as f64;
        for i in 0..=6u32 {
            for j in 0..=(6 - i) {
                let sum: f64 = points
                    .iter()
                    .map(|(x, y, w)| w * x.powi(i as i32) * y.powi(j as i32))
                    .sum();
                let exact = factorial(i) * factorial(j) / factorial(i + j + 2);
                assert!((sum - exact).abs() < 1e-13, "{i} {j}: {sum} {exact}");
            }
        }
    }

    #[test]
    fn triangle_basis_is_nodal() {
        let nodes = [
            [0., 0.],
            [1., 0.],
            [0., 1.],
            [0.5, 0.],
            [0.5, 0.5],
            [0., 0.5],
            [1. / 3., 1. / 3.],
        ];
        for (i, [x, y]) in nodes.into_iter().enumerate() {
            for (j, v) in tri7(x, y).0.into_iter().enumerate() {
                assert!((v - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }
}

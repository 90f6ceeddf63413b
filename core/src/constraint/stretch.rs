//! The largest principal stretch, averaged over the solid part of a disc of the reference shape.
//!
//! Re-entrant corners are singular: a pointwise maximum does not converge with the mesh. So the stretch at a quadrature
//! point i is the average over the points j around it,
//!
//! m_i = sum_j w_j k(|X_i - X_j|) s_j / sum_j w_j k(|X_i - X_j|),   k(d) = (1 - (d/r)^2)^2 for d < r (C^1),
//!
//! and each region of the solid (the surroundings of one chamber corner) has the smooth maximum
//! (Kreisselmeier-Steinhauser)
//!
//! KS = ln( sum_i w_i exp(rho m_i) / (pi (r/4)^2) ) / rho,
//!
//! so that an optimiser sees every corner that is near its limit, not only the hottest. It exceeds the true maximum where an
//! area larger than that spot is as hot, and falls below it where a smaller one is.
//!
//! In plane strain the in-plane stretches l1 >= l2 satisfy l1 + l2 = sqrt(s + 2 J), l1 - l2 = sqrt(s - 2 J), s = F:F.

use crate::assembly::{PointSensitivity, System};

/// Sharpness of the smooth maximum: an area e times the disc's raises it by 1 / RHO.
pub const RHO: f64 = 100.0;
/// Radius of the spot, as a part of the disc's, that the smooth maximum takes to be as hot as the largest value: what is seen
/// at re-entrant corners, where the average falls by 1 / RHO over such a distance.
const HOT_SPOT: f64 = 0.25;
/// Smooths the larger stretch where both are equal.
const EPSILON: f64 = 1e-6;

/// The averaging discs of one reference shape.
pub struct StretchMeasure {
    radius: f64,
    area: Vec<f64>,
    at: Vec<[f64; 2]>,
    /// Number of regions, and the region of each point.
    regions: usize,
    region: Vec<u16>,
    /// Index of each point's material law.
    law: Vec<u16>,
    /// Neighbours of point i, itself included, at `start[i]..start[i + 1]`.
    start: Vec<u32>,
    neighbour: Vec<u32>,
    /// k and -dk/d(d^2) of each.
    kernel: Vec<[f64; 2]>,
    /// sum_j w_j k_ij.
    weight: Vec<f64>,
    /// w_j k_ij over that sum.
    share: Vec<f64>,
}

/// The measure at a state.
#[derive(Clone, Debug)]
pub struct StretchState {
    /// Averaged stretch per point.
    pub averaged: Vec<f64>,
    pointwise: Vec<f64>,
    deformation_gradient: Vec<[[f64; 2]; 2]>,
}

impl StretchState {
    /// Largest averaged stretch.
    pub fn largest(&self) -> f64 {
        self.averaged.iter().copied().fold(1.0, f64::max)
    }

    /// Largest stretch at a quadrature point; depends on the mesh.
    pub fn largest_pointwise(&self) -> f64 {
        self.pointwise.iter().copied().fold(1.0, f64::max)
    }
}

impl StretchMeasure {
    /// Finds the points of each disc of radius `radius` (mm).
    pub fn new(system: &System, radius: f64) -> Self {
        let (mut area, mut at, mut region) = (Vec::new(), Vec::new(), Vec::new());
        let mut law = Vec::new();
        let laws: Vec<u16> = (system.body.mesh.blocks.iter())
            .flat_map(|b| b.material.iter().copied())
            .collect();
        let rest = vec![[0.0; 2]; system.body.mesh.nodes.len()];
        let regions = &system.body.regions;
        system.sample(&rest, |p| {
            area.push(p.area);
            at.push(p.at);
            region.push(regions.of_element.get(p.element).copied().unwrap_or(0));
            law.push(laws[p.element]);
        });
        let cell = |x: [f64; 2]| {
            (
                (x[0] / radius).floor() as i64,
                (x[1] / radius).floor() as i64,
            )
        };
        let mut sorted: Vec<((i64, i64), u32)> = at
            .iter()
            .enumerate()
            .map(|(i, &x)| (cell(x), i as u32))
            .collect();
        sorted.sort_unstable();
        let mut this = Self {
            radius,
            start: vec![0],
            neighbour: Vec::new(),
            kernel: Vec::new(),
            share: Vec::new(),
            weight: Vec::with_capacity(at.len()),
            area,
            at,
            regions: regions.count.max(1),
            region,
            law,
        };
        let square = radius * radius;
        for &x in &this.at {
            let (cx, cy) = cell(x);
            let mut sum = 0.0;
            for a in cx - 1..=cx + 1 {
                let first = sorted.partition_point(|(c, _)| *c < (a, cy - 1));
                for &(c, j) in &sorted[first..] {
                    if c > (a, cy + 1) {
                        break;
                    }
                    let y = this.at[j as usize];
                    let t = 1.0 - ((x[0] - y[0]).powi(2) + (x[1] - y[1]).powi(2)) / square;
                    if t > 0.0 {
                        this.neighbour.push(j);
                        this.kernel.push([t * t, 2.0 * t / square]);
                        let own = this.area[j as usize] * t * t;
                        this.share.push(own);
                        sum += own;
                    }
                }
            }
            this.weight.push(sum);
            let first = this.start[this.start.len() - 1] as usize;
            this.share[first..].iter_mut().for_each(|s| *s /= sum);
            this.start.push(this.neighbour.len() as u32);
        }
        this
    }

    fn discs(&self, i: usize) -> std::ops::Range<usize> {
        self.start[i] as usize..self.start[i + 1] as usize
    }

    /// Averaged stretches at displacements `u`.
    pub fn at_state(&self, system: &System, u: &[[f64; 2]]) -> StretchState {
        let n = self.at.len();
        let (mut pointwise, mut deformation_gradient) =
            (Vec::with_capacity(n), Vec::with_capacity(n));
        system.sample(u, |p| {
            pointwise.push(principal_stretch(&p.f).0);
            deformation_gradient.push(p.f);
        });
        let averaged = (0..n)
            .map(|i| {
                let disc = self.discs(i);
                let weighted = self.neighbour[disc.clone()].iter().zip(&self.share[disc]);
                weighted.map(|(j, s)| s * pointwise[*j as usize]).sum()
            })
            .collect();
        StretchState {
            averaged,
            pointwise,
            deformation_gradient,
        }
    }

    /// Largest averaged stretch in the solid of each material law.
    pub fn largest_by_law(&self, state: &StretchState) -> Vec<f64> {
        let laws = self.law.iter().max().map_or(0, |l| *l as usize + 1);
        let mut largest = vec![1.0_f64; laws];
        for (m, law) in state.averaged.iter().zip(&self.law) {
            largest[*law as usize] = largest[*law as usize].max(*m);
        }
        largest
    }

    /// Number of regions.
    pub fn regions(&self) -> usize {
        self.regions
    }

    /// KS of a state per region.
    pub fn smooth_maxima(&self, state: &StretchState) -> Vec<f64> {
        let mut largest = vec![1.0_f64; self.regions];
        for (m, r) in state.averaged.iter().zip(&self.region) {
            largest[*r as usize] = largest[*r as usize].max(*m);
        }
        let mut sum = vec![0.0; self.regions];
        for ((m, r), w) in state.averaged.iter().zip(&self.region).zip(&self.area) {
            let below = RHO * (m - largest[*r as usize]);
            // What double precision does not see is not worth an exponential.
            if below > -45.0 {
                sum[*r as usize] += w * below.exp();
            }
        }
        let spot = std::f64::consts::PI * (HOT_SPOT * self.radius).powi(2);
        largest
            .iter()
            .zip(&sum)
            .map(|(l, s)| l + (s / spot).ln() / RHO)
            .collect()
    }

    /// Derivatives of a region's KS, whose value is `smooth`, with respect to what each quadrature point holds.
    pub fn sensitivities(
        &self,
        state: &StretchState,
        region: usize,
        smooth: f64,
    ) -> Vec<PointSensitivity> {
        let n = self.at.len();
        let spot = std::f64::consts::PI * (HOT_SPOT * self.radius).powi(2);
        let mut out = vec![PointSensitivity::default(); n];
        let mut d_stretch = vec![0.0; n];
        for i in 0..n {
            if self.region[i] as usize != region {
                continue;
            }
            let share = self.area[i] / spot * (RHO * (state.averaged[i] - smooth)).exp();
            // Points that cannot be seen in double precision are left out.
            if share < 1e-18 {
                continue;
            }
            out[i].area += share / (RHO * self.area[i]);
            for k in self.discs(i) {
                let j = self.neighbour[k] as usize;
                let [value, slope] = self.kernel[k];
                let common = share / self.weight[i];
                let excess = state.pointwise[j] - state.averaged[i];
                d_stretch[j] += common * self.area[j] * value;
                out[j].area += common * excess * value;
                // dk/dX_i = -2 slope (X_i - X_j).
                let pull = -2.0 * slope * common * excess * self.area[j];
                for c in 0..2 {
                    let d = pull * (self.at[i][c] - self.at[j][c]);
                    out[i].at[c] += d;
                    out[j].at[c] -= d;
                }
            }
        }
        let points = d_stretch.iter().zip(&state.deformation_gradient);
        for (o, (d, f)) in out.iter_mut().zip(points) {
            if *d != 0.0 {
                o.f = principal_stretch(f).1.map(|row| row.map(|v| v * d));
            }
        }
        out
    }
}

/// The larger in-plane principal stretch and its derivative with respect to F.
fn principal_stretch(f: &[[f64; 2]; 2]) -> (f64, [[f64; 2]; 2]) {
    // s - 2 J and s + 2 J as sums of squares: no cancellation.
    let difference =
        ((f[0][0] - f[1][1]).powi(2) + (f[0][1] + f[1][0]).powi(2) + EPSILON * EPSILON).sqrt();
    let sum = ((f[0][0] + f[1][1]).powi(2) + (f[0][1] - f[1][0]).powi(2)).sqrt();
    let cof = [[f[1][1], -f[1][0]], [-f[0][1], f[0][0]]];
    let d = std::array::from_fn(|i| {
        std::array::from_fn(|k| {
            0.5 * ((f[i][k] + cof[i][k]) / sum + (f[i][k] - cof[i][k]) / difference)
        })
    });
    (0.5 * (sum + difference - EPSILON), d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_stretch_of_known_deformations() {
        assert!((principal_stretch(&[[1., 0.], [0., 1.]]).0 - 1.0).abs() < 1e-15);
        assert!((principal_stretch(&[[0., -3.], [0.25, 0.]]).0 - 3.0).abs() < 1e-6);
        // Simple shear g: l1 - 1/l1 = g.
        let l = principal_stretch(&[[1., 0.7], [0., 1.]]).0;
        assert!((l - 1.0 / l - 0.7).abs() < 1e-6);
    }

    #[test]
    fn its_derivative_matches_differences() {
        let f = [[1.2, 0.3], [-0.4, 0.9]];
        let (_, d) = principal_stretch(&f);
        for i in 0..2 {
            for k in 0..2 {
                let shifted = |h: f64| {
                    let mut g = f;
                    g[i][k] += h;
                    principal_stretch(&g).0
                };
                assert!(((shifted(1e-5) - shifted(-1e-5)) / 2e-5 - d[i][k]).abs() < 1e-9);
            }
        }
    }
}

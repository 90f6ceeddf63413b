//! Elements of one kind in packs of four: gather, kernel, scatter.

use super::{DofMap, Pattern};
use crate::element::kernel::{self, ElementOutput, Kinematics, PackGeometry};
use crate::element::shape::ShapeTable;
use crate::lane::{LANES, Pack, has_fma};
use crate::material::MaterialLaw;
use crate::material::hyperelastic::Parameters;
use crate::mesh::{ElementBlock, ElementKind};

/// The elements of one kind, ready for assembly.
pub struct Block<const NN: usize, const NQ: usize, const NP: usize> {
    table: ShapeTable<NN, NQ, NP>,
    /// Nodes of the four elements of a pack; short packs repeat their last element.
    nodes: Vec<[[u32; LANES]; NN]>,
    /// Elements in each pack.
    active: Vec<usize>,
    /// Slots of the lower blocks per element, in the order of the scatter loop.
    slots: Vec<u32>,
    material: Vec<Parameters>,
    geometry: Vec<Box<PackGeometry<NN, NQ, NP>>>,
    fma: bool,
}

/// Independent pressures of a block.
pub type Pressures = Vec<f64>;

/// A quadrature point: area (mm^2), reference position (mm), deformation gradient.
pub struct PointSample {
    /// Element, counted over all blocks.
    pub element: usize,
    /// Weight times Jacobian.
    pub area: f64,
    /// Place in the reference shape.
    pub at: [f64; 2],
    /// Deformation gradient.
    pub f: [[f64; 2]; 2],
}

/// Derivatives of a functional with respect to what [`PointSample`] holds.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointSensitivity {
    /// With respect to the area.
    pub area: f64,
    /// With respect to the place.
    pub at: [f64; 2],
    /// With respect to the deformation gradient.
    pub f: [[f64; 2]; 2],
}

impl PointSensitivity {
    fn is_zero(&self) -> bool {
        self.area == 0.0 && self.at == [0.0; 2] && self.f == [[0.0; 2]; 2]
    }
}

macro_rules! dispatch {
    ($fma:expr, $name:ident :: <$($generic:tt),*> ( $($arg:expr),* )) => {{
        #[cfg(target_arch = "x86_64")]
        {
            if $fma {
                // SAFETY: `fma` is set only where `has_fma` found both instruction sets.
                unsafe { fast::$name::<$($generic),*>($($arg),*) }
            } else {
                kernel::$name::<false, $($generic),*>($($arg),*)
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            if $fma { kernel::$name::<true, $($generic),*>($($arg),*) } else { kernel::$name::<false, $($generic),*>($($arg),*) }
        }
    }};
}

/// The kernels compiled for AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
mod fast {
    use super::{ElementOutput, Pack, PackGeometry, Parameters, ShapeTable, kernel};

    #[target_feature(enable = "avx2,fma")]
    pub fn assemble<const T: bool, const NN: usize, const NQ: usize, const NP: usize>(
        table: &ShapeTable<NN, NQ, NP>,
        geometry: &PackGeometry<NN, NQ, NP>,
        material: &Parameters,
        u: &[[Pack; 2]; NN],
        p_lin: Option<&[Pack; NP]>,
        out: &mut ElementOutput<NN, NP>,
    ) {
        kernel::assemble::<true, T, NN, NQ, NP>(table, geometry, material, u, p_lin, out);
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn linear_pressure<const NN: usize, const NQ: usize, const NP: usize>(
        table: &ShapeTable<NN, NQ, NP>,
        geometry: &PackGeometry<NN, NQ, NP>,
        bulk: Pack,
        u: &[[Pack; 2]; NN],
        at: &[[Pack; 2]; NN],
        du: &[[Pack; 2]; NN],
    ) -> [Pack; NP] {
        kernel::linear_pressure::<true, NN, NQ, NP>(table, geometry, bulk, u, at, du)
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn frozen_pressure<const NN: usize, const NQ: usize, const NP: usize>(
        table: &ShapeTable<NN, NQ, NP>,
        geometry: &PackGeometry<NN, NQ, NP>,
        bulk: Pack,
        u: &[[Pack; 2]; NN],
        at: &[[Pack; 2]; NN],
        p_lin: &[Pack; NP],
        out: &mut [[Pack; 2]; NN],
    ) {
        kernel::frozen_pressure::<true, NN, NQ, NP>(table, geometry, bulk, u, at, p_lin, out);
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn shape_derivative<const NN: usize, const NQ: usize, const NP: usize>(
        table: &ShapeTable<NN, NQ, NP>,
        geometry: &PackGeometry<NN, NQ, NP>,
        material: &Parameters,
        u: &[[Pack; 2]; NN],
        lambda: &[[Pack; 2]; NN],
        out: &mut [[Pack; 2]; NN],
    ) {
        kernel::shape_derivative::<true, NN, NQ, NP>(table, geometry, material, u, lambda, out);
    }
}

impl<const NN: usize, const NQ: usize, const NP: usize> Block<NN, NQ, NP> {
    fn new(
        table: ShapeTable<NN, NQ, NP>,
        source: &ElementBlock,
        laws: &[MaterialLaw],
        dofs: &DofMap,
        pattern: &Pattern,
    ) -> Self {
        let element = |e: usize| &source.nodes[e * NN..(e + 1) * NN];
        let count = source.len();
        let (mut nodes, mut active, mut material) = (Vec::new(), Vec::new(), Vec::new());
        let mut slots = Vec::with_capacity(count * NN * (2 * NN + 1));
        for first in (0..count).step_by(LANES) {
            let inside = LANES.min(count - first);
            let lane = |l: usize| first + l.min(inside - 1);
            nodes.push(std::array::from_fn(|a| {
                std::array::from_fn(|l| element(lane(l))[a])
            }));
            active.push(inside);
            let mut parameters = Parameters::default();
            for l in 0..LANES {
                parameters.set_lane(l, &laws[source.material[lane(l)] as usize]);
            }
            material.push(parameters);
            for e in first..first + inside {
                let own = element(e);
                for l in 0..NN {
                    for a in l..NN {
                        for i in 0..2 {
                            for j in 0..2 {
                                // Within a node's own block the upper entry repeats the lower one.
                                slots.push(if a == l && j > i {
                                    Pattern::NONE
                                } else {
                                    pattern.slot(dofs.unknown(own[a], i), dofs.unknown(own[l], j))
                                });
                            }
                        }
                    }
                }
            }
        }
        Self {
            table,
            nodes,
            active,
            slots,
            material,
            geometry: Vec::new(),
            fma: has_fma(),
        }
    }

    fn gather(nodes: &[[u32; LANES]; NN], field: &[[f64; 2]]) -> [[Pack; 2]; NN] {
        std::array::from_fn(|a| {
            std::array::from_fn(|i| Pack(std::array::from_fn(|l| field[nodes[a][l] as usize][i])))
        })
    }

    fn scatter(
        nodes: &[[u32; LANES]; NN],
        active: usize,
        local: &[[Pack; 2]; NN],
        field: &mut [[f64; 2]],
    ) {
        for l in 0..active {
            for a in 0..NN {
                for i in 0..2 {
                    field[nodes[a][l] as usize][i] += local[a][i].0[l];
                }
            }
        }
    }

    fn set_reference(&mut self, x: &[[f64; 2]]) -> Option<usize> {
        self.geometry.clear();
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let (geometry, least) = PackGeometry::new(&self.table, &Self::gather(nodes, x));
            if least <= 0.0 || least.is_nan() {
                return Some(pack * LANES);
            }
            self.geometry.push(geometry);
        }
        None
    }

    fn read_pressure(p: &[f64], pack: usize) -> [Pack; NP] {
        std::array::from_fn(|a| Pack(std::array::from_fn(|l| p[(pack * NP + a) * LANES + l])))
    }

    fn write_pressure(p: &mut [f64], pack: usize, value: &[Pack; NP]) {
        for a in 0..NP {
            p[(pack * NP + a) * LANES..][..LANES].copy_from_slice(&value[a].0);
        }
    }

    fn assemble(
        &self,
        u: &[[f64; 2]],
        p_lin: &mut Pressures,
        refresh: bool,
        residual: &mut [[f64; 2]],
        mut tangent: Option<&mut [f64]>,
    ) -> f64 {
        let mut out = ElementOutput::<NN, NP>::new();
        let mut least = f64::INFINITY;
        let per_element = NN * (NN + 1) / 2 * 4;
        let mut first_slot = 0;
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let geometry = &*self.geometry[pack];
            let local = Self::gather(nodes, u);
            let linear = Self::read_pressure(p_lin, pack);
            let linear = (!refresh).then_some(&linear);
            let material = &self.material[pack];
            if tangent.is_some() {
                dispatch!(
                    self.fma,
                    assemble::<true, NN, NQ, NP>(
                        &self.table,
                        geometry,
                        material,
                        &local,
                        linear,
                        &mut out
                    )
                );
            } else {
                dispatch!(
                    self.fma,
                    assemble::<false, NN, NQ, NP>(
                        &self.table,
                        geometry,
                        material,
                        &local,
                        linear,
                        &mut out
                    )
                );
            }
            least = least.min(out.least_j.min_lane());
            if least <= 0.0 || least.is_nan() {
                return if least.is_nan() {
                    f64::NEG_INFINITY
                } else {
                    least
                };
            }
            if refresh {
                Self::write_pressure(p_lin, pack, &out.p);
            }
            let active = self.active[pack];
            Self::scatter(nodes, active, &out.r, residual);
            if let Some(values) = tangent.as_deref_mut() {
                for lane in 0..active {
                    let slots = &self.slots[first_slot..first_slot + per_element];
                    first_slot += per_element;
                    let mut k = 0;
                    for l in 0..NN {
                        for a in l..NN {
                            for i in 0..2 {
                                for j in 0..2 {
                                    let slot = slots[k];
                                    k += 1;
                                    if slot != Pattern::NONE {
                                        values[slot as usize] += out.k[a][l][i][j].0[lane];
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
        least
    }

    fn update_pressure(
        &self,
        u: &[[f64; 2]],
        at: &[[f64; 2]],
        du: &[[f64; 2]],
        p_lin: &mut Pressures,
    ) {
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let (local, step) = (Self::gather(nodes, u), Self::gather(nodes, du));
            let frozen = Self::gather(nodes, at);
            let p = dispatch!(
                self.fma,
                linear_pressure::<NN, NQ, NP>(
                    &self.table,
                    &*self.geometry[pack],
                    self.material[pack].bulk,
                    &local,
                    &frozen,
                    &step
                )
            );
            Self::write_pressure(p_lin, pack, &p);
        }
    }

    fn add_frozen_pressure(
        &self,
        u: &[[f64; 2]],
        at: &[[f64; 2]],
        p_lin: &Pressures,
        out: &mut [[f64; 2]],
    ) {
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let (local, frozen) = (Self::gather(nodes, u), Self::gather(nodes, at));
            let mut r = [[Pack::ZERO; 2]; NN];
            dispatch!(
                self.fma,
                frozen_pressure::<NN, NQ, NP>(
                    &self.table,
                    &*self.geometry[pack],
                    self.material[pack].bulk,
                    &local,
                    &frozen,
                    &Self::read_pressure(p_lin, pack),
                    &mut r
                )
            );
            Self::scatter(nodes, self.active[pack], &r, out);
        }
    }

    fn add_shape_derivative(&self, u: &[[f64; 2]], lambda: &[[f64; 2]], out: &mut [[f64; 2]]) {
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let (local, adjoint) = (Self::gather(nodes, u), Self::gather(nodes, lambda));
            let mut d = [[Pack::ZERO; 2]; NN];
            dispatch!(
                self.fma,
                shape_derivative::<NN, NQ, NP>(
                    &self.table,
                    &*self.geometry[pack],
                    &self.material[pack],
                    &local,
                    &adjoint,
                    &mut d
                )
            );
            Self::scatter(nodes, self.active[pack], &d, out);
        }
    }

    /// Adds (area, area * |grad du|^8) of the block, |.| the Frobenius norm at the first quadrature point's average.
    fn gradient_moment(&self, du: &[[f64; 2]]) -> (f64, f64) {
        let (mut area, mut moment) = (0.0, 0.0);
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let local = Self::gather(nodes, du);
            let geometry = &*self.geometry[pack];
            for q in 0..NQ {
                let h = kernel::gradient::<false, NN>(&local, &geometry.g[q]);
                let square = kernel::contract(&h, &h);
                for l in 0..self.active[pack] {
                    let w = geometry.w[q].0[l];
                    area += w;
                    moment += w * square.0[l].powi(4);
                }
            }
        }
        (area, moment)
    }

    fn sample(
        &self,
        x: &[[f64; 2]],
        u: &[[f64; 2]],
        first_element: usize,
        visit: &mut dyn FnMut(PointSample),
    ) {
        let mut element = first_element;
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let (local, place) = (Self::gather(nodes, u), Self::gather(nodes, x));
            let geometry = &*self.geometry[pack];
            let k: [Kinematics; NQ] = std::array::from_fn(|q| {
                kernel::kinematics(kernel::gradient::<false, NN>(&local, &geometry.g[q])).0
            });
            for l in 0..self.active[pack] {
                for q in 0..NQ {
                    let mut at = [0.0; 2];
                    for a in 0..NN {
                        for i in 0..2 {
                            at[i] += self.table.n[q][a] * place[a][i].0[l];
                        }
                    }
                    visit(PointSample {
                        element,
                        area: geometry.w[q].0[l],
                        at,
                        f: k[q].f.map(|row| row.map(|v| v.0[l])),
                    });
                }
                element += 1;
            }
        }
    }

    /// The transpose of [`Self::sample`]: sensitivities per point become nodal ones with respect to u and X.
    fn sample_transpose(
        &self,
        u: &[[f64; 2]],
        next: &mut dyn FnMut() -> PointSensitivity,
        d_u: &mut [[f64; 2]],
        d_x: &mut [[f64; 2]],
    ) {
        for (pack, nodes) in self.nodes.iter().enumerate() {
            let local = Self::gather(nodes, u);
            let geometry = &*self.geometry[pack];
            for l in 0..self.active[pack] {
                for q in 0..NQ {
                    let s = next();
                    if s.is_zero() {
                        continue;
                    }
                    let h = kernel::gradient::<false, NN>(&local, &geometry.g[q])
                        .map(|row| row.map(|v| v.0[l]));
                    let area = geometry.w[q].0[l] * s.area;
                    for a in 0..NN {
                        let node = nodes[a][l] as usize;
                        let g = [geometry.g[q][a][0].0[l], geometry.g[q][a][1].0[l]];
                        for m in 0..2 {
                            d_u[node][m] += s.f[m][0] * g[0] + s.f[m][1] * g[1];
                            let carried: f64 = (0..2)
                                .map(|n| (h[0][m] * s.f[0][n] + h[1][m] * s.f[1][n]) * g[n])
                                .sum();
                            d_x[node][m] += area * g[m] - carried + self.table.n[q][a] * s.at[m];
                        }
                    }
                }
            }
        }
    }
}

/// A block of any kind.
pub enum BlockKernel {
    /// Q1P0.
    Quad4(Block<4, 4, 1>),
    /// Q2P1.
    Quad9(Block<9, 9, 3>),
    /// P2 + bubble / P1.
    Tri7(Block<7, 12, 3>),
}

macro_rules! each {
    ($this:expr, $block:ident => $body:expr) => {
        match $this {
            BlockKernel::Quad4($block) => $body,
            BlockKernel::Quad9($block) => $body,
            BlockKernel::Tri7($block) => $body,
        }
    };
}

impl BlockKernel {
    /// Prepares a block.
    pub fn new(
        source: &ElementBlock,
        laws: &[MaterialLaw],
        dofs: &DofMap,
        pattern: &Pattern,
    ) -> Self {
        match source.kind {
            ElementKind::Quad4 => {
                Self::Quad4(Block::new(ShapeTable::quad4(), source, laws, dofs, pattern))
            }
            ElementKind::Quad9 => {
                Self::Quad9(Block::new(ShapeTable::quad9(), source, laws, dofs, pattern))
            }
            ElementKind::Tri7 => {
                Self::Tri7(Block::new(ShapeTable::tri7(), source, laws, dofs, pattern))
            }
        }
    }

    /// Computes the reference geometry; the first element of a pack with a Jacobian that is not positive, if any.
    pub fn set_reference(&mut self, x: &[[f64; 2]]) -> Option<usize> {
        each!(self, b => b.set_reference(x))
    }

    /// Length of the vector of independent pressures.
    pub fn pressures(&self) -> usize {
        match self {
            Self::Quad4(b) => b.nodes.len() * LANES,
            Self::Quad9(b) => 3 * b.nodes.len() * LANES,
            Self::Tri7(b) => 3 * b.nodes.len() * LANES,
        }
    }

    /// Adds residual and tangent at `u`; with `refresh` the independent pressures become p(u) first. Returns the
    /// smallest J; where it is not positive the sums are incomplete.
    pub fn assemble(
        &self,
        u: &[[f64; 2]],
        p_lin: &mut Pressures,
        refresh: bool,
        residual: &mut [[f64; 2]],
        tangent: Option<&mut [f64]>,
    ) -> f64 {
        each!(self, b => b.assemble(u, p_lin, refresh, residual, tangent))
    }

    /// The independent pressures after a step `du` from `u`, to first order, with B at the displacements `at`.
    pub fn update_pressure(
        &self,
        u: &[[f64; 2]],
        at: &[[f64; 2]],
        du: &[[f64; 2]],
        p_lin: &mut Pressures,
    ) {
        each!(self, b => b.update_pressure(u, at, du, p_lin));
    }

    /// Adds (B_at - B(u))' (p(u) - p_lin): what a step with the tangent of `at` needs beside the residual.
    pub fn add_frozen_pressure(
        &self,
        u: &[[f64; 2]],
        at: &[[f64; 2]],
        p_lin: &Pressures,
        out: &mut [[f64; 2]],
    ) {
        each!(self, b => b.add_frozen_pressure(u, at, p_lin, out));
    }

    /// Adds d(lambda . r)/dX.
    pub fn add_shape_derivative(&self, u: &[[f64; 2]], lambda: &[[f64; 2]], out: &mut [[f64; 2]]) {
        each!(self, b => b.add_shape_derivative(u, lambda, out));
    }

    /// (area, integral of |grad du|^8).
    pub fn gradient_moment(&self, du: &[[f64; 2]]) -> (f64, f64) {
        each!(self, b => b.gradient_moment(du))
    }

    /// Visits every quadrature point in a fixed order.
    pub fn sample(
        &self,
        x: &[[f64; 2]],
        u: &[[f64; 2]],
        first_element: usize,
        visit: &mut dyn FnMut(PointSample),
    ) {
        each!(self, b => b.sample(x, u, first_element, visit));
    }

    /// The transpose of [`Self::sample`], asking for sensitivities in the same order.
    pub fn sample_transpose(
        &self,
        u: &[[f64; 2]],
        next: &mut dyn FnMut() -> PointSensitivity,
        d_u: &mut [[f64; 2]],
        d_x: &mut [[f64; 2]],
    ) {
        each!(self, b => b.sample_transpose(u, next, d_u, d_x));
    }
}

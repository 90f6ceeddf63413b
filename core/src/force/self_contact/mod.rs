//! Frictionless contact of the body's surfaces with each other and with rigid obstacles, from its potential.
//!
//! The surfaces are sampled at points with reference lengths; any two points that bound the same region outside of the solid
//! (the same void, or the outside) repel each other as `kernel` says. The energy is a function of the present places x = X + u,
//! of the reference lengths and of the reference distances alone, smooth in all of them; so forces are equal and opposite to
//! round-off, the tangent is symmetric, and the adjoint stays exact to the discretisation. There is no master and no slave, no
//! normal and no nearest point.
//!
//! No penetration: `collision` bounds every step, so that surfaces never pass through each other. A gap below the
//! activation distance remains between surfaces that press on each other.

mod collision;
mod kernel;
mod surface;
#[cfg(test)]
mod tests;

use crate::linear::Coupling;
use crate::mesh::{BoundaryLoop, Obstacle, Partners};
use surface::{Bounds, Piece, Surface};

/// What two surfaces do that come near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// Surfaces farther apart than this do not act, mm.
    pub activation_mm: f64,
    /// Pressure of flat surfaces at half that distance, MPa.
    pub pressure_mpa: f64,
}

/// Pressure at half the activation distance over the least shear modulus of the body. The pressures that walls hold off are
/// of this order, and in proportion to the modulus the response depends on p / mu alone.
pub const PRESSURE_OVER_MODULUS: f64 = 0.5;
/// Points whose r_ij^2 is more than this share of r0^2 are away from corners: the least gap is theirs.
const FAR: f64 = 0.9;
/// Points nearer than this share of the activation distance press on each other as nothing does that is still solid.
const CRUSHED: f64 = 0.02;
/// Share of a gap, or of the activation distance, that a step leaves.
const LEAST_GAP_KEPT: f64 = 0.4;
/// Pieces that are this near may act soon, mm per activation distance: they keep a place in the tangent.
const SOON: f64 = 5.0;

/// The surfaces of a body that may meet.
pub struct SelfContact {
    /// The law.
    pub law: ContactLaw,
    surface: Surface,
    /// Which pieces may act on each other; `None`: all.
    partners: Option<Partners>,
    /// c, MPa.
    stiffness: f64,
    obstacles: usize,
    reference: Vec<[f64; 2]>,
}

/// Two pieces that act on each other, or may soon.
#[derive(Clone, Debug)]
pub struct Touch {
    /// The pieces.
    pieces: [u32; 2],
    /// dE / d(node), nodes of the first piece, then of the second, N/mm.
    force: [[f64; 2]; 6],
    /// d^2 E; `None` where nothing acts.
    hessian: Option<Box<[[f64; 12]; 12]>>,
    /// Least distance of two points that act, over their activation distance.
    least_ratio: Option<f64>,
}

/// The contact of a state.
#[derive(Clone, Debug, Default)]
pub struct Touches {
    list: Vec<Touch>,
    /// E, N.
    pub energy: f64,
    /// Number of pairs of points that act.
    pub pairs: usize,
    /// Force on each obstacle, N/mm.
    pub on_obstacle: Vec<[f64; 2]>,
    /// Least distance of two acting points, mm.
    pub least_distance_mm: Option<f64>,
    /// Least distance over the activation distance.
    least_ratio: Option<f64>,
    /// Reference places of these points, mm.
    pub least_at_mm: Option<[[f64; 2]; 2]>,
    /// Largest force on a point over its reference length, MPa.
    pub pressure_mpa: f64,
}

/// Points of a piece that are looked at together.
const BLOCK: usize = 16;

/// Where the points of a piece are.
#[derive(Default)]
struct Places {
    of: Option<u32>,
    list: Vec<[f64; 2]>,
    /// Boxes around all of them, and around each block of them.
    whole: Bounds,
    blocks: Vec<Bounds>,
}

impl Places {
    fn enclose(&mut self) {
        self.blocks.clear();
        self.blocks
            .extend(self.list.chunks(BLOCK).map(Bounds::around));
        self.whole = Bounds::empty();
        for block in &self.blocks {
            self.whole.include(block.low);
            self.whole.include(block.high);
        }
    }
}

/// Two points that act.
struct Pair {
    /// Their numbers in their pieces.
    points: [usize; 2],
    /// r = x_i - x_j.
    r: [f64; 2],
    /// (|r| / r_ij)^2.
    s: f64,
    /// r_ij^2, mm^2.
    square: f64,
    /// d r_ij^2 / dX_i, opposite by X_j.
    square_slope: [f64; 2],
    /// c l_i l_j w.
    scale: f64,
    /// d ln w / dX_i, opposite by X_j.
    weight_slope: [f64; 2],
}

impl SelfContact {
    /// Samples the surfaces in the reference shape `x`.
    pub fn new(
        law: ContactLaw,
        loops: &[BoundaryLoop],
        obstacles: &[Obstacle],
        partners: Option<&Partners>,
        x: &[[f64; 2]],
    ) -> Self {
        Self {
            surface: Surface::new(loops, obstacles, partners, x, law.activation_mm),
            partners: partners.cloned(),
            stiffness: law.pressure_mpa / kernel::flat_pressure(0.5),
            obstacles: obstacles.len(),
            law,
            reference: x.to_vec(),
        }
    }

    /// Whether any two points act, or surfaces have crossed, at present places `x`; the obstacles have moved by `travel`.
    pub fn is_touching(&self, x: &[[f64; 2]], travel: &[[f64; 2]]) -> bool {
        let mut touching = false;
        self.for_each_near(x, travel, 0.0, |this, a, b, places| {
            touching = touching || {
                let mut found = false;
                this.for_each_pair([a, b], places, |_| found = true);
                found
            };
        });
        touching
    }

    /// Energy and forces at present places `x`; with `hessian` the second derivatives as well, and the pieces that may act
    /// soon with zeros.
    pub fn touches(&self, x: &[[f64; 2]], travel: &[[f64; 2]], hessian: bool) -> Touches {
        let mut all = Touches {
            on_obstacle: vec![[0.0; 2]; self.obstacles],
            ..Touches::default()
        };
        let soon = if hessian {
            SOON * self.law.activation_mm
        } else {
            0.0
        };
        let mut by_point = Vec::new();
        self.for_each_near(x, travel, soon, |this, a, b, places| {
            let touch = this.touch([a, b], places, hessian, &mut all, &mut by_point);
            if hessian || touch.force != [[0.0; 2]; 6] {
                all.list.push(touch);
            }
        });
        all.pressure_mpa = by_point
            .iter()
            .map(|t: &[f64; 2]| t[0].hypot(t[1]))
            .fold(0.0, f64::max);
        all
    }

    fn touch(
        &self,
        pieces: [u32; 2],
        places: &[Places; 2],
        hessian: bool,
        all: &mut Touches,
        by_point: &mut Vec<[f64; 2]>,
    ) -> Touch {
        let mut touch = Touch {
            pieces,
            force: [[0.0; 2]; 6],
            hessian: None,
            least_ratio: None,
        };
        let two = self.pieces(pieces);
        self.for_each_pair(pieces, places, |pair| {
            let [value, first, second] = kernel::psi(pair.s);
            let c = pair.scale;
            let k1 = 2.0 * c * first / pair.square;
            let k2 = 4.0 * c * second / pair.square.powi(2);
            all.energy += c * value;
            all.pairs += 1;
            let distance = (pair.r[0] * pair.r[0] + pair.r[1] * pair.r[1]).sqrt();
            let far = pair.square > FAR * self.law.activation_mm.powi(2);
            if far && all.least_distance_mm.is_none_or(|d| distance < d) {
                all.least_distance_mm = Some(distance);
                let place = |k: usize| self.surface.reference[two[k].first + pair.points[k]];
                all.least_at_mm = Some([place(0), place(1)]);
            }
            let lower = |least: &mut Option<f64>, value: f64| {
                *least = Some(least.map_or(value, |l| l.min(value)));
            };
            lower(&mut all.least_ratio, pair.s.sqrt());
            lower(&mut touch.least_ratio, pair.s.sqrt());
            if by_point.is_empty() {
                by_point.resize(self.surface.reference.len(), [0.0; 2]);
            }
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                let index = two[side].first + pair.points[side];
                let scale = sign * k1 / self.surface.length[index];
                by_point[index][0] += scale * pair.r[0];
                by_point[index][1] += scale * pair.r[1];
            }
            let n = self.shapes(two, &pair);
            for (f, n) in touch.force.iter_mut().zip(&n) {
                for i in 0..2 {
                    f[i] += k1 * n * pair.r[i];
                }
            }
            for (side, piece) in two.iter().enumerate() {
                if let Some(obstacle) = piece.obstacle {
                    let sign = if side == 0 { -1.0 } else { 1.0 };
                    for i in 0..2 {
                        all.on_obstacle[obstacle as usize][i] += sign * k1 * pair.r[i];
                    }
                }
            }
            if !hessian {
                return;
            }
            let h = touch
                .hessian
                .get_or_insert_with(|| Box::new([[0.0; 12]; 12]));
            let r = pair.r;
            let block = [
                [k1 + k2 * r[0] * r[0], k2 * r[0] * r[1]],
                [k2 * r[0] * r[1], k1 + k2 * r[1] * r[1]],
            ];
            for a in 0..6 {
                for b in 0..=a {
                    let weight = n[a] * n[b];
                    if weight != 0.0 {
                        for i in 0..2 {
                            for j in 0..2 {
                                h[2 * a + i][2 * b + j] += weight * block[i][j];
                            }
                        }
                    }
                }
            }
        });
        touch
    }

    /// Adds d(lambda . dE/du)/dX at fixed u.
    pub fn add_shape_derivative(
        &self,
        x: &[[f64; 2]],
        travel: &[[f64; 2]],
        lambda: &[[f64; 2]],
        out: &mut [[f64; 2]],
    ) {
        self.for_each_near(x, travel, 0.0, |this, a, b, places| {
            let two = this.pieces([a, b]);
            let nodes = |k: usize| two[k / 3].nodes[k % 3] as usize;
            let mut local = [[0.0; 2]; 6];
            for (k, l) in local.iter_mut().enumerate() {
                if k % 3 < two[k / 3].count {
                    *l = lambda[nodes(k)];
                }
            }
            let mut d = [[0.0; 2]; 6];
            this.for_each_pair([a, b], places, |pair| {
                let [_, first, second] = kernel::psi(pair.s);
                let k1 = 2.0 * pair.scale * first / pair.square;
                let k2 = 4.0 * pair.scale * second / pair.square.powi(2);
                let n = this.shapes(two, &pair);
                let mut moved = [0.0; 2];
                for (l, n) in local.iter().zip(&n) {
                    moved[0] += n * l[0];
                    moved[1] += n * l[1];
                }
                let r = pair.r;
                let along = r[0] * moved[0] + r[1] * moved[1];
                let value = k1 * along;
                // By the present places.
                for (d, n) in d.iter_mut().zip(&n) {
                    for i in 0..2 {
                        d[i] += n * (k1 * moved[i] + k2 * along * r[i]);
                    }
                }
                // By the reference lengths.
                for (side, piece) in two.iter().enumerate().filter(|(_, p)| p.count > 0) {
                    let dn = &this.surface.tables[piece.table].dn[pair.points[side]];
                    let mut tangent = [0.0; 2];
                    for a in 0..piece.count {
                        let p = this.reference[piece.nodes[a] as usize];
                        tangent[0] += dn[a] * p[0];
                        tangent[1] += dn[a] * p[1];
                    }
                    let scale = value / (tangent[0].powi(2) + tangent[1].powi(2));
                    for a in 0..piece.count {
                        d[3 * side + a][0] += scale * dn[a] * tangent[0];
                        d[3 * side + a][1] += scale * dn[a] * tangent[1];
                    }
                }
                // By the reference distance, on which w and r_ij depend; n has the sign of x_i - x_j.
                let by_square =
                    -2.0 * pair.scale * along * (second * pair.s + first) / pair.square.powi(2);
                let slope: [f64; 2] = std::array::from_fn(|i| {
                    value * pair.weight_slope[i] + by_square * pair.square_slope[i]
                });
                for (d, n) in d.iter_mut().zip(&n) {
                    d[0] += n * slope[0];
                    d[1] += n * slope[1];
                }
            });
            for (k, d) in d.iter().enumerate() {
                if k % 3 < two[k / 3].count {
                    out[nodes(k)][0] += d[0];
                    out[nodes(k)][1] += d[1];
                }
            }
        });
    }

    fn pieces(&self, [a, b]: [u32; 2]) -> [&Piece; 2] {
        [a, b].map(|k| &self.surface.pieces[k as usize])
    }

    /// Weights of the six nodes in x_i - x_j.
    fn shapes(&self, two: [&Piece; 2], pair: &Pair) -> [f64; 6] {
        let mut n = [0.0; 6];
        for (side, piece) in two.iter().enumerate() {
            let sign = if side == 0 { 1.0 } else { -1.0 };
            if piece.count > 0 {
                let shape = &self.surface.tables[piece.table].n[pair.points[side]];
                for a in 0..piece.count {
                    n[3 * side + a] = sign * shape[a];
                }
            }
        }
        n
    }

    /// Visits the pairs of points of two pieces that act.
    fn for_each_pair(&self, pieces: [u32; 2], places: &[Places; 2], mut visit: impl FnMut(Pair)) {
        let [a, b] = self.pieces(pieces);
        let r0 = self.law.activation_mm;
        let square = r0 * r0;
        let rigid = a.obstacle.is_some() || b.obstacle.is_some();
        let [near, others] = places;
        for (k, p) in near.list.iter().enumerate() {
            if !others.whole.is_near_point(*p, r0) {
                continue;
            }
            let blocks = others.list.chunks(BLOCK).zip(&others.blocks).enumerate();
            let reached = blocks.filter(|(_, (_, block))| block.is_near_point(*p, r0));
            let points = reached.flat_map(|(n, (block, _))| (n * BLOCK..).zip(block));
            for (l, q) in points {
                let r = [p[0] - q[0], p[1] - q[1]];
                let r_square = r[0] * r[0] + r[1] * r[1];
                if r_square >= square {
                    continue;
                }
                let (i, j) = (a.first + k, b.first + l);
                let mut pair = Pair {
                    points: [k, l],
                    r,
                    s: 0.0,
                    square,
                    square_slope: [0.0; 2],
                    scale: self.stiffness * self.surface.length[i] * self.surface.length[j],
                    weight_slope: [0.0; 2],
                };
                if !rigid && !self.weigh([i, j], &mut pair) {
                    continue;
                }
                // Points that coincide repel without bound; a finite number lets the caller shorten its step.
                pair.s = (r_square / pair.square).max(1e-12);
                if pair.s < 1.0 {
                    visit(pair);
                }
            }
        }
    }

    /// Multiplies a pair by w and lowers its distance of action, with their derivatives; `false` where w is zero.
    fn weigh(&self, points: [usize; 2], pair: &mut Pair) -> bool {
        let square = self.law.activation_mm.powi(2);
        let [p, q] = points.map(|k| self.surface.reference[k]);
        let apart = [p[0] - q[0], p[1] - q[1]];
        let d2 = (apart[0].powi(2) + apart[1].powi(2)) / square;
        let (w, slope) = kernel::weight(d2);
        if w == 0.0 {
            return false;
        }
        pair.scale *= w;
        pair.weight_slope = apart.map(|a| 2.0 * a * slope / square / w);
        let (radius, slope) = kernel::radius(d2);
        pair.square = radius * square;
        pair.square_slope = apart.map(|a| 2.0 * a * slope);
        true
    }

    /// Visits the pieces that are within the activation distance and `more` of each other, with the places of their points.
    fn for_each_near(
        &self,
        x: &[[f64; 2]],
        travel: &[[f64; 2]],
        more: f64,
        mut visit: impl FnMut(&Self, u32, u32, &[Places; 2]),
    ) {
        let mut places = [Places::default(), Places::default()];
        for (a, b) in self.facing(x, travel, self.law.activation_mm + more) {
            for (places, index) in places.iter_mut().zip([a, b]) {
                if places.of != Some(index) {
                    let piece = &self.surface.pieces[index as usize];
                    self.surface.places(piece, x, travel, &mut places.list);
                    places.of = Some(index);
                    places.enclose();
                }
            }
            visit(self, a, b, &places);
        }
    }

    /// Pairs of pieces that are within a distance of each other, neighbours on a straight line left out.
    fn facing(
        &self,
        x: &[[f64; 2]],
        travel: &[[f64; 2]],
        within: f64,
    ) -> impl Iterator<Item = (u32, u32)> {
        let pieces = self.surface.pieces.iter();
        let bounds: Vec<Bounds> = pieces.map(|p| Surface::bounds(p, x, travel)).collect();
        self.near(&bounds, within).into_iter().filter(|&(a, b)| {
            let [p, q] = self.pieces([a, b]);
            !(p.touches(q) && Surface::is_straight(p, q, x, &self.reference))
        })
    }

    /// Whether the scene lets two pieces act on each other; obstacles act on all.
    fn may_meet(&self, a: &Piece, b: &Piece) -> bool {
        let rigid = a.obstacle.is_some() || b.obstacle.is_some();
        rigid || (self.partners.as_ref()).is_none_or(|partners| partners.meet(a.groups, b.groups))
    }

    /// Pairs of pieces, the first with the smaller index, whose boxes are within a distance and that may meet at all.
    fn near(&self, bounds: &[Bounds], within: f64) -> Vec<(u32, u32)> {
        let pieces = &self.surface.pieces;
        let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
        // Only what bounds the same region meets.
        order.sort_unstable_by(|&a, &b| {
            let region = |k: u32| pieces[k as usize].region;
            let left = |k: u32| bounds[k as usize].low[0];
            region(a).cmp(&region(b)).then(left(a).total_cmp(&left(b)))
        });
        let mut found = Vec::new();
        for (k, &a) in order.iter().enumerate() {
            let (own, bound) = (&pieces[a as usize], &bounds[a as usize]);
            for &b in &order[k + 1..] {
                let (other, other_bound) = (&pieces[b as usize], &bounds[b as usize]);
                if other.region != own.region || other_bound.low[0] > bound.high[0] + within {
                    break;
                }
                let rigid = own.obstacle.is_some() && other.obstacle.is_some();
                let meet = self.may_meet(own, other) && !rigid;
                if meet && bound.is_near(other_bound, within) {
                    found.push((a.min(b), a.max(b)));
                }
            }
        }
        found.sort_unstable();
        found
    }
}

impl Touches {
    /// Whether surfaces are so near that no state can be made of it.
    pub fn is_crushed(&self) -> bool {
        self.least_ratio.is_some_and(|r| r < CRUSHED)
    }

    /// Whether surfaces have come much nearer to each other than they were: as the repulsion grows without bound, a linear
    /// prediction of it is of use over a part of the gap only.
    pub fn is_rash_after(&self, before: &Self) -> bool {
        self.list.iter().any(|touch| {
            let Some(now) = touch.least_ratio else {
                return false;
            };
            // Both lists are sorted by pieces.
            let old = before
                .list
                .binary_search_by_key(&touch.pieces, |t| t.pieces)
                .ok()
                .and_then(|k| before.list[k].least_ratio);
            now < LEAST_GAP_KEPT * old.unwrap_or(1.0)
        })
    }

    /// Adds the forces dE/du to a nodal field.
    pub fn add_gradient(&self, contact: &SelfContact, out: &mut [[f64; 2]]) {
        for touch in &self.list {
            let two = contact.pieces(touch.pieces);
            for (k, f) in touch.force.iter().enumerate() {
                let piece = two[k / 3];
                if k % 3 < piece.count {
                    let node = &mut out[piece.nodes[k % 3] as usize];
                    node[0] += f[0];
                    node[1] += f[1];
                }
            }
        }
    }

    /// The parts of the tangent, with the number of each unknown; `unknown` answers [`Coupling::NONE`] for a fixed component.
    pub fn couplings(
        &self,
        contact: &SelfContact,
        unknown: impl Fn(u32, usize) -> u32,
    ) -> Vec<Coupling> {
        let coupling = |touch: &Touch| {
            let two = contact.pieces(touch.pieces);
            let mut unknowns = [Coupling::NONE; 12];
            let mut nodes = [None; 6];
            for k in 0..6 {
                let piece = two[k / 3];
                if k % 3 < piece.count {
                    let node = piece.nodes[k % 3];
                    nodes[k] = Some(node);
                    unknowns[2 * k] = unknown(node, 0);
                    unknowns[2 * k + 1] = unknown(node, 1);
                }
            }
            Coupling {
                key: touch.pieces,
                nodes,
                unknowns,
                values: touch.hessian.clone(),
            }
        };
        self.list.iter().map(coupling).collect()
    }
}

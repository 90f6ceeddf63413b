//! Newton's method at one load or at one cavity area, with independent pressure and capped steps.
//!
//! An energy line search creeps along the valley det F = 1 of nearly incompressible solids, so steps are not searched but
//! capped: the step is scaled to a displacement gradient of [`Settings::step_cap`], and shortened where the smallest J would
//! fall below a tenth of its value. Where the tangent at a load is not positive definite a diagonal shift makes it so, which
//! leads towards a stable state; where that does not converge the indefinite factor is used as it is.
//!
//! A factor is used again for the next step where that converges fast (`kept_factor`).
//!
//! At a given cavity area the load is an unknown: K du = -R + f dl and f . du = q - q(u), with f = dR_ext/dl = dq/du the
//! forces per unit of load and q their conjugate (for pressures the areas of the cavities, weighted by the pressures'
//! rates). The bordered system stays regular at a limit point of the load.

use super::kept_factor::KeptFactor;
use super::leg::Leg;
use super::observer::{Observer, Phase};
use super::status::{NotConverged, PathWork};
use crate::assembly::{Assembled, DofMap, Load, State, System, Workspace};
use crate::linear::Solver;

/// Settings of Newton's method and of the load path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Accepted residual over the force scale.
    pub tolerance: f64,
    /// Newton iterations at one load.
    pub max_iterations: usize,
    /// Largest size of a Newton step.
    pub step_cap: f64,
    /// Largest size of a predictor.
    pub predictor_cap: f64,
    /// Smallest load step as a fraction of a leg.
    pub least_step: f64,
    /// Factorisations of the whole path.
    pub max_factorisations: usize,
    /// What leads the path.
    pub control: Control,
    /// Load margin: beyond every loaded row of the schedule the path is followed on to this many times the row.
    pub load_margin: Option<f64>,
}

/// What leads the path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Control {
    /// The load; where it has a limit, the cavity area locates it.
    #[default]
    Load,
    /// The cavity area from the start of every leg: a second way to the same limits.
    CavityArea,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            max_iterations: 30,
            step_cap: 0.5,
            predictor_cap: 0.7,
            least_step: 1e-4,
            max_factorisations: 20_000,
            control: Control::Load,
            load_margin: None,
        }
    }
}

/// A residual above this share of the force scale is not looked at for being round-off.
const ROUND_OFF: f64 = 1e-6;
/// A residual that is round-off is less than this many times what one rounding of the displacements makes: nearly all residuals
/// stall below that.
const ROUND_OFF_FACTOR: f64 = 2.0;
/// Iterations with a shifted tangent before the indefinite factor is used as it is.
const SHIFTED_ITERATIONS: usize = 10;
/// A step is shortened until the smallest J keeps this share of its value.
const LEAST_J_KEPT: f64 = 0.1;
/// Corrections that grow by this factor, and are larger than the other, tell a bend of the path.
const GROWTH: f64 = 1.5;
const NOTICED: f64 = 0.02;
/// Steps of a damped motion, the largest size of one, and the least damping as a share of the tangent's mean diagonal.
const RELAXATIONS: usize = 200;
const CALM_STEP: f64 = 0.2;
const LEAST_DAMPING: f64 = 1e-9;
/// A search for a near equilibrium whose correction is larger than this is lost.
const LOST_STEP: f64 = 2.0;
/// How often a step is shortened for J.
const MOST_SHORTENINGS: usize = 12;

/// What one Newton solve gave.
#[derive(Clone, Copy, Debug)]
pub(super) enum Converged {
    /// Accepted.
    Yes(Solved),
    /// Not accepted.
    No,
}

impl Converged {
    pub(super) fn solved(self) -> Option<Solved> {
        match self {
            Self::Yes(solved) => Some(solved),
            Self::No => None,
        }
    }
}

/// A solution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    /// Residual over the force scale.
    pub residual: f64,
    /// Smallest J.
    pub least_j: f64,
    /// Whether a tangent on the way was indefinite, or a correction larger than the one before.
    pub bent: bool,
    /// Fraction of the leg: that of the load, or the one found at the cavity area.
    pub fraction: f64,
    /// Size of the way from the state whose tangent's factor the solver holds; infinite where it holds no other.
    pub from_factor: f64,
}

/// What is held while the displacements are found.
#[derive(Clone, Copy)]
pub(super) enum Held<'a> {
    /// The load at a fraction of a leg; the state that is sought is stable.
    Load { leg: &'a Leg, fraction: f64 },
    /// The load; whichever state is near.
    LoadNearest { leg: &'a Leg, fraction: f64 },
    /// The conjugate of the leg's load, from a guess of the fraction.
    Area {
        leg: &'a Leg,
        fraction: f64,
        conjugate: f64,
    },
}

/// The loop's surroundings.
pub(super) struct Newton<'a> {
    pub system: &'a System,
    pub solver: &'a mut Solver,
    pub settings: &'a Settings,
    pub force_floor: f64,
    pub work: &'a mut PathWork,
    pub vectors: &'a mut Workspace,
    pub observer: &'a mut dyn Observer,
    /// The load of the state from which is started.
    pub load_before: Load,
    /// The shift with which the next indefinite tangent is tried first.
    pub shift: f64,
    /// The displacements whose tangent the solver holds the factor of, where they are not those of the state: at the start
    /// of a solve by which a predictor was found, after it that of the last step. Empty for none.
    pub factored_at: &'a mut Vec<[f64; 2]>,
}

impl Newton<'_> {
    /// Solves R(u) = 0 from `state`, whose smallest J is `least_j`, moved by `first`.
    pub(super) fn solve(
        &mut self,
        state: &mut State,
        mut least_j: f64,
        first: &[[f64; 2]],
        held: Held<'_>,
    ) -> Result<Converged, NotConverged> {
        let system = self.system;
        let (leg, mut fraction, area) = match held {
            Held::Load { leg, fraction } | Held::LoadNearest { leg, fraction } => {
                (leg, fraction, None)
            }
            Held::Area {
                leg,
                fraction,
                conjugate,
            } => (leg, fraction, Some(conjugate)),
        };
        let seek_stable = matches!(held, Held::Load { .. });
        let mut step = vec![0.0; system.dofs.free()];
        let mut du = first.to_vec();
        let mut best = f64::INFINITY;
        let mut last = f64::INFINITY;
        let mut shifted = 0;
        let mut bent = false;
        let mut last_size = f64::INFINITY;
        let mut since_best = 0;
        // Whether the last step was made by the tangent of its own state: with another a residual may fall slowly.
        let mut fresh = false;
        let mut kept = KeptFactor::none();
        // A predictor's independent pressures move by the tangent that it was found with.
        let predicted_at = match held {
            Held::LoadNearest { .. } => Vec::new(),
            _ => std::mem::take(self.factored_at),
        };
        for iteration in 0..=self.settings.max_iterations {
            if self.observer.cancelled() {
                return Err(NotConverged::Cancelled);
            }
            self.observer.enter(Phase::Assembly);
            let load = leg.load(fraction);
            // A first step that moves supports or obstacles must be taken whole.
            let floor = if iteration == 0 && leg.moves_supports(system) {
                None
            } else {
                Some(LEAST_J_KEPT * least_j)
            };
            let predicted = iteration == 0 && !predicted_at.is_empty();
            let at = kept.at().or(predicted.then_some(predicted_at.as_slice()));
            let tangent = kept.at().is_none();
            let Some(assembled) = self.move_by(state, &mut du, &load, floor, at, tangent) else {
                return Ok(Converged::No);
            };
            self.load_before = load.clone();
            least_j = assembled.least_j;
            let relative = assembled.residual / assembled.force.max(self.force_floor);
            let missing = area.map_or(0.0, |q| q - system.conjugate(state, leg.rate()));
            if !relative.is_finite() {
                return Ok(Converged::No);
            }
            let solved = Solved {
                residual: relative,
                least_j,
                bent,
                fraction,
                from_factor: kept.distance(),
            };
            let on_area = area.is_none_or(|q| missing.abs() <= 1e-9 * q.abs().max(1e-6));
            if iteration > 0 && on_area && relative <= self.settings.tolerance {
                *self.factored_at = kept.into_place();
                return Ok(Converged::Yes(solved));
            }
            let stalls = relative < ROUND_OFF && relative > 0.5 * last;
            if iteration > 0
                && on_area
                && stalls
                && fresh
                && self.is_round_off(state, &load, assembled.residual)
            {
                self.work.stagnated += 1;
                *self.factored_at = kept.into_place();
                return Ok(Converged::Yes(solved));
            }
            if relative < 0.9 * best {
                best = relative;
                since_best = 0;
            } else {
                since_best += 1;
            }
            last = relative;
            if iteration == self.settings.max_iterations || since_best > 12 {
                return Ok(Converged::No);
            }
            self.work.newton_iterations += 1;
            self.work.contact_steps += usize::from(self.vectors.touches.pairs > 0);
            let mut change = 0.0;
            let mut size = f64::INFINITY;
            fresh = false;
            if let Some(at) = kept.at() {
                self.observer.enter(Phase::Factorisation);
                system.freeze(state, at, &mut self.vectors.residual);
                self.direction(&mut step, &mut du);
                size = system.gradient_size(&du);
                let steps = (self.settings.tolerance / relative).ln();
                if !kept.serves(size / last_size, steps) || stalls {
                    self.observer.enter(Phase::Assembly);
                    system.assemble(state, &load, false, true, self.vectors);
                    size = f64::INFINITY;
                }
            }
            if size.is_infinite() {
                fresh = true;
                self.observer.enter(Phase::Factorisation);
                let definite = self.factorise(seek_stable, &mut shifted)?;
                bent |= !definite;
                if area.is_some() {
                    du.fill([0.0; 2]);
                    change = self.bordered_step(state, leg, missing, &mut step, &mut du);
                } else {
                    self.direction(&mut step, &mut du);
                }
                size = system.gradient_size(&du);
                if definite && seek_stable && size <= self.settings.step_cap {
                    kept.renew(&state.u, size);
                } else {
                    kept.forget();
                }
            }
            bent |= size > GROWTH * last_size && size > NOTICED;
            last_size = size;
            let lost = matches!(held, Held::LoadNearest { .. }) && size > LOST_STEP;
            if !size.is_finite() || !change.is_finite() || lost {
                return Ok(Converged::No);
            }
            if size > self.settings.step_cap {
                let scale = self.settings.step_cap / size;
                du.iter_mut().flatten().for_each(|d| *d *= scale);
                change *= scale;
            }
            kept.moved(size);
            fraction += change;
        }
        Ok(Converged::No)
    }

    /// Whether rounding is all that the residual of the workspace is: as much comes of moving every displacement to the next
    /// number of the machine, up or down. No state at these displacements has a residual that is known better.
    fn is_round_off(&mut self, state: &State, load: &Load, residual: f64) -> bool {
        let before = self.vectors.residual.clone();
        let mut probe = state.clone();
        for (k, u) in probe.u.iter_mut().flatten().enumerate() {
            // Signs without a pattern (Weyl's sequence).
            let up = (k as f64 * 0.618_033_988_749_895).fract() < 0.5;
            *u = if up { u.next_up() } else { u.next_down() };
        }
        self.system
            .assemble(&mut probe, load, false, false, self.vectors);
        let after = std::mem::replace(&mut self.vectors.residual, before);
        let components = self.system.dofs.components();
        let changes = after
            .iter()
            .flatten()
            .zip(self.vectors.residual.iter().flatten());
        let largest = components
            .iter()
            .zip(changes)
            .filter(|(unknown, _)| **unknown != DofMap::FIXED)
            .fold(0.0_f64, |m, (_, (a, b))| m.max((a - b).abs()));
        residual <= ROUND_OFF_FACTOR * largest
    }

    /// The step -K^-1 R into `du`, with the factor that is there and the residual of the workspace.
    fn direction(&mut self, step: &mut [f64], du: &mut [[f64; 2]]) {
        let dofs = &self.system.dofs;
        dofs.gather(&self.vectors.residual, step);
        self.solver.solve(step, 1);
        du.fill([0.0; 2]);
        dofs.add_to_field(-1.0, step, du);
    }

    /// Moves the state by `du`, shortened until the smallest J is above `floor`, and assembles there; without a floor the
    /// whole step is taken, or none if J vanishes. The independent pressures move by the tangent at `at`. Where contact acts
    /// the step is shortened so that no surfaces pass through each other, or come much nearer to each other than they were.
    fn move_by(
        &mut self,
        state: &mut State,
        du: &mut [[f64; 2]],
        load: &Load,
        floor: Option<f64>,
        at: Option<&[[f64; 2]]>,
        tangent: bool,
    ) -> Option<Assembled> {
        let system = self.system;
        let before = state.u.clone();
        let touches = std::mem::take(&mut self.vectors.touches);
        if self.vectors.contact_acts {
            self.observer.enter(Phase::Contact);
            let free = system.free_share(state, du, &self.load_before, load);
            if free < 1.0 {
                if floor.is_none() || free <= 0.0 {
                    return None;
                }
                du.iter_mut().flatten().for_each(|d| *d *= free);
            }
            self.observer.enter(Phase::Assembly);
        }
        for _ in 0..floor.map_or(1, |_| MOST_SHORTENINGS) {
            system.advance(state, du, at);
            let assembled = system.assemble(state, load, false, tangent, self.vectors);
            let rash = self.vectors.touches.is_rash_after(&touches);
            if assembled.least_j > floor.unwrap_or(0.0) && !rash {
                return Some(assembled);
            }
            state.u.copy_from_slice(&before);
            du.iter_mut().flatten().for_each(|d| *d *= 0.5);
        }
        None
    }

    /// The step at a held cavity area into `step` and `du`; the change of the fraction.
    fn bordered_step(
        &mut self,
        state: &State,
        leg: &Leg,
        missing: f64,
        step: &mut [f64],
        du: &mut [[f64; 2]],
    ) -> f64 {
        let system = self.system;
        let n = step.len();
        let mut forces = vec![[0.0; 2]; du.len()];
        system.add_forces(state, leg.rate(), &mut forces);
        let mut f = vec![0.0; n];
        system.dofs.gather(&forces, &mut f);
        let mut both = vec![0.0; 2 * n];
        both[..n].copy_from_slice(&f);
        system.dofs.gather(&self.vectors.residual, &mut both[n..]);
        self.solver.solve(&mut both, 2);
        let (a, b) = both.split_at(n);
        let dot = |v: &[f64]| f.iter().zip(v).map(|(x, y)| x * y).sum::<f64>();
        let change = (missing + dot(b)) / dot(a);
        for ((s, a), b) in step.iter_mut().zip(a).zip(b) {
            *s = change * a - b;
        }
        system.dofs.add_to_field(1.0, step, du);
        change
    }

    /// Follows the damped motion (K + m I) du = -R from `state` moved by `first` at a load to a stable state, as a body does
    /// that snaps: the damping m is raised where a step would be large and falls as the motion calms.
    pub(super) fn relax(
        &mut self,
        state: &mut State,
        mut least_j: f64,
        first: Option<&[[f64; 2]]>,
        leg: &Leg,
        fraction: f64,
    ) -> Result<Converged, NotConverged> {
        let system = self.system;
        let load = leg.load(fraction);
        let mut step = vec![0.0; system.dofs.free()];
        let mut du = first.map_or_else(
            || vec![[0.0; 2]; system.body.mesh.nodes.len()],
            <[_]>::to_vec,
        );
        let pattern = &system.pattern;
        let n = pattern.size();
        let mut damping = 0.0;
        let mut last = f64::INFINITY;
        for iteration in 0..RELAXATIONS {
            if self.observer.cancelled() {
                return Err(NotConverged::Cancelled);
            }
            self.observer.enter(Phase::Assembly);
            let floor = Some(LEAST_J_KEPT * least_j);
            let Some(assembled) = self.move_by(state, &mut du, &load, floor, None, true) else {
                return Ok(Converged::No);
            };
            least_j = assembled.least_j;
            let relative = assembled.residual / assembled.force.max(self.force_floor);
            if !relative.is_finite() {
                return Ok(Converged::No);
            }
            let stalls = relative < ROUND_OFF && damping == 0.0 && relative > 0.5 * last;
            let stagnant = stalls && self.is_round_off(state, &load, assembled.residual);
            last = relative;
            self.work.stagnated += usize::from(stagnant && relative > self.settings.tolerance);
            if iteration > 0 && (relative <= self.settings.tolerance || stagnant) {
                return Ok(Converged::Yes(Solved {
                    residual: relative,
                    least_j,
                    bent: true,
                    fraction,
                    from_factor: f64::INFINITY,
                }));
            }
            self.work.newton_iterations += 1;
            self.observer.enter(Phase::Factorisation);
            let diagonal = |k: usize| pattern.diagonal(k);
            let mean = (0..n)
                .map(|k| self.vectors.tangent[diagonal(k)].abs())
                .sum::<f64>()
                / n as f64;
            let mut applied = 0.0;
            loop {
                self.check_work()?;
                (0..n).for_each(|k| self.vectors.tangent[diagonal(k)] += damping - applied);
                applied = damping;
                self.work.factorisations += 1;
                let definite = self.system.factorise(self.solver, self.vectors);
                let mut size = f64::INFINITY;
                if definite {
                    system.dofs.gather(&self.vectors.residual, &mut step);
                    self.solver.solve(&mut step, 1);
                    du.fill([0.0; 2]);
                    system.dofs.add_to_field(-1.0, &step, &mut du);
                    size = system.gradient_size(&du);
                }
                if size <= CALM_STEP {
                    if size < 0.25 * CALM_STEP {
                        damping *= 0.3;
                    }
                    if damping < LEAST_DAMPING * mean {
                        damping = 0.0;
                    }
                    break;
                }
                // A soft mode moves as 1 / damping.
                let growth = if size.is_finite() {
                    (size / CALM_STEP).clamp(2.0, 30.0)
                } else {
                    4.0
                };
                damping = (growth * damping).max(LEAST_DAMPING * mean);
                if damping > mean {
                    return Ok(Converged::No);
                }
            }
        }
        Ok(Converged::No)
    }

    /// Factorises the tangent of the workspace; whether it was positive definite. Where a stable state is sought one that
    /// is not is shifted until it is.
    fn factorise(&mut self, seek_stable: bool, shifted: &mut usize) -> Result<bool, NotConverged> {
        self.check_work()?;
        self.work.factorisations += 1;
        if self.system.factorise(self.solver, self.vectors) {
            return Ok(true);
        }
        if !seek_stable || *shifted >= SHIFTED_ITERATIONS {
            self.work.factorisations += 1;
            self.system.factorise_indefinite(self.solver, self.vectors);
            return Ok(false);
        }
        *shifted += 1;
        let pattern = &self.system.pattern;
        let n = pattern.size();
        let mean = (0..n)
            .map(|k| self.vectors.tangent[pattern.diagonal(k)].abs())
            .sum::<f64>()
            / n as f64;
        let (mut shift, mut applied) = (self.shift.max(1e-4 * mean), 0.0);
        loop {
            for k in 0..n {
                self.vectors.tangent[pattern.diagonal(k)] += shift - applied;
            }
            applied = shift;
            self.check_work()?;
            self.work.factorisations += 1;
            if self.system.factorise(self.solver, self.vectors) {
                self.shift = 0.2 * shift;
                return Ok(false);
            }
            if shift > 1e3 * mean {
                self.system.factorise_indefinite(self.solver, self.vectors);
                return Ok(false);
            }
            shift *= 5.0;
        }
    }

    fn check_work(&self) -> Result<(), NotConverged> {
        if let Some(why) = &self.solver.failed_extension {
            return Err(NotConverged::Analysis {
                detail: why.to_string(),
            });
        }
        if self.work.factorisations >= self.settings.max_factorisations {
            return Err(NotConverged::WorkLimit {
                factorisations: self.work.factorisations,
            });
        }
        Ok(())
    }
}

//! Newton's method at one load, with independent pressure and capped steps.
//!
//! An energy line search creeps along the valley det F = 1 of nearly incompressible solids, so steps are not searched but
//! capped: the step is scaled to a displacement gradient of [`Settings::step_cap`]. Where the tangent is not positive
//! definite a diagonal shift makes it so, which leads towards a stable state; where that does not converge, or the path
//! is already on an unstable branch, the indefinite factor is used as it is.

use super::observer::{Observer, Phase};
use super::status::{NotConverged, PathWork};
use crate::assembly::{Load, State, System, Workspace};
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
        }
    }
}

/// Below this share of the force scale a residual that no longer falls is round-off.
const ROUND_OFF: f64 = 1e-6;
/// Iterations with a shifted tangent before the indefinite factor is used as it is.
const SHIFTED_ITERATIONS: usize = 10;

/// What one Newton solve gave.
pub(super) enum Converged {
    /// Accepted: relative residual, smallest J.
    Yes { residual: f64, least_j: f64 },
    /// Not accepted.
    No { residual: f64, iterations: usize },
}

/// The loop's surroundings.
pub(super) struct Newton<'a> {
    pub system: &'a System,
    pub solver: &'a mut Solver,
    pub settings: &'a Settings,
    pub force_floor: f64,
    pub work: &'a mut PathWork,
    pub observer: &'a mut dyn Observer,
}

impl Newton<'_> {
    /// Solves R(u) = 0 at `load` from `state`; `unstable` says that the path is on an unstable branch already.
    pub(super) fn solve(
        &mut self,
        state: &mut State,
        load: &Load,
        unstable: bool,
        vectors: &mut Workspace,
    ) -> Result<Converged, NotConverged> {
        let system = self.system;
        let mut step = vec![0.0; system.dofs.free()];
        let mut du = vec![[0.0; 2]; system.body.mesh.nodes.len()];
        let mut best = f64::INFINITY;
        let mut last = f64::INFINITY;
        let mut shifted = 0;
        let mut since_best = 0;
        for iteration in 0..=self.settings.max_iterations {
            if self.observer.cancelled() {
                return Err(NotConverged::Cancelled);
            }
            self.observer.enter(Phase::Assembly);
            let assembled = system.assemble(state, load, false, true, vectors);
            let relative = assembled.residual / assembled.force.max(self.force_floor);
            if assembled.least_j <= 0.0 || !relative.is_finite() {
                return Ok(Converged::No {
                    residual: f64::INFINITY,
                    iterations: iteration,
                });
            }
            if iteration > 0 {
                if relative <= self.settings.tolerance {
                    return Ok(Converged::Yes {
                        residual: relative,
                        least_j: assembled.least_j,
                    });
                }
                if relative < ROUND_OFF && relative > 0.5 * last && last < ROUND_OFF {
                    self.work.stagnated += 1;
                    return Ok(Converged::Yes {
                        residual: relative,
                        least_j: assembled.least_j,
                    });
                }
            }
            if relative < 0.9 * best {
                best = relative;
                since_best = 0;
            } else {
                since_best += 1;
            }
            last = relative;
            if iteration == self.settings.max_iterations || since_best > 12 {
                return Ok(Converged::No {
                    residual: relative,
                    iterations: iteration,
                });
            }
            self.work.newton_iterations += 1;
            self.observer.enter(Phase::Factorisation);
            self.factorise(unstable, &mut shifted, vectors)?;
            system.dofs.gather(&vectors.residual, &mut step);
            self.solver.solve(&mut step, 1);
            du.fill([0.0; 2]);
            system.dofs.add_to_field(-1.0, &step, &mut du);
            let size = system.gradient_size(&du);
            if !size.is_finite() {
                return Ok(Converged::No {
                    residual: relative,
                    iterations: iteration,
                });
            }
            if size > self.settings.step_cap {
                let scale = self.settings.step_cap / size;
                du.iter_mut().flatten().for_each(|d| *d *= scale);
            }
            system.advance(state, &du);
        }
        Ok(Converged::No {
            residual: last,
            iterations: self.settings.max_iterations,
        })
    }

    /// Factorises the tangent of the workspace, shifted where that makes it positive definite.
    fn factorise(
        &mut self,
        unstable: bool,
        shifted: &mut usize,
        vectors: &mut Workspace,
    ) -> Result<(), NotConverged> {
        self.check_work()?;
        if self.solver.factorise(&vectors.tangent) {
            self.work.factorisations += 1;
            return Ok(());
        }
        self.work.factorisations += 1;
        if unstable || *shifted >= SHIFTED_ITERATIONS {
            self.solver.factorise_indefinite(&vectors.tangent);
            self.work.factorisations += 1;
            return Ok(());
        }
        *shifted += 1;
        let pattern = &self.system.pattern;
        let n = pattern.size();
        let mean = (0..n)
            .map(|k| vectors.tangent[pattern.diagonal(k)].abs())
            .sum::<f64>()
            / n as f64;
        let (mut shift, mut applied) = (1e-4 * mean, 0.0);
        loop {
            for k in 0..n {
                vectors.tangent[pattern.diagonal(k)] += shift - applied;
            }
            applied = shift;
            self.check_work()?;
            self.work.factorisations += 1;
            if self.solver.factorise(&vectors.tangent) {
                return Ok(());
            }
            if shift > 1e3 * mean {
                self.solver.factorise_indefinite(&vectors.tangent);
                return Ok(());
            }
            shift *= 5.0;
        }
    }

    fn check_work(&self) -> Result<(), NotConverged> {
        if self.work.factorisations >= self.settings.max_factorisations {
            return Err(NotConverged::WorkLimit {
                factorisations: self.work.factorisations,
            });
        }
        Ok(())
    }
}

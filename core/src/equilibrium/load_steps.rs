//! Steps of the load, as long as the tangent predictor allows.
//!
//! From each accepted state a tangent predictor leads to the next one; a step whose predictor is larger than
//! [`Settings::predictor_cap`](super::Settings) is shortened, one whose Newton solve fails is cut. Where steps become small
//! the cavity area takes over the lead (`area_control`), which tells a hard passage from a limit. The factor at
//! an accepted state serves the predictor, the count of negative pivots and, where it is wanted, the adjoint.

use super::load_path::StateVisitor;
use super::newton::{Control, Held};
use super::observer::{Observer, Phase};
use super::status::PathEnd;
use super::tracker::Tracker;

/// Failed steps in a row after which the cavity area takes over.
const MOST_CUTS: usize = 2;
/// The load of a snap beyond the last state, as a part of the leg, and how many of them may fail.
const SNAP_STEP: f64 = 0.02;
const MOST_LONG_SNAPS: usize = 2;

impl Tracker<'_> {
    /// Goes to a fraction of the present leg, in as many steps as it takes.
    pub fn advance_to(
        &mut self,
        target: f64,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<(), PathEnd> {
        // The area leads what pressures and tractions do, not what obstacles do.
        let has_forces = self.leg.has_forces(self.system) && !self.leg.moves_obstacles(self.system);
        let mut cuts = 0;
        loop {
            let remaining = target - self.at.fraction;
            let mut step = remaining.min(self.suggested);
            if step > 0.6 * remaining && step < remaining {
                step = 0.5 * remaining;
            }
            observer.enter(Phase::Factorisation);
            let (mut du, size) = self.predict(step, observer);
            self.watch_rate(&du, step, size);
            if size.is_finite() && size > self.settings.predictor_cap {
                let scale = 0.9 * self.settings.predictor_cap / size;
                step *= scale;
                du.iter_mut().flatten().for_each(|d| *d *= scale);
            }
            let small = step < self.settings.least_step.min(0.5 * remaining);
            let stuck = cuts > MOST_CUTS || small;
            let by_area = self.settings.control == Control::CavityArea || stuck;
            let may_snap =
                stuck && has_forces && !self.beyond && self.failed_snaps < MOST_LONG_SNAPS;
            if may_snap && self.snap(SNAP_STEP, target, visitor, observer)? {
                cuts = 0;
                if self.at.fraction >= target {
                    return Ok(());
                }
                continue;
            }
            if by_area && has_forces {
                if self.lead_by_area(target, visitor, observer)? {
                    return Ok(());
                }
                cuts = 0;
                continue;
            }
            if small {
                return Err(self.failed());
            }
            let whole = step >= remaining * (1.0 - 1e-12);
            let fraction = if whole {
                target
            } else {
                self.at.fraction + step
            };
            let before = self.at.clone();
            let leg = self.leg.clone();
            let mut state = before.state.clone();
            let held = Held::Load {
                leg: &leg,
                fraction,
            };
            let Some(solved) = self.solve(&mut state, before.least_j, &du, held, observer)? else {
                cuts += 1;
                self.work.load_cuts += 1;
                self.suggested = 0.4 * step;
                // Newton's iterations overwrote the factor.
                self.return_to(before, observer);
                continue;
            };
            self.accept(state, solved, observer);
            self.settle(&before, &du, solved, observer)?;
            cuts = 0;
            self.suggested = (2.0 * step).max(self.suggested).min(1.0);
            if whole {
                return Ok(());
            }
            self.suggested = 1.5 * step;
            self.work.inserted_states += 1;
            observer.enter(Phase::Measures);
            let stretch = visitor.stretch(self.system, &self.at.state);
            self.note(stretch);
            if let Some(end) = self.asymptote() {
                return Err(end);
            }
        }
    }

    /// Tangent predictor for a step of the present leg: displacement increment and its size.
    fn predict(&mut self, step: f64, observer: &mut dyn Observer) -> (Vec<[f64; 2]>, f64) {
        let (mut du, _) = if let Some(moved) = self.prescribed_change(step) {
            // Forces of moved supports are those of this state: only its own tangent holds them in balance.
            if !self.factored_at.is_empty() {
                self.factorise(observer);
            }
            (self.predict_moved(step, moved), 0.0)
        } else {
            let (mut du, compliance) = self.tangent_direction();
            du.iter_mut().flatten().for_each(|d| *d *= step);
            (du, compliance)
        };
        let size = self.system.gradient_size(&du);
        if !size.is_finite() {
            du.fill([0.0; 2]);
        }
        (du, size)
    }

    /// The predictor where supports move: K u_prescribed by a difference of residuals, as a predictor need not be exact.
    fn predict_moved(&mut self, step: f64, moved: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        let mut change = vec![[0.0; 2]; moved.len()];
        // Tractions, supports and obstacles follow the shares, pressures are linear in themselves.
        let mut pressures = self.leg.rate().clone();
        pressures.share.fill(0.0);
        self.system
            .add_forces(&self.at.state, &pressures, &mut change);
        change.iter_mut().flatten().for_each(|c| *c *= step);
        let load = self.leg.load(self.at.fraction);
        let epsilon = 1e-6;
        let mut probe = self.at.state.clone();
        for (u, m) in probe.u.iter_mut().zip(&moved) {
            u[0] += epsilon * m[0];
            u[1] += epsilon * m[1];
        }
        let mut moved_on = load.clone();
        moved_on.share = self.leg.load(self.at.fraction + epsilon * step).share;
        let mut residual = |state: &mut _, load: &_| {
            self.system
                .assemble(state, load, true, false, &mut self.vectors);
            self.vectors.residual.clone()
        };
        let here = residual(&mut self.at.state, &load);
        let there = residual(&mut probe, &moved_on);
        for ((c, r), r0) in change.iter_mut().zip(&there).zip(&here) {
            for i in 0..2 {
                c[i] -= (r[i] - r0[i]) / epsilon;
            }
        }
        let mut unknowns = vec![0.0; self.system.dofs.free()];
        self.system.dofs.gather(&change, &mut unknowns);
        self.solver.solve(&mut unknowns, 1);
        let mut du = moved;
        self.system.dofs.add_to_field(1.0, &unknowns, &mut du);
        du
    }

    /// Change of the prescribed displacements over a step, where there is any.
    fn prescribed_change(&self, step: f64) -> Option<Vec<[f64; 2]>> {
        let nodes = self.system.body.mesh.nodes.len();
        let obstacles = self.leg.moves_obstacles(self.system);
        let mut moved: Option<Vec<[f64; 2]>> = obstacles.then(|| vec![[0.0; 2]; nodes]);
        for s in &self.system.body.supports {
            let change = s.displacement_mm * self.leg.rate().share[s.channel] * step;
            if change != 0.0 {
                moved.get_or_insert_with(|| vec![[0.0; 2]; nodes])[s.node as usize]
                    [s.component as usize] += change;
            }
        }
        moved
    }
}

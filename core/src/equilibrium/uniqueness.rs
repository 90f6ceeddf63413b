//! Where a second equilibrium is met: saying so, and following the stable branch.
//!
//! Three signs are acted on. *An accepted state with negative pivots*: the path has run onto an unstable branch. The loss of
//! uniqueness is located by bisection on the load, and the state is pushed along its lowest mode, to one side and, where that
//! fails, to the other, and a damped motion settles on a stable state: that branch is followed. *A bend*: the path's rate grows
//! fast, or Newton's corrections grow: the branch passes a bifurcation that an imperfection (the mesh's own, or the shape's)
//! has broken. From there on, on the other side of the path's straight continuation, the nearest equilibrium is sought
//! without regard to its stability; at the end of the leg once more and, where the rate has grown much, by a damped motion too,
//! which costs more. If either ends elsewhere the load does not determine the shape, although the path followed is stable. A rate that
//! falls is no bend: a slack body stiffens as it is inflated, and its corrections may grow at first. *A snap*: no state near, but a damped motion from the last one comes to rest at a slightly larger load.

use super::load_path::StateVisitor;
use super::newton::{Control, Held, Solved};
use super::observer::Observer;
use super::status::{LimitKind, LossOfUniqueness, NotConverged, PathEnd};
use super::tracker::{Place, Tracker, norm};

/// Sizes of the pushes along the lowest mode, in this order.
const PUSHES: [f64; 2] = [0.05, -0.05];
/// Vectors and iterations of the search for the lowest mode.
const VECTORS: usize = 4;
const MODE_ITERATIONS: usize = 10;
/// Searches for a second equilibrium on one path, and those by a damped motion.
const MOST_SEARCHES: usize = 8;
const MOST_DAMPED_SEARCHES: usize = 1;
/// A loss of uniqueness is located to this share of the leg's largest load.
const LOCATED: f64 = 0.01;
/// Two equilibria differ by more than this size.
const DIFFERENT: f64 = 1e-3;
/// The path bends where its rate grows by this factor within this part of a leg.
const RATE_GROWTH: f64 = 1.6;
const WINDOW: f64 = 0.12;
/// Damped motions of one path that come to no rest.
const MOST_FAILED_SNAPS: usize = 4;
/// A snap that stretches the solid by more than this factor is none: the body balloons.
const MOST_GROWTH_OF_STRETCH: f64 = 1.5;

/// A place from which the path may be continued straight.
pub(super) struct Bend {
    leg: usize,
    from: Place,
    direction: Vec<[f64; 2]>,
    rate: f64,
    /// Fraction at which the bend was noticed.
    noticed: Option<f64>,
    /// Whether the rate has grown by [`RATE_GROWTH`].
    sharp: bool,
    /// Whether a second equilibrium was sought where it was noticed.
    sought: bool,
}

impl Bend {
    fn new(leg: usize, from: Place, du: &[[f64; 2]], step: f64, rate: f64) -> Self {
        let scaled = |d: &[f64; 2]| [d[0] / step, d[1] / step];
        Self {
            leg,
            from,
            direction: du.iter().map(scaled).collect(),
            rate,
            noticed: None,
            sharp: false,
            sought: false,
        }
    }
}

impl Tracker<'_> {
    /// Looks at the state that was just accepted after a step `du` from `before`: leaves an unstable branch, notes the loss
    /// of uniqueness.
    pub fn settle(
        &mut self,
        before: &Place,
        du: &[[f64; 2]],
        solved: Solved,
        observer: &mut dyn Observer,
    ) -> Result<(), PathEnd> {
        if self.negative > 0 && self.lowest_mode().is_some() {
            if self.beyond {
                return Err(self.limit(LimitKind::Bifurcation, before.fraction, None));
            }
            return self.leave_unstable(before, observer);
        }
        let may_search = self.settings.control == Control::Load
            && !self.beyond
            && self.loss.is_none()
            && self.searches < MOST_SEARCHES;
        if !may_search {
            return Ok(());
        }
        if solved.bent && self.bend.is_none() {
            let step = self.at.fraction - before.fraction;
            let rate = self.system.gradient_size(du) / step;
            let after = self.system.gradient_size(&self.tangent_direction().0);
            if after >= rate {
                let mut bend = Bend::new(self.leg.index, before.clone(), du, step, rate);
                bend.sharp = after > RATE_GROWTH * rate;
                self.bend = Some(bend);
            }
        }
        // Where the bend is noticed, and at the end of the leg.
        let here = self.at.fraction;
        let due = |b: &mut Bend| b.leg == self.leg.index && (!b.sought || here >= 1.0);
        if let Some(mut bend) = self.bend.take_if(due) {
            bend.noticed.get_or_insert(here);
            bend.sought = true;
            self.searches += 1;
            self.search_second(&bend, observer)?;
            self.bend = (here < 1.0).then_some(bend);
        }
        Ok(())
    }

    /// Compares the rate of the path with that of a while ago: where it has grown fast the path bends.
    pub fn watch_rate(&mut self, du: &[[f64; 2]], step: f64, size: f64) {
        let rate = size / step;
        if self.beyond
            || self.bend.is_some()
            || !rate.is_finite()
            || self.settings.control != Control::Load
        {
            return;
        }
        let (leg, here) = (self.leg.index, self.at.fraction);
        self.trail.retain(|b| b.leg == leg);
        while self.trail.len() > 1 && here - self.trail[1].from.fraction >= WINDOW {
            self.trail.remove(0);
        }
        if let Some(old) = self.trail.first()
            && old.from.fraction < here
            && rate > RATE_GROWTH * old.rate
        {
            let mut bend = self.trail.remove(0);
            bend.noticed = Some(here);
            bend.sharp = true;
            self.bend = Some(bend);
            self.trail.clear();
            return;
        }
        if self.trail.last().is_none_or(|b| b.from.fraction < here) {
            self.trail
                .push(Bend::new(leg, self.at.clone(), du, step, rate));
        }
    }

    /// Lets the body snap: from the accepted state, a damped motion at a load that is larger by a part of the leg.
    pub fn snap(
        &mut self,
        step: f64,
        target: f64,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<bool, PathEnd> {
        // A damped motion moves no supports.
        if self.failed_snaps >= MOST_FAILED_SNAPS || self.leg.moves_supports(self.system) {
            return Ok(false);
        }
        let before = self.at.clone();
        let fraction = (before.fraction + step).min(target);
        let stretch_before = visitor.stretch(self.system, &before.state);
        let mut state = before.state.clone();
        if let Some(solved) = self.relax(&mut state, before.least_j, None, fraction, observer)? {
            self.accept(state, solved, observer);
            let stretch = visitor.stretch(self.system, &self.at.state);
            if self.negative == 0 && stretch < MOST_GROWTH_OF_STRETCH * stretch_before {
                self.work.snaps += 1;
                if self.loss.is_none() {
                    self.note_loss(0.5 * (before.fraction + fraction), 0);
                }
                self.suggested = step;
                return Ok(true);
            }
        }
        self.failed_snaps += 1;
        self.return_to(before, observer);
        Ok(false)
    }

    /// The mode of a negative eigenvalue; `None` where the factor's sign is round-off.
    fn lowest_mode(&mut self) -> Option<Vec<[f64; 2]>> {
        let modes = self.modes();
        let negative = modes.iter().filter(|(inverse, _)| *inverse < 0.0);
        Some(negative.min_by(|a, b| a.0.total_cmp(&b.0))?.1.clone())
    }

    /// The mode of the eigenvalue nearest to zero.
    pub fn nearest_mode(&mut self) -> Option<Vec<[f64; 2]>> {
        let modes = self.modes().into_iter();
        Some(modes.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?.1)
    }

    /// Inverses of the eigenvalues nearest to zero with their modes, of gradient size 1 and positive in their largest
    /// component, by orthogonal iteration with K^-1 from fixed start vectors.
    fn modes(&mut self) -> Vec<(f64, Vec<[f64; 2]>)> {
        let n = self.system.dofs.free();
        // Deterministic start vectors without symmetry.
        let mut vectors: Vec<Vec<f64>> = (0..VECTORS.min(n))
            .map(|v| {
                let entry = |k: usize| ((k * (7919 + 104 * v) + 31 * v) % 997) as f64 / 997.0 - 0.5;
                (0..n).map(entry).collect()
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut inverse = [0.0; VECTORS];
        for _ in 0..MODE_ITERATIONS {
            for v in 0..vectors.len() {
                let (done, rest) = vectors.split_at_mut(v);
                let vector = &mut rest[0];
                for other in done {
                    let share = dot(other, vector);
                    vector
                        .iter_mut()
                        .zip(&*other)
                        .for_each(|(x, o)| *x -= share * o);
                }
                let length = dot(vector, vector).sqrt();
                for x in vector {
                    *x /= length;
                }
            }
            let mut all = vectors.concat();
            self.solver.solve(&mut all, vectors.len());
            for (v, image) in all.chunks(n).enumerate() {
                inverse[v] = dot(&vectors[v], image);
                vectors[v].copy_from_slice(image);
            }
        }
        let mode = |(vector, inverse): (&Vec<f64>, f64)| {
            let largest = vector
                .iter()
                .copied()
                .max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
            let mut field = vec![[0.0; 2]; self.system.body.mesh.nodes.len()];
            self.system
                .dofs
                .add_to_field(largest.signum(), vector, &mut field);
            let size = self.system.gradient_size(&field);
            field.iter_mut().flatten().for_each(|x| *x /= size);
            Some((inverse, field))
        };
        vectors.iter().zip(inverse).filter_map(mode).collect()
    }

    /// The accepted state is unstable: notes where the path became so, and settles on a stable state of the same load.
    fn leave_unstable(
        &mut self,
        before: &Place,
        observer: &mut dyn Observer,
    ) -> Result<(), PathEnd> {
        let (unstable, negative) = (self.at.clone(), self.negative);
        let mode = self.lowest_mode();
        if self.loss.is_none() {
            self.locate_loss(before, &unstable, negative, observer)?;
        }
        for push in PUSHES {
            let Some(mode) = &mode else { break };
            let du: Vec<[f64; 2]> = mode.iter().map(|m| [push * m[0], push * m[1]]).collect();
            let mut state = unstable.state.clone();
            let (least_j, fraction) = (unstable.least_j, unstable.fraction);
            let solved = self.relax(&mut state, least_j, Some(&du), fraction, observer)?;
            if let Some(solved) = solved {
                self.accept(state, solved, observer);
                if self.negative == 0 {
                    return Ok(());
                }
            }
        }
        self.at = before.clone();
        Err(self.limit(LimitKind::Bifurcation, before.fraction, None))
    }

    /// Bisects between a stable place and an unstable one for the load at which the branch lost its stability.
    fn locate_loss(
        &mut self,
        stable: &Place,
        unstable: &Place,
        negative: usize,
        observer: &mut dyn Observer,
    ) -> Result<(), NotConverged> {
        let leg = self.leg.clone();
        let (mut low, mut high, mut pivots) = (stable.clone(), unstable.clone(), negative);
        while self.is_wide(low.fraction, high.fraction) {
            let middle = 0.5 * (low.fraction + high.fraction);
            let held = Held::LoadNearest {
                leg: &leg,
                fraction: middle,
            };
            // Half-way between two states of one branch.
            let half: Vec<[f64; 2]> = difference(&high.state.u, &low.state.u, 0.5);
            let mut state = low.state.clone();
            let solved = self.solve(&mut state, low.least_j, &half, held, observer)?;
            let Some(solved) = solved else { break };
            self.accept(state, solved, observer);
            if self.negative > 0 {
                (high, pivots) = (self.at.clone(), self.negative);
            } else {
                low = self.at.clone();
            }
        }
        self.note_loss(0.5 * (low.fraction + high.fraction), pivots);
        Ok(())
    }

    /// Seeks another equilibrium at the load of the accepted state, on the other side of the straight continuation of the
    /// path from before the bend.
    fn search_second(
        &mut self,
        bend: &Bend,
        observer: &mut dyn Observer,
    ) -> Result<(), NotConverged> {
        let stable = self.at.clone();
        let contact_acts = self.vectors.contact_acts;
        let leg = self.leg.clone();
        let held = Held::LoadNearest {
            leg: &leg,
            fraction: stable.fraction,
        };
        let step = stable.fraction - bend.from.fraction;
        for (reflection, damped) in [(1.0, false), (0.0, false), (1.0, true)] {
            if damped {
                let due = bend.sharp && stable.fraction >= 1.0;
                if !due || self.damped_searches >= MOST_DAMPED_SEARCHES {
                    break;
                }
                self.damped_searches += 1;
            }
            // u + d step, reflected in the stable state: 2 (u + d step) - u_stable.
            let guess = |((u, d), s): ((&[f64; 2], &[f64; 2]), &[f64; 2])| {
                std::array::from_fn(|i| {
                    let straight = u[i] + step * d[i];
                    straight + reflection * (straight - s[i]) - u[i]
                })
            };
            let from = &bend.from.state.u;
            let du: Vec<[f64; 2]> = from
                .iter()
                .zip(&bend.direction)
                .zip(&stable.state.u)
                .map(guess)
                .collect();
            let mut state = bend.from.state.clone();
            let (least_j, fraction) = (bend.from.least_j, stable.fraction);
            let found = if damped {
                self.relax(&mut state, least_j, Some(&du), fraction, observer)?
            } else {
                self.solve(&mut state, least_j, &du, held, observer)?
            };
            let Some(solved) = found else { continue };
            let apart = difference(&state.u, &stable.state.u, 1.0);
            if self.system.gradient_size(&apart) > DIFFERENT {
                self.accept(state, solved, observer);
                let noticed = bend.noticed.unwrap_or(stable.fraction);
                let pivots = self.negative;
                self.note_loss(0.5 * (bend.from.fraction + noticed), pivots);
                break;
            }
        }
        self.vectors.contact_acts = contact_acts;
        self.return_to(stable, observer);
        Ok(())
    }

    fn is_wide(&self, low: f64, high: f64) -> bool {
        let load = |fraction: f64| norm(&self.leg.pressure_kpa(fraction));
        let scale = load(0.0).max(load(1.0));
        (load(high) - load(low)).abs() > LOCATED * scale && high - low > LOCATED
    }

    fn note_loss(&mut self, fraction: f64, negative_pivots: usize) {
        self.loss = Some(LossOfUniqueness {
            leg: self.leg.index,
            fraction: self.leg.of_schedule(fraction),
            pressure_kpa: self.leg.pressure_kpa(fraction),
            negative_pivots,
        });
    }
}

fn difference(a: &[[f64; 2]], b: &[[f64; 2]], scale: f64) -> Vec<[f64; 2]> {
    let apart = |(a, b): (&[f64; 2], &[f64; 2])| [scale * (a[0] - b[0]), scale * (a[1] - b[1])];
    a.iter().zip(b).map(apart).collect()
}

//! The cavity area leads and the load follows: through hard passages, and to the limits of the load.
//!
//! The area is the conjugate q of the leg's load. Along the branch dl/dq = 1 / (f . K^-1 f): positive on the way up, zero
//! at a limit point, where K is singular but the bordered system is not. Each step enlarges q by what the tangent
//! predictor gives within a cap.

use super::load_path::{LimitPoint, StateVisitor};
use super::newton::Held;
use super::observer::{Observer, Phase};
use super::status::{LimitKind, NotConverged, PathEnd};
use super::tracker::{Place, Tracker, norm};

/// Size of the first step.
const FIRST_STEP: f64 = 0.1;
/// Largest size of a step.
const LARGEST_STEP: f64 = 0.35;
/// Smallest size of a step.
const LEAST_STEP: f64 = 1e-4;
/// Factorisations of a lead that makes no way.
const MOST_FACTORISATIONS: usize = 200;
/// Part of the leg that is way.
const WAY: f64 = 1e-4;
/// The load of a snap where the area leads no further, as a part of the leg.
const SHORT_SNAP: f64 = 1e-3;
/// Steps of one lead.
const MOST_STEPS: usize = 400;
/// A limit point is located when its load is known to this share.
const LOAD_ACCURACY: f64 = 0.005;
/// Secants to a limit point, and the slope dl/dq there as a share of that at the last state before.
const MOST_SECANTS: usize = 30;
const LIMIT_SLOPE: f64 = 1e-8;
/// Averaged stretch beyond which a flat load-stretch curve is an asymptote.
const ASYMPTOTE_STRETCH: f64 = 6.0;
/// d ln(load) / d ln(stretch) of a flat curve.
const ASYMPTOTE_SLOPE: f64 = 0.05;

impl Tracker<'_> {
    /// Leads by the cavity area towards a fraction of the leg: `true` where it was reached, `false` where the load may lead
    /// again.
    pub fn lead_by_area(
        &mut self,
        target: f64,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<bool, PathEnd> {
        let only = self.settings.control == super::Control::CavityArea;
        let leg = self.leg.clone();
        let begin = self.at.fraction;
        let mut size = FIRST_STEP;
        let mut slope = None;
        let mut most = self.work.factorisations + MOST_FACTORISATIONS;
        for _ in 0..MOST_STEPS {
            observer.enter(Phase::Factorisation);
            let (mut du, compliance) = self.tangent_direction();
            let rate = self.system.gradient_size(&du);
            if !rate.is_finite() || compliance == 0.0 {
                return Err(self.failed());
            }
            let mut change = compliance.signum() * size / rate;
            let remaining = target - self.at.fraction;
            let before = self.at.clone();
            let mut state = before.state.clone();
            let last = change >= remaining;
            if last {
                change = remaining;
            }
            du.iter_mut().flatten().for_each(|d| *d *= change);
            let held = if last {
                Held::Load {
                    leg: &leg,
                    fraction: target,
                }
            } else {
                let mut moved = before.state.clone();
                for (u, d) in moved.u.iter_mut().zip(&du) {
                    u[0] += d[0];
                    u[1] += d[1];
                }
                Held::Area {
                    leg: &leg,
                    fraction: before.fraction + change,
                    conjugate: self.system.conjugate(&moved, leg.rate()),
                }
            };
            let negative = self.negative;
            let solved = self.solve(&mut state, before.least_j, &du, held, observer)?;
            let Some(solved) = solved.filter(|s| s.fraction < target || last) else {
                size *= 0.4;
                self.work.load_cuts += 1;
                self.negative = negative;
                self.return_to(before, observer);
                if size < LEAST_STEP || self.work.factorisations > most {
                    // A few elements, at a corner, may snap without a trace in the area.
                    if !self.beyond && self.snap(SHORT_SNAP, target, visitor, observer)? {
                        return Ok(self.at.fraction >= target);
                    }
                    return Err(self.failed());
                }
                continue;
            };
            self.accept(state, solved, observer);
            if (self.at.fraction - before.fraction).abs() > WAY {
                most = self.work.factorisations + MOST_FACTORISATIONS;
            }
            if last {
                self.settle(&before, &du, solved, observer)?;
                return Ok(true);
            }
            self.work.inserted_states += 1;
            let (_, compliance) = self.tangent_direction();
            let (from, to) = (slope.unwrap_or(1.0 / compliance.abs()), 1.0 / compliance);
            let conjugates = [
                self.system.conjugate(&before.state, leg.rate()),
                self.system.conjugate(&self.at.state, leg.rate()),
            ];
            if to < 0.0 {
                let width = conjugates[1] - conjugates[0];
                let peak = peak([before.fraction, self.at.fraction], [from, to], width);
                let load = |fraction: f64| norm(&leg.pressure_kpa(fraction));
                let known = load(before.fraction).max(load(self.at.fraction));
                if (load(peak) - known).abs() <= LOAD_ACCURACY * load(peak) || size < 1e-3 {
                    let end = self.limit(LimitKind::LimitPoint, peak, None);
                    if visitor.wants_limit_points() {
                        let bracket = [(conjugates[0], from), (conjugates[1], to)];
                        return Err(self
                            .refine(&before, bracket, visitor, observer)?
                            .unwrap_or(end));
                    }
                    self.at = before;
                    return Err(end);
                }
                size *= 0.3;
                self.return_to(before, observer);
                continue;
            }
            if self.negative > 0 {
                self.settle(&before, &du, solved, observer)?;
                return Ok(false);
            }
            slope = Some(to);
            observer.enter(Phase::Measures);
            let stretch = visitor.stretch(self.system, &self.at.state);
            self.note(stretch);
            if let Some(end) = self.asymptote() {
                return Err(end);
            }
            let step = self.at.fraction - before.fraction;
            if !only && self.at.fraction - begin > 0.02 && step > 0.01 && rate * step < LARGEST_STEP
            {
                self.suggested = 2.0 * step;
                return Ok(false);
            }
            size = (1.5 * size).min(LARGEST_STEP);
        }
        Err(self.failed())
    }

    /// Solves dl/dq = 0 between two conjugates with slopes of either sign by the secant method, shows the limit point to the
    /// visitor, and returns to the place before.
    fn refine(
        &mut self,
        before: &Place,
        mut bracket: [(f64, f64); 2],
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<Option<PathEnd>, NotConverged> {
        let leg = self.leg.clone();
        let scale = bracket[0].1.abs();
        let mut found = None;
        let mut kept = None;
        for _ in 0..MOST_SECANTS {
            let [(q0, s0), (q1, s1)] = bracket;
            let conjugate = (q0 + (q1 - q0) * s0 / (s0 - s1)).clamp(q0.min(q1), q0.max(q1));
            let mut state = self.at.state.clone();
            let (direction, compliance) = self.tangent_direction();
            let here = self.system.conjugate(&state, leg.rate());
            let change = (conjugate - here) / compliance;
            let du: Vec<_> = direction
                .iter()
                .map(|d| [change * d[0], change * d[1]])
                .collect();
            let held = Held::Area {
                leg: &leg,
                fraction: self.at.fraction + change,
                conjugate,
            };
            let solved = self.solve(&mut state, self.at.least_j, &du, held, observer)?;
            let Some(solved) = solved else { break };
            self.accept(state, solved, observer);
            let slope = 1.0 / self.tangent_direction().1;
            if slope.abs() < LIMIT_SLOPE * scale {
                found = Some(self.limit(LimitKind::LimitPoint, self.at.fraction, None));
                break;
            }
            // Illinois' rule: an end that is kept twice in a row counts half.
            let side = usize::from(slope < 0.0);
            bracket[side] = (conjugate, slope);
            if kept == Some(1 - side) {
                bracket[1 - side].1 *= 0.5;
            }
            kept = Some(1 - side);
        }
        if found.is_some()
            && let Some(mode) = self.nearest_mode()
        {
            visitor.limit_point(LimitPoint {
                system: self.system,
                state: &self.at.state,
                load: &leg.load(self.at.fraction),
                mode: &mode,
                rate: leg.rate(),
                span: leg.span(),
            });
        }
        self.at = before.clone();
        Ok(found)
    }

    /// The asymptote, where the last two states show one.
    pub fn asymptote(&self) -> Option<PathEnd> {
        let [(p0, s0), (p1, s1)] = self.history;
        if !(p0 > 0.0 && p1 > p0 && s1 > s0 && s1 > ASYMPTOTE_STRETCH) {
            return None;
        }
        let flat = (p1 / p0).ln() / (s1 / s0).ln() < ASYMPTOTE_SLOPE;
        // A balloon's pressure approaches its asymptote as 1 / stretch^2.
        let beyond = 1.0 + (p1 - p0) / p1 / ((s1 / s0).powi(2) - 1.0);
        let tends_to = self.pressure_kpa().iter().map(|p| p * beyond).collect();
        flat.then(|| self.limit(LimitKind::Asymptote, self.at.fraction, Some(tends_to)))
    }
}

/// The largest value of the cubic with these end values and slopes on an interval of this width.
fn peak(value: [f64; 2], slope: [f64; 2], width: f64) -> f64 {
    let at = |t: f64| {
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * value[0]
            + (t3 - 2.0 * t2 + t) * width * slope[0]
            + (3.0 * t2 - 2.0 * t3) * value[1]
            + (t3 - t2) * width * slope[1]
    };
    (0..=64)
        .map(|k| at(k as f64 / 64.0))
        .fold(f64::NEG_INFINITY, f64::max)
}

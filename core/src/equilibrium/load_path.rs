//! The path through the fixed states of the schedule, with adaptive steps between them.
//!
//! From each accepted state a tangent predictor leads to the next one; a step whose predictor is larger than
//! [`Settings::predictor_cap`] is shortened, one whose Newton solve fails is halved. The tangent is factorised once at
//! every accepted state: that factor serves the predictor, the count of negative pivots and the adjoint.

use super::newton::{Converged, Newton, Settings};
use super::observer::{Observer, Phase};
use super::status::{Limit, LimitKind, NotConverged, PathEnd, PathWork};
use crate::actuation::{ActuationCycle, ActuationPoint};
use crate::assembly::{Load, State, System, Workspace};
use crate::linear::{Factor, Solver};

/// A converged state of the path, with the factor of its tangent in `solver`.
pub struct AcceptedState<'a> {
    /// Index in the path.
    pub index: usize,
    /// Its place in the schedule.
    pub point: &'a ActuationPoint,
    /// The system.
    pub system: &'a System,
    /// The state.
    pub state: &'a State,
    /// The load.
    pub load: &'a Load,
    /// Holds the factor of the tangent at this state.
    pub solver: &'a mut Solver,
    /// Residual over the force scale.
    pub residual: f64,
    /// Smallest J.
    pub least_j: f64,
    /// Negative pivots of the tangent.
    pub negative_pivots: usize,
}

/// Sees the states of the path as they are accepted.
pub trait StateVisitor {
    /// A state of the path; returns the largest stretch of the state, for the verdict on limits.
    fn accepted(&mut self, state: AcceptedState<'_>, observer: &mut dyn Observer) -> f64;

    /// The largest stretch of a state that is not of the path.
    fn stretch(&mut self, system: &System, state: &State) -> f64;
}

/// Averaged stretch beyond which a flat load-stretch curve is an asymptote.
const ASYMPTOTE_STRETCH: f64 = 6.0;
/// d ln(load) / d ln(stretch) of a flat curve.
const ASYMPTOTE_SLOPE: f64 = 0.05;

/// Load of channel pressures in kPa; `largest` is each channel's largest absolute value in the schedule.
fn load(pressure_kpa: &[f64], largest: &[f64]) -> Load {
    Load {
        pressure: pressure_kpa.iter().map(|p| p * 1e-3).collect(),
        share: pressure_kpa
            .iter()
            .zip(largest)
            .map(|(p, m)| if *m > 0.0 { p / m } else { 0.0 })
            .collect(),
    }
}

/// Follows the whole schedule. Returns how it ended, the work, and (leg + fraction) / legs of the last converged state.
pub fn follow(
    system: &System,
    solver: &mut Solver,
    cycle: &ActuationCycle,
    settings: &Settings,
    visitor: &mut dyn StateVisitor,
    observer: &mut dyn Observer,
) -> (PathEnd, PathWork, f64) {
    let mut path = Path::new(system, solver, cycle, settings);
    let end = path.run(cycle, visitor, observer);
    let reached = (path.leg as f64 + path.fraction) / cycle.legs().max(1) as f64;
    (end, path.work, reached)
}

struct Path<'a> {
    system: &'a System,
    solver: &'a mut Solver,
    settings: &'a Settings,
    largest: Vec<f64>,
    force_floor: f64,
    work: PathWork,
    vectors: Workspace,
    state: State,
    load: Load,
    leg: usize,
    fraction: f64,
    /// Step as a fraction of a leg that the last solves suggest.
    suggested: f64,
    /// Size of the last predictor per fraction of a leg.
    rate: f64,
    unstable: bool,
    /// Last two (norm of load, stretch).
    history: [(f64, f64); 2],
}

impl<'a> Path<'a> {
    fn new(
        system: &'a System,
        solver: &'a mut Solver,
        cycle: &ActuationCycle,
        settings: &'a Settings,
    ) -> Self {
        let largest: Vec<f64> = (0..cycle.channels())
            .map(|c| {
                cycle
                    .rows_kpa
                    .iter()
                    .fold(0.0_f64, |m, row| m.max(row[c].abs()))
            })
            .collect();
        let force_floor = cycle
            .rows_kpa
            .iter()
            .map(|row| system.reference_force(&load(row, &largest)))
            .fold(0.0, f64::max)
            * 0.1;
        Self {
            // A schedule that moves supports only has no external force; then reactions alone are the scale.
            force_floor: force_floor.max(f64::MIN_POSITIVE),
            state: system.rest(),
            vectors: system.workspace(),
            load: load(&cycle.rows_kpa[0], &largest),
            system,
            solver,
            settings,
            largest,
            work: PathWork::default(),
            leg: 0,
            fraction: 0.0,
            suggested: 1.0,
            rate: 0.0,
            unstable: false,
            history: [(0.0, 1.0); 2],
        }
    }

    fn run(
        &mut self,
        cycle: &ActuationCycle,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> PathEnd {
        observer.enter(Phase::Assembly);
        self.system
            .assemble(&mut self.state, &self.load, true, true, &mut self.vectors);
        observer.enter(Phase::Factorisation);
        let negative = self.factorise_accepted();
        if negative > 0 {
            return PathEnd::NotConverged(NotConverged::NotHeld { negative });
        }
        let points = cycle.path();
        self.visit(0, &points[0], 0.0, 1.0, visitor, observer);
        for (index, point) in points.iter().enumerate().skip(1) {
            if point.leg != self.leg {
                self.leg = point.leg;
                self.fraction = 0.0;
            }
            match self.advance_to(cycle, point, visitor, observer) {
                Ok((residual, least_j)) => {
                    self.visit(index, point, residual, least_j, visitor, observer);
                }
                Err(end) => return end,
            }
        }
        PathEnd::Complete
    }

    fn visit(
        &mut self,
        index: usize,
        point: &ActuationPoint,
        residual: f64,
        least_j: f64,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) {
        let negative_pivots = match self.solver.factor() {
            Factor::Indefinite { negative } => negative,
            _ => 0,
        };
        let stretch = visitor.accepted(
            AcceptedState {
                index,
                point,
                system: self.system,
                state: &self.state,
                load: &self.load,
                solver: self.solver,
                residual,
                least_j,
                negative_pivots,
            },
            observer,
        );
        self.note(stretch);
    }

    fn note(&mut self, stretch: f64) {
        let size = self.load.pressure.iter().map(|p| p * p).sum::<f64>().sqrt();
        self.history = [self.history[1], (size, stretch)];
    }

    /// Factorises the tangent in the workspace as that of the accepted state; the count of its negative pivots.
    fn factorise_accepted(&mut self) -> usize {
        self.work.factorisations += 1;
        let negative = if self.solver.factorise(&self.vectors.tangent) {
            0
        } else {
            self.work.factorisations += 1;
            self.solver.factorise_indefinite(&self.vectors.tangent)
        };
        self.unstable = negative > 0;
        negative
    }

    /// Goes to a point of the present leg, in as many steps as it takes.
    fn advance_to(
        &mut self,
        cycle: &ActuationCycle,
        point: &ActuationPoint,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<(f64, f64), PathEnd> {
        let mut last_failure = (0.0, 0);
        loop {
            let remaining = point.fraction - self.fraction;
            let mut step = remaining.min(self.suggested);
            if step > 0.6 * remaining && step < remaining {
                step = 0.5 * remaining;
            }
            observer.enter(Phase::Factorisation);
            let (mut du, size) = self.predict(cycle, step);
            if size.is_finite() && size > self.settings.predictor_cap {
                let scale = 0.9 * self.settings.predictor_cap / size;
                step *= scale;
                du.iter_mut().flatten().for_each(|d| *d *= scale);
            }
            self.rate = size.min(self.settings.predictor_cap) / step.max(f64::MIN_POSITIVE);
            if step < self.settings.least_step.min(0.5 * remaining) {
                return Err(self.verdict(point, last_failure));
            }
            let whole = step >= remaining * (1.0 - 1e-12);
            let target = if whole {
                point.fraction
            } else {
                self.fraction + step
            };
            let next = load(&cycle.pressure_kpa(self.leg, target), &self.largest);
            let before = (self.state.clone(), self.load.clone());
            self.system.advance(&mut self.state, &du);
            self.load = next;
            let load_now = self.load.clone();
            let outcome = Newton {
                system: self.system,
                solver: self.solver,
                settings: self.settings,
                force_floor: self.force_floor,
                work: &mut self.work,
                observer,
            }
            .solve(&mut self.state, &load_now, self.unstable, &mut self.vectors)
            .map_err(PathEnd::NotConverged)?;
            match outcome {
                Converged::Yes { residual, least_j } => {
                    // The independent pressures lag behind p(u) by a square of the last step times K: the tangent of the
                    // state itself has p(u).
                    observer.enter(Phase::Assembly);
                    self.system
                        .assemble(&mut self.state, &load_now, true, true, &mut self.vectors);
                    observer.enter(Phase::Factorisation);
                    self.factorise_accepted();
                    self.fraction = target;
                    self.suggested = (2.0 * step).max(self.suggested).min(1.0);
                    if whole {
                        return Ok((residual, least_j));
                    }
                    self.suggested = 1.5 * step;
                    self.work.inserted_states += 1;
                    observer.enter(Phase::Measures);
                    let stretch = visitor.stretch(self.system, &self.state);
                    self.note(stretch);
                    if let Some(end) = self.asymptote(point) {
                        return Err(end);
                    }
                }
                Converged::No {
                    residual,
                    iterations,
                } => {
                    last_failure = (residual, iterations);
                    self.work.load_cuts += 1;
                    (self.state, self.load) = before;
                    self.suggested = 0.4 * step;
                    self.restore_factor(observer);
                }
            }
        }
    }

    /// Newton's iterations overwrote the factor of the last accepted state: build it again.
    fn restore_factor(&mut self, observer: &mut dyn Observer) {
        observer.enter(Phase::Assembly);
        let mut again = self.state.clone();
        self.system
            .assemble(&mut again, &self.load, true, true, &mut self.vectors);
        observer.enter(Phase::Factorisation);
        self.factorise_accepted();
    }

    /// Tangent predictor for a step of the present leg: displacement increment and its size.
    fn predict(&mut self, cycle: &ActuationCycle, step: f64) -> (Vec<[f64; 2]>, f64) {
        let target = (self.fraction + step).min(1.0);
        let next = load(&cycle.pressure_kpa(self.leg, target), &self.largest);
        let mut change = vec![[0.0; 2]; self.system.body.mesh.nodes.len()];
        self.system
            .external_change(&self.state, &self.load, &next, &mut change);
        let mut du = vec![[0.0; 2]; change.len()];
        if let Some(moved) = self.prescribed_change(&next) {
            // K u_prescribed by a difference of residuals: a predictor need not be exact.
            let epsilon = 1e-6;
            let mut probe = self.state.clone();
            for (u, m) in probe.u.iter_mut().zip(&moved) {
                u[0] += epsilon * m[0];
                u[1] += epsilon * m[1];
            }
            let load_now = self.load.clone();
            self.system
                .assemble(&mut self.state, &load_now, true, false, &mut self.vectors);
            let at_rest = self.vectors.residual.clone();
            self.system
                .assemble(&mut probe, &load_now, true, false, &mut self.vectors);
            for ((c, r), r0) in change.iter_mut().zip(&self.vectors.residual).zip(&at_rest) {
                for i in 0..2 {
                    c[i] -= (r[i] - r0[i]) / epsilon;
                }
            }
            du = moved;
        }
        let mut unknowns = vec![0.0; self.system.dofs.free()];
        self.system.dofs.gather(&change, &mut unknowns);
        self.solver.solve(&mut unknowns, 1);
        self.system.dofs.add_to_field(1.0, &unknowns, &mut du);
        let size = self.system.gradient_size(&du);
        (du, size)
    }

    /// Change of the prescribed displacements towards a load, where there is any.
    fn prescribed_change(&self, next: &Load) -> Option<Vec<[f64; 2]>> {
        let mut moved: Option<Vec<[f64; 2]>> = None;
        for s in &self.system.body.supports {
            let change = s.displacement_mm * (next.share[s.channel] - self.load.share[s.channel]);
            if change != 0.0 {
                moved.get_or_insert_with(|| vec![[0.0; 2]; self.system.body.mesh.nodes.len()])
                    [s.node as usize][s.component as usize] += change;
            }
        }
        moved
    }

    fn asymptote(&self, point: &ActuationPoint) -> Option<PathEnd> {
        let [(p0, s0), (p1, s1)] = self.history;
        let flat = p0 > 0.0 && s1 > s0 && ((p1 / p0).ln() / (s1 / s0).ln()) < ASYMPTOTE_SLOPE;
        (s1 > ASYMPTOTE_STRETCH && flat).then(|| self.limit(LimitKind::Asymptote, point))
    }

    fn limit(&self, kind: LimitKind, point: &ActuationPoint) -> PathEnd {
        PathEnd::NoEquilibrium(Limit {
            kind,
            leg: point.leg,
            fraction: self.fraction,
            pressure_kpa: self.load.pressure.iter().map(|p| p * 1e3).collect(),
        })
    }

    /// No step of the smallest length succeeds. A limit point shows by a predictor that a hundredth of the load would
    /// make larger than any admissible step; everything else is a failure of ours.
    fn verdict(&self, point: &ActuationPoint, (residual, iterations): (f64, usize)) -> PathEnd {
        if let Some(end) = self.asymptote(point) {
            return end;
        }
        if self.rate * 0.01 > self.settings.predictor_cap {
            return self.limit(LimitKind::LimitPoint, point);
        }
        PathEnd::NotConverged(NotConverged::Newton {
            leg: point.leg,
            fraction: self.fraction,
            residual,
            iterations,
        })
    }
}

//! The path through the fixed states of the schedule.

use super::leg::Leg;
use super::newton::Settings;
use super::observer::{Observer, Phase};
use super::status::{LostMargin, NotConverged, PathEnd, PathReport};
use super::tracker::Tracker;
use crate::actuation::{ActuationCycle, ActuationPoint};
use crate::assembly::{Load, State, System};
use crate::linear::Solver;

/// A converged state of the path; `solver` holds the factor of its tangent, or of one that is as good where the visitor
/// does not want exact ones.
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
    /// Holds the factor.
    pub solver: &'a mut Solver,
    /// Residual over the force scale.
    pub residual: f64,
    /// Smallest J.
    pub least_j: f64,
    /// Negative pivots of the tangent.
    pub negative_pivots: usize,
    /// Whether contact acts.
    pub contact_acts: bool,
}

/// Sees the states of the path as they are accepted.
pub trait StateVisitor {
    /// A state of the path; returns the largest stretch of the state, for the verdict on limits.
    fn accepted(&mut self, state: AcceptedState<'_>, observer: &mut dyn Observer) -> f64;

    /// The largest stretch of a state that is not of the path.
    fn stretch(&mut self, system: &System, state: &State) -> f64;

    /// A stable state at the load margin beyond a row of the schedule; `index` and `point` are those of the row.
    fn margin(&mut self, _state: AcceptedState<'_>, _observer: &mut dyn Observer) {}

    /// Whether the solver must hold the factor of the accepted state itself, for adjoints; else one of a state that no
    /// stability verdict tells from it may do.
    fn wants_exact_factors(&self) -> bool {
        false
    }

    /// Whether limit points are to be found to the solver's tolerance, for [`Self::limit_point`].
    fn wants_limit_points(&self) -> bool {
        false
    }

    /// A limit point of the load.
    fn limit_point(&mut self, _point: LimitPoint<'_>) {}
}

/// A limit point of the load.
pub struct LimitPoint<'a> {
    /// The system.
    pub system: &'a System,
    /// The state, with a singular tangent.
    pub state: &'a State,
    /// The load.
    pub load: &'a Load,
    /// The null vector of the tangent.
    pub mode: &'a [[f64; 2]],
    /// Change of the load over the leg.
    pub rate: &'a Load,
    /// Length of the leg in fractions of the schedule's leg.
    pub span: f64,
}

/// Follows the whole schedule.
pub fn follow(
    system: &System,
    solver: &mut Solver,
    cycle: &ActuationCycle,
    settings: &Settings,
    visitor: &mut dyn StateVisitor,
    observer: &mut dyn Observer,
) -> PathReport {
    let mut tracker = Tracker::new(system, solver, cycle, settings);
    let end = match tracker.run(cycle, visitor, observer) {
        Ok(()) => match &tracker.solver.failed_extension {
            None => PathEnd::Complete,
            Some(why) => NotConverged::Analysis {
                detail: why.to_string(),
            }
            .into(),
        },
        Err(end) => end,
    };
    let reached = tracker.leg.of_schedule(tracker.at.fraction).min(1.0);
    PathReport {
        end,
        work: tracker.work,
        reached: (tracker.leg.index as f64 + reached) / cycle.legs().max(1) as f64,
        loss: tracker.loss,
        lost_margin: tracker.lost_margin,
    }
}

impl Tracker<'_> {
    fn run(
        &mut self,
        cycle: &ActuationCycle,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<(), PathEnd> {
        self.exact_factors = visitor.wants_exact_factors();
        self.factorise(observer);
        if self.negative > 0 {
            return Err(NotConverged::NotHeld {
                negative: self.negative,
            }
            .into());
        }
        for (index, point) in cycle.path().iter().enumerate() {
            if point.leg != self.leg.index {
                self.leg = Leg::of(cycle, point.leg, &self.largest);
                self.at.fraction = 0.0;
            }
            if index > 0 {
                self.advance_to(point.fraction, visitor, observer)?;
            }
            self.visit(index, point, visitor, observer);
            let loaded = point.pressure_kpa.iter().any(|p| *p != 0.0);
            if let Some(factor) = self.settings.load_margin
                && point.fraction == 1.0
                && loaded
                && self.lost_margin.is_none()
            {
                self.try_margin(cycle, index, point, factor, visitor, observer)?;
            }
        }
        Ok(())
    }

    /// Goes on beyond a row of the schedule to the load margin, and returns.
    fn try_margin(
        &mut self,
        cycle: &ActuationCycle,
        index: usize,
        point: &ActuationPoint,
        factor: f64,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) -> Result<(), PathEnd> {
        let (place, suggested, history) = (self.at.clone(), self.suggested, self.history);
        let inserted = self.work.inserted_states;
        self.beyond = true;
        self.leg = Leg::beyond(cycle, point.leg, factor, &self.largest);
        self.at.fraction = 0.0;
        let went = self.advance_to(1.0, visitor, observer);
        let reached = 1.0 + (factor - 1.0) * self.at.fraction;
        match went {
            Ok(()) => {
                let load = self.leg.load(1.0);
                let state = self.accepted(index, point, &load);
                visitor.margin(state, observer);
            }
            Err(PathEnd::NotConverged(
                why @ (NotConverged::Cancelled | NotConverged::WorkLimit { .. }),
            )) => return Err(why.into()),
            Err(end) => {
                self.lost_margin = Some(LostMargin {
                    leg: point.leg,
                    factor: match &end {
                        PathEnd::NoEquilibrium(limit) => limit.fraction,
                        _ => reached,
                    },
                    end,
                });
            }
        }
        self.beyond = false;
        (self.suggested, self.history) = (suggested, history);
        self.work.inserted_states = inserted;
        self.leg = Leg::of(cycle, point.leg, &self.largest);
        self.return_to(place, observer);
        Ok(())
    }

    fn visit(
        &mut self,
        index: usize,
        point: &ActuationPoint,
        visitor: &mut dyn StateVisitor,
        observer: &mut dyn Observer,
    ) {
        observer.enter(Phase::Measures);
        let load = self.leg.load(self.at.fraction);
        let stretch = visitor.accepted(self.accepted(index, point, &load), observer);
        self.note(stretch);
    }

    fn accepted<'b>(
        &'b mut self,
        index: usize,
        point: &'b ActuationPoint,
        load: &'b Load,
    ) -> AcceptedState<'b> {
        AcceptedState {
            index,
            point,
            system: self.system,
            state: &self.at.state,
            load,
            solver: self.solver,
            residual: self.at.residual,
            least_j: self.at.least_j,
            negative_pivots: self.negative,
            contact_acts: self.vectors.contact_acts,
        }
    }
}

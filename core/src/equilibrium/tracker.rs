//! The state that is led along the path, with the factor of its tangent.

use super::leg::{Leg, load};
use super::newton::{Held, Newton, Settings, Solved};
use super::observer::{Observer, Phase};
use super::status::{
    Limit, LimitKind, LossOfUniqueness, LostMargin, NotConverged, PathEnd, PathWork,
};
use super::uniqueness::Bend;
use crate::actuation::ActuationCycle;
use crate::assembly::{Load, State, System, Workspace};
use crate::linear::Solver;

/// Size of a displacement that a stability verdict does not see: a few hundredths of a leg, as a loss of uniqueness is
/// located.
const SAME_STATE: f64 = 0.02;

/// A place on the path to which the tracker can return.
#[derive(Clone)]
pub(super) struct Place {
    pub state: State,
    pub fraction: f64,
    pub least_j: f64,
    pub residual: f64,
}

pub(super) struct Tracker<'a> {
    pub system: &'a System,
    pub solver: &'a mut Solver,
    pub settings: &'a Settings,
    pub largest: Vec<f64>,
    force_floor: f64,
    pub work: PathWork,
    pub vectors: Workspace,
    pub leg: Leg,
    /// The accepted state.
    pub at: Place,
    /// Negative pivots of its tangent, whose factor is in `solver`.
    pub negative: usize,
    /// The displacements of the tangent whose factor is in `solver`, where they are not those of the accepted state.
    pub factored_at: Vec<[f64; 2]>,
    /// Whether the factor must be that of the accepted state itself.
    pub exact_factors: bool,
    /// Step as a fraction of a leg that the last solves suggest.
    pub suggested: f64,
    /// Last two (norm of the pressures, stretch).
    pub history: [(f64, f64); 2],
    /// The first loss of uniqueness.
    pub loss: Option<LossOfUniqueness>,
    /// The first bend of the path.
    pub bend: Option<Bend>,
    /// Recent places of this leg.
    pub trail: Vec<Bend>,
    /// Whether the path goes beyond a row of the schedule, to the load margin.
    pub beyond: bool,
    /// The first load margin that was not reached.
    pub lost_margin: Option<LostMargin>,
    /// Damped motions so far that came to no rest.
    pub failed_snaps: usize,
    /// Searches for a second equilibrium so far.
    pub searches: usize,
    /// Those of them by a damped motion.
    pub damped_searches: usize,
}

impl<'a> Tracker<'a> {
    pub fn new(
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
        // A schedule that moves supports or obstacles only has no external force; then reactions alone are the scale, and before
        // an obstacle or another part is met there are none: then what surfaces do that meet.
        let of_contact = system.contact.as_ref().map_or(f64::MIN_POSITIVE, |c| {
            c.law.pressure_mpa * c.law.activation_mm
        });
        Self {
            force_floor: if force_floor > 0.0 {
                force_floor
            } else {
                of_contact
            },
            at: Place {
                state: system.rest(),
                fraction: 0.0,
                least_j: 1.0,
                residual: 0.0,
            },
            vectors: system.workspace(),
            leg: Leg::of(cycle, 0, &largest),
            system,
            solver,
            settings,
            largest,
            work: PathWork::default(),
            negative: 0,
            exact_factors: false,
            factored_at: Vec::new(),
            suggested: 1.0,
            history: [(0.0, 1.0); 2],
            loss: None,
            bend: None,
            trail: Vec::new(),
            beyond: false,
            lost_margin: None,
            failed_snaps: 0,
            searches: 0,
            damped_searches: 0,
        }
    }

    /// Solves from `state` moved by `first`; the accepted state stays where it is.
    pub fn solve(
        &mut self,
        state: &mut State,
        least_j: f64,
        first: &[[f64; 2]],
        held: Held<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Solved>, NotConverged> {
        let start = self.without_contact(state);
        let solved = self
            .newton(observer)
            .solve(state, least_j, first, held)?
            .solved();
        let leg = match held {
            Held::Load { leg, .. } | Held::LoadNearest { leg, .. } | Held::Area { leg, .. } => leg,
        };
        if self.must_repeat(state, solved.map(|s| leg.load(s.fraction)), start, observer) {
            return Ok(self
                .newton(observer)
                .solve(state, least_j, first, held)?
                .solved());
        }
        Ok(solved)
    }

    /// A copy of the state from which is started, where contact is left out so far.
    fn without_contact(&self, state: &State) -> Option<State> {
        (self.system.contact.is_some() && !self.vectors.contact_acts).then(|| state.clone())
    }

    /// Whether surfaces touch at a state that was found without contact: then contact acts from now on, and the state is again
    /// what it was at the start, where none touched.
    fn must_repeat(
        &mut self,
        state: &mut State,
        load: Option<Load>,
        start: Option<State>,
        observer: &mut dyn Observer,
    ) -> bool {
        let (Some(start), Some(load)) = (start, load) else {
            return false;
        };
        observer.enter(Phase::Contact);
        if !self.system.is_touching(state, &load) {
            return false;
        }
        self.vectors.contact_acts = true;
        *state = start;
        true
    }

    /// Follows a damped motion to a stable state at a fraction of the leg, from `state` moved by `first`.
    pub fn relax(
        &mut self,
        state: &mut State,
        least_j: f64,
        first: Option<&[[f64; 2]]>,
        fraction: f64,
        observer: &mut dyn Observer,
    ) -> Result<Option<Solved>, NotConverged> {
        let leg = self.leg.clone();
        let start = self.without_contact(state);
        let solved = self
            .newton(observer)
            .relax(state, least_j, first, &leg, fraction)?
            .solved();
        if self.must_repeat(state, solved.map(|s| leg.load(s.fraction)), start, observer) {
            return Ok(self
                .newton(observer)
                .relax(state, least_j, first, &leg, fraction)?
                .solved());
        }
        Ok(solved)
    }

    fn newton<'b>(&'b mut self, observer: &'b mut dyn Observer) -> Newton<'b> {
        Newton {
            system: self.system,
            solver: self.solver,
            settings: self.settings,
            force_floor: self.force_floor,
            work: &mut self.work,
            vectors: &mut self.vectors,
            observer,
            load_before: self.leg.load(self.at.fraction),
            shift: 0.0,
            factored_at: &mut self.factored_at,
        }
    }

    /// Makes a solved state the accepted one, with the factor of its tangent; one of a state less than [`SAME_STATE`] away
    /// is as good for a predictor and for the count of negative pivots, unless `exact_factors` are wanted.
    ///
    /// The independent pressures lag behind p(u) by a square of the last step times K: the tangent of the state itself
    /// has p(u).
    pub fn accept(&mut self, state: State, solved: Solved, observer: &mut dyn Observer) {
        self.at = Place {
            state,
            fraction: solved.fraction,
            least_j: solved.least_j,
            residual: solved.residual,
        };
        if self.exact_factors || solved.from_factor > SAME_STATE {
            self.factorise(observer);
        } else {
            self.negative = 0;
        }
    }

    /// Returns to a place and builds its factor again.
    pub fn return_to(&mut self, place: Place, observer: &mut dyn Observer) {
        self.at = place;
        self.factorise(observer);
    }

    /// Factorises the tangent of the accepted state and counts its negative pivots.
    pub fn factorise(&mut self, observer: &mut dyn Observer) {
        observer.enter(Phase::Assembly);
        self.factored_at.clear();
        let load = self.leg.load(self.at.fraction);
        self.system
            .assemble(&mut self.at.state, &load, true, true, &mut self.vectors);
        observer.enter(Phase::Factorisation);
        self.work.factorisations += 1;
        self.negative = if self.system.factorise(self.solver, &self.vectors) {
            0
        } else {
            self.work.factorisations += 1;
            self.system.factorise_indefinite(self.solver, &self.vectors)
        };
    }

    /// Displacement per unit of the leg's fraction, K^-1 f, as unknowns and as a field, with f . K^-1 f.
    pub fn tangent_direction(&mut self) -> (Vec<[f64; 2]>, f64) {
        let mut forces = vec![[0.0; 2]; self.system.body.mesh.nodes.len()];
        self.system
            .add_forces(&self.at.state, self.leg.rate(), &mut forces);
        let mut f = vec![0.0; self.system.dofs.free()];
        self.system.dofs.gather(&forces, &mut f);
        let mut a = f.clone();
        self.solver.solve(&mut a, 1);
        let compliance = f.iter().zip(&a).map(|(f, a)| f * a).sum();
        let mut field = vec![[0.0; 2]; forces.len()];
        self.system.dofs.add_to_field(1.0, &a, &mut field);
        (field, compliance)
    }

    /// Pressures at the accepted state, kPa.
    pub fn pressure_kpa(&self) -> Vec<f64> {
        self.leg.pressure_kpa(self.at.fraction)
    }

    pub fn note(&mut self, stretch: f64) {
        let size = norm(&self.pressure_kpa());
        self.history = [self.history[1], (size, stretch)];
    }

    /// The limit at a fraction of the leg.
    pub fn limit(
        &self,
        kind: LimitKind,
        fraction: f64,
        asymptote_kpa: Option<Vec<f64>>,
    ) -> PathEnd {
        PathEnd::NoEquilibrium(Limit {
            kind,
            leg: self.leg.index,
            fraction: self.leg.of_schedule(fraction),
            pressure_kpa: self.leg.pressure_kpa(fraction),
            asymptote_kpa,
        })
    }

    /// A failure at the accepted state.
    pub fn failed(&self) -> PathEnd {
        PathEnd::NotConverged(NotConverged::Newton {
            leg: self.leg.index,
            fraction: self.leg.of_schedule(self.at.fraction),
            residual: self.at.residual,
            iterations: self.settings.max_iterations,
        })
    }
}

pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

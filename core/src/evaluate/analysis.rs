//! One finite-element analysis: the path, what is measured at its states, and the derivatives that are wanted.
//!
//! What is not wanted is not allocated, not computed and not paid for.

use super::contact::ContactState;
use super::limits::{Extrema, Extremum, Limits};
use super::measure::{PathMeasure, Quantity, Sensitivities};
use crate::actuation::{ActuationCycle, ActuationPoint};
use crate::adjoint::{self, NodeGradient};
use crate::assembly::{FoldedReference, State, System};
use crate::constraint::walls::{Crossing, Walls};
use crate::equilibrium::{
    AcceptedState, LimitPoint, LossOfUniqueness, LostMargin, Observer, PathEnd, PathReport,
    PathWork, Phase, Settings, StateVisitor, follow,
};
use crate::force::cavity_pressure;
use crate::linear::AnalysisFailed;
use crate::material::MaterialLaw;
use crate::mesh::Discretisation;
use crate::objective::probe::ProbePoint;

/// What is wanted of an analysis.
#[derive(Clone, Debug, Default)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "independent outputs, each asked for by name"
)]
pub struct Wanted {
    /// Measures whose derivatives are wanted.
    pub gradients_of: Vec<PathMeasure>,
    /// Radius of the averaging disc of the stretch, mm; `None` leaves the stretch out.
    pub stretch_radius: Option<f64>,
    /// Smooth minimum of the gaps between the walls of each channel's voids.
    pub wall_gaps: bool,
    /// Derivatives of the smooth extrema of the stretch and of the gaps over the path.
    pub limit_gradients: bool,
    /// Crossings of walls.
    pub walls: bool,
    /// Least gaps.
    pub gaps: bool,
    /// Displacement fields of all states of the path.
    pub fields: bool,
}

/// What is measured at a state of the path.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Place in the schedule.
    pub point: ActuationPoint,
    /// Displacement of each probe, mm.
    pub displacement: Vec<[f64; 2]>,
    /// Area per channel, mm^2.
    pub cavity_area: Vec<f64>,
    /// Largest averaged stretch; 1 where it is left out.
    pub max_stretch: f64,
    /// Largest stretch at a quadrature point.
    pub max_stretch_raw: f64,
    /// Largest averaged stretch in the solid of each material law; empty where the stretch is left out.
    pub stretch_by_law: Vec<f64>,
    /// Least gap, mm.
    pub min_gap: Option<f64>,
    /// First crossing that was found.
    pub crossing: Option<Crossing>,
    /// Negative pivots.
    pub negative_pivots: usize,
    /// Residual over the force scale.
    pub residual: f64,
    /// Smallest J.
    pub min_jacobian: f64,
    /// Contact, where surfaces act on each other.
    pub contact: Option<ContactState>,
}

/// An analysis.
pub struct Analysis {
    /// The system, for its counts and its body.
    pub system: System,
    /// How the path ended.
    pub end: PathEnd,
    /// Work.
    pub work: PathWork,
    /// (leg + fraction) / legs of the last converged state.
    pub reached: f64,
    /// The first loss of uniqueness that was met.
    pub loss: Option<LossOfUniqueness>,
    /// States of the path that were reached.
    pub states: Vec<Measured>,
    /// Derivatives of the numbers of which the wanted measures are made.
    pub sensitivities: Sensitivities,
    /// Smooth maximum of the averaged stretch over the path, and its derivative, per region of the solid; empty where it
    /// is left out.
    pub stretch: Vec<Extremum>,
    /// Smooth maximum of the averaged stretch over the states at the load margin, and its derivative, per region.
    pub margin: Vec<Extremum>,
    /// Largest averaged stretch at the load margin, where it was reached.
    pub margin_stretch: Option<f64>,
    /// The first load margin that was not reached.
    pub lost_margin: Option<LostMargin>,
    /// Derivative of the last limit point's load, in fractions of its leg.
    pub limit_gradient: Option<NodeGradient>,
    /// Smooth minimum of the gaps over the path, mm, and its derivative, per channel; empty where it is left out.
    pub wall_gap: Vec<Extremum>,
    /// Displacement fields per state.
    pub fields: Vec<Vec<[f64; 2]>>,
}

/// A body that cannot be analysed at all.
#[derive(Debug, thiserror::Error)]
pub enum CannotAnalyse {
    /// An element of the reference shape is folded.
    #[error(transparent)]
    Folded(#[from] FoldedReference),
    /// The symbolic analysis failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisFailed),
}

/// Analyses a body over a schedule.
pub fn analyse(
    body: Discretisation,
    laws: &[MaterialLaw],
    cycle: &ActuationCycle,
    probes: &[ProbePoint],
    settings: &Settings,
    wanted: &Wanted,
    observer: &mut dyn Observer,
) -> Result<Analysis, CannotAnalyse> {
    observer.enter(Phase::SetUp);
    let system = System::new(body, laws)?;
    let mut solver = system.solver()?;
    let mut recorder = Recorder::new(&system, probes, cycle.channels(), wanted);
    let PathReport {
        end,
        work,
        reached,
        loss,
        lost_margin,
    } = follow(
        &system,
        &mut solver,
        cycle,
        settings,
        &mut recorder,
        observer,
    );
    let Recorder {
        states,
        sensitivities,
        fields,
        limits,
        margin_stretch,
        limit_gradient,
        ..
    } = recorder;
    let Extrema {
        stretch,
        margin,
        wall_gap,
    } = limits.finish();
    Ok(Analysis {
        system,
        end,
        work,
        reached,
        loss,
        states,
        sensitivities,
        stretch,
        margin,
        margin_stretch,
        lost_margin,
        limit_gradient,
        wall_gap,
        fields,
    })
}

/// The contact of a state, where surfaces act on each other.
fn contact_state(accepted: &AcceptedState<'_>) -> Option<ContactState> {
    if !accepted.contact_acts {
        return None;
    }
    let touches = accepted.system.touches(accepted.state, accepted.load)?;
    (touches.pairs > 0).then(|| ContactState {
        least_distance_mm: touches.least_distance_mm,
        penetration_mm: accepted.system.penetration(accepted.state, accepted.load),
        pressure_mpa: touches.pressure_mpa,
        energy: touches.energy,
        on_obstacle: touches.on_obstacle,
    })
}

/// Measures the accepted states.
struct Recorder<'a> {
    probes: &'a [ProbePoint],
    channels: usize,
    wanted: &'a Wanted,
    limits: Limits,
    walls: Option<Walls>,
    states: Vec<Measured>,
    sensitivities: Sensitivities,
    fields: Vec<Vec<[f64; 2]>>,
    crossed: bool,
    margin_stretch: Option<f64>,
    limit_gradient: Option<NodeGradient>,
}

impl<'a> Recorder<'a> {
    fn new(system: &System, probes: &'a [ProbePoint], channels: usize, wanted: &'a Wanted) -> Self {
        let need_walls = wanted.walls || wanted.gaps;
        Self {
            probes,
            channels,
            wanted,
            limits: Limits::new(system, channels, wanted),
            walls: need_walls.then(|| Walls::new(&system.body.boundary, &system.body.mesh.nodes)),
            states: Vec::new(),
            sensitivities: Sensitivities::default(),
            fields: Vec::new(),
            crossed: false,
            margin_stretch: None,
            limit_gradient: None,
        }
    }

    /// The derivatives of all numbers of this state on which a wanted measure depends, solved together.
    fn add_sensitivities(&mut self, accepted: &mut AcceptedState<'_>) {
        let mut quantities: Vec<Quantity> = Vec::new();
        for measure in &self.wanted.gradients_of {
            for quantity in measure.quantities(accepted.index) {
                if !quantities.contains(&quantity) {
                    quantities.push(quantity);
                }
            }
        }
        let functionals = quantities
            .iter()
            .map(|q| q.functional(accepted, self.probes))
            .collect();
        let derivatives = adjoint::of_functionals(accepted, functionals);
        for (quantity, derivative) in quantities.into_iter().zip(derivatives) {
            self.sensitivities
                .push(accepted.index, quantity, derivative);
        }
    }
}

impl StateVisitor for Recorder<'_> {
    fn accepted(&mut self, mut accepted: AcceptedState<'_>, observer: &mut dyn Observer) -> f64 {
        observer.enter(Phase::Measures);
        let system = accepted.system;
        let (x, u) = (&system.body.mesh.nodes, &accepted.state.u);
        let stretch = self.limits.stretch(system, u);
        let (max_stretch, max_stretch_raw) = stretch
            .as_ref()
            .map_or((1.0, 1.0), |s| (s.largest(), s.largest_pointwise()));
        // Once walls have crossed, later states of the path add nothing to the verdict, unless it was but a fold.
        let crossing = match &self.walls {
            Some(walls) if self.wanted.walls && !self.crossed => walls.crossing(x, u),
            _ => None,
        };
        self.crossed |= crossing.is_some_and(|c| !c.corner_fold);
        let min_gap = match &self.walls {
            Some(walls) if self.wanted.gaps => walls.least_gap(x, u),
            _ => None,
        };
        let mut cavity_area = vec![0.0; self.channels];
        let deformed = adjoint::deformed(x, u);
        for cavity in &system.body.cavities {
            cavity_area[cavity.channel] += cavity_pressure::area(cavity, &deformed);
        }
        self.states.push(Measured {
            point: accepted.point.clone(),
            displacement: self.probes.iter().map(|p| p.displacement(u)).collect(),
            cavity_area,
            max_stretch,
            max_stretch_raw,
            stretch_by_law: stretch
                .as_ref()
                .map_or_else(Vec::new, |s| self.limits.stretch_by_law(s)),
            min_gap,
            crossing,
            negative_pivots: accepted.negative_pivots,
            residual: accepted.residual,
            min_jacobian: accepted.least_j,
            contact: contact_state(&accepted),
        });
        if self.wanted.fields {
            self.fields.push(u.clone());
        }
        observer.enter(Phase::Adjoint);
        self.add_sensitivities(&mut accepted);
        self.limits.add(&mut accepted, stretch.as_ref());
        max_stretch
    }

    fn margin(&mut self, mut accepted: AcceptedState<'_>, observer: &mut dyn Observer) {
        observer.enter(Phase::Measures);
        let stretch = self.limits.add_margin(&mut accepted);
        self.margin_stretch = stretch
            .into_iter()
            .chain(self.margin_stretch)
            .reduce(f64::max);
    }

    fn wants_exact_factors(&self) -> bool {
        self.wanted.limit_gradients || !self.wanted.gradients_of.is_empty()
    }

    fn wants_limit_points(&self) -> bool {
        self.wanted.limit_gradients
    }

    fn limit_point(&mut self, point: LimitPoint<'_>) {
        self.limit_gradient = Some(adjoint::of_limit_point(&point));
    }

    fn stretch(&mut self, system: &System, state: &State) -> f64 {
        self.limits
            .stretch(system, &state.u)
            .map_or(1.0, |s| s.largest())
    }
}

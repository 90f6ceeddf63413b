//! The limits of a study over the whole path: stretch and gaps as smooth extrema, with their derivatives.

use super::analysis::Wanted;
use crate::adjoint::{self, Functional, NodeGradient};
use crate::assembly::System;
use crate::constraint::gap::{Gaps, NodalDerivative, RHO_GAP};
use crate::constraint::stretch::{RHO, StretchMeasure, StretchState};
use crate::equilibrium::AcceptedState;

/// A smooth extremum over the path and, where it is wanted, its derivative with respect to the nodes.
pub type Extremum = (f64, Option<NodeGradient>);

/// Gathers the limits as the states of the path come.
pub(super) struct Limits {
    measure: Option<StretchMeasure>,
    gaps: Option<Gaps>,
    gradients: bool,
    /// Stretch per region.
    hottest: Vec<SmoothMaximum>,
    /// Stretch per region at the load margin beyond the rows of the schedule.
    at_margin: Vec<SmoothMaximum>,
    /// Negative gap per channel.
    closest: Vec<SmoothMaximum>,
}

/// The limits of a path.
#[derive(Default)]
pub(super) struct Extrema {
    /// Stretch per region.
    pub stretch: Vec<Extremum>,
    /// Stretch per region at the load margin.
    pub margin: Vec<Extremum>,
    /// Gap per channel.
    pub wall_gap: Vec<Extremum>,
}

impl Limits {
    pub(super) fn new(system: &System, channels: usize, wanted: &Wanted) -> Self {
        let measure = wanted
            .stretch_radius
            .map(|r| StretchMeasure::new(system, r));
        let regions = measure.as_ref().map_or(0, StretchMeasure::regions);
        // The voids of an actuator follow its outline, in the order of the cavities.
        let gaps = wanted.wall_gaps.then(|| {
            let loops = &system.body.boundary;
            let voids = loops[loops.len() - system.body.cavities.len()..].iter();
            Gaps::new(voids, &system.body.mesh.nodes)
        });
        let channels = if gaps.is_some() { channels } else { 0 };
        Self {
            hottest: vec![SmoothMaximum::new(RHO); regions],
            at_margin: vec![SmoothMaximum::new(RHO); regions],
            closest: vec![SmoothMaximum::new(RHO_GAP); channels],
            gradients: wanted.limit_gradients,
            measure,
            gaps,
        }
    }

    /// The averaged stretches of a state, where they are wanted.
    pub(super) fn stretch(&self, system: &System, u: &[[f64; 2]]) -> Option<StretchState> {
        self.measure.as_ref().map(|m| m.at_state(system, u))
    }

    /// Largest averaged stretch in the solid of each material law.
    pub(super) fn stretch_by_law(&self, stretch: &StretchState) -> Vec<f64> {
        self.measure
            .as_ref()
            .map_or_else(Vec::new, |m| m.largest_by_law(stretch))
    }

    /// Adds an accepted state with its stretches.
    pub(super) fn add(&mut self, accepted: &mut AcceptedState<'_>, stretch: Option<&StretchState>) {
        // Values first: which derivatives can be seen is known before any is computed.
        let system = accepted.system;
        let mut functionals = Vec::new();
        let mut owners = Vec::new();
        let mut values = Vec::new();
        if let (Some(measure), Some(state)) = (&self.measure, stretch) {
            for (region, value) in measure.smooth_maxima(state).into_iter().enumerate() {
                if self.gradients && self.hottest[region].matters(value) {
                    let points = measure.sensitivities(state, region, value);
                    functionals.push(Functional::of_points(accepted, &points));
                    owners.push(values.len());
                }
                values.push((Limit::Stretch(region), value));
            }
        }
        if let Some(gaps) = &self.gaps {
            let x = &system.body.mesh.nodes;
            let voids = gaps.at_state(x, &accepted.state.u);
            for channel in 0..self.closest.len() {
                // All voids of a channel together are one functional, so that many units cost no more solves than one.
                let mut of_channel = SmoothMaximum::new(RHO_GAP);
                let own = |void: &usize| system.body.cavities[*void].channel == channel;
                if !(0..voids.len()).any(|void| own(&void)) {
                    continue;
                }
                for void in (0..voids.len()).filter(own) {
                    of_channel.add(-voids[void].gap, None);
                }
                let (value, _) = of_channel.finish();
                if self.gradients && self.closest[channel].matters(value) {
                    let mut sum = Functional {
                        u: vec![[0.0; 2]; x.len()],
                        x: vec![[0.0; 2]; x.len()],
                    };
                    for void in (0..voids.len()).filter(own) {
                        let weight = (RHO_GAP * (-voids[void].gap - value)).exp();
                        let NodalDerivative { u, x } = gaps.derivative(void, &voids[void], x);
                        add_scaled(&mut sum.u, weight, &u);
                        add_scaled(&mut sum.x, weight, &x);
                    }
                    functionals.push(sum);
                    owners.push(values.len());
                }
                values.push((Limit::Gap(channel), -value));
            }
        }
        let mut gradients = vec![None; values.len()];
        for (owner, gradient) in owners
            .into_iter()
            .zip(adjoint::of_functionals(accepted, functionals))
        {
            gradients[owner] = Some(gradient.nodes);
        }
        for ((limit, value), gradient) in values.into_iter().zip(gradients) {
            match limit {
                Limit::Stretch(region) => self.hottest[region].add(value, gradient),
                Limit::Gap(channel) => self.closest[channel].add(-value, gradient.map(negative)),
            }
        }
    }

    /// Adds a state at the load margin; its largest averaged stretch.
    pub(super) fn add_margin(&mut self, accepted: &mut AcceptedState<'_>) -> Option<f64> {
        let measure = self.measure.as_ref()?;
        let state = measure.at_state(accepted.system, &accepted.state.u);
        let values = measure.smooth_maxima(&state);
        let seen: Vec<usize> = (0..values.len())
            .filter(|&region| self.gradients && self.at_margin[region].matters(values[region]))
            .collect();
        let functional = |&region: &usize| {
            let points = measure.sensitivities(&state, region, values[region]);
            Functional::of_points(accepted, &points)
        };
        let functionals = seen.iter().map(functional).collect();
        let mut gradients = vec![None; values.len()];
        for (region, gradient) in seen
            .into_iter()
            .zip(adjoint::of_functionals(accepted, functionals))
        {
            gradients[region] = Some(gradient.nodes);
        }
        for ((sum, value), gradient) in self.at_margin.iter_mut().zip(values).zip(gradients) {
            sum.add(value, gradient);
        }
        Some(state.largest())
    }

    /// The extrema over the path.
    pub(super) fn finish(self) -> Extrema {
        let gap = |m: SmoothMaximum| {
            let (value, gradient) = m.finish();
            (-value, gradient.map(negative))
        };
        let all = |sums: Vec<SmoothMaximum>| sums.into_iter().map(SmoothMaximum::finish).collect();
        Extrema {
            stretch: all(self.hottest),
            margin: all(self.at_margin),
            wall_gap: self.closest.into_iter().map(gap).collect(),
        }
    }
}

#[derive(Clone, Copy)]
enum Limit {
    Stretch(usize),
    Gap(usize),
}

fn add_scaled(sum: &mut NodeGradient, weight: f64, of: &NodeGradient) {
    for (s, v) in sum.iter_mut().zip(of) {
        s[0] += weight * v[0];
        s[1] += weight * v[1];
    }
}

fn negative(mut gradient: NodeGradient) -> NodeGradient {
    gradient.iter_mut().flatten().for_each(|g| *g = -*g);
    gradient
}

/// ln(sum exp(rho v_s)) / rho over the states' values v_s and its derivative, summed as the states come. Of the smooth
/// minimum of gaps it holds the negatives.
#[derive(Clone)]
struct SmoothMaximum {
    rho: f64,
    largest: f64,
    sum: f64,
    gradient: Option<NodeGradient>,
}

impl SmoothMaximum {
    fn new(rho: f64) -> Self {
        Self {
            rho,
            largest: 0.0,
            sum: 0.0,
            gradient: None,
        }
    }

    /// Whether the derivative of a state of this value can be seen beside that of the largest so far: its weight there is
    /// above 1e-11.
    fn matters(&self, value: f64) -> bool {
        self.sum == 0.0 || self.rho * (value - self.largest) > -25.0
    }

    fn add(&mut self, value: f64, gradient: Option<NodeGradient>) {
        if self.sum == 0.0 {
            self.largest = value;
        }
        if value > self.largest {
            let scale = (self.rho * (self.largest - value)).exp();
            self.sum *= scale;
            self.gradient
                .iter_mut()
                .flatten()
                .flatten()
                .for_each(|v| *v *= scale);
            self.largest = value;
        }
        let weight = (self.rho * (value - self.largest)).exp();
        self.sum += weight;
        if let Some(gradient) = gradient {
            let sum = self
                .gradient
                .get_or_insert_with(|| vec![[0.0; 2]; gradient.len()]);
            add_scaled(sum, weight, &gradient);
        }
    }

    fn finish(self) -> (f64, Option<NodeGradient>) {
        if self.sum == 0.0 {
            return (0.0, None);
        }
        let gradient = self.gradient.map(|mut g| {
            g.iter_mut().flatten().for_each(|v| *v /= self.sum);
            g
        });
        (self.largest + self.sum.ln() / self.rho, gradient)
    }
}

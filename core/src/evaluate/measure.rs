//! Measures over a path: their values, and their derivatives from those of the numbers that they are made of.
//!
//! Every measure is a function of displacement components of probes and of chamber areas at states of the path. The adjoint
//! gives the derivatives of these numbers where their state is accepted, whose factor is there then; what a measure makes of
//! them is known once the path is complete.

use super::analysis::Measured;
use crate::adjoint::{Derivative, Functional, NodeGradient};
use crate::equilibrium::AcceptedState;
use crate::geometry::Point;
use crate::objective::probe::ProbePoint;
use crate::objective::{bending_angle, enclosed_area, tip_path};
use crate::scene::{Measure, Orientation, Probe};

/// A probe of an analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedProbe {
    /// Index among the probes of the analysis.
    pub index: usize,
    /// Its place, mm.
    pub at_mm: Point,
}

/// A measure whose probes are those of an analysis.
pub type PathMeasure = Measure<PlacedProbe>;

/// Finds the probe of a place.
pub fn by_place(probes: &[Probe]) -> impl Fn(&Point) -> Option<PlacedProbe> {
    move |at| placed(probes, |p| p.at_mm == *at)
}

/// Finds the probe of a name.
pub fn by_name(probes: &[Probe]) -> impl Fn(&String) -> Option<PlacedProbe> {
    move |name| placed(probes, |p| p.name == *name)
}

fn placed(probes: &[Probe], is: impl Fn(&Probe) -> bool) -> Option<PlacedProbe> {
    let index = probes.iter().position(is)?;
    let at_mm = probes[index].at_mm;
    Some(PlacedProbe { index, at_mm })
}

/// A number of one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// A displacement component of a probe, mm.
    Displacement {
        /// Index of the probe.
        probe: usize,
        /// 0 for x, 1 for y.
        component: usize,
    },
    /// Deformed area of a channel's chambers, mm^2.
    ChamberArea {
        /// The channel.
        channel: usize,
    },
}

impl Quantity {
    /// As a functional of an accepted state.
    pub fn functional(self, accepted: &AcceptedState<'_>, probes: &[ProbePoint]) -> Functional {
        match self {
            Self::Displacement { probe, component } => {
                Functional::of_probe(accepted, &probes[probe], component)
            }
            Self::ChamberArea { channel } => Functional::of_chamber_area(accepted, channel),
        }
    }
}

/// A number of a state and the weight of its derivative.
pub type Weight = (usize, Quantity, f64);

impl PathMeasure {
    /// The numbers of a state that it depends on.
    pub fn quantities(&self, at: usize) -> Vec<Quantity> {
        let both = |probe: &PlacedProbe| {
            [0, 1].map(|component| Quantity::Displacement {
                probe: probe.index,
                component,
            })
        };
        match self {
            Self::EnclosedArea { probe, .. } | Self::TipPath { probe, .. } => both(probe).into(),
            Self::Displacement {
                probe,
                direction,
                state,
            } if *state == at => {
                let parts = both(probe).into_iter().zip(direction);
                parts.filter(|(_, d)| **d != 0.0).map(|(q, _)| q).collect()
            }
            Self::BendingAngle { probes, state } if *state == at => {
                probes.iter().flat_map(both).collect()
            }
            Self::ChamberArea {
                channel,
                state,
                change,
            } if *state == at || (*change && at == 0) => {
                vec![Quantity::ChamberArea { channel: *channel }]
            }
            _ => Vec::new(),
        }
    }

    /// Its value over a complete path.
    pub fn value(&self, states: &[Measured]) -> f64 {
        match self {
            Self::EnclosedArea { probe, orientation } => {
                area_sign(*orientation) * enclosed_area::area(&tip_displacements(states, *probe))
            }
            Self::Displacement {
                probe,
                direction,
                state,
            } => {
                let [x, y] = unit(*direction);
                let u = states[*state].displacement[probe.index];
                x * u[0] + y * u[1]
            }
            Self::BendingAngle { probes, state } => {
                let lines: Vec<_> = states[..=*state].iter().map(|s| line(probes, s)).collect();
                bending_angle::angle_deg(reference_line(probes), &lines)
            }
            Self::TipPath { probe, points_mm } => {
                let (tips, targets) = follow(states, *probe, points_mm);
                tip_path::mean_square(&tips, &targets)
            }
            Self::ChamberArea {
                channel,
                state,
                change,
            } => {
                let rest = if *change {
                    states[0].cavity_area[*channel]
                } else {
                    0.0
                };
                states[*state].cavity_area[*channel] - rest
            }
        }
    }

    /// Its derivatives with respect to the numbers of a complete path.
    pub fn weights(&self, states: &[Measured]) -> Vec<Weight> {
        let of_tip = |probe: &PlacedProbe, gradient: Vec<[f64; 2]>, factor: f64| {
            let probe = probe.index;
            let at = move |(state, g): (usize, [f64; 2])| {
                [0, 1].map(|component| {
                    let quantity = Quantity::Displacement { probe, component };
                    (state, quantity, factor * g[component])
                })
            };
            gradient.into_iter().enumerate().flat_map(at).collect()
        };
        match self {
            Self::EnclosedArea { probe, orientation } => {
                let gradient = enclosed_area::gradient(&tip_displacements(states, *probe));
                of_tip(probe, gradient, area_sign(*orientation))
            }
            Self::TipPath { probe, points_mm } => {
                let (tips, targets) = follow(states, *probe, points_mm);
                of_tip(probe, tip_path::gradient(&tips, &targets), 1.0)
            }
            Self::Displacement {
                probe,
                direction,
                state,
            } => components(probe.index, *state, unit(*direction)).into(),
            Self::BendingAngle { probes, state } => {
                let g = bending_angle::gradient(line(probes, &states[*state]));
                let from = components(probes[0].index, *state, g.map(|v| -v));
                let to = components(probes[1].index, *state, g);
                [from, to].concat()
            }
            Self::ChamberArea {
                channel,
                state,
                change,
            } => {
                let quantity = Quantity::ChamberArea { channel: *channel };
                let mut weights = vec![(*state, quantity, 1.0)];
                if *change {
                    weights.push((0, quantity, -1.0));
                }
                weights
            }
        }
    }
}

/// Derivatives of numbers, as they come with their states.
#[derive(Default)]
pub struct Sensitivities(Vec<(usize, Quantity, Derivative)>);

impl Sensitivities {
    /// Adds one.
    pub fn push(&mut self, state: usize, quantity: Quantity, derivative: Derivative) {
        self.0.push((state, quantity, derivative));
    }

    fn of(&self, state: usize, quantity: Quantity) -> Option<&Derivative> {
        let is_it = |(s, q, _): &&(usize, Quantity, Derivative)| (*s, *q) == (state, quantity);
        self.0.iter().find(is_it).map(|(.., derivative)| derivative)
    }

    /// The derivative by the nodes of what has these weights; `None` where one of its numbers has none.
    pub fn combine(&self, weights: &[Weight]) -> Option<NodeGradient> {
        let mut total: Option<NodeGradient> = None;
        for (state, quantity, weight) in weights.iter().filter(|(.., w)| *w != 0.0) {
            let gradient = &self.of(*state, *quantity)?.nodes;
            let total = total.get_or_insert_with(|| vec![[0.0; 2]; gradient.len()]);
            for (t, g) in total.iter_mut().zip(gradient) {
                t[0] += weight * g[0];
                t[1] += weight * g[1];
            }
        }
        let nodes = self.0.first().map(|(.., d)| d.nodes.len())?;
        Some(total.unwrap_or_else(|| vec![[0.0; 2]; nodes]))
    }

    /// The same by the logarithm of a factor on all pressures.
    pub fn combine_pressure(&self, weights: &[Weight]) -> Option<f64> {
        let weighted = |(state, quantity, weight): &Weight| {
            Some(weight * self.of(*state, *quantity)?.pressure)
        };
        weights
            .iter()
            .filter(|(.., w)| *w != 0.0)
            .map(weighted)
            .sum()
    }
}

/// Displacements of a probe over the path, mm.
pub fn tip_displacements(states: &[Measured], probe: PlacedProbe) -> Vec<[f64; 2]> {
    states.iter().map(|s| s.displacement[probe.index]).collect()
}

fn area_sign(orientation: Orientation) -> f64 {
    match orientation {
        Orientation::CounterClockwise => 1.0,
        Orientation::Clockwise => -1.0,
    }
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    [x / length, y / length]
}

fn components(probe: usize, state: usize, weight: [f64; 2]) -> [Weight; 2] {
    [0, 1].map(|component| {
        let quantity = Quantity::Displacement { probe, component };
        (state, quantity, weight[component])
    })
}

fn reference_line([a, b]: &[PlacedProbe; 2]) -> [f64; 2] {
    [b.at_mm[0] - a.at_mm[0], b.at_mm[1] - a.at_mm[1]]
}

fn line(probes: &[PlacedProbe; 2], state: &Measured) -> [f64; 2] {
    let [a, b] = [0, 1].map(|k| state.displacement[probes[k].index]);
    let reference = reference_line(probes);
    std::array::from_fn(|i| reference[i] + b[i] - a[i])
}

/// Where the probe is over the path, and where it should be.
fn follow(
    states: &[Measured],
    probe: PlacedProbe,
    points: &[Point],
) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let tips = tip_displacements(states, probe).into_iter();
    let tips = tips.map(|u| [probe.at_mm[0] + u[0], probe.at_mm[1] + u[1]]);
    let at: Vec<_> = states
        .iter()
        .map(|s| (s.point.leg, s.point.fraction))
        .collect();
    (tips.collect(), tip_path::targets(points, &at))
}

//! What can be aimed at or bounded: numbers over the path of an analysis, and how a target or a bound uses them.

use serde_json::{Map, Value, json};

use super::Orientation;
use crate::geometry::Point;

/// A number over the path. `P` says how probes are given: by name, by place, or by index.
#[derive(Clone, Debug, PartialEq)]
pub enum Measure<P> {
    /// The area that a probe's closed path encloses (Eq. 3), positive in the sense of `orientation`, mm^2.
    EnclosedArea {
        /// The probe.
        probe: P,
        /// The sense that counts as positive.
        orientation: Orientation,
    },
    /// Displacement of a probe along a direction, mm.
    Displacement {
        /// The probe.
        probe: P,
        /// The direction; its length does not matter.
        direction: [f64; 2],
        /// Index in the path.
        state: usize,
    },
    /// Rotation of the line from the first probe to the second, counter-clockwise positive, degrees. It is continued along
    /// the path from zero at rest, so that it may pass half a turn.
    BendingAngle {
        /// The ends of the line; on the end face they make this its bending angle.
        probes: [P; 2],
        /// Index in the path.
        state: usize,
    },
    /// Mean squared distance over the states of the path between a probe and the point where it should be, mm^2.
    TipPath {
        /// The probe.
        probe: P,
        /// Where it should be in space: a point for each row of the schedule, with straight lines between them, or one
        /// for each state of the path.
        points_mm: Vec<Point>,
    },
    /// Deformed area of a channel's chambers over all units, mm^2: per mm of depth the fluid that it holds.
    ChamberArea {
        /// The channel.
        channel: usize,
        /// Index in the path.
        state: usize,
        /// Whether the area at rest is taken off.
        change: bool,
    },
}

/// What a target does with its measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sense {
    /// The objective is the measure.
    Minimise,
    /// The objective is its negative.
    Maximise,
    /// The objective is the square of its distance from this value.
    Reach(f64),
}

/// A target: what is minimised.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal<P> {
    /// The number.
    pub measure: Measure<P>,
    /// What is done with it.
    pub sense: Sense,
}

/// A bound on a measure, one row of constraints per end.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound<P> {
    /// The number.
    pub measure: Measure<P>,
    /// Its least value.
    pub at_least: Option<f64>,
    /// Its largest value.
    pub at_most: Option<f64>,
}

impl<P> Measure<P> {
    /// The same measure with its probes given otherwise; `None` where one of them cannot be.
    pub fn map_probes<Q>(&self, mut give: impl FnMut(&P) -> Option<Q>) -> Option<Measure<Q>> {
        Some(match self {
            Self::EnclosedArea { probe, orientation } => Measure::EnclosedArea {
                probe: give(probe)?,
                orientation: *orientation,
            },
            Self::Displacement {
                probe,
                direction,
                state,
            } => Measure::Displacement {
                probe: give(probe)?,
                direction: *direction,
                state: *state,
            },
            Self::BendingAngle {
                probes: [a, b],
                state,
            } => Measure::BendingAngle {
                probes: [give(a)?, give(b)?],
                state: *state,
            },
            Self::TipPath { probe, points_mm } => Measure::TipPath {
                probe: give(probe)?,
                points_mm: points_mm.clone(),
            },
            Self::ChamberArea {
                channel,
                state,
                change,
            } => Measure::ChamberArea {
                channel: *channel,
                state: *state,
                change: *change,
            },
        })
    }

    /// The same measure over a path of as many legs with `to` states on each instead of `from`. `None` where it is of a state
    /// within a leg, or has a point for each state.
    #[must_use]
    pub fn with_load_steps(&self, legs: usize, from: usize, to: usize) -> Option<Self>
    where
        P: Clone,
    {
        let mut measure = self.clone();
        match &mut measure {
            Self::EnclosedArea { .. } => {}
            Self::TipPath { points_mm, .. } => {
                if points_mm.len() != legs + 1 {
                    return None;
                }
            }
            Self::Displacement { state, .. }
            | Self::BendingAngle { state, .. }
            | Self::ChamberArea { state, .. } => {
                if !state.is_multiple_of(from) {
                    return None;
                }
                *state = *state / from * to;
            }
        }
        Some(measure)
    }

    /// Its probes.
    pub fn probes(&self) -> Vec<&P> {
        match self {
            Self::EnclosedArea { probe, .. }
            | Self::Displacement { probe, .. }
            | Self::TipPath { probe, .. } => vec![probe],
            Self::BendingAngle { probes: [a, b], .. } => vec![a, b],
            Self::ChamberArea { .. } => Vec::new(),
        }
    }

    /// The one point that it follows, where there is one: the tip.
    pub fn tip(&self) -> Option<&P> {
        match self.probes()[..] {
            [tip] => Some(tip),
            _ => None,
        }
    }

    /// Its unit.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::EnclosedArea { .. } | Self::TipPath { .. } | Self::ChamberArea { .. } => {
                "mm\u{b2}"
            }
            Self::Displacement { .. } => "mm",
            Self::BendingAngle { .. } => "\u{b0}",
        }
    }

    /// What it is, in words.
    pub fn words(&self) -> String {
        match self {
            Self::EnclosedArea { orientation, .. } => match orientation {
                Orientation::CounterClockwise => "enclosed area, counter-clockwise".into(),
                Orientation::Clockwise => "enclosed area, clockwise".into(),
            },
            Self::Displacement {
                direction, state, ..
            } => {
                format!(
                    "displacement along ({}, {}) at state {state}",
                    direction[0], direction[1]
                )
            }
            Self::BendingAngle { state, .. } => format!("bending angle at state {state}"),
            Self::TipPath { .. } => "mean squared distance from the target path".into(),
            Self::ChamberArea {
                channel,
                state,
                change,
            } => format!(
                "{} of channel {channel} at state {state}",
                if *change {
                    "change of chamber area"
                } else {
                    "chamber area"
                }
            ),
        }
    }

    /// Its fields in a document; `name` gives a probe's form, and `suffix` ends the names of the fields that hold them.
    fn fields(&self, suffix: &str, name: impl Fn(&P) -> Value) -> Map<String, Value> {
        let mut map = Map::new();
        let mut put = |field: &str, value: Value| {
            map.insert(field.to_string(), value);
        };
        let one = format!("probe{suffix}");
        match self {
            Self::EnclosedArea { probe, orientation } => {
                put("kind", json!("enclosed_area"));
                put(&one, name(probe));
                put("orientation", json!(orientation));
            }
            Self::Displacement {
                probe,
                direction,
                state,
            } => {
                put("kind", json!("displacement"));
                put(&one, name(probe));
                match direction {
                    [1.0, 0.0] => put("component", json!("x")),
                    [0.0, 1.0] => put("component", json!("y")),
                    _ => put("direction", json!(direction)),
                }
                put("state", json!(state));
            }
            Self::BendingAngle {
                probes: [a, b],
                state,
            } => {
                put("kind", json!("bending_angle"));
                put(&format!("probes{suffix}"), json!([name(a), name(b)]));
                put("state", json!(state));
            }
            Self::TipPath { probe, points_mm } => {
                put("kind", json!("tip_path"));
                put(&one, name(probe));
                put("points_mm", json!(points_mm));
            }
            Self::ChamberArea {
                channel,
                state,
                change,
            } => {
                put("kind", json!("chamber_area"));
                put("channel", json!(channel));
                put("state", json!(state));
                put("change", json!(change));
            }
        }
        map
    }
}

impl<P> Goal<P> {
    /// The objective at a value of the measure, and its derivative there.
    pub fn objective(&self, value: f64) -> (f64, f64) {
        match self.sense {
            Sense::Minimise => (value, 1.0),
            Sense::Maximise => (-value, -1.0),
            Sense::Reach(wanted) => ((value - wanted).powi(2), 2.0 * (value - wanted)),
        }
    }

    /// The document that reads back to it.
    pub fn document(&self, suffix: &str, name: impl Fn(&P) -> Value) -> Map<String, Value> {
        let mut map = self.measure.fields(suffix, name);
        let sense = match (&self.measure, self.sense) {
            (_, Sense::Reach(wanted)) => Some(("reach", json!(wanted))),
            (Measure::EnclosedArea { .. } | Measure::TipPath { .. }, _) => None,
            (Measure::Displacement { .. }, Sense::Minimise) => Some(("sign", json!(1.0))),
            (Measure::Displacement { .. }, Sense::Maximise) => Some(("sign", json!(-1.0))),
            (_, Sense::Minimise) => Some(("sense", json!("minimise"))),
            (_, Sense::Maximise) => Some(("sense", json!("maximise"))),
        };
        map.extend(sense.map(|(field, value)| (field.to_string(), value)));
        map
    }

    /// What is minimised, in words.
    pub fn words(&self) -> String {
        let (what, unit) = (self.measure.words(), self.measure.unit());
        match self.sense {
            Sense::Minimise => format!("least {what} ({unit})"),
            Sense::Maximise => format!("largest {what} ({unit})"),
            Sense::Reach(wanted) => format!("{what} to reach {wanted} {unit}"),
        }
    }

    /// Unit of the objective.
    pub fn unit(&self) -> &'static str {
        match (self.sense, self.measure.unit()) {
            (Sense::Reach(_), "mm") => "mm\u{b2}",
            (Sense::Reach(_), "mm\u{b2}") => "mm\u{2074}",
            (Sense::Reach(_), _) => "\u{b0}\u{b2}",
            (_, unit) => unit,
        }
    }
}

impl<P> Bound<P> {
    /// Number of its rows.
    pub fn rows(&self) -> usize {
        usize::from(self.at_least.is_some()) + usize::from(self.at_most.is_some())
    }

    /// Its rows at a value of the measure, feasible when <= 0, each with its derivative: in shares of the bound, so that
    /// they are of order one, or in the measure's own unit where the bound is zero.
    pub fn values(&self, value: f64) -> impl Iterator<Item = (f64, f64)> {
        let row = move |bound: f64, sign: f64| {
            let scale = if bound == 0.0 { 1.0 } else { bound.abs() };
            (sign * (value - bound) / scale, sign / scale)
        };
        let least = self.at_least.map(|bound| row(bound, -1.0));
        let most = self.at_most.map(|bound| row(bound, 1.0));
        least.into_iter().chain(most)
    }

    /// The document that reads back to it.
    pub fn document(&self, suffix: &str, name: impl Fn(&P) -> Value) -> Map<String, Value> {
        let mut map = self.measure.fields(suffix, name);
        let ends = [("at_least", self.at_least), ("at_most", self.at_most)];
        let ends = ends.into_iter().filter_map(|(n, v)| Some((n, v?)));
        map.extend(ends.map(|(field, value)| (field.to_string(), json!(value))));
        map
    }

    /// What must hold, in words.
    pub fn words(&self) -> String {
        let unit = self.measure.unit();
        let least = self.at_least.map(|v| format!(" \u{2265} {v} {unit}"));
        let most = self.at_most.map(|v| format!(" \u{2264} {v} {unit}"));
        let ends: Vec<String> = least.into_iter().chain(most).collect();
        format!("{}{}", self.measure.words(), ends.join(" and"))
    }
}

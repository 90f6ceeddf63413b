//! Reads what scenes and studies say alike of targets and bounds: which measure, of which probes, at which state, and
//! what is done with it.

use super::Orientation;
use super::measure::{Bound, Goal, Measure, Sense};
use crate::actuation::ActuationCycle;
use crate::document::{Node, Object};

const MAX_POINTS: usize = 1_000_000;

/// How a document gives probes and senses.
pub struct MeasureReader<'a, P> {
    /// The ending of the fields that hold probes: nothing (names) or `_mm` (places).
    pub suffix: &'a str,
    /// Reads one probe.
    pub probe: &'a dyn Fn(&Node<'_>) -> Option<P>,
    /// Reads `orientation` of an enclosed area, where it is given.
    pub orientation: &'a dyn Fn(Option<Node<'_>>) -> Option<Orientation>,
    /// The schedule; without it any state is taken.
    pub actuation: Option<&'a ActuationCycle>,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    EnclosedArea,
    Displacement,
    BendingAngle,
    TipPath,
    ChamberArea,
}

/// Reads a sense that an analysis can count; `counter_clockwise` where none is given.
pub fn read_one_orientation(node: Option<Node<'_>>) -> Option<Orientation> {
    let Some(node) = node else {
        return Some(Orientation::CounterClockwise);
    };
    if node.value().as_str() == Some("either") {
        return node.fault("\"either\" is for the target of a study: here one sense counts");
    }
    node.choice(&[
        ("counter_clockwise", Orientation::CounterClockwise),
        ("clockwise", Orientation::Clockwise),
    ])
}

impl<P: PartialEq> MeasureReader<'_, P> {
    /// Reads a target.
    pub fn goal(&self, node: &Node<'_>) -> Option<Goal<P>> {
        let object = node.open()?;
        let kind = read_kind(&object)?;
        let senses: &[&str] = match kind {
            Kind::EnclosedArea | Kind::TipPath => &["reach"],
            Kind::Displacement => &["sign", "sense", "reach"],
            Kind::BendingAngle | Kind::ChamberArea => &["sense", "reach"],
        };
        let measure = self.measure(&object, kind, senses);
        let sense = read_sense(&object, kind, senses);
        Some(Goal {
            measure: measure?,
            sense: sense?,
        })
    }

    /// Reads a bound.
    pub fn bound(&self, node: &Node<'_>) -> Option<Bound<P>> {
        let object = node.open()?;
        let kind = read_kind(&object)?;
        let measure = self.measure(&object, kind, &["at_least", "at_most"]);
        let at_least = object.optional("at_least", Node::number);
        let at_most = object.optional("at_most", Node::number);
        let bound = Bound {
            measure: measure?,
            at_least: at_least?,
            at_most: at_most?,
        };
        match (bound.at_least, bound.at_most) {
            (None, None) => object.node().fault("needs at_least, at_most or both"),
            (Some(least), Some(most)) if least > most => {
                object.fault("at_most", format!("is below at_least, {least}"));
                None
            }
            _ => Some(bound),
        }
    }

    fn measure(&self, object: &Object<'_>, kind: Kind, others: &[&str]) -> Option<Measure<P>> {
        let (one, two) = (
            format!("probe{}", self.suffix),
            format!("probes{}", self.suffix),
        );
        let own: &[&str] = match kind {
            Kind::EnclosedArea => &["kind", &one, "orientation"],
            Kind::Displacement => &["kind", &one, "component", "direction", "state", "leg"],
            Kind::BendingAngle => &["kind", &two, "state", "leg"],
            Kind::TipPath => &["kind", &one, "points_mm"],
            Kind::ChamberArea => &["kind", "channel", "state", "leg", "change"],
        };
        object.allow(&[own, others].concat());
        let probe = || object.required(&one).and_then(|n| (self.probe)(&n));
        // Every field is read before the first missing one ends the reading.
        match kind {
            Kind::EnclosedArea => {
                let (probe, orientation) = (probe(), (self.orientation)(object.get("orientation")));
                Some(Measure::EnclosedArea {
                    probe: probe?,
                    orientation: orientation?,
                })
            }
            Kind::Displacement => {
                let (probe, direction, state) = (probe(), direction(object), self.state(object));
                Some(Measure::Displacement {
                    probe: probe?,
                    direction: direction?,
                    state: state?,
                })
            }
            Kind::BendingAngle => {
                let probes = object.required(&two).and_then(|n| {
                    let [a, b]: [P; 2] = n.each(2, 2, self.probe)?.try_into().ok()?;
                    n.expect(a != b, "a line needs two different points")?;
                    Some([a, b])
                });
                let state = self.state(object);
                Some(Measure::BendingAngle {
                    probes: probes?,
                    state: state?,
                })
            }
            Kind::TipPath => {
                let (probe, points_mm) = (probe(), self.points(object));
                Some(Measure::TipPath {
                    probe: probe?,
                    points_mm: points_mm?,
                })
            }
            Kind::ChamberArea => {
                let last = self.actuation.map_or(usize::MAX, |a| a.channels() - 1);
                let channel = object.required("channel").and_then(|n| n.count(0, last));
                let state = self.state(object);
                let change = object.or("change", false, Node::boolean);
                Some(Measure::ChamberArea {
                    channel: channel?,
                    state: state?,
                    change: change?,
                })
            }
        }
    }

    /// `state`, an index in the path, or `leg`, whose end it is.
    fn state(&self, object: &Object<'_>) -> Option<usize> {
        let Some(leg) = object.get("leg") else {
            return object.required("state").and_then(|n| self.index(&n));
        };
        if object.has("state") {
            object.fault("leg", "either state or leg, not both");
            return None;
        }
        let legs = self.actuation.map_or(usize::MAX, ActuationCycle::legs);
        let k = leg.count(0, MAX_POINTS)?;
        leg.expect(
            k < legs,
            &format!("leg {k} is out of the schedule, which has {legs}"),
        )?;
        Some((k + 1) * self.actuation.map_or(1, |a| a.load_steps_per_leg))
    }

    fn index(&self, node: &Node<'_>) -> Option<usize> {
        let state = node.count(0, usize::MAX)?;
        let last = self
            .actuation
            .map_or(usize::MAX, |a| a.legs() * a.load_steps_per_leg);
        node.expect(
            state <= last,
            &format!("state {state} is out of the path, whose last state is {last}"),
        )?;
        Some(state)
    }

    fn points(&self, object: &Object<'_>) -> Option<Vec<[f64; 2]>> {
        let node = object.required("points_mm")?;
        let points = node.each(2, MAX_POINTS, Node::pair)?;
        let Some(cycle) = self.actuation else {
            return Some(points);
        };
        let (rows, states) = (
            cycle.rows_kpa.len(),
            cycle.legs() * cycle.load_steps_per_leg + 1,
        );
        node.expect(
            points.len() == rows || points.len() == states,
            &format!(
                "expected {rows} points (one for each row of the schedule) or {states} (one for each state), found {}",
                points.len()
            ),
        )?;
        Some(points)
    }
}

fn read_kind(object: &Object<'_>) -> Option<Kind> {
    object.required("kind")?.choice(&[
        ("enclosed_area", Kind::EnclosedArea),
        ("displacement", Kind::Displacement),
        ("bending_angle", Kind::BendingAngle),
        ("tip_path", Kind::TipPath),
        ("chamber_area", Kind::ChamberArea),
    ])
}

/// `component` or `direction`.
fn direction(object: &Object<'_>) -> Option<[f64; 2]> {
    let Some(node) = object.get("direction") else {
        let axes = [("x", [1.0, 0.0]), ("y", [0.0, 1.0])];
        return object.required("component")?.choice(&axes);
    };
    if object.has("component") {
        object.fault("direction", "either component or direction, not both");
        return None;
    }
    let direction = node.pair()?;
    let length = direction[0].hypot(direction[1]);
    node.expect(
        length.is_finite() && length > 0.0,
        "a direction has a length above zero",
    )?;
    Some(direction)
}

/// `sense`, `reach`, or the `sign` of a displacement: at most one of them.
fn read_sense(object: &Object<'_>, kind: Kind, known: &[&str]) -> Option<Sense> {
    let given: Vec<&str> = known.iter().copied().filter(|n| object.has(n)).collect();
    let default = match kind {
        Kind::EnclosedArea => Some(Sense::Maximise),
        Kind::Displacement | Kind::TipPath => Some(Sense::Minimise),
        Kind::BendingAngle | Kind::ChamberArea => None,
    };
    match given[..] {
        [] if default.is_none() => object
            .node()
            .fault("needs sense (\"minimise\" or \"maximise\") or reach, a value to reach"),
        [] => default,
        ["reach"] => object.get("reach")?.number().map(Sense::Reach),
        ["sense"] => object
            .get("sense")?
            .choice(&[("minimise", Sense::Minimise), ("maximise", Sense::Maximise)]),
        ["sign"] => {
            let node = object.get("sign")?;
            let sign = node.number()?;
            node.expect(sign.abs() == 1.0, "must be 1 or -1")?;
            Some(if sign > 0.0 {
                Sense::Minimise
            } else {
                Sense::Maximise
            })
        }
        [_, second, ..] => {
            object.fault(
                second,
                format!("only one of {} may be given", given.join(", ")),
            );
            None
        }
        [_] => None,
    }
}

//! Reads a step's starts.

use super::optimiser::{Bounds, MAX_POINTS};
use crate::document::{Node, Object};
use crate::optimiser::OptimiserOptions;
use crate::study::spec::{Restarts, StartKind};

const MAX_RANDOM: usize = 10_000;
const DEFAULT_SEED: u64 = 1;

/// Reads `restarts`; a sweep has none. `of_unit`: the number of corner variables of a unit, `None` for a program.
pub fn read_restarts(
    step: &Object<'_>,
    optimiser: Option<&OptimiserOptions>,
    of_unit: Option<usize>,
    bounds: Option<&Bounds>,
) -> Option<Restarts> {
    if matches!(optimiser, Some(OptimiserOptions::Sweep(_))) {
        if step.has("restarts") {
            step.fault(
                "restarts",
                "a sweep evaluates its own points and has no starts",
            );
        }
        return Some(Restarts::sweep());
    }
    let Some(node) = step.get("restarts") else {
        // An optimiser that could not be read may be a sweep, so nothing is known to be missing.
        if optimiser.is_some() {
            step.fault("restarts", "is required: where the optimiser starts");
        }
        return None;
    };
    let object = node.object(&["start", "points", "count", "seed"])?;
    let start = object
        .required("start")
        .and_then(|n| read_starts(&n, of_unit.is_some()));
    let has = |kind: StartKind| start.as_ref().is_none_or(|s| s.contains(&kind));
    let points = match object.get("points") {
        Some(n) if has(StartKind::Given) => read_points(&n, of_unit, bounds),
        Some(n) => n.fault("belongs to start = \"given\""),
        None if start.is_some() && has(StartKind::Given) => {
            object.fault("points", "is required by start = \"given\"");
            None
        }
        None => Some(Vec::new()),
    };
    let count = match object.get("count") {
        Some(n) if has(StartKind::Random) => n.count(1, MAX_RANDOM),
        Some(n) => n.fault("belongs to start = \"random\""),
        None if start.is_some() && has(StartKind::Random) => {
            object.fault("count", "is required by start = \"random\"");
            None
        }
        None => Some(0),
    };
    let seed = object.or("seed", DEFAULT_SEED, Node::seed);
    Some(Restarts {
        start: start?,
        points: points?,
        count: count?,
        seed: seed?,
    })
}

fn read_starts(node: &Node<'_>, chambers: bool) -> Option<Vec<StartKind>> {
    if node.value().is_array() {
        let starts = node.each(1, 4, |n| read_start(n, chambers))?;
        let twice = starts
            .iter()
            .enumerate()
            .any(|(i, s)| starts[..i].contains(s));
        node.expect(!twice, "names a kind of start twice")?;
        return Some(starts);
    }
    Some(vec![read_start(node, chambers)?])
}

fn read_start(node: &Node<'_>, chambers: bool) -> Option<StartKind> {
    match node.value().as_str() {
        Some(later @ ("latin_hypercube" | "sobol")) => node.fault(format!(
            "\"{later}\" is not available yet; use \"paper\", \"given\" or \"random\""
        )),
        Some("paper") if !chambers => node
            .fault("\"paper\" is the start of a finite-element model; use \"given\" or \"random\""),
        _ => node.choice(&[
            ("paper", StartKind::Paper),
            ("given", StartKind::Given),
            ("random", StartKind::Random),
            ("taken", StartKind::Taken),
        ]),
    }
}

/// Reads a list of points within the bounds. Where several units are free a point may give one of them, for all.
pub fn read_points(
    node: &Node<'_>,
    of_unit: Option<usize>,
    bounds: Option<&Bounds>,
) -> Option<Vec<Vec<f64>>> {
    node.each(1, MAX_POINTS, |point| {
        let Some((lower, upper)) = bounds else {
            return point.numbers(1, MAX_POINTS);
        };
        let coordinates = point.list()?;
        let (given, all) = (coordinates.len(), lower.len());
        // Bounds of free units are those of one unit over and over; those of a program stand for themselves.
        let one_unit = of_unit == Some(given) && all.is_multiple_of(given);
        if given != all && !one_unit {
            let expected = match of_unit {
                Some(one) if all > one => format!("{all} numbers, or {one} for all units alike"),
                _ => format!("{all} numbers"),
            };
            return point.fault(format!("expected {expected}, found {given}"));
        }
        let read = crate::document::all(
            coordinates
                .iter()
                .enumerate()
                .map(|(i, c)| c.number_in(lower[i], upper[i])),
        )?;
        Some(read.repeat(all / given))
    })
}

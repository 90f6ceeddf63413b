//! Reads a step's starts.

use super::optimiser::{Bounds, MAX_POINTS};
use super::race::{Fidelities, read_competition};
use crate::document::{Node, Object};
use crate::optimiser::OptimiserOptions;
use crate::study::spec::{LEAST_DISTANCE, Restarts, StartKind};

const MAX_DRAWN: usize = 10_000;
const DRAWN: &str = "\"random\", \"latin_hypercube\" or \"sobol\"";
const DEFAULT_SEED: u64 = 1;

/// Reads `restarts`; a sweep and an exchange descent have none. `of_unit`: the number of corner variables of a unit, `None` for a program. `fidelities`:
/// what may be coarser on a rung of theirs.
pub fn read_restarts(
    step: &Object<'_>,
    optimiser: Option<&OptimiserOptions>,
    of_unit: Option<usize>,
    bounds: Option<&Bounds>,
    fidelities: Fidelities,
) -> Option<Restarts> {
    if let Some(options) = optimiser.filter(|o| !o.has_starts()) {
        if step.has("restarts") {
            let message = if matches!(options, OptimiserOptions::Exchange(_)) {
                "an exchange descent begins with its uniform sequences and has no starts"
            } else {
                "a sweep evaluates its own points and has no starts"
            };
            step.fault("restarts", message);
        }
        return Some(Restarts::none());
    }
    let Some(node) = step.get("restarts") else {
        // An optimiser that could not be read may be a sweep, so nothing is known to be missing.
        if optimiser.is_some() {
            step.fault("restarts", "is required: where the optimiser starts");
        }
        return None;
    };
    let object = node.object(&[
        "start",
        "points",
        "count",
        "seed",
        "least_distance",
        "race",
        "stop_dominated",
        "merge_within",
    ])?;
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
    let draws = start
        .as_ref()
        .map(|kinds| kinds.iter().any(|kind| kind.is_drawn()));
    let count = match object.get("count") {
        Some(n) if draws != Some(false) => n.count(1, MAX_DRAWN),
        Some(n) => n.fault(format!("belongs to starts that are drawn: {DRAWN}")),
        None if draws == Some(true) => {
            object.fault("count", "is required by starts that are drawn");
            None
        }
        None => Some(0),
    };
    let least_distance = match object.get("least_distance") {
        Some(n) if draws != Some(false) => n.number_in(0.0, 1.0),
        Some(n) => n.fault(format!("belongs to starts that are drawn: {DRAWN}")),
        None => Some(LEAST_DISTANCE),
    };
    let seed = object.or("seed", DEFAULT_SEED, Node::seed);
    let competition = read_competition(&object, fidelities);
    let is_sample = optimiser.is_some_and(OptimiserOptions::is_sample);
    if is_sample && competition.as_ref().is_some_and(|c| !c.is_none()) {
        for name in ["race", "stop_dominated", "merge_within"] {
            if object.has(name) {
                object.fault(
                    name,
                    "a random search leads nowhere: there is nothing to compare, nor an iteration to wait for",
                );
            }
        }
    }
    Some(Restarts {
        start: start?,
        points: points?,
        count: count?,
        seed: seed?,
        least_distance: least_distance?,
        competition: competition?,
    })
}

fn read_starts(node: &Node<'_>, chambers: bool) -> Option<Vec<StartKind>> {
    if node.value().is_array() {
        let starts = node.each(1, 6, |n| read_start(n, chambers))?;
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
        Some("paper") if !chambers => node.fault(format!(
            "\"paper\" is the start of a finite-element model; use \"given\", {DRAWN}"
        )),
        _ => node.choice(&[
            ("paper", StartKind::Paper),
            ("given", StartKind::Given),
            ("random", StartKind::Random),
            ("uniform", StartKind::Random),
            ("latin_hypercube", StartKind::LatinHypercube),
            ("sobol", StartKind::Sobol),
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

//! Reads how restarts compete.

use crate::document::{Node, Object};
use crate::study::race::{Competition, DominationRule, MERGE_WITHIN, Race, Rung, StopDominated};

const MOST_RUNGS: usize = 8;
const MOST_EVALUATIONS: usize = 1_000_000;
const MOST_LOAD_STEPS: usize = 1000;
const DEFAULT_ETA: usize = 3;
const DEFAULT_CORRELATION: f64 = 0.5;
/// Of an order-one constraint: iterates lie a little to either side of their limits, on the two sides at two fidelities.
const DEFAULT_TOLERANCE: f64 = 0.1;
/// Budget of the one rung of `race = true`.
const DEFAULT_EVALUATIONS: usize = 8;
/// Of `mesh = "coarse"`.
const COARSE: f64 = 0.5;
/// States on each leg of the one rung of `race = true`.
const COARSE_LOAD_STEPS: usize = 4;

/// What may be coarser on a rung.
#[derive(Clone, Copy)]
pub struct Fidelities {
    /// Whether the model has a mesh.
    pub mesh: bool,
    /// Whether it has states, and nothing is measured at one within a leg.
    pub fewer_states: bool,
}

/// Reads `race`, `stop_dominated` and `merge_within` of `restarts`.
pub fn read_competition(restarts: &Object<'_>, fidelities: Fidelities) -> Option<Competition> {
    let race = restarts.optional("race", |n| read_race(n, fidelities));
    let stop_dominated = restarts.optional("stop_dominated", read_stop_dominated);
    let merge_within = restarts.optional("merge_within", |n| {
        if n.value().is_boolean() {
            return Some(n.boolean()?.then_some(MERGE_WITHIN));
        }
        let within = n.number_in(0.0, 1.0)?;
        n.expect(within > 0.0, "must be above zero")?;
        Some(Some(within))
    });
    Some(Competition {
        race: race?.flatten(),
        stop_dominated: stop_dominated?.flatten(),
        merge_within: merge_within?.flatten(),
    })
}

/// `Some(None)` of `false`.
#[expect(
    clippy::option_option,
    reason = "a fault, and what is switched off, are two things"
)]
fn read_race(node: &Node<'_>, fidelities: Fidelities) -> Option<Option<Race>> {
    let by_default = || Rung {
        evaluations: DEFAULT_EVALUATIONS,
        mesh: if fidelities.mesh { COARSE } else { 1.0 },
        load_steps_per_leg: fidelities.fewer_states.then_some(COARSE_LOAD_STEPS),
    };
    if node.value().is_boolean() {
        return Some(node.boolean()?.then(|| Race {
            rungs: vec![by_default()],
            eta: DEFAULT_ETA,
            least_correlation: DEFAULT_CORRELATION,
            tolerance: DEFAULT_TOLERANCE,
        }));
    }
    let object = node.object(&["rungs", "eta", "least_correlation", "tolerance"])?;
    let rungs = object.or("rungs", vec![by_default()], |n| {
        let rungs = n.each(1, MOST_RUNGS, |n| read_rung(n, fidelities))?;
        let grow = rungs.windows(2).all(|pair| pair[0].mesh <= pair[1].mesh);
        n.expect(
            grow,
            "each rung has at least the mesh of the one before it: designs go up",
        )?;
        Some(rungs)
    });
    let eta = object.or("eta", DEFAULT_ETA, |n| n.count(1, 1000));
    let least_correlation = object.or("least_correlation", DEFAULT_CORRELATION, |n| {
        n.number_in(-1.0, 1.0)
    });
    let tolerance = object.or("tolerance", DEFAULT_TOLERANCE, |n| n.number_in(0.0, 1000.0));
    Some(Some(Race {
        rungs: rungs?,
        eta: eta?,
        least_correlation: least_correlation?,
        tolerance: tolerance?,
    }))
}

fn read_rung(node: &Node<'_>, fidelities: Fidelities) -> Option<Rung> {
    let object = node.object(&["evaluations", "mesh", "load_steps_per_leg"])?;
    let evaluations = object
        .required("evaluations")
        .and_then(|n| n.count(1, MOST_EVALUATIONS));
    let no_mesh = "this model has one fidelity: its rungs differ by their evaluations alone";
    let mesh = object.or("mesh", 1.0, |n| {
        n.expect(fidelities.mesh, no_mesh)?;
        match n.value().as_str() {
            Some("coarse") => Some(COARSE),
            Some("full") => Some(1.0),
            Some(_) => {
                n.fault("expected \"coarse\", \"full\", or a share of the elements each way")
            }
            None => n.number_in(0.1, 1.0),
        }
    });
    let load_steps_per_leg = object.optional("load_steps_per_leg", |n| {
        n.expect(fidelities.mesh, no_mesh)?;
        n.expect(
            fidelities.fewer_states,
            "the target or a bound is of a state within a leg, which a path of fewer states does not have",
        )?;
        n.count(1, MOST_LOAD_STEPS)
    });
    Some(Rung {
        evaluations: evaluations?,
        mesh: mesh?,
        load_steps_per_leg: load_steps_per_leg?,
    })
}

/// `Some(None)` of `false`.
#[expect(
    clippy::option_option,
    reason = "a fault, and what is switched off, are two things"
)]
fn read_stop_dominated(node: &Node<'_>) -> Option<Option<StopDominated>> {
    let default = StopDominated::default();
    if node.value().is_boolean() {
        return Some(node.boolean()?.then_some(default));
    }
    let object = node.object(&["every", "rule", "ahead"])?;
    let every = object.or("every", default.every, |n| n.count(1, MOST_EVALUATIONS));
    let rule = object.or("rule", default.rule, |n| {
        n.choice(&[
            ("bound", DominationRule::Bound),
            ("median", DominationRule::Median),
        ])
    });
    let by_bound = rule == Some(DominationRule::Bound);
    let ahead = object.or("ahead", default.ahead.filter(|_| by_bound), |n| {
        n.expect(by_bound || rule.is_none(), "belongs to rule = \"bound\"")?;
        n.number_in(0.0, 1000.0).map(Some)
    });
    Some(Some(StopDominated {
        every: every?,
        rule: rule?,
        ahead: ahead?,
    }))
}

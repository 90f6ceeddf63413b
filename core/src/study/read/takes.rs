//! Reads how a step hangs together with others: its pass, its simplifications, what it takes.

use crate::document::{Node, Object};
use crate::scene::actuator::MAX_UNITS;
use crate::study::takes::{Pass, Simplification, Take, TakenAs};

const MAX_TAKES: usize = 100;
pub(super) const MAX_KEEPS: usize = 1000;

/// What a step says of its place in the framework.
pub struct Place {
    pub pass: Pass,
    pub simplifies: Vec<Simplification>,
    pub takes: Vec<Take>,
}

/// Reads `pass`, `simplifies` and `takes`. How many candidates are taken where the document does not say it, and whether the
/// other steps are there, is seen when all steps are read.
pub fn read_place(step: &Object<'_>) -> Option<Place> {
    let pass = step.or("pass", Pass::default(), |n| {
        n.choice(&[("forward", Pass::Forward), ("backward", Pass::Backward)])
    });
    let simplifies = step.or("simplifies", Vec::new(), |n| n.each(0, 4, read_kind));
    let takes = step.or("takes", Vec::new(), |n| n.each(0, MAX_TAKES, read_take));
    Some(Place {
        pass: pass?,
        simplifies: simplifies?,
        takes: takes?,
    })
}

fn read_kind(node: &Node<'_>) -> Option<Simplification> {
    let object = node.object(&["kind"])?;
    let kind = object.required("kind")?.choice(&[
        ("repeat", 0),
        ("reduce", 1),
        ("split", 2),
        ("symmetry", 3),
    ])?;
    Some(match kind {
        0 => Simplification::Repeat,
        1 => Simplification::Reduce,
        2 => Simplification::Split,
        _ => Simplification::Symmetry,
    })
}

fn read_take(node: &Node<'_>) -> Option<Take> {
    let object = node.object(&["step", "as", "units", "candidates"])?;
    let step = object.required("step").and_then(|n| n.text());
    let taken_as = object.required("as").and_then(|n| {
        n.choice(&[
            ("starts", TakenAs::Starts),
            ("geometry", TakenAs::Geometry),
            ("alphabet", TakenAs::Alphabet),
            ("layout", TakenAs::Layout),
            ("behaviour", TakenAs::Behaviour),
        ])
    });
    let units = object.or("units", Vec::new(), |n| {
        n.each(1, MAX_UNITS, |n| n.count(1, MAX_UNITS))
    });
    // 0: all that the other step keeps.
    let candidates = object.or("candidates", 0, |n| n.count(1, MAX_KEEPS));
    Some(Take {
        step: step?.to_owned(),
        taken_as: taken_as?,
        units: units?,
        candidates: candidates?,
    })
}

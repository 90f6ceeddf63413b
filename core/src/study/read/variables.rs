//! Reads a step's variables.

use crate::document::Node;
use crate::study::spec::{Parametrisation, Variables};

const MAX_VARIABLES: usize = 10_000;

/// Reads `variables` of a finite-element model (`chambers`) or of a program.
pub fn read_variables(node: &Node<'_>, chambers: bool) -> Option<Variables> {
    if chambers {
        let object = node.object(&["parametrisation"])?;
        let parametrisation = object.or("parametrisation", Parametrisation::Corners, |n| {
            n.choice(&[
                ("corners", Parametrisation::Corners),
                ("rectangle", Parametrisation::Rectangle),
            ])
        })?;
        return Some(Variables::Chambers { parametrisation });
    }
    let object = node.object(&["lower", "upper"])?;
    let lower = object
        .required("lower")
        .and_then(|n| n.numbers(1, MAX_VARIABLES));
    let upper_node = object.required("upper");
    let upper = upper_node
        .as_ref()
        .and_then(|n| n.numbers(1, MAX_VARIABLES));
    let (lower, upper) = (lower?, upper?);
    let upper_node = upper_node?;
    if lower.len() != upper.len() {
        return upper_node.fault(format!(
            "has {} entries where lower has {}",
            upper.len(),
            lower.len()
        ));
    }
    let mut sound = true;
    for (i, (a, b)) in lower.iter().zip(&upper).enumerate() {
        if a > b {
            object.fault(
                &format!("upper[{i}]"),
                format!("the bounds are reversed: lower {a}, upper {b}"),
            );
            sound = false;
        }
    }
    sound.then_some(Variables::Bounds { lower, upper })
}

//! Reads a step's variables.

use super::model::Kind;
use crate::document::Node;
use crate::study::spec::{Parametrisation, Variables};

const MAX_VARIABLES: usize = 10_000;

/// Reads `variables` of a model of the given kind.
pub fn read_variables(node: &Node<'_>, kind: Kind) -> Option<Variables> {
    if kind != Kind::Command {
        let object = node.object(&["parametrisation"])?;
        let parametrisation = object.or("parametrisation", Parametrisation::Corners, |n| {
            let parametrisation = n.choice(&[
                ("corners", Parametrisation::Corners),
                ("rectangle", Parametrisation::Rectangle),
            ])?;
            n.expect(
                kind != Kind::FeDirect || parametrisation == Parametrisation::Corners,
                "\"rectangle\" describes one unit that is repeated; with \"fe_direct\" each unit has its own corners",
            )?;
            Some(parametrisation)
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

//! Reads a step's variables.

use super::model::Kind;
use crate::document::Node;
use crate::geometry::ChamberCorners;
use crate::study::spec::{Model, Parametrisation, Variables};

const MAX_VARIABLES: usize = 10_000;

/// Bounds of the entries of a transformation, [x_scl, x_sh, y_sh, y_scl]: a unit that grows by up to 30 % and shears by up to a quarter.
const TRANSFORM: [[f64; 4]; 2] = [[0.9, -0.25, -0.25, 0.9], [1.3, 0.25, 0.25, 1.1]];
/// Bounds of the strains of a unit, [turn (rad), extension, shear], as far as those of a transformation.
const STRAIN: [[f64; 3]; 2] = [[-0.25, -0.1, -0.25], [0.25, 0.3, 0.25]];
/// Least side of a chamber in shares of its domain.
const LEAST_SHARE: f64 = 0.05;

/// The variables of a model that has its own.
pub fn read_bounds_of(model: &Model) -> Variables {
    let [lower, upper] = match model {
        Model::LinearTransform(model) => TRANSFORM.map(|of_one| of_one.repeat(model.actuations)),
        Model::ConstantStrain(model) => STRAIN.map(|of_one| of_one.repeat(model.actuations)),
        Model::FeLayouts(model) => [
            vec![0.0, LEAST_SHARE, LEAST_SHARE],
            vec![(model.layouts.len() - 1) as f64, 1.0, 1.0],
        ],
        Model::FeCascade(_) | Model::FeDirect(_) | Model::Command(_) => [Vec::new(), Vec::new()],
    };
    Variables::Bounds { lower, upper }
}

/// Reads how many corners a chamber has.
pub fn read_corners(node: &Node<'_>) -> Option<ChamberCorners> {
    match ChamberCorners::try_from(node.count(1, usize::MAX)?) {
        Ok(corners) => Some(corners),
        Err(message) => node.fault(message),
    }
}

/// Reads `variables` of a model of the given kind.
pub fn read_variables(node: &Node<'_>, kind: Kind, model: Option<&Model>) -> Option<Variables> {
    if !matches!(
        kind,
        Kind::Command | Kind::LinearTransform | Kind::ConstantStrain
    ) {
        let object = node.object(&["parametrisation", "corners"])?;
        let corners = object.optional("corners", read_corners);
        let parametrisation = object.or("parametrisation", Parametrisation::Corners, |n| {
            let parametrisation = n.choice(&[
                ("corners", Parametrisation::Corners),
                ("rectangle", Parametrisation::Rectangle),
                ("sequence", Parametrisation::Sequence),
            ])?;
            n.expect(
                kind != Kind::FeDirect || parametrisation != Parametrisation::Rectangle,
                "\"rectangle\" describes one unit that is repeated; with \"fe_direct\" each unit has its own corners",
            )?;
            n.expect(
                kind == Kind::FeDirect || parametrisation != Parametrisation::Sequence,
                "a sequence says of each unit which one it is: only \"fe_direct\" has units of their own",
            )?;
            Some(parametrisation)
        })?;
        return Some(Variables::Chambers {
            parametrisation,
            corners: corners?,
        });
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
    if let Some((reduced, parts)) = model.and_then(Model::reduced)
        && lower.len() != parts * reduced.actuations
    {
        let names = match kind {
            Kind::ConstantStrain => "turn_rad, extension, shear",
            _ => "x_scl, x_sh, y_sh, y_scl",
        };
        return node.fault(format!(
            "expected {parts} entries ({names}) for each of {} actuations, found {}",
            reduced.actuations,
            lower.len()
        ));
    }
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

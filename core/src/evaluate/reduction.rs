//! The reduced model of a unit from FE, and how well it foretells chains: fitted on one unit and in three, cascaded, held
//! against the FE paths of three and nine; and how far the middle unit of three stands for units 2 to 8 of nine.

use serde::Serialize;

use super::chain_states::{ChainEnd, ChainStates};
use crate::geometry::Point;
use crate::geometry::polygon::{distance, signed_area};
use crate::reduced::{
    AreaMap, Calibrated, CannotFit, Entry, Explored, LinearTransform, MapAxis, area_map,
    largest_areas, tip,
};

/// Numbers of units that are solved: one alone, the shortest chain with a middle, the whole actuator.
pub const CHAINS: [usize; 3] = [1, 3, 9];
/// Chains that are foretold, each with the unit whose right edge has the tip.
const TIPS: [[usize; 2]; 3] = [[3, 2], [9, 8], [9, 9]];
/// Most actuations of the exploration.
const ACTUATIONS: usize = 5;
/// Starts of each of its searches.
const STARTS: usize = 16;
/// Values of each axis of its map.
const MAP: usize = 31;

/// Which transformations are cascaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// That of one unit alone, for all.
    OneUnit,
    /// That of the middle unit of three, for all.
    MiddleOfThree,
    /// Those of three units: the first, the middle one for all between, the last.
    EachOfThree,
}

/// A unit's transformations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnitFit {
    /// Units of the chain in which it was fitted.
    pub chain: usize,
    /// The unit, from 1.
    pub unit: usize,
    /// Largest residual over the states, root of the mean square, mm.
    pub rms_mm: f64,
    /// Largest residual of a point over the states, mm.
    pub max_mm: f64,
    /// Largest way of the right-hand nodes over the states, mm.
    pub moved_mm: f64,
    /// The fits.
    #[serde(flatten)]
    pub calibrated: Calibrated,
}

/// A chain foretold, against FE.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Which transformations were cascaded.
    pub source: Source,
    /// Units of the chain.
    pub units: usize,
    /// The tip is the middle of the right edge of this unit, from 1.
    pub tip_unit: usize,
    /// Largest displacement of the tip in FE, mm.
    pub largest_mm: f64,
    /// Largest distance of the two paths over the states, over the largest displacement.
    pub max_error: f64,
    /// Root of its mean square, over the largest displacement.
    pub rms_error: f64,
    /// Area that the tip encloses in FE, mm^2.
    pub fe_area_mm2: f64,
    /// Foretold over the same states, mm^2.
    pub area_mm2: f64,
    /// Area of the polygon of the schedule's rows in FE, mm^2.
    pub fe_area_of_rows_mm2: f64,
    /// The same foretold: all that the paper's model knows of a path, mm^2.
    pub area_of_rows_mm2: f64,
    /// Places of the tip in FE, mm.
    pub fe_path_mm: Vec<Point>,
    /// Foretold, mm.
    pub path_mm: Vec<Point>,
}

/// A unit of nine against the middle unit of three.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UnitDifference {
    /// The unit, from 1.
    pub unit: usize,
    /// Largest distance over the states between where the two put a right-hand node, mm.
    pub max_mm: f64,
    /// The same over the largest way of those nodes in the middle unit of three.
    pub relative: f64,
    /// Largest difference of the turns of the right edges, degrees.
    pub turn_deg: f64,
}

/// The design space within the box of the entries that the middle unit of three reaches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exploration {
    /// Units up to the tip.
    pub units: usize,
    /// Largest areas by number of actuations.
    pub largest: Vec<Explored>,
    /// Areas over the shears x_sh of the first and the last row of the schedule that loads; none with fewer than two, or
    /// where no edge turns.
    pub map: Option<AreaMap>,
    /// Those shears as fitted.
    pub fitted: Option<[f64; 2]>,
}

/// The whole comparison. What needs a chain that did not end well is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reduction {
    /// How the chains ended.
    pub chains: Vec<ChainEnd>,
    /// Fits of one unit and of each of three.
    pub fits: Vec<UnitFit>,
    /// Chains of three and nine foretold.
    pub predictions: Vec<Prediction>,
    /// Units 2 to 8 of nine.
    pub unit_differences: Vec<UnitDifference>,
    /// The design space.
    pub exploration: Option<Exploration>,
}

/// Compares solved chains of [`CHAINS`] units.
///
/// # Errors
/// Points that do not determine a fit.
pub fn reduction(chains: &[ChainStates]) -> Result<Reduction, CannotFit> {
    let of = |units: usize| {
        let chain = chains.iter().find(|chain| chain.end.units == units)?;
        chain.is_complete().then_some(chain)
    };
    let fits_of = |units: usize| -> Result<Vec<Calibrated>, CannotFit> {
        of(units).map_or(Ok(Vec::new()), |chain| {
            (1..=units).map(|unit| chain.fit_unit(unit)).collect()
        })
    };
    let [one, three, nine] = [fits_of(1)?, fits_of(3)?, fits_of(9)?];
    let mut fits = Vec::new();
    for (chain, of_chain) in [(1, &one), (3, &three)] {
        for (index, calibrated) in of_chain.iter().enumerate() {
            fits.push(unit_fit(chain, index + 1, calibrated));
        }
    }
    let mut predictions = Vec::new();
    for [units, tip_unit] in TIPS {
        let Some(chain) = of(units) else { continue };
        let mut add = |source, cascaded: Vec<&Calibrated>| {
            predictions.push(prediction(chain, source, &cascaded));
        };
        if let [unit] = &one[..] {
            add(Source::OneUnit, vec![unit; tip_unit]);
        }
        if let [first, middle, last] = &three[..] {
            add(Source::MiddleOfThree, vec![middle; tip_unit]);
            let mut each = vec![middle; units];
            (each[0], each[units - 1]) = (first, last);
            each.truncate(tip_unit);
            add(Source::EachOfThree, each);
        }
    }
    let middle = three.get(1);
    let unit_differences = match (middle, nine.len()) {
        (Some(middle), 9) => (2..=8)
            .map(|unit| unit_difference(unit, &nine[unit - 1], middle))
            .collect(),
        _ => Vec::new(),
    };
    Ok(Reduction {
        chains: chains.iter().map(|chain| chain.end.clone()).collect(),
        fits,
        predictions,
        unit_differences,
        exploration: middle.map(exploration),
    })
}

fn unit_fit(chain: usize, unit: usize, calibrated: &Calibrated) -> UnitFit {
    let largest = |of: &dyn Fn(&crate::reduced::Fit) -> f64| {
        let states = calibrated.states.iter();
        states.fold(0.0, |m: f64, state| m.max(of(&state.fit)))
    };
    UnitFit {
        chain,
        unit,
        rms_mm: largest(&|fit| fit.rms_mm),
        max_mm: largest(&|fit| fit.max_mm),
        moved_mm: moved_mm(calibrated),
        calibrated: calibrated.clone(),
    }
}

/// Largest way of the right-hand nodes from rest, mm.
fn moved_mm(calibrated: &Calibrated) -> f64 {
    let rest = LinearTransform::IDENTITY;
    let states = calibrated.states.iter();
    states.fold(0.0, |m: f64, state| {
        m.max((state.fit.transform).node_distance_mm(&rest, calibrated.unit_mm))
    })
}

/// Cascades the transformations of the units up to the tip of a complete chain, state by state.
fn prediction(chain: &ChainStates, source: Source, units: &[&Calibrated]) -> Prediction {
    let tip_unit = units.len();
    let fe = chain.tip_path(tip_unit);
    let path: Vec<Point> = (0..fe.len())
        .map(|state| {
            let of_state = units.iter().map(|unit| unit.states[state].fit.transform);
            tip(&of_state.collect::<Vec<_>>(), chain.unit_mm)
        })
        .collect();
    let largest_mm = fe.iter().fold(0.0, |m: f64, p| m.max(distance(fe[0], *p)));
    let errors = || fe.iter().zip(&path).map(|(a, b)| distance(*a, *b));
    let scale = if largest_mm > 0.0 { largest_mm } else { 1.0 };
    let mean = errors().map(|e| e * e).sum::<f64>() / fe.len() as f64;
    let rows: Vec<usize> = (units.iter().take(1))
        .flat_map(|unit| unit.rows())
        .map(|(state, _)| state)
        .collect();
    let of_rows = |path: &[Point]| {
        let corners: Vec<Point> = rows.iter().map(|state| path[*state]).collect();
        signed_area(&corners)
    };
    Prediction {
        source,
        units: chain.end.units,
        tip_unit,
        largest_mm,
        max_error: errors().fold(0.0, f64::max) / scale,
        rms_error: mean.sqrt() / scale,
        fe_area_mm2: signed_area(&fe),
        area_mm2: signed_area(&path),
        fe_area_of_rows_mm2: of_rows(&fe),
        area_of_rows_mm2: of_rows(&path),
        fe_path_mm: fe,
        path_mm: path,
    }
}

fn unit_difference(unit: usize, own: &Calibrated, middle: &Calibrated) -> UnitDifference {
    let pairs = || {
        let states = own.states.iter().zip(&middle.states);
        states.map(|(a, b)| (a.fit.transform, b.fit.transform))
    };
    let max_mm = pairs().fold(0.0, |m: f64, (a, b)| {
        m.max(a.node_distance_mm(&b, middle.unit_mm))
    });
    let turn = pairs().fold(0.0, |m: f64, (a, b)| {
        m.max((a.turn_rad() - b.turn_rad()).abs())
    });
    let moved = moved_mm(middle);
    UnitDifference {
        unit,
        max_mm,
        relative: max_mm / if moved > 0.0 { moved } else { 1.0 },
        turn_deg: turn.to_degrees(),
    }
}

/// The design space about a unit, for the tip of the whole actuator.
fn exploration(middle: &Calibrated) -> Exploration {
    let [.., units] = CHAINS;
    let bounds = middle.bounds();
    let largest = largest_areas(ACTUATIONS, &bounds, middle.unit_mm, units, STARTS);
    let loaded: Vec<LinearTransform> = middle
        .rows()
        .filter(|(_, state)| state.point.pressure_kpa.iter().any(|p| *p != 0.0))
        .map(|(_, state)| state.fit.transform)
        .collect();
    let widest = bounds.lower.x_sh.abs().max(bounds.upper.x_sh.abs());
    let values: Vec<f64> = (0..MAP)
        .map(|i| 1.5 * widest * (2.0 * i as f64 / (MAP - 1) as f64 - 1.0))
        .collect();
    let axis = |actuation| MapAxis {
        actuation,
        entry: Entry::XSh,
        values: values.clone(),
    };
    let (map, fitted) = match &loaded[..] {
        [first, .., last] if widest > 0.0 => {
            let axes = [axis(0), axis(loaded.len() - 1)];
            let map = area_map(&loaded, axes, middle.unit_mm, units).ok();
            (map, Some([first.x_sh, last.x_sh]))
        }
        _ => (None, None),
    };
    Exploration {
        units,
        largest,
        map,
        fitted,
    }
}

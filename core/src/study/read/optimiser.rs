//! Reads a step's optimiser.

use super::restarts::read_points;
use super::step::MAX_EVALUATIONS;
use crate::document::{Node, Object};
use crate::optimiser::{
    CmaEsOptions, Curvature, DescentOptions, ExchangeOptions, GcmmaOptions, GradientSource,
    MmfdOptions, OptimiserOptions, RandomSearchOptions, SqpOptions, SweepOptions,
};

pub(super) const MAX_POINTS: usize = 100_000;
/// Of any count of iterations.
const MOST: usize = 1_000_000;

/// Lower and upper bounds of a step's variables.
pub type Bounds = (Vec<f64>, Vec<f64>);

#[derive(Clone, Copy)]
enum Method {
    Mmfd,
    Gcmma,
    Sqp,
    CmaEs,
    RandomSearch,
    Exchange,
    Sweep,
}

/// What a model can do about gradients.
#[derive(Clone, Copy)]
struct Gradients {
    /// A finite-element model: the adjoint costs a few per cent of the analysis that it belongs to; a program's gradient
    /// may cost anything.
    chambers: bool,
    gives: bool,
}

impl Gradients {
    fn default_source(self) -> GradientSource {
        if self.gives {
            GradientSource::Model
        } else {
            GradientSource::Differences
        }
    }

    /// Reads `gradient`.
    fn read(self, object: &Object<'_>) -> Option<GradientSource> {
        object.or("gradient", self.default_source(), |n| {
            let source = n.choice(&[
                ("model", GradientSource::Model),
                ("differences", GradientSource::Differences),
            ])?;
            n.expect(
                self.gives || source == GradientSource::Differences,
                "the command model gives no gradient (gradient = true is missing there)",
            )?;
            Some(source)
        })
    }

    /// Reads what the methods that follow gradients have in common.
    fn read_descent(self, object: &Object<'_>, default: &DescentOptions) -> Option<DescentOptions> {
        let number = |name: &str, default: f64| object.or(name, default, Node::number);
        let count = |name: &str, default: usize| object.or(name, default, |n| n.count(1, MOST));
        // Every field is read before the first missing one ends the reading.
        let gradient = self.read(object);
        let eager_gradients = object.or("eager_gradients", self.chambers, Node::boolean);
        let difference_step = number("difference_step", default.difference_step);
        let least_difference_step = number("least_difference_step", default.least_difference_step);
        let violation_tolerance = number("violation_tolerance", default.violation_tolerance);
        let absolute_tolerance = object.optional("absolute_tolerance", Node::number);
        let relative_tolerance = number("relative_tolerance", default.relative_tolerance);
        let consecutive = count("consecutive", default.consecutive);
        let max_iterations = count("max_iterations", default.max_iterations);
        let infeasible_iterations = count("infeasible_iterations", default.infeasible_iterations);
        let stall_factor = number("stall_factor", default.stall_factor);
        Some(DescentOptions {
            gradient: gradient?,
            eager_gradients: eager_gradients?,
            difference_step: difference_step?,
            least_difference_step: least_difference_step?,
            violation_tolerance: violation_tolerance?,
            absolute_tolerance: absolute_tolerance?,
            relative_tolerance: relative_tolerance?,
            consecutive: consecutive?,
            max_iterations: max_iterations?,
            infeasible_iterations: infeasible_iterations?,
            stall_factor: stall_factor?,
        })
    }
}

/// Reads `optimiser` for a finite-element model, whose units have `of_unit` corner variables, or for a program (`None`), which
/// gives gradients or not.
pub fn read_optimiser(
    node: &Node<'_>,
    of_unit: Option<usize>,
    gives_gradients: bool,
    bounds: Option<&Bounds>,
) -> Option<OptimiserOptions> {
    let object = node.open()?;
    let gradients = Gradients {
        chambers: of_unit.is_some(),
        gives: gives_gradients,
    };
    let method = object.required("method")?.choice(&[
        ("mmfd", Method::Mmfd),
        ("gcmma", Method::Gcmma),
        ("sqp", Method::Sqp),
        ("cma_es", Method::CmaEs),
        ("random_search", Method::RandomSearch),
        ("exchange", Method::Exchange),
        ("sweep", Method::Sweep),
    ])?;
    let options = match method {
        Method::Mmfd => read_mmfd(&object, gradients).map(OptimiserOptions::Mmfd),
        Method::Gcmma => read_gcmma(&object, gradients).map(OptimiserOptions::Gcmma),
        Method::Sqp => read_sqp(&object, gradients).map(OptimiserOptions::Sqp),
        Method::CmaEs => read_cma_es(&object).map(OptimiserOptions::CmaEs),
        Method::RandomSearch => read_random_search(&object).map(OptimiserOptions::RandomSearch),
        Method::Exchange => read_exchange(&object).map(OptimiserOptions::Exchange),
        Method::Sweep => read_sweep(&object, of_unit, bounds).map(OptimiserOptions::Sweep),
    }?;
    let mut faults = crate::fault::Faults::default();
    options.faults(node.path(), &mut faults);
    node.append(faults)?;
    Some(options)
}

/// Names of [`DescentOptions`].
const DESCENT: [&str; 11] = [
    "gradient",
    "eager_gradients",
    "difference_step",
    "least_difference_step",
    "violation_tolerance",
    "absolute_tolerance",
    "relative_tolerance",
    "consecutive",
    "max_iterations",
    "infeasible_iterations",
    "stall_factor",
];

/// Faults fields that neither all methods that follow gradients have, nor this one.
fn allow(object: &Object<'_>, own: &[&str]) {
    object.allow(&[&["method"], &DESCENT[..], own].concat());
}

fn read_mmfd(object: &Object<'_>, gradients: Gradients) -> Option<MmfdOptions> {
    allow(
        object,
        &[
            "curvature",
            "active_from",
            "first_objective_change",
            "first_move",
            "scale_every",
            "push_off",
        ],
    );
    let default = MmfdOptions::default();
    let number = |name: &str, default: f64| object.or(name, default, Node::number);
    // Every field is read before the first missing one ends the reading.
    let descent = gradients.read_descent(object, &default.descent);
    let curvature = object.or("curvature", default.curvature, |n| {
        n.choice(&[
            ("never", Curvature::Never),
            ("unconstrained", Curvature::Unconstrained),
            ("always", Curvature::Always),
        ])
    });
    let active_from = number("active_from", default.active_from);
    let first_objective_change = number("first_objective_change", default.first_objective_change);
    let first_move = number("first_move", default.first_move);
    let scale_every = object.optional("scale_every", |n| n.count(0, 1_000_000));
    let push_off = number("push_off", default.push_off);
    Some(MmfdOptions {
        descent: descent?,
        curvature: curvature?,
        active_from: active_from?,
        first_objective_change: first_objective_change?,
        first_move: first_move?,
        scale_every: scale_every?,
        push_off: push_off?,
    })
}

fn read_gcmma(object: &Object<'_>, gradients: Gradients) -> Option<GcmmaOptions> {
    allow(
        object,
        &["globalise", "stationarity_tolerance", "first_move"],
    );
    let default = GcmmaOptions::default();
    let number = |name: &str, default: f64| object.or(name, default, Node::number);
    // Every field is read before the first missing one ends the reading.
    let descent = gradients.read_descent(object, &default.descent);
    let globalise = object.or("globalise", default.globalise, Node::boolean);
    let stationarity_tolerance = number("stationarity_tolerance", default.stationarity_tolerance);
    let first_move = number("first_move", default.first_move);
    Some(GcmmaOptions {
        descent: descent?,
        globalise: globalise?,
        stationarity_tolerance: stationarity_tolerance?,
        first_move: first_move?,
    })
}

fn read_sqp(object: &Object<'_>, gradients: Gradients) -> Option<SqpOptions> {
    allow(object, &["stationarity_tolerance", "first_move"]);
    let default = SqpOptions::default();
    let number = |name: &str, default: f64| object.or(name, default, Node::number);
    // Every field is read before the first missing one ends the reading.
    let descent = gradients.read_descent(object, &default.descent);
    let stationarity_tolerance = number("stationarity_tolerance", default.stationarity_tolerance);
    let first_move = number("first_move", default.first_move);
    Some(SqpOptions {
        descent: descent?,
        stationarity_tolerance: stationarity_tolerance?,
        first_move: first_move?,
    })
}

fn read_cma_es(object: &Object<'_>) -> Option<CmaEsOptions> {
    object.allow(&[
        "method",
        "seed",
        "population",
        "first_step",
        "doublings",
        "max_evaluations",
        "violation_tolerance",
        "absolute_tolerance",
        "relative_tolerance",
        "step_tolerance",
        "stall_factor",
    ]);
    let default = CmaEsOptions::default();
    let number = |name: &str, default: f64| object.or(name, default, Node::number);
    // Every field is read before the first missing one ends the reading.
    let seed = object.or("seed", default.seed, Node::seed);
    let population = object.optional("population", |n| n.count(1, MAX_POINTS));
    let first_step = number("first_step", default.first_step);
    let doublings = object.or("doublings", default.doublings, |n| n.count(0, MAX_POINTS));
    let max_evaluations = object.optional("max_evaluations", |n| n.count(1, MAX_EVALUATIONS));
    let violation_tolerance = number("violation_tolerance", default.violation_tolerance);
    let absolute_tolerance = object.optional("absolute_tolerance", Node::number);
    let relative_tolerance = number("relative_tolerance", default.relative_tolerance);
    let step_tolerance = number("step_tolerance", default.step_tolerance);
    let stall_factor = number("stall_factor", default.stall_factor);
    Some(CmaEsOptions {
        seed: seed?,
        population: population?,
        first_step: first_step?,
        doublings: doublings?,
        max_evaluations: max_evaluations?,
        violation_tolerance: violation_tolerance?,
        absolute_tolerance: absolute_tolerance?,
        relative_tolerance: relative_tolerance?,
        step_tolerance: step_tolerance?,
        stall_factor: stall_factor?,
    })
}

fn read_random_search(object: &Object<'_>) -> Option<RandomSearchOptions> {
    object.allow(&[
        "method",
        "seed",
        "evaluations",
        "batch",
        "violation_tolerance",
    ]);
    let default = RandomSearchOptions::default();
    let seed = object.or("seed", default.seed, Node::seed);
    let evaluations = object
        .required("evaluations")
        .and_then(|n| n.count(1, MAX_EVALUATIONS));
    let batch = object.or("batch", default.batch, |n| n.count(1, MAX_POINTS));
    let violation_tolerance = object.or(
        "violation_tolerance",
        default.violation_tolerance,
        Node::number,
    );
    Some(RandomSearchOptions {
        seed: seed?,
        evaluations: evaluations?,
        batch: batch?,
        violation_tolerance: violation_tolerance?,
    })
}

fn read_exchange(object: &Object<'_>) -> Option<ExchangeOptions> {
    object.allow(&[
        "method",
        "enumerate_up_to",
        "max_iterations",
        "max_evaluations",
        "violation_tolerance",
    ]);
    let default = ExchangeOptions::default();
    let enumerate_up_to = object.or("enumerate_up_to", default.enumerate_up_to, |n| {
        n.count(0, MAX_POINTS)
    });
    let max_iterations = object.or("max_iterations", default.max_iterations, |n| {
        n.count(1, MOST)
    });
    let max_evaluations = object.optional("max_evaluations", |n| n.count(1, MAX_EVALUATIONS));
    let violation_tolerance = object.or(
        "violation_tolerance",
        default.violation_tolerance,
        Node::number,
    );
    Some(ExchangeOptions {
        enumerate_up_to: enumerate_up_to?,
        max_iterations: max_iterations?,
        max_evaluations: max_evaluations?,
        violation_tolerance: violation_tolerance?,
    })
}

fn read_sweep(
    object: &Object<'_>,
    of_unit: Option<usize>,
    bounds: Option<&Bounds>,
) -> Option<SweepOptions> {
    object.allow(&["method", "grid", "points", "violation_tolerance"]);
    let tolerance = object.or(
        "violation_tolerance",
        SweepOptions::default().violation_tolerance,
        Node::number,
    );
    let points = match (object.get("grid"), object.get("points")) {
        (Some(grid), None) => read_grid(&grid, bounds),
        // The document of a study that takes its points says that they are none of its own.
        (None, Some(points))
            if points.value().as_str() == Some("taken")
                || points.value().as_array().is_some_and(Vec::is_empty) =>
        {
            Some(Vec::new())
        }
        (None, Some(points)) => read_points(&points, of_unit, bounds),
        (Some(_), Some(_)) => {
            object.fault("points", "either grid or points, not both");
            None
        }
        (None, None) => {
            object.fault(
                "grid",
                "is required (or points): a list of values for each variable",
            );
            None
        }
    };
    Some(SweepOptions {
        points: points?,
        violation_tolerance: tolerance?,
    })
}

/// Every combination of the values of each variable; the last variable runs fastest.
fn read_grid(node: &Node<'_>, bounds: Option<&Bounds>) -> Option<Vec<Vec<f64>>> {
    let axes = node.list()?;
    let values = node.each(1, usize::MAX, |axis| axis.numbers(1, MAX_POINTS))?;
    if let Some((lower, upper)) = bounds {
        if axes.len() != lower.len() {
            return node.fault(format!(
                "expected a list of values for each of the {} variables, found {}",
                lower.len(),
                axes.len()
            ));
        }
        let mut sound = true;
        for (i, axis) in axes.iter().enumerate() {
            for value in axis.list()? {
                sound &= value.number_in(lower[i], upper[i]).is_some();
            }
        }
        sound.then_some(())?;
    }
    let total = values
        .iter()
        .try_fold(1_usize, |n, axis| n.checked_mul(axis.len()))
        .filter(|n| *n <= MAX_POINTS);
    if total.is_none() {
        return node.fault(format!("a sweep has at most {MAX_POINTS} points"));
    }
    let mut points = vec![Vec::new()];
    for axis in &values {
        points = points
            .iter()
            .flat_map(|point: &Vec<f64>| {
                axis.iter().map(move |v| {
                    let mut point = point.clone();
                    point.push(*v);
                    point
                })
            })
            .collect();
    }
    Some(points)
}

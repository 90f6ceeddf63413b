//! How far a scene's objective is from that of its model without discretisation: "numerical error <= x %, model as stated".
//!
//! The scene is solved again with one setting at a time nearer to its limit, and each term says what is left to that limit:
//!
//! | term | solved again with | bound |
//! |---|---|---|
//! | `mesh` | each element split 2 by 2 and 4 by 4 | nested: `1.25 \|A4 - A2\|` for an observed order `1 <= q <= formal`, else 3 times the largest difference |
//! | `tolerance` | a hundredth of it | `1.25 \|dA\| / (1 - 100^-1)` |
//! | `path` | 2 and 4 times the states a leg | `\|A - A4\|`, and of `A4` as for the mesh; formal order 2 |
//! | `contact` | half the activation distance | `1.25 \|dA\| / (1 - 2^-1)` |
//! | `bulk` | ten times K/mu | `1.25 \|dA\| / (1 - 10^-1)`: what compressibility does is of order one in mu/K |
//!
//! The remainder of three nested values is `\|A4 - A2\| / (2^q - 1)`; q counts as 1 in it, whatever was observed: the corners of
//! voids leave an order near one on meshes fine enough, and coarse ones show more.
//!
//! The laws are those of incompressible rubber and K/mu a setting by which that is reached, like the mesh: so `bulk` is a
//! term. Formal order: 4 of `quad9`, 2 of `quad4`. Their sum is the error of A4, the value on the finest mesh; that of the
//! scene's own mesh is their sum and `|A1 - A4|`. Nothing is said where a solve does not end: its status is.

use serde::Serialize;

use super::answer::{SceneAnswer, SceneStatus};
use super::converge::{NESTED, known, observed_order, swing};
use super::scene::{SceneOptions, plan_element, solve_scene};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::{MeshPlan, PlanElement};
use crate::scene::{Body, Measure, Scene};

/// Least order that three nested values must show, and the order by which their remainder counts.
const LEAST_ORDER: f64 = 1.0;
/// Formal order of a polygon through states.
const PATH_ORDER: f64 = 2.0;
/// An objective that is smaller than this in its unit has its error in that unit alone.
const LEAST_FOR_PERCENT: f64 = 1.0;

/// A source of error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Size of the elements.
    Mesh,
    /// Tolerance of the residual.
    Tolerance,
    /// States of the path.
    Path,
    /// Activation distance of contact.
    Contact,
    /// K/mu.
    Bulk,
}

impl Source {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Tolerance => "tolerance",
            Self::Path => "path",
            Self::Contact => "contact",
            Self::Bulk => "bulk",
        }
    }
}

/// A setting other than the mesh.
struct Perturbation {
    source: Source,
    /// How many times nearer to its limit it is brought, once or twice.
    times: &'static [u16],
    /// Why the term is zero for a scene that ended so; `None`: it is solved for.
    absent: fn(&Scene, &SceneAnswer) -> Option<&'static str>,
    /// Brings it that much nearer and says so in words; `None` where that cannot be done.
    nearer: fn(&mut Scene, u16) -> Option<String>,
}

/// All but the mesh.
const PERTURBATIONS: [Perturbation; 4] = [
    Perturbation {
        source: Source::Tolerance,
        times: &[100],
        absent: |_, _| None,
        nearer: |scene, times| {
            scene.relative_residual_force_tolerance /= f64::from(times);
            let tolerance = scene.relative_residual_force_tolerance;
            Some(format!("tolerance {tolerance:e}"))
        },
    },
    Perturbation {
        source: Source::Path,
        times: &[2, 4],
        absent: |scene, _| {
            names_each_state(scene).then_some("the objective names a point for each state")
        },
        nearer: |scene, times| {
            let times = usize::from(times);
            scene.actuation.load_steps_per_leg *= times;
            if let Some(goal) = &mut scene.objective {
                match &mut goal.measure {
                    Measure::Displacement { state, .. }
                    | Measure::BendingAngle { state, .. }
                    | Measure::ChamberArea { state, .. } => *state *= times,
                    Measure::EnclosedArea { .. } | Measure::TipPath { .. } => {}
                }
            }
            let steps = scene.actuation.load_steps_per_leg;
            Some(format!("{steps} load steps a leg"))
        },
    },
    Perturbation {
        source: Source::Contact,
        times: &[2],
        absent: |_, own| (own.work.contact_steps == 0).then_some("contact did not act"),
        nearer: |scene, times| {
            scene.contact_activation_mm /= times as f64;
            let distance = scene.contact_activation_mm;
            Some(format!("activation distance {distance} mm"))
        },
    },
    Perturbation {
        source: Source::Bulk,
        times: &[10],
        absent: |_, _| None,
        nearer: |scene, times| {
            let Body::Actuator(chain) = &mut scene.body else {
                return None;
            };
            let mut ratios = Vec::new();
            for law in &mut chain.materials {
                law.bulk_over_shear *= f64::from(times);
                let ratio = law.bulk_over_shear.to_string();
                if !ratios.contains(&ratio) {
                    ratios.push(ratio);
                }
            }
            Some(format!("K/mu {}", ratios.join(", ")))
        },
    },
];

/// Whether an objective has a point for each state, so that other states are another objective.
fn names_each_state(scene: &Scene) -> bool {
    let rows = scene.actuation.rows_kpa.len();
    matches!(
        scene.objective.as_ref().map(|goal| &goal.measure),
        Some(Measure::TipPath { points_mm, .. }) if points_mm.len() != rows
    )
}

/// A scene to be solved beside its own.
#[derive(Clone, Debug)]
pub struct Variant {
    source: Source,
    setting: String,
    scene: Scene,
    plan: MeshPlan,
}

/// How a variant ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Solve {
    #[serde(skip)]
    source: Source,
    /// What differs from the scene.
    pub setting: String,
    /// How it ended.
    pub status: SceneStatus,
    /// The objective.
    pub value: Option<f64>,
    /// Elements.
    pub elements: usize,
    /// Free displacement unknowns.
    pub dofs: usize,
}

/// One term of the sum.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorTerm {
    /// Its source.
    pub source: Source,
    /// At most this, in the unit of the objective; `None` where a solve did not end.
    pub error: Option<f64>,
    /// The same in percent of the objective.
    pub error_percent: Option<f64>,
    /// Observed order, of the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
    /// Why it is zero without a solve, or not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// What was solved for it.
    pub solves: Vec<Solve>,
}

/// A value with its bound.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Bounded {
    /// The objective.
    pub value: Option<f64>,
    /// It is off by at most this, in its unit.
    pub error: Option<f64>,
    /// The same in percent of it; `None` also of an objective below 1 in its unit.
    pub error_percent: Option<f64>,
}

/// The numerical error of a scene's objective.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NumericalError {
    /// Unit of the objective.
    pub unit: &'static str,
    /// The objective on the finest of the three nested meshes.
    #[serde(flatten)]
    pub finest: Bounded,
    /// That of the scene's own mesh.
    pub own_mesh: Bounded,
    /// The terms of the sum.
    pub terms: Vec<ErrorTerm>,
    /// All of it in words.
    pub sentence: String,
}

/// Whether a scene can have a numerical error at all.
///
/// # Errors
/// A fault for what is missing: an objective, a mesh that can be refined.
pub fn check(scene: &Scene) -> Result<(), Faults> {
    let mut faults = Faults::default();
    if scene.objective.is_none() {
        faults.add(
            "objective",
            "a numerical error is that of an objective: the scene names none",
        );
    }
    if matches!(scene.body, Body::MeshFile(_)) {
        faults.add(
            "mesh_file",
            "a numerical error needs a mesh that can be refined: give an actuator",
        );
    }
    faults.check(())
}

/// The mesh plan of a scene's own choice.
///
/// # Errors
/// A fault for a mesh file, or for a shape that cannot be meshed.
pub fn own_plan(scene: &Scene) -> Result<MeshPlan, Faults> {
    let fault = |path: &str, message: String| {
        let mut faults = Faults::default();
        faults.add(path, message);
        faults
    };
    let Body::Actuator(chain) = &scene.body else {
        return Err(fault("mesh_file", "has a mesh of its own".to_owned()));
    };
    let element = plan_element(scene.mesh.element);
    MeshPlan::choose(&chain.actuator, element, scene.mesh.size())
        .map_err(|why| fault("actuator", why.to_string()))
}

/// What is to be solved beside a scene that ended as `own` on `plan` (`None`: the mesh of its own choice), the dearest first.
/// Nothing where it did not end.
///
/// # Errors
/// As [`check`]; a shape that cannot be meshed.
pub fn variants(
    scene: &Scene,
    plan: Option<&MeshPlan>,
    own: &SceneAnswer,
) -> Result<Vec<Variant>, Faults> {
    check(scene)?;
    if own.status != SceneStatus::Ok {
        return Ok(Vec::new());
    }
    let plan = match plan {
        Some(plan) => plan.clone(),
        None => own_plan(scene)?,
    };
    let nested = NESTED[1..].iter().rev().map(|factor| Variant {
        source: Source::Mesh,
        setting: format!("each element split {factor} by {factor}"),
        scene: scene.clone(),
        plan: plan.refined(*factor),
    });
    let others = PERTURBATIONS
        .iter()
        .filter(|perturbation| (perturbation.absent)(scene, own).is_none())
        .flat_map(|perturbation| {
            perturbation.times.iter().rev().filter_map(|times| {
                let mut scene = scene.clone();
                Some(Variant {
                    source: perturbation.source,
                    setting: (perturbation.nearer)(&mut scene, *times)?,
                    scene,
                    plan: plan.clone(),
                })
            })
        });
    Ok(nested.chain(others).collect())
}

impl Variant {
    /// Solves it.
    ///
    /// # Errors
    /// As [`solve_scene`].
    pub fn solve(&self, observer: &mut dyn Observer) -> Result<Solve, Faults> {
        let options = SceneOptions {
            plan: Some(self.plan.clone()),
            path_only: true,
            ..SceneOptions::default()
        };
        let answer = solve_scene(&self.scene, &options, observer)?.answer;
        Ok(Solve {
            source: self.source,
            setting: self.setting.clone(),
            status: answer.status,
            value: answer.objective,
            elements: answer.mesh.elements,
            dofs: answer.mesh.dofs,
        })
    }
}

impl NumericalError {
    /// Solves all variants of a scene, one after the other.
    ///
    /// # Errors
    /// As [`variants`] and [`solve_scene`].
    pub fn solve(
        scene: &Scene,
        plan: Option<&MeshPlan>,
        own: &SceneAnswer,
        observer: &mut dyn Observer,
    ) -> Result<Self, Faults> {
        let variants = variants(scene, plan, own)?;
        let solves = variants.iter().map(|variant| variant.solve(observer));
        Ok(Self::of(
            scene,
            own,
            &solves.collect::<Result<Vec<_>, _>>()?,
        ))
    }

    /// Of a scene, its answer, and how its variants ended.
    pub fn of(scene: &Scene, own: &SceneAnswer, solves: &[Solve]) -> Self {
        let unit = scene.objective.as_ref().map_or("", |goal| goal.unit());
        let Some(at_own) = own.objective.filter(|_| own.status == SceneStatus::Ok) else {
            let status = word(own.status);
            return Self {
                unit,
                finest: Bounded::default(),
                own_mesh: Bounded::default(),
                terms: Vec::new(),
                sentence: format!("numerical error not known: the scene ended with {status}"),
            };
        };
        let formal = match plan_element(scene.mesh.element) {
            PlanElement::Quad4 => 2.0,
            PlanElement::Quad9 => 4.0,
        };
        let mut terms = vec![mesh_term(at_own, formal, solves)];
        terms.extend(PERTURBATIONS.iter().map(|perturbation| {
            match (perturbation.absent)(scene, own) {
                Some(why) => ErrorTerm {
                    error: Some(0.0),
                    why: Some(why.to_owned()),
                    ..ErrorTerm::unknown(perturbation.source, solves)
                },
                None => perturbation_term(perturbation, at_own, solves),
            }
        }));
        let at_finest = terms[0].solves.last().and_then(|solve| solve.value);
        let sum: Option<f64> = terms.iter().map(|term| term.error).sum();
        for term in &mut terms {
            term.error_percent = percent(at_finest, term.error);
        }
        let finest = Bounded::new(at_finest, sum);
        let off = at_finest.map(|value| (at_own - value).abs());
        let own_mesh = Bounded::new(Some(at_own), sum.zip(off).map(|(sum, off)| sum + off));
        Self {
            unit,
            sentence: sentence(unit, &finest, &own_mesh, &terms),
            finest,
            own_mesh,
            terms,
        }
    }
}

impl Bounded {
    fn new(value: Option<f64>, error: Option<f64>) -> Self {
        Self {
            value,
            error,
            error_percent: percent(value, error),
        }
    }

    /// The bound in words, rounded up: in percent, or of a small objective in its unit.
    fn words(&self, unit: &str) -> String {
        match (self.error_percent, self.error) {
            (Some(percent), _) => format!("<= {} %", rounded_up(percent)),
            (None, Some(error)) => format!("<= {} {unit}", rounded_up(error)),
            (None, None) => "not known".to_owned(),
        }
    }

    /// The value with one decimal more than its bound has.
    fn number(&self) -> String {
        let (value, error) = (self.value.unwrap_or_default(), self.error.unwrap_or(0.0));
        if value != 0.0 && value.abs() < 1e-3 {
            return format!("{value:.4e}");
        }
        let decimals = if error > 0.0 { decimals(error) } else { 6 };
        format!("{value:.0$}", (decimals + 1).min(6))
    }
}

impl ErrorTerm {
    /// A term of which nothing is known but what was solved for it.
    fn unknown(source: Source, solves: &[Solve]) -> Self {
        let own = solves.iter().filter(|solve| solve.source == source);
        // Variants come with the finest mesh first.
        let solves: Vec<Solve> = own.rev().cloned().collect();
        let failed = solves.iter().find(|solve| solve.value.is_none());
        Self {
            source,
            error: None,
            error_percent: None,
            order: None,
            why: Some(failed.map_or_else(
                || "it was not solved for".to_owned(),
                |solve| format!("{} ended with {}", solve.setting, word(solve.status)),
            )),
            solves,
        }
    }
}

fn mesh_term(at_own: f64, formal: f64, solves: &[Solve]) -> ErrorTerm {
    let term = ErrorTerm::unknown(Source::Mesh, solves);
    let values: Vec<f64> = term.solves.iter().filter_map(|solve| solve.value).collect();
    let &[mid, fine] = values.as_slice() else {
        return term;
    };
    let (error, order) = nested_error([at_own, mid, fine], formal);
    ErrorTerm {
        error: Some(error),
        order,
        why: None,
        ..term
    }
}

fn perturbation_term(perturbation: &Perturbation, at_own: f64, solves: &[Solve]) -> ErrorTerm {
    let term = ErrorTerm::unknown(perturbation.source, solves);
    let values: Vec<f64> = term.solves.iter().filter_map(|solve| solve.value).collect();
    let error = match (perturbation.times, values.as_slice()) {
        (&[times], &[nearer]) => known((nearer - at_own) / (1.0 - 1.0 / f64::from(times))),
        (&[_, _], &[mid, last]) => {
            let (of_last, _) = nested_error([at_own, mid, last], PATH_ORDER);
            (last - at_own).abs() + of_last
        }
        _ => return term,
    };
    ErrorTerm {
        error: Some(error),
        why: None,
        ..term
    }
}

/// Bound of the last of three values, each twice as near to the limit, and the observed order where the bound rests on it.
fn nested_error([coarse, mid, fine]: [f64; 3], formal: f64) -> (f64, Option<f64>) {
    match observed_order(coarse, mid, fine) {
        Some(order) if (LEAST_ORDER..=formal).contains(&order) => {
            let rest = (fine - mid) / (2_f64.powf(LEAST_ORDER) - 1.0);
            (known(rest), Some(order))
        }
        _ => (swing(coarse, mid, fine), None),
    }
}

fn percent(value: Option<f64>, error: Option<f64>) -> Option<f64> {
    let value = value?.abs();
    (value >= LEAST_FOR_PERCENT).then_some(100.0 * error? / value)
}

fn sentence(unit: &str, finest: &Bounded, own: &Bounded, terms: &[ErrorTerm]) -> String {
    if finest.error.is_none() {
        let failed = terms.iter().filter(|term| term.error.is_none());
        let why: Vec<&str> = failed.filter_map(|term| term.why.as_deref()).collect();
        return format!("numerical error not known: {}", why.join("; "));
    }
    format!(
        "objective {} {unit} on the finest of three nested meshes: numerical error {}, model as stated; {} {unit} on the scene's own mesh: {}",
        finest.number(),
        finest.words(unit),
        own.number(),
        own.words(unit)
    )
}

/// Decimals of two significant digits.
fn decimals(x: f64) -> usize {
    (1.0 - x.log10().floor()).clamp(0.0, 300.0) as usize
}

/// Two significant digits, never less than the number.
fn rounded_up(x: f64) -> String {
    if x <= 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = x.log10().floor() - 1.0;
    let unit = 10_f64.powf(digits);
    let up = (x / unit - 1e-9).ceil() * unit;
    if (1e-4..1e4).contains(&x) {
        format!("{up:.0$}", decimals(x))
    } else {
        format!("{up:.1e}")
    }
}

/// The word of a status.
fn word(status: SceneStatus) -> String {
    let document = serde_json::to_value(status).unwrap_or_default();
    document.as_str().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_of_the_method_counts_and_any_other_does_not() {
        // Differences 0.4 and 0.1: order 2, of which one counts.
        let (error, order) = nested_error([1.0, 1.4, 1.5], 4.0);
        assert!((error - 1.25 * 0.1).abs() < 1e-12);
        assert!((order.unwrap() - 2.0).abs() < 1e-12);
        // The same beyond the formal order, below the least one, and of values that swing.
        for (values, formal, widest) in [
            ([1.0, 1.4, 1.5], 1.5, 0.4),
            ([1.0, 1.4, 1.7], 4.0, 0.4),
            ([1.0, 1.4, 1.2], 4.0, 0.4),
            ([1.0, 1.1, 1.6], 4.0, 0.5),
        ] {
            let (error, order) = nested_error(values, formal);
            assert!((error - 3.0 * widest).abs() < 1e-12, "{values:?}: {error}");
            assert_eq!(order, None);
        }
        assert_eq!(nested_error([2.0; 3], 4.0), (0.0, None));
    }

    #[test]
    fn a_bound_is_rounded_up_and_small_values_have_their_unit() {
        for (x, text) in [
            (0.310, "0.31"),
            (0.3101, "0.32"),
            (12.0, "12"),
            (12.1, "13"),
            (0.0, "0"),
            (3.21e-7, "3.3e-7"),
        ] {
            assert_eq!(rounded_up(x), text);
        }
        let large = Bounded::new(Some(-904.168), Some(2.803));
        assert_eq!(large.words("mm\u{b2}"), "<= 0.32 %");
        assert_eq!(large.number(), "-904.17");
        let small = Bounded::new(Some(-0.3815), Some(0.0012));
        assert_eq!(small.error_percent, None);
        assert_eq!(small.words("mm\u{b2}"), "<= 0.0012 mm\u{b2}");
        assert_eq!(small.number(), "-0.38150");
    }
}

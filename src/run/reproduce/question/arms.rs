//! The studies of the question: one question, asked with more or fewer variables, of more or fewer units, with gradients by the
//! adjoint or by differences.

use salp_core::document::parse_toml;
use salp_core::fault::Faults;
use salp_core::study::{StepInputs, Study, read_study};
use serde_json::{Value, json};

use super::Fidelity;
use crate::failure::Failure;
use crate::run::reproduce::realised::QUICK_SIZE_MM;

const EXAMPLE: &str = include_str!("../../../../examples/asymmetric-bending.toml");
/// Of the sequence that all starts come from.
const SEED: u64 = 1;
/// Iterations of a run of a quick look.
const QUICK_ITERATIONS: u16 = 10;
/// Evaluations of a restart of random search: about what an optimiser asks for.
const RANDOM: usize = 40;

/// What the arms differ in.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// An optimiser's runs.
    Optimise {
        free: bool,
        units: usize,
        differences: bool,
    },
    /// From the winners of another arm.
    Freed,
    Rectangles,
    Random,
}

/// An arm of the question.
#[derive(Clone, Copy, Debug)]
pub struct Arm {
    /// Its name, and that of its folder.
    pub id: &'static str,
    /// In tables and figures.
    pub title: &'static str,
    kind: Kind,
    /// One start in so many of the others'.
    thinned: usize,
}

const fn optimise(
    id: &'static str,
    title: &'static str,
    [free, differences]: [bool; 2],
    units: usize,
    thinned: usize,
) -> Arm {
    Arm {
        id,
        title,
        kind: Kind::Optimise {
            free,
            units,
            differences,
        },
        thinned,
    }
}

/// All arms; one that rests on another comes after it. Those that a machine can hardly pay have fewer starts.
pub const ARMS: [Arm; 11] = [
    optimise(
        "shared-3-adjoint",
        "16 on three units, adjoint",
        [false, false],
        3,
        1,
    ),
    optimise(
        "shared-9-adjoint",
        "16 on nine units, adjoint",
        [false, false],
        9,
        1,
    ),
    optimise(
        "free-3-adjoint",
        "48 on three units, adjoint",
        [true, false],
        3,
        1,
    ),
    optimise(
        "free-9-adjoint",
        "144 on nine units, adjoint",
        [true, false],
        9,
        1,
    ),
    Arm {
        id: "freed",
        title: "144 on nine units, adjoint, from the winners of 16 on three",
        kind: Kind::Freed,
        thinned: 1,
    },
    Arm {
        id: "rectangles",
        title: "grid of rectangle pairs on three units",
        kind: Kind::Rectangles,
        thinned: 1,
    },
    Arm {
        id: "random",
        title: "random search, 16 on three units",
        kind: Kind::Random,
        thinned: 1,
    },
    optimise(
        "shared-3-differences",
        "16 on three units, differences",
        [false, true],
        3,
        1,
    ),
    optimise(
        "shared-9-differences",
        "16 on nine units, differences",
        [false, true],
        9,
        2,
    ),
    optimise(
        "free-3-differences",
        "48 on three units, differences",
        [true, true],
        3,
        5,
    ),
    optimise(
        "free-9-differences",
        "144 on nine units, differences",
        [true, true],
        9,
        10,
    ),
];

/// The arm whose winners the arm `freed` starts from.
pub const PARENT: &str = "shared-3-adjoint";

impl Arm {
    /// Whether it starts from another arm's winners.
    pub fn is_freed(&self) -> bool {
        self.kind == Kind::Freed
    }

    fn units(&self) -> usize {
        match self.kind {
            Kind::Optimise { units, .. } => units,
            Kind::Freed => 9,
            Kind::Rectangles | Kind::Random => 3,
        }
    }

    /// Its study, from starts of 16 variables each.
    ///
    /// # Errors
    /// None but for a fault of this program.
    pub fn study(&self, starts: &[Vec<f64>], fidelity: Fidelity) -> Result<Study, Faults> {
        let quick = fidelity.quick;
        let mut document = question(fidelity)?;
        document["name"] = json!(self.id);
        document["actuator"]["units"] = json!(self.units());
        let step = &mut document["step"][0];
        let mut most = starts.len().div_ceil(self.thinned);
        match self.kind {
            Kind::Optimise {
                free,
                units,
                differences,
            } => {
                on_units(step, free, units);
                if differences {
                    step["optimiser"]["gradient"] = json!("differences");
                }
                if differences && quick {
                    most = 1;
                    // One gradient of 144 variables and what follows, for each sense.
                    step["budget"] = json!({"evaluations": 320});
                }
            }
            Kind::Freed => on_units(step, true, 9),
            Kind::Rectangles => {
                step["variables"] = json!({"parametrisation": "rectangle"});
                step["optimiser"] = json!({"method": "sweep", "grid": grid(quick)});
                if let Some(fields) = step.as_object_mut() {
                    fields.remove("restarts");
                }
            }
            Kind::Random => {
                let evaluations = if quick { RANDOM / 2 } else { RANDOM };
                step["optimiser"] = json!({"method": "random_search", "evaluations": evaluations});
            }
        }
        if step.get("restarts").is_some() {
            step["restarts"] = json!({"start": "given", "points": starts[..most]});
        }
        read_study(&document, false)
    }
}

fn on_units(step: &mut Value, free: bool, units: usize) {
    if free {
        step["model"]["kind"] = json!("fe_direct");
    }
    if units == 9 {
        step["target"]["probe_mm"] = json!([640, 40]);
    }
}

/// Widths and heights, mm.
fn grid(quick: bool) -> Value {
    let line = |from: f64, to: f64, n: u32| -> Vec<f64> {
        let step = (to - from) / f64::from(n - 1);
        (0..n).map(|k| from + f64::from(k) * step).collect()
    };
    if quick {
        json!([line(20.0, 70.0, 6), line(16.0, 36.0, 5)])
    } else {
        json!([line(6.0, 76.0, 36), line(10.0, 37.0, 10)])
    }
}

/// What all arms share.
fn question(fidelity: Fidelity) -> Result<Value, Faults> {
    let mut document = parse_toml(EXAMPLE)?;
    document["error_bands"] = json!(false);
    document["step"][0]["optimiser"] = json!({"method": "gcmma", "gradient": "model"});
    let mut iterations = fidelity.iterations;
    if fidelity.quick {
        document["actuation"]["load_steps_per_leg"] = json!(2);
        document["step"][0]["model"]["max_size_mm"] = json!(QUICK_SIZE_MM);
        iterations = iterations.or(Some(QUICK_ITERATIONS));
    }
    if let Some(most) = iterations {
        document["step"][0]["optimiser"]["max_iterations"] = json!(most);
    }
    Ok(document)
}

/// The starts of all arms: designs of 16 variables that keep the walls.
pub fn starts(count: usize) -> Result<Vec<Vec<f64>>, Failure> {
    let mut document = question(Fidelity::default())?;
    document["step"][0]["restarts"] = json!({"start": "sobol", "count": count, "seed": SEED});
    // One sense, so that each start is there once.
    document["step"][0]["target"]["orientation"] = json!("clockwise");
    let study = read_study(&document, false)?;
    let restarts = study
        .restarts(0, &StepInputs::default())
        .map_err(|broken| Failure::Study(broken.to_string()))?;
    Ok(restarts.into_iter().map(|restart| restart.x0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_arm_asks_the_same_question_from_the_same_starts() {
        let starts = starts(3).expect("a sound sequence");
        assert_eq!(starts.len(), 3);
        for quick in [true, false] {
            let fidelity = Fidelity {
                quick,
                iterations: None,
            };
            for arm in &ARMS {
                let study = arm.study(&starts, fidelity).expect(arm.id);
                let variables = study.variables(0).expect("chambers").lower.len();
                let expected = match arm.kind {
                    Kind::Optimise {
                        free: true, units, ..
                    } => 16 * units,
                    Kind::Freed => 144,
                    Kind::Rectangles => 2,
                    _ => 16,
                };
                assert_eq!(variables, expected, "{}", arm.id);
                let first = study.restarts(0, &StepInputs::default()).expect(arm.id);
                if arm.kind != Kind::Rectangles {
                    assert!(
                        first[0].x0.chunks(16).all(|unit| unit == starts[0]),
                        "{}",
                        arm.id
                    );
                }
                let limits = |study: &Study| serde_json::to_value(&study.steps[0].constraints).ok();
                let common = ARMS[0].study(&starts, fidelity).expect("sound");
                assert_eq!(limits(&study), limits(&common), "{}", arm.id);
            }
        }
    }
}

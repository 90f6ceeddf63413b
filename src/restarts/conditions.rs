//! Under which conditions a step sought: what must be the same for two results to be compared, and what may differ.

use salp_core::material::{HyperelasticModel, MaterialLaw};
use salp_core::scene::material_document;
use salp_core::study::Study;
use salp_core::study::spec::{Model, StepConstraints, StudyStep};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// Conditions of a step by their names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// Objective, sense, limits, schedule, p/mu, tip, law, chain: an objective means nothing beside one of another kind.
    pub held_to: Map<String, Value>,
    /// Method, starts, mesh: what is compared, or what the numerical error covers.
    pub sought_by: Map<String, Value>,
}

/// A condition that is not the same for all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Its name.
    pub condition: String,
    /// What it is for each study, in their order; null where it does not exist.
    pub values: Vec<Value>,
}

impl Conditions {
    /// Of a step of a study.
    pub fn of(study: &Study, step: usize) -> Self {
        let Some(s) = study.steps.get(step) else {
            return Self::default();
        };
        let mut held_to = Map::new();
        let mut put = |name: &str, value: Value| {
            if !value.is_null() {
                held_to.insert(name.to_owned(), value);
            }
        };
        objective(s, &mut put);
        if let Some(body) = study.body_of(step).ok().flatten() {
            let p = body.actuation.largest_kpa();
            let laws = body.material.laws(body.actuator.units);
            let ratio = |law: &MaterialLaw| json!(p * 1e-3 / law.shear_modulus_mpa());
            put("p_over_mu", of_units(laws.iter().map(ratio).collect()));
            put("law", of_units(laws.iter().map(law).collect()));
            put("schedule", shares(&body.actuation.rows_kpa, p));
            put(
                "states",
                json!([body.actuation.spacing, body.actuation.load_steps_per_leg]),
            );
            put("units", json!(body.actuator.units));
            put("unit_mm", json!(body.actuator.unit_mm));
            put("corner_radius_mm", json!(body.actuator.corner_radius_mm));
            if let StepConstraints::Chambers(constraints) = &s.constraints {
                put("limits.stretch", json!(body.stretch_limit(constraints)));
            }
        }
        for (name, value) in object(&s.constraints) {
            // The limit that acts is there already.
            if name != "stretch" {
                put(&format!("limits.{name}"), value);
            }
        }
        if let Some(fe) = s.model.finite_elements() {
            put("contact", json!([fe.contact, fe.contact_activation_mm]));
        }
        let mut sought_by = Map::new();
        for (name, of) in [
            ("model", object(&s.model)),
            ("variables", object(&s.variables)),
            ("optimiser", object(&s.optimiser)),
            ("starts", object(&s.restarts)),
        ] {
            for (field, value) in of {
                if !held(name, &field) {
                    sought_by.insert(format!("{name}.{field}"), value);
                }
            }
        }
        Self { held_to, sought_by }
    }
}

/// What is minimised.
fn objective(s: &StudyStep, put: &mut impl FnMut(&str, Value)) {
    let document = s.target.as_ref().map(object);
    for (name, value) in document.into_iter().flatten() {
        let name = match name.as_str() {
            "kind" => "objective",
            "probe_mm" => "tip_mm",
            other => other,
        };
        put(name, value);
    }
    if let Model::Command(command) = &s.model {
        put("objective", json!(command.argv));
    }
}

/// What is compared elsewhere, or is of no weight.
fn held(part: &str, field: &str) -> bool {
    let model = [
        "units",
        "contact",
        "contact_activation_mm",
        "argv",
        "time_limit_s",
    ];
    part == "model" && model.contains(&field) || part == "starts" && field == "points"
}

/// A law without its modulus where that enters by p/mu alone.
fn law(law: &MaterialLaw) -> Value {
    let mut of = material_document(law);
    if let Some(fields) = of.as_object_mut()
        && matches!(law.model, HyperelasticModel::NeoHookean { .. })
    {
        fields.remove("c10_mpa");
    }
    of
}

/// One value for all units where it is the same.
fn of_units(values: Vec<Value>) -> Value {
    if values.windows(2).all(|pair| pair[0] == pair[1]) {
        values.into_iter().next().unwrap_or(Value::Null)
    } else {
        Value::Array(values)
    }
}

/// Rows of the schedule over the largest pressure.
fn shares(rows: &[Vec<f64>], largest: f64) -> Value {
    let share = |p: &f64| (p / largest * 1e12).round() / 1e12;
    let rows = rows
        .iter()
        .map(|row| row.iter().map(share).collect::<Vec<_>>());
    json!(rows.collect::<Vec<_>>())
}

fn object(of: &impl Serialize) -> Map<String, Value> {
    match json!(of) {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// Conditions of which not all have the same value; numbers within 1e-9 of each other are the same.
pub fn differences(of: &[&Map<String, Value>]) -> Vec<Difference> {
    let mut names: Vec<&String> = of.iter().flat_map(|map| map.keys()).collect();
    names.sort();
    names.dedup();
    let difference = |name: &String| Difference {
        condition: name.clone(),
        values: of
            .iter()
            .map(|map| map.get(name).cloned().unwrap_or(Value::Null))
            .collect(),
    };
    let differs = |d: &Difference| d.values.windows(2).any(|pair| !alike(&pair[0], &pair[1]));
    names.into_iter().map(difference).filter(differs).collect()
}

fn alike(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|n| n.as_f64().unwrap_or(f64::NAN));
            (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            let same =
                |(name, value): (&String, &Value)| b.get(name).is_some_and(|b| alike(value, b));
            a.len() == b.len() && a.iter().all(same)
        }
        (a, b) => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use salp_core::document::set;
    use salp_core::study::read_study;

    fn conditions(assignments: &[&str]) -> Conditions {
        let mut document = json!({ "preset": "asymmetric-bending", "name": "a", "step": [{ "id": "three-units" }] });
        for assignment in assignments {
            set(&mut document, assignment).unwrap();
        }
        Conditions::of(&read_study(&document, true).unwrap(), 0)
    }

    fn names(a: &Conditions, b: &Conditions) -> Vec<String> {
        let found = differences(&[&a.held_to, &b.held_to]);
        found.into_iter().map(|d| d.condition).collect()
    }

    #[test]
    fn what_must_be_the_same_is_told() {
        let own = conditions(&[]);
        for name in [
            "objective",
            "orientation",
            "tip_mm",
            "p_over_mu",
            "schedule",
            "limits.stretch",
            "limits.load_margin",
            "units",
            "contact",
        ] {
            assert!(own.held_to.contains_key(name), "{name}: {:?}", own.held_to);
        }
        for (change, expected) in [
            ("actuation.schedule=swap", &["schedule", "states"][..]),
            (
                "material=mold-star-30-soft",
                &["law", "limits.stretch", "p_over_mu"],
            ),
            (
                "step[0].constraints.load_margin=1.2",
                &["limits.load_margin"],
            ),
            ("step[0].constraints.stretch=1.6", &["limits.stretch"]),
            ("step[0].target.orientation=clockwise", &["orientation"]),
            ("actuation.load_steps_per_leg=4", &["states"]),
            ("step[0].optimiser.max_iterations=3", &[]),
            ("step[0].restarts.seed=9", &[]),
        ] {
            let found = names(&own, &conditions(&[change]));
            assert!(
                found.iter().all(|name| expected.contains(&name.as_str())),
                "{change}: {found:?}"
            );
            assert_eq!(found.is_empty(), expected.is_empty(), "{change}");
        }
        let method = conditions(&["step[0].optimiser.max_iterations=3"]);
        assert_eq!(differences(&[&own.sought_by, &method.sought_by]).len(), 1);
    }
}

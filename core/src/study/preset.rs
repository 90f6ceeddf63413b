//! Presets: documents that a study may start from with `preset = "..."`.

use serde_json::{Map, Value, json};

use crate::document::read;
use crate::fault::Faults;

/// Names of the presets.
pub const PRESETS: [&str; 2] = ["paper", "asymmetric-bending"];

/// The document of a preset; `None` for an unknown name.
pub fn preset(name: &str) -> Option<Value> {
    match name {
        "paper" => Some(paper()),
        "asymmetric-bending" => Some(asymmetric_bending()),
        _ => None,
    }
}

/// The document with its preset filled in: objects are merged field by field, everything else is replaced. An object
/// that states another `kind`, `method`, `schedule` or `start` replaces the preset's. Steps are merged by their `id`; a step with
/// a new one is added, and a document of one step without an `id` overrides the preset's only step.
pub fn expand(document: &Value) -> Result<Value, Faults> {
    let Some(name) = document.get("preset") else {
        return Ok(document.clone());
    };
    let base = read(document, |node| {
        let choices: Vec<(&str, &str)> = PRESETS.iter().map(|p| (*p, *p)).collect();
        let preset_node = node.open()?.required("preset")?;
        preset(preset_node.choice(&choices)?)
    });
    let mut base = base.map_err(|mut faults| {
        faults.0.retain(|f| !f.path.is_empty());
        if faults.0.is_empty() {
            faults.add("preset", format!("no preset is named {name}"));
        }
        faults
    })?;
    let mut over = document.clone();
    if let Some(map) = over.as_object_mut() {
        map.shift_remove("preset");
    }
    merge(&mut base, over);
    Ok(base)
}

fn merge(base: &mut Value, over: Value) {
    match (base, over) {
        (Value::Object(base), Value::Object(over)) if !replaces(base, &over) => {
            for (name, value) in over {
                match base.get_mut(&name) {
                    Some(place) if name == "step" => merge_steps(place, value),
                    Some(place) => merge(place, value),
                    None => {
                        base.insert(name, value);
                    }
                }
            }
        }
        (base, over) => *base = over,
    }
}

fn replaces(base: &Map<String, Value>, over: &Map<String, Value>) -> bool {
    ["kind", "method", "schedule", "start"].iter().any(|tag| {
        over.get(*tag)
            .is_some_and(|o| base.get(*tag).is_some_and(|b| b != o))
    })
}

fn merge_steps(base: &mut Value, over: Value) {
    let (Value::Array(steps), Value::Array(overs)) = (&mut *base, &over) else {
        *base = over;
        return;
    };
    let only = steps.len() == 1 && overs.len() == 1;
    for step in overs {
        let id = step.get("id");
        let same = steps
            .iter_mut()
            .find(|s| (id.is_none() && only) || (id.is_some() && s.get("id") == id));
        match same {
            Some(place) => merge(place, step.clone()),
            None => steps.push(step.clone()),
        }
    }
}

/// The paper's three-unit step with its own settings (Tables A1, A2), the upper chamber first.
fn paper() -> Value {
    json!({
        "name": "paper-hierarchical",
        "error_bands": false,
        "actuator": {"unit_mm": [80, 80], "units": 3, "layout": "stacked_pair", "wall_mm": 2, "centre_clearance_mm": 0.5},
        "material": "mold-star-30",
        "actuation": {
            "schedule": [[0, 0], [0, 15], [15, 15], [0, 0]],
            "load_steps_per_leg": 10,
            "spacing": "equal"
        },
        "step": [{
            "id": "three-units",
            "level": 2,
            "target": {"kind": "enclosed_area", "probe_mm": [160, 40], "orientation": "counter_clockwise"},
            "model": {
                "kind": "fe_cascade",
                "element": "quad4",
                "mean_size_mm": 0.9,
                "relative_residual_force_tolerance": 0.1,
                "contact": "auto"
            },
            "variables": {"parametrisation": "corners"},
            "constraints": {"wall_mm": 2, "spike_deg": 3, "stretch": "off", "wall_gap_mm": "off", "load_margin": "off", "exclude_non_unique": false},
            "optimiser": {
                "method": "mmfd",
                "gradient": "differences",
                "curvature": "never",
                "difference_step": 1e-3,
                "relative_tolerance": 1e-3,
                "consecutive": 2,
                "max_iterations": 100
            },
            "restarts": {"start": ["paper", "random"], "count": 3, "seed": 1}
        }]
    })
}

/// Our own default: exact gradients, tight tolerance, both senses, the stretch limit on.
fn asymmetric_bending() -> Value {
    json!({
        "name": "asymmetric-bending",
        "actuator": {"unit_mm": [80, 80], "units": 3, "layout": "stacked_pair", "wall_mm": 2, "centre_clearance_mm": 0.5},
        "material": "mold-star-30",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 8, "spacing": "graded"},
        "step": [{
            "id": "three-units",
            "level": 2,
            "target": {"kind": "enclosed_area", "probe_mm": [160, 40], "orientation": "either"},
            "model": {
                "kind": "fe_cascade",
                "element": "quad9",
                "max_size_mm": null,
                "relative_residual_force_tolerance": 1e-8,
                "contact": "auto"
            },
            "variables": {"parametrisation": "corners"},
            "constraints": {
                "wall_mm": 2,
                "spike_deg": 3,
                "stretch": "material",
                "stretch_length_mm": 0.5,
                "wall_gap_mm": "off",
                "load_margin": 1.1,
                "exclude_non_unique": true
            },
            "optimiser": {
                "method": "gcmma",
                "gradient": "model",
                "max_iterations": 24
            },
            "restarts": {"start": ["paper", "random"], "count": 3, "seed": 1}
        }]
    })
}

//! The shipped schema against the reader: what reads conforms, and what does not conform does not read.

use serde_json::json;

use super::*;

/// Whether a value conforms, for the keywords that the schema uses; any other keyword fails the test.
fn conforms(schema: &Value, value: &Value) -> bool {
    let keywords = schema.as_object().expect("a schema is an object");
    keywords
        .iter()
        .all(|(keyword, rule)| match keyword.as_str() {
            "$schema" | "title" | "description" => true,
            "type" => match rule.as_str().expect("a type") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "null" => value.is_null(),
                "number" => value.is_number(),
                "integer" => value.as_f64().is_some_and(|v| v.fract() == 0.0),
                other => panic!("type {other}"),
            },
            "const" => value == rule,
            "enum" => rule.as_array().expect("a list").contains(value),
            "anyOf" => rule
                .as_array()
                .expect("a list")
                .iter()
                .any(|s| conforms(s, value)),
            "properties" => value.as_object().is_none_or(|map| {
                map.iter()
                    .all(|(name, v)| rule.get(name).is_none_or(|s| conforms(s, v)))
            }),
            "additionalProperties" => value.as_object().is_none_or(|map| {
                map.keys()
                    .all(|name| schema["properties"].get(name).is_some())
            }),
            "required" => {
                let names = rule.as_array().expect("a list");
                names
                    .iter()
                    .all(|n| value.get(n.as_str().expect("a name")).is_some())
            }
            "items" => value
                .as_array()
                .is_none_or(|items| items.iter().all(|v| conforms(rule, v))),
            "minItems" => value
                .as_array()
                .is_none_or(|v| v.len() as f64 >= number(rule)),
            "maxItems" => value
                .as_array()
                .is_none_or(|v| v.len() as f64 <= number(rule)),
            "minLength" => value
                .as_str()
                .is_none_or(|v| v.len() as f64 >= number(rule)),
            "maxLength" => value
                .as_str()
                .is_none_or(|v| v.chars().count() as f64 <= number(rule)),
            "minimum" => value.as_f64().is_none_or(|v| v >= number(rule)),
            "maximum" => value.as_f64().is_none_or(|v| v <= number(rule)),
            "exclusiveMinimum" => value.as_f64().is_none_or(|v| v > number(rule)),
            "exclusiveMaximum" => value.as_f64().is_none_or(|v| v < number(rule)),
            other => panic!("keyword {other}"),
        })
}

fn number(rule: &Value) -> f64 {
    rule.as_f64().expect("a number")
}

#[test]
fn what_reads_conforms() {
    let schema = schema();
    for name in [
        "paper-hierarchical",
        "asymmetric-bending",
        "direct",
        "rectangles",
        "bend-90",
        "follow-path",
        "three-bar-truss",
        "mixed",
    ] {
        assert!(conforms(&schema, &example(name)), "{name}");
        assert!(
            conforms(&schema, &study(&example(name)).document()),
            "{name}, resolved"
        );
    }
    for materials in [
        "unit_materials=[\"mold-star-30\", \"ecoflex-00-30\", {\"model\": \"yeoh\", \"c_mpa\": [0.1, 0, 0], \"fit_stretch\": 2}]",
        "material={\"model\": \"ogden\", \"form\": \"a\", \"mu_mpa\": [0.2, 0.1], \"alpha\": [2, -2], \"fit_stretch\": 3}",
    ] {
        let document = with(&example("asymmetric-bending"), &[materials]);
        assert!(conforms(&schema, &document), "{materials}");
        assert!(
            conforms(&schema, &study(&document).document()),
            "{materials}, resolved"
        );
    }
    for optimiser in [
        "{\"method\": \"gcmma\", \"first_move\": 0.2}",
        "{\"method\": \"gcmma\", \"globalise\": false}",
        "{\"method\": \"sqp\", \"first_move\": 0.2, \"absolute_tolerance\": null}",
        "{\"method\": \"cma_es\"}",
        "{\"method\": \"cma_es\", \"population\": 20, \"doublings\": 2, \"max_evaluations\": 5000, \"stall_factor\": 0}",
        "{\"method\": \"random_search\", \"evaluations\": 100}",
    ] {
        let assignment = format!("step[0].optimiser={optimiser}");
        let document = with(&example("three-bar-truss"), &[&assignment]);
        assert!(conforms(&schema, &document), "{optimiser}");
        assert!(
            conforms(&schema, &study(&document).document()),
            "{optimiser}, resolved"
        );
    }
    for restarts in [
        r#"{"start": "random", "count": 2, "race": true, "stop_dominated": true, "merge_within": true}"#,
        r#"{"start": "paper", "race": {"rungs": [{"evaluations": 8, "mesh": "coarse", "load_steps_per_leg": 4}], "eta": 2},
            "stop_dominated": {"rule": "median"}, "merge_within": 0.02}"#,
    ] {
        let assignment = format!("step[0].restarts={restarts}");
        let document = with(&example("asymmetric-bending"), &[&assignment]);
        assert!(conforms(&schema, &document), "{restarts}");
        assert!(
            conforms(&schema, &study(&document).document()),
            "{restarts}, resolved"
        );
    }
    for name in PRESETS {
        assert!(
            conforms(&schema, &preset(name).expect("a preset")),
            "{name}"
        );
        assert!(conforms(
            &schema,
            &json!({"preset": name, "step": [{"keeps": 2}]})
        ));
    }
}

#[test]
fn what_does_not_conform_does_not_read() {
    let schema = schema();
    for assignment in [
        "colour=red",
        "preset=nature",
        "name=7",
        "actuator.units=0",
        "actuator.wall_mm=-2",
        "actuator.corners=5",
        "step[0].variables.corners=8",
        "material.c10_mpa=-1",
        "material.fit_stretch=1",
        "unit_materials=[7]",
        "actuation.schedule=sideways",
        "actuation={\"schedule\": [[0, 0]]}",
        "step=[]",
        "step[0].level=0",
        "step[0].target.orientation=up",
        "step[0].model.kind=oracle",
        "step[0].model.element=hex",
        "step[0].constraints.stretch=0.9",
        "step[0].optimiser.method=luck",
        "step[0].optimiser.active_from=1",
        "step[0].optimiser.max_iterations=0",
        "step[0].restarts.start=luck",
        "step[0].restarts.count=0",
        "step[0].restarts.race=fast",
        "step[0].restarts.race={\"eta\": 0}",
        "step[0].restarts.stop_dominated.rule=luck",
        "step[0].restarts.merge_within=0",
        "step[0].takes=[\"other\"]",
    ] {
        let document = with(
            &example("asymmetric-bending"),
            &[
                "material={\"model\": \"neo_hookean\", \"c10_mpa\": 0.2}",
                "step[0].constraints.stretch=off",
                assignment,
            ],
        );
        assert!(!conforms(&schema, &document), "{assignment} conforms");
        assert!(!faults(&document).is_empty(), "{assignment} reads");
    }
}

#[test]
fn every_field_of_a_resolved_document_is_described() {
    let schema = schema();
    let mut step = study(&example("asymmetric-bending")).document()["step"][0].clone();
    let properties = &schema["properties"]["step"]["items"]["properties"];
    for (name, value) in step.as_object_mut().expect("an object") {
        assert!(properties[name].is_object(), "{name}");
        for field in value.as_object().into_iter().flat_map(|map| map.keys()) {
            let text = properties[name].to_string();
            assert!(text.contains(&format!("\"{field}\":")), "{name}.{field}");
        }
    }
}

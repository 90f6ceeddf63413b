//! For tests: every document that differs from a given one in a single value.

use serde_json::{Value, json};

/// Values that no field expects, or that only some do.
fn odd_values() -> Vec<Value> {
    vec![
        json!(null),
        json!(true),
        json!(0),
        json!(-1),
        json!(0.5),
        json!(1e300),
        json!(-1e300),
        json!(1e-300),
        json!(u64::MAX),
        json!(""),
        json!("x"),
        json!([]),
        json!([1]),
        json!([[], []]),
        json!([1e300, 1e300]),
        json!({}),
        json!({"kind": "command"}),
    ]
}

/// Calls `visit` with every such document; fields are also left out.
pub fn for_each_mutation(document: &Value, visit: &mut impl FnMut(&Value)) {
    let mut pointers = Vec::new();
    collect(document, String::new(), &mut pointers);
    for pointer in &pointers {
        for odd in odd_values() {
            let mut mutated = document.clone();
            if let Some(place) = mutated.pointer_mut(pointer) {
                *place = odd;
                visit(&mutated);
            }
        }
        if let Some((parent, name)) = pointer.rsplit_once('/') {
            let mut mutated = document.clone();
            match mutated.pointer_mut(parent) {
                Some(Value::Object(map)) => {
                    map.shift_remove(name);
                }
                Some(Value::Array(list)) => {
                    list.pop();
                }
                _ => {}
            }
            visit(&mutated);
        }
    }
}

fn collect(value: &Value, pointer: String, pointers: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (name, item) in map {
                collect(item, format!("{pointer}/{name}"), pointers);
            }
        }
        Value::Array(list) => {
            for (i, item) in list.iter().enumerate() {
                collect(item, format!("{pointer}/{i}"), pointers);
            }
        }
        _ => {}
    }
    pointers.push(pointer);
}

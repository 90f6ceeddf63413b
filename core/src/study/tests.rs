//! Tests of studies: documents, starts, and the restart machine.

mod direct;
mod documents;
mod faults;
mod layouts;
mod machine;
mod racing;
mod replan;
mod schema;
mod starts;
mod without_gradients;

use serde_json::Value;

use super::*;
use crate::document::{parse_toml, set};

/// A study document with overrides.
fn with(document: &Value, assignments: &[&str]) -> Value {
    let mut document = document.clone();
    for assignment in assignments {
        set(&mut document, assignment).expect("an assignment that applies");
    }
    document
}

fn study(document: &Value) -> Study {
    read_study(document, true).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Paths of the faults of a document.
fn faults(document: &Value) -> Vec<String> {
    match read_study(document, true) {
        Ok(_) => Vec::new(),
        Err(faults) => faults.0.into_iter().map(|f| f.path).collect(),
    }
}

fn example(name: &str) -> Value {
    let path = format!("{}/../examples/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("an example that is there");
    parse_toml(&text).expect("valid TOML")
}

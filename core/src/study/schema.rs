//! The JSON Schema of a study, for editors and for programs that write studies. The reader checks more than it can say.

use serde_json::Value;

/// The schema's text (JSON Schema 2020-12).
pub const SCHEMA: &str = include_str!("study.schema.json");

/// The schema.
pub fn schema() -> Value {
    // The file is part of the program, and a test parses it.
    serde_json::from_str(SCHEMA).unwrap_or_default()
}

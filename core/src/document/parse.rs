//! Text to a document: JSON, and TOML as the same document.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use crate::fault::Faults;

fn at_root(message: String) -> Faults {
    let mut faults = Faults::default();
    faults.add("", message);
    faults
}

/// Parses JSON text. A field that is given twice is refused: one of the two would be ignored in silence.
pub fn parse_json(text: &str) -> Result<Value, Faults> {
    let mut source = serde_json::Deserializer::from_str(text);
    let value = Strict::deserialize(&mut source)
        .and_then(|value| source.end().map(|()| value.0))
        .map_err(|error| at_root(format!("is not valid JSON: {error}")))?;
    Ok(value)
}

/// Parses TOML text. Numbers that are not finite and dates are faults at their paths.
pub fn parse_toml(text: &str) -> Result<Value, Faults> {
    let table: toml::Table = toml::from_str(text).map_err(|error| {
        at_root(format!(
            "is not valid TOML: {}",
            error.to_string().trim_end()
        ))
    })?;
    let mut faults = Faults::default();
    let value = from_toml(toml::Value::Table(table), "", &mut faults);
    faults.check(value)
}

fn from_toml(value: toml::Value, path: &str, faults: &mut Faults) -> Value {
    match value {
        toml::Value::String(s) => Value::String(s),
        toml::Value::Integer(i) => Value::from(i),
        toml::Value::Boolean(b) => Value::Bool(b),
        toml::Value::Float(v) => Number::from_f64(v).map_or_else(
            || {
                faults.add(path, format!("expected a finite number, found {v}"));
                Value::Null
            },
            Value::Number,
        ),
        toml::Value::Datetime(_) => {
            faults.add(path, "no field is a date");
            Value::Null
        }
        toml::Value::Array(items) => items
            .into_iter()
            .enumerate()
            .map(|(i, item)| from_toml(item, &format!("{path}[{i}]"), faults))
            .collect(),
        toml::Value::Table(table) => {
            let mut map = Map::new();
            for (name, item) in table {
                let dot = if path.is_empty() { "" } else { "." };
                let item = from_toml(item, &format!("{path}{dot}{name}"), faults);
                map.insert(name, item);
            }
            Value::Object(map)
        }
    }
}

/// A value whose objects name each field once.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        source.deserialize_any(StrictVisitor).map(Strict)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, v: bool) -> Result<Value, E> {
        Ok(Value::Bool(v))
    }

    fn visit_i64<E>(self, v: i64) -> Result<Value, E> {
        Ok(Value::from(v))
    }

    fn visit_u64<E>(self, v: u64) -> Result<Value, E> {
        Ok(Value::from(v))
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<Value, E> {
        Number::from_f64(v)
            .map(Value::Number)
            .ok_or_else(|| E::custom("a number that is not finite"))
    }

    fn visit_str<E>(self, v: &str) -> Result<Value, E> {
        Ok(Value::String(v.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut source: A) -> Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(Strict(item)) = source.next_element()? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut source: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(name) = source.next_key::<String>()? {
            let Strict(item) = source.next_value()?;
            if map.contains_key(&name) {
                return Err(A::Error::custom(format!("field \"{name}\" is given twice")));
            }
            map.insert(name, item);
        }
        Ok(Value::Object(map))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn toml_and_json_give_the_same_document() {
        let toml = "name = \"a\"\nx = [1, 2.5]\n[[step]]\nid = \"s\"\nmodel = { kind = \"k\" }\n";
        let json = r#"{"name": "a", "x": [1, 2.5], "step": [{"id": "s", "model": {"kind": "k"}}]}"#;
        assert_eq!(parse_toml(toml), parse_json(json));
    }

    #[test]
    fn numbers_that_are_not_finite_are_faults_at_their_paths() {
        let faults = parse_toml("a = nan\n[b]\nc = [1, inf]\n").unwrap_err();
        let paths: Vec<_> = faults.0.iter().map(|f| f.path.as_str()).collect();
        assert_eq!(paths, ["a", "b.c[1]"]);
        assert!(parse_json("{\"a\": 1e999}").is_err());
        assert!(parse_json("{\"a\": NaN}").is_err());
    }

    #[test]
    fn a_field_given_twice_is_refused() {
        assert!(parse_json(r#"{"a": {"b": 1, "b": 2}}"#).is_err());
        assert_eq!(
            parse_json(r#"{"a": [{"b": 1}, {"b": 2}]}"#),
            Ok(json!({"a": [{"b": 1}, {"b": 2}]}))
        );
    }
}

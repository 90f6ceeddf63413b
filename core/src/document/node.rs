//! A value of a document with its path, which notes its faults where they belong.
//!
//! Readers return `Option`: `None` means that at least one fault was noted. So a reader goes on to the next field after
//! a fault, and the user sees all of them at once.

use std::cell::RefCell;

use serde_json::{Map, Value};

use crate::fault::Faults;

/// Message of a missing field.
pub(crate) const IS_REQUIRED: &str = "is required";

/// Reads a document with `reader`; every fault that it notes is returned.
pub fn read<T>(document: &Value, reader: impl FnOnce(&Node<'_>) -> Option<T>) -> Result<T, Faults> {
    let faults = RefCell::new(Faults::default());
    let value = reader(&Node {
        value: document,
        path: String::new(),
        faults: &faults,
    });
    let mut faults = faults.into_inner();
    if value.is_none() && faults.0.is_empty() {
        faults.add("", "cannot be read");
    }
    match value {
        Some(value) if faults.0.is_empty() => Ok(value),
        _ => Err(faults),
    }
}

/// A value of a document and its path.
#[derive(Clone)]
pub struct Node<'a> {
    value: &'a Value,
    path: String,
    faults: &'a RefCell<Faults>,
}

/// An object whose fields are known.
pub struct Object<'a> {
    map: &'a Map<String, Value>,
    node: Node<'a>,
}

impl<'a> Node<'a> {
    /// The value itself.
    pub fn value(&self) -> &'a Value {
        self.value
    }

    /// Path from the root, for example `actuator.chambers_mm[1]`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Notes a fault here; `None` for the reader to return.
    pub fn fault<T>(&self, message: impl Into<String>) -> Option<T> {
        self.faults
            .borrow_mut()
            .add(self.path.clone(), message.into());
        None
    }

    /// Notes faults that something else found; `None` if there are any.
    pub fn append(&self, faults: Faults) -> Option<()> {
        let none = faults.0.is_empty();
        self.faults.borrow_mut().0.extend(faults.0);
        none.then_some(())
    }

    /// Notes a fault unless `holds`.
    pub fn expect(&self, holds: bool, message: &str) -> Option<()> {
        if holds { Some(()) } else { self.fault(message) }
    }

    fn wrong_type<T>(&self, expected: &str) -> Option<T> {
        let found = match self.value {
            Value::Null => "null".into(),
            Value::Bool(b) => format!("{b}"),
            Value::Number(n) => format!("{n}"),
            Value::String(s) if s.chars().count() <= 40 => format!("{s:?}"),
            Value::String(_) => "a long text".into(),
            Value::Array(_) => "a list".into(),
            Value::Object(_) => "an object".into(),
        };
        self.fault(format!("expected {expected}, found {found}"))
    }

    fn child(&self, step: &str, value: &'a Value) -> Node<'a> {
        Node {
            value,
            path: format!("{}{step}", self.path),
            faults: self.faults,
        }
    }

    /// An object whose fields are all among `known`; every other field is a fault.
    pub fn object(&self, known: &[&str]) -> Option<Object<'a>> {
        let object = self.open()?;
        object.allow(known);
        Some(object)
    }

    /// An object, its fields not yet checked: call [`Object::allow`] once its kind is known.
    pub fn open(&self) -> Option<Object<'a>> {
        match self.value {
            Value::Object(map) => Some(Object {
                map,
                node: self.clone(),
            }),
            _ => self.wrong_type("an object"),
        }
    }

    /// The items of a list.
    pub fn list(&self) -> Option<Vec<Node<'a>>> {
        match self.value {
            Value::Array(items) => Some(
                items
                    .iter()
                    .enumerate()
                    .map(|(i, item)| self.child(&format!("[{i}]"), item))
                    .collect(),
            ),
            _ => self.wrong_type("a list"),
        }
    }

    /// The items of a list of `min..=max` entries.
    pub fn list_of(&self, min: usize, max: usize) -> Option<Vec<Node<'a>>> {
        let items = self.list()?;
        if items.len() < min {
            return self.fault(format!(
                "expected at least {min} entries, found {}",
                items.len()
            ));
        }
        if items.len() > max {
            return self.fault(format!(
                "expected at most {max} entries, found {}",
                items.len()
            ));
        }
        Some(items)
    }

    /// Reads every item of a list, so that all their faults are noted.
    pub fn each<T>(
        &self,
        min: usize,
        max: usize,
        mut item: impl FnMut(&Node<'a>) -> Option<T>,
    ) -> Option<Vec<T>> {
        all(self.list_of(min, max)?.iter().map(&mut item))
    }

    /// A finite number.
    pub fn number(&self) -> Option<f64> {
        match self.value.as_f64() {
            Some(v) if v.is_finite() => Some(v),
            _ => self.wrong_type("a finite number"),
        }
    }

    /// A number above zero.
    pub fn positive(&self) -> Option<f64> {
        let v = self.number()?;
        self.expect(v > 0.0, &format!("must be above zero, found {v}"))?;
        Some(v)
    }

    /// A number in `[min, max]`.
    pub fn number_in(&self, min: f64, max: f64) -> Option<f64> {
        let v = self.number()?;
        self.expect(
            (min..=max).contains(&v),
            &format!("must be between {min} and {max}, found {v}"),
        )?;
        Some(v)
    }

    /// A whole number in `[min, max]`.
    pub fn count(&self, min: usize, max: usize) -> Option<usize> {
        let v = self.whole_number()?;
        self.expect(
            v >= min as f64 && v <= max as f64,
            &format!("must be a whole number between {min} and {max}, found {v}"),
        )?;
        Some(v as usize)
    }

    fn whole_number(&self) -> Option<f64> {
        match self.value.as_f64() {
            Some(v) if v.is_finite() && v.fract() == 0.0 => Some(v),
            _ => self.wrong_type("a whole number"),
        }
    }

    /// Any unsigned 64-bit number, such as a seed.
    pub fn seed(&self) -> Option<u64> {
        match self.value.as_u64() {
            Some(v) => Some(v),
            None => self.wrong_type("a whole number from 0 to 18446744073709551615"),
        }
    }

    /// `true` or `false`.
    pub fn boolean(&self) -> Option<bool> {
        match self.value {
            Value::Bool(b) => Some(*b),
            _ => self.wrong_type("true or false"),
        }
    }

    /// A text that is not empty.
    pub fn text(&self) -> Option<&'a str> {
        match self.value {
            Value::String(s) if !s.is_empty() => Some(s),
            _ => self.wrong_type("a text that is not empty"),
        }
    }

    /// One of several names.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Option<T> {
        let found = self.value.as_str();
        if let Some((_, choice)) = choices.iter().find(|(name, _)| Some(*name) == found) {
            return Some(*choice);
        }
        let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
        self.wrong_type(&one_of(&names))
    }

    /// A list of numbers.
    pub fn numbers(&self, min: usize, max: usize) -> Option<Vec<f64>> {
        self.each(min, max, Node::number)
    }

    /// A pair of numbers.
    pub fn pair(&self) -> Option<[f64; 2]> {
        let items = match self.list() {
            Some(items) if items.len() == 2 => items,
            Some(items) => {
                return self.fault(format!("expected two numbers, found {}", items.len()));
            }
            None => return None,
        };
        let (a, b) = (items[0].number(), items[1].number());
        Some([a?, b?])
    }
}

impl<'a> Object<'a> {
    /// Notes a fault for every field that is not among `known`.
    pub fn allow(&self, known: &[&str]) {
        for name in self.map.keys() {
            if !known.contains(&name.as_str()) {
                self.node.faults.borrow_mut().add(
                    self.field_path(name),
                    format!("unknown field; known here: {}", known.join(", ")),
                );
            }
        }
    }

    /// The object as a node.
    pub fn node(&self) -> &Node<'a> {
        &self.node
    }

    /// Names of the fields in the document's order.
    pub fn names(&self) -> impl Iterator<Item = &'a str> {
        self.map.keys().map(String::as_str)
    }

    /// Whether a field is present (`null` counts as present).
    pub fn has(&self, name: &str) -> bool {
        self.map.contains_key(name)
    }

    fn field_path(&self, name: &str) -> String {
        if self.node.path.is_empty() {
            name.into()
        } else {
            format!("{}.{name}", self.node.path)
        }
    }

    /// A field that may be missing.
    pub fn get(&self, name: &str) -> Option<Node<'a>> {
        self.map.get(name).map(|value| Node {
            value,
            path: self.field_path(name),
            faults: self.node.faults,
        })
    }

    /// A field that may be missing or `null`.
    pub fn nullable(&self, name: &str) -> Option<Node<'a>> {
        self.get(name).filter(|n| !n.value.is_null())
    }

    /// A field that must be there.
    pub fn required(&self, name: &str) -> Option<Node<'a>> {
        let node = self.get(name);
        if node.is_none() {
            self.fault(name, IS_REQUIRED);
        }
        node
    }

    /// A field that may be missing: `default` then.
    pub fn or<T>(
        &self,
        name: &str,
        default: T,
        reader: impl FnOnce(&Node<'a>) -> Option<T>,
    ) -> Option<T> {
        match self.get(name) {
            Some(node) => reader(&node),
            None => Some(default),
        }
    }

    /// A field that may be missing or `null`: `Some(None)` then.
    pub fn optional<T>(
        &self,
        name: &str,
        reader: impl FnOnce(&Node<'a>) -> Option<T>,
    ) -> Option<Option<T>> {
        match self.nullable(name) {
            Some(node) => reader(&node).map(Some),
            None => Some(None),
        }
    }

    /// Notes a fault at a field, present or not.
    pub fn fault(&self, name: &str, message: impl Into<String>) {
        self.node
            .faults
            .borrow_mut()
            .add(self.field_path(name), message);
    }
}

/// All values, after every item was read.
pub(crate) fn all<T>(items: impl Iterator<Item = Option<T>>) -> Option<Vec<T>> {
    let read: Vec<Option<T>> = items.collect();
    read.into_iter().collect()
}

fn one_of(names: &[&str]) -> String {
    let quoted: Vec<_> = names.iter().map(|n| format!("\"{n}\"")).collect();
    quoted.join(" or ")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn every_fault_is_noted_with_its_path() {
        let document = json!({"a": {"b": [1, "x", null]}, "c": -1, "d": 2.5, "unknown": 0});
        let faults = read(&document, |node| {
            let root = node.object(&["a", "c", "d", "e"])?;
            let list = root
                .required("a")
                .and_then(|a| a.object(&["b"])?.required("b")?.numbers(0, 9));
            let c = root.required("c").and_then(|c| c.positive());
            let d = root.required("d").and_then(|d| d.count(0, 9));
            let e = root.required("e").and_then(|e| e.number());
            Some((list?, c?, d?, e?))
        })
        .unwrap_err();
        let paths: Vec<_> = faults.0.iter().map(|f| f.path.as_str()).collect();
        assert_eq!(paths, ["unknown", "a.b[1]", "a.b[2]", "c", "d", "e"]);
    }

    #[test]
    fn a_whole_number_may_be_written_with_a_point() {
        assert_eq!(read(&json!(3.0), |n| n.count(1, 5)), Ok(3));
        assert!(read(&json!(1e300), |n| n.count(1, 5)).is_err());
        assert!(read(&json!(-1), |n| n.count(0, 9)).is_err());
    }
}

//! A swept field: `step[0].constraints.stretch=1.5,1.85,2.0` or `p_over_mu=0.02..0.07:6`.

use serde_json::{Value, json};

use crate::fault::Faults;

/// The path that stands for the largest pressure over the first unit's shear modulus.
pub const P_OVER_MU: &str = "p_over_mu";
const MAX_VALUES: usize = 1000;

/// A field and its values in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// Path of the field, or [`P_OVER_MU`].
    pub path: String,
    /// Values, no two alike.
    pub values: Vec<Value>,
}

impl Sweep {
    /// Reads `path=a..b:n`, n values at equal distances from a to b, or `path=v1,v2,...`. A value is JSON; what is not JSON
    /// is a text. Commas within brackets, braces and quotes belong to a value.
    ///
    /// # Errors
    /// Faults whose path is that of the field.
    pub fn read(text: &str) -> Result<Self, Faults> {
        let fault = |path: &str, message: String| {
            let mut faults = Faults::default();
            faults.add(path, message);
            Err(faults)
        };
        let Some((path, values)) = text.split_once('=') else {
            return fault(
                text,
                "a sweep is written path=from..to:count or path=value,value".into(),
            );
        };
        let path = path.trim();
        let values = match range(values.trim()) {
            Some(Ok(values)) => values,
            Some(Err(message)) => return fault(path, message),
            None => parts(values).into_iter().map(value).collect(),
        };
        if values.len() > MAX_VALUES {
            return fault(path, format!("a sweep has at most {MAX_VALUES} values"));
        }
        for (k, v) in values.iter().enumerate() {
            if v.as_str() == Some("") {
                return fault(path, format!("value {} of the sweep is empty", k + 1));
            }
            if values[..k].contains(v) {
                return fault(path, format!("the sweep has the value {v} twice"));
            }
            if path == P_OVER_MU && v.as_f64().is_none_or(|v| v <= 0.0) {
                return fault(path, format!("p/mu is a number above zero, found {v}"));
            }
        }
        Ok(Self {
            path: path.into(),
            values,
        })
    }

    /// The assignment of a value that [`super::set`] takes.
    pub fn assignment(&self, value: &Value) -> String {
        format!("{}={}", self.path, shown(value))
    }
}

/// A value as it is written in a sweep.
pub fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// `a..b:n`; `None` for what has another form.
fn range(text: &str) -> Option<Result<Vec<Value>, String>> {
    let (from, rest) = text.split_once("..")?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let from = number(from)?;
    let (to, count) = match rest.split_once(':') {
        Some((to, count)) => (number(to)?, Some(count)),
        None => (number(rest)?, None),
    };
    let Some(count) = count else {
        return Some(Err(format!(
            "a range says how many values it has: {from}..{to}:6"
        )));
    };
    Some(match count.trim().parse::<usize>() {
        Ok(n) if (2..=MAX_VALUES).contains(&n) => Ok((0..n)
            .map(|k| {
                let share = k as f64 / (n - 1) as f64;
                // Both ends exactly, and what lies between to twelve digits, so that 0.02..0.07:6 has 0.03.
                let between = from + (to - from) * share;
                let value = match k {
                    0 => from,
                    _ if k + 1 == n => to,
                    _ => format!("{between:.11e}").parse().unwrap_or(between),
                };
                json!(value)
            })
            .collect()),
        _ => Err(format!(
            "a range has between 2 and {MAX_VALUES} values, found {}",
            count.trim()
        )),
    })
}

fn value(text: &str) -> Value {
    let text = text.trim();
    super::parse_json(text).unwrap_or_else(|_| Value::String(text.into()))
}

/// Splits at the commas that no bracket, brace or quote encloses.
fn parts(text: &str) -> Vec<&str> {
    let (mut depth, mut quoted, mut escaped, mut start) = (0_usize, false, false, 0);
    let mut parts = Vec::new();
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' | '{' => depth += 1,
            ']' | '}' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<Value> {
        Sweep::read(text).unwrap_or_else(|f| panic!("{f}")).values
    }

    #[test]
    fn ranges_have_equal_distances_and_both_ends() {
        assert_eq!(
            values("p_over_mu=0.02..0.07:6"),
            [0.02, 0.03, 0.04, 0.05, 0.06, 0.07].map(|v| json!(v))
        );
        assert_eq!(values("a=3..1:3"), [3.0, 2.0, 1.0].map(|v| json!(v)));
    }

    #[test]
    fn lists_hold_numbers_texts_and_whole_values() {
        let swept = Sweep::read("step[0].constraints.stretch=1.5, off").unwrap();
        assert_eq!(swept.path, "step[0].constraints.stretch");
        assert_eq!(swept.values, [json!(1.5), json!("off")]);
        assert_eq!(
            swept.assignment(&swept.values[1]),
            "step[0].constraints.stretch=off"
        );
        assert_eq!(
            values("actuation.schedule=[[0, 0], [1, 2]],hold"),
            [json!([[0, 0], [1, 2]]), json!("hold")]
        );
        assert_eq!(values("m=\"a,b\",c"), [json!("a,b"), json!("c")]);
        // A path in a file name is no range.
        assert_eq!(values("mesh_file=../a.msh,../b.msh").len(), 2);
    }

    #[test]
    fn what_is_no_sweep_is_a_fault_at_its_path() {
        for (text, path) in [
            ("stretch", "stretch"),
            ("a=1..2", "a"),
            ("a=1..2:1", "a"),
            ("a=1..2:many", "a"),
            ("a=1..1:3", "a"),
            ("a=1,,2", "a"),
            ("a=", "a"),
            ("a=1,1", "a"),
            ("p_over_mu=-0.01", "p_over_mu"),
            ("p_over_mu=0..0.1:3", "p_over_mu"),
            ("p_over_mu=soft", "p_over_mu"),
        ] {
            let faults = Sweep::read(text).unwrap_err();
            assert_eq!(faults.0[0].path, path, "{text}");
        }
    }
}

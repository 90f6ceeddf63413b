//! Overriding one field: `actuation.pressure_kpa=12`, `step[0].optimiser.max_iterations=5`.

use serde_json::{Map, Value};

use crate::fault::Faults;

/// One step of a path.
enum Step<'a> {
    Field(&'a str),
    Index(usize),
}

/// Sets the field of an assignment `path=value`. The value is JSON; what is not JSON is a text. Missing objects on the way
/// are created (an unknown name among them is a fault when the document is read); entries of lists must exist.
pub fn set(document: &mut Value, assignment: &str) -> Result<(), Faults> {
    let fault = |path: &str, message: &str| {
        let mut faults = Faults::default();
        faults.add(path, message);
        faults
    };
    let Some((path, text)) = assignment.split_once('=') else {
        return Err(fault(assignment, "an override is written path=value"));
    };
    let path = path.trim();
    let steps = steps(path).ok_or_else(|| fault(path, "is not a path such as a.b[0].c"))?;
    let mut place = document;
    for step in steps {
        place = match step {
            Step::Field(name) => {
                if place.is_null() {
                    *place = Value::Object(Map::new());
                }
                place
                    .as_object_mut()
                    .ok_or_else(|| {
                        fault(
                            path,
                            &format!("\"{name}\" is looked up in a value that is not an object"),
                        )
                    })?
                    .entry(name)
                    .or_insert(Value::Null)
            }
            Step::Index(index) => place
                .as_array_mut()
                .and_then(|list| list.get_mut(index))
                .ok_or_else(|| fault(path, &format!("there is no entry [{index}]")))?,
        };
    }
    *place = super::parse_json(text.trim()).unwrap_or_else(|_| Value::String(text.trim().into()));
    Ok(())
}

fn steps(path: &str) -> Option<Vec<Step<'_>>> {
    let mut steps = Vec::new();
    for part in path.split('.') {
        let (name, indices) = part.split_at(part.find('[').unwrap_or(part.len()));
        if name.is_empty() {
            return None;
        }
        steps.push(Step::Field(name));
        let mut rest = indices;
        while !rest.is_empty() {
            let (index, tail) = rest.strip_prefix('[')?.split_once(']')?;
            steps.push(Step::Index(index.parse().ok()?));
            rest = tail;
        }
    }
    Some(steps)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn fields_and_entries_are_overridden() {
        let mut d = json!({"a": {"b": [[1, 2], [3, 4]]}, "s": "x"});
        set(&mut d, "a.b[1][0]=7").unwrap();
        set(&mut d, "s=hold").unwrap();
        set(&mut d, "mesh.max_size_mm=2.5").unwrap();
        set(&mut d, "list=[1, 2]").unwrap();
        assert_eq!(
            d,
            json!({"a": {"b": [[1, 2], [7, 4]]}, "s": "hold", "mesh": {"max_size_mm": 2.5}, "list": [1, 2]})
        );
    }

    #[test]
    fn what_cannot_be_set_is_a_fault() {
        let mut d = json!({"a": [1], "s": "x"});
        for bad in ["a[1]=2", "s.b=1", "a", "=1", "a..b=1", "a[x]=1", "a[0=1"] {
            assert!(set(&mut d, bad).is_err(), "{bad}");
        }
        assert_eq!(d, json!({"a": [1], "s": "x"}));
    }
}

//! `--sweep path=values`: the same document at several values of one field; a table, a CSV file and a picture.

use std::path::{Path, PathBuf};

use salp_core::document::{P_OVER_MU, Sweep, set, shown};
use salp_core::fault::Faults;
use salp_core::picture::{Scale, ScatterPicture, ScatterSeries};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::numbers::{Numbers, lines_of};
use crate::output::{number, table, write_file};

/// What one value led to.
pub struct SweptPoint {
    /// The value.
    pub value: Value,
    /// How it ended.
    pub status: String,
    /// Objective.
    pub objective: Option<f64>,
    /// Enclosed area, mm^2, counter-clockwise positive.
    pub area: Option<f64>,
    /// Largest averaged stretch over the path.
    pub max_stretch: Option<f64>,
    /// p/mu and the rest.
    pub numbers: Option<Numbers>,
    /// CPU time, s.
    pub cpu_s: f64,
    /// Further columns, numbers of the same names for all points.
    pub more: Vec<(&'static str, Value)>,
    /// Folder of its own results.
    pub folder: Option<PathBuf>,
}

/// What is drawn against the values.
pub struct Drawn {
    /// Name of the vertical axis.
    pub label: String,
    /// Its value at a point.
    pub of: fn(&SweptPoint) -> Option<f64>,
}

/// A whole sweep.
pub struct Swept<'a> {
    /// What was swept.
    pub sweep: &'a Sweep,
    /// Name of the document.
    pub name: String,
    /// One for each value.
    pub points: Vec<SweptPoint>,
    /// What is drawn.
    pub drawn: Drawn,
    /// Lines under the picture after p/mu, schedule, units and tip.
    pub caption: Vec<String>,
}

/// Reads a document at each value of a sweep; `read` also says what p/mu it is to have, where that is swept.
///
/// # Errors
/// The faults at all values, each with the value that has it.
pub fn read_each<T>(
    base: &Value,
    sweep: &Sweep,
    read: impl Fn(&Value, Option<f64>) -> Result<T, Faults>,
) -> Result<Vec<T>, Failure> {
    let mut faults = Faults::default();
    let mut all = Vec::new();
    for value in &sweep.values {
        let at_value = if sweep.path == P_OVER_MU {
            read(base, value.as_f64())
        } else {
            let mut document = base.clone();
            set(&mut document, &sweep.assignment(value)).and_then(|()| read(&document, None))
        };
        match at_value {
            Ok(it) => all.push(it),
            Err(wrong) => {
                for fault in wrong.0 {
                    let message = format!("{} (with {})", fault.message, sweep.assignment(value));
                    faults.add(fault.path, message);
                }
            }
        }
    }
    Ok(faults.check(all)?)
}

/// Largest pressure (kPa) at a p/mu.
pub fn pressure_kpa(p_over_mu: f64, mu_mpa: f64) -> f64 {
    1e3 * p_over_mu * mu_mpa
}

/// A part of a file name that says a value: letters, digits and a few signs; long ones are cut.
pub fn file_part(text: &str) -> String {
    let sound = |c: char| c.is_ascii_alphanumeric() || "._+-=".contains(c);
    let clean = text.chars().map(|c| if sound(c) { c } else { '-' });
    let clean: String = clean.take(40).collect();
    clean.trim_matches(['-', '.']).to_owned()
}

/// The last name of a path: `stretch` of `step[0].constraints.stretch`.
pub fn last_name(path: &str) -> &str {
    let last = path.rsplit('.').next().unwrap_or(path);
    last.split('[').next().unwrap_or(last)
}

impl Swept<'_> {
    /// Writes `sweep.csv` and `sweep.svg` into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        write_file(&folder.join("sweep.csv"), &self.csv())?;
        write_file(&folder.join("sweep.svg"), &self.picture().svg())
    }

    fn more(&self) -> Vec<&'static str> {
        let first = self.points.first();
        first.map_or_else(Vec::new, |p| p.more.iter().map(|(name, _)| *name).collect())
    }

    fn has_folders(&self) -> bool {
        self.points.iter().any(|p| p.folder.is_some())
    }

    /// The table for people.
    pub fn table(&self) -> String {
        let more = self.more();
        let mut header = vec![
            last_name(&self.sweep.path),
            "status",
            "objective",
            "area (mm\u{b2})",
            "max stretch",
            "p/mu",
        ];
        header.extend(&more);
        header.push("CPU (s)");
        let rows: Vec<Vec<String>> = self
            .points
            .iter()
            .map(|p| {
                let mut row = vec![shown(&p.value), p.status.clone()];
                let p_over_mu = p.numbers.as_ref().map(|n| n.p_over_mu);
                let numbers = [p.objective, p.area, p.max_stretch, p_over_mu];
                row.extend(numbers.map(number));
                row.extend(p.more.iter().map(|(_, value)| shown(value)));
                row.push(number(Some(p.cpu_s)));
                row
            })
            .collect();
        table(&header, &rows)
    }

    fn csv(&self) -> String {
        let mut text =
            "value,status,objective,enclosed_area_mm2,max_stretch,p_over_mu,pressure_kpa,cpu_s"
                .to_owned();
        for name in self.more() {
            text += &format!(",{name}");
        }
        if self.has_folders() {
            text += ",folder";
        }
        text.push('\n');
        let plain = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
        for p in &self.points {
            let numbers = p.numbers.as_ref();
            let mut cells = vec![
                quoted(&shown(&p.value)),
                p.status.clone(),
                plain(p.objective),
                plain(p.area),
                plain(p.max_stretch),
                plain(numbers.map(|n| n.p_over_mu)),
                plain(numbers.map(|n| n.pressure_kpa)),
                p.cpu_s.to_string(),
            ];
            cells.extend(p.more.iter().map(|(_, v)| v.to_string()));
            let folder = p.folder.as_ref().map(|f| quoted(&f.display().to_string()));
            cells.extend(folder);
            text += &cells.join(",");
            text.push('\n');
        }
        text
    }

    /// As a document.
    pub fn document(&self, status: &str) -> Value {
        let point = |p: &SweptPoint| {
            let numbers = p.numbers.as_ref();
            let mut document = json!({
                "value": p.value,
                "status": p.status,
                "objective": p.objective,
                "enclosed_area_mm2": p.area,
                "max_stretch": p.max_stretch,
                "p_over_mu": numbers.map(|n| n.p_over_mu),
                "pressure_kpa": numbers.map(|n| n.pressure_kpa),
                "cpu_s": p.cpu_s,
            });
            for (name, value) in &p.more {
                document[*name] = value.clone();
            }
            if let Some(folder) = &p.folder {
                document["folder"] = json!(folder.display().to_string());
            }
            document
        };
        json!({
            "status": status,
            "sweep": {"path": self.sweep.path, "values": self.sweep.values},
            "points": self.points.iter().map(point).collect::<Vec<_>>(),
        })
    }

    fn picture(&self) -> ScatterPicture {
        // Values that are no numbers stand side by side.
        let by_number = self.points.iter().all(|p| p.value.is_number());
        let x = |k: usize, p: &SweptPoint| {
            let place = if by_number { p.value.as_f64() } else { None };
            place.unwrap_or((k + 1) as f64)
        };
        let points: Vec<([f64; 2], String)> = self
            .points
            .iter()
            .enumerate()
            .filter_map(|(k, p)| Some(([x(k, p), (self.drawn.of)(p)?], shown(&p.value))))
            .collect();
        let missing: Vec<String> = self
            .points
            .iter()
            .filter(|p| (self.drawn.of)(p).is_none())
            .map(|p| format!("{} ({})", shown(&p.value), p.status.replace('_', " ")))
            .collect();
        let numbers: Vec<Numbers> = self
            .points
            .iter()
            .filter_map(|p| p.numbers.clone())
            .collect();
        let mut caption = lines_of(&numbers);
        caption.extend(self.caption.iter().cloned());
        if !missing.is_empty() {
            caption.push(format!("without a value: {}", missing.join(", ")));
        }
        let scales = [0, 1].map(|k| Scale::fitting(points.iter().map(|p| p.0[k])));
        ScatterPicture {
            // The axes say in full what is drawn against what.
            title: format!("{}: sweep over {}", self.name, self.short_label()),
            x_label: self.label(),
            y_label: self.drawn.label.clone(),
            scales: if by_number {
                scales
            } else {
                [Scale::Linear, scales[1]]
            },
            series: vec![ScatterSeries {
                label: self.drawn.label.clone(),
                points,
                joined: by_number,
            }],
            level: None,
            caption,
        }
    }

    fn label(&self) -> String {
        match self.sweep.path.as_str() {
            P_OVER_MU => "p/mu".into(),
            path => path.to_owned(),
        }
    }

    fn short_label(&self) -> String {
        last_name(&self.label()).to_owned()
    }
}

/// What a line says at each value of a sweep: once, with ` / ` between what differs where all have as many words, else
/// each line with its value.
pub fn at_all_values(sweep: &Sweep, lines: &[String]) -> Vec<String> {
    let words: Vec<Vec<&str>> = lines.iter().map(|l| l.split(' ').collect()).collect();
    let Some(first) = words.first() else {
        return Vec::new();
    };
    if words.iter().any(|w| w.len() != first.len()) {
        let said = lines.iter().zip(&sweep.values);
        return said
            .map(|(line, value)| format!("with {}: {line}", sweep.assignment(value)))
            .collect();
    }
    let merged = (0..first.len()).map(|k| {
        let all: Vec<&str> = words.iter().map(|w| w[k]).collect();
        if all.iter().all(|word| *word == all[0]) {
            return all[0].to_owned();
        }
        // A mark behind all of them is said once.
        let mark = |c: char| ";,:)".contains(c);
        let end = &all[0][all[0].trim_end_matches(mark).len()..];
        let bare: Option<Vec<&str>> = all.iter().map(|word| word.strip_suffix(end)).collect();
        bare.map_or_else(|| all.join(" / "), |bare| bare.join(" / ") + end)
    });
    vec![merged.collect::<Vec<_>>().join(" ")]
}

/// A cell of a CSV file.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_between_values_is_said_for_each() {
        let sweep = Sweep::read("stretch=1.5,2.0").unwrap_or_else(|f| panic!("{f:?}"));
        let said = |lines: [&str; 2]| at_all_values(&sweep, &lines.map(str::to_owned));
        assert_eq!(said(["a 1.5; b", "a 1.5; b"]), ["a 1.5; b"]);
        assert_eq!(said(["a 1.5; b", "a 2; b"]), ["a 1.5 / 2; b"]);
        assert_eq!(said(["a 1.5; b", "a 2, b"]), ["a 1.5; / 2, b"]);
        assert_eq!(
            said(["a 1.5", "none"]),
            ["with stretch=1.5: a 1.5", "with stretch=2.0: none"]
        );
    }
}

//! A tension test from a CSV file: nominal stress against stretch or strain, with units in the header.

use crate::fault::Faults;

/// Least and largest stretch that a row may have: what is outside is a wrong unit.
const STRETCHES: [f64; 2] = [0.05, 20.0];
/// Largest absolute stress that a row may have, MPa.
const LARGEST_MPA: f64 = 1e6;
/// Least rows with a stretch other than 1.
const LEAST_ROWS: usize = 3;

/// What a file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TensionTest {
    /// In the order in which they first appear; one without a name where there is no such column.
    pub specimens: Vec<Specimen>,
    /// Columns that were not read.
    pub ignored: Vec<String>,
    /// Lines that begin with `#`, without it: where the data come from, if the file says so.
    pub comments: Vec<String>,
}

/// One strip of material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Specimen {
    /// Its name.
    pub name: String,
    /// Stretch (1) and nominal stress (MPa), in the order of the file.
    pub points: Vec<[f64; 2]>,
}

impl TensionTest {
    /// All rows.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.specimens.iter().flat_map(|s| s.points.iter().copied())
    }

    /// Least and largest stretch, 1 included.
    pub fn stretches(&self) -> [f64; 2] {
        let both = |[low, high]: [f64; 2], [l, _]: [f64; 2]| [low.min(l), high.max(l)];
        self.points().fold([1.0; 2], both)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Column {
    Stretch,
    StrainPercent,
    StressMpa,
    StressKpa,
    Specimen,
}

/// Reads a file: `#` begins a comment, the first other line is the header, cells are separated by `,`, `;` or tabs.
///
/// | column | what |
/// |---|---|
/// | `stretch`, or `strain_percent` (`strain_%`) | length over length at rest, or engineering strain |
/// | `stress_mpa`, or `stress_kpa` | force over area at rest; `nominal_` or `engineering_` may stand before |
/// | `specimen` | name of the strip; may be missing |
///
/// Spaces, brackets and capitals do not count: `Nominal stress (MPa)` is `nominal_stress_mpa`. Other columns are ignored and named.
///
/// # Errors
/// Every fault at once, a row's with its line number.
pub fn read_csv(text: &str) -> Result<TensionTest, Faults> {
    let mut faults = Faults::default();
    let mut test = TensionTest::default();
    let mut header: Option<Header> = None;
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let number = index + 1;
        let line = line.trim_end_matches('\r');
        if let Some(comment) = line.trim_start().strip_prefix('#') {
            test.comments.push(comment.trim().to_owned());
        } else if !line.trim().is_empty() {
            match &header {
                None => match Header::read(line, number, &mut faults) {
                    Some(read) => {
                        test.ignored.clone_from(&read.ignored);
                        header = Some(read);
                    }
                    // Without a header no row can be read.
                    None => return Err(faults),
                },
                Some(header) => {
                    if let Some((name, point)) = header.row(line, number, &mut faults) {
                        let known = test.specimens.iter().position(|s| s.name == name);
                        let at = known.unwrap_or_else(|| {
                            let points = Vec::new();
                            test.specimens.push(Specimen { name, points });
                            test.specimens.len() - 1
                        });
                        test.specimens[at].points.push(point);
                    }
                }
            }
        }
    }
    if header.is_none() {
        faults.add("header", "the file holds no line but comments");
    } else if faults.0.is_empty() {
        let moved = test.points().filter(|[l, _]| *l != 1.0).count();
        if moved < LEAST_ROWS {
            let message = format!(
                "expected at least {LEAST_ROWS} rows with a stretch other than 1, found {moved}"
            );
            faults.add("rows", message);
        } else if test.points().all(|[_, s]| s == 0.0) {
            faults.add("rows", "all stresses are zero");
        }
    }
    faults.check(test)
}

struct Header {
    separator: char,
    columns: Vec<Option<Column>>,
    names: Vec<String>,
    ignored: Vec<String>,
}

impl Header {
    fn read(line: &str, number: usize, faults: &mut Faults) -> Option<Self> {
        let separator = [';', '\t'].into_iter().find(|s| line.contains(*s));
        let separator = separator.unwrap_or(',');
        let path = format!("line {number}");
        let before = faults.0.len();
        let names: Vec<String> = line.split(separator).map(cell).map(str::to_owned).collect();
        let mut columns = Vec::new();
        let mut ignored = Vec::new();
        for name in &names {
            let known = column(name);
            match known {
                Ok(None) => ignored.push(name.clone()),
                Ok(Some(c)) if columns.contains(&Some(c)) => {
                    faults.add(
                        &path,
                        format!("\"{name}\" names the same as a column before it"),
                    );
                }
                Ok(Some(_)) => {}
                Err(message) => faults.add(&path, format!("\"{name}\": {message}")),
            }
            columns.push(known.unwrap_or(None));
        }
        let count = |of: [Column; 2]| columns.iter().flatten().filter(|c| of.contains(c)).count();
        let mut one = |of: [Column; 2], expected: &str| match count(of) {
            1 => {}
            0 if faults.0.len() > before => {}
            0 => faults.add(
                &path,
                format!("expected a column {expected}, found {}", names.join(", ")),
            ),
            _ => faults.add(&path, format!("expected one column {expected}, found both")),
        };
        one(
            [Column::Stretch, Column::StrainPercent],
            "\"stretch\" or \"strain_percent\"",
        );
        one(
            [Column::StressMpa, Column::StressKpa],
            "\"stress_mpa\" or \"stress_kpa\" (nominal stress)",
        );
        (faults.0.len() == before).then_some(Self {
            separator,
            columns,
            names,
            ignored,
        })
    }

    fn row(&self, line: &str, number: usize, faults: &mut Faults) -> Option<(String, [f64; 2])> {
        let cells: Vec<&str> = line.split(self.separator).map(cell).collect();
        if cells.len() != self.columns.len() {
            let message = format!(
                "expected {} cells, found {}",
                self.columns.len(),
                cells.len()
            );
            faults.add(format!("line {number}"), message);
            return None;
        }
        let before = faults.0.len();
        let mut name = String::new();
        let mut point = [f64::NAN; 2];
        for ((text, column), title) in cells.into_iter().zip(&self.columns).zip(&self.names) {
            let path = || format!("line {number}, {title}");
            let Some(column) = column else { continue };
            if *column == Column::Specimen {
                text.clone_into(&mut name);
                if text.is_empty() {
                    faults.add(path(), "the specimen has no name");
                }
                continue;
            }
            let value = match text.parse::<f64>() {
                Ok(value) if value.is_finite() => value,
                _ if text.contains(',') => {
                    faults.add(path(), format!("write \"{text}\" with a decimal point"));
                    continue;
                }
                _ => {
                    faults.add(path(), format!("expected a number, found \"{text}\""));
                    continue;
                }
            };
            match column {
                Column::Stretch | Column::StrainPercent => {
                    let stretch = match column {
                        Column::Stretch => value,
                        _ => 1.0 + value / 100.0,
                    };
                    let [low, high] = STRETCHES;
                    if !(low..=high).contains(&stretch) {
                        let message = format!(
                            "is a stretch of {stretch}, outside of {low} to {high}: is the column's unit right?"
                        );
                        faults.add(path(), message);
                    }
                    point[0] = stretch;
                }
                _ => {
                    let mpa = match column {
                        Column::StressKpa => value / 1000.0,
                        _ => value,
                    };
                    if mpa.abs() > LARGEST_MPA {
                        faults.add(path(), format!("is {mpa} MPa, above {LARGEST_MPA} MPa"));
                    }
                    point[1] = mpa;
                }
            }
        }
        (faults.0.len() == before).then_some((name, point))
    }
}

fn cell(text: &str) -> &str {
    text.trim().trim_matches('"').trim()
}

/// What a header's name says; `None` for a column that is not needed.
fn column(name: &str) -> Result<Option<Column>, &'static str> {
    let letter = |c: char| {
        if c.is_alphanumeric() || c == '%' {
            c.to_ascii_lowercase()
        } else {
            '_'
        }
    };
    let plain: String = name.chars().map(letter).collect();
    let words: Vec<&str> = plain.split('_').filter(|w| !w.is_empty()).collect();
    let nominal = |word: &&str| matches!(*word, "nominal" | "engineering");
    let rest: Vec<&str> = words.iter().copied().filter(|w| !nominal(w)).collect();
    match rest[..] {
        ["stretch"] => Ok(Some(Column::Stretch)),
        ["strain", "percent" | "%"] | ["strain%"] => Ok(Some(Column::StrainPercent)),
        ["stress", "mpa"] => Ok(Some(Column::StressMpa)),
        ["stress", "kpa"] => Ok(Some(Column::StressKpa)),
        ["specimen"] => Ok(Some(Column::Specimen)),
        ["strain"] => Err("names no unit; write strain_percent, or stretch"),
        ["stress"] => Err("names no unit; write stress_mpa or stress_kpa"),
        ["true" | "cauchy", "stress", ..] => {
            Err("is force over the deformed area; give the nominal stress (divide by the stretch)")
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_names_and_separators_are_understood() {
        let plain = read_csv("stretch,stress_mpa\n1.0,0\n1.5,0.3\n2,0.5\n2.5,0.7\n").unwrap();
        let other = read_csv(
            "\u{feff}# by hand\n\"Engineering strain (%)\";Time [s];Nominal Stress [kPa]\r\n0;0;0\r\n\r\n50;1;300\r\n# more\n100;2;500\r\n150;3;700\n",
        )
        .unwrap();
        assert_eq!(plain.specimens, other.specimens);
        assert_eq!(other.comments, ["by hand", "more"]);
        assert_eq!(other.ignored, ["Time [s]"]);
        assert_eq!(plain.stretches(), [1.0, 2.5]);
        let two =
            read_csv("specimen\tstretch\tstress_mpa\na\t1.1\t0.1\nb\t1.2\t0.2\na\t1.3\t0.3\n")
                .unwrap();
        let names: Vec<(&str, usize)> = two
            .specimens
            .iter()
            .map(|s| (s.name.as_str(), s.points.len()))
            .collect();
        assert_eq!(names, [("a", 2), ("b", 1)]);
    }

    #[test]
    fn every_bad_row_is_told_with_its_line() {
        let text = "# made up\nstretch,stress_mpa,specimen\n1,0,a\n1.2,x,a\n-3,0.2,\n1.4,0.3\n400,nan,b\n1.6,0.4,b\n";
        let faults = read_csv(text).unwrap_err();
        let paths: Vec<&str> = faults.0.iter().map(|f| f.path.as_str()).collect();
        assert_eq!(
            paths,
            [
                "line 4, stress_mpa",
                "line 5, stretch",
                "line 5, specimen",
                "line 6",
                "line 7, stretch",
                "line 7, stress_mpa"
            ]
        );
        let said = faults.to_string();
        assert!(
            said.contains("found \"x\"") && said.contains("expected 3 cells, found 2"),
            "{said}"
        );
        assert!(said.contains("is the column's unit right?"), "{said}");
    }

    #[test]
    fn headers_and_files_that_say_too_little_are_faults() {
        for (text, part) in [
            ("", "no line but comments"),
            ("# nothing\n", "no line but comments"),
            ("strain,stress_mpa\n", "write strain_percent"),
            ("stretch,stress\n", "write stress_mpa or stress_kpa"),
            ("stretch,true stress (MPa)\n", "nominal stress"),
            ("a,b\n1,2\n", "expected a column \"stretch\""),
            ("stretch,strain_%,stress_mpa\n", "found both"),
            (
                "stretch,stretch,stress_mpa\n",
                "the same as a column before",
            ),
            ("stretch,stress_mpa\n1,0\n1.2,1\n", "at least 3 rows"),
            (
                "stretch,stress_mpa\n1.1,0\n1.2,0\n1.3,0\n",
                "all stresses are zero",
            ),
            ("stretch;stress_mpa\n1,1;0\n", "decimal point"),
        ] {
            let said = read_csv(text).unwrap_err().to_string();
            assert!(said.contains(part), "{text:?}: {said}");
        }
    }
}

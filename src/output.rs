//! What goes where: one document or text for people on standard output, everything else on standard error.

use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use crate::failure::Failure;

/// How a verb answers.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// One JSON document instead of text.
    pub json: bool,
}

impl Output {
    /// Prints a document, or the text for people.
    pub fn print(self, document: &impl Serialize, text: impl FnOnce() -> String) {
        if self.json {
            // Our documents serialise: text keys, finite numbers.
            self.line(&serde_json::to_string(document).unwrap_or_default());
        } else {
            self.line(text().trim_end());
        }
    }

    /// Prints a line. A reader that went away (`| head`) is no failure.
    #[expect(clippy::unused_self, reason = "reads as the place where output goes")]
    pub fn line(self, line: &str) {
        let mut out = std::io::stdout().lock();
        let _ = writeln!(out, "{line}").and_then(|()| out.flush());
    }

    /// Says why a verb did not end well.
    pub fn failure(self, failure: &Failure) {
        if self.json
            && let Some(document) = failure.document()
        {
            self.line(&document.to_string());
        }
        match failure {
            Failure::BadInput(faults) => {
                for fault in &faults.0 {
                    let path = if fault.path.is_empty() {
                        "document"
                    } else {
                        &fault.path
                    };
                    note(&format!("salp: {path}: {}", fault.message));
                }
            }
            failure => note(&format!("salp: {failure}")),
        }
    }
}

/// A line on standard error.
pub fn note(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Writes a file, its folder created if need be. Readers see the old file or the new one, never a part.
pub fn write_file(path: &Path, content: &str) -> Result<(), Failure> {
    write_bytes(path, content.as_bytes())
}

/// The same of bytes.
pub fn write_bytes(path: &Path, content: &[u8]) -> Result<(), Failure> {
    let failed = |doing| {
        move |source| Failure::File {
            doing,
            path: path.to_owned(),
            source,
        }
    };
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed("create the folder of"))?;
    }
    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(".part");
    std::fs::write(&unfinished, content).map_err(failed("write"))?;
    std::fs::rename(&unfinished, path).map_err(failed("write"))
}

/// A table with a header; the first column to the left, the others to the right.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let width = |column: usize| {
        rows.iter()
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count())
            .chain([header[column].chars().count()])
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let cells: Vec<String> = cells
            .zip(&widths)
            .enumerate()
            .map(|(i, (cell, width))| {
                let blanks = " ".repeat(width.saturating_sub(cell.chars().count()));
                if i == 0 {
                    format!("{cell}{blanks}")
                } else {
                    format!("{blanks}{cell}")
                }
            })
            .collect();
        cells.join("  ").trim_end().to_owned()
    };
    let mut text = line(&mut header.iter().copied());
    for row in rows {
        text.push('\n');
        text += &line(&mut row.iter().map(String::as_str));
    }
    text
}

/// A number with five significant digits at most, or a dash.
pub fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "-".into();
    };
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-3..1e6).contains(&size) {
        let decimals = (4 - size.log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{value:.4e}")
    }
}

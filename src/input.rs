//! Documents from files, with `--set`.

use std::path::{Path, PathBuf};

use clap::Args;
use salp_core::document::{parse_json, parse_toml, set};
use serde_json::Value;

use crate::failure::Failure;

/// A document and its overrides.
#[derive(Args, Clone, Debug)]
pub struct DocumentArguments {
    /// The file: TOML or JSON
    pub file: PathBuf,
    /// Overrides a field, for example --set actuation.pressure_kpa=12
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub overrides: Vec<String>,
}

impl DocumentArguments {
    /// Reads the document and applies the overrides; all that fail are faults.
    pub fn read(&self) -> Result<Value, Failure> {
        let bytes = std::fs::read(&self.file).map_err(|error| {
            Failure::fault("", format!("cannot read {}: {error}", self.file.display()))
        })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| Failure::fault("", format!("{} is not text", self.file.display())))?;
        let is_toml = match self.file.extension().and_then(|e| e.to_str()) {
            Some("toml") => true,
            Some("json") => false,
            _ => !text.trim_start().starts_with('{'),
        };
        let mut document = if is_toml {
            parse_toml(&text)?
        } else {
            parse_json(&text)?
        };
        let mut faults = salp_core::fault::Faults::default();
        for assignment in &self.overrides {
            if let Err(wrong) = set(&mut document, assignment) {
                faults.0.extend(wrong.0);
            }
        }
        Ok(faults.check(document)?)
    }

    /// The folder from which the document's relative paths start.
    pub fn folder(&self) -> &Path {
        match self.file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }
}

//! `salp new`: a commented study.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use crate::failure::Failure;
use crate::output::{Output, write_file};

/// Arguments of `salp new`.
#[derive(Args)]
pub struct New {
    /// The file to write
    #[arg(default_value = "study.toml")]
    file: PathBuf,
    /// What it starts from
    #[arg(long, value_enum, default_value_t = Template::AsymmetricBending)]
    template: Template,
    /// Overwrites the file
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Template {
    /// Our default: exact gradients, stretch limit, both senses
    AsymmetricBending,
    /// The paper's three-unit step with its settings
    Paper,
    /// A sweep of rectangle pairs, the baseline
    Rectangles,
    /// A program as the model
    Command,
}

impl New {
    /// Writes the study.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        if self.file.exists() && !self.force {
            let message = format!("{} exists; --force overwrites it", self.file.display());
            return Err(Failure::fault("file", message));
        }
        let text = match self.template {
            Template::AsymmetricBending => include_str!("../examples/asymmetric-bending.toml"),
            Template::Paper => include_str!("../examples/paper-hierarchical.toml"),
            Template::Rectangles => include_str!("../examples/rectangles.toml"),
            Template::Command => include_str!("new/command.toml"),
        };
        write_file(&self.file, text)?;
        let path = self.file.display().to_string();
        output.print(&json!({ "status": "ok", "file": path }), || {
            format!("wrote {path}; run it with: salp run {path}")
        });
        Ok(())
    }
}

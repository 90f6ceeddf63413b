//! `salp reproduce`: what others have claimed or left open, by our own runs.

mod paper;
mod question;
mod realised;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use salp_core::fault::Faults;

use super::{Setting, interrupted};
use crate::failure::Failure;
use crate::output::Output;
use crate::parallel::cores;

/// Arguments of `salp reproduce`.
#[derive(Args)]
pub struct Reproduce {
    /// What is reproduced
    #[arg(value_enum)]
    what: What,
    /// Coarse meshes, few iterations and small budgets: minutes instead of days; figures and tables say so
    #[arg(long)]
    quick: bool,
    /// Worker processes [default: one per core]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    workers: Option<u16>,
    /// Folder of the results [default: salp-out/reproduce-WHAT, with -quick]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Starts over: removes what earlier runs left in the folder
    #[arg(long)]
    fresh: bool,
    /// Of the question: starts of every arm [default: 20; quick 2]
    #[arg(long, value_parser = clap::value_parser!(u16).range(2..=1000))]
    starts: Option<u16>,
    /// Of the question: most iterations of a run [default: 100; quick 10]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    iterations: Option<u16>,
    /// Of the question: only these arms
    #[arg(long, value_delimiter = ',', value_name = "ID,ID")]
    arms: Vec<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// Ligthart and Venter, Math. Comput. Appl. 2023, 28(2), 47
    Paper,
    /// Whether the hierarchy still pays when gradients are nearly free (docs/open-question.md)
    Question,
}

impl Reproduce {
    /// Runs what has not ended yet, then draws and prints.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let interrupted = interrupted()?;
        let setting = Setting {
            workers: self.workers.map_or_else(cores, usize::from),
            fresh: self.fresh,
            known: None,
            numerical_error: false,
            programs: None,
        };
        let name = match self.what {
            What::Paper => "reproduce-paper",
            What::Question => "reproduce-question",
        };
        let quick = if self.quick { "-quick" } else { "" };
        let folder = || Path::new("salp-out").join(format!("{name}{quick}"));
        let out = self.out.clone().unwrap_or_else(folder);
        let (document, text) = match self.what {
            What::Paper => {
                let mut faults = Faults::default();
                for (path, given) in [
                    ("--starts", self.starts.is_some()),
                    ("--iterations", self.iterations.is_some()),
                    ("--arms", !self.arms.is_empty()),
                ] {
                    if given {
                        faults.add(path, "belongs to salp reproduce question");
                    }
                }
                faults.check(())?;
                paper::Reproduction {
                    quick: self.quick,
                    setting: &setting,
                    out: &out,
                }
                .run(&interrupted)?
            }
            What::Question => question::Question {
                starts: self.starts.map(usize::from),
                fidelity: question::Fidelity {
                    quick: self.quick,
                    iterations: self.iterations,
                },
                only: &self.arms,
                setting: &setting,
                out: &out,
            }
            .run(&interrupted)?,
        };
        output.print(&document, || text);
        Ok(())
    }
}

//! `salp verify`: the problems of which the answer is known.

mod designs;
mod extremes;
mod optimisers;
mod problems;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use salp_core::equilibrium::{Observer, Phase};
use salp_core::geometry::{ChamberCorners, Layout};
use salp_core::mesh::ElementKind;
use salp_core::verify::CpuClock;
use salp_core::verify::designs::SEED;

use crate::failure::Failure;
use crate::output::Output;
use crate::stopwatch::{cpu_seconds, thread_cpu_seconds};

/// Arguments of `salp verify`.
#[derive(Args)]
pub struct Verify {
    /// Stiff and extreme scenes instead: each must end as physics says
    #[arg(long)]
    stress: bool,
    /// Optimisers instead: every method on every published problem, beside what others took
    #[arg(long, conflicts_with_all = ["stress", "designs", "mesher", "element", "tighten"])]
    optimisers: bool,
    /// Random designs instead: N of them at two p/mu, each with a true status
    #[arg(long, value_name = "N", conflicts_with_all = ["stress", "mesher", "only", "element", "tighten"])]
    designs: Option<usize>,
    /// Random designs through the mesher alone: N of them, none may fold
    #[arg(long, value_name = "N", conflicts_with_all = ["stress", "only", "element", "tighten"])]
    mesher: Option<usize>,
    /// Chambers of the designs of --mesher: stacked_pair, side_by_side or three_chambers
    #[arg(long, value_parser = layout, default_value = "stacked_pair", requires = "mesher")]
    layout: Layout,
    /// Corners of each chamber of the designs of --mesher: 4 or 6
    #[arg(long, value_parser = corners, default_value = "4", requires = "mesher")]
    corners: ChamberCorners,
    /// Seed of random designs
    #[arg(long, default_value_t = SEED)]
    seed: u64,
    /// Solves random designs with contact
    #[arg(long, requires = "designs")]
    contact: bool,
    /// Designs that optimisers met: 16 numbers a line, or a ledger of `salp run` [default: shipped ones]
    #[arg(long, value_name = "FILE", requires = "designs")]
    met: Option<PathBuf>,
    /// Writes all lines of --designs as CSV
    #[arg(long, value_name = "FILE", requires = "designs")]
    csv: Option<PathBuf>,
    /// Threads of --designs and --mesher [default: one per core]
    #[arg(long)]
    threads: Option<usize>,
    /// Folder in which --optimisers writes its data profiles, as CSV and as a picture
    #[arg(long, value_name = "DIR", requires = "optimisers")]
    out: Option<PathBuf>,
    /// Only the lines whose problem (or, of --optimisers, whose method) has this in its name
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Only this element
    #[arg(long)]
    element: Option<Element>,
    /// Divides every bound, to see what margin it has
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    tighten: f64,
}

/// A layout by its name in documents.
fn layout(name: &str) -> Result<Layout, String> {
    let found = Layout::NAMES.iter().find(|(known, _)| *known == name);
    found.map(|(_, layout)| *layout).ok_or_else(|| {
        let names = Layout::NAMES.map(|(known, _)| known);
        format!("expected one of {}", names.join(", "))
    })
}

/// Corners of a chamber.
fn corners(text: &str) -> Result<ChamberCorners, String> {
    let count = text.parse::<usize>().map_err(|error| error.to_string())?;
    ChamberCorners::try_from(count).map_err(str::to_owned)
}

/// Elements by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Element {
    /// Bilinear, constant pressure
    Quad4,
    /// Biquadratic, linear pressure
    Quad9,
    /// Triangles with bubble, linear pressure
    Tri7,
}

impl Element {
    fn kind(self) -> ElementKind {
        match self {
            Self::Quad4 => ElementKind::Quad4,
            Self::Quad9 => ElementKind::Quad9,
            Self::Tri7 => ElementKind::Tri7,
        }
    }
}

impl Verify {
    /// Runs what is asked for.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        if !(self.tighten.is_finite() && self.tighten > 0.0) {
            let message = format!("expected a number above 0, found {}", self.tighten);
            return Err(Failure::fault("tighten", message));
        }
        for (path, count) in [
            ("designs", self.designs),
            ("mesher", self.mesher),
            ("threads", self.threads),
        ] {
            if count == Some(0) {
                return Err(Failure::fault(path, "expected at least 1, found 0"));
            }
        }
        match (self.designs, self.mesher) {
            (Some(count), _) => designs::run(&self, count, output),
            (None, Some(count)) => designs::run_mesher(&self, count, output),
            (None, None) if self.optimisers => optimisers::run(&self, output),
            (None, None) if self.stress => extremes::run(&self, output),
            (None, None) => problems::run(&self, output),
        }
    }

    fn threads(&self) -> usize {
        self.threads.unwrap_or_else(crate::parallel::cores)
    }

    fn wants(&self, name: &str) -> bool {
        self.only.as_ref().is_none_or(|only| name.contains(only))
    }

    fn wants_element(&self, element: ElementKind) -> bool {
        self.element.is_none_or(|only| only.kind() == element)
    }
}

/// Name of an element.
fn element_name(element: ElementKind) -> &'static str {
    match element {
        ElementKind::Quad4 => "quad4",
        ElementKind::Quad9 => "quad9",
        ElementKind::Tri7 => "tri7",
    }
}

fn verdict(passed: bool) -> &'static str {
    if passed { "pass" } else { "FAIL" }
}

/// CPU time of this process.
struct ProcessClock;

impl Observer for ProcessClock {
    fn enter(&mut self, _: Phase) {}
}

impl CpuClock for ProcessClock {
    fn cpu_s(&self) -> f64 {
        cpu_seconds()
    }
}

/// CPU time of the calling thread.
struct ThreadClock;

impl Observer for ThreadClock {
    fn enter(&mut self, _: Phase) {}
}

impl CpuClock for ThreadClock {
    fn cpu_s(&self) -> f64 {
        thread_cpu_seconds()
    }
}

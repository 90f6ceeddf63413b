//! `salp report`: the report folder of a study of a coordinator.

use std::path::PathBuf;

use clap::Args;
use salp_core::study::read_study;
use salp_protocol::Axis;
use serde_json::json;

use crate::client::StudyArguments;
use crate::failure::Failure;
use crate::output::Output;
use crate::parallel::cores;
use crate::run::document::Results;
use crate::run::report::{Settings, write};

/// Arguments of `salp report`.
#[derive(Args)]
pub struct Report {
    #[command(flatten)]
    study: StudyArguments,
    /// Folder of the report [default: salp-out/NAME-ID]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Says how far the best design's objective is from that of its model: six more solves
    #[arg(long)]
    numerical_error: bool,
    /// Threads of what is solved beyond the study [default: one per core]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

impl Report {
    /// Writes the report of what has been found so far.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let (client, id) = self.study.open()?;
        let study = read_study(&client.document(&id)?, true)?;
        // From the first claim to the last result.
        let curve = client.curve(&id, Axis::Wall)?;
        let points = curve.restarts.iter().flat_map(|r| &r.points);
        let seconds = points.map(|point| point.t_s).fold(0.0, f64::max);
        let results = Results::fetch(&client, &id, &study, seconds)?;
        let folder = self
            .out
            .unwrap_or_else(|| PathBuf::from("salp-out").join(format!("{}-{}", study.name, id.0)));
        let mut document = results.document(results.view.state);
        let settings = Settings {
            threads: self.threads.map_or_else(cores, usize::from),
            numerical_error: self.numerical_error,
        };
        let text = write(&folder, &study, &results, &mut document, &settings)?;
        let page = folder.join("report.html");
        let document = json!({ "status": "ok", "file": page.display().to_string() });
        output.print(&document, || text);
        Ok(())
    }
}

//! `salp show`: a study with its restarts.

use clap::Args;
use salp_protocol::{RestartState, RestartView, StudyView};
use serde_json::{Value, json};

use crate::client::StudyArguments;
use crate::failure::Failure;
use crate::output::{Output, number, table};

/// Arguments of `salp show`.
#[derive(Args)]
pub struct Show {
    #[command(flatten)]
    study: StudyArguments,
}

impl Show {
    /// Shows a study.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let (client, id) = self.study.open()?;
        let study = client.study(&id)?;
        let restarts = client.restarts(&id)?;
        let mut document = json!(study);
        document["restarts"] = json!(restarts);
        output.print(&document, || text(&study, &restarts));
        Ok(())
    }
}

fn text(study: &StudyView, restarts: &[RestartView]) -> String {
    let counts = &study.counts;
    let mut text = format!(
        "{} {} is {}\nevaluations: {} answered ({} without values, {} alarms), {} out, {} waiting\n",
        study.id,
        study.name,
        study.state,
        counts.answered,
        counts.without_values,
        counts.alarms,
        counts.leased,
        counts.ready
    );
    if counts.bands.evaluations > 0 {
        text += &format!(
            "error bands: {} of {} answered ({} without values)\n",
            counts.bands.answered, counts.bands.evaluations, counts.bands.without_values
        );
    }
    let guesses = &counts.guesses;
    if guesses.answered > 0 {
        text += &format!(
            "guesses: {} answered, {} of them asked for since, {} s of CPU\n",
            guesses.answered,
            guesses.used,
            number(Some(guesses.cpu_s))
        );
    }
    if let Some(why) = &study.failure {
        text += &format!("failed: {why}\n");
    }
    for line in crate::race::lines(&study.steps) {
        text += &format!("{line}\n");
    }
    let rows: Vec<Vec<String>> = restarts
        .iter()
        .map(|restart| {
            let step = study.steps.get(restart.step);
            vec![
                step.map_or_else(|| restart.step.to_string(), |s| s.id.clone()),
                restart.index.to_string(),
                match restart.state {
                    RestartState::Running => "running".into(),
                    RestartState::Waiting => "waiting".into(),
                    RestartState::Done => {
                        stop_reason(&restart.summary).unwrap_or("done").to_owned()
                    }
                },
                restart.evaluations.to_string(),
                number(restart.best.as_ref().map(|best| best.objective)),
                restart.history_sha256.chars().take(12).collect(),
            ]
        })
        .collect();
    text + &table(
        &["step", "restart", "state", "evaluations", "best", "history"],
        &rows,
    )
}

/// Why the optimiser of a restart stopped.
pub fn stop_reason(summary: &Value) -> Option<&str> {
    summary.pointer("/stop/reason")?.as_str()
}

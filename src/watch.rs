//! `salp watch`: follows a study until it ends.

use clap::Args;
use salp_protocol::{Event, StudyState};
use serde_json::Value;

use crate::client::StudyArguments;
use crate::failure::Failure;
use crate::output::{Output, number};

/// How long the coordinator may hold an answer back, s.
const WAIT_S: f64 = 15.0;

/// Arguments of `salp watch`.
#[derive(Args)]
pub struct Watch {
    #[command(flatten)]
    study: StudyArguments,
    /// Only events after this one
    #[arg(long, default_value_t = 0)]
    after: i64,
}

impl Watch {
    /// Prints an event a line until the study has ended.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let (client, id) = self.study.open()?;
        let mut after = self.after;
        loop {
            let ended = client.study(&id)?.state.is_final();
            let events = client.events(&id, after, if ended { 0.0 } else { WAIT_S })?;
            for event in &events {
                after = event.id;
                output.print(event, || text(event));
            }
            if ended && events.is_empty() {
                break;
            }
        }
        let view = client.study(&id)?;
        match view.state {
            StudyState::Failed => Err(Failure::Study(view.failure.unwrap_or_default())),
            _ => Ok(()),
        }
    }
}

fn text(event: &Event) -> String {
    let field = |name: &str| match event.data.get(name) {
        Some(Value::String(text)) => text.clone(),
        Some(Value::Number(value)) if value.is_f64() => number(value.as_f64()),
        Some(value) => value.to_string(),
        None => "-".into(),
    };
    match event.kind.as_str() {
        "evaluation" => format!(
            "step {} restart {}: evaluation {}{} {} {}",
            field("step"),
            field("restart"),
            field("evaluation"),
            event
                .data
                .get("band_of")
                .map_or_else(String::new, |_| format!(" (band of {})", field("band_of"))),
            field("status"),
            field("objective")
        ),
        "restart" => format!(
            "step {} restart {}: {}",
            field("step"),
            field("restart"),
            field("state")
        ),
        "step" => format!("step {}: {}", field("step"), field("state")),
        _ => format!("study: {}", field("state")),
    }
}

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
        let mut steps: Vec<String> = Vec::new();
        loop {
            let view = client.study(&id)?;
            let ended = view.state.is_final();
            steps.clear();
            steps.extend(view.steps.into_iter().map(|step| step.id));
            let events = client.events(&id, after, if ended { 0.0 } else { WAIT_S })?;
            for event in &events {
                after = event.id;
                let event = with_id(event, &steps);
                output.print(&event, || text(&event));
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

/// Events name a step by its index; its id says more.
fn with_id(event: &Event, steps: &[String]) -> Event {
    let mut event = event.clone();
    let index = event.data.get("step").and_then(Value::as_u64);
    if let (Some(index), Some(data)) = (index, event.data.as_object_mut())
        && let Some(id) = steps.get(index as usize)
    {
        data.insert("step_id".to_owned(), Value::from(id.as_str()));
    }
    event
}

fn text(event: &Event) -> String {
    let field = |name: &str| match event.data.get(name) {
        Some(Value::String(text)) => text.clone(),
        Some(Value::Number(value)) if value.is_f64() => number(value.as_f64()),
        Some(value) => value.to_string(),
        None => "-".into(),
    };
    let step = match event.data.get("step_id") {
        Some(_) => field("step_id"),
        None => field("step"),
    };
    let has = |name: &str| event.data.get(name).is_some();
    match event.kind.as_str() {
        "evaluation" => format!(
            "step {step} restart {}: evaluation {}{} {} {}",
            field("restart"),
            field("evaluation"),
            if has("band_of") {
                format!(" (band of {})", field("band_of"))
            } else {
                String::new()
            },
            field("status"),
            field("objective")
        ),
        "restart" => format!(
            "step {step} restart {}: {}",
            field("restart"),
            field("state")
        ),
        "step" if has("reason") => format!("step {step}: {}: {}", field("state"), field("reason")),
        "step" => format!("step {step}: {}", field("state")),
        _ => format!("study: {}", field("state")),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn steps_say_their_name_and_why_they_are_blocked() {
        let told = |kind: &str, data: Value| {
            let event = Event {
                id: 1,
                kind: kind.to_owned(),
                created_ms: 0,
                data,
            };
            text(&with_id(
                &event,
                &["layout".to_owned(), "nine-units".to_owned()],
            ))
        };
        let why = "step layout found nothing to hand on";
        let blocked = json!({"step": 1, "state": "blocked", "reason": why});
        assert_eq!(
            told("step", blocked),
            "step nine-units: blocked: step layout found nothing to hand on"
        );
        let waits = json!({"step": 1, "state": "waiting"});
        assert_eq!(told("step", waits), "step nine-units: waiting");
        let band = json!({"step": 0, "restart": 2, "evaluation": "e-9", "band_of": "e-4", "status": "ok", "objective": 1.5});
        assert_eq!(
            told("evaluation", band),
            "step layout restart 2: evaluation e-9 (band of e-4) ok 1.5"
        );
        assert_eq!(told("state", json!({"state": "done"})), "study: done");
    }
}

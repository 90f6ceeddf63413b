//! `salp resume`: a paused study, or one restart that the competition of its step stopped.

use clap::Args;

use crate::client::StudyArguments;
use crate::command::Command;
use crate::failure::Failure;
use crate::output::Output;

/// Arguments of `salp resume`.
#[derive(Args)]
pub struct Resume {
    #[command(flatten)]
    study: StudyArguments,
    /// Index of a restart that was not promoted, dominated or merged: it goes on to its own end
    #[arg(long)]
    restart: Option<usize>,
    /// Id of the restart's step; the only one by default
    #[arg(long, requires = "restart")]
    step: Option<String>,
}

impl Resume {
    /// Resumes and prints what goes on.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let Some(index) = self.restart else {
            return Command::of(self.study).run("resume", output);
        };
        let (client, id) = self.study.open()?;
        let steps = client.study(&id)?.steps;
        let step = match &self.step {
            Some(name) => steps.iter().position(|step| step.id == *name),
            None => (steps.len() == 1).then_some(0),
        };
        let Some(step) = step else {
            let ids: Vec<&str> = steps.iter().map(|step| step.id.as_str()).collect();
            let message = format!("name one of the study's steps: {}", ids.join(", "));
            return Err(Failure::fault("step", message));
        };
        let view = client.resume_restart(&id, step, index)?;
        output.print(&view, || {
            format!(
                "restart {} of step {} goes on after {} evaluations",
                view.index, steps[step].id, view.evaluations
            )
        });
        Ok(())
    }
}

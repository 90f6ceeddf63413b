//! `salp cancel`, `salp pause`, and `salp resume` of a whole study.

use clap::Args;

use crate::client::StudyArguments;
use crate::failure::Failure;
use crate::output::Output;

/// Arguments of the commands to a study.
#[derive(Args)]
pub struct Command {
    #[command(flatten)]
    study: StudyArguments,
}

impl Command {
    /// A command to a study.
    pub fn of(study: StudyArguments) -> Self {
        Self { study }
    }

    /// Commands and prints the study.
    pub fn run(self, command: &str, output: Output) -> Result<(), Failure> {
        let (client, id) = self.study.open()?;
        let view = client.command(&id, command)?;
        output.print(&view, || {
            format!("{} {} is {}", view.id, view.name, view.state)
        });
        Ok(())
    }
}

//! `salp cancel`, `salp pause`, `salp resume`.

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

//! `salp submit`: a study to a coordinator.

use clap::Args;
use salp_core::study::read_study;

use crate::accuracy::{needs_meshes, with_meshes};
use crate::client::ClientArguments;
use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::output::Output;

/// Arguments of `salp submit`.
#[derive(Args)]
pub struct Submit {
    #[command(flatten)]
    study: DocumentArguments,
    /// Submitting again under the same key answers the same study
    #[arg(long)]
    idempotency_key: Option<String>,
    #[command(flatten)]
    client: ClientArguments,
}

impl Submit {
    /// Checks the study here, submits it, prints its id.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let mut document = self.study.read()?;
        // Whether programs are allowed is the coordinator's to say.
        let study = read_study(&document, true)?;
        if needs_meshes(&study) {
            document = with_meshes(&study)?.document();
        }
        let client = self.client.client()?;
        let created = client.submit(&document, self.idempotency_key.as_deref())?;
        output.print(&created, || created.id.to_string());
        Ok(())
    }
}

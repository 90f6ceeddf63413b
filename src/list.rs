//! `salp ls`: the studies of a coordinator.

use clap::Args;
use salp_protocol::StudyPage;

use crate::client::ClientArguments;
use crate::failure::Failure;
use crate::output::{Output, number, table};

/// Arguments of `salp ls`.
#[derive(Args)]
pub struct List {
    #[command(flatten)]
    client: ClientArguments,
}

impl List {
    /// Lists all studies, latest first.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let client = self.client.client()?;
        let mut page = client.studies(None)?;
        while let Some(cursor) = page.next.take() {
            let next = client.studies(Some(&cursor))?;
            page.studies.extend(next.studies);
            page.next = next.next;
        }
        output.print(&page, || text(&page));
        Ok(())
    }
}

fn text(page: &StudyPage) -> String {
    let rows: Vec<Vec<String>> = page
        .studies
        .iter()
        .map(|study| {
            vec![
                study.id.to_string(),
                study.name.clone(),
                study.state.to_string(),
                format!("{}/{}", study.counts.restarts_done, study.counts.restarts),
                study.counts.answered.to_string(),
                number(study.best.as_ref().map(|best| best.objective)),
            ]
        })
        .collect();
    table(
        &["study", "name", "state", "restarts", "evaluations", "best"],
        &rows,
    )
}

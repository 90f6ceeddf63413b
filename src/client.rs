//! Reaching a coordinator.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use salp_protocol::StudyId;
use salp_worker::Client;

use crate::failure::Failure;

/// Where `salp serve` listens by default.
pub const DEFAULT_URL: &str = "http://127.0.0.1:7257";

/// Which coordinator.
#[derive(Args, Clone, Debug)]
pub struct ClientArguments {
    /// Address of the coordinator
    #[arg(long, env = "SALP_URL", default_value = DEFAULT_URL)]
    pub url: String,
    /// File with the coordinator's token; else the environment's SALP_TOKEN
    #[arg(long)]
    pub token_file: Option<PathBuf>,
}

/// A study of a coordinator.
#[derive(Args, Clone, Debug)]
pub struct StudyArguments {
    /// Id of the study
    pub study: String,
    #[command(flatten)]
    pub client: ClientArguments,
}

impl ClientArguments {
    /// A client whose requests end after a minute.
    pub fn client(&self) -> Result<Client, Failure> {
        if !self.url.starts_with("http://") || self.url.len() == "http://".len() {
            let message = format!("\"{}\" is not an address like {DEFAULT_URL}", self.url);
            return Err(Failure::fault("url", message));
        }
        let token = token(self.token_file.as_ref())?;
        Ok(Client::new(
            &self.url,
            token.as_deref(),
            Duration::from_mins(1),
        ))
    }
}

impl StudyArguments {
    /// The client and the id, which goes into a path of the API.
    pub fn open(&self) -> Result<(Client, StudyId), Failure> {
        let sound = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.study.is_empty() || !self.study.chars().all(sound) {
            let message = format!("there is no study {}", self.study);
            return Err(Failure::fault("study", message));
        }
        Ok((self.client.client()?, StudyId(self.study.clone())))
    }
}

/// The token of a file, else of the environment.
pub fn token(file: Option<&PathBuf>) -> Result<Option<String>, Failure> {
    match file {
        Some(file) => std::fs::read_to_string(file).map(Some).map_err(|error| {
            Failure::fault(
                "token_file",
                format!("cannot read {}: {error}", file.display()),
            )
        }),
        None => Ok(std::env::var("SALP_TOKEN").ok()),
    }
}

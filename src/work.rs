//! `salp work`: a worker.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use salp_worker::WorkerConfig;
use salp_worker::stop::Stop;

/// Arguments of `salp work`.
#[derive(Args)]
pub struct Work {
    /// Address of the coordinator
    url: String,
    /// File with the coordinator's token; else the environment's SALP_TOKEN
    #[arg(long)]
    token_file: Option<PathBuf>,
    /// May start the programs of studies
    #[arg(long)]
    allow_commands: bool,
    /// Folder in which programs are looked up: that of the study file
    #[arg(long, default_value = ".")]
    folder: PathBuf,
    /// Ends when the standard input ends
    #[arg(long)]
    die_with_parent: bool,
}

impl Work {
    /// Works until told to end.
    pub fn run(self) -> Result<(), Box<dyn Error>> {
        let mut config = WorkerConfig::new(self.url);
        config.token = match (&self.token_file, std::env::var("SALP_TOKEN")) {
            (Some(file), _) => Some(std::fs::read_to_string(file)?),
            (None, Ok(text)) => Some(text),
            (None, Err(_)) => None,
        };
        if self.allow_commands {
            config.commands = Some(self.folder.canonicalize()?);
        }
        config.die_with_parent = self.die_with_parent;
        salp_worker::run(&config, &Stop::default())?;
        Ok(())
    }
}

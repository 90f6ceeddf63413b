//! `salp work`: workers.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use clap::Args;
use rustix::process::{Pid, Signal, kill_process};
use salp_worker::WorkerConfig;
use salp_worker::stop::Stop;
use serde_json::json;

use crate::client::{DEFAULT_URL, token};
use crate::failure::Failure;
use crate::output::Output;

/// Arguments of `salp work`.
#[derive(Args)]
pub struct Work {
    /// Address of the coordinator
    #[arg(env = "SALP_URL", default_value = DEFAULT_URL)]
    url: String,
    /// Number of worker processes
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    count: u16,
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
    /// Works until told to end. With `--count` this process is one of the workers, and the others end with it.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let mut config = WorkerConfig::new(&self.url);
        config.token = token(self.token_file.as_ref())?;
        if self.allow_commands {
            config.commands = Some(self.folder.canonicalize().map_err(|error| {
                Failure::fault(
                    "folder",
                    format!("cannot open {}: {error}", self.folder.display()),
                )
            })?);
        }
        config.die_with_parent = self.die_with_parent;
        let mut others = (1..self.count)
            .map(|_| self.another())
            .collect::<Result<Vec<Child>, Failure>>()?;
        let ended = salp_worker::run(&config, &Stop::default());
        for other in &mut others {
            // It ends after its evaluation, like this one. One that has ended already is not signalled: its id may be
            // another's by now.
            if matches!(other.try_wait(), Ok(None)) {
                let _ = kill_process(Pid::from_child(other), Signal::TERM);
            }
            let _ = other.wait();
        }
        let salp_worker::WorkerEnd::Stopped { evaluations } = ended?;
        output.print(
            &json!({ "status": "ok", "evaluations": evaluations }),
            || format!("ended after {evaluations} evaluations"),
        );
        Ok(())
    }

    /// Another worker as a child, with the same arguments and environment. It is in this process's group, so signals of
    /// a terminal reach both.
    fn another(&self) -> Result<Child, Failure> {
        let refused = |source| Failure::System {
            doing: "start a worker",
            source,
        };
        let mut command = Command::new(std::env::current_exe().map_err(refused)?);
        command.args(["work", &self.url, "--die-with-parent"]);
        if let Some(file) = &self.token_file {
            command.arg("--token-file").arg(file);
        }
        if self.allow_commands {
            command
                .arg("--allow-commands")
                .arg("--folder")
                .arg(&self.folder);
        }
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .map_err(refused)
    }
}

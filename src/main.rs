//! The one executable: `salp`. One file per verb; none has logic of its own.

mod serve;
mod work;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tracing_subscriber::EnvFilter;

/// Designs soft pneumatic actuators.
#[derive(Parser)]
#[command(name = "salp", version)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Runs the coordinator.
    Serve(serve::Serve),
    /// Runs a worker for a coordinator.
    Work(work::Work),
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let filter = EnvFilter::try_from_env("SALP_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .init();
    let ended = match arguments.verb {
        Verb::Serve(serve) => serve.run(),
        Verb::Work(work) => work.run(),
    };
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("salp: {failure}");
            ExitCode::FAILURE
        }
    }
}

//! The one executable: `salp`. One file per verb; none has logic of its own.

mod accuracy;
mod client;
mod command;
mod companions;
mod compare;
mod converge;
mod curve;
mod failure;
mod gradient;
mod input;
mod list;
mod map;
mod material;
mod new;
mod numbers;
mod numerical_error;
mod output;
mod parallel;
mod race;
mod raster;
mod reduce;
mod report;
mod restarts;
mod resume;
mod run;
mod sensitivities;
mod serve;
mod shape;
mod show;
mod solve;
mod stopwatch;
mod submit;
mod sweep;
mod verify;
mod watch;
mod work;

use std::io::IsTerminal as _;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tracing_subscriber::EnvFilter;

use failure::Failure;
use output::Output;

/// Designs soft pneumatic actuators.
///
/// Exit codes: 0 done, 1 a failed run, 2 bad input, 3 paused or interrupted.
#[derive(Parser)]
#[command(name = "salp", version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
    /// Prints one JSON document on standard output (JSON lines for `watch`); logs stay on standard error
    #[arg(long, global = true)]
    json: bool,
    /// Logs as JSON lines
    #[arg(long, global = true)]
    log_json: bool,
}

#[derive(Subcommand)]
enum Verb {
    /// One finite-element analysis of a scene
    Solve(solve::Solve),
    /// A scene's objective and its gradient; with --check held against central differences
    Gradient(gradient::Gradient),
    /// Writes a commented study
    New(new::New),
    /// A whole study on this machine: coordinator, workers, report
    Run(run::Run),
    /// The coordinator
    Serve(serve::Serve),
    /// The tip over the plane of two pressures, and the area of any schedule on it
    Map(map::Map),
    /// Studies at equal CPU time: best of N, chances, expected CPU time to a target
    Compare(compare::Compare),
    /// Error against run time of a scene: meshes, elements, tolerances, load steps
    Converge(converge::Converge),
    /// The paper's reduced model of a scene's unit, fitted, and held against chains of three and nine
    Reduce(reduce::Reduce),
    /// The paper's methods by our own runs: its table and figures, with the differences listed
    Reproduce(run::reproduce::Reproduce),
    /// Published problems, the limits of the solver, random designs: each line against what is right
    Verify(verify::Verify),
    /// Workers for a coordinator
    Work(work::Work),
    /// Submits a study to a coordinator
    Submit(submit::Submit),
    /// Lists the studies of a coordinator
    Ls(list::List),
    /// Shows a study with its restarts
    Show(show::Show),
    /// Follows a study until it ends
    Watch(watch::Watch),
    /// Run time against objective of a study
    Curve(curve::CurveVerb),
    /// Writes the report of a study: one page, pictures, tables
    Report(report::Report),
    /// Cancels a study
    Cancel(command::Command),
    /// Pauses a study: nothing more is handed out
    Pause(command::Command),
    /// Resumes a paused study, or with --restart one restart that the competition of its step stopped
    Resume(resume::Resume),
    /// The material records
    Material(material::Material),
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refuse(&error),
    };
    start_logs(&arguments);
    let output = Output {
        json: arguments.json,
    };
    let ended = match arguments.verb {
        Verb::Solve(verb) => verb.run(output),
        Verb::Gradient(verb) => verb.run(output),
        Verb::Map(verb) => verb.run(output),
        Verb::Compare(verb) => verb.run(output),
        Verb::Converge(verb) => verb.run(output),
        Verb::Reduce(verb) => verb.run(output),
        Verb::Reproduce(verb) => verb.run(output),
        Verb::Verify(verb) => verb.run(output),
        Verb::New(verb) => verb.run(output),
        Verb::Run(verb) => verb.run(output),
        Verb::Serve(verb) => verb.run(output),
        Verb::Work(verb) => verb.run(output),
        Verb::Submit(verb) => verb.run(output),
        Verb::Ls(verb) => verb.run(output),
        Verb::Show(verb) => verb.run(output),
        Verb::Watch(verb) => verb.run(output),
        Verb::Curve(verb) => verb.run(output),
        Verb::Report(verb) => verb.run(output),
        Verb::Cancel(verb) => verb.run("cancel", output),
        Verb::Pause(verb) => verb.run("pause", output),
        Verb::Resume(verb) => verb.run(output),
        Verb::Material(verb) => verb.run(output),
    };
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            output.failure(&failure);
            failure.exit_code()
        }
    }
}

/// Help and version are answers; anything else is bad input, told like that of a document.
fn refuse(error: &clap::Error) -> ExitCode {
    // A reader that went away is no failure.
    let _ = error.print();
    if !error.use_stderr() {
        return ExitCode::SUCCESS;
    }
    let json = std::env::args_os().any(|argument| argument == "--json");
    let said = error.to_string();
    let said: Vec<&str> = said
        .lines()
        .take_while(|l| !l.is_empty())
        .map(str::trim)
        .collect();
    let said = said.join(" ");
    let failure = Failure::fault("arguments", said.trim_start_matches("error: "));
    if let (true, Some(document)) = (json, failure.document()) {
        Output { json }.line(&document.to_string());
    }
    failure.exit_code()
}

/// Logs go to standard error. `SALP_LOG` filters them; coordinator and workers say what they do, other verbs only what
/// goes wrong.
fn start_logs(arguments: &Arguments) {
    // A slow query on a machine with other work to do is no news, and its text nobody's.
    let usual = match arguments.verb {
        Verb::Serve(_) | Verb::Work(_) => "info,sqlx=error",
        // Its problems are what they are.
        Verb::Verify(_) => "error",
        _ => "warn,sqlx=error",
    };
    let filter = EnvFilter::try_from_env("SALP_LOG").unwrap_or_else(|_| EnvFilter::new(usual));
    let logs = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    if arguments.log_json {
        logs.json().init();
    } else {
        logs.init();
    }
}

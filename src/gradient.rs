//! `salp gradient`: objective and its gradient; `--check` holds it against central differences.

use clap::Args;
use salp_core::evaluate::{SceneOptions, SceneStatus, check_bound, check_gradient, solve_scene};
use salp_core::scene::read_scene;
use serde_json::json;

use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::output::{Output, number, table};
use crate::sensitivities;
use crate::solve::{ended_well, text, with_seconds};
use crate::stopwatch::Stopwatch;

/// Arguments of `salp gradient`.
#[derive(Args)]
pub struct Gradient {
    #[command(flatten)]
    scene: DocumentArguments,
    /// Sweeps central differences against the adjoint
    #[arg(long)]
    check: bool,
}

impl Gradient {
    /// Solves, differentiates and prints.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let scene = read_scene(&self.scene.read()?, self.scene.folder())?;
        if scene.objective.is_none() {
            return Err(Failure::fault("objective", "a gradient needs one"));
        }
        let options = SceneOptions {
            gradient: true,
            ..SceneOptions::default()
        };
        let mut stopwatch = Stopwatch::start();
        let solution = solve_scene(&scene, &options, &mut stopwatch)?;
        let mut document = with_seconds(&solution.answer, stopwatch.document());
        let gradient = solution.gradient();
        document["gradient"] = json!(gradient);
        let sensitivities = sensitivities::of(&scene, &solution, false);
        document["sensitivities"] = json!(sensitivities);
        let mut lines = Vec::new();
        if self.check && solution.answer.status == SceneStatus::Ok {
            let (_, check) = check_gradient(&scene, &mut Stopwatch::start())?;
            document["check"] = json!(check);
            lines = check;
        }
        output.print(&document, || {
            let mut text = text(&scene, &solution.answer);
            text += &format!("\ngradient {}", document["gradient"]);
            let unit = scene.objective.as_ref().map_or("", |goal| goal.unit());
            for line in sensitivities
                .iter()
                .flat_map(|s| sensitivities::lines(s, unit))
            {
                text += &format!("\n{line}");
            }
            if !lines.is_empty() {
                let rows: Vec<Vec<String>> = lines
                    .iter()
                    .map(|line| {
                        vec![
                            line.index.to_string(),
                            format!("{:.10e}", line.adjoint),
                            format!("{:.1e}", line.best_error),
                        ]
                    })
                    .collect();
                text.push('\n');
                text += &table(&["variable", "adjoint", "best error"], &rows);
            }
            let seconds = &document["seconds"];
            let part = |name: &str| number(seconds[name].as_f64());
            text + &format!(
                "\nforward {} s, adjoint {} s",
                part("forward"),
                part("adjoint")
            )
        });
        ended_well(&solution.answer)?;
        // Without a finite error the check has failed as well.
        if lines
            .iter()
            .all(|line| line.best_error <= check_bound(&solution.answer))
        {
            Ok(())
        } else {
            Err(Failure::Run(
                "the gradient differs from the differences by more than its bound",
            ))
        }
    }
}

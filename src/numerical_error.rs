//! The numerical error of an objective: what is solved for it, and how it is told.

use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::numerical_error::{NumericalError, Solve, variants};
use salp_core::evaluate::{SceneAnswer, SceneStatus};
use salp_core::geometry::MeshPlan;
use salp_core::scene::Scene;

use crate::failure::Failure;
use crate::output::{note, number, table};
use crate::parallel::in_parallel;

/// Solves what a numerical error needs beside the answer `own` of a scene, on some threads.
pub fn numerical_error(
    scene: &Scene,
    plan: Option<&MeshPlan>,
    own: &SceneAnswer,
    threads: usize,
) -> Result<NumericalError, Failure> {
    let variants = variants(scene, plan, own)?;
    let solves = in_parallel(
        threads.min(variants.len()),
        variants.len(),
        |index| variants[index].solve(&mut Unobserved),
        |_, solve| {
            if let Ok(solve) = solve {
                note(&format!(
                    "{}: {} unknowns, objective {}{}",
                    solve.setting,
                    solve.dofs,
                    number(solve.value),
                    if solve.status == SceneStatus::Ok {
                        ""
                    } else {
                        " (no complete path)"
                    }
                ));
            }
        },
    );
    let solves: Vec<Solve> = solves.into_iter().collect::<Result<_, _>>()?;
    Ok(NumericalError::of(scene, own, &solves))
}

/// A table of the terms and the sentence.
pub fn lines(error: &NumericalError) -> Vec<String> {
    let mut lines = Vec::new();
    if !error.terms.is_empty() {
        let rows: Vec<Vec<String>> = error.terms.iter().map(row).collect();
        let unit = format!("error ({})", error.unit);
        let header = ["error of", &unit, "%", "objective", "solved with"];
        lines.push(table(&header, &rows));
    }
    lines.push(error.sentence.clone());
    lines
}

fn row(term: &salp_core::evaluate::numerical_error::ErrorTerm) -> Vec<String> {
    let joined = |texts: Vec<String>| texts.join("; ");
    let mut with: Vec<String> = term.solves.iter().map(|s| s.setting.clone()).collect();
    with.extend(term.order.map(|order| format!("order {order:.2}")));
    with.extend(term.why.clone());
    vec![
        term.source.name().to_owned(),
        number(term.error),
        number(term.error_percent),
        joined(term.solves.iter().map(|s| number(s.value)).collect()),
        joined(with),
    ]
}

//! How restarts competed, in words.

use salp_core::study::race::{LEAST_PAIRS, RaceSummary};
use salp_protocol::StepView;

use crate::output::number;

/// A line for each rung, for the checks and for what was brought back, of the steps whose restarts compete.
pub fn lines(steps: &[StepView]) -> Vec<String> {
    let many = steps.len() > 1;
    let of_step = |step: &StepView| {
        let said = step.race.as_ref().map_or_else(Vec::new, words);
        let name = step.id.clone();
        said.into_iter().map(move |line| {
            if many {
                format!("step {name}: {line}")
            } else {
                line
            }
        })
    };
    steps.iter().flat_map(of_step).collect()
}

fn words(race: &RaceSummary) -> Vec<String> {
    let mut lines = Vec::new();
    for (k, rung) in race.rungs.iter().enumerate() {
        let agreement = match rung.correlation {
            Some(c) => match c.spearman {
                Some(rho) => format!(
                    "rank correlation with the next fidelity {} over {} designs",
                    number(Some(rho)),
                    c.pairs
                ),
                None => format!("{} designs equal at one of the fidelities", c.pairs),
            },
            None => "no rank correlation with the next fidelity yet".into(),
        };
        let off = rung.off_from.map_or_else(String::new, |from| {
            format!("; below the least one over {LEAST_PAIRS} designs or more: the race is off from restart {from} on, all later ones went up")
        });
        lines.push(format!(
            "race, rung {}: {} restarts came to its end, {} went up ({}), {} merged; {agreement}{off}",
            k + 1,
            rung.reached,
            rung.promoted.len(),
            list(&rung.promoted),
            rung.merged
        ));
    }
    let checks = &race.checks;
    if checks.decided > 0 {
        lines.push(format!(
            "checks at the study's fidelity: {}; dominated: {}; merged with an earlier restart: {}",
            checks.decided,
            list(&checks.dominated),
            list(&checks.merged)
        ));
    }
    if !race.resumed.is_empty() {
        lines.push(format!(
            "brought back by hand after they were stopped, out of competition: {}",
            list(&race.resumed)
        ));
    }
    lines
}

fn list(indices: &[usize]) -> String {
    if indices.is_empty() {
        return "none".into();
    }
    let words: Vec<String> = indices.iter().map(usize::to_string).collect();
    words.join(", ")
}

//! The best distinct designs of a step with their errors: what it hands on, and beyond that the best of its restarts.

use salp_core::hierarchy::StepResult;
use salp_core::hierarchy::candidate::DISTINCT;
use salp_core::hierarchy::optima::{Optimum, Standing, standings};
use salp_core::study::{Study, band_half_width};
use salp_protocol::{Candidate, EvaluationRow, StepView};
use serde_json::{Value, json};

use super::document::Results;
use super::steps;
use crate::output::{number, table};

/// Distinct designs that a report lists of a step that hands on fewer.
const LISTED: usize = 5;

/// A design in the list.
pub struct Listed {
    x: Vec<f64>,
    /// Of a sequence of units which is which, from 1.
    sequence: Option<Vec<usize>>,
    objective: f64,
    max_violation: Option<f64>,
    constraints: Option<Vec<f64>>,
    restart: usize,
    half_width: Option<f64>,
    standing: Standing,
    /// Whether the step hands it on; of a step that has not ended all are listed so.
    handed_on: bool,
}

/// The list of a step, the best first. `ledger` and `bands` hold the evaluations of the study.
pub fn of_step(
    study: &Study,
    (step, view): (usize, &StepView),
    candidates: &[Candidate],
    ledger: &[EvaluationRow],
    bands: &[EvaluationRow],
) -> Vec<Listed> {
    let given = study.given(step, &steps::inputs(view).given);
    let result = view.result.clone();
    let result = result.and_then(|r| serde_json::from_value::<StepResult>(r).ok());
    let of_restarts = candidates.iter().filter(|c| c.step == step);
    let mut chosen: Vec<(Vec<f64>, f64, usize, bool)> = Vec::new();
    if let Some(result) = &result {
        let handed_on = result.candidates.iter();
        chosen.extend(handed_on.map(|c| (c.x.clone(), c.objective, c.restart, true)));
    }
    for c in of_restarts {
        let is_distinct = |(x, ..): &(Vec<f64>, f64, usize, bool)| {
            let distance = given.scaled_distance(step, &c.x, x);
            distance.is_ok_and(|distance| distance > DISTINCT)
        };
        if result.is_none() || (chosen.len() < LISTED && chosen.iter().all(is_distinct)) {
            chosen.push((c.x.clone(), c.objective, c.restart, result.is_none()));
        }
    }
    let mut listed: Vec<Listed> = chosen
        .into_iter()
        .map(|(x, objective, restart, handed_on)| {
            let mut rows = ledger.iter();
            let row = rows.find(|r| {
                (r.step, r.restart) == (step, restart) && r.x == x && r.fidelity.is_none()
            });
            let of = row.map(|row| &row.evaluation);
            let band = bands
                .iter()
                .find(|b| of.is_some() && b.band_of.as_ref() == of);
            let second = band.and_then(|band| band.objective);
            Listed {
                half_width: second.map(|second| band_half_width(objective, second)),
                max_violation: row.and_then(|row| row.max_violation),
                constraints: row.and_then(|row| Some(row.outcome.as_ref()?.constraints.clone())),
                sequence: given.sequence(step, &x),
                x,
                objective,
                restart,
                standing: Standing {
                    distance: 0.0,
                    same_as: None,
                },
                handed_on,
            }
        })
        .collect();
    let optima: Vec<Optimum<'_>> = listed.iter().map(Listed::optimum).collect();
    let found = standings(&given, step, &optima).unwrap_or_default();
    for (listed, standing) in listed.iter_mut().zip(found) {
        listed.standing = standing;
    }
    listed
}

impl Listed {
    fn optimum(&self) -> Optimum<'_> {
        Optimum {
            x: &self.x,
            objective: self.objective,
            half_width: self.half_width,
        }
    }

    /// As `candidates` of the document list it; `None` of one that is not handed on.
    pub fn document(&self) -> Option<Value> {
        let band = |half: f64| [self.objective - half, self.objective + half];
        self.handed_on.then(|| {
            json!({
                "x": self.x,
                "sequence": self.sequence,
                "objective": self.objective,
                "constraints": self.constraints,
                "max_violation": self.max_violation,
                "restart": self.restart,
                "band": self.half_width.map(band),
                "distance": self.standing.distance,
                "same_as": self.standing.same_as,
            })
        })
    }

    fn cells(&self, place: usize, label: String) -> Vec<String> {
        let same = self.standing.same_as;
        vec![
            format!("{}{}", place + 1, if self.handed_on { "" } else { " *" }),
            label,
            number(Some(self.objective)),
            number(self.half_width),
            number(self.max_violation),
            number(Some(self.standing.distance)),
            same.map_or_else(|| "-".to_owned(), |k| (k + 1).to_string()),
        ]
    }
}

/// A table of the best distinct designs of each step that has several.
pub fn tables(study: &Study, results: &Results) -> Vec<String> {
    let of_step = |(step, listed): (usize, &Vec<Listed>)| {
        if listed.len() < 2 {
            return None;
        }
        let rows: Vec<Vec<String>> = (listed.iter().enumerate())
            .map(|(k, l)| {
                let restart = || results.label(study, step, l.restart);
                let sequence = l.sequence.as_ref();
                l.cells(k, sequence.map_or_else(restart, |s| steps::spelt(s)))
            })
            .collect();
        let header = [
            "",
            "restart",
            "objective",
            "\u{b1}",
            "violation",
            "distance",
            "same as",
        ];
        let id = &study.steps.get(step)?.id;
        let beyond = if listed.iter().any(|l| !l.handed_on) {
            "; *: not handed on"
        } else {
            ""
        };
        Some(format!(
            "distinct designs of step {id} (distance: largest difference of a variable from the best over its range; same as: near, and \
             their error bands meet{beyond}):\n{}",
            table(&header, &rows)
        ))
    };
    results
        .optima
        .iter()
        .enumerate()
        .filter_map(of_step)
        .collect()
}

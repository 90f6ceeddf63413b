//! Hashes: of a study, of an evaluation, of a history. SHA-256 in hex digits; numbers enter by their bits.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::error::StudyError;
use super::result::{EvaluationRequest, Outcome};
use super::spec::{Model, Parametrisation, Study, Variables};
use crate::optimiser::AskKind;

/// The variables of free units.
const CORNERS: Variables = Variables::Chambers {
    parametrisation: Parametrisation::Corners,
    // The body says how many.
    corners: None,
};

/// One line of a restart's history, in the optimiser's order.
#[derive(Clone, Copy, Debug)]
pub struct HistoryEntry<'a> {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart.
    pub restart: usize,
    /// Why the optimiser asked.
    pub kind: AskKind,
    /// The design.
    pub x: &'a [f64],
    /// Its objective; `None` where the outcome is not ok.
    pub objective: Option<f64>,
    /// Name of the outcome's status, see [`super::OutcomeStatus::name`].
    pub outcome: &'a str,
}

/// The hash of a history without entries.
pub fn empty_history() -> String {
    hex(Sha256::new())
}

/// The hash of a history that goes on with `entry`.
pub fn extend_history(history: &str, entry: &HistoryEntry<'_>) -> String {
    let mut hash = Sha256::new();
    text(&mut hash, history);
    number(&mut hash, entry.step as u64);
    number(&mut hash, entry.restart as u64);
    text(&mut hash, name_of(&entry.kind).as_str());
    bits(&mut hash, entry.x);
    match entry.objective {
        Some(objective) => bits(&mut hash, &[objective]),
        None => bits(&mut hash, &[]),
    }
    text(&mut hash, entry.outcome);
    hex(hash)
}

/// The hash of a whole history: "same history" means equal hashes.
pub fn history_sha256<'a>(entries: impl IntoIterator<Item = HistoryEntry<'a>>) -> String {
    entries.into_iter().fold(empty_history(), |history, entry| {
        extend_history(&history, &entry)
    })
}

impl<'a> HistoryEntry<'a> {
    /// The line of a request and its outcome.
    pub fn new(restart: usize, request: &'a EvaluationRequest, outcome: &'a Outcome) -> Self {
        Self {
            step: request.step,
            restart,
            kind: request.kind,
            x: &request.x,
            objective: outcome.objective,
            outcome: outcome.status.name(),
        }
    }
}

impl Study {
    /// Hash of the resolved document: equal for documents that mean the same.
    pub fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        text(&mut hash, "salp study 1");
        text(&mut hash, &self.document().to_string());
        hex(hash)
    }
}

impl EvaluationRequest {
    /// Key of the result cache: equal for evaluations that give the same values. `build` names the solver's build and the
    /// instruction set. What a program answers is known to belong to its study alone.
    pub fn key(&self, study: &Study, build: &str) -> Result<String, StudyError> {
        let study = &*study.given(self.step, &self.given);
        let step = study.step(self.step)?;
        // A sequence is the free units that it stands for, whatever its alphabet is; it does not matter where the document says how
        // many corners a chamber has.
        let variables = match &step.variables {
            Variables::Chambers {
                parametrisation: Parametrisation::Corners | Parametrisation::Sequence,
                ..
            } => &CORNERS,
            others => others,
        };
        let mut hash = Sha256::new();
        text(&mut hash, "salp evaluation 1");
        text(&mut hash, build);
        if let Model::Command(_) = &step.model {
            text(&mut hash, &study.fingerprint());
        } else {
            text(&mut hash, &json(&study.body_of(self.step)?));
            text(&mut hash, &json(&step.target));
            text(&mut hash, &json(&variables));
            text(&mut hash, &json(&step.constraints));
        }
        // The number of units is that of the body: it does not matter where the document says it.
        text(&mut hash, &json(&step.model.without_units()));
        if !self.given.behaviour.is_empty() {
            text(&mut hash, &json(&self.given.behaviour));
        }
        text(&mut hash, &json(&self.orientation));
        bits(&mut hash, &of_letters(study, self.step, &self.x)?);
        let base = self.plan_base.as_deref().unwrap_or(&[]);
        bits(&mut hash, &of_letters(study, self.step, base)?);
        number(&mut hash, u64::from(self.want_gradient));
        number(&mut hash, u64::from(self.second_mesh));
        if let Some(fidelity) = &self.fidelity {
            text(&mut hash, &json(fidelity));
        }
        Ok(hex(hash))
    }
}

/// The corners of a sequence; any other design as it is.
fn of_letters<'x>(study: &Study, step: usize, x: &'x [f64]) -> Result<Cow<'x, [f64]>, StudyError> {
    match study.sequence(step, x) {
        Some(_) => study.corners(step, x).map(Cow::Owned),
        None => Ok(Cow::Borrowed(x)),
    }
}

fn json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

/// The name under which an enum value without fields is serialised.
pub(super) fn name_of<T: Serialize>(value: &T) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

fn number(hash: &mut Sha256, value: u64) {
    hash.update(value.to_le_bytes());
}

fn text(hash: &mut Sha256, value: &str) {
    number(hash, value.len() as u64);
    hash.update(value.as_bytes());
}

fn bits(hash: &mut Sha256, values: &[f64]) {
    number(hash, values.len() as u64);
    for value in values {
        number(hash, value.to_bits());
    }
}

fn hex(hash: Sha256) -> String {
    hash.finalize()
        .iter()
        .fold(String::new(), |mut text, byte| {
            // Writing to a string cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
}

//! What a restart shows to the ones after it.

use serde::{Deserialize, Serialize};

use super::decide::Decision;
use super::merit::Merit;
use crate::scene::Orientation;

/// Where a restart waits for a decision. Gates are passed in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gate {
    /// The end of a rung, from 0.
    Rung(usize),
    /// A check at the study's own fidelity: so many times the evaluations between two of them.
    Check(usize),
}

/// What a restart showed at a gate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Which.
    pub gate: Gate,
    /// Evaluations of the restart when it came there.
    pub evaluations: usize,
    /// Its iterate.
    pub x: Vec<f64>,
    /// At a rung that of the iterate; at a check that of the best design so far.
    pub merit: Merit,
    /// That of the same design at the next fidelity, once it went up and was evaluated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<Merit>,
    /// What was decided; `None`: it waits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decision: Option<Decision>,
}

/// Where a restart ended by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// Its last iterate.
    pub x: Vec<f64>,
    /// That of its best design.
    pub merit: Merit,
}

/// All that a restart shows to the ones after it. What it showed never changes, not even where the restart is resumed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RaceRecord {
    /// The rung on which it is; the number of rungs: the study's own fidelity.
    pub rung: usize,
    /// The sense in which its area counts: restarts of two senses head for two optima.
    pub orientation: Option<Orientation>,
    /// Its marks, in the order of the gates.
    pub marks: Vec<Mark>,
    /// That of its first evaluation at the study's own fidelity.
    pub opened: Option<Merit>,
    /// Where it ended by itself at the study's own fidelity; `None` while it runs, and where the race ended it.
    pub end: Option<End>,
    /// Whether it shows nothing more: it ended, or was stopped.
    pub out: bool,
    /// Whether somebody brought it back after it was stopped.
    #[serde(default, skip_serializing_if = "crate::study::result::is_false")]
    pub resumed: bool,
}

impl RaceRecord {
    /// The gate at which it waits.
    pub fn waits_at(&self) -> Option<Gate> {
        let last = self.marks.last().filter(|_| !self.out)?;
        last.decision.is_none().then_some(last.gate)
    }

    /// What it showed at a gate.
    pub fn at(&self, gate: Gate) -> Option<&Mark> {
        self.marks.iter().find(|mark| mark.gate == gate)
    }

    /// Whether all is known of it that matters at a gate: it has been decided there or beyond, or is out.
    pub(super) fn is_past(&self, gate: Gate) -> bool {
        let decided = |mark: &Mark| mark.gate >= gate && mark.decision.is_some();
        self.out || self.marks.iter().any(decided)
    }
}

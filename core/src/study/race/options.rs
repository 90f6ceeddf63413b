//! What a document says of the competition of its restarts.

use serde::{Deserialize, Serialize};

/// Evaluations between two checks where the document does not say.
pub const DEFAULT_EVERY: usize = 8;
/// Checks over which the recent gain is extrapolated where the document does not say.
pub const AHEAD: f64 = 2.0;
/// Distance of `merge_within = true`, in shares of the variables' ranges.
pub const MERGE_WITHIN: f64 = 0.01;

/// How the restarts of a step compete; by default they do not.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Competition {
    /// Rungs of low fidelity before the study's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub race: Option<Race>,
    /// When a restart at the study's own fidelity is given up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_dominated: Option<StopDominated>,
    /// A restart whose design comes as near to that of an earlier one is given up, in shares of the variables' ranges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub merge_within: Option<f64>,
}

/// Rungs through which every restart goes before it runs at the study's own fidelity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Race {
    /// The rungs, the cheapest first.
    pub rungs: Vec<Rung>,
    /// One restart in so many goes up; 1: all do.
    pub eta: usize,
    /// The race is off once the order of designs at a rung agrees by less than this with their order at the next fidelity.
    pub least_correlation: f64,
    /// Designs within this violation are compared by their objective on a rung.
    pub tolerance: f64,
}

/// A rung: a fidelity and a budget.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// Evaluations after which a restart comes to its end, at its next iteration.
    pub evaluations: usize,
    /// Elements each way over those of the study.
    #[serde(skip_serializing_if = "is_one")]
    pub mesh: f64,
    /// States on each leg; `None`: as many as the study's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_steps_per_leg: Option<usize>,
}

/// A fidelity other than the study's own: below it on the rungs of a race, above it where a winner is looked at again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// Elements each way over those of the study.
    pub mesh: f64,
    /// States on each leg; `None`: as many as the study's. More than those are as many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_steps_per_leg: Option<usize>,
}

/// Early stop of dominated restarts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StopDominated {
    /// Evaluations at the study's own fidelity between two checks.
    pub every: usize,
    /// What it takes to be dominated.
    pub rule: DominationRule,
    /// Of `bound`: checks over which the recent gain is extrapolated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ahead: Option<f64>,
}

/// What it takes to be dominated, at equal cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DominationRule {
    /// Its best so far, with its recent gain extrapolated, is worse than the best of the earlier restarts.
    Bound,
    /// Its best so far is worse than the median of the earlier restarts.
    Median,
}

impl Default for StopDominated {
    fn default() -> Self {
        Self {
            every: DEFAULT_EVERY,
            rule: DominationRule::Bound,
            ahead: Some(AHEAD),
        }
    }
}

impl Competition {
    /// Whether restarts do not compete.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Number of rungs below the study's own fidelity.
    pub fn rungs(&self) -> usize {
        self.race.as_ref().map_or(0, |race| race.rungs.len())
    }

    /// A rung; `None` beyond the last one.
    pub fn rung(&self, rung: usize) -> Option<&Rung> {
        self.race.as_ref()?.rungs.get(rung)
    }

    /// The fidelity at a rung; `None`: the study's own.
    pub fn fidelity(&self, rung: usize) -> Option<Fidelity> {
        self.rung(rung)?.fidelity()
    }

    /// Evaluations between two checks; `None` where nothing is checked.
    pub fn checks_every(&self) -> Option<usize> {
        match (&self.stop_dominated, self.merge_within) {
            (Some(stop), _) => Some(stop.every),
            (None, Some(_)) => Some(DEFAULT_EVERY),
            (None, None) => None,
        }
    }
}

impl Rung {
    /// Its fidelity; `None`: the study's own.
    pub fn fidelity(&self) -> Option<Fidelity> {
        let below = self.mesh < 1.0 || self.load_steps_per_leg.is_some();
        below.then_some(Fidelity {
            mesh: self.mesh,
            load_steps_per_leg: self.load_steps_per_leg,
        })
    }
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    clippy::float_cmp,
    reason = "the signature that serde asks for; the document's number itself"
)]
fn is_one(share: &f64) -> bool {
    *share == 1.0
}

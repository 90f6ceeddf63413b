//! The decisions: pure functions of what the restarts of lower index show.

use serde::{Deserialize, Serialize};

use super::merit::{Merit, median, spearman};
use super::options::{AHEAD, Competition, DominationRule, Race, StopDominated};
use super::record::{Gate, Mark, RaceRecord};
use crate::study::restart::StudyStop;

/// Designs at two fidelities of which a correlation is taken at least.
pub const LEAST_PAIRS: usize = 4;
/// Earlier restarts of which a median is taken at least.
pub const LEAST_COMPARED: usize = 4;
/// The correlation is looked at anew for every so many restarts: within a block nobody waits for an evaluation of another one
/// at the next fidelity.
pub const BLOCK: usize = 8;

/// What was decided of a restart at a gate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// How many earlier restarts are at least as good at this gate.
    pub rank: usize,
    /// Number of those compared, itself included.
    pub of: usize,
    /// Agreement of this rung's order with the next fidelity's, as far as it was known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Correlation>,
    /// Whether the race is off at this rung from here on, because the orders do not agree.
    #[serde(default, skip_serializing_if = "crate::study::result::is_false")]
    pub race_off: bool,
    /// Why the restart ends here; `None`: it goes on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<StudyStop>,
}

/// Agreement of two orders of the same designs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correlation {
    /// Number of designs.
    pub pairs: usize,
    /// Spearman's rank correlation; `None` where all are equal at one of the fidelities.
    pub spearman: Option<f64>,
}

/// The decisions that can be taken now, by index. `records` has one entry for each restart of the step; `distance` is that
/// of two designs in shares of the variables' ranges.
pub fn due(
    competition: &Competition,
    records: &[RaceRecord],
    distance: &dyn Fn(&[f64], &[f64]) -> f64,
) -> Vec<(usize, Decision)> {
    let mut records = records.to_vec();
    let mut decisions = Vec::new();
    for index in 0..records.len() {
        let (lower, rest) = records.split_at_mut(index);
        let record = &mut rest[0];
        if let Some(decision) = decide(competition, lower, record, distance) {
            if let Some(mark) = record.marks.last_mut() {
                mark.decision = Some(decision.clone());
            }
            record.out = decision.stop.is_some();
            decisions.push((index, decision));
        }
    }
    decisions
}

/// `None` where it does not wait, or has to.
fn decide(
    competition: &Competition,
    lower: &[RaceRecord],
    record: &RaceRecord,
    distance: &dyn Fn(&[f64], &[f64]) -> f64,
) -> Option<Decision> {
    let gate = record.waits_at()?;
    let mark = record.marks.last()?;
    if !lower.iter().all(|other| other.is_past(gate)) {
        return None;
    }
    let seen = || lower.iter().filter_map(|other| other.at(gate));
    let rank = seen().filter(|m| !mark.merit.better_than(&m.merit)).count();
    let mut decision = Decision {
        rank,
        of: seen().count() + 1,
        correlation: None,
        race_off: false,
        stop: None,
    };
    if let (Gate::Rung(rung), Some(race)) = (gate, &competition.race) {
        let changes = competition.fidelity(rung) != competition.fidelity(rung + 1);
        decision.correlation = correlation(lower, gate, changes)?;
        let off_before = seen().any(|m| m.decision.as_ref().is_some_and(|d| d.race_off));
        decision.race_off = off_before || is_low(race, decision.correlation);
        let places = decision.of.div_ceil(race.eta);
        if !decision.race_off && rank >= places {
            decision.stop = Some(StudyStop::NotPromoted {
                rung,
                rank,
                of: decision.of,
                places,
            });
        }
    }
    if let (Gate::Check(_), Some(rule)) = (gate, &competition.stop_dominated) {
        decision.stop = dominated(*rule, lower, record, mark);
    }
    if let Some(within) = competition.merge_within
        && let Some(merged) = merged(within, lower, record, mark, distance)
    {
        decision.stop = Some(merged);
    }
    Some(decision)
}

/// Of the designs that went up in the blocks before: `Some(None)` where they are too few, `None` where one of them has still
/// to be evaluated. `changes`: whether the next rung has another fidelity; nothing is evaluated again otherwise.
#[expect(
    clippy::option_option,
    reason = "to wait and to know too little are two things"
)]
fn correlation(lower: &[RaceRecord], gate: Gate, changes: bool) -> Option<Option<Correlation>> {
    let block = lower.len() / BLOCK * BLOCK;
    let mut pairs = Vec::new();
    for other in &lower[..block] {
        let Some(mark) = other.at(gate) else { continue };
        let went_up = mark.decision.as_ref().is_some_and(|d| d.stop.is_none());
        match mark.next {
            Some(next) if went_up => pairs.push((mark.merit, next)),
            // One that ended on its way never will be.
            None if went_up && changes && !other.out => return None,
            _ => {}
        }
    }
    Some((pairs.len() >= LEAST_PAIRS).then(|| Correlation {
        pairs: pairs.len(),
        spearman: spearman(&pairs),
    }))
}

fn is_low(race: &Race, correlation: Option<Correlation>) -> bool {
    correlation
        .and_then(|c| c.spearman)
        .is_some_and(|rho| rho < race.least_correlation)
}

fn dominated(
    options: StopDominated,
    lower: &[RaceRecord],
    record: &RaceRecord,
    mark: &Mark,
) -> Option<StudyStop> {
    // One that ended by itself at lower cost stands by its end.
    let compared: Vec<Merit> = lower
        .iter()
        .filter_map(|other| match (other.at(mark.gate), &other.end) {
            (Some(seen), _) => Some(seen.merit),
            (None, Some(end)) => Some(end.merit),
            (None, None) => None,
        })
        .collect();
    let (own, reference) = match options.rule {
        DominationRule::Bound => {
            let mut checks = record.marks.iter().rev().skip(1);
            let before = checks
                .find(|m| matches!(m.gate, Gate::Check(_)))
                .map(|m| m.merit)
                .or(record.opened)?;
            let best = compared.iter().copied().min_by(Merit::order)?;
            let ahead = options.ahead.unwrap_or(AHEAD);
            (mark.merit.extrapolated(&before, ahead)?, best)
        }
        DominationRule::Median if compared.len() < LEAST_COMPARED => return None,
        DominationRule::Median => (mark.merit, median(&compared)?),
    };
    reference.better_than(&own).then_some(StudyStop::Dominated {
        rule: options.rule,
        evaluations: mark.evaluations,
        merit: mark.merit,
        bound: own,
        reference,
        of: compared.len(),
    })
}

/// The nearest of those that went on from this gate, or ended by themselves before it.
fn merged(
    within: f64,
    lower: &[RaceRecord],
    record: &RaceRecord,
    mark: &Mark,
    distance: &dyn Fn(&[f64], &[f64]) -> f64,
) -> Option<StudyStop> {
    lower
        .iter()
        .enumerate()
        .filter(|(_, other)| other.orientation == record.orientation)
        .filter_map(|(index, other)| {
            let x = match other.at(mark.gate) {
                Some(seen) => seen.decision.as_ref()?.stop.is_none().then_some(&seen.x)?,
                None => &other.end.as_ref()?.x,
            };
            Some((index, distance(x, &mark.x)))
        })
        .filter(|(_, distance)| *distance <= within)
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .map(|(with, distance)| StudyStop::Merged { with, distance })
}

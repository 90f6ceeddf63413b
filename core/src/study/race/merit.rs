//! The order of designs in a race, and how well two orders of the same designs agree.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

/// What a design is worth: feasible ones by their objective, behind them the others by their violation, behind all those
/// without values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Merit {
    /// Within the violation tolerance, of this objective.
    Feasible(f64),
    /// Of this largest violation.
    Violated(f64),
    /// Without values.
    Failed,
}

impl Merit {
    /// Of a design with values.
    pub fn of(objective: f64, violation: f64, tolerance: f64) -> Self {
        if violation <= tolerance {
            Self::Feasible(objective)
        } else {
            Self::Violated(violation)
        }
    }

    /// Less is better.
    pub fn order(&self, other: &Self) -> Ordering {
        match (self, other) {
            (Self::Feasible(a), Self::Feasible(b)) | (Self::Violated(a), Self::Violated(b)) => {
                a.total_cmp(b)
            }
            _ => self.class().cmp(&other.class()),
        }
    }

    /// Whether it is worth more than another.
    pub fn better_than(&self, other: &Self) -> bool {
        self.order(other) == Ordering::Less
    }

    fn class(&self) -> u8 {
        match self {
            Self::Feasible(_) => 0,
            Self::Violated(_) => 1,
            Self::Failed => 2,
        }
    }

    /// Where it would be after `ahead` more gains like that since `before`. `None`: anywhere, because it has only just become
    /// feasible, or would become so.
    pub fn extrapolated(&self, before: &Self, ahead: f64) -> Option<Self> {
        match (before, self) {
            (Self::Feasible(before), Self::Feasible(now)) => {
                Some(Self::Feasible(now - ahead * (before - now).max(0.0)))
            }
            (Self::Violated(before), Self::Violated(now)) => {
                let later = now - ahead * (before - now).max(0.0);
                (later > 0.0).then_some(Self::Violated(later))
            }
            (_, Self::Failed) => Some(Self::Failed),
            _ => None,
        }
    }
}

/// The middle one; of an even number the better one of the two.
pub fn median(merits: &[Merit]) -> Option<Merit> {
    let mut sorted = merits.to_vec();
    sorted.sort_by(Merit::order);
    sorted.get(sorted.len().checked_sub(1)? / 2).copied()
}

/// Spearman's rank correlation of pairs, equal merits sharing their mean rank; `None` where all of one side are equal.
pub fn spearman(pairs: &[(Merit, Merit)]) -> Option<f64> {
    let first = ranks(&pairs.iter().map(|p| p.0).collect::<Vec<_>>());
    let second = ranks(&pairs.iter().map(|p| p.1).collect::<Vec<_>>());
    let mean = f64::midpoint(pairs.len() as f64, 1.0);
    let moment = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let spread = moment(&first, &first) * moment(&second, &second);
    (spread > 0.0).then(|| moment(&first, &second) / spread.sqrt())
}

/// Ranks from 1.
fn ranks(merits: &[Merit]) -> Vec<f64> {
    let count = |merit: &Merit, order| merits.iter().filter(|m| m.order(merit) == order).count();
    merits
        .iter()
        .map(|merit| {
            let (less, equal) = (count(merit, Ordering::Less), count(merit, Ordering::Equal));
            less as f64 + f64::midpoint(equal as f64, 1.0)
        })
        .collect()
}

//! Exchange descent: a sequence of letters, one at each place, improved by exchanging letters.
//!
//! A point is a list of whole numbers, at each place one of the `k` letters 0 to k - 1. Where all `k^n` sequences are few they
//! are asked for as one batch. Otherwise the search begins with the k uniform sequences, goes on from the best one by the
//! n (k - 1) sequences that differ from it at one place, and where none of those is better by those that have two of its
//! letters swapped; it ends where none of both is better. Each step is one batch, of which the best is taken
//! (steepest descent in the neighbourhood; Aarts and Lenstra, Local Search in Combinatorial Optimization, 1997, ch. 1).
//!
//! Every sequence is asked for at most once: what was asked before is no better than where the search stands. Results are
//! taken in the order of the batch, of equals the first, so that the order in which they arrive decides nothing. A
//! sequence without values is one that is not taken.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::{
    contract::{Ask, AskKind, Told},
    method::Method,
    options::{at_least_one, positive},
    point::{Point, keep_best},
    problem::{Problem, StartError},
    stop::StopReason,
};
use crate::fault::Faults;

/// Letters at most: far beyond what anybody evaluates.
const MOST_LETTERS: f64 = 1e6;

/// Letters at each place, as indices.
type Sequence = Vec<usize>;

/// Options of the exchange descent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExchangeOptions {
    /// All sequences are evaluated where there are no more than this.
    pub enumerate_up_to: usize,
    /// Moves to a better sequence at most.
    pub max_iterations: usize,
    /// Evaluations at most; a batch that goes beyond is cut short.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_evaluations: Option<usize>,
    /// A constraint is violated above this value.
    pub violation_tolerance: f64,
}

impl Default for ExchangeOptions {
    fn default() -> Self {
        Self {
            enumerate_up_to: 64,
            max_iterations: 50,
            max_evaluations: None,
            violation_tolerance: 0.003,
        }
    }
}

impl ExchangeOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        let tolerance = ("violation_tolerance", self.violation_tolerance);
        positive(path, &[tolerance], faults);
        let evaluations = self.max_evaluations.unwrap_or(1);
        let counts = [
            ("max_iterations", self.max_iterations),
            ("max_evaluations", evaluations),
        ];
        at_least_one(path, &counts, faults);
    }
}

/// What the pending batch is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    /// Every sequence.
    All,
    /// The same letter everywhere.
    Uniform,
    /// One letter exchanged.
    Exchanges,
    /// Two letters swapped.
    Swaps,
}

/// State of an exchange descent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exchange {
    options: ExchangeOptions,
    problem: Problem,
    /// Number of letters.
    letters: usize,
    phase: Phase,
    /// Where the search stands: the best sequence, or the first one while none has values.
    centre: Sequence,
    pending: Vec<Sequence>,
    asked: BTreeSet<Sequence>,
    /// Whether the pending batch was cut short by the limit of evaluations.
    cut: bool,
    best: Option<Point>,
    iteration: usize,
    analyses: usize,
    failed: usize,
    done: Option<StopReason>,
}

impl Exchange {
    /// Opens a search over all places of the problem: its lower bounds are 0, its upper ones the last letter.
    pub(crate) fn start(options: ExchangeOptions, problem: Problem) -> Result<Self, StartError> {
        let last = problem.upper.first().copied().unwrap_or(0.0);
        let is_one = |(lower, upper): (&f64, &f64)| *lower == 0.0 && *upper == last;
        let mut bounds = problem.lower.iter().zip(&problem.upper);
        if !bounds.all(is_one) || last.fract() != 0.0 || last > MOST_LETTERS {
            return Err(StartError::NoLetters);
        }
        let (letters, places) = (last as usize + 1, problem.dimension());
        let all = u32::try_from(places)
            .ok()
            .and_then(|n| letters.checked_pow(n))
            .is_some_and(|all| all <= options.enumerate_up_to);
        let mut search = Self {
            phase: if all { Phase::All } else { Phase::Uniform },
            centre: vec![0; places],
            options,
            problem,
            letters,
            pending: Vec::new(),
            asked: BTreeSet::new(),
            cut: false,
            best: None,
            iteration: 0,
            analyses: 0,
            failed: 0,
            done: None,
        };
        search.fill();
        Ok(search)
    }

    /// The sequences of the phase.
    fn batch(&self) -> Vec<Sequence> {
        let (places, letters) = (self.centre.len(), self.letters);
        let of_centre = |change: &dyn Fn(&mut Sequence)| {
            let mut sequence = self.centre.clone();
            change(&mut sequence);
            sequence
        };
        match self.phase {
            Phase::All => (0..places).fold(vec![Vec::new()], |heads, _| {
                let longer = |head: &Sequence| {
                    let head = head.clone();
                    (0..letters).map(move |letter| [&head[..], &[letter][..]].concat())
                };
                heads.iter().flat_map(longer).collect()
            }),
            Phase::Uniform => (0..letters).map(|letter| vec![letter; places]).collect(),
            Phase::Exchanges => (0..places)
                .flat_map(|place| (0..letters).map(move |letter| (place, letter)))
                .map(|(place, letter)| of_centre(&|s| s[place] = letter))
                .collect(),
            Phase::Swaps => (0..places)
                .flat_map(|a| (a + 1..places).map(move |b| (a, b)))
                .map(|(a, b)| of_centre(&|s| s.swap(a, b)))
                .collect(),
        }
    }

    /// Asks for what the phase has that is new, as far as the limit goes.
    fn fill(&mut self) {
        let left = self.options.max_evaluations.unwrap_or(usize::MAX) - self.analyses;
        self.cut = false;
        for sequence in self.batch() {
            if self.asked.contains(&sequence) {
                continue;
            }
            if self.pending.len() == left {
                self.cut = true;
                break;
            }
            self.asked.insert(sequence.clone());
            self.pending.push(sequence);
        }
    }

    /// The point of a sequence.
    fn point(sequence: &[usize]) -> Vec<f64> {
        sequence.iter().map(|letter| *letter as f64).collect()
    }

    /// Goes on to the next batch, or ends; `better`: the last one held something better.
    fn go_on(&mut self, mut better: bool) {
        if self.ends_at_limit() {
            return;
        }
        if better && self.phase != Phase::Uniform {
            self.iteration += 1;
        }
        if self.phase != Phase::All && self.iteration >= self.options.max_iterations {
            self.done = Some(StopReason::IterationLimit {
                iterations: self.iteration,
            });
            return;
        }
        while self.pending.is_empty() && self.done.is_none() {
            self.phase = match (self.phase, better) {
                (Phase::Uniform, _) | (Phase::Exchanges | Phase::Swaps, true) => Phase::Exchanges,
                (Phase::Exchanges, false) => Phase::Swaps,
                (Phase::All, _) | (Phase::Swaps, false) => {
                    self.done = Some(self.end());
                    return;
                }
            };
            better = false;
            self.fill();
            if self.pending.is_empty() {
                self.ends_at_limit();
            }
        }
    }

    /// Ends the search where the limit of evaluations has cut its batch short.
    fn ends_at_limit(&mut self) -> bool {
        if self.cut {
            self.done = Some(StopReason::EvaluationLimit {
                evaluations: self.analyses,
            });
        }
        self.cut
    }

    /// Why a search ends that has nothing left to ask for.
    fn end(&self) -> StopReason {
        let (points, failed) = (self.analyses, self.failed);
        match (&self.best, self.phase) {
            (None, _) => StopReason::FailedStart { attempts: points },
            (Some(_), Phase::All) => StopReason::SearchComplete { points, failed },
            (Some(_), _) => StopReason::NoBetterExchange { points, failed },
        }
    }
}

impl Method for Exchange {
    fn asks(&self) -> Vec<Ask> {
        let first = matches!(self.phase, Phase::All | Phase::Uniform);
        let ask = |sequence: &Sequence| Ask {
            kind: if first {
                AskKind::Initial
            } else {
                AskKind::Trial
            },
            x: Self::point(sequence),
            want_gradient: false,
            iteration: self.iteration,
        };
        self.pending.iter().map(ask).collect()
    }

    fn tell(&mut self, told: &[Told]) {
        if self.done.is_some() {
            return;
        }
        let mut better = false;
        for (k, sequence) in std::mem::take(&mut self.pending).into_iter().enumerate() {
            self.analyses += 1;
            let Some(values) = self.problem.usable(told.get(k)) else {
                self.failed += 1;
                continue;
            };
            let point = Point::new(&self.problem, Self::point(&sequence), values);
            keep_best(&mut self.best, &point, self.options.violation_tolerance);
            if self.best.as_ref() == Some(&point) {
                better = true;
                self.centre = sequence;
            }
        }
        self.go_on(better);
    }

    fn done(&self) -> Option<StopReason> {
        self.done
    }

    fn best(&self) -> Option<&Point> {
        self.best.as_ref()
    }

    fn iteration(&self) -> usize {
        self.iteration
    }

    fn analyses(&self) -> usize {
        self.analyses
    }
}

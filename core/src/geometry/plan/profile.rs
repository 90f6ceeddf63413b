//! What the sides of chambers and walls ask of their blocks: element counts and where their lines lie.

use super::size_rule::{SizeRule, Span};

/// What one chamber side or one wall asks of its block: consecutive spans.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    pub(super) spans: Vec<Span>,
    pub(super) least: usize,
}

impl Profile {
    pub(super) fn count(&self, rule: &SizeRule) -> usize {
        let wanted: usize = self.spans.iter().map(|s| rule.count(*s)).sum();
        wanted.max(self.least)
    }

    /// Elements of each span when the profile gets n in all.
    pub(super) fn share(&self, rule: &SizeRule, n: usize) -> Vec<usize> {
        let mut counts: Vec<usize> = self.spans.iter().map(|s| rule.count(*s)).collect();
        for _ in counts.iter().sum::<usize>()..n {
            let size = |k: usize| self.spans[k].length / counts[k] as f64;
            let longest = (0..counts.len())
                .max_by(|a, b| size(*a).total_cmp(&size(*b)))
                .unwrap_or(0);
            counts[longest] += 1;
        }
        counts
    }

    /// Lines of the profile when it gets n elements, as lengths; and the indices where spans meet.
    pub(super) fn lines(&self, rule: &SizeRule, n: usize) -> (Vec<f64>, Vec<usize>) {
        let (mut lines, mut cuts) = (vec![0.0], vec![]);
        for (span, count) in self.spans.iter().zip(self.share(rule, n)) {
            let start = lines[lines.len() - 1];
            lines.extend(rule.lines(*span, count)[1..].iter().map(|s| start + s));
            cuts.push(lines.len() - 1);
        }
        cuts.pop();
        (lines, cuts)
    }

    pub(super) fn length(&self) -> f64 {
        self.spans.iter().map(|s| s.length).sum()
    }
}

/// One interval of a unit's columns or rows: a wall, or the rim of chambers.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub(super) profiles: Vec<Profile>,
    /// Whether it is a sheared wall between two chambers.
    pub(super) sheared: bool,
}

impl Block {
    pub(super) fn count(&self, rule: &SizeRule) -> usize {
        self.profiles
            .iter()
            .map(|p| p.count(rule))
            .max()
            .unwrap_or(1)
    }

    pub(super) fn length(&self) -> f64 {
        self.profiles
            .iter()
            .map(Profile::length)
            .fold(0.0, f64::max)
    }
}

//! Sequences of units: designs that say for each unit which of an alphabet it is.

use super::error::StudyError;
use super::spec::{Study, StudyStep};
use super::takes::{Take, TakenAs};

impl Study {
    /// Number of letters of a step: of the units that it was given, before that as many as it may take at most.
    ///
    /// # Errors
    /// Where the study has no such step.
    pub fn letters(&self, step: usize) -> Result<usize, StudyError> {
        let s = self.step(step)?;
        let whole = self.body.as_ref().map_or(1, |body| body.actuator.units);
        Ok(match s.given.alphabet.len() {
            0 => most_letters(&self.steps, s, whole),
            given => given,
        })
    }

    /// The sequence that a design stands for, letters counted from 1; `None` of a step without sequences.
    pub fn sequence(&self, step: usize, x: &[f64]) -> Option<Vec<usize>> {
        self.steps.get(step).filter(|s| s.variables.are_letters())?;
        let letters = self.letters(step).ok()?;
        let index = |(place, letter): (usize, &f64)| letter_at(step, place, *letter, letters);
        let indices: Result<Vec<usize>, _> = x.iter().enumerate().map(index).collect();
        let is_whole = x.len() == self.free_units(step).ok()?;
        let found = indices.ok().filter(|_| is_whole)?;
        Some(found.into_iter().map(|index| index + 1).collect())
    }

    /// Chamber corners of all units of a sequence. Before the alphabet is there each letter is a unit of the smallest voids, so
    /// that the number of rows and their names are known.
    pub(super) fn corners_of_sequence(
        &self,
        step: usize,
        x: &[f64],
    ) -> Result<Vec<f64>, StudyError> {
        let expected = self.free_units(step)?;
        if x.len() != expected {
            return Err(StudyError::Length {
                step,
                expected,
                found: x.len(),
            });
        }
        let letters = self.letters(step)?;
        let alphabet = &self.step(step)?.given.alphabet;
        let (body, ..) = self.chambers(step)?;
        let smallest = body.actuator.boxes().common_start();
        let mut corners = Vec::new();
        for (place, letter) in x.iter().enumerate() {
            let index = letter_at(step, place, *letter, letters)?;
            corners.extend(alphabet.get(index).map_or(&smallest, |l| &l.corners));
        }
        Ok(corners)
    }
}

/// The index of a variable that is a letter.
fn letter_at(step: usize, place: usize, letter: f64, letters: usize) -> Result<usize, StudyError> {
    if letter >= 0.0 && letter < letters as f64 && letter.fract() == 0.0 {
        return Ok(letter as usize);
    }
    Err(StudyError::NoSuchLetter {
        step,
        place,
        letter,
        letters,
    })
}

/// Units that a step takes as letters at most, `whole` being the number of the actuator's units.
pub(super) fn most_letters(steps: &[StudyStep], step: &StudyStep, whole: usize) -> usize {
    let of_candidate = |take: &Take| match steps.iter().find(|s| s.id == take.step) {
        Some(source) if source.model.is_direct() && take.units.is_empty() => {
            source.model.units().unwrap_or(whole)
        }
        _ => take.units.len().max(1),
    };
    let takes = step.takes.iter();
    takes
        .filter(|take| take.taken_as == TakenAs::Alphabet)
        .map(|take| take.candidates.max(1) * of_candidate(take))
        .sum()
}

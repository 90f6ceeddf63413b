//! What a step takes from the results of others: designs put together unit by unit, a layout, a behaviour.

use super::candidate::{Candidate, DISTINCT, StepResult};
use crate::study::spec::Model;
use crate::study::takes::{Given, Letter, StepInputs, Take, TakenAs, TakenDesign, TakenFrom};
use crate::study::{Study, StudyError, scaled_distance};

/// Designs that a step takes at most: of several steps with several candidates each, the combinations of the best ranks.
pub const MOST_DESIGNS: usize = 64;

/// A candidate as the chambers of each of its free units: one list where all units are copies.
struct Part<'a> {
    take: &'a Take,
    rank: usize,
    candidate: &'a Candidate,
    units: Vec<Vec<f64>>,
}

/// The inputs of a step, `results` in the order of its takes and each with a candidate. The inner error says why nothing fits.
///
/// # Errors
/// Where a candidate does not fit its own step.
pub fn inputs(
    study: &Study,
    step: usize,
    results: &[&StepResult],
) -> Result<Result<StepInputs, String>, StudyError> {
    let takes = &study.step(step)?.takes;
    let mut given = Given::default();
    for (take, result) in takes.iter().zip(results) {
        let (Some(source), Some(best)) = (study.index_of(&take.step), result.candidates.first())
        else {
            continue;
        };
        let other = study.given(source, &best.given);
        match take.taken_as {
            TakenAs::Layout => given.layout = other.layout_of(source, &best.x)?,
            TakenAs::Behaviour => given.behaviour = other.transforms_of(source, &best.x)?,
            // Chambers bring their layout with them.
            TakenAs::Starts | TakenAs::Geometry | TakenAs::Alphabet if given.layout.is_none() => {
                given.layout = other.layout_of(source, &best.x)?;
            }
            TakenAs::Starts | TakenAs::Geometry | TakenAs::Alphabet => {}
        }
    }
    // As in the document: then nothing is given, and an evaluation is known by the same key as without any take.
    let of_actuator = study.body.as_ref().map(|body| body.actuator.layout);
    given.layout = given.layout.filter(|layout| Some(*layout) != of_actuator);
    if study.step(step)?.variables.are_letters() {
        given.alphabet = alphabet(study, step, &given, results)?;
        if given.alphabet.is_empty() {
            let id = &study.step(step)?.id;
            return Ok(Err(format!(
                "step \"{id}\" did not begin: no unit that it takes has its layout"
            )));
        }
    }
    let own = study.given(step, &given);
    let mut lists: Vec<Vec<Part>> = Vec::new();
    for (take, result) in takes.iter().zip(results) {
        if !matches!(take.taken_as, TakenAs::Starts | TakenAs::Geometry) {
            continue;
        }
        let Some(source) = study.index_of(&take.step) else {
            continue;
        };
        let mut parts = Vec::new();
        let chambers = own.step(step)?.model.finite_elements().is_some();
        for (rank, candidate) in result.candidates.iter().take(take.candidates).enumerate() {
            let other = study.given(source, &candidate.given);
            let fits = !chambers || other.layout_of(source, &candidate.x)? == own.layout(step);
            if fits {
                parts.push(Part {
                    take,
                    rank,
                    candidate,
                    units: if chambers {
                        units_for(&own, step, &other, (source, candidate))?
                    } else {
                        vec![candidate.x.clone()]
                    },
                });
            }
        }
        if parts.is_empty() {
            return Ok(Err(format!(
                "step \"{}\" did not begin: no candidate of step \"{}\" has its layout",
                own.step(step)?.id,
                take.step
            )));
        }
        lists.push(parts);
    }
    let mut designs = Vec::new();
    for combination in combinations(&lists) {
        let parts: Vec<&Part> = combination
            .iter()
            .zip(&lists)
            .map(|(k, list)| &list[*k])
            .collect();
        let design = assemble(&own, step, &parts)?;
        if designs.iter().all(|d: &TakenDesign| d.x != design.x) {
            designs.push(design);
        }
    }
    Ok(Ok(StepInputs { given, designs }))
}

/// The units of which a step's sequences are made: those of each candidate that are no units of an earlier one.
fn alphabet(
    study: &Study,
    step: usize,
    given: &Given,
    results: &[&StepResult],
) -> Result<Vec<Letter>, StudyError> {
    let own = study.given(step, given);
    let body = own.body_of(step)?.ok_or(StudyError::NoChambers { step })?;
    let [lower, upper] = body.actuator.boxes().bounds();
    let mut letters: Vec<Letter> = Vec::new();
    for (take, result) in own.step(step)?.takes.iter().zip(results) {
        let Some(source) = study.index_of(&take.step) else {
            continue;
        };
        if take.taken_as != TakenAs::Alphabet {
            continue;
        }
        for (rank, candidate) in result.candidates.iter().take(take.candidates).enumerate() {
            let other = study.given(source, &candidate.given);
            if other.layout_of(source, &candidate.x)? != own.layout(step) {
                continue;
            }
            let units = units_for(&own, step, &other, (source, candidate))?;
            for (unit, corners) in (1..).zip(units) {
                let is_taken = take.units.is_empty() || take.units.contains(&unit);
                let is_near = |other: &Letter| {
                    scaled_distance(&lower, &upper, &corners, &other.corners) <= DISTINCT
                };
                if is_taken && !letters.iter().any(is_near) {
                    letters.push(Letter {
                        corners,
                        unit,
                        from: taken_from(take, rank, candidate),
                    });
                }
            }
        }
    }
    Ok(letters)
}

/// Chamber corners of each free unit of a candidate, as many for each chamber as the step has that takes it.
fn units_for(
    own: &Study,
    step: usize,
    other: &Study,
    (source, candidate): (usize, &Candidate),
) -> Result<Vec<Vec<f64>>, StudyError> {
    let body = own.body_of(step)?.ok_or(StudyError::NoChambers { step })?;
    let boxes = body.actuator.boxes();
    let units = other.unit_corners(source, &candidate.x)?.into_iter();
    let fitted = units.map(|unit| boxes.with_these_corners(&unit).unwrap_or(unit));
    Ok(fitted.collect())
}

fn taken_from(take: &Take, rank: usize, candidate: &Candidate) -> TakenFrom {
    TakenFrom {
        step: take.step.clone(),
        candidate: rank,
        objective: candidate.objective,
    }
}

/// Ranks of a candidate from each list: all of them where they are few, the least sums first.
fn combinations(lists: &[Vec<Part>]) -> Vec<Vec<usize>> {
    if lists.is_empty() {
        return Vec::new();
    }
    let mut all = vec![Vec::new()];
    for list in lists {
        all = all
            .into_iter()
            .flat_map(|head: Vec<usize>| {
                (0..list.len()).map(move |k| {
                    let mut next = head.clone();
                    next.push(k);
                    next
                })
            })
            .collect();
        all.sort_by_key(|ranks| ranks.iter().sum::<usize>());
        all.truncate(MOST_DESIGNS);
    }
    all
}

/// The design of a step whose units come from the parts.
fn assemble(study: &Study, step: usize, parts: &[&Part]) -> Result<TakenDesign, StudyError> {
    let s = study.step(step)?;
    let free = match s.model {
        Model::FeDirect(_) => study.free_units(step)?,
        _ => 1,
    };
    let mut x = Vec::new();
    for unit in 1..=free {
        let covers = |part: &&&Part| part.take.units.is_empty() || part.take.units.contains(&unit);
        let Some(part) = parts.iter().find(covers) else {
            continue;
        };
        // A chain of free units gives each unit its own; copies give the one that they have.
        let own = part.units.get(unit - 1).or(part.units.first());
        x.extend(own.into_iter().flatten());
    }
    // A part of the actuator may run round its area in another sense than the whole.
    let orientation = match parts {
        [one] => one.candidate.orientation,
        _ => None,
    };
    Ok(TakenDesign {
        x,
        orientation,
        from: parts
            .iter()
            .map(|part| taken_from(part.take, part.rank, part.candidate))
            .collect(),
    })
}

//! Meshes that a study asks for by their error: chosen here, where the solver is, before the study is submitted.

use salp_core::evaluate::choose_meshes;
use salp_core::scene::ElementChoice;
use salp_core::study::Study;
use salp_core::study::spec::AccuracyDesign;

use crate::converge::Progress;
use crate::failure::Failure;
use crate::output::{note, number};

/// Whether a mesh has still to be chosen.
pub fn needs_meshes(study: &Study) -> bool {
    !study.unchosen_meshes().0.is_empty()
}

/// The study with its meshes chosen.
pub fn with_meshes(study: &Study) -> Result<Study, Failure> {
    note("choosing a mesh for the wanted error");
    let chosen = choose_meshes(study, &mut Progress)?;
    for line in lines(&chosen) {
        note(&line);
    }
    Ok(chosen)
}

/// What was chosen, a line for each step that asked.
pub fn lines(study: &Study) -> Vec<String> {
    let line = |step: &salp_core::study::spec::StudyStep| {
        let model = step.model.finite_elements()?;
        let accuracy = model.accuracy.as_ref()?;
        let chosen = accuracy.chosen.as_ref()?;
        let per_cent = |v: f64| format!("{} %", number(Some(100.0 * v)));
        let element = match model.element {
            ElementChoice::Quad4 => "quad4",
            ElementChoice::Auto | ElementChoice::Quad9 => "quad9",
        };
        let size = model.max_size_mm.map_or_else(
            || "by the size rule".into(),
            |size| format!("of at most {} mm", number(Some(size))),
        );
        let design = match chosen.at {
            AccuracyDesign::Given => "the first given start",
            AccuracyDesign::Middle => "the middle of the bounds",
        };
        let area = chosen
            .area_error
            .map_or_else(String::new, |e| format!(", area {}", per_cent(e)));
        Some(format!(
            "mesh of step {} chosen for an error of {}: {element} {size}, {} elements; at {design} tip {}{area}, uncertain by {}",
            step.id,
            per_cent(accuracy.error),
            chosen.elements,
            per_cent(chosen.tip_error),
            per_cent(chosen.uncertainty)
        ))
    };
    study.steps.iter().filter_map(line).collect()
}

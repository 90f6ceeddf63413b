//! The picture of a solved scene.

use salp_core::evaluate::SceneSolution;
use salp_core::mesh::Discretisation;
use salp_core::picture::ShapePicture;
use salp_core::scene::{Measure, Scene};

use crate::numbers::tip;
use crate::output::number;

/// The state that is deformed most, drawn with the path of the tip. `caption` follows a line about the state.
pub fn picture(
    title: &str,
    scene: &Scene,
    solution: &SceneSolution,
    body: &Discretisation,
    caption: &[String],
) -> String {
    let size = |field: &Vec<[f64; 2]>| field.iter().flatten().fold(0.0, |m: f64, u| m.max(u.abs()));
    let most = (0..solution.fields.len())
        .max_by(|a, b| size(&solution.fields[*a]).total_cmp(&size(&solution.fields[*b])));
    let path = &solution.answer.path;
    let tip_path_mm: Vec<[f64; 2]> = tip(scene).map_or_else(Vec::new, |(name, at)| {
        path.iter()
            .filter_map(|state| state.displacement_mm.get(&name))
            .map(|u| [at[0] + u[0], at[1] + u[1]])
            .collect()
    });
    let target_path_mm = match scene.objective.as_ref().map(|goal| &goal.measure) {
        Some(Measure::TipPath { points_mm, .. }) => points_mm.as_slice(),
        _ => &[],
    };
    let mut lines = Vec::new();
    if let Some(state) = most.and_then(|i| path.get(i)) {
        let pressures: Vec<String> = state
            .pressure_kpa
            .iter()
            .map(|p| number(Some(*p)))
            .collect();
        let area = solution
            .answer
            .enclosed_area_mm2
            .map_or_else(String::new, |area| {
                let sense = if area >= 0.0 {
                    "counter-clockwise"
                } else {
                    "clockwise"
                };
                format!(
                    "; the tip encloses {} mm\u{b2} ({sense})",
                    number(Some(area.abs()))
                )
            });
        let wanted = if target_path_mm.is_empty() {
            ""
        } else {
            "; blue: the path that it should follow"
        };
        lines.push(format!(
            "grey: undeformed; black: mesh at ({}) kPa; red: path of the tip{wanted}{area}",
            pressures.join(", ")
        ));
    }
    lines.extend_from_slice(caption);
    ShapePicture {
        title,
        mesh: &body.mesh,
        boundary: &body.boundary,
        displacement_mm: most.map(|i| solution.fields[i].as_slice()),
        tip_path_mm: &tip_path_mm,
        target_path_mm,
        caption: &lines,
    }
    .svg()
}

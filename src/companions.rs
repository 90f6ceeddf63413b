//! What becomes of a design beyond its own scene: solved on some threads, and told.

use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::companions::{CompanionAnswer, Kind, companions};
use salp_core::evaluate::{SceneAnswer, SceneStatus};
use salp_core::geometry::MeshPlan;
use salp_core::scene::Scene;

use crate::failure::Failure;
use crate::output::number;
use crate::parallel::in_parallel;

/// Solves a scene's companions.
pub fn solve(
    scene: &Scene,
    plan: Option<&MeshPlan>,
    threads: usize,
) -> Result<Vec<CompanionAnswer>, Failure> {
    let all = companions(scene, plan);
    let solve = |index: usize| all[index].solve(&mut Unobserved);
    let answers = in_parallel(threads.min(all.len()), all.len(), solve, |_, _| ());
    Ok(answers.into_iter().collect::<Result<_, _>>()?)
}

/// A line for each, beside the answer `own` of the scene itself.
pub fn lines(own: &SceneAnswer, all: &[CompanionAnswer]) -> Vec<String> {
    let line = |answer: &CompanionAnswer| {
        let setting = &answer.setting;
        if answer.status != SceneStatus::Ok {
            let status = serde_json::to_value(answer.status).unwrap_or_default();
            let status = status.as_str().unwrap_or_default();
            return format!("with {setting}: no complete path ({status})");
        }
        let areas: Vec<String> = answer
            .areas
            .iter()
            .map(|a| {
                let [x, y] = a.tip_mm;
                let area = number(Some(a.enclosed_area_mm2));
                format!("{area} mm\u{b2} at ({x}, {y}) mm")
            })
            .collect();
        let areas = areas.join(", ");
        let stretch = number(Some(answer.max_stretch));
        match answer.kind {
            Kind::ModelSpread => {
                let other = answer.areas.first().map(|a| a.enclosed_area_mm2);
                let change = own.enclosed_area_mm2.zip(other).map(|(own, other)| {
                    // Adding zero takes the sign from a change that rounds to none.
                    let tenths = (1e3 * (other / own - 1.0)).round() + 0.0;
                    format!("{:+.1} %: ", tenths / 10.0)
                });
                let change = change.unwrap_or_default();
                format!(
                    "model spread {change}{areas} with {setting}; largest averaged stretch {stretch}"
                )
            }
            Kind::NineUnits => {
                format!(
                    "{setting}: {areas} (counter-clockwise positive); largest averaged stretch {stretch}"
                )
            }
        }
    };
    all.iter().map(line).collect()
}

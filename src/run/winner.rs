//! The best design, solved once more for pictures and for what a reader asks of it.

use salp_core::evaluate::{SceneAnswer, SceneOptions, SceneSensitivities, solve_scene};
use salp_core::fault::Faults;
use salp_core::geometry::MeshPlan;
use salp_core::scene::{Orientation, Scene};
use salp_core::study::Study;
use salp_protocol::Best;
use serde_json::Value;

use super::document::Results;
use crate::failure::Failure;
use crate::output::number;
use crate::sensitivities;
use crate::shape::picture;
use crate::stopwatch::Stopwatch;

/// The best design as it was evaluated.
pub struct Evaluated {
    /// Its scene.
    pub scene: Scene,
    /// The design of its mesh plan.
    pub plan_base: Option<Vec<f64>>,
    /// The sense in which its area counts.
    pub orientation: Option<Orientation>,
}

impl Evaluated {
    /// Its mesh plan.
    pub fn plan(&self, study: &Study, step: usize) -> Option<MeshPlan> {
        study.mesh_plan(step, self.plan_base.as_deref()?).ok()?
    }
}

/// The best design as it was evaluated; `None` for programs.
pub fn evaluated(study: &Study, results: &Results, step: usize, best: &Best) -> Option<Evaluated> {
    let restart = results
        .restarts
        .iter()
        .find(|r| (r.step, r.index) == (step, best.restart))?;
    let said = |path: &str| {
        restart
            .summary
            .pointer(path)
            .cloned()
            .unwrap_or(Value::Null)
    };
    let orientation: Option<Orientation> =
        serde_json::from_value(said("/best/orientation")).ok()?;
    let plan_base: Option<Vec<f64>> = serde_json::from_value(said("/best/plan_base")).ok()?;
    Some(Evaluated {
        scene: study.scene(step, &best.x, orientation).ok()?,
        plan_base,
        orientation,
    })
}

/// The best design's answer and picture.
pub struct Winner {
    /// At rest and deformed, with the path of the tip.
    pub svg: String,
    /// All numbers.
    pub answer: SceneAnswer,
    /// What its objective is worth by its numbers.
    pub sensitivities: Option<SceneSensitivities>,
}

impl Winner {
    /// Solves and draws it, on the mesh of its evaluation.
    pub fn solve(
        title: &str,
        scene: &Scene,
        plan: Option<&MeshPlan>,
        caption: &[String],
    ) -> Result<Self, Failure> {
        let options = SceneOptions {
            gradient: true,
            fields: true,
            plan: plan.cloned(),
            ..SceneOptions::default()
        };
        let solution = solve_scene(scene, &options, &mut Stopwatch::start())?;
        let Some(body) = &solution.body else {
            return Err(Failure::BadInput(Faults::default()));
        };
        Ok(Self {
            svg: picture(title, scene, &solution, body, caption),
            sensitivities: sensitivities::of(scene, &solution, true),
            answer: solution.answer,
        })
    }

    /// Area, stretch, stability, contact and residual over all states.
    pub fn lines(&self) -> Vec<String> {
        let answer = &self.answer;
        let states = || answer.path.iter();
        let least = |of: Vec<f64>| of.into_iter().reduce(f64::min);
        let most = |of: Vec<f64>| of.into_iter().fold(0.0, f64::max);
        let area = answer.enclosed_area_mm2.map_or_else(String::new, |area| {
            let sense = if area >= 0.0 {
                "counter-clockwise"
            } else {
                "clockwise"
            };
            let area = number(Some(area.abs()));
            format!("enclosed area {area} mm\u{b2}, {sense}; ")
        });
        let crossing = answer.walls_overlap.as_ref();
        let walls = if crossing.is_some_and(|overlap| !overlap.corner_fold) {
            "walls overlap"
        } else {
            "no walls overlap"
        };
        let stretch = most(states().map(|s| s.max_stretch).collect());
        let pivots = states().map(|s| s.negative_pivots).max().unwrap_or(0);
        let mut lines = vec![format!(
            "{area}largest averaged stretch {}; {pivots} negative pivots; {walls}",
            number(Some(stretch))
        )];
        let gap = least(states().filter_map(|s| s.min_gap_mm).collect());
        let gap = gap.map_or_else(String::new, |gap| {
            format!("; least gap between facing walls {} mm", number(Some(gap)))
        });
        let contact = answer.contact.as_ref().map_or_else(
            || "; no contact acted".to_owned(),
            |contact| {
                let penetration = number(Some(contact.penetration_mm));
                format!("; contact acted, penetration {penetration} mm")
            },
        );
        lines.push(format!(
            "largest residual {}; least J {}{gap}{contact}",
            number(Some(most(states().map(|s| s.residual).collect()))),
            number(least(states().map(|s| s.min_jacobian).collect())),
        ));
        let noted = answer.notes.iter();
        lines.extend(noted.map(|note| format!("note: {}: {}", note.about, note.message)));
        lines
    }
}

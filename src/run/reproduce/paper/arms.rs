//! The studies of a reproduction: both methods of the paper, as the paper ran them and as Salp does.

use salp_core::document::parse_toml;
use salp_core::fault::Faults;
use salp_core::study::{Study, read_study};
use serde_json::{Value, json};

/// The whole framework, and the direct method.
const FRAMEWORK: &str = include_str!("../../../../examples/paper.toml");
const DIRECT: &str = include_str!("../../../../examples/direct.toml");

/// A study of the reproduction.
pub struct Arm {
    /// Name of its folder.
    pub id: &'static str,
    /// In tables and figures.
    pub title: &'static str,
    /// Whether all nine units are free.
    pub direct: bool,
    /// Whether it has Salp's settings, rather than the paper's.
    pub ours: bool,
    /// Resolved.
    pub study: Study,
}

/// All of them. `quick`: coarse meshes, few iterations, small budgets.
///
/// # Errors
/// None but for a fault of this program.
pub fn arms(quick: bool) -> Result<Vec<Arm>, Faults> {
    // Fig. 5b does not say which chamber is first.
    let upper = json!([[0, 0], [0, 15], [15, 15], [0, 0]]);
    let lower = json!([[0, 0], [15, 0], [15, 15], [0, 0]]);
    let arm = |id, title, direct, ours, document: &Value| {
        Ok(Arm {
            id,
            title,
            direct,
            ours,
            study: read_study(document, false)?,
        })
    };
    Ok(vec![
        arm(
            "hfm-salp",
            "HFm, Salp's settings",
            false,
            true,
            &framework(quick)?,
        )?,
        arm(
            "dm-salp",
            "Dm, Salp's settings",
            true,
            true,
            &direct(quick)?,
        )?,
        arm(
            "hfm-paper-upper",
            "HFm, the paper's settings, upper chamber first",
            false,
            false,
            &hfm(quick, &upper),
        )?,
        arm(
            "hfm-paper-lower",
            "HFm, the paper's settings, lower chamber first",
            false,
            false,
            &hfm(quick, &lower),
        )?,
        arm(
            "dm-paper-upper",
            "Dm, the paper's settings, upper chamber first",
            true,
            false,
            &dm(quick, &upper),
        )?,
        arm(
            "dm-paper-lower",
            "Dm, the paper's settings, lower chamber first",
            true,
            false,
            &dm(quick, &lower),
        )?,
    ])
}

/// The framework, and the direct method from its winner: what repetition gave up.
fn framework(quick: bool) -> Result<Value, Faults> {
    let mut document = parse_toml(FRAMEWORK)?;
    document["name"] = json!("hfm-salp");
    // The paper's layout, so that both methods have the same chambers; the example offers others.
    document["step"][1]["model"]["layouts"] = json!(["stacked_pair"]);
    document["step"][1]["optimiser"]["grid"][0] = json!([0]);
    let mut freed = parse_toml(DIRECT)?["step"][0].take();
    freed["id"] = json!("freed");
    freed["takes"] = json!([{"step": "three-units", "as": "starts", "candidates": 1}]);
    freed["restarts"] = json!({"start": "taken"});
    if quick {
        // Shared by two senses, of which a taken start runs in one: the winner as it is, and two steps.
        freed["budget"] = json!({"evaluations": 6});
    } else {
        freed["optimiser"]["max_iterations"] = json!(8);
    }
    freed["constraints"]["wall_gap_mm"] = json!("off");
    if let Some(steps) = document["step"].as_array_mut() {
        steps.push(freed);
    }
    if quick {
        coarse(&mut document);
        document["step"][2]["optimiser"]["max_iterations"] = json!(10);
    }
    Ok(document)
}

fn direct(quick: bool) -> Result<Value, Faults> {
    let mut document = parse_toml(DIRECT)?;
    document["name"] = json!("dm-salp");
    document["step"][0]["constraints"]["wall_gap_mm"] = json!("off");
    if quick {
        coarse(&mut document);
        document["step"][0]["optimiser"]["max_iterations"] = json!(7);
    }
    Ok(document)
}

/// Elements of at most 12 mm, two steps a leg, no bands.
fn coarse(document: &mut Value) {
    document["actuation"]["load_steps_per_leg"] = json!(2);
    document["error_bands"] = json!(false);
    for step in document["step"].as_array_mut().into_iter().flatten() {
        let kind = step["model"]["kind"].as_str().unwrap_or_default();
        if kind.starts_with("fe_") {
            step["model"]["max_size_mm"] = json!(crate::run::reproduce::realised::QUICK_SIZE_MM);
        }
    }
}

/// The paper's three-unit step (preset `paper`).
fn hfm(quick: bool, schedule: &Value) -> Value {
    let mut document = json!({
        "preset": "paper",
        "name": "hfm-paper",
        "actuation": {"schedule": schedule},
        "step": [{"id": "three-units"}],
    });
    if quick {
        document["actuation"]["load_steps_per_leg"] = json!(2);
        document["step"][0]["model"] = json!({"mean_size_mm": null, "max_size_mm": crate::run::reproduce::realised::QUICK_SIZE_MM});
        document["step"][0]["restarts"] =
            json!({"start": ["paper", "random"], "count": 1, "seed": 1});
        // Five gradients by differences and a little more for each of two restarts.
        document["step"][0]["budget"] = json!({"evaluations": 200});
    }
    document
}

/// The paper's direct method: all chambers of nine units, differences.
fn dm(quick: bool, schedule: &Value) -> Value {
    let mut document = json!({
        "preset": "paper",
        "name": "dm-paper",
        "actuator": {"units": 9},
        "actuation": {"schedule": schedule},
        "step": [{
            "id": "three-units",
            "level": 1,
            "model": {"kind": "fe_direct", "element": "quad4", "mean_size_mm": 0.9, "relative_residual_force_tolerance": 0.1, "contact": "auto"},
            "target": {"kind": "enclosed_area", "probe_mm": [640, 40], "orientation": "counter_clockwise"},
            "restarts": {"start": ["paper"]},
        }],
    });
    if quick {
        document["actuation"]["load_steps_per_leg"] = json!(2);
        document["step"][0]["model"]["mean_size_mm"] = json!(null);
        document["step"][0]["model"]["max_size_mm"] =
            json!(crate::run::reproduce::realised::QUICK_SIZE_MM);
        // One gradient by differences, and the steps that follow it.
        document["step"][0]["budget"] = json!({"evaluations": 155});
    }
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_study_reads_and_has_the_sizes_of_the_papers_table() {
        for quick in [true, false] {
            for arm in arms(quick).expect("sound documents") {
                let step = arm.study.steps.len() - 1;
                let variables = arm
                    .study
                    .variables(if arm.direct { step } else { step.min(2) });
                let count = variables.expect("chambers").lower.len();
                assert_eq!(count, if arm.direct { 144 } else { 16 }, "{}", arm.id);
            }
        }
    }
}

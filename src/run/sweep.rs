//! `salp run --sweep`: the study at several values of one field, one after the other, each in a folder of its own; then a
//! table, a CSV file and a picture of the best objective against the value.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use salp_core::document::{Sweep, shown};
use salp_core::fault::Faults;
use salp_core::scene::measure::Measure;
use salp_core::study::{Study, read_study};
use salp_protocol::StudyState;
use serde_json::{Value, json};

use super::{Ended, Run, report};
use crate::failure::Failure;
use crate::numbers::{Numbers, lines_of};
use crate::output::{Output, note, number};
use crate::sweep::{
    Drawn, Swept, SweptPoint, at_all_values, file_part, last_name, pressure_kpa, read_each,
};

impl Run {
    /// Runs each value; a run that was interrupted goes on where it was.
    pub(super) fn sweep(
        &self,
        document: &Value,
        sweep: &Sweep,
        interrupted: &AtomicBool,
        output: Output,
    ) -> Result<(), Failure> {
        let studies = read_each(document, sweep, at)?;
        for study in &studies {
            self.check_programs(study)?;
        }
        let name = studies[0].name.clone();
        let out = self.out.clone().unwrap_or_else(|| {
            let field = file_part(last_name(&sweep.path));
            PathBuf::from("salp-out").join(format!("{name}-sweep-{field}"))
        });
        let mut points = Vec::new();
        let mut limits = Vec::new();
        for (k, (study, value)) in studies.iter().zip(&sweep.values).enumerate() {
            note(&format!(
                "{} ({} of {})",
                sweep.assignment(value),
                k + 1,
                studies.len()
            ));
            let part = file_part(&format!("{}={}", last_name(&sweep.path), shown(value)));
            let folder = out.join(format!("{}-{part}", k + 1));
            let ended = self.carry_out(study, folder.clone(), interrupted)?;
            if ended.state == StudyState::Paused {
                return Err(Failure::Paused);
            }
            points.push(point(study, value, &ended, folder));
            limits.push(report::limits(study, study.steps.len() - 1));
        }
        let mut caption = at_all_values(sweep, &limits);
        caption.push(spent(&points));
        let swept = Swept {
            sweep,
            name,
            drawn: drawn(&studies[0]),
            points,
            caption: caption.clone(),
        };
        swept.write(&out)?;
        let failed = swept.points.iter().any(|p| p.status != "done");
        output.print(
            &swept.document(if failed { "failed" } else { "done" }),
            || {
                let numbers: Vec<Numbers> = swept
                    .points
                    .iter()
                    .filter_map(|p| p.numbers.clone())
                    .collect();
                let mut lines = vec![swept.name.clone(), swept.table()];
                lines.extend(lines_of(&numbers));
                lines.extend(caption);
                lines.push(format!("table, picture and studies in {}", out.display()));
                lines.join("\n")
            },
        );
        if failed {
            return Err(Failure::Study("at least one value did not end well".into()));
        }
        Ok(())
    }
}

/// The study of a document, scaled to a p/mu where that is swept.
fn at(document: &Value, p_over_mu: Option<f64>) -> Result<Study, Faults> {
    let mut study = read_study(document, true)?;
    let Some(ratio) = p_over_mu else {
        return Ok(study);
    };
    let Some(body) = &mut study.body else {
        let mut faults = Faults::default();
        faults.add("actuation", "a study of programs has no p/mu to sweep");
        return Err(faults);
    };
    let mu = body.material.each()[0].law.shear_modulus_mpa();
    body.actuation = body.actuation.scaled_to(pressure_kpa(ratio, mu));
    Ok(study)
}

fn point(study: &Study, value: &Value, ended: &Ended, folder: PathBuf) -> SweptPoint {
    let results = &ended.results;
    let best = results.best();
    let outcome = best.and_then(|(_, best)| {
        let row = results
            .ledger
            .iter()
            .find(|r| r.evaluation == best.evaluation)?;
        row.outcome.as_ref()?.report.as_ref()
    });
    // Without a best design the start's scene says p/mu and the rest as well.
    let step = best.map_or(study.steps.len() - 1, |(step, _)| step);
    let x = if let Some((_, best)) = best {
        Some(best.x.clone())
    } else {
        let first = results.restarts.iter().find(|r| r.step == step);
        first.and_then(|r| serde_json::from_value(r.summary["x0"].clone()).ok())
    };
    let scene = x.and_then(|x| study.scene(step, &x, None).ok());
    let state = json!(ended.state);
    SweptPoint {
        value: value.clone(),
        status: state.as_str().unwrap_or_default().to_owned(),
        objective: best.map(|(_, best)| best.objective),
        area: outcome.and_then(|r| r.enclosed_area_mm2),
        max_stretch: outcome.map(|r| r.max_stretch),
        numbers: scene.as_ref().map(|s| Numbers::of_study(study, s)),
        cpu_s: report::cpu_s(results),
        more: vec![
            ("restarts", json!(results.restarts.len())),
            ("evaluations", json!(results.view.counts.answered)),
        ],
        folder: Some(folder),
    }
}

/// Restarts and CPU time behind the points.
fn spent(points: &[SweptPoint]) -> String {
    let count = |name: &str| {
        let of = |p: &SweptPoint| p.more.iter().find(|(n, _)| *n == name)?.1.as_u64();
        points.iter().filter_map(of).sum::<u64>()
    };
    let cpu: f64 = points.iter().map(|p| p.cpu_s).sum();
    format!(
        "the best of {} restarts and {} evaluations at {} values; {} s of CPU in all",
        count("restarts"),
        count("evaluations"),
        points.len(),
        number(Some(cpu))
    )
}

/// An area is drawn as the size that was reached, other targets as they are minimised.
fn drawn(study: &Study) -> Drawn {
    let target = study.steps.last().and_then(|s| s.target.as_ref());
    match target {
        Some(target) if matches!(target.goal.measure, Measure::EnclosedArea { .. }) => Drawn {
            label: "enclosed area of the best design (mm\u{b2})".into(),
            of: |p| p.objective.map(|objective| -objective),
        },
        Some(target) => Drawn {
            label: format!("best objective ({})", target.goal.unit()),
            of: |p| p.objective,
        },
        None => Drawn {
            label: "best objective".into(),
            of: |p| p.objective,
        },
    }
}

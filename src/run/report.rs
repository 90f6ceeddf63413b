//! The report folder: curve, best design, summary, ledger, and one page that shows all.

use std::collections::BTreeMap;
use std::path::Path;

use salp_core::geometry::Point;
use salp_core::scene::{Bound, ContactMode, Goal, Measure};
use salp_core::study::Study;
use salp_core::study::spec::{Model, StepConstraints};
use salp_core::study::surrogate::fitness;
use salp_protocol::{Best, EvaluationRow, csv};
use serde_json::{Value, json};

use super::document::Results;
use super::finer;
use super::optima;
use super::page::Page;
use super::steps;
use super::winner::{self, Winner};
use crate::companions;
use crate::failure::Failure;
use crate::numbers::Numbers;
use crate::numerical_error::{self, numerical_error};
use crate::output::{number, write_file};
use crate::restarts::{self, Analysis, Named, StudyRestarts};
use crate::sensitivities;

/// What a report is made with.
pub struct Settings {
    /// Threads that solve what goes beyond the study.
    pub threads: usize,
    /// The numerical error of the best design is computed and added to the document.
    pub numerical_error: bool,
}

/// Writes everything into a folder; answers the summary.
pub fn write(
    folder: &Path,
    study: &Study,
    results: &Results,
    document: &mut Value,
    settings: &Settings,
) -> Result<String, Failure> {
    let at = |name: &str| folder.join(name);
    let mut page = Page::new(&study.name);
    let pretty = |value: &Value| serde_json::to_string_pretty(value).unwrap_or_default();
    write_file(&at("curve.csv"), &csv::curve(&results.curve))?;
    write_file(&at("ledger.csv"), &csv::ledger(&all_rows(results)))?;
    let mut lines = counts(results);
    lines.extend(crate::race::lines(&results.view.steps));
    lines.extend(coarse(results));
    let mut caption = Vec::new();
    let mut summary = json!({ "study_id": results.view.id, "name": study.name });
    match results.best() {
        None => lines.push("no feasible design without overlapping walls was found".into()),
        Some((step, best)) => {
            let given = steps::as_given(study, results, step);
            let study = &*given;
            let label = results.label(study, step, best.restart);
            let goal = goal(study, step);
            lines.extend(goal.map(|goal| format!("target: {}", goal.words())));
            lines.push(format!(
                "best objective {}{} in {}, evaluation {}, largest violation {}",
                number(Some(best.objective)),
                goal.map_or_else(String::new, |goal| format!(" {}", goal.unit())),
                label,
                best.evaluation,
                number(Some(best.max_violation))
            ));
            lines.extend(steps::sequence(study, step, &best.x));
            lines.extend(measures(study, results, step, best));
            lines.extend(surrogate(study, step));
            if let Some(active) = results.active(step) {
                lines.extend(
                    active.lines(
                        &goal.map_or_else(String::new, |goal| format!(" ({})", goal.unit())),
                    ),
                );
            }
            if let Some(evaluated) = winner::evaluated(study, results, step, best) {
                let scene = &evaluated.scene;
                caption = Numbers::of_study(study, scene).lines();
                caption.push(limits(study, step));
                summary["numbers"] = Numbers::of_study(study, scene).document();
                write_file(&at("best.json"), &pretty(&scene.document()))?;
                let plan = evaluated.plan(study, step);
                let winner = Winner::solve(
                    &format!("{}: best design", study.name),
                    scene,
                    plan.as_ref(),
                    &caption,
                )?;
                write_file(&at("best.svg"), &winner.svg)?;
                page.figure("The best design", &winner.svg);
                lines.extend(winner.lines());
                lines.extend(of_winner(results, step, goal, &winner, &mut summary));
                if settings.numerical_error {
                    let error =
                        numerical_error(scene, plan.as_ref(), &winner.answer, settings.threads)?;
                    lines.extend(numerical_error::lines(&error));
                    summary["numerical_error"] = json!(error);
                    document["numerical_error"] = json!(error);
                } else {
                    lines.push(
                        "numerical error beyond the band: not computed (--numerical-error)".into(),
                    );
                }
                let (finer, beside) = std::thread::scope(|scope| {
                    let finer = scope.spawn(|| finer::solve(study, step, best, &evaluated));
                    let threads = settings.threads.saturating_sub(1).max(1);
                    let beside = companions::solve(scene, plan.as_ref(), threads);
                    (finer.join().ok().flatten(), beside)
                });
                let beside = beside?;
                lines.extend(finer.as_ref().map(|f| f.line(goal.map_or("", Goal::unit))));
                lines.extend(companions::lines(&winner.answer, &beside));
                summary["finer_elements"] = json!(finer);
                summary["companions"] = json!(beside);
                summary["enclosed_area_mm2"] = json!(winner.answer.enclosed_area_mm2);
            } else {
                write_file(
                    &at("best.json"),
                    &pretty(&json!({ "x": best.x, "objective": best.objective })),
                )?;
                if settings.numerical_error {
                    lines.push("numerical error not known: the model is a program".into());
                }
            }
            summary["best"] = json!(best);
        }
    }
    let winner = results.best().map(|(step, _)| step);
    let (of_steps, documents) = steps::write(folder, study, results, winner, &mut page)?;
    lines.extend(of_steps);
    summary["steps"] = documents;
    lines.extend(optima::tables(study, results));
    lines.push(bands(study, results));
    lines.extend(guesses(study, results));
    let restarts = StudyRestarts::of(study, results);
    write_file(&at(restarts::FILE), &json!(restarts).to_string())?;
    summary["starts"] = of_starts(folder, &restarts, &caption, &mut page, &mut lines)?;
    lines.extend(crate::accuracy::lines(study));
    lines.extend(caption.iter().cloned());
    // Steps of programs have no goal, and their objective no unit that we know.
    let unit = results.best().and_then(|(step, _)| goal(study, step));
    let unit = unit.map_or_else(String::new, |goal| format!(" ({})", goal.unit()));
    write_file(&at("result.json"), &document.to_string())?;
    let label = |step: usize, index: usize| results.label(study, step, index);
    let curve = crate::curve::picture(&results.curve, &study.name, &unit, label, caption);
    let curve = curve.svg();
    write_file(&at("curve.svg"), &curve)?;
    page.figure("Run time against the best objective", &curve);
    summary["bands"] = json!(results.view.counts.bands);
    summary["guesses"] = json!(results.view.counts.guesses);
    summary["races"] = json!(
        results
            .view
            .steps
            .iter()
            .map(|s| &s.race)
            .collect::<Vec<_>>()
    );
    summary["restarts"] = json!(results.restarts.len());
    summary["evaluations"] = json!(results.view.counts.answered);
    summary["cpu_s"] = json!(cpu_s(results));
    summary["wall_s"] = json!(results.seconds);
    summary["evaluations_by_worker"] = json!(by_worker(results));
    summary["text"] = json!(lines);
    write_file(&at("summary.json"), &pretty(&summary))?;
    write_file(&at("report.html"), &page.html(&lines))?;
    lines.push(format!("report in {}", folder.display()));
    let text = format!("{}\n{}", study.name, lines.join("\n"));
    write_file(&at("summary.txt"), &format!("{text}\n"))?;
    Ok(text)
}

/// What the best design's objective is worth by its numbers and by its limits.
fn of_winner(
    results: &Results,
    step: usize,
    goal: Option<&Goal<Point>>,
    best: &Winner,
    summary: &mut Value,
) -> Vec<String> {
    let unit = goal.map_or("", Goal::unit);
    let Some(found) = &best.sensitivities else {
        return Vec::new();
    };
    summary["sensitivities"] = json!(found);
    let mut lines = sensitivities::lines(found, unit);
    if let Some(active) = results.active(step) {
        summary["sensitivities"]["limits"] = json!(active.by_limit());
        lines.extend(active.limit_lines(unit));
    }
    lines
}

/// What the starts of the winner's step are worth, where there are several.
fn of_starts(
    folder: &Path,
    restarts: &StudyRestarts,
    caption: &[String],
    page: &mut Page,
    lines: &mut Vec<String>,
) -> Result<Value, Failure> {
    let Some(step) = restarts.step(None).filter(|step| step.runs.len() > 1) else {
        return Ok(Value::Null);
    };
    let label = match restarts.steps.len() {
        1 => restarts.name.clone(),
        _ => format!("{}: {}", restarts.name, step.step),
    };
    let title = label.clone();
    let analysis = Analysis::of(vec![Named { label, step }], None);
    let figures = analysis.figures(&title, caption);
    Analysis::write(&figures, folder)?;
    for figure in &figures {
        page.figure(figure.caption, &figure.svg);
    }
    lines.extend(analysis.lines());
    Ok(analysis.document())
}

fn counts(results: &Results) -> Vec<String> {
    let counts = &results.view.counts;
    let workers = by_worker(results);
    let shares: Vec<String> = workers.values().map(usize::to_string).collect();
    vec![
        format!(
            "{}: {} restarts, {} evaluations ({} without values, {} alarms)",
            results.view.state,
            results.restarts.len(),
            counts.answered,
            counts.without_values,
            counts.alarms
        ),
        format!(
            "{} s of CPU in {} s of wall time; {} worker processes took part ({} evaluations)",
            number(Some(cpu_s(results))),
            number(Some(results.seconds)),
            workers.len(),
            shares.join(" + ")
        ),
    ]
}

/// The band of the best design, and what the bands took.
fn bands(study: &Study, results: &Results) -> String {
    if study.body.is_none() {
        return "no error bands: every model is a program".into();
    }
    if !study.error_bands {
        return "no error bands: the study says off".into();
    }
    let counts = &results.view.counts.bands;
    let best = results.best().map_or_else(String::new, |(step, best)| {
        let unit = goal(study, step).map_or_else(String::new, |goal| format!(" {}", goal.unit()));
        match results.band(step) {
            Some([low, high]) => format!(
                "best {} \u{b1} {}{unit} (two meshes); ",
                number(Some(best.objective)),
                number(Some((high - low) / 2.0))
            ),
            None => "band of the best not known; ".to_owned(),
        }
    });
    format!(
        "{best}bands: {} evaluations ({} without values), {} s of CPU beside that of the optimisers",
        counts.answered,
        counts.without_values,
        number(Some(counts.cpu_s))
    )
}

/// What was evaluated before an optimiser asked for it.
fn guesses(study: &Study, results: &Results) -> Option<String> {
    let guesses = &results.view.counts.guesses;
    study.speculate.then(|| {
        format!(
            "guesses: {} evaluations by workers that had nothing else to do, {} of them asked for since, {} s of CPU beside that of \
             the optimisers",
            guesses.answered,
            guesses.used,
            number(Some(guesses.cpu_s))
        )
    })
}

/// What was evaluated below the study's own fidelity.
fn coarse(results: &Results) -> Option<String> {
    let coarse = || results.ledger.iter().filter(|row| row.fidelity.is_some());
    let paid = coarse().filter(|row| row.cached_from.is_none());
    let cpu_s: f64 = paid.filter_map(|row| row.cpu_s).sum();
    (coarse().count() > 0).then(|| {
        format!(
            "below the study's own fidelity: {} of the evaluations, {} s of the CPU; none of them counts as best",
            coarse().count(),
            number(Some(cpu_s))
        )
    })
}

/// The whole ledger.
fn all_rows(results: &Results) -> Vec<EvaluationRow> {
    let mut rows = results.ledger.clone();
    rows.extend(results.bands.iter().cloned());
    rows.extend(results.guesses.iter().cloned());
    rows
}

/// CPU time that was spent by optimisers: a known result costs nothing again.
pub fn cpu_s(results: &Results) -> f64 {
    results
        .ledger
        .iter()
        .filter(|row| row.cached_from.is_none())
        .filter_map(|row| row.cpu_s)
        .sum()
}

fn by_worker(results: &Results) -> BTreeMap<String, usize> {
    let mut workers = BTreeMap::new();
    for row in &results.ledger {
        if let (Some(worker), None) = (&row.worker, &row.cached_from) {
            *workers.entry(worker.to_string()).or_insert(0) += 1;
        }
    }
    workers
}

/// What a step minimises; `None` for programs.
fn goal(study: &Study, step: usize) -> Option<&Goal<Point>> {
    Some(&study.steps.get(step)?.target.as_ref()?.goal)
}

/// Whether the units of a step's chain may stand for nine under its schedule, where its target is an area.
fn surrogate(study: &Study, step: usize) -> Option<String> {
    let area = matches!(goal(study, step)?.measure, Measure::EnclosedArea { .. });
    let body = study.body_of(step).ok()??;
    let fitness = fitness(&body.actuation.rows_kpa, body.actuator.units);
    fitness.sentence().filter(|_| area)
}

/// The best design's measures: that of the target, then each bound with what must hold.
fn measures(study: &Study, results: &Results, step: usize, best: &Best) -> Vec<String> {
    let row = results
        .ledger
        .iter()
        .find(|r| r.evaluation == best.evaluation);
    let outcome = row.and_then(|r| r.outcome.as_ref());
    let values = outcome.and_then(|o| o.report.as_ref()).map(|r| &r.measures);
    let (Some(goal), Some([of_target, of_bounds @ ..])) =
        (goal(study, step), values.map(Vec::as_slice))
    else {
        return Vec::new();
    };
    let Some(StepConstraints::Chambers(constraints)) =
        study.steps.get(step).map(|s| &s.constraints)
    else {
        return Vec::new();
    };
    let said =
        |words: &str, value: f64, unit: &str| format!("{words}: {} {unit}", number(Some(value)));
    let target = said(&goal.measure.words(), *of_target, goal.measure.unit());
    let bounds = constraints.bounds.iter().zip(of_bounds);
    let bounds = bounds.map(|(b, v)| format!("bound: {}", said(&b.words(), *v, b.measure.unit())));
    [target].into_iter().chain(bounds).collect()
}

/// What every counted design satisfies, and what is off.
pub fn limits(study: &Study, step: usize) -> String {
    let (Some(body), Some(step)) = (&study.body, study.steps.get(step)) else {
        return String::new();
    };
    let StepConstraints::Chambers(constraints) = &step.constraints else {
        return String::new();
    };
    let stretch = body.stretch_limit(constraints).map_or_else(
        || "stretch limit off".to_owned(),
        |limit| {
            format!(
                "averaged stretch \u{2264} {} (radius {} mm)",
                number(Some(limit)),
                constraints.stretch_length_mm
            )
        },
    );
    let gap = constraints
        .wall_gap_mm
        .number()
        .map_or_else(String::new, |gap| {
            format!("facing walls \u{2265} {gap} mm apart at every state; ")
        });
    let contact = match &step.model {
        Model::FeCascade(fe) | Model::FeDirect(fe) if fe.contact != ContactMode::Off => format!(
            "contact without friction (activation distance {} mm); ",
            fe.contact_activation_mm
        ),
        _ => "contact off; ".to_owned(),
    };
    let margin = constraints.load_margin.number().map_or_else(
        || "load margin off; ".to_owned(),
        |factor| format!("the same up to {factor} times every loaded row; "),
    );
    let unique = if constraints.exclude_non_unique {
        "no second equilibrium met; "
    } else {
        ""
    };
    let materials: Vec<&str> = body
        .material
        .each()
        .iter()
        .map(|m| m.record.as_deref().unwrap_or("given by the study"))
        .collect();
    let material = materials.join(", ");
    let bounds: Vec<String> = constraints.bounds.iter().map(Bound::words).collect();
    let bounds = if bounds.is_empty() {
        String::new()
    } else {
        format!("; bounds: {}", bounds.join(", "))
    };
    format!(
        "limits: {stretch}; {margin}walls \u{2265} {} mm; corners \u{2265} {}\u{b0}; {contact}{gap}{unique}no overlapping walls, no negative pivots; material {material}{bounds}",
        constraints.wall_mm, constraints.spike_deg
    )
}

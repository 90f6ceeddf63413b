//! The steps of a study: the graph as it ran, what each found, what each simplification gave up.

use std::borrow::Cow;
use std::path::Path;

use salp_core::hierarchy::{GivenUp, StepResult, given_up};
use salp_core::picture::{GraphPicture, GraphStep, ReducedPicture};
use salp_core::reduced::{Bounds, Entry, LinearTransform, MapAxis, area_map, largest_areas};
use salp_core::scene::Measure;
use salp_core::study::spec::{Model, StudyStep, Variables};
use salp_core::study::takes::{Pass, Simplification, TakenAs};
use salp_core::study::{StepInputs, Study};
use salp_protocol::{StepState, StepView};
use serde_json::{Value, json};

use super::document::Results;
use super::page::Page;
use super::winner::{self, Winner};
use crate::failure::Failure;
use crate::numbers::Numbers;
use crate::output::{number, table, write_file};

/// Most actuations of the reduced model's figure, the starts of each search, and the values of an axis of its map.
const ACTUATIONS: usize = 5;
const STARTS: usize = 16;
const MAP: usize = 41;

/// What a step took, as stored.
pub fn inputs(view: &StepView) -> StepInputs {
    let inputs = view.inputs.clone().unwrap_or(Value::Null);
    serde_json::from_value(inputs).unwrap_or_default()
}

/// The study as a step means it with what it took.
pub fn as_given<'a>(study: &'a Study, results: &Results, step: usize) -> Cow<'a, Study> {
    match results.view.steps.get(step) {
        Some(view) => study.given(step, &inputs(view).given),
        None => Cow::Borrowed(study),
    }
}

/// Writes the figures of a study of several steps; answers lines for the summary, and the steps as a document. `winner` is the
/// step whose best design has figures of its own.
pub fn write(
    folder: &Path,
    study: &Study,
    results: &Results,
    winner: Option<usize>,
    page: &mut Page,
) -> Result<(Vec<String>, Value), Failure> {
    if study.steps.len() < 2 {
        return Ok((Vec::new(), Value::Null));
    }
    let graph = graph(study, results);
    write_file(&folder.join("hierarchy.svg"), &graph)?;
    page.figure("The hierarchical framework as it ran", &graph);
    let mut lines = Vec::new();
    let mut documents = Vec::new();
    for (step, (s, view)) in study.steps.iter().zip(&results.view.steps).enumerate() {
        let told = of_step(study, results, step).join("; ");
        lines.push(format!("step {}: {told}", s.id));
        let rows = given_up_by(results, step);
        if !rows.is_empty() {
            lines.push(gave_up(s, &rows));
        }
        documents.push(json!({
            "id": s.id,
            "state": view.state,
            "cpu_s": cpu_s(results, step),
            "inputs": view.inputs,
            "result": view.result,
            "given_up": rows,
        }));
        if Some(step) != winner
            && let Some(svg) = figure(folder, study, results, step)?
        {
            write_file(&folder.join(format!("steps/{}.svg", s.id)), &svg)?;
            page.figure(&format!("Step {}", s.id), &svg);
        }
    }
    Ok((lines, json!(documents)))
}

/// CPU time of a step's optimisers, s: a known result costs nothing again.
fn cpu_s(results: &Results, step: usize) -> f64 {
    let rows = results.ledger.iter().filter(|row| row.step == step);
    let paid = rows.filter(|row| row.cached_from.is_none());
    paid.filter_map(|row| row.cpu_s).sum()
}

fn given_up_by(results: &Results, step: usize) -> Vec<GivenUp> {
    let rows = results.ledger.iter().filter(|row| row.step == step);
    let evaluated: Vec<(&[f64], f64)> = rows
        .filter(|row| row.fidelity.is_none())
        .filter_map(|row| Some((row.x.as_slice(), row.objective?)))
        .collect();
    let view = &results.view.steps[step];
    let best = view.best.as_ref().map(|best| best.objective);
    given_up(&inputs(view), &evaluated, best)
}

/// A table of the same designs in two models.
fn gave_up(step: &StudyStep, rows: &[GivenUp]) -> String {
    let lines: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let names = row
                .from
                .iter()
                .map(|f| format!("{} {}", f.step, f.candidate + 1));
            let there = row.from.iter().map(|f| number(Some(f.objective)));
            vec![
                names.collect::<Vec<_>>().join(" + "),
                there.collect::<Vec<_>>().join(", "),
                number(row.objective),
                number(row.best),
            ]
        })
        .collect();
    let here = format!("in {}", step.id);
    let header = ["taken", "objective there", &here, "best that counts"];
    format!(
        "what the simplification gave up, seen in step {}:\n{}",
        step.id,
        table(&header, &lines)
    )
}

/// What a step is, in a few words.
fn model(study: &Study, step: usize) -> String {
    let s = &study.steps[step];
    let whole = study.body.as_ref().map_or(0, |body| body.actuator.units);
    let units = s.model.units().unwrap_or(whole);
    let variables = study.variables(step).map_or(0, |v| v.lower.len());
    match &s.model {
        Model::FeCascade(_) => format!("FE, {units} copies of a unit, {variables} variables"),
        Model::FeDirect(_) if s.variables.are_letters() => {
            let letters = study.letters(step).unwrap_or(0);
            format!("FE, {units} units, each one of {letters}")
        }
        Model::FeDirect(_) => format!("FE, {units} free units, {variables} variables"),
        Model::FeLayouts(model) => format!("FE, one unit, {} layouts", model.layouts.len()),
        Model::LinearTransform(model) => format!(
            "reduced model (Eq. 1), {units} units, {} actuations",
            model.actuations
        ),
        Model::ConstantStrain(model) => format!(
            "reduced model (constant strains), {units} units, {} actuations",
            model.actuations
        ),
        Model::Command(_) => format!("a program, {variables} variables"),
    }
}

fn of_step(study: &Study, results: &Results, step: usize) -> Vec<String> {
    let given = as_given(study, results, step);
    let study = &*given;
    let (s, view) = (&study.steps[step], &results.view.steps[step]);
    let mut lines = vec![model(study, step)];
    if !s.simplifies.is_empty() {
        let names: Vec<&str> = s.simplifies.iter().map(Simplification::name).collect();
        lines.push(format!("simplifies: {}", names.join(", ")));
    }
    let state = json!(view.state);
    let state = state.as_str().unwrap_or_default();
    let rows = results.ledger.iter().filter(|row| row.step == step);
    let wall = view
        .began_ms
        .zip(view.ended_ms)
        .map_or_else(String::new, |(from, to)| {
            format!(" in {} s", number(Some((to - from) as f64 / 1e3)))
        });
    lines.push(match &view.reason {
        Some(reason) => format!("{state}: {reason}"),
        None => format!(
            "{state}{wall}: {} evaluations, {} s of CPU",
            rows.count(),
            number(Some(cpu_s(results, step)))
        ),
    });
    if let Some(best) = &view.best {
        let target = s.target.as_ref();
        let unit = target.map_or_else(String::new, |target| format!(" {}", target.goal.unit()));
        let layout = match &s.model {
            Model::FeLayouts(model) => format!(", {}", name(&json!(model.at(&best.x).0))),
            _ => sequence(study, step, &best.x).map_or_else(String::new, |s| format!(", {s}")),
        };
        let result = view.result.clone().unwrap_or(Value::Null);
        let kept: StepResult = serde_json::from_value(result).unwrap_or_default();
        lines.push(format!(
            "best {}{unit}{layout}; hands on {}",
            number(Some(best.objective)),
            kept.candidates.len()
        ));
        lines.extend(alphabet(study, step));
    } else if view.state == StepState::Done {
        lines.push("nothing feasible was found".into());
    }
    lines
}

/// Which unit is which, of a design that is a sequence of units; letters count from 1.
pub fn sequence(study: &Study, step: usize, x: &[f64]) -> Option<String> {
    study.sequence(step, x).map(|letters| spelt(&letters))
}

/// A sequence in words.
pub fn spelt(letters: &[usize]) -> String {
    let letters: Vec<String> = letters.iter().map(usize::to_string).collect();
    format!("sequence {}", letters.join(" "))
}

/// What the letters of a step's sequences are.
pub fn alphabet(study: &Study, step: usize) -> Option<String> {
    let letters = &study.steps.get(step)?.given.alphabet;
    let words = letters.iter().enumerate().map(|(k, letter)| {
        let from = &letter.from;
        format!(
            "{}: step {}, candidate {}, unit {}",
            k + 1,
            from.step,
            from.candidate + 1,
            letter.unit
        )
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| format!("units of the sequences: {}", words.join("; ")))
}

fn name(value: &Value) -> String {
    value.as_str().unwrap_or_default().replace('_', " ")
}

fn graph(study: &Study, results: &Results) -> String {
    let steps = study.steps.iter().zip(&results.view.steps).enumerate();
    let steps = steps.map(|(step, (s, view))| GraphStep {
        id: s.id.clone(),
        level: s.level,
        forward: s.pass == Pass::Forward,
        done: view.state == StepState::Done && view.best.is_some(),
        lines: of_step(study, results, step),
    });
    let takes = study.steps.iter().enumerate().flat_map(|(to, s)| {
        s.takes.iter().filter_map(move |take| {
            let word = match take.taken_as {
                TakenAs::Starts => "starts",
                TakenAs::Geometry => "geometry",
                TakenAs::Alphabet => "alphabet",
                TakenAs::Layout => "layout",
                TakenAs::Behaviour => "behaviour",
            };
            let units: Vec<String> = take.units.iter().map(usize::to_string).collect();
            let label = match &units[..] {
                [] => word.to_owned(),
                units => format!("{word} of units {}", units.join(", ")),
            };
            Some((study.index_of(&take.step)?, to, label))
        })
    });
    GraphPicture {
        title: format!("{}: the framework as it ran", study.name),
        steps: steps.collect(),
        takes: takes.collect(),
        caption: vec![format!("{}; dashed: no candidates.", results.view.state)],
    }
    .svg()
}

/// The figure of a step: its best design, or what its reduced model asks for; `None` where there is nothing to draw.
fn figure(
    folder: &Path,
    study: &Study,
    results: &Results,
    step: usize,
) -> Result<Option<String>, Failure> {
    let given = as_given(study, results, step);
    let study = &*given;
    let Some(best) = results
        .view
        .steps
        .get(step)
        .and_then(|view| view.best.as_ref())
    else {
        return Ok(None);
    };
    if study.steps[step].model.reduced().is_some() {
        return Ok(reduced(study, step, &best.x));
    }
    let Some(evaluated) = winner::evaluated(study, results, step, best) else {
        return Ok(None);
    };
    let scene = &evaluated.scene;
    let file = folder.join(format!("steps/{}.json", study.steps[step].id));
    let pretty = serde_json::to_string_pretty(&scene.document()).unwrap_or_default();
    write_file(&file, &pretty)?;
    let plan = evaluated.plan(study, step);
    let caption = Numbers::of_study(study, scene).lines();
    let title = format!("{}, step {}", study.name, study.steps[step].id);
    Ok(Some(
        Winner::solve(&title, scene, plan.as_ref(), &caption)?.svg,
    ))
}

/// Fig. 4 of the paper for the transformations that a step asks for.
fn reduced(study: &Study, step: usize, x: &[f64]) -> Option<String> {
    let body = study.body_of(step).ok()??;
    let transforms = study.transforms_of(step, x).ok()?;
    let unit_mm = body.actuator.unit_mm;
    let Measure::EnclosedArea { probe, .. } = &study.steps[step].target.as_ref()?.goal.measure
    else {
        return None;
    };
    let units = (probe[0] / unit_mm[0]).round() as usize;
    let rows: Vec<(String, LinearTransform)> = transforms
        .iter()
        .enumerate()
        .map(|(k, t)| (format!("actuation {}", k + 1), *t))
        .collect();
    let Variables::Bounds { lower, upper } = &study.steps[step].variables else {
        return None;
    };
    let of_first = |entries: &[f64]| Some(LinearTransform::from_slice(entries.first_chunk::<4>()?));
    // The design space is drawn over entries of transformations.
    let space = match study.steps[step].model {
        Model::LinearTransform(_) => Some(Bounds {
            lower: of_first(lower)?,
            upper: of_first(upper)?,
        }),
        _ => None,
    };
    let largest: Vec<f64> = space
        .iter()
        .flat_map(|bounds| largest_areas(ACTUATIONS, bounds, unit_mm, units, STARTS))
        .map(|e| e.area_mm2)
        .collect();
    let axis = |bounds: &Bounds, actuation: usize| {
        let k = Entry::XSh as usize;
        let (low, high) = (bounds.lower.entries()[k], bounds.upper.entries()[k]);
        let value = |i: usize| low + (high - low) * i as f64 / (MAP - 1) as f64;
        MapAxis {
            actuation,
            entry: Entry::XSh,
            values: (0..MAP).map(value).collect(),
        }
    };
    let map = match (&transforms[..], &space) {
        ([a, b, ..], Some(bounds)) => {
            let axes = [axis(bounds, 0), axis(bounds, 1)];
            let map = area_map(&transforms, axes, unit_mm, units).ok();
            map.map(|map| (map, [a.x_sh, b.x_sh]))
        }
        _ => None,
    };
    let picture = ReducedPicture {
        title: &format!(
            "{}, step {}: what is asked of a unit",
            study.name, study.steps[step].id
        ),
        unit_mm,
        chambers_mm: &[],
        rows: &rows,
        units,
        paths: &[],
        largest_mm2: &largest,
        map: map.as_ref().map(|(map, at)| (map, *at)),
        caption: &[
            "Transformations within the bounds of the step; start and ends of actuations alone."
                .to_owned(),
        ],
    };
    Some(picture.svg())
}

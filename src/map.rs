//! `salp map`: the tip over the plane of two pressures, and what schedules enclose on it.

use std::path::PathBuf;

use clap::Args;
use salp_core::actuation::{ActuationCycle, Spacing};
use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::pressure_map::{
    CannotMap, DEFAULT_GRID, NotScored, PressureMap, Score, check_rows,
};
use salp_core::evaluate::{SceneAnswer, SceneOptions, SceneStatus, solve_scene};
use salp_core::fault::Faults;
use salp_core::objective::enclosed_area::area;
use salp_core::picture::PressurePlanePicture;
use salp_core::scene::{Probe, Scene, read_scene};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::numbers::{Numbers, tip};
use crate::output::{Output, number, table, write_file};
use crate::solve::ended_well;
use crate::stopwatch::{Stopwatch, cpu_seconds};

/// Schedules that are scored where none is named.
const USUAL: [&str; 3] = ["hold", "swap", "overlap"];
const EXPECTED: &str = "expected hold, swap, overlap or rows such as [[0,0],[15,0],[0,0]]";
/// Lines of constant pressure in the picture, and points on each.
const LINES: usize = 7;
const POINTS: usize = 60;

/// Arguments of `salp map`.
#[derive(Args)]
pub struct Map {
    #[command(flatten)]
    scene: DocumentArguments,
    /// Pressures of each channel, zero among them: odd
    #[arg(long, value_name = "N", default_value_t = DEFAULT_GRID)]
    grid: usize,
    /// Scores a schedule: hold, swap, overlap, or rows of kPa such as `[[0,0],[15,0],[0,15],[0,0]]`; may be repeated
    /// [default: hold, swap, overlap]
    #[arg(long = "schedule", value_name = "NAME|ROWS")]
    schedules: Vec<String>,
    /// Solves each schedule directly as well, with the scene's states a leg
    #[arg(long)]
    direct: bool,
    /// Writes the displacement of each probe at each pair of pressures
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Draws the tip over the pressure plane, with the path of the first schedule
    #[arg(long)]
    svg: Option<PathBuf>,
}

/// A schedule to score.
struct Schedule {
    name: String,
    rows_kpa: Vec<Vec<f64>>,
}

/// What became of a schedule.
struct Scored {
    schedule: Schedule,
    /// Per probe.
    scores: Vec<Score>,
    direct: Option<Direct>,
}

/// A schedule's own solve.
struct Direct {
    answer: SceneAnswer,
    cpu_s: f64,
    /// Per probe; empty where the path is not complete.
    areas: Vec<f64>,
}

impl Map {
    /// Solves the map, scores the schedules and prints them.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let scene = read_scene(&self.scene.read()?, self.scene.folder())?;
        let largest = scene.actuation.rows_kpa.iter().flatten();
        let largest = largest.fold(0.0, |m: f64, p| m.max(*p));
        let schedules = self.schedules(largest)?;
        let mut stopwatch = Stopwatch::start();
        let map = PressureMap::solve(&scene, self.grid, None, &mut stopwatch);
        let map = map.map_err(|why| refused(&why))?;
        let seconds = stopwatch.document();
        let mut all = Vec::new();
        let mut why = None;
        for schedule in schedules {
            let score = |probe: &Probe| map.score(&probe.name, &schedule.rows_kpa);
            let scores = match scene.probes.iter().map(score).collect() {
                Ok(scores) => scores,
                Err(wrong) => {
                    why = Some(wrong);
                    Vec::new()
                }
            };
            let direct = self.direct.then(|| direct(&scene, &schedule)).transpose()?;
            all.push(Scored {
                schedule,
                scores,
                direct,
            });
        }
        if let Some(file) = &self.csv {
            write_file(file, &csv(&scene, &map))?;
        }
        if let Some(file) = &self.svg {
            let name = self.scene.file.file_stem().unwrap_or_default();
            let first = all.first();
            match picture(&name.to_string_lossy(), &scene, &map, first) {
                Ok(picture) => write_file(file, &picture)?,
                Err(wrong) => why = Some(wrong),
            }
        }
        let document = document(&scene, &map, &all, &seconds, why.as_ref());
        output.print(&document, || {
            text(&scene, &map, &all, &seconds, why.as_ref())
        });
        ended_well(&map.answer)?;
        match why {
            Some(_) => Err(Failure::Run("the map scores no schedule")),
            None => Ok(()),
        }
    }

    /// The schedules of the arguments, named ones up to the largest pressure.
    fn schedules(&self, largest_kpa: f64) -> Result<Vec<Schedule>, Failure> {
        let usual: Vec<String> = USUAL.map(str::to_owned).to_vec();
        let wanted = if self.schedules.is_empty() {
            &usual
        } else {
            &self.schedules
        };
        let mut faults = Faults::default();
        let mut all = Vec::new();
        for (index, name) in wanted.iter().enumerate() {
            let named = USUAL.contains(&name.as_str());
            let rows = match ActuationCycle::named_rows(name, largest_kpa).filter(|_| named) {
                Some(rows) => Ok(rows),
                None => serde_json::from_str(name).map_err(|_| EXPECTED.to_owned()),
            };
            let checked = rows.and_then(|rows: Vec<Vec<f64>>| {
                let sound = check_rows(&rows, largest_kpa);
                sound.map(|()| rows).map_err(|why| why.to_string())
            });
            match checked {
                Ok(rows_kpa) => all.push(Schedule {
                    name: name.clone(),
                    rows_kpa,
                }),
                Err(why) => faults.add(format!("schedule[{index}]"), why),
            }
        }
        Ok(faults.check(all)?)
    }
}

/// A scene or a grid without a map is bad input.
fn refused(why: &CannotMap) -> Failure {
    let path = match why {
        CannotMap::Scene(faults) => return Failure::BadInput(faults.clone()),
        CannotMap::Channels { .. } | CannotMap::Pressure { .. } => "actuation.schedule",
        CannotMap::Grid { .. } => "grid",
        CannotMap::NoProbe => "probes",
    };
    Failure::fault(path, why.to_string())
}

fn direct(scene: &Scene, schedule: &Schedule) -> Result<Direct, Failure> {
    let mut own = scene.clone();
    own.actuation.rows_kpa.clone_from(&schedule.rows_kpa);
    own.objective = None;
    let before = cpu_seconds();
    let answer = solve_scene(&own, &SceneOptions::default(), &mut Unobserved)?.answer;
    let cpu_s = cpu_seconds() - before;
    let of_probe = |probe: &Probe| {
        let path = answer.path.iter();
        let points: Vec<[f64; 2]> = path
            .filter_map(|s| s.displacement_mm.get(&probe.name).copied())
            .collect();
        area(&points)
    };
    let areas = if answer.status == SceneStatus::Ok {
        scene.probes.iter().map(of_probe).collect()
    } else {
        Vec::new()
    };
    Ok(Direct {
        answer,
        cpu_s,
        areas,
    })
}

fn document(
    scene: &Scene,
    map: &PressureMap,
    all: &[Scored],
    seconds: &Value,
    why: Option<&NotScored>,
) -> Value {
    let answer = &map.answer;
    let by_probe = |values: Vec<Value>| -> Value {
        let names = scene.probes.iter().map(|p| p.name.clone());
        Value::Object(names.zip(values).collect())
    };
    let schedules: Vec<Value> = all
        .iter()
        .map(|s| {
            let mut entry = json!({"schedule": s.schedule.name, "rows_kpa": s.schedule.rows_kpa});
            entry["scores"] = by_probe(s.scores.iter().map(|score| json!(score)).collect());
            if let Some(direct) = &s.direct {
                let areas = by_probe(direct.areas.iter().map(|a| json!(a)).collect());
                entry["direct"] = json!({
                    "status": direct.answer.status,
                    "unique": direct.answer.unique,
                    "enclosed_area_mm2": areas,
                    "work": direct.answer.work,
                    "cpu_s": direct.cpu_s,
                });
            }
            entry
        })
        .collect();
    let states: Vec<Value> = (answer.path.iter())
        .map(|s| json!({"pressure_kpa": s.pressure_kpa, "displacement_mm": s.displacement_mm}))
        .collect();
    let stretches = answer.path.iter().map(|s| s.max_stretch);
    json!({
        "status": answer.status,
        "reason": answer.reason,
        "limit": answer.limit,
        "unique": map.not_unique.is_none(),
        "not_unique": map.not_unique,
        "not_scored": why.map(ToString::to_string),
        "pressures_kpa": map.pressures_kpa,
        "gap_mm": map.gap_mm,
        "schedules": schedules,
        "states": states,
        "max_stretch": stretches.fold(1.0, f64::max),
        "walls_overlap": answer.walls_overlap,
        "contact": answer.contact,
        "numbers": Numbers::of(scene).document(),
        "mesh": answer.mesh,
        "work": answer.work,
        "notes": answer.notes,
        "seconds": seconds,
    })
}

fn text(
    scene: &Scene,
    map: &PressureMap,
    all: &[Scored],
    seconds: &Value,
    why: Option<&NotScored>,
) -> String {
    let answer = &map.answer;
    let mut lines = Vec::new();
    if let Some(reason) = &answer.reason {
        lines.push(format!("not complete: {reason}"));
    }
    if let Some(limit) = &answer.limit {
        let at: Vec<String> = limit
            .pressure_kpa
            .iter()
            .map(|p| number(Some(*p)))
            .collect();
        let kind = limit.kind.name().replace('_', " ");
        lines.push(format!(
            "no equilibrium beyond ({}) kPa: {kind}",
            at.join(", ")
        ));
    }
    if let Some(why) = why {
        lines.push(format!("no score: {why}"));
    }
    let with_direct = all.iter().any(|s| s.direct.is_some());
    let mut header = vec![
        "schedule",
        "probe",
        "area (mm\u{b2})",
        "error (mm\u{b2})",
        "crosses itself",
    ];
    if with_direct {
        header.extend(["direct (mm\u{b2})", "CPU s"]);
    }
    let mut rows = Vec::new();
    for scored in all {
        for (index, probe) in scene.probes.iter().enumerate() {
            let score = scored.scores.get(index);
            let mut row = vec![scored.schedule.name.clone(), probe.name.clone()];
            row.push(number(score.map(|s| s.area_mm2)));
            row.push(number(score.map(|s| s.error_mm2)));
            row.push(
                score
                    .map_or("-", |s| if s.self_crossing { "yes" } else { "no" })
                    .into(),
            );
            if let Some(direct) = &scored.direct {
                row.push(number(direct.areas.get(index).copied()));
                row.push(number(Some(direct.cpu_s)));
            }
            rows.push(row);
        }
    }
    lines.push(table(&header, &rows));
    let gap = map.gap_mm.map_or_else(String::new, |gap| {
        format!(
            "; states met again differ by at most {} mm",
            number(Some(gap))
        )
    });
    let mut last = format!(
        "map of {n} by {n} pressures, {} states{gap}: {} CPU s",
        map.states(),
        number(seconds["cpu"].as_f64()),
        n = map.pressures_kpa.len(),
    );
    if with_direct {
        let direct = all.iter().filter_map(|s| s.direct.as_ref());
        last += &format!(
            "; direct solves {} CPU s",
            number(Some(direct.map(|d| d.cpu_s).sum()))
        );
    }
    lines.push(last);
    lines.push(about(scene));
    lines.join("\n")
}

/// The numbers without which an area says nothing, but for the schedule.
fn about(scene: &Scene) -> String {
    let numbers = Numbers::of(scene);
    let units = numbers.units.map_or_else(
        || "a mesh file".to_owned(),
        |n| format!("{n} unit{}", if n == 1 { "" } else { "s" }),
    );
    let probes: Vec<String> = (scene.probes.iter())
        .map(|p| format!("{} at ({}, {}) mm", p.name, p.at_mm[0], p.at_mm[1]))
        .collect();
    format!(
        "p/mu = {} at the largest pressure, {} kPa; {units}; {}",
        number(Some(numbers.p_over_mu)),
        number(Some(numbers.pressure_kpa)),
        probes.join(", "),
    )
}

fn csv(scene: &Scene, map: &PressureMap) -> String {
    let mut csv = String::from("first_kpa,second_kpa");
    for probe in &scene.probes {
        csv += &format!(",{0}_u_x_mm,{0}_u_y_mm", probe.name);
    }
    let grid = map.pressures_kpa.len().pow(2);
    for state in map.answer.path.iter().take(grid) {
        let cells = state.pressure_kpa.iter().copied();
        let of_probes = scene.probes.iter().flat_map(|p| {
            let u = state.displacement_mm.get(&p.name);
            u.copied().unwrap_or([f64::NAN; 2])
        });
        let cells: Vec<String> = cells.chain(of_probes).map(|c| c.to_string()).collect();
        csv.push('\n');
        csv += &cells.join(",");
    }
    csv.push('\n');
    csv
}

/// The tip over the pressure plane.
fn picture(
    name: &str,
    scene: &Scene,
    map: &PressureMap,
    first: Option<&Scored>,
) -> Result<String, NotScored> {
    let (probe, _) = tip(scene).unwrap_or_default();
    let largest = map.largest_kpa();
    let at = |pressure_kpa: [f64; 2]| map.displacement(&probe, pressure_kpa);
    let along = |fixed: usize, pressure: f64| {
        let points = (0..=POINTS).map(|k| {
            let mut pair = [pressure; 2];
            pair[1 - fixed] = largest * (k as f64 / POINTS as f64).powi(2);
            at(pair)
        });
        Ok((pressure, points.collect::<Result<_, NotScored>>()?))
    };
    let family = |fixed: usize| {
        let pressures = (0..LINES).map(|k| largest * k as f64 / (LINES - 1) as f64);
        pressures
            .map(|p| along(fixed, p))
            .collect::<Result<Vec<_>, NotScored>>()
    };
    let path = match first {
        Some(scored) => {
            let cycle = ActuationCycle {
                rows_kpa: scored.schedule.rows_kpa.clone(),
                load_steps_per_leg: POINTS,
                spacing: Spacing::Graded,
            };
            let states = cycle.path().into_iter();
            let pressures = states.map(|s| [s.pressure_kpa[0], s.pressure_kpa[1]]);
            pressures.map(at).collect::<Result<_, _>>()?
        }
        None => Vec::new(),
    };
    let grid = map.pressures_kpa.len().pow(2);
    let states = map.answer.path.iter().take(grid);
    let mut caption = Vec::new();
    if let Some((scored, score)) = first.and_then(|s| {
        Some((
            s,
            s.scores
                .get(scene.probes.iter().position(|p| p.name == probe)?)?,
        ))
    }) {
        caption.push(format!(
            "schedule {}: encloses {} mm\u{b2}, error by interpolation {} mm\u{b2}; dots: the states that were solved",
            scored.schedule.name,
            number(Some(score.area_mm2)),
            number(Some(score.error_mm2)),
        ));
    }
    caption.push(about(scene));
    let picture = PressurePlanePicture {
        title: format!("{name}: {probe} over the pressure plane"),
        lines: [family(0)?, family(1)?],
        names: ["first pressure".into(), "second pressure".into()],
        states: states
            .filter_map(|s| s.displacement_mm.get(&probe).copied())
            .collect(),
        path,
        caption,
    };
    Ok(picture.svg())
}

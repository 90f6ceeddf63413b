//! `salp converge`: error against run time of a scene.

use std::path::PathBuf;

use clap::Args;
use salp_core::equilibrium::{Observer, Phase};
use salp_core::evaluate::{
    CannotConverge, Clock, Convergence, Family, Run, SceneStatus, Setting, converge,
};
use salp_core::picture::{ScatterPicture, ScatterSeries};
use salp_core::scene::{ElementChoice, read_scene};

use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::numbers::Numbers;
use crate::output::{Output, note, number, table, write_file};
use crate::stopwatch::cpu_seconds;

/// Arguments of `salp converge`.
#[derive(Args)]
pub struct Converge {
    #[command(flatten)]
    scene: DocumentArguments,
    /// The relative error, in tip and area, that the recommended setting must meet
    #[arg(long, default_value_t = 0.01)]
    error: f64,
    /// Folder of the results [default: salp-out/NAME-converge]
    #[arg(long)]
    out: Option<PathBuf>,
}

impl Converge {
    /// Solves all settings, writes table and picture, and prints them.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        if !(self.error > 0.0 && self.error <= 1.0) {
            let message = format!(
                "expected a number above 0 and at most 1, found {}",
                self.error
            );
            return Err(Failure::fault("error", message));
        }
        let scene = read_scene(&self.scene.read()?, self.scene.folder())?;
        let found = converge(&scene, self.error, &mut Progress).map_err(|cannot| match cannot {
            CannotConverge::Faults(faults) => Failure::BadInput(faults),
            CannotConverge::Reference { .. } => {
                note(&format!("salp: {cannot}"));
                Failure::Run("the reference of a convergence study did not converge")
            }
            cannot => {
                let text = cannot.to_string();
                let (path, message) = text.split_once(": ").unwrap_or(("", &text));
                Failure::fault(path, message)
            }
        })?;
        let file = &self.scene.file;
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        let out = self
            .out
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("salp-out/{name}-converge")));
        write_file(&out.join("converge.csv"), &csv(&found))?;
        let caption = Numbers::of(&scene).lines();
        write_file(&out.join("converge.svg"), &picture(&name, &found, caption))?;
        output.print(&found, || {
            format!("{}\nreport in {}", text(&found), out.display())
        });
        Ok(())
    }
}

/// Tells each run as it ends.
pub struct Progress;

impl Observer for Progress {
    fn enter(&mut self, _: Phase) {}
}

impl Clock for Progress {
    fn cpu_s(&self) -> f64 {
        cpu_seconds()
    }

    fn done(&mut self, run: &Run) {
        note(&format!(
            "{}: {} unknowns, {:.2} CPU s",
            label(&run.setting),
            run.dofs,
            run.cpu_s
        ));
    }
}

fn element(choice: ElementChoice) -> &'static str {
    match choice {
        ElementChoice::Quad4 => "quad4",
        ElementChoice::Auto | ElementChoice::Quad9 => "quad9",
    }
}

fn mesh(setting: &Setting) -> String {
    let size = setting.max_size_mm.map_or("size rule".to_owned(), |s| {
        format!("{} mm", number(Some(s)))
    });
    match setting.refined {
        1 => size,
        n => format!("{size} / {n}"),
    }
}

fn label(setting: &Setting) -> String {
    format!(
        "{} {}, tolerance {:e}, {} steps a leg",
        element(setting.element),
        mesh(setting),
        setting.tolerance,
        setting.load_steps_per_leg
    )
}

fn family(family: Family) -> &'static str {
    match family {
        Family::Mesh => "mesh",
        Family::Tolerance => "tolerance",
        Family::LoadSteps => "load steps",
        Family::Reference => "reference",
        Family::Combined => "combined",
    }
}

fn per_cent(error: Option<f64>) -> String {
    error.map_or("-".into(), |e| format!("{} %", number(Some(100.0 * e))))
}

fn text(found: &Convergence) -> String {
    let rows: Vec<Vec<String>> = found
        .runs
        .iter()
        .map(|run| {
            vec![
                family(run.setting.family).to_owned(),
                element(run.setting.element).to_owned(),
                mesh(&run.setting),
                format!("{:e}", run.setting.tolerance),
                run.setting.load_steps_per_leg.to_string(),
                run.dofs.to_string(),
                run.factorisations.to_string(),
                format!("{:.3}", run.cpu_s),
                per_cent(run.tip_error),
                per_cent(run.area_error),
                if run.status != SceneStatus::Ok {
                    "failed".into()
                } else if run.pareto {
                    "*".into()
                } else {
                    String::new()
                },
            ]
        })
        .collect();
    let header = [
        "varies",
        "element",
        "mesh",
        "tolerance",
        "steps",
        "unknowns",
        "factorisations",
        "CPU s",
        "tip error",
        "area error",
        "front",
    ];
    let reference = &found.reference;
    let mut text = table(&header, &rows);
    text += &format!(
        "\nreference: three nested quad9 meshes; tip known to {}, observed order {}",
        per_cent(Some(reference.tip_uncertainty)),
        number(reference.tip_order)
    );
    if let Some(area) = reference.area_mm2 {
        text += &format!(
            "; area {} mm\u{b2} known to {}, observed order {} (in the load step {})",
            number(Some(area)),
            per_cent(reference.area_uncertainty),
            number(reference.area_order),
            number(reference.step_order)
        );
    }
    text += &match &found.recommended {
        Some(run) => format!(
            "\nfor {}: {}: tip {}, area {}, {:.3} CPU s",
            per_cent(Some(found.wanted)),
            label(&run.setting),
            per_cent(run.tip_error),
            per_cent(run.area_error),
            run.cpu_s
        ),
        None => format!("\nno setting reaches {}", per_cent(Some(found.wanted))),
    };
    text
}

fn csv(found: &Convergence) -> String {
    let mut csv = String::from(
        "varies,element,max_size_mm,refined,tolerance,load_steps_per_leg,elements,unknowns,factorisations,cpu_s,tip_error,area_error,status,pareto\n",
    );
    let or_empty = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
    for run in &found.runs {
        let s = &run.setting;
        let status = serde_json::to_value(run.status).unwrap_or_default();
        csv += &format!(
            "{},{},{},{},{:e},{},{},{},{},{},{},{},{},{}\n",
            family(s.family),
            element(s.element),
            or_empty(s.max_size_mm),
            s.refined,
            s.tolerance,
            s.load_steps_per_leg,
            run.elements,
            run.dofs,
            run.factorisations,
            run.cpu_s,
            or_empty(run.tip_error),
            or_empty(run.area_error),
            status.as_str().unwrap_or_default(),
            run.pareto
        );
    }
    csv
}

fn picture(name: &str, found: &Convergence, mut caption: Vec<String>) -> String {
    // Below this an error is that of the solver's tolerance.
    let least = 1e-6 * found.wanted;
    let worse = |run: &Run| {
        let tip = run.tip_error?;
        let worse = run.area_error.map_or(tip, |area| area.max(tip));
        (worse > least).then_some(worse)
    };
    let series = |label: &str, keep: &dyn Fn(&Run) -> bool, tag: &dyn Fn(&Setting) -> String| {
        let mut points: Vec<([f64; 2], String)> = found
            .runs
            .iter()
            .filter(|run| keep(run))
            .filter_map(|run| Some(([run.cpu_s, worse(run)?], tag(&run.setting))))
            .collect();
        points.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        ScatterSeries {
            label: label.into(),
            points,
            joined: true,
        }
    };
    let of = |f: Family| move |run: &Run| run.setting.family == f;
    let meshes = |e: ElementChoice| {
        move |run: &Run| run.setting.family == Family::Mesh && run.setting.element == e
    };
    caption.push(
        "error: the larger of tip and area; of meshes against the extrapolated reference, of tolerances and load steps that of the same mesh"
            .into(),
    );
    let recommended = found.recommended.as_ref().map(|run| run.setting.clone());
    let paper = {
        let recommended = recommended.clone();
        move |run: &Run| {
            run.setting.family == Family::Combined && Some(&run.setting) != recommended.as_ref()
        }
    };
    let chosen = move |run: &Run| Some(&run.setting) == recommended.as_ref();
    ScatterPicture {
        title: format!("{name}: error against run time"),
        x_label: "CPU time of one thread (s)".into(),
        y_label: "relative error".into(),
        series: vec![
            series("quad9 meshes", &meshes(ElementChoice::Quad9), &mesh),
            series("quad4 meshes", &meshes(ElementChoice::Quad4), &mesh),
            series("tolerance", &of(Family::Tolerance), &|s| {
                format!("{:e}", s.tolerance)
            }),
            series("load steps a leg", &of(Family::LoadSteps), &|s| {
                s.load_steps_per_leg.to_string()
            }),
            series("paper's mesh and tolerance", &paper, &|_| String::new()),
            series("recommended", &chosen, &|_| String::new()),
        ],
        level: Some((
            found.wanted,
            format!("wanted: {}", per_cent(Some(found.wanted))),
        )),
        caption,
        ..ScatterPicture::default()
    }
    .svg()
}

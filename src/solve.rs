//! `salp solve`: one finite-element analysis of a scene.

use std::path::PathBuf;

use clap::Args;
use salp_core::document::Sweep;
use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::{
    SceneAnswer, SceneOptions, SceneSolution, SceneStatus, numerical_error, solve_scene,
};
use salp_core::geometry::MeshPlan;
use salp_core::mesh::gmsh;
use salp_core::mesh::vtu::{VtuData, vtu};
use salp_core::scene::measure::Measure;
use salp_core::scene::{Body, Goal, Scene, read_scene};
use serde_json::{Value, json};

use crate::companions;
use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::numbers::{Numbers, lines_of};
use crate::output::{Output, note, number, table, write_file};
use crate::parallel::cores;
use crate::sensitivities;
use crate::shape::picture;
use crate::stopwatch::{Stopwatch, cpu_seconds};
use crate::sweep::{
    Drawn, Swept, SweptPoint, at_all_values, file_part, last_name, pressure_kpa, read_each,
};

/// Arguments of `salp solve`.
#[derive(Args)]
pub struct Solve {
    #[command(flatten)]
    scene: DocumentArguments,
    /// Writes the mesh with the displacements of all states for ParaView
    #[arg(long)]
    vtu: Option<PathBuf>,
    /// Draws the undeformed and the deformed shape with the tip path
    #[arg(long)]
    svg: Option<PathBuf>,
    /// Writes the mesh for Gmsh (MSH 4.1) with the groups `left`, `channel-0`, `channel-1`, ... and `solid`: a `mesh_file`
    #[arg(long)]
    msh: Option<PathBuf>,
    /// Solves at several values of a field: p_over_mu=0.02..0.07:6, mesh.max_size_mm=8,4,2
    #[arg(long, value_name = "PATH=VALUES", conflicts_with_all = ["vtu", "svg", "msh"])]
    sweep: Option<String>,
    /// Solves on the scene's mesh with each element split N by N
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "sweep",
        value_parser = clap::value_parser!(u8).range(1..=16))]
    refine: u8,
    /// Says how far the objective is from that of the model: six more solves, of which the finest has 16 times the elements
    #[arg(long, conflicts_with = "sweep")]
    numerical_error: bool,
    /// Encloses the area as well with a stiffening law of equal initial modulus (model spread), and as nine units
    #[arg(long)]
    model_spread: bool,
    /// Says what the objective is worth by pressure, modulus, walls and corners, and how far each may be off: the adjoint, and one more solve
    #[arg(long, conflicts_with = "sweep")]
    sensitivities: bool,
    /// Threads of --numerical-error and --model-spread [default: one per core]
    #[arg(long, requires = "numerical_error", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder of a sweep's table and picture [default: salp-out/NAME-sweep-FIELD]
    #[arg(long, requires = "sweep")]
    out: Option<PathBuf>,
}

impl Solve {
    /// Solves and prints the answer.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        if let Some(sweep) = &self.sweep {
            return self.sweep(&Sweep::read(sweep)?, output);
        }
        let scene = read_scene(&self.scene.read()?, self.scene.folder())?;
        if self.msh.is_some() && matches!(scene.body, Body::MeshFile(_)) {
            let message = "the scene names a mesh file already";
            return Err(Failure::fault("msh", message));
        }
        if self.numerical_error {
            numerical_error::check(&scene)?;
        }
        if self.sensitivities && scene.objective.is_none() {
            return Err(Failure::fault("objective", "sensitivities need one"));
        }
        let plan = self.plan(&scene)?;
        let options = SceneOptions {
            gradient: self.sensitivities,
            fields: self.vtu.is_some() || self.svg.is_some(),
            plan: plan.clone(),
            ..SceneOptions::default()
        };
        let mut stopwatch = Stopwatch::start();
        let solution = solve_scene(&scene, &options, &mut stopwatch)?;
        let mut document = with_seconds(&solution.answer, stopwatch.document());
        let slopes = if self.sensitivities {
            let found = sensitivities::of(&scene, &solution, true);
            document["sensitivities"] = json!(found);
            found
        } else {
            None
        };
        let error = if self.numerical_error {
            let threads = self.threads.map_or_else(cores, usize::from);
            let answer = &solution.answer;
            Some(crate::numerical_error::numerical_error(
                &scene,
                plan.as_ref(),
                answer,
                threads,
            )?)
        } else {
            None
        };
        if let Some(error) = &error {
            document["numerical_error"] = json!(error);
        }
        let beside = if self.model_spread {
            let threads = self.threads.map_or_else(cores, usize::from);
            let beside = companions::solve(&scene, plan.as_ref(), threads)?;
            document["companions"] = json!(beside);
            beside
        } else {
            Vec::new()
        };
        if let Some(file) = &self.vtu {
            write_vtu(&solution, file)?;
        }
        if let (Some(file), Some(body)) = (&self.msh, &solution.body) {
            // Writing to a string does not fail.
            let content = gmsh::write(&gmsh::export(body)).unwrap_or_default();
            write_file(file, &content)?;
        }
        if let (Some(file), Some(body)) = (&self.svg, &solution.body) {
            let name = self
                .scene
                .file
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy();
            let numbers = Numbers::of(&scene);
            write_file(
                file,
                &picture(&name, &scene, &solution, body, &numbers.lines()),
            )?;
        }
        output.print(&document, || {
            let mut lines = vec![text(&scene, &solution.answer)];
            let unit = scene.objective.as_ref().map_or("", Goal::unit);
            lines.extend(slopes.iter().flat_map(|s| sensitivities::lines(s, unit)));
            lines.extend(error.iter().flat_map(crate::numerical_error::lines));
            lines.extend(companions::lines(&solution.answer, &beside));
            lines.join("\n")
        });
        ended_well(&solution.answer)?;
        match error {
            Some(error) if error.finest.error.is_none() => {
                Err(Failure::Run("a solve for the numerical error did not end"))
            }
            _ => Ok(()),
        }
    }

    /// The mesh plan of `--refine`. A shape that cannot be meshed has none: its answer says so.
    fn plan(&self, scene: &Scene) -> Result<Option<MeshPlan>, Failure> {
        if self.refine == 1 {
            return Ok(None);
        }
        if matches!(scene.body, Body::MeshFile(_)) {
            let message = "the scene names a mesh file: its elements cannot be split";
            return Err(Failure::fault("refine", message));
        }
        let plan = numerical_error::own_plan(scene).ok();
        Ok(plan.map(|plan| plan.refined(self.refine.into())))
    }

    /// Solves at each value. A limit that is met is an answer like others; a failure of ours is none.
    fn sweep(&self, sweep: &Sweep, output: Output) -> Result<(), Failure> {
        let folder = self.scene.folder();
        let scenes = read_each(&self.scene.read()?, sweep, |document, p_over_mu| {
            let mut scene = read_scene(document, folder)?;
            if let Some(ratio) = p_over_mu {
                let mu = Numbers::of(&scene).mu_mpa[0];
                scene.actuation = scene.actuation.scaled_to(pressure_kpa(ratio, mu));
            }
            Ok(scene)
        })?;
        let name = self.scene.file.file_stem().unwrap_or_default();
        let name = name.to_string_lossy().into_owned();
        let out = self.out.clone().unwrap_or_else(|| {
            let field = file_part(last_name(&sweep.path));
            PathBuf::from(format!("salp-out/{name}-sweep-{field}"))
        });
        let mut points = Vec::new();
        for (scene, value) in scenes.iter().zip(&sweep.values) {
            let before = cpu_seconds();
            let options = SceneOptions::default();
            let answer = solve_scene(scene, &options, &mut Unobserved)?.answer;
            let point = swept_point(scene, value, &answer, cpu_seconds() - before);
            note(&format!("{}: {}", sweep.assignment(value), point.status));
            points.push(point);
        }
        let swept = Swept {
            sweep,
            name,
            points,
            drawn: drawn(&scenes[0]),
            caption: about(sweep, &scenes),
        };
        swept.write(&out)?;
        let alarms = swept.points.iter().any(|p| p.status == "not_converged");
        let status = if alarms { "not_converged" } else { "ok" };
        output.print(&swept.document(status), || {
            let mut lines = vec![swept.table()];
            let numbers: Vec<Numbers> = swept
                .points
                .iter()
                .filter_map(|p| p.numbers.clone())
                .collect();
            lines.extend(lines_of(&numbers));
            lines.push(format!("table and picture in {}", out.display()));
            lines.join("\n")
        });
        if alarms {
            return Err(Failure::Run("not converged: a fault of ours"));
        }
        Ok(())
    }
}

fn swept_point(scene: &Scene, value: &Value, answer: &SceneAnswer, cpu_s: f64) -> SweptPoint {
    let stretch = answer.path.iter().map(|s| s.max_stretch);
    SweptPoint {
        value: value.clone(),
        status: json!(answer.status).as_str().unwrap_or_default().to_owned(),
        objective: answer.objective,
        area: answer.enclosed_area_mm2,
        max_stretch: (!answer.path.is_empty()).then(|| stretch.fold(1.0, f64::max)),
        numbers: Some(Numbers::of(scene)),
        cpu_s,
        more: Vec::new(),
        folder: None,
    }
}

fn about(sweep: &Sweep, scenes: &[Scene]) -> Vec<String> {
    let words = |scene: &Scene| scene.objective.as_ref().map_or("none".into(), Goal::words);
    let targets = scenes.iter().map(|s| format!("objective: {}", words(s)));
    let targets: Vec<String> = targets.collect();
    let mut lines = if scenes.iter().any(|s| s.objective.is_some()) {
        at_all_values(sweep, &targets)
    } else {
        Vec::new()
    };
    lines.push("no limits: walls may overlap, stretches are what they are".into());
    lines
}

/// What a sweep of a scene is about: its area, else its objective, else its stretch.
fn drawn(scene: &Scene) -> Drawn {
    match &scene.objective {
        Some(goal) if matches!(goal.measure, Measure::EnclosedArea { .. }) => Drawn {
            label: "|enclosed area| (mm\u{b2})".into(),
            of: |p| p.area.map(f64::abs),
        },
        Some(goal) => Drawn {
            label: format!("objective ({})", goal.unit()),
            of: |p| p.objective,
        },
        None => Drawn {
            label: "largest averaged stretch".into(),
            of: |p| p.max_stretch.filter(|_| p.status == "ok"),
        },
    }
}

/// The answer with its `seconds`.
pub fn with_seconds(answer: &SceneAnswer, seconds: Value) -> Value {
    let mut document = json!(answer);
    document["seconds"] = seconds;
    document
}

/// Whether the status is ok; the document is printed by then.
pub fn ended_well(answer: &SceneAnswer) -> Result<(), Failure> {
    match answer.status {
        SceneStatus::Ok => Ok(()),
        SceneStatus::NoEquilibrium => {
            Err(Failure::Run("no equilibrium exists beyond the last state"))
        }
        SceneStatus::InfeasibleGeometry => Err(Failure::Run("the shape cannot be meshed")),
        SceneStatus::NotConverged => Err(Failure::Run("not converged: a fault of ours")),
    }
}

fn write_vtu(solution: &SceneSolution, file: &std::path::Path) -> Result<(), Failure> {
    let Some(body) = &solution.body else {
        return Ok(());
    };
    let fields: Vec<VtuData> = solution
        .fields
        .iter()
        .zip(&solution.answer.path)
        .enumerate()
        .map(|(i, (field, state))| {
            let pressures: Vec<String> = state
                .pressure_kpa
                .iter()
                .map(|p| number(Some(*p)))
                .collect();
            VtuData {
                name: format!("displacement_mm_{i:03} at {} kPa", pressures.join(" ")),
                components: 2,
                values: field.iter().flatten().copied().collect(),
            }
        })
        .collect();
    // The fields are as long as the mesh by construction.
    let content = vtu(&body.mesh, &fields, &[]).unwrap_or_default();
    write_file(file, &content)
}

/// The answer for people: the ends of the legs, then what it means.
pub fn text(scene: &Scene, answer: &SceneAnswer) -> String {
    let status = json!(answer.status);
    let mut text = format!("status {}", status.as_str().unwrap_or_default());
    if let Some(reason) = &answer.reason {
        text += &format!(": {reason}");
    }
    text.push('\n');
    let names: Vec<&String> = answer
        .path
        .first()
        .into_iter()
        .flat_map(|s| s.displacement_mm.keys())
        .collect();
    let mut header = vec!["leg".to_owned(), "kPa".to_owned()];
    for name in &names {
        header.extend([format!("u_x {name} (mm)"), format!("u_y {name} (mm)")]);
    }
    header.push("stretch".into());
    let last = answer.path.len().saturating_sub(1);
    let rows: Vec<Vec<String>> = answer
        .path
        .iter()
        .enumerate()
        .filter(|(i, state)| state.fraction == 1.0 || *i == last)
        .map(|(_, state)| {
            let pressures: Vec<String> = state
                .pressure_kpa
                .iter()
                .map(|p| number(Some(*p)))
                .collect();
            let mut row = vec![state.leg.to_string(), pressures.join(", ")];
            for name in &names {
                let u = state.displacement_mm.get(*name).copied();
                row.extend([number(u.map(|u| u[0])), number(u.map(|u| u[1]))]);
            }
            row.push(number(Some(state.max_stretch)));
            row
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    if !rows.is_empty() {
        text += &table(&header, &rows);
        text.push('\n');
    }
    if let Some(objective) = answer.objective {
        text += &format!("objective {}", number(Some(objective)));
        if let Some(area) = answer.enclosed_area_mm2 {
            text += &format!(", enclosed area {} mm\u{b2}", number(Some(area)));
        }
        text.push('\n');
    }
    if let Some(limit) = &answer.limit {
        text += &format!("limit {}\n", json!(limit));
    }
    if let Some(contact) = &answer.contact {
        let gap = contact.least_distance_mm.map_or_else(
            || "only at folding corners".to_owned(),
            |d| format!("least gap {} mm", number(Some(d))),
        );
        text += &format!(
            "contact from {} of leg {}: {gap}, penetration {} mm, activation distance {} mm, at most {} kPa\n",
            number(Some(contact.from.fraction)),
            contact.from.leg,
            number(Some(contact.penetration_mm)),
            number(Some(contact.activation_mm)),
            number(Some(contact.max_pressure_kpa)),
        );
    }
    if let Some(overlap) = &answer.walls_overlap {
        text += &format!("walls overlap {}\n", json!(overlap));
    }
    for line in Numbers::of(scene).lines() {
        text += &line;
        text.push('\n');
    }
    text += &format!(
        "mesh: {} {} elements, {} unknowns; {} Newton iterations",
        answer.mesh.elements,
        answer.mesh.element,
        answer.mesh.dofs,
        json!(answer.work)["newton_iterations"]
    );
    for left_out in &answer.left_out {
        text += &format!("\nleft out: {} ({})", left_out.what, left_out.why);
    }
    for note in &answer.notes {
        text += &format!("\nnote: {}: {}", note.about, note.message);
    }
    text
}

//! `salp solve`: one finite-element analysis of a scene.

use std::path::PathBuf;

use clap::Args;
use salp_core::evaluate::{SceneAnswer, SceneOptions, SceneSolution, SceneStatus, solve_scene};
use salp_core::mesh::gmsh;
use salp_core::mesh::vtu::{VtuData, vtu};
use salp_core::scene::{Body, Scene, read_scene};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::output::{Output, number, table, write_file};
use crate::shape::{Numbers, picture};
use crate::stopwatch::Stopwatch;

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
}

impl Solve {
    /// Solves and prints the answer.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let scene = read_scene(&self.scene.read()?, self.scene.folder())?;
        if self.msh.is_some() && matches!(scene.body, Body::MeshFile(_)) {
            let message = "the scene names a mesh file already";
            return Err(Failure::fault("msh", message));
        }
        let options = SceneOptions {
            fields: self.vtu.is_some() || self.svg.is_some(),
            ..SceneOptions::default()
        };
        let mut stopwatch = Stopwatch::start();
        let solution = solve_scene(&scene, &options, &mut stopwatch)?;
        let document = with_seconds(&solution.answer, stopwatch.document());
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
        output.print(&document, || text(&scene, &solution.answer));
        ended_well(&solution.answer)
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

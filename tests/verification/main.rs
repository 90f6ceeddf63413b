//! Published problems, solved from Gmsh files as a user would: written, read, solved by a scene; and verbs that compare solutions.

mod command;
mod cooks_membrane;
mod numerical_error;
mod reduced_model;
mod thick_cylinder;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::{SceneAnswer, SceneOptions, SceneStatus, solve_scene};
use salp_core::mesh::gmsh::write;
use salp_core::scene::read_scene;
use salp_core::verify::{MESH_FILE, Problem};

/// A folder that is removed at the end of its test.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Solves a problem from its files.
fn solve(problem: &Problem) -> SceneAnswer {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let name = format!("salp-verification-{}-{count}", std::process::id());
    let folder = Folder(std::env::temp_dir().join(name));
    std::fs::create_dir_all(&folder.0).unwrap();
    std::fs::write(folder.0.join(MESH_FILE), write(&problem.mesh).unwrap()).unwrap();
    let scene = read_scene(&problem.scene, &folder.0).unwrap();
    let solution = solve_scene(&scene, &SceneOptions::default(), &mut Unobserved).unwrap();
    assert_eq!(
        solution.answer.status,
        SceneStatus::Ok,
        "{:?}",
        solution.answer.reason
    );
    solution.answer
}

/// Displacement of a probe at the last state, mm.
fn displacement(answer: &SceneAnswer, probe: &str) -> [f64; 2] {
    answer.path.last().unwrap().displacement_mm[probe]
}

/// Orders of convergence between meshes that halve the size.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

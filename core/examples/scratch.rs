use salp_core::equilibrium::{Observer, Phase};
use salp_core::evaluate::*;
use std::time::Instant;
struct Clock {
    phase: Option<Phase>,
    since: Instant,
    t: [f64; 5],
}
impl Observer for Clock {
    fn enter(&mut self, p: Phase) {
        let now = Instant::now();
        if let Some(q) = self.phase {
            self.t[q as usize] += (now - self.since).as_secs_f64();
        }
        self.phase = Some(p);
        self.since = now;
    }
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&args[1]).unwrap();
    let mut doc: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut check = false;
    let mut grad = false;
    let mut verbose = false;
    for a in &args[2..] {
        if a == "--check" {
            check = true
        } else if a == "--grad" {
            grad = true
        } else if a == "-v" {
            verbose = true
        } else {
            salp_core::document::set(&mut doc, a).unwrap();
        }
    }
    let scene =
        salp_core::scene::read_scene(&doc, std::path::Path::new(&args[1]).parent().unwrap())
            .unwrap_or_else(|f| {
                eprintln!("{f}");
                std::process::exit(2)
            });
    let mut clock = Clock {
        phase: None,
        since: Instant::now(),
        t: [0.; 5],
    };
    let start = Instant::now();
    if check {
        let (_, lines) = check_gradient(&scene, &mut clock).unwrap();
        for l in &lines {
            println!(
                "{} {:+.6e} best {:.1e}  {:?}",
                l.index,
                l.adjoint,
                l.best_error,
                l.differences
                    .iter()
                    .map(|d| format!("{:.1e}", d.error))
                    .collect::<Vec<_>>()
            );
        }
        return;
    }
    let s = solve_scene(
        &scene,
        &SceneOptions {
            gradient: grad,
            ..Default::default()
        },
        &mut clock,
    )
    .unwrap();
    let total = start.elapsed().as_secs_f64();
    let a = &s.answer;
    println!(
        "{:?} {:?} reached {} limit {:?} loss {:?} overlap {:?}",
        a.status, a.reason, a.load_fraction_reached, a.limit, a.loss_of_uniqueness, a.walls_overlap
    );
    println!(
        "area {:?} sampling {:?} mesh {:?}",
        a.enclosed_area_mm2, a.area_sampling_error_mm2, a.mesh
    );
    println!("work {:?}", a.work);
    println!(
        "total {total:.3} setup {:.3} assembly {:.3} factor {:.3} adjoint {:.3} measures {:.3}",
        clock.t[0], clock.t[1], clock.t[2], clock.t[3], clock.t[4]
    );
    for p in &a.path {
        if verbose || p.fraction == 1.0 {
            println!(
                "{} {:.3} {:?} {:?} str {:.3} raw {:.3} gap {:?} np {} res {:.1e} J {:.3} cav {:?}",
                p.leg,
                p.fraction,
                p.pressure_kpa,
                p.displacement_mm,
                p.max_stretch,
                p.max_stretch_raw,
                p.min_gap_mm,
                p.negative_pivots,
                p.residual,
                p.min_jacobian,
                p.cavity_area_mm2
            )
        }
    }
    if grad {
        println!("{:?}", s.gradient().map(|g| g.flat()));
    }
}

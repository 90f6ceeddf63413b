//! Sensitivities of a design for people.

use salp_core::evaluate::sensitivities::{PerCondition, TOLERATED, Wall};
use salp_core::evaluate::{SceneSensitivities, SceneSolution, check_tolerance};
use salp_core::scene::Scene;

use crate::output::{number, table};
use crate::stopwatch::Stopwatch;

/// Sensitivities of a solved scene; with `check` the most sensitive corner is moved by its tolerance and solved.
pub fn of(scene: &Scene, solution: &SceneSolution, check: bool) -> Option<SceneSensitivities> {
    let mut found = solution.sensitivities(scene)?;
    if check {
        // A move that leaves a probe without solid has no answer, which is no fault of the scene.
        let checked = check_tolerance(scene, solution, &found, &mut Stopwatch::start());
        found.check = checked.ok().flatten();
    }
    Some(found)
}

/// A table of all, and what the check found; `unit` is that of the objective.
pub fn lines(found: &SceneSensitivities, unit: &str) -> Vec<String> {
    let percent = number(Some(100.0 * TOLERATED));
    let mut rows = Vec::new();
    let row = |name: String, slope: String, tolerance: Option<f64>, of: &str| {
        let tolerance =
            tolerance.map_or_else(|| "-".into(), |t| format!("\u{b1}{} {of}", number(Some(t))));
        vec![name, slope, tolerance]
    };
    let condition = |name: &str, of: &str, c: &PerCondition| {
        let value = number(Some(c.value));
        row(
            format!("{name} ({value} {of})"),
            format!("{} per {of}", number(Some(c.per_unit))),
            c.tolerance_percent,
            "%",
        )
    };
    rows.extend(
        found
            .pressure
            .as_ref()
            .map(|p| condition("pressure", "kPa", p)),
    );
    rows.extend(
        found
            .modulus
            .as_ref()
            .map(|m| condition("modulus mu", "MPa", m)),
    );
    for wall in &found.walls {
        let slope = format!("{} per mm", number(Some(wall.per_mm)));
        rows.push(row(
            words(wall.wall).to_owned(),
            slope,
            wall.tolerance_mm,
            "mm",
        ));
    }
    let several = found.corners.iter().any(|c| c.unit > 0);
    for c in &found.corners {
        let unit = if several {
            format!("unit {}, ", c.unit + 1)
        } else {
            String::new()
        };
        let [x, y] = c.per_mm.map(|g| number(Some(g)));
        rows.push(row(
            format!("{unit}chamber {}, corner {}", c.chamber + 1, c.corner + 1),
            format!("{x}, {y} per mm in x, y"),
            c.tolerance_mm,
            "mm",
        ));
    }
    let header = ["sensitivities", "objective", &format!("for {percent} %")];
    let of = if unit.is_empty() {
        String::new()
    } else {
        format!(" ({unit})")
    };
    let mut lines = vec![format!(
        "sensitivities: change of the objective{of}; beside them by how much each may be off for {percent} % of it, linear, nothing else changed\n{}",
        table(&header, &rows)
    )];
    if let Some(check) = &found.check {
        let found = check.found.map_or_else(
            || "no equilibrium".to_owned(),
            |share| format!("{} %", number(Some(100.0 * share))),
        );
        lines.push(format!(
            "checked by a solve: chamber {}, corner {} moved by its tolerance, ({}, {}) mm: {found}, by the derivative {percent} %",
            check.chamber + 1,
            check.corner + 1,
            number(Some(check.move_mm[0])),
            number(Some(check.move_mm[1]))
        ));
    }
    lines
}

fn words(wall: Wall) -> &'static str {
    match wall {
        Wall::Bottom => "outer wall, bottom",
        Wall::Top => "outer wall, top",
        Wall::BetweenStacked => "wall between upper and lower",
        Wall::Left => "wall to the left",
        Wall::Right => "wall to the right",
        Wall::BetweenBeside => "wall between left and right",
    }
}

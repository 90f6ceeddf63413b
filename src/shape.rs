//! The picture of a solved scene, and the numbers without which an area says nothing.

use salp_core::actuation::ActuationCycle;
use salp_core::evaluate::SceneSolution;
use salp_core::mesh::Discretisation;
use salp_core::picture::ShapePicture;
use salp_core::scene::{Body, Scene};

use crate::output::number;

/// p/mu, schedule, units and tip: a factor 1.7 in the modulus is a factor 8 to 26 in the area.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// Largest pressure over the initial shear modulus of the first law.
    pub p_over_mu: f64,
    /// Largest pressure, kPa.
    pub pressure_kpa: f64,
    /// Initial shear modulus, MPa.
    pub mu_mpa: f64,
    /// Rows of the schedule.
    pub schedule: String,
    /// Units in the chain; `None` for a mesh file.
    pub units: Option<usize>,
    /// The objective's probe.
    pub tip: Option<(String, [f64; 2])>,
}

impl Numbers {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        let (law, units) = match &scene.body {
            Body::Actuator(body) => (
                body.materials.first().copied(),
                Some(body.actuator.units.len()),
            ),
            Body::MeshFile(body) => (Some(body.material), None),
        };
        let mu_mpa = law.map_or(f64::NAN, |law| law.shear_modulus_mpa());
        let pressure_kpa = scene
            .actuation
            .rows_kpa
            .iter()
            .flatten()
            .fold(0.0, |largest: f64, p| largest.max(p.abs()));
        Self {
            p_over_mu: pressure_kpa * 1e-3 / mu_mpa,
            pressure_kpa,
            mu_mpa,
            schedule: schedule(&scene.actuation),
            units,
            tip: tip(scene),
        }
    }

    /// As lines for a caption.
    pub fn lines(&self) -> Vec<String> {
        let units = self
            .units
            .map_or_else(|| "a mesh file".into(), |n| format!("{n} units"));
        let tip = self
            .tip
            .as_ref()
            .map_or_else(String::new, |(name, [x, y])| {
                format!("; {name} at ({x}, {y}) mm")
            });
        vec![format!(
            "p/mu = {} (p = {} kPa, mu = {} MPa); schedule {}; {units}{tip}",
            number(Some(self.p_over_mu)),
            number(Some(self.pressure_kpa)),
            number(Some(self.mu_mpa)),
            self.schedule
        )]
    }
}

/// A schedule's rows, with its name where it has one.
fn schedule(cycle: &ActuationCycle) -> String {
    let largest = cycle
        .rows_kpa
        .iter()
        .flatten()
        .fold(0.0, |m: f64, p| m.max(*p));
    let name = ["hold", "swap", "overlap", "ramp"]
        .into_iter()
        .find(|name| ActuationCycle::named_rows(name, largest).as_ref() == Some(&cycle.rows_kpa));
    let rows: Vec<String> = cycle
        .rows_kpa
        .iter()
        .map(|row| {
            let row: Vec<String> = row.iter().map(|p| number(Some(*p))).collect();
            format!("({})", row.join(", "))
        })
        .collect();
    let rows = rows.join(" \u{2192} ");
    name.map_or_else(
        || format!("{rows} kPa"),
        |name| format!("{name} {rows} kPa"),
    )
}

/// The objective's probe, else one named `tip`, else the first.
fn tip(scene: &Scene) -> Option<(String, [f64; 2])> {
    let wanted = scene.objective.as_ref().and_then(|o| o.measure.tip());
    let wanted = wanted.map_or("tip", String::as_str);
    let probe = scene
        .probes
        .iter()
        .find(|p| p.name == wanted)
        .or(scene.probes.first())?;
    Some((probe.name.clone(), probe.at_mm))
}

/// The state that is deformed most, drawn with the path of the tip. `caption` follows a line about the state.
pub fn picture(
    title: &str,
    scene: &Scene,
    solution: &SceneSolution,
    body: &Discretisation,
    caption: &[String],
) -> String {
    let size = |field: &Vec<[f64; 2]>| field.iter().flatten().fold(0.0, |m: f64, u| m.max(u.abs()));
    let most = (0..solution.fields.len())
        .max_by(|a, b| size(&solution.fields[*a]).total_cmp(&size(&solution.fields[*b])));
    let path = &solution.answer.path;
    let tip_path_mm: Vec<[f64; 2]> = tip(scene).map_or_else(Vec::new, |(name, at)| {
        path.iter()
            .filter_map(|state| state.displacement_mm.get(&name))
            .map(|u| [at[0] + u[0], at[1] + u[1]])
            .collect()
    });
    let mut lines = Vec::new();
    if let Some(state) = most.and_then(|i| path.get(i)) {
        let pressures: Vec<String> = state
            .pressure_kpa
            .iter()
            .map(|p| number(Some(*p)))
            .collect();
        let area = solution
            .answer
            .enclosed_area_mm2
            .map_or_else(String::new, |area| {
                let sense = if area >= 0.0 {
                    "counter-clockwise"
                } else {
                    "clockwise"
                };
                format!(
                    "; the tip encloses {} mm\u{b2} ({sense})",
                    number(Some(area.abs()))
                )
            });
        lines.push(format!(
            "grey: undeformed; black: mesh at ({}) kPa; red: path of the tip{area}",
            pressures.join(", ")
        ));
    }
    lines.extend_from_slice(caption);
    ShapePicture {
        title,
        mesh: &body.mesh,
        boundary: &body.boundary,
        displacement_mm: most.map(|i| solution.fields[i].as_slice()),
        tip_path_mm: &tip_path_mm,
        caption: &lines,
    }
    .svg()
}

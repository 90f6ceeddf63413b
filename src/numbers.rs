//! The numbers without which an area says nothing: p/mu, schedule, units and tip. A factor 1.7 in the modulus is a factor
//! 8 to 26 in the area.

use salp_core::actuation::ActuationCycle;
use salp_core::material::MaterialLaw;
use salp_core::scene::{Body, Scene};
use salp_core::study::Study;
use serde_json::{Value, json};

use crate::output::number;

/// Of a scene.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// Largest pressure over the initial shear modulus of the first unit's law.
    pub p_over_mu: f64,
    /// Largest pressure, kPa.
    pub pressure_kpa: f64,
    /// Initial shear modulus of each unit's law, MPa; one entry where all have the same.
    pub mu_mpa: Vec<f64>,
    actuation: ActuationCycle,
    /// Units in the chain; `None` for a mesh file.
    pub units: Option<usize>,
    /// Name and place of the objective's probe.
    pub tip: Option<(String, [f64; 2])>,
}

impl Numbers {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        let (mut mu_mpa, units): (Vec<f64>, _) = match &scene.body {
            Body::Actuator(body) => {
                let laws = body.materials.iter();
                (
                    laws.map(MaterialLaw::shear_modulus_mpa).collect(),
                    Some(body.actuator.units.len()),
                )
            }
            Body::MeshFile(body) => (vec![body.material.shear_modulus_mpa()], None),
        };
        if mu_mpa.windows(2).all(|mu| mu[0] == mu[1]) {
            mu_mpa.truncate(1);
        }
        let pressure_kpa = scene.actuation.largest_kpa();
        Self {
            p_over_mu: mu_mpa
                .first()
                .map_or(f64::NAN, |mu| pressure_kpa * 1e-3 / mu),
            pressure_kpa,
            mu_mpa,
            actuation: scene.actuation.clone(),
            units,
            tip: tip(scene),
        }
    }

    /// Of a scene of a study, whose schedule is told in the channels of the document rather than in chambers.
    pub fn of_study(study: &Study, scene: &Scene) -> Self {
        let numbers = Self::of(scene);
        match &study.body {
            Some(body) => Self {
                actuation: body.actuation.clone(),
                ..numbers
            },
            None => numbers,
        }
    }

    /// As lines for a caption.
    pub fn lines(&self) -> Vec<String> {
        lines_of(std::slice::from_ref(self))
    }

    /// As a document.
    pub fn document(&self) -> Value {
        let mut document = json!({
            "p_over_mu": self.p_over_mu,
            "pressure_kpa": self.pressure_kpa,
            "mu_mpa": self.mu_mpa.first(),
            "schedule_kpa": self.actuation.rows_kpa,
            "units": self.units,
            "tip_mm": self.tip.as_ref().map(|(_, at)| at),
        });
        if self.mu_mpa.len() > 1 {
            document["unit_mu_mpa"] = json!(self.mu_mpa);
        }
        document
    }

    fn p_over_each_mu(&self) -> impl Iterator<Item = f64> + '_ {
        self.mu_mpa.iter().map(|mu| self.pressure_kpa * 1e-3 / mu)
    }
}

/// Lines for a caption of several scenes, with the ranges of what differs between them.
pub fn lines_of(all: &[Numbers]) -> Vec<String> {
    let Some(first) = all.first() else {
        return Vec::new();
    };
    let each_unit = if all.iter().any(|n| n.mu_mpa.len() > 1) {
        let ratios = span(all.iter().flat_map(Numbers::p_over_each_mu));
        format!(" in unit 1, {ratios} over the units")
    } else {
        String::new()
    };
    let units = match (first.units, all.iter().all(|n| n.units == first.units)) {
        (None, true) => "a mesh file".into(),
        (Some(1), true) => "1 unit".into(),
        _ => format!(
            "{} units",
            span(all.iter().filter_map(|n| n.units).map(|n| n as f64))
        ),
    };
    let tip = match &first.tip {
        Some((name, [x, y])) if all.iter().all(|n| n.tip == first.tip) => {
            format!("; {name} at ({x}, {y}) mm")
        }
        Some(_) => "; the tip differs".into(),
        None => String::new(),
    };
    vec![format!(
        "p/mu = {}{each_unit} (p = {} kPa, mu = {} MPa); schedule {}; {units}{tip}",
        span(all.iter().map(|n| n.p_over_mu)),
        span(all.iter().map(|n| n.pressure_kpa)),
        span(all.iter().flat_map(|n| n.mu_mpa.iter().copied())),
        schedules(all)
    )]
}

/// A number, or the least and the largest.
fn span(values: impl Iterator<Item = f64>) -> String {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    match (number(Some(low)), number(Some(high))) {
        (low, high) if low == high => low,
        (low, high) => format!("{low} to {high}"),
    }
}

/// The schedule of all; in shares of the largest pressure where only that differs.
fn schedules(all: &[Numbers]) -> String {
    let first = &all[0].actuation;
    if all.iter().all(|n| n.actuation == *first) {
        return format!("{} kPa", schedule(first));
    }
    let in_shares = |n: &Numbers| ActuationCycle {
        rows_kpa: n.actuation.scaled_to(1.0).rows_kpa,
        ..n.actuation.clone()
    };
    let shape = in_shares(&all[0]);
    let alike = |n: &Numbers| {
        let shares = in_shares(n);
        let [a, b] = [&shape, &shares].map(|c| c.rows_kpa.iter().flatten());
        (
            shape.rows_kpa.len(),
            shape.spacing,
            shape.load_steps_per_leg,
        ) == (
            shares.rows_kpa.len(),
            shares.spacing,
            shares.load_steps_per_leg,
        ) && a.clone().count() == b.clone().count()
            && a.zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    };
    if all.iter().all(alike) {
        format!("{} times p", schedule(&shape))
    } else {
        "differs".into()
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
    name.map_or_else(|| rows.clone(), |name| format!("{name} {rows}"))
}

/// The objective's probe, else one named `tip`, else the first.
pub fn tip(scene: &Scene) -> Option<(String, [f64; 2])> {
    let wanted = scene.objective.as_ref().and_then(|o| o.measure.tip());
    let wanted = wanted.map_or("tip", String::as_str);
    let probe = scene
        .probes
        .iter()
        .find(|p| p.name == wanted)
        .or(scene.probes.first())?;
    Some((probe.name.clone(), probe.at_mm))
}

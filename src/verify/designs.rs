//! Random designs: every status must be true, and no design may fold in the mesher.

use salp_core::evaluate::SceneStatus;
use salp_core::geometry::LayoutBoxes;
use salp_core::geometry::samples::Stratum;
use salp_core::verify::designs::{
    Confirmation, DesignLine, LimitLine, MATERIALS, MesherCount, Origin, SHIPPED_MET, mesh_designs,
    read_designs, samples, solve_design,
};
use serde_json::{Value, json};

use super::{ThreadClock, Verify};
use crate::failure::Failure;
use crate::output::{Output, note, number, table, write_file};
use crate::parallel::in_parallel;

/// Designs that a thread meshes before it takes the next ones.
const MESHER_BATCH: usize = 100;
/// Least scaled corner Jacobian of `--mesher`.
const LEAST_SCALED_JACOBIAN: f64 = 0.05;

/// Solves random designs at both p/mu.
pub fn run(verify: &Verify, count: usize, output: Output) -> Result<(), Failure> {
    let met = match &verify.met {
        Some(file) => {
            let text = std::fs::read_to_string(file).map_err(|error| {
                Failure::fault("met", format!("cannot read {}: {error}", file.display()))
            })?;
            read_designs(&text)
        }
        None => read_designs(SHIPPED_MET),
    };
    if met.is_empty() {
        return Err(Failure::fault("met", "no line has 16 numbers"));
    }
    let designs = samples(count, verify.seed, &met);
    let jobs = designs.len() * MATERIALS.len();
    let lines = in_parallel(
        verify.threads(),
        jobs,
        |job| {
            let design = &designs[job / MATERIALS.len()];
            solve_design(
                design,
                job % MATERIALS.len(),
                verify.contact,
                &mut ThreadClock,
            )
        },
        |done, line| {
            if let Ok(line) = line
                && (line.status == SceneStatus::NotConverged || done % 50 == 0)
            {
                note(&format!(
                    "{done} of {jobs}: design {} {} at p/mu {}: {} {}",
                    line.design,
                    line.stratum.name(),
                    line.p_over_mu,
                    name(line.status),
                    line.reason.as_deref().unwrap_or_default()
                ));
            }
        },
    );
    let lines = lines.into_iter().collect::<Result<Vec<DesignLine>, _>>()?;
    if let Some(file) = &verify.csv {
        write_file(file, &csv(&lines))?;
    }
    let failed = lines
        .iter()
        .filter(|line| line.status == SceneStatus::NotConverged)
        .count();
    let document = json!({
        "status": if failed == 0 { "ok" } else { "failed" },
        "seed": verify.seed,
        "counts": counts(&lines),
        "not_converged": failed,
        "cpu_s": lines.iter().map(|l| l.cpu_s).sum::<f64>(),
        "confirm_cpu_s": lines.iter().map(|l| l.confirm_cpu_s).sum::<f64>(),
        "lines": lines,
    });
    output.print(&document, || text(&lines, &document));
    if failed == 0 {
        Ok(())
    } else {
        Err(Failure::Run("a design has no true status"))
    }
}

fn name(status: SceneStatus) -> String {
    let value = serde_json::to_value(status).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

const STATUSES: [SceneStatus; 4] = [
    SceneStatus::Ok,
    SceneStatus::NoEquilibrium,
    SceneStatus::InfeasibleGeometry,
    SceneStatus::NotConverged,
];

/// Lines of an origin at a p/mu by status.
fn counts(lines: &[DesignLine]) -> Vec<Value> {
    let mut all = Vec::new();
    for origin in Origin::ALL {
        for (p_over_mu, _) in MATERIALS {
            let of = |status: SceneStatus| {
                let is = |l: &&DesignLine| {
                    l.stratum == origin && l.p_over_mu == p_over_mu && l.status == status
                };
                lines.iter().filter(is).count()
            };
            let mut count = json!({"stratum": origin, "p_over_mu": p_over_mu});
            for status in STATUSES {
                count[name(status)] = json!(of(status));
            }
            all.push(count);
        }
    }
    all
}

fn text(lines: &[DesignLine], document: &Value) -> String {
    let header = [
        "stratum",
        "p/mu",
        "ok",
        "no_equilibrium",
        "infeasible_geometry",
        "not_converged",
    ];
    let rows: Vec<Vec<String>> = counts(lines)
        .iter()
        .map(|count| {
            let cell = |name: &str| match &count[name] {
                Value::String(text) => text.clone(),
                value => value.to_string(),
            };
            let mut row = vec![cell("stratum"), cell("p_over_mu")];
            row.extend(STATUSES.iter().map(|s| cell(&name(*s))));
            row
        })
        .collect();
    let mut text = table(&header, &rows);
    for line in lines
        .iter()
        .filter(|l| l.status == SceneStatus::NotConverged)
    {
        text += &format!(
            "\ndesign {} at p/mu {}: {}",
            line.design,
            line.p_over_mu,
            line.reason.as_deref().unwrap_or_default()
        );
    }
    let folds = |l: &&DesignLine| l.negative_pivots > 0;
    let touched: Vec<&DesignLine> = lines.iter().filter(|l| l.contact_steps > 0).collect();
    if !touched.is_empty() {
        text += &format!(
            "\n{} solves with contact, {} CPU s; penetration at most {} mm",
            touched.len(),
            number(Some(touched.iter().map(|l| l.cpu_s).sum())),
            number(Some(
                touched.iter().map(|l| l.penetration_mm).fold(0.0, f64::max)
            )),
        );
    }
    text + &format!(
        "\n{} solves, {} with crossing walls, {} with an unstable state; {} CPU s, second paths {} CPU s",
        lines.len(),
        lines.iter().filter(|l| l.walls_overlap).count(),
        lines.iter().filter(folds).count(),
        number(document["cpu_s"].as_f64()),
        number(document["confirm_cpu_s"].as_f64()),
    )
}

fn csv(lines: &[DesignLine]) -> String {
    let mut csv = String::from(
        "design,stratum,p_over_mu,status,limit_kind,limit_leg,limit_pressure_kpa,confirmed,confirmed_kind,\
         confirmed_pressure_kpa,newton_iterations,factorisations,cpu_s,confirm_cpu_s,max_stretch,negative_pivots,\
         walls_overlap,contact_steps,penetration_mm,x\n",
    );
    let list = |values: &[f64]| {
        let cells: Vec<String> = values.iter().map(f64::to_string).collect();
        cells.join(" ")
    };
    for line in lines {
        let limit = line.limit.as_ref();
        let confirmed = line.confirmation.as_ref();
        let second = confirmed.and_then(|c| c.pressure_kpa.as_ref());
        let cells = [
            line.design.to_string(),
            line.stratum.name().to_owned(),
            line.p_over_mu.to_string(),
            name(line.status),
            limit.map_or(String::new(), LimitLine::kind_name),
            limit.map_or(String::new(), |l| l.leg.to_string()),
            limit.map_or(String::new(), |l| list(&l.pressure_kpa)),
            confirmed.map_or(String::new(), |c| c.confirmed.to_string()),
            confirmed.map_or(String::new(), Confirmation::kind_name),
            second.map_or(String::new(), |p| list(p)),
            line.newton_iterations.to_string(),
            line.factorisations.to_string(),
            line.cpu_s.to_string(),
            line.confirm_cpu_s.to_string(),
            line.max_stretch.to_string(),
            line.negative_pivots.to_string(),
            line.walls_overlap.to_string(),
            line.contact_steps.to_string(),
            line.penetration_mm.to_string(),
            list(&line.x),
        ];
        csv += &cells.join(",");
        csv.push('\n');
    }
    csv
}

/// Meshes random designs of every stratum of a layout.
pub fn run_mesher(verify: &Verify, count: usize, output: Output) -> Result<(), Failure> {
    let boxes = LayoutBoxes {
        layout: verify.layout,
        corners: verify.corners,
        ..LayoutBoxes::PAPER
    };
    let mut totals = Vec::new();
    for stratum in Stratum::ALL {
        let share = count.div_ceil(Stratum::ALL.len());
        let batches = share.div_ceil(MESHER_BATCH);
        let parts = in_parallel(
            verify.threads(),
            batches,
            |batch| {
                let first = batch * MESHER_BATCH;
                let last = share.min(first + MESHER_BATCH);
                mesh_designs(&boxes, stratum, verify.seed, first..last)
            },
            |done, _| {
                if done % 10 == 0 {
                    note(&format!("{} of {share} designs", done * MESHER_BATCH));
                }
            },
        );
        let mut total = MesherCount::new(stratum);
        for part in &parts {
            total.add(part);
        }
        totals.push(total);
    }
    let sound = |t: &MesherCount| {
        t.folds == 0
            && t.least_jacobian_mm2 > 0.0
            && t.least_scaled_jacobian >= LEAST_SCALED_JACOBIAN
    };
    let failed = totals.iter().filter(|t| !sound(t)).count();
    let document = json!({
        "status": if failed == 0 { "ok" } else { "failed" },
        "seed": verify.seed,
        "layout": boxes.layout,
        "corners": boxes.corners,
        "strata": totals,
    });
    output.print(&document, || mesher_text(&totals));
    if failed == 0 {
        Ok(())
    } else {
        Err(Failure::Run("a design folds, or nearly"))
    }
}

fn mesher_text(totals: &[MesherCount]) -> String {
    let header = [
        "stratum",
        "designs",
        "folds",
        "least Jacobian bound (mm^2)",
        "least scaled Jacobian",
        "of design",
    ];
    let rows: Vec<Vec<String>> = totals
        .iter()
        .map(|t| {
            vec![
                t.stratum.to_owned(),
                t.designs.to_string(),
                t.folds.to_string(),
                number(Some(t.least_jacobian_mm2)),
                number(Some(t.least_scaled_jacobian)),
                t.worst.to_string(),
            ]
        })
        .collect();
    table(&header, &rows)
}

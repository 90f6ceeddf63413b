//! Every optimiser on every published problem.

use std::path::Path;

use salp_core::optimiser::{GradientSource, StopReason};
use salp_core::picture::{ProfilePanel, ProfilePicture};
use salp_core::verify::optimisers::{
    DataProfile, METHODS, OptimiserLine, OptimiserTable, TOLERANCES, Win, data_profiles,
    optimisers, wins,
};
use serde_json::json;

use super::{Verify, verdict};
use crate::failure::Failure;
use crate::output::{Output, table, write_file};
use crate::stopwatch::cpu_seconds;

/// By how much a method must be cheaper than another to be worth keeping beside it.
const SHARE: f64 = 0.2;
const PAIR: [&str; 2] = ["sqp", "gcmma"];

/// Runs the methods and problems that are asked for.
pub fn run(verify: &Verify, output: Output) -> Result<(), Failure> {
    let tables = optimisers(&|method, problem| verify.wants(method) || verify.wants(problem));
    if tables.is_empty() {
        let names: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
        let message = format!(
            "no method or problem has this in its name; methods are {}",
            names.join(", ")
        );
        return Err(Failure::fault("only", message));
    }
    if let Some(folder) = &verify.out {
        profiles(&tables, folder)?;
    }
    let lines = || tables.iter().flat_map(|table| &table.lines);
    let failed = lines().filter(|line| !line.passed).count();
    let passed = lines().count() - failed;
    let [one, other] = PAIR;
    let wins = [
        wins(&tables, [one, other], SHARE),
        wins(&tables, [other, one], SHARE),
    ];
    let cpu_s = cpu_seconds();
    let document = json!({
        "status": if failed == 0 { "ok" } else { "failed" },
        "tables": tables,
        "wins": wins.concat(),
        "passed": passed,
        "failed": failed,
        "cpu_s": cpu_s,
    });
    output.print(&document, || {
        let mut text = text(&tables);
        for wins in &wins {
            text += &told(wins);
        }
        text + &format!(
            "\n{} lines, {failed} failed, {cpu_s:.1} CPU s",
            passed + failed
        )
    });
    if failed == 0 {
        Ok(())
    } else {
        Err(Failure::Run(
            "an optimiser does not keep to what it is held to",
        ))
    }
}

/// Writes the data profiles into a folder.
fn profiles(tables: &[OptimiserTable], folder: &Path) -> Result<(), Failure> {
    let all = data_profiles(tables);
    let mut csv = String::from("tolerance,method,problems,k,share\n");
    let mut panels = Vec::new();
    for (tolerance, profiles) in TOLERANCES.iter().zip(&all) {
        for DataProfile { profile, problems } in profiles {
            // A method that solves nothing has a line too.
            for (k, share) in [&(0.0, 0.0)].into_iter().chain(&profile.steps) {
                csv += &format!("{tolerance:e},{},{problems},{k},{share}\n", profile.method);
            }
        }
        let series = |of: &DataProfile| {
            let name = format!("{} ({})", of.profile.method, of.problems);
            (name, of.profile.steps.clone())
        };
        panels.push(ProfilePanel {
            heading: format!("all but {tolerance:.0e} of the possible gain"),
            series: profiles.iter().map(series).collect(),
        });
    }
    let picture = ProfilePicture {
        title: "Data profiles: the published problems, gradients by differences".into(),
        x_label: "evaluations / (n + 1)".into(),
        y_label: "share of the problems".into(),
        panels,
        caption: vec![
            "in brackets the number of problems that a method is run on; from the published start; violations up to the method's own \
             tolerance, at least 1e-3, are allowed"
                .into(),
        ],
    };
    write_file(&folder.join("data-profiles.csv"), &csv)?;
    write_file(&folder.join("data-profiles.svg"), &picture.svg())
}

fn text(tables: &[OptimiserTable]) -> String {
    let header = [
        "problem",
        "gradients",
        "start",
        "method",
        "gap",
        "violation",
        "to 0.1 %",
        "whole run",
        "iterations",
        "stop",
        "",
    ];
    let mut rows = Vec::new();
    for table in tables {
        rows.extend(table.lines.iter().map(row));
        for (name, other) in &table.others {
            rows.push(vec![
                table.problem.clone(),
                source(table.gradient).to_owned(),
                "x0".into(),
                format!("({name})"),
                other.gap.map_or("-".into(), |gap| format!("{gap:+.0e}")),
                other.violation.map_or("-".into(), |v| format!("{v:.0e}")),
                other.to_target.as_deref().map_or("-".into(), cost),
                cost(&other.whole),
                "-".into(),
                if other.stopped { "stopped" } else { "-" }.into(),
                String::new(),
            ]);
        }
    }
    let mut text = self::table(&header, &rows);
    for line in tables.iter().flat_map(|table| &table.lines) {
        if !line.why.is_empty() {
            text += &format!(
                "\n{}: {} on {} ({}, {}) misses: {}",
                if line.passed { "known" } else { "FAIL" },
                line.method,
                line.problem,
                source(line.gradient),
                line.start,
                line.why.join(", ")
            );
        }
    }
    text + "\nCosts: analyses + gradients; in brackets what others took, as measured."
}

fn row(line: &OptimiserLine) -> Vec<String> {
    let costs = |analyses: usize, gradients: usize| match line.gradient {
        GradientSource::Model => cost(&[analyses, gradients]),
        GradientSource::Differences => cost(&[analyses]),
    };
    vec![
        line.problem.clone(),
        source(line.gradient).to_owned(),
        line.start.clone(),
        line.method.to_owned(),
        line.gap.map_or("-".into(), |gap| format!("{gap:+.1e}")),
        line.violation.map_or("-".into(), |v| format!("{v:.0e}")),
        line.to_target.map_or("-".into(), |[a, g]| costs(a, g)),
        costs(line.analyses, line.gradients),
        line.iterations.to_string(),
        reason(line.stop),
        match (line.passed, line.why.is_empty()) {
            (true, false) => "known".into(),
            (passed, _) => verdict(passed).into(),
        },
    ]
}

/// Where a method is cheaper than another.
fn told(wins: &[Win]) -> String {
    let Some(first) = wins.first() else {
        return String::new();
    };
    let each = wins.iter().map(|win| {
        let other = win
            .other
            .map_or("not reached".into(), |other| other.to_string());
        format!(
            "{} {} {} : {other}",
            win.problem,
            source(win.gradient),
            win.cost
        )
    });
    format!(
        "\n{} cheaper than {} by {:.0} % or more to a gap of 0.1 %, {} times: {}",
        first.method,
        first.over,
        100.0 * SHARE,
        wins.len(),
        each.collect::<Vec<_>>().join(", ")
    )
}

fn cost(cost: &[usize]) -> String {
    let parts: Vec<String> = cost.iter().map(usize::to_string).collect();
    parts.join("+")
}

fn source(gradient: GradientSource) -> &'static str {
    match gradient {
        GradientSource::Model => "exact",
        GradientSource::Differences => "differences",
    }
}

/// Name of a stop reason in documents.
fn reason(stop: StopReason) -> String {
    serde_json::to_value(stop)
        .ok()
        .and_then(|value| value["reason"].as_str().map(str::to_owned))
        .unwrap_or_default()
}

//! Stiff and extreme scenes.

use salp_core::mesh::ElementKind;
use salp_core::verify::{ExtremeLine, extremes, run_extreme};
use serde_json::json;

use super::{ProcessClock, Verify, element_name, verdict};
use crate::failure::Failure;
use crate::output::{Output, note, table};

/// Runs the extreme scenes that are asked for on both elements.
pub fn run(verify: &Verify, output: Output) -> Result<(), Failure> {
    let mut lines = Vec::new();
    for extreme in extremes() {
        if !verify.wants(extreme.group) && !verify.wants(&extreme.name) {
            continue;
        }
        for element in [ElementKind::Quad9, ElementKind::Quad4] {
            if verify.wants_element(element) {
                let mut line = run_extreme(&extreme, element, &mut ProcessClock);
                line.bound /= verify.tighten;
                line.passed &= line.error.is_some_and(|error| error <= line.bound);
                note(&format!(
                    "{}: {} {} {}: {}",
                    verdict(line.passed),
                    line.group,
                    line.name,
                    element_name(element),
                    line.status
                ));
                lines.push(line);
            }
        }
    }
    if lines.is_empty() {
        let message = "no extreme scene has this in its group or name";
        return Err(Failure::fault("only", message));
    }
    let failed = lines.iter().filter(|l| !l.passed).count();
    let cpu_s: f64 = lines.iter().map(|l| l.cpu_in_all_s).sum();
    let document = json!({
        "status": if failed == 0 { "ok" } else { "failed" },
        "lines": lines,
        "passed": lines.len() - failed,
        "failed": failed,
        "cpu_s": cpu_s,
    });
    output.print(&document, || text(&lines, failed, cpu_s));
    if failed == 0 {
        Ok(())
    } else {
        Err(Failure::Run("an extreme scene did not end as it must"))
    }
}

fn text(lines: &[ExtremeLine], failed: usize, cpu_s: f64) -> String {
    let header = [
        "extreme",
        "element",
        "status",
        "expected",
        "iterations",
        "factorisations",
        "error",
        "bound",
        "against",
        "",
        "CPU s",
    ];
    let rows: Vec<Vec<String>> = lines
        .iter()
        .map(|line| {
            vec![
                format!("{}: {}", line.group, line.name),
                element_name(line.element).to_owned(),
                line.status.clone(),
                line.expected.clone(),
                line.newton_iterations.to_string(),
                line.factorisations.to_string(),
                line.error.map_or("-".into(), |e| format!("{e:.1e}")),
                format!("{:.1e}", line.bound),
                line.against.clone(),
                verdict(line.passed).to_owned(),
                format!("{:.2}", line.cpu_s),
            ]
        })
        .collect();
    let mut text = table(&header, &rows);
    for line in lines.iter().filter(|line| !line.passed) {
        text += &format!(
            "\n{}: {} on {} must be {} within {:.1e} of {}: {}",
            line.group,
            line.name,
            element_name(line.element),
            line.expected,
            line.bound,
            line.against,
            line.why
        );
    }
    text + &format!("\n{} lines, {failed} failed, {cpu_s:.1} CPU s", lines.len())
}

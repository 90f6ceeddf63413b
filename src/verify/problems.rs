//! Published and closed-form problems.

use salp_core::verify::{Line, PROBLEMS};
use serde_json::json;

use super::{ProcessClock, Verify, element_name, verdict};
use crate::failure::Failure;
use crate::output::{Output, note, number, table};

/// Runs the problems that are asked for.
pub fn run(verify: &Verify, output: Output) -> Result<(), Failure> {
    let mut lines = Vec::new();
    for problem in &PROBLEMS {
        for element in problem.elements {
            if verify.wants(problem.name) && verify.wants_element(*element) {
                let found = problem.run(*element, verify.tighten, &mut ProcessClock);
                found.iter().for_each(tell);
                lines.extend(found);
            }
        }
    }
    if lines.is_empty() {
        let names: Vec<&str> = PROBLEMS.iter().map(|p| p.name).collect();
        let message = format!("nothing has this name; there are {}", names.join(", "));
        return Err(Failure::fault("only", message));
    }
    let failed = lines.iter().filter(|l| !l.passed).count();
    let cpu_s: f64 = lines.iter().map(|l| l.cpu_s).sum();
    let status = if failed == 0 { "ok" } else { "failed" };
    let document = json!({
        "status": status,
        "lines": lines,
        "passed": lines.len() - failed,
        "failed": failed,
        "cpu_s": cpu_s,
    });
    output.print(&document, || text(&lines, failed, cpu_s));
    if failed == 0 {
        Ok(())
    } else {
        Err(Failure::Run("a line is out of its bounds"))
    }
}

fn tell(line: &Line) {
    note(&format!(
        "{}: {} {}: {}",
        verdict(line.passed),
        line.problem,
        element_name(line.element),
        line.quantity
    ));
}

fn text(lines: &[Line], failed: usize, cpu_s: f64) -> String {
    let header = [
        "problem", "element", "quantity", "value", "expected", "error", "bound", "order", "",
        "CPU s",
    ];
    let short = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.1e}"));
    let rows: Vec<Vec<String>> = lines
        .iter()
        .map(|line| {
            vec![
                line.problem.to_owned(),
                element_name(line.element).to_owned(),
                line.quantity.clone(),
                number(line.value),
                number(line.expected),
                short(line.error),
                short(line.bound),
                line.order.map_or("-".into(), |o| format!("{o:.1}")),
                verdict(line.passed).to_owned(),
                format!("{:.2}", line.cpu_s),
            ]
        })
        .collect();
    let mut text = table(&header, &rows);
    for line in lines {
        if let Some(reason) = &line.reason {
            text += &format!(
                "\n{} {}: {reason}",
                line.problem,
                element_name(line.element)
            );
        }
    }
    text + &format!("\n{} lines, {failed} failed, {cpu_s:.1} CPU s", lines.len())
}

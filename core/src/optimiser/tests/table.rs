//! Gap, violation and counts against the reference implementation's, with the paper's settings.

use super::{
    cases::{Case, named},
    run::{Run, options, run, tail},
};
use crate::optimiser::{Curvature, GradientSource, MmfdOptions};

/// What the reference implementation took.
struct Reference {
    id: &'static str,
    /// Analyses and gradients with exact gradients.
    exact: Option<(usize, usize)>,
    /// Analyses with differences.
    differences: usize,
}

const fn reference(
    id: &'static str,
    exact: Option<(usize, usize)>,
    differences: usize,
) -> Reference {
    Reference {
        id,
        exact,
        differences,
    }
}

const REFERENCES: [Reference; 15] = [
    reference("cantilever_5", Some((63, 16)), 195),
    reference("cantilever_50", Some((110, 29)), 2389),
    reference("cantilever_100", Some((124, 32)), 6524),
    reference("hs100", Some((62, 11)), 142),
    reference("hs113", Some((33, 8)), 113),
    reference("hs71", Some((28, 7)), 56),
    reference("pressure_vessel", Some((21, 5)), 41),
    reference("rosen_suzuki", Some((106, 18)), 209),
    reference("rosen_suzuki_noisy", None, 294),
    reference("rosenbrock_disk", Some((84, 24)), 80),
    reference("speed_reducer", Some((28, 8)), 84),
    reference("spring", Some((46, 12)), 94),
    reference("svanberg_cantilever", Some((29, 6)), 59),
    reference("three_bar_truss", Some((12, 3)), 18),
    reference("welded_beam", Some((41, 10)), 79),
];

struct Line {
    text: String,
    failures: Vec<String>,
}

fn line(
    case: &Case,
    run: &Run,
    label: &str,
    reference: Option<usize>,
    cost: usize,
    curved: bool,
) -> Line {
    let best = run.state.best().expect("a best point");
    let gap = (best.objective - case.f_star) / case.f_star.abs();
    let limit = reference.map(|reference| reference * 3 / 2 + 10);
    let tail = tail(run, best.objective);
    let mut failures = Vec::new();
    let mut check = |holds: bool, what: String| {
        if !holds {
            failures.push(format!("{} {label}: {what}", case.id));
        }
    };
    // With curvature everywhere this is another method; 1.1 % is what the published one is held to.
    let most = if curved { 0.02 } else { 0.011 };
    check(gap.abs() <= most, format!("gap {gap:.2e}"));
    check(
        best.violation <= 0.003,
        format!("violation {:.2e}", best.violation),
    );
    check(
        limit.is_none_or(|limit| cost <= limit),
        format!("cost {cost}, allowed {}", limit.unwrap_or(0)),
    );
    check(tail <= 3.0, format!("{tail:.2} times the cost to 0.1 %"));
    let text = format!(
        "{:<20} {label:<22} gap {gap:+9.2e}  violation {:8.1e}  iterations {:3}  analyses {:5}  gradients {:3}  cost {cost:5}  reference {:>5}  tail {tail:.2}  {:?}",
        case.id,
        best.violation,
        run.state.iteration(),
        run.state.analyses(),
        run.state.gradients(),
        reference.map_or("-".to_owned(), |reference| reference.to_string()),
        run.reason,
    );
    Line { text, failures }
}

/// Runs every problem from every start; `exact` and `differences` are its options.
fn table(title: &str, exact: &MmfdOptions, differences: &MmfdOptions) {
    let mut lines = Vec::new();
    let curved = exact.curvature == Curvature::Always;
    for reference in &REFERENCES {
        let case = named(reference.id);
        for (start, x0) in std::iter::once(("x0", &case.x0))
            .chain(case.starts.iter().map(|(name, x)| (&**name, x)))
        {
            let from_x0 = start == "x0";
            if let Some((analyses, gradients)) = reference.exact {
                let run = run(&case, exact.clone(), x0.clone());
                let cost = run.state.analyses() + run.state.gradients();
                let label = format!("exact {start}");
                lines.push(line(
                    &case,
                    &run,
                    &label,
                    from_x0.then_some(analyses + gradients),
                    cost,
                    curved,
                ));
            }
            if !from_x0 && reference.id == "rosenbrock_disk" {
                // DABOBJ, 1e-4 of a large F0, ends this run early.
                continue;
            }
            let run = run(&case, differences.clone(), x0.clone());
            let cost = run.state.analyses();
            lines.push(line(
                &case,
                &run,
                &format!("differences {start}"),
                from_x0.then_some(reference.differences),
                cost,
                curved,
            ));
        }
    }
    println!("{title}");
    for line in &lines {
        println!("{}", line.text);
    }
    let failures: Vec<String> = lines.into_iter().flat_map(|line| line.failures).collect();
    assert!(failures.is_empty(), "{failures:#?}");
}

/// `cargo test -p salp-core --no-default-features --lib mmfd_table -- --nocapture` prints the tables.
#[test]
fn mmfd_table() {
    table(
        "the method as published",
        &options(GradientSource::Model),
        &options(GradientSource::Differences),
    );
}

#[test]
fn mmfd_table_with_curvature() {
    let always = |gradient| MmfdOptions {
        curvature: Curvature::Always,
        ..options(gradient)
    };
    table(
        "with curvature",
        &always(GradientSource::Model),
        &always(GradientSource::Differences),
    );
}

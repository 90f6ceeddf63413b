//! Every line of the table keeps to what it is held to, and the rule finds one that does not.

use super::*;

#[test]
fn every_method_keeps_to_what_it_is_held_to() {
    let tables = optimisers(&|_, _| true);
    let mut failed = Vec::new();
    for line in tables.iter().flat_map(|table| &table.lines) {
        if !line.passed {
            failed.push(format!(
                "{} {} {:?} {}: {:?}, gap {:?}, tail {:.2}, {:?}",
                line.problem,
                line.method,
                line.gradient,
                line.start,
                line.why,
                line.gap,
                line.tail,
                line.stop
            ));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
    // Figures of others are there for the problems on which they were measured.
    let measured = |gradient| {
        let with = tables
            .iter()
            .filter(|t| t.gradient == gradient && t.others.len() == 11);
        with.count()
    };
    assert_eq!(measured(GradientSource::Model), 14);
    assert_eq!(measured(GradientSource::Differences), 15);
}

#[test]
fn a_run_that_is_cut_short_fails() {
    let sqp = METHODS.iter().find(|method| method.name == "sqp");
    let short = Method {
        options: |gradient, _| {
            crate::optimiser::SqpOptions {
                descent: crate::optimiser::DescentOptions {
                    gradient,
                    max_iterations: 2,
                    ..crate::optimiser::SqpOptions::default().descent
                },
                ..crate::optimiser::SqpOptions::default()
            }
            .into()
        },
        ..*sqp.unwrap()
    };
    let case = published::all()
        .into_iter()
        .find(|case| case.id == "welded_beam")
        .unwrap();
    let line = run::run(&short, &case, GradientSource::Model, "x0", &case.x0);
    assert!(!line.passed && line.why.len() >= 2, "{line:?}");
}

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
    let [coarse, fine] = data_profiles(&tables);
    assert_eq!(coarse.len(), METHODS.len());
    for (coarse, fine) in coarse.iter().zip(&fine) {
        let name = &coarse.profile.method;
        assert_eq!(*name, fine.profile.method);
        let by_values = ["cma_es", "random_search"].contains(&name.as_str());
        assert_eq!(coarse.problems < coarse_of(&tables), by_values, "{name}");
        for k in [1.0, 3.0, 10.0, 100.0, 1e6] {
            assert!(fine.profile.share(k) <= coarse.profile.share(k), "{name}");
        }
        let end = coarse.profile.share(f64::INFINITY);
        assert!(end <= 1.0 && coarse.profile.share(0.5) == 0.0, "{name}");
        // SQP solves all that has one optimum, a random search hardly anything.
        match name.as_str() {
            "sqp" => assert!(fine.profile.share(f64::INFINITY) > 0.6),
            "random_search" => assert!(end < 0.5),
            _ => {}
        }
    }
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

/// Problems with differences.
fn coarse_of(tables: &[OptimiserTable]) -> usize {
    let with = tables
        .iter()
        .filter(|t| t.gradient == GradientSource::Differences);
    with.count()
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

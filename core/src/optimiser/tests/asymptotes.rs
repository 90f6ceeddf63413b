//! The moving asymptotes against what Svanberg's own implementations took on the same problems: at most twice their
//! analyses and gradients to a gap of 0.1 %. `cargo test -p salp-core --no-default-features --lib gcmma_table --
//! --nocapture` prints the table.

use super::{
    cases::{Case, named},
    run::{Run, run, tail},
};
use crate::optimiser::{GcmmaOptions, GradientSource};

/// What Svanberg's implementation took to a gap of 0.1 %.
struct Reference {
    id: &'static str,
    /// Analyses and gradients with exact gradients; none where it did not get there.
    exact: Option<(usize, usize)>,
    /// Analyses with differences.
    differences: Option<usize>,
}

const fn reference(
    id: &'static str,
    exact: Option<(usize, usize)>,
    differences: Option<usize>,
) -> Reference {
    Reference {
        id,
        exact,
        differences,
    }
}

/// hs71, which Svanberg's GCMMA does not solve, with the figures of his MMA.
const GCMMA: [Reference; 15] = [
    reference("cantilever_5", Some((20, 5)), Some(69)),
    reference("cantilever_50", Some((36, 7)), Some(736)),
    reference("cantilever_100", Some((36, 7)), Some(1436)),
    reference("hs100", Some((25, 5)), Some(60)),
    reference("hs113", Some((35, 9)), Some(127)),
    reference("hs71", Some((56, 55)), Some(276)),
    reference("pressure_vessel", Some((21, 18)), Some(93)),
    reference("rosen_suzuki", Some((14, 4)), Some(30)),
    reference("rosen_suzuki_noisy", None, Some(31)),
    reference("rosenbrock_disk", Some((211, 50)), Some(489)),
    reference("speed_reducer", Some((9, 8)), Some(65)),
    reference("spring", Some((95, 48)), Some(206)),
    reference("svanberg_cantilever", Some((7, 3)), Some(22)),
    reference("three_bar_truss", Some((10, 3)), Some(16)),
    reference("welded_beam", Some((14, 6)), Some(38)),
];

const MMA: [Reference; 15] = [
    reference("cantilever_5", Some((18, 17)), Some(166)),
    reference("cantilever_50", None, Some(4546)),
    reference("cantilever_100", Some((50, 49)), Some(8041)),
    reference("hs100", Some((16, 15)), Some(185)),
    reference("hs113", Some((53, 52)), None),
    reference("hs71", Some((56, 55)), Some(276)),
    reference("pressure_vessel", Some((15, 14)), Some(71)),
    reference("rosen_suzuki", Some((12, 11)), Some(56)),
    reference("rosen_suzuki_noisy", None, Some(61)),
    reference("rosenbrock_disk", None, None),
    reference("speed_reducer", Some((4, 3)), Some(25)),
    reference("spring", Some((20, 19)), Some(73)),
    reference("svanberg_cantilever", Some((5, 4)), Some(25)),
    reference("three_bar_truss", Some((6, 5)), Some(16)),
    reference("welded_beam", Some((9, 7)), Some(37)),
];

/// Analyses and gradients until a design within the tolerance and 0.1 % of the optimum, had at the end of an ask.
pub(super) fn to_target(case: &Case, run: &Run) -> Option<(usize, usize)> {
    let (mut analyses, mut gradients) = (0, 0);
    for (ask, seen) in &run.history {
        let extra = ask.kind == crate::optimiser::AskKind::Gradient && ask.want_gradient;
        gradients += usize::from(ask.want_gradient);
        analyses += usize::from(!extra);
        if let Some((f, violation)) = seen
            && *violation <= 0.003
            && (f - case.f_star) / case.f_star.abs() <= 1e-3
        {
            return Some((analyses, gradients));
        }
    }
    None
}

/// Problems that the method without globalisation need not solve: it cycles or wanders outside the feasible region.
const MMA_EXCEPTIONS: [&str; 3] = ["cantilever_50", "cantilever_100", "rosenbrock_disk"];

fn table(
    title: &str,
    references: &[Reference],
    exceptions: &[&str],
    options: impl Fn(GradientSource) -> GcmmaOptions,
) {
    println!("{title}");
    let mut failures = Vec::new();
    for reference in references {
        let case = named(reference.id);
        for (start, x0) in std::iter::once(("x0", &case.x0))
            .chain(case.starts.iter().map(|(name, x)| (&**name, x)))
        {
            for gradient in [GradientSource::Model, GradientSource::Differences] {
                if (start, reference.id, gradient)
                    == ("infeasible", "rosenbrock_disk", GradientSource::Differences)
                {
                    // The error of the differences exceeds the descent along the valley's floor.
                    continue;
                }
                let run = run(&case, options(gradient), x0.clone());
                let best = run.state.best().expect("a best point");
                let gap = (best.objective - case.f_star) / case.f_star.abs();
                let target = to_target(&case, &run);
                let tail = tail(&run, best.objective);
                let allowed = match gradient {
                    GradientSource::Model => reference.exact,
                    GradientSource::Differences => reference.differences.map(|a| (a, 0)),
                }
                .filter(|_| start == "x0");
                let within = match (target, allowed) {
                    (_, None) => gap <= 1e-3 || start == "x0",
                    (Some((a, g)), Some((most_a, most_g))) => {
                        a <= 2 * most_a && (most_g == 0 || g <= 2 * most_g)
                    }
                    (None, Some(_)) => false,
                };
                let sound = within && tail <= 3.0 && best.violation <= 0.003;
                let text = format!(
                    "{} {:<20} {gradient:?} {start:<10} gap {gap:+9.2e} violation {:8.1e} iterations {:3} analyses {:5} gradients {:3} to 0.1 % {:<14} reference {:<14} tail {tail:.2} {:?}",
                    if sound { " " } else { "!" },
                    case.id,
                    best.violation,
                    run.state.iteration(),
                    run.state.analyses(),
                    run.state.gradients(),
                    target.map_or("-".to_owned(), |t| format!("{t:?}")),
                    allowed.map_or("-".to_owned(), |t| format!("{t:?}")),
                    run.reason,
                );
                println!("{text}");
                if !sound && !exceptions.contains(&reference.id) {
                    failures.push(text);
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn gcmma_table() {
    table("GCMMA", &GCMMA, &[], |gradient| GcmmaOptions {
        gradient,
        ..GcmmaOptions::default()
    });
}

#[test]
fn mma_table() {
    table("MMA", &MMA, &MMA_EXCEPTIONS, |gradient| GcmmaOptions {
        gradient,
        globalise: false,
        infeasible_iterations: 100,
        ..GcmmaOptions::default()
    });
}

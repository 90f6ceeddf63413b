//! The problems against their published digits, and quick runs of them.

use super::*;
use crate::equilibrium::{Observer, Phase, Unobserved};
use crate::material::closed_form::one_of_each;

struct Still;

impl Observer for Still {
    fn enter(&mut self, _: Phase) {}
}

impl CpuClock for Still {
    fn cpu_s(&self) -> f64 {
        0.0
    }
}

fn run(name: &str, element: ElementKind, tighten: f64) -> Vec<Line> {
    let problem = PROBLEMS.iter().find(|p| p.name == name).unwrap();
    problem.run(element, tighten, &mut Still)
}

#[test]
fn closed_forms_are_the_published_numbers() {
    for (a, p) in [
        (1.05, 0.070132),
        (1.1, 0.131562),
        (1.25, 0.275712),
        (1.5, 0.428228),
        (2.0, 0.574054),
        (3.0, 0.660417),
    ] {
        let found = thick_cylinder::pressure_mpa(&thick_cylinder::neo_hookean(), a);
        assert!((found - p).abs() < 6e-7, "{a}: {found}");
        let (k, b) = (a * a - 1.0, (a * a + 3.0).sqrt());
        let closed = 2_f64.ln() - (b / a).ln() + 0.5 * k * (1.0 / (a * a) - 1.0 / (b * b));
        assert!((found - closed).abs() < 1e-12, "{a}: {found} {closed}");
    }
    for (a, p) in [
        (1.1, 0.024326),
        (1.25, 0.051715),
        (1.5, 0.083733),
        (2.0, 0.126306),
    ] {
        let found = thick_cylinder::pressure_mpa(&thick_cylinder::yeoh(), a);
        assert!((found - p).abs() < 6e-7, "{a}: {found}");
    }
    for (angle, radius, moment) in [
        (45.0, 122.4258, 2.61317),
        (90.0, 58.8721, 5.19773),
        (180.0, 27.2713, 10.17733),
        (360.0, 11.8321, 18.88306),
    ] {
        let bent = rivlin_flexure::Bent::by(angle);
        assert!((bent.inner_mm - radius).abs() < 6e-5, "{bent:?}");
        assert!((bent.moment_over_mu() - moment).abs() < 6e-6, "{bent:?}");
    }
}

#[test]
fn a_block_bent_to_a_ring_keeps_its_inner_radius() {
    // Coarse: one quadratic element through the thickness.
    let problem = rivlin_flexure::problem(file_kind(ElementKind::Quad9), 1);
    let solved = problem.solve(&mut Unobserved).unwrap();
    let error = solved.displacement(0, solved.last())[1];
    assert!(error.abs() < 0.05, "{error}");
}

#[test]
fn every_law_and_element_passes_the_patch_tests() {
    for element in [ElementKind::Quad9, ElementKind::Quad4, ElementKind::Tri7] {
        let lines = run("homogeneous", element, 1.0);
        assert_eq!(lines.len(), 8 * one_of_each(1e6).len());
        for line in lines {
            assert!(line.passed, "{line:?}");
        }
    }
}

#[test]
fn symmetries_hold_and_a_bound_that_is_too_tight_fails() {
    for name in ["retraced-channel", "mirror", "overlap-hold"] {
        for line in run(name, ElementKind::Quad9, 1.0) {
            assert!(line.passed, "{line:?}");
        }
    }
    let lines = run("retraced-channel", ElementKind::Quad4, 1e12);
    assert!(lines.iter().any(|line| !line.passed));
}

#[test]
fn the_table_of_extremes_reads_and_two_of_it_end_as_they_must() {
    let table = extremes();
    for extreme in &table {
        let document = extreme.document(ElementKind::Quad4);
        let scene = crate::scene::read_scene(&document, std::path::Path::new(""));
        assert!(scene.is_ok(), "{}: {scene:?}", extreme.name);
    }
    for name in ["chamber of 70 x 7 mm, 15 kPa", "1 mm outside, 120 kPa"] {
        let extreme = table.iter().find(|e| e.name == name).unwrap();
        let line = run_extreme(extreme, ElementKind::Quad9, &mut Still);
        assert!(line.passed, "{line:?}");
        let wrong = Extreme {
            expected: Expected::NoEquilibrium {
                pressure_kpa: 5.0,
                within: 0.1,
            },
            against: Against::Limit,
            ..extreme.clone()
        };
        assert!(!run_extreme(&wrong, ElementKind::Quad9, &mut Still).passed);
    }
}

#[test]
fn designs_have_their_thirds_and_are_read_from_ledgers() {
    use designs::{Origin, SEED, SHIPPED_MET, read_designs, samples, solve_design};
    let met = read_designs(SHIPPED_MET);
    assert_eq!(met.len(), 400);
    let numbers: Vec<String> = met[7].iter().map(f64::to_string).collect();
    let ledger = format!("evaluation,x\n12,\"a, b\",ok,{}\n", numbers.join(" "));
    assert_eq!(read_designs(&ledger), [met[7].clone()]);
    assert_eq!(read_designs(&numbers.join(",")), [met[7].clone()]);
    assert!(read_designs("1 2 3\nx").is_empty());

    let designs = samples(10, SEED, &met);
    let of = |origin| designs.iter().filter(|d| d.origin == origin).count();
    assert_eq!(Origin::ALL.map(of), [4, 3, 3]);
    assert!(designs.iter().enumerate().all(|(k, d)| d.index == k));
    let line = solve_design(&designs[8], 0, false, &mut Still).unwrap();
    assert_eq!(line.status, crate::evaluate::SceneStatus::Ok, "{line:?}");
    assert!(line.factorisations > 5 && line.max_stretch > 1.0);
}

#[test]
fn random_designs_do_not_fold() {
    use crate::geometry::{ChamberCorners, Layout, LayoutBoxes, samples::Stratum};
    for (name, layout) in Layout::NAMES {
        for corners in [ChamberCorners::Four, ChamberCorners::Six] {
            let boxes = LayoutBoxes {
                layout,
                corners,
                ..LayoutBoxes::PAPER
            };
            let n = match (layout, corners) {
                (Layout::StackedPair, ChamberCorners::Four) => 40,
                _ => 20,
            };
            for stratum in Stratum::ALL {
                let count = designs::mesh_designs(&boxes, stratum, designs::SEED, 0..n);
                let what = format!("{name}, {corners:?}: {count:?}");
                assert_eq!((count.designs, count.folds), (n, 0), "{what}");
                assert!(count.least_jacobian_mm2 > 0.0, "{what}");
                assert!(count.least_scaled_jacobian >= 0.05, "{what}");
            }
        }
    }
}

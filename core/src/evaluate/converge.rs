//! Error against work: a scene at several meshes, elements, tolerances and load-step counts, against an extrapolated
//! reference.
//!
//! Three families are solved, each varying one thing from the scene's own settings: the mesh (both elements), the tolerance,
//! and the load steps. The reference of the meshes is Richardson's extrapolation of three nested `quad9` meshes with their
//! observed order; that of the load steps is the area's extrapolated limit; that of the tolerances is the tightest. The
//! error of a setting is the sum of its three parts.

use serde::Serialize;

use super::answer::{SceneAnswer, SceneStatus};
use super::scene::{SceneOptions, plan_element, solve_scene};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::{InfeasibleGeometry, MeshPlan};
use crate::scene::{Body, ElementChoice, Scene};

/// Largest element sizes of the families, mm on a unit of 80 x 80 mm; `None`: the size rule.
pub(super) const QUAD9_SIZES: [Option<f64>; 5] =
    [Some(10.0), Some(6.0), Some(4.0), None, Some(2.0)];
pub(super) const QUAD4_SIZES: [Option<f64>; 5] = [Some(4.0), Some(2.0), None, Some(1.4), Some(0.9)];
const TOLERANCES: [f64; 6] = [1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10];
const STEPS: [usize; 5] = [1, 2, 4, 8, 16];
/// Refinements of the reference's nested meshes.
pub(super) const NESTED: [usize; 3] = [1, 2, 4];
/// Orders that an extrapolation may use: of the method at most.
const ORDERS: [f64; 2] = [0.5, 4.0];
/// Shares of the wanted error that tolerance and load steps may take.
const TOLERANCE_SHARE: f64 = 0.05;
const STEP_SHARE: f64 = 0.25;

/// What a run varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Element and size.
    Mesh,
    /// Tolerance of the residual.
    Tolerance,
    /// Load steps a leg.
    LoadSteps,
    /// Nested meshes of the reference.
    Reference,
    /// The paper's mesh and tolerance, and the recommended setting: everything at once.
    Combined,
}

/// Settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// What it varies.
    pub family: Family,
    /// Element.
    pub element: ElementChoice,
    /// Largest element edge, mm; `None`: the size rule.
    pub max_size_mm: Option<f64>,
    /// Each element of that mesh split into this many by this many.
    pub refined: usize,
    /// Tolerance of the residual.
    pub tolerance: f64,
    /// Load steps a leg.
    pub load_steps_per_leg: usize,
}

/// A run with its errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Its settings.
    #[serde(flatten)]
    pub setting: Setting,
    /// How it ended; errors are null unless `ok`.
    pub status: SceneStatus,
    /// Elements.
    pub elements: usize,
    /// Free displacement unknowns.
    pub dofs: usize,
    /// Factorisations of the path.
    pub factorisations: usize,
    /// CPU seconds of the whole solve.
    pub cpu_s: f64,
    /// Largest |u - u_ref| over the corners of the schedule, over the largest |u_ref|.
    pub tip_error: Option<f64>,
    /// |A - A_ref| / |A_ref|.
    pub area_error: Option<f64>,
    /// Whether no other run of the same family of runs is both cheaper and better.
    pub pareto: bool,
}

/// What errors are measured against.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reference {
    /// Displacement of the probe at the corners of the schedule, mm.
    pub tip_mm: Vec<[f64; 2]>,
    /// Its uncertainty over the largest displacement.
    pub tip_uncertainty: f64,
    /// Enclosed area, where the scene has that objective, mm^2.
    pub area_mm2: Option<f64>,
    /// Its relative uncertainty: of the meshes and of the load steps.
    pub area_uncertainty: Option<f64>,
    /// Observed order of the tip in the element size; `None` where the differences do not fall.
    pub tip_order: Option<f64>,
    /// Observed order of the area.
    pub area_order: Option<f64>,
    /// Observed order of the area in the load step.
    pub step_order: Option<f64>,
}

/// All runs with their reference and the cheapest setting for a wanted error.
#[derive(Clone, Debug, Serialize)]
pub struct Convergence {
    /// The wanted error.
    pub wanted: f64,
    /// The reference.
    pub reference: Reference,
    /// Every run.
    pub runs: Vec<Run>,
    /// The cheapest setting within the wanted error, run as such: the last of `runs`. `None` where none is good enough.
    pub recommended: Option<Run>,
}

/// Why a scene has no convergence study.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CannotConverge {
    /// A mesh file is one mesh.
    #[error("mesh_file: a convergence study needs a mesh that can be refined: give an actuator")]
    MeshFile,
    /// No probe.
    #[error("probes: a convergence study needs one")]
    NoProbe,
    /// A shape without a mesh.
    #[error("actuator: {0}")]
    Mesh(#[from] InfeasibleGeometry),
    /// The reference itself failed.
    #[error("the reference mesh (each element split {refined} by {refined}) ended with {status:?}")]
    Reference {
        /// Refinement.
        refined: usize,
        /// Its status.
        status: SceneStatus,
    },
    /// Faults of the scene.
    #[error(transparent)]
    Faults(#[from] Faults),
}

/// CPU seconds of one call, from the caller, who has a clock.
pub trait Clock: Observer {
    /// CPU seconds of this process.
    fn cpu_s(&self) -> f64;
    /// A run has ended.
    fn done(&mut self, run: &Run);
}

/// What a run says of the probe.
pub(super) struct Sample {
    corners: Vec<[f64; 2]>,
    area: Option<f64>,
}

/// Solves a scene in all families and measures their errors; `wanted` is the relative error that a recommendation must meet.
///
/// # Errors
/// Scenes without a refinable mesh or a probe, and references that do not converge.
pub fn converge(
    scene: &Scene,
    wanted: f64,
    clock: &mut dyn Clock,
) -> Result<Convergence, CannotConverge> {
    let Body::Actuator(chain) = &scene.body else {
        return Err(CannotConverge::MeshFile);
    };
    let probe = scene.probes.first().ok_or(CannotConverge::NoProbe)?;
    let probe = probe.name.clone();
    let scale = (chain.actuator.unit_mm[0] * chain.actuator.unit_mm[1]).sqrt() / 80.0;
    let base = Setting {
        family: Family::Reference,
        element: ElementChoice::Quad9,
        max_size_mm: None,
        refined: 1,
        tolerance: scene.relative_residual_force_tolerance,
        load_steps_per_leg: scene.actuation.load_steps_per_leg,
    };
    let mut bench = Bench::new(scene, &probe, clock);
    let mut nested = Vec::new();
    for refined in NESTED {
        let setting = Setting {
            refined,
            ..base.clone()
        };
        let sample = bench.solve(setting)?;
        nested.push(
            sample.ok_or(CannotConverge::Reference {
                refined,
                status: bench
                    .runs
                    .last()
                    .map_or(SceneStatus::NotConverged, |r| r.0.status),
            })?,
        );
    }
    for (element, sizes) in [
        (ElementChoice::Quad9, QUAD9_SIZES.as_slice()),
        (ElementChoice::Quad4, &QUAD4_SIZES),
    ] {
        for size in sizes {
            bench.solve(Setting {
                family: Family::Mesh,
                element,
                max_size_mm: size.map(|s| s * scale),
                ..base.clone()
            })?;
        }
    }
    for tolerance in TOLERANCES {
        bench.solve(Setting {
            family: Family::Tolerance,
            tolerance,
            ..base.clone()
        })?;
    }
    for load_steps_per_leg in STEPS {
        bench.solve(Setting {
            family: Family::LoadSteps,
            load_steps_per_leg,
            ..base.clone()
        })?;
    }
    bench.solve(Setting {
        family: Family::Combined,
        element: ElementChoice::Quad4,
        max_size_mm: Some(0.9 * scale),
        tolerance: 0.1,
        ..base.clone()
    })?;
    let reference = reference(&nested, &bench);
    let mut runs: Vec<Run> = bench.assess(&nested, &reference);
    let recommended = match recommend(&runs, wanted) {
        Some(setting) => {
            bench.solve(setting)?;
            runs = bench.assess(&nested, &reference);
            runs.last().cloned()
        }
        None => None,
    };
    mark_pareto(&mut runs);
    Ok(Convergence {
        wanted,
        reference,
        runs,
        recommended,
    })
}

pub(super) struct Bench<'a> {
    scene: &'a Scene,
    probe: &'a str,
    clock: &'a mut dyn Clock,
    runs: Vec<(Run, Option<Sample>)>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(scene: &'a Scene, probe: &'a str, clock: &'a mut dyn Clock) -> Self {
        Self {
            scene,
            probe,
            clock,
            runs: Vec::new(),
        }
    }

    /// Solves at a setting; `None` unless its path is complete.
    pub(super) fn solve(&mut self, setting: Setting) -> Result<Option<Sample>, CannotConverge> {
        let mut scene = self.scene.clone();
        scene.mesh.element = setting.element;
        scene.mesh.max_size_mm = setting.max_size_mm;
        scene.mesh.mean_size_mm = None;
        scene.relative_residual_force_tolerance = setting.tolerance;
        scene.actuation.load_steps_per_leg = setting.load_steps_per_leg;
        let plan = match &scene.body {
            Body::Actuator(chain) if setting.refined > 1 => Some(
                MeshPlan::choose(
                    &chain.actuator,
                    plan_element(setting.element),
                    setting.max_size_mm,
                )?
                .refined(setting.refined),
            ),
            _ => None,
        };
        let options = SceneOptions {
            plan,
            path_only: true,
            ..SceneOptions::default()
        };
        let before = self.clock.cpu_s();
        let answer = solve_scene(&scene, &options, self.clock)?.answer;
        let run = Run {
            setting,
            status: answer.status,
            elements: answer.mesh.elements,
            dofs: answer.mesh.dofs,
            factorisations: answer.work.factorisations,
            cpu_s: self.clock.cpu_s() - before,
            tip_error: None,
            area_error: None,
            pareto: false,
        };
        self.clock.done(&run);
        let sample = |answer: &SceneAnswer| Sample {
            corners: answer
                .path
                .iter()
                .filter(|state| state.fraction == 1.0)
                .filter_map(|state| state.displacement_mm.get(self.probe).copied())
                .collect(),
            area: answer.enclosed_area_mm2,
        };
        let complete = answer.status == SceneStatus::Ok;
        self.runs.push((run, complete.then(|| sample(&answer))));
        Ok(complete.then(|| sample(&answer)))
    }

    /// The area at a number of load steps, if that run was complete.
    fn area_at(&self, steps: usize) -> Option<f64> {
        let of_steps = |(run, _): &&(Run, Option<Sample>)| {
            run.setting.family == Family::LoadSteps && run.setting.load_steps_per_leg == steps
        };
        self.runs.iter().find(of_steps)?.1.as_ref()?.area
    }

    /// The runs with their errors. Each run differs from the base in some of mesh, tolerance and steps; its own error is
    /// that of its sample against the reference at its number of load steps, plus what those steps miss of the area.
    pub(super) fn assess(&self, nested: &[Sample], reference: &Reference) -> Vec<Run> {
        let largest = largest(&reference.tip_mm);
        let at_base = nested[0].area;
        self.runs
            .iter()
            .map(|(run, sample)| {
                let mut run = run.clone();
                let Some(sample) = sample else { return run };
                // Meshes and tolerances share the base's load steps, so that their reference has them too.
                run.tip_error = Some(
                    sample
                        .corners
                        .iter()
                        .zip(&reference.tip_mm)
                        .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
                        .fold(0.0, f64::max)
                        / largest,
                );
                run.area_error = match (run.setting.family, sample.area, reference.area_mm2) {
                    // Of the same mesh, so that its error is that of the load steps alone.
                    (Family::LoadSteps, Some(area), Some(_)) => self
                        .step_limit()
                        .map(|(limit, ..)| ((area - limit) / limit).abs()),
                    (Family::Tolerance, Some(area), Some(_)) => {
                        at_base.map(|base| ((area - base) / base).abs())
                    }
                    (Family::Combined, Some(area), Some(mesh)) => {
                        // The reference in the limit of the load steps.
                        let whole = match (self.step_limit(), at_base) {
                            (Some((limit, ..)), Some(base)) => mesh + limit - base,
                            _ => mesh,
                        };
                        Some(((area - whole) / whole).abs())
                    }
                    (_, Some(area), Some(mesh)) => Some(((area - mesh) / mesh).abs()),
                    _ => None,
                }
                // A path that encloses nothing has no relative error.
                .filter(|error: &f64| error.is_finite());
                if run.setting.family == Family::Tolerance
                    || run.setting.family == Family::LoadSteps
                {
                    run.tip_error = Some(
                        sample
                            .corners
                            .iter()
                            .zip(&nested[0].corners)
                            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
                            .fold(0.0, f64::max)
                            / largest,
                    );
                }
                run
            })
            .collect()
    }

    /// Limit of the area in the load step, the uncertainty of that limit, and the observed order.
    fn step_limit(&self) -> Option<(f64, f64, Option<f64>)> {
        let areas: Vec<f64> = STEPS[2..]
            .iter()
            .filter_map(|steps| self.area_at(*steps))
            .collect();
        let [coarse, mid, fine] = areas.try_into().ok()?;
        let (limit, uncertainty, order) = extrapolate(coarse, mid, fine);
        Some((limit, uncertainty, order))
    }
}

fn largest(tips: &[[f64; 2]]) -> f64 {
    tips.iter()
        .map(|t| t[0].hypot(t[1]))
        .fold(f64::MIN_POSITIVE, f64::max)
}

/// Richardson's limit of three values at h, h/2, h/4, its uncertainty and the observed order: with an order within
/// [`ORDERS`] [`known`] of it, else [`swing`].
fn extrapolate(coarse: f64, mid: f64, fine: f64) -> (f64, f64, Option<f64>) {
    if fine == mid {
        return (fine, 0.0, None);
    }
    match observed_order(coarse, mid, fine) {
        Some(order) if order >= ORDERS[0] => {
            let rest = (fine - mid) / (2_f64.powf(order.min(ORDERS[1])) - 1.0);
            (fine + rest, known(rest), Some(order))
        }
        _ => (fine, swing(coarse, mid, fine), None),
    }
}

/// Observed order q of three values at h, h/2, h/4: their differences fall as 2^q. `None` unless they have one sign.
pub(super) fn observed_order(coarse: f64, mid: f64, fine: f64) -> Option<f64> {
    let (first, second) = (mid - coarse, fine - mid);
    (first * second > 0.0).then(|| (first / second).log2())
}

/// Uncertainty of a value from which an extrapolation of known order says that `rest` is missing: Roache's 1.25 of it.
pub(super) fn known(rest: f64) -> f64 {
    1.25 * rest.abs()
}

/// Uncertainty of the last of three values without an order: three times their largest difference.
pub(super) fn swing(coarse: f64, mid: f64, fine: f64) -> f64 {
    3.0 * (mid - coarse).abs().max((fine - mid).abs())
}

pub(super) fn reference(nested: &[Sample], bench: &Bench<'_>) -> Reference {
    let [coarse, mid, fine] = nested else {
        unreachable!("three nested meshes");
    };
    let mut tip_mm = Vec::new();
    let mut uncertainty = 0.0_f64;
    // The order is that of the corner that moves most.
    let scale = largest(&fine.corners);
    let mut order = (0.0, None);
    for ((a, b), c) in coarse.corners.iter().zip(&mid.corners).zip(&fine.corners) {
        let each: [(f64, f64, Option<f64>); 2] =
            std::array::from_fn(|i| extrapolate(a[i], b[i], c[i]));
        tip_mm.push(each.map(|(limit, ..)| limit));
        uncertainty = uncertainty.max(each[0].1.hypot(each[1].1));
        for i in 0..2 {
            if c[i].abs() > order.0 {
                order = (c[i].abs(), each[i].2);
            }
        }
    }
    let area = match (coarse.area, mid.area, fine.area) {
        (Some(a), Some(b), Some(c)) => Some(extrapolate(a, b, c)),
        _ => None,
    };
    let steps = bench.step_limit();
    Reference {
        tip_mm,
        tip_uncertainty: uncertainty / scale,
        area_mm2: area.map(|(limit, ..)| limit),
        area_uncertainty: area.map(|(limit, own, _)| {
            (own + steps.map_or(0.0, |(_, uncertainty, _)| uncertainty)) / limit.abs()
        }),
        tip_order: order.1,
        area_order: area.and_then(|(_, _, order)| order),
        step_order: steps.and_then(|(_, _, order)| order),
    }
}

/// The larger of the two errors.
pub(super) fn error(run: &Run) -> Option<f64> {
    let tip = run.tip_error?;
    Some(run.area_error.map_or(tip, |area| area.max(tip)))
}

/// The cheapest mesh, the loosest tolerance and the fewest load steps whose errors together stay within the wanted one.
fn recommend(runs: &[Run], wanted: f64) -> Option<Setting> {
    let within = |family: Family, share: f64| {
        runs.iter()
            .filter(move |run| run.setting.family == family)
            .filter(move |run| error(run).is_some_and(|e| e <= share * wanted))
            .min_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s))
    };
    let tolerance = within(Family::Tolerance, TOLERANCE_SHARE)?;
    let steps = within(Family::LoadSteps, STEP_SHARE)?;
    let rest = 1.0
        - [tolerance, steps]
            .iter()
            .filter_map(|r| error(r))
            .sum::<f64>()
            / wanted;
    let mesh = within(Family::Mesh, rest)?;
    Some(Setting {
        family: Family::Combined,
        tolerance: tolerance.setting.tolerance,
        load_steps_per_leg: steps.setting.load_steps_per_leg,
        ..mesh.setting.clone()
    })
}

fn mark_pareto(runs: &mut [Run]) {
    let points: Vec<(Family, f64, Option<f64>)> = runs
        .iter()
        .map(|run| (run.setting.family, run.cpu_s, error(run)))
        .collect();
    for (run, (family, cpu, own)) in runs.iter_mut().zip(&points) {
        let Some(own) = own else { continue };
        run.pareto = !points.iter().any(|(other_family, other_cpu, other)| {
            other_family == family
                && other.is_some_and(|other| {
                    other_cpu <= cpu && other <= *own && (other_cpu < cpu || other < *own)
                })
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extrapolation_finds_limit_and_order() {
        for q in [1.0, 2.0, 3.3] {
            let at = |h: f64| 7.0 + 0.4 * h.powf(q);
            let (limit, uncertainty, order) = extrapolate(at(1.0), at(0.5), at(0.25));
            assert!((limit - 7.0).abs() < 1e-12);
            assert!((order.unwrap() - q).abs() < 1e-9);
            assert!(uncertainty > (at(0.25) - 7.0).abs() && uncertainty < 2.0 * (at(0.25) - 7.0));
        }
        // Values that swing have no order: the limit is the finest, within thrice the swing.
        let (limit, uncertainty, order) = extrapolate(1.0, 1.2, 1.1);
        assert!(order.is_none() && limit == 1.1 && (uncertainty - 0.6).abs() < 1e-12);
    }

    fn run(family: Family, cpu_s: f64, error: f64) -> Run {
        Run {
            setting: Setting {
                family,
                element: ElementChoice::Quad9,
                max_size_mm: Some(cpu_s),
                refined: 1,
                tolerance: cpu_s,
                load_steps_per_leg: cpu_s as usize,
            },
            status: SceneStatus::Ok,
            elements: 1,
            dofs: 1,
            factorisations: 1,
            cpu_s,
            tip_error: Some(error),
            area_error: Some(0.5 * error),
            pareto: false,
        }
    }

    #[test]
    fn the_cheapest_parts_that_share_the_error_are_recommended() {
        let mut runs = vec![
            run(Family::Mesh, 1.0, 0.02),
            run(Family::Mesh, 2.0, 0.0085),
            run(Family::Mesh, 3.0, 0.009),
            run(Family::Mesh, 9.0, 0.001),
            run(Family::Tolerance, 1.0, 0.0006),
            run(Family::Tolerance, 2.0, 0.0004),
            run(Family::LoadSteps, 1.0, 0.003),
            run(Family::LoadSteps, 4.0, 0.001),
        ];
        let setting = recommend(&runs, 0.01).unwrap();
        // 1 % - 0.04 % - 0.1 % are left to the mesh.
        assert_eq!(setting.max_size_mm, Some(2.0));
        assert_eq!((setting.tolerance, setting.load_steps_per_leg), (2.0, 4));
        assert!(recommend(&runs, 1e-4).is_none());
        mark_pareto(&mut runs);
        let front: Vec<bool> = runs[..4].iter().map(|r| r.pareto).collect();
        assert_eq!(front, [true, true, false, true]);
    }
}

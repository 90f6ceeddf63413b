//! The winners of a reproduction in one and the same model: nine units with Salp's elements, tolerance and contact, under the
//! schedule for which they were designed.

use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::{SceneAnswer, SceneOptions, SceneStatus, solve_scene};
use salp_core::material::MaterialLaw;
use salp_core::objective::enclosed_area::area;
use salp_core::scene::{Body, ContactMode, ElementChoice, Probe, Scene};
use serde::Serialize;

use crate::failure::Failure;
use crate::parallel::in_parallel;
use crate::shape::picture;

/// Units of the whole actuator, and the ends whose areas are compared.
pub const WHOLE: usize = 9;
pub const TIPS: [usize; 2] = [8, 9];
/// Longest element edge of a quick reproduction, mm.
pub const QUICK_SIZE_MM: f64 = 12.0;
/// Pressures at which reachability is looked at, in shares of the study's.
const SHARES: [f64; 7] = [0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4];

/// A winner on nine units.
#[derive(Clone, Debug, Serialize)]
pub struct Realised {
    /// How its path ended.
    pub status: SceneStatus,
    /// Enclosed areas of the ends of units 8 and 9, mm^2, counter-clockwise positive; where the path is complete.
    pub areas_mm2: Option<[f64; 2]>,
    /// Of three of its units, the end of unit 2; of copies of one unit alone.
    pub three_units_mm2: Option<f64>,
    /// Largest averaged stretch on nine units.
    pub max_stretch: f64,
    /// Free displacement unknowns of nine units.
    pub dofs: usize,
    /// Its picture.
    #[serde(skip)]
    pub svg: Option<String>,
}

/// A design's scene on a number of units, in Salp's settings; its free units stay where there are as many. `None` of a mesh file.
pub fn on(scene: &Scene, units: usize, quick: bool) -> Option<Scene> {
    let mut scene = scene.clone();
    let Body::Actuator(body) = &mut scene.body else {
        return None;
    };
    let width = body.actuator.unit_mm[0];
    let height = body.actuator.unit_mm[1];
    if body.actuator.units.len() != units {
        // Of units that differ the one in the middle, which has neighbours on both sides as most of the whole have.
        let middle = body.actuator.units.len() / 2;
        let unit = body.actuator.units.get(middle)?.clone();
        let law = *body.materials.get(middle)?;
        body.actuator.units = vec![unit; units];
        body.materials = vec![law; units];
        body.actuator.repeated = true;
    }
    let tips: &[usize] = if units == WHOLE { &TIPS } else { &[2] };
    scene.probes = tips
        .iter()
        .map(|unit| Probe {
            name: format!("unit-{unit}"),
            at_mm: [*unit as f64 * width, 0.5 * height],
        })
        .collect();
    scene.objective = None;
    scene.mesh.element = ElementChoice::Quad9;
    scene.mesh.max_size_mm = quick.then_some(QUICK_SIZE_MM);
    scene.mesh.mean_size_mm = None;
    scene.contact = ContactMode::Auto;
    scene.relative_residual_force_tolerance = 1e-8;
    Some(scene)
}

fn areas(scene: &Scene, answer: &SceneAnswer) -> Option<Vec<f64>> {
    let complete = answer.status == SceneStatus::Ok;
    let of = |probe: &Probe| {
        let states = answer.path.iter();
        let points: Vec<[f64; 2]> = states
            .filter_map(|state| state.displacement_mm.get(&probe.name).copied())
            .collect();
        area(&points)
    };
    complete.then(|| scene.probes.iter().map(of).collect())
}

/// Solves a winner on three and on nine units, and draws nine (Fig. 8 of the paper).
pub fn realise(title: &str, winner: &Scene, quick: bool) -> Result<Option<Realised>, Failure> {
    let Some(whole) = on(winner, WHOLE, quick) else {
        return Ok(None);
    };
    let options = SceneOptions {
        fields: true,
        ..SceneOptions::default()
    };
    let solution = solve_scene(&whole, &options, &mut Unobserved)?;
    let svg = solution.body.as_ref().map(|body| {
        let caption = ["nine units, elements quad9, contact, tolerance 1e-8".to_owned()];
        picture(title, &whole, &solution, body, &caption)
    });
    let found = areas(&whole, &solution.answer);
    let one_unit = matches!(&winner.body, Body::Actuator(body) if body.actuator.repeated);
    let three = match on(winner, 3, quick).filter(|_| one_unit) {
        Some(three) => {
            let answer = solve_scene(&three, &SceneOptions::default(), &mut Unobserved)?.answer;
            areas(&three, &answer).and_then(|areas| areas.first().copied())
        }
        None => None,
    };
    let stretches = solution.answer.path.iter().map(|s| s.max_stretch);
    Ok(Some(Realised {
        status: solution.answer.status,
        areas_mm2: found.and_then(|areas| <[f64; 2]>::try_from(areas).ok()),
        three_units_mm2: three,
        max_stretch: stretches.fold(1.0, f64::max),
        dofs: solution.answer.mesh.dofs,
        svg,
    }))
}

/// |A| of a design against p/mu.
#[derive(Clone, Debug, Serialize)]
pub struct Reach {
    /// Largest pressure over the shear modulus.
    pub p_over_mu: f64,
    /// On three units, the end of unit 2, mm^2; `None` without an equilibrium over the whole path.
    pub three_units_mm2: Option<f64>,
    /// On nine units, the end of unit 8.
    pub nine_units_mm2: Option<f64>,
}

/// Areas of a design at several p/mu: only that ratio matters.
pub fn reach(winner: &Scene, quick: bool, threads: usize) -> Result<Vec<Reach>, Failure> {
    let Body::Actuator(body) = &winner.body else {
        return Ok(Vec::new());
    };
    let Some(mu) = body.materials.first().map(MaterialLaw::shear_modulus_mpa) else {
        return Ok(Vec::new());
    };
    let pressure = winner.actuation.largest_kpa();
    let solve = |index: usize| -> Result<Reach, Failure> {
        let share = SHARES[index];
        let at = |units: usize| -> Result<Option<f64>, Failure> {
            let Some(mut scene) = on(winner, units, quick) else {
                return Ok(None);
            };
            scene.actuation = scene.actuation.scaled_to(share * pressure);
            let answer = solve_scene(&scene, &SceneOptions::default(), &mut Unobserved)?.answer;
            let areas = areas(&scene, &answer);
            Ok(areas.and_then(|areas| areas.first().map(|a| a.abs())))
        };
        Ok(Reach {
            p_over_mu: share * pressure * 1e-3 / mu,
            three_units_mm2: at(3)?,
            nine_units_mm2: at(WHOLE)?,
        })
    };
    let threads = threads.min(SHARES.len());
    let all = in_parallel(threads, SHARES.len(), solve, |_, _| ());
    all.into_iter().collect()
}

/// The p/mu at which a design passes an area, by linear interpolation between the ones that were solved; `None` where none of them
/// brackets it.
pub fn passes(reach: &[Reach], of: impl Fn(&Reach) -> Option<f64>, area: f64) -> Option<f64> {
    let rest = (0.0, 0.0);
    let points = reach.iter().filter_map(|r| Some((r.p_over_mu, of(r)?)));
    let points: Vec<(f64, f64)> = std::iter::once(rest).chain(points).collect();
    points.windows(2).find_map(|pair| {
        let [(p, a), (q, b)] = [pair[0], pair[1]];
        (a < area && area <= b).then(|| p + (q - p) * (area - a) / (b - a))
    })
}

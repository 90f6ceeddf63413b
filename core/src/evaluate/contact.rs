//! Contact of an evaluation: what is computed, and what is said of it.

use serde::Serialize;

use super::analysis::Measured;
use crate::fault::Faults;
use crate::mesh::{BoundaryLoop, Contact, Discretisation};
use crate::scene::{ContactMode, LEAST_ACTIVATION_MM, Scene};
use crate::study::Note;

/// What contact did over a path.
#[derive(Clone, Debug, Serialize)]
pub struct ContactAnswer {
    /// Surfaces farther apart than this do not act on each other, mm.
    pub activation_mm: f64,
    /// The first state of the path at which surfaces act.
    pub from: ContactFrom,
    /// Least distance of two points that act, away from corners that fold shut, mm; `None` where only such corners act.
    pub least_distance_mm: Option<f64>,
    /// How far surfaces have passed into each other, away from the very corners that fold shut, mm.
    pub penetration_mm: f64,
    /// Largest contact pressure, kPa.
    pub max_pressure_kpa: f64,
}

/// A place in the schedule.
#[derive(Clone, Debug, Serialize)]
pub struct ContactFrom {
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg.
    pub fraction: f64,
    /// Channel pressures, kPa.
    pub pressure_kpa: Vec<f64>,
}

/// Contact at a state.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactState {
    /// Least distance of two points that act, away from corners that fold shut, mm; `None` where only such corners act.
    pub least_distance_mm: Option<f64>,
    /// How far surfaces have passed into each other, mm.
    pub penetration_mm: f64,
    /// Largest contact pressure, MPa.
    pub pressure_mpa: f64,
    /// Energy of the contact, N mm per mm of depth.
    pub energy: f64,
    /// Force on each obstacle per mm of depth, N/mm.
    pub on_obstacle: Vec<[f64; 2]>,
}

/// Contact as a scene asks for it, in a body; a note where the activation distance was lowered.
///
/// # Errors
/// A gap of the reference shape narrower than twice the activation distance, where contact is on.
pub fn contact_of(
    mode: ContactMode,
    activation_mm: f64,
    body: &Discretisation,
) -> Result<(Option<Contact>, Option<Note>), Faults> {
    if mode == ContactMode::Off {
        return Ok((None, None));
    }
    let narrowest = narrowest_gap(body);
    let from_start = mode == ContactMode::On || !body.obstacles.is_empty();
    let contact = |activation_mm| {
        Some(Contact {
            activation_mm,
            from_start,
        })
    };
    if narrowest >= 2.0 * activation_mm {
        return Ok((contact(activation_mm), None));
    }
    if mode == ContactMode::On {
        let mut faults = Faults::default();
        faults.add(
            "contact_activation_mm",
            format!(
                "a void or gap of {narrowest:.3} mm is narrower than twice {activation_mm} mm: its sides would act on each other at rest"
            ),
        );
        return Err(faults);
    }
    let lowered = (0.5 * narrowest).max(LEAST_ACTIVATION_MM);
    let note = Note {
        about: "contact_activation_mm".to_owned(),
        message: format!(
            "contact: the activation distance is {lowered:.3} mm instead of {activation_mm} mm, half of the narrowest gap"
        ),
    };
    Ok((contact(lowered), Some(note)))
}

/// The same body with half of the activation distance, where the mode leaves that open, and the note that says so. Sides
/// of a crevice may catch on each other at one distance and not at another.
pub fn halved_activation(
    mode: ContactMode,
    body: &Discretisation,
) -> Option<(Discretisation, Note)> {
    let contact = body.contact.filter(|_| mode == ContactMode::Auto)?;
    let activation_mm = 0.5 * contact.activation_mm;
    let note = Note {
        about: "contact_activation_mm".to_owned(),
        message: format!(
            "contact: the activation distance is {activation_mm:.3} mm instead of {:.3} mm, with which no complete path was found",
            contact.activation_mm
        ),
    };
    let mut body = body.clone();
    body.contact = Some(Contact {
        activation_mm,
        ..contact
    });
    Some((body, note))
}

/// Contact as a study asks for it. The activation distance is the same for every design, however narrow its gaps, so that
/// objectives are smooth in the design: points act only where they have come much nearer than they were drawn.
pub fn contact_of_study(mode: ContactMode, activation_mm: f64) -> Option<Contact> {
    (mode != ContactMode::Off).then_some(Contact {
        activation_mm,
        from_start: mode == ContactMode::On,
    })
}

/// The contact of a path, where surfaces acted.
pub fn contact_answer(
    scene: &Scene,
    body: &Discretisation,
    states: &[Measured],
) -> Option<ContactAnswer> {
    let first = states.iter().find(|s| s.contact.is_some())?;
    let all = || states.iter().filter_map(|s| s.contact.as_ref());
    Some(ContactAnswer {
        activation_mm: body
            .contact
            .map_or(scene.contact_activation_mm, |c| c.activation_mm),
        from: ContactFrom {
            leg: first.point.leg,
            fraction: first.point.fraction,
            pressure_kpa: first.point.pressure_kpa.clone(),
        },
        least_distance_mm: all()
            .filter_map(|c| c.least_distance_mm)
            .min_by(f64::total_cmp),
        penetration_mm: all().fold(0.0, |m, c| m.max(c.penetration_mm)),
        max_pressure_kpa: all().fold(0.0, |m: f64, c| m.max(1e3 * c.pressure_mpa)),
    })
}

/// Least distance in the reference shape between sides of the boundary that bound the same gap and do not meet in a corner, mm.
/// Of a rim without corners it is the smaller side of its box. Sides that may not act on each other are no gap.
fn narrowest_gap(body: &Discretisation) -> f64 {
    let mut least = f64::INFINITY;
    let meet = |a: u64, b: u64| {
        let partners = body.partners.as_ref();
        partners.is_none_or(|partners| partners.meet(a, b))
    };
    for rim in &body.boundary {
        let points = side_points(rim, body);
        let sides = points.last().map_or(0, |p| p.side + 1);
        let is_void = signed_area(&points) < 0.0;
        if !is_void {
            continue;
        }
        if sides <= 1 {
            let extent = |i: usize| {
                let (low, high) = points
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                        (low.min(p.at[i]), high.max(p.at[i]))
                    });
                high - low
            };
            let groups = points.iter().fold(0, |all, p| all | p.groups);
            if meet(groups, groups) {
                least = least.min(extent(0).min(extent(1)));
            }
            continue;
        }
        for (k, p) in points.iter().enumerate() {
            for q in &points[k + 1..] {
                let apart = p.side.abs_diff(q.side);
                if apart.min(sides - apart) >= 2 && meet(p.groups, q.groups) {
                    least = least.min((p.at[0] - q.at[0]).hypot(p.at[1] - q.at[1]));
                }
            }
        }
    }
    least
}

/// A node of a rim.
struct SidePoint {
    /// Number of the side on which it lies; a corner belongs to the side that it begins.
    side: usize,
    at: [f64; 2],
    /// Groups of its edge.
    groups: u64,
}

/// Nodes of a rim in order.
fn side_points(rim: &BoundaryLoop, body: &Discretisation) -> Vec<SidePoint> {
    let first = rim.starts_at_corner.iter().position(|c| *c).unwrap_or(0);
    let count = rim.edges.len();
    let mut side = 0;
    let mut points = Vec::new();
    for k in 0..count {
        let index = (first + k) % count;
        if k > 0 && rim.starts_at_corner.get(index).copied().unwrap_or(false) {
            side += 1;
        }
        let e = &rim.edges[index];
        let groups = body.partners.as_ref().map_or(0, |p| p.groups(e));
        for node in [Some(e.ends[0]), e.mid].into_iter().flatten() {
            let at = body.mesh.nodes[node as usize];
            points.push(SidePoint { side, at, groups });
        }
    }
    points
}

fn signed_area(points: &[SidePoint]) -> f64 {
    let corners: Vec<[f64; 2]> = points.iter().map(|p| p.at).collect();
    crate::geometry::polygon::signed_area(&corners)
}

//! Notes of an answer: where the solid was stretched beyond what its laws are known for, or are stable to.

use super::analysis::Measured;
use crate::material::MaterialLaw;
use crate::material::stability::Stability;
use crate::scene::Body;
use crate::study::Note;

/// One note for each law and range that was left, at the first state where it was.
pub fn of_ranges(body: &Body, laws: &[MaterialLaw], states: &[Measured]) -> Vec<Note> {
    let mut notes = Vec::new();
    for (about, law, indices) in fields(body, laws) {
        let stretch = |s: &Measured| {
            indices
                .iter()
                .filter_map(|i| s.stretch_by_law.get(*i))
                .fold(1.0, |m: f64, l| m.max(*l))
        };
        let mut left = |limit: f64, what: &str| {
            if let Some(first) = states.iter().find(|s| stretch(s) > limit) {
                let largest = states.iter().map(stretch).fold(1.0, f64::max);
                notes.push(Note {
                    about: about.clone(),
                    message: format!(
                        "the averaged stretch is beyond {limit:.4}, {what}, from leg {}, fraction {:.4} on: largest {largest:.4}",
                        first.point.leg, first.point.fraction
                    ),
                });
            }
        };
        if let Some(range) = law.fit_stretch {
            left(range, "the end of the data behind the law");
        }
        if let Some((what, at)) = Stability::of(&law).lost_in_plane_strain() {
            left(at, &format!("where the law loses {what}"));
        }
    }
    notes
}

/// A note where corners have less than the radius that was asked for.
pub fn of_corners(body: &Body) -> Option<Note> {
    let Body::Actuator(chain) = body else {
        return None;
    };
    let wanted = chain.actuator.corner_radius_mm;
    let units = if chain.actuator.repeated {
        1
    } else {
        chain.actuator.units.len()
    };
    let radii: Vec<f64> = (0..units)
        .flat_map(|u| (0..chain.actuator.units[u].chambers_mm.len()).map(move |c| (u, c)))
        .flat_map(|(u, c)| chain.actuator.rounded(u, c).radii_mm())
        .collect();
    let smaller = radii.iter().filter(|r| **r < 0.999 * wanted).count();
    (smaller > 0).then(|| {
        let least = radii.iter().copied().fold(f64::INFINITY, f64::min);
        Note {
            about: "actuator.corner_radius_mm".into(),
            message: format!(
                "{smaller} of {} corners{} have no room for {wanted} mm; the least radius is {least:.3} mm",
                radii.len(),
                if units == 1 && chain.actuator.repeated { " of a unit" } else { "" }
            ),
        }
    })
}

/// Each law with the field that gives it and its indices.
fn fields(body: &Body, laws: &[MaterialLaw]) -> Vec<(String, MaterialLaw, Vec<usize>)> {
    if let [first, rest @ ..] = laws
        && rest.iter().all(|l| l == first)
    {
        return vec![("material".to_owned(), *first, (0..laws.len()).collect())];
    }
    let name = |i: usize| match body {
        Body::Actuator(_) => format!("unit_materials[{i}]"),
        Body::MeshFile(_) if i == 0 => "material".to_owned(),
        Body::MeshFile(file) => {
            let entry = file.materials.iter().position(|m| m.material == laws[i]);
            format!("materials[{}].material", entry.unwrap_or(0))
        }
    };
    laws.iter()
        .enumerate()
        .map(|(i, law)| (name(i), *law, vec![i]))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use serde_json::{Value, json};

    use crate::equilibrium::Unobserved;
    use crate::evaluate::{SceneAnswer, SceneOptions, StateAnswer, solve_scene};
    use crate::scene::read_scene;

    /// Two units under a strong pressure, each of its own law.
    fn answer(first: &Value, second: &Value) -> SceneAnswer {
        let document = json!({
            "version": 1,
            "actuator": {"repeat": 2, "chambers_mm": [[[20, 5], [60, 5], [60, 35], [20, 35]]]},
            "unit_materials": [first, second],
            "actuation": {"schedule": "ramp", "pressure_kpa": 20, "load_steps_per_leg": 4},
            "mesh": {"element": "quad4", "max_size_mm": 5},
            "contact": "off",
            "probes": {"tip": [160, 40]}
        });
        let scene = read_scene(&document, Path::new("")).unwrap_or_else(|f| panic!("{f}"));
        let options = SceneOptions::default();
        solve_scene(&scene, &options, &mut Unobserved)
            .unwrap_or_else(|f| panic!("{f}"))
            .answer
    }

    fn neo_hookean(c10_mpa: f64, fit_stretch: f64) -> Value {
        json!({"model": "neo_hookean", "c10_mpa": c10_mpa, "fit_stretch": fit_stretch})
    }

    #[test]
    fn a_range_that_is_left_is_noted_for_the_unit_that_left_it() {
        let stretch = |a: &SceneAnswer| a.path.last().map_or(1.0, |s| s.max_stretch);
        let quiet = answer(&neo_hookean(0.2, 3.0), &neo_hookean(0.2, 3.0));
        assert!(quiet.notes.is_empty() && stretch(&quiet) > 1.03);
        // The second unit is ten times as stiff: only the first reaches the end of its range.
        let range = 1.0 + 0.5 * (stretch(&quiet) - 1.0);
        let noted = answer(&neo_hookean(0.2, range), &neo_hookean(2.0, range));
        let about: Vec<&str> = noted.notes.iter().map(|n| n.about.as_str()).collect();
        assert_eq!(about, ["unit_materials[0]"]);
        assert!(noted.notes[0].message.contains("leg 0"));
        // One law for all is named once.
        let both = answer(&neo_hookean(0.2, range), &neo_hookean(0.2, range));
        assert_eq!(both.notes.len(), 1);
        assert_eq!(both.notes[0].about, "material");
    }

    #[test]
    fn a_radius_without_room_is_noted_and_rounding_changes_the_answer() {
        let answer = |radius: f64| {
            let document = json!({
                "version": 1,
                "actuator": {
                    "chambers_mm": [[[20, 5], [60, 5], [60, 35], [20, 35]], [[20, 45], [23, 45], [23, 75], [20, 75]]],
                    "corner_radius_mm": radius
                },
                "material": neo_hookean(0.2, 9.0),
                "actuation": {"schedule": "hold", "pressure_kpa": 5, "load_steps_per_leg": 2},
                "mesh": {"element": "quad9"},
                "contact": "off",
                "probes": {"tip": [80, 40]}
            });
            let scene = read_scene(&document, Path::new("")).unwrap_or_else(|f| panic!("{f}"));
            let options = SceneOptions::default();
            let found = solve_scene(&scene, &options, &mut Unobserved);
            found.unwrap_or_else(|f| panic!("{f}")).answer
        };
        let tip = |a: &SceneAnswer| {
            let reach = |s: &StateAnswer| s.displacement_mm["tip"][1].abs();
            a.path.iter().map(reach).fold(0.0, f64::max)
        };
        let [sharp, small, large] = [0.0, 0.3, 3.0].map(answer);
        assert!(sharp.notes.is_empty() && small.notes.is_empty());
        assert_eq!(large.notes.len(), 1);
        assert_eq!(large.notes[0].about, "actuator.corner_radius_mm");
        // Both chambers' radii shrink: 3 mm fit into the corners of the first alone.
        assert!(
            large.notes[0].message.contains("4 of 8 corners"),
            "{:?}",
            large.notes
        );
        let change = |a: &SceneAnswer| (tip(a) / tip(&sharp) - 1.0).abs();
        assert!(
            change(&small) < 0.03 && (0.1..0.2).contains(&change(&large)),
            "{} {}",
            change(&small),
            change(&large)
        );
        assert_eq!(small.resolved["actuator"]["corner_radius_mm"], json!(0.3));
    }

    #[test]
    fn a_stiff_unit_bends_less_and_an_ogden_twin_changes_nothing() {
        let tip = |a: &SceneAnswer| a.path.last().map_or([0.0; 2], |s| s.displacement_mm["tip"]);
        let soft = neo_hookean(0.2, 3.0);
        let twin = json!({"model": "ogden", "form": "a", "mu_mpa": [0.4], "alpha": [2]});
        let (one, other) = (tip(&answer(&soft, &soft)), tip(&answer(&soft, &twin)));
        assert!(one[1].abs() > 0.1);
        for i in 0..2 {
            assert!(
                (one[i] - other[i]).abs() <= 1e-7 * one[1].abs(),
                "{one:?} {other:?}"
            );
        }
        let stiff = tip(&answer(&soft, &neo_hookean(2.0, 3.0)));
        assert!(stiff[1].abs() < 0.99 * one[1].abs());
        // In the other order the tip moves by another amount: each element has its own unit's law.
        let swapped = tip(&answer(&neo_hookean(2.0, 3.0), &soft));
        assert!((swapped[1] - stiff[1]).abs() > 1e-3 * one[1].abs());
    }
}

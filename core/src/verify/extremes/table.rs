//! The table of extreme scenes.
//!
//! Limits in it are estimates of membranes of neo-Hookean rubber, mu = 0.22 MPa, in plane strain, wall t:
//! a closed membrane of perimeter 2 pi R tends to p = mu t / R; one of length L between rigid ends to 2 pi mu t / L; a hole
//! in a solid, inner and outer radius A and B, to p = mu ln(B/A). Where a scene's own frame is soft the limit was found once
//! by two elements on two meshes, as said there.

use serde_json::{Value, json};

use super::{Against, Expected, Extreme};

/// mu = 0.22 MPa, K/mu = 1000.
const SOFT: &str = "mold-star-30-soft";
/// Limit of `thin-76x37`, kPa: 13.6 to 13.9 on several meshes of either element.
const THIN_LIMIT_KPA: f64 = 13.75;

fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Value {
    json!([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
}

/// 40 x 15 mm at the middle of each domain of the paper's unit.
fn moderate() -> Value {
    json!([rectangle(20., 13., 60., 28.), rectangle(20., 52., 60., 67.)])
}

/// Two chambers that leave walls of this thickness to the outline and between them.
fn walls(t: f64) -> Value {
    let middle = 40.0 - 0.5 * t;
    json!([
        rectangle(t, t, 80. - t, middle),
        rectangle(t, 80. - middle, 80. - t, 80. - t)
    ])
}

/// A chamber of this size in the middle of a unit.
fn central(width: f64, height: f64) -> Value {
    let (w, h) = (0.5 * width, 0.5 * height);
    json!([rectangle(40. - w, 40. - h, 40. + w, 40. + h)])
}

fn neo_hookean(c10_mpa: f64, bulk_over_shear: f64) -> Value {
    json!({"model": "neo_hookean", "c10_mpa": c10_mpa, "bulk_over_shear": bulk_over_shear})
}

fn scene(units: usize, chambers: &Value, schedule: &Value) -> Value {
    json!({
        "version": 1,
        "actuator": {"repeat": units, "chambers_mm": chambers},
        "material": SOFT,
        "actuation": {"schedule": schedule, "load_steps_per_leg": 2},
        "mesh": {},
        "contact": "off",
        "probes": {"tip": [80 * units, 40]}
    })
}

fn ok(group: &'static str, name: String, scene: Value, why: &'static str) -> Extreme {
    Extreme {
        group,
        name,
        scene,
        expected: Expected::Ok,
        why,
        against: Against::OtherSteps(3),
    }
}

fn limit(
    group: &'static str,
    name: String,
    scene: Value,
    (pressure_kpa, within): (f64, f64),
    why: &'static str,
) -> Extreme {
    Extreme {
        group,
        name,
        scene,
        expected: Expected::NoEquilibrium {
            pressure_kpa,
            within,
        },
        why,
        against: Against::Limit,
    }
}

/// All extreme scenes.
pub fn extremes() -> Vec<Extreme> {
    let mut list = bulk_moduli();
    list.extend(contrasts());
    list.extend(wall_thicknesses());
    list.extend(chamber_sizes());
    list.extend(aspect_ratios());
    list.extend(pressures());
    list.extend(load_steps());
    list.extend(unit_counts());
    list
}

fn bulk_moduli() -> Vec<Extreme> {
    let mut list = Vec::new();
    for exponent in 2..=6 {
        let bulk = 10_f64.powi(exponent);
        for (what, chambers, schedule) in [
            ("40 x 15 mm, 15 kPa", moderate(), json!([[0, 0], [15, 0]])),
            ("walls of 2 mm, 8 kPa", walls(2.), json!([[0, 0], [8, 0]])),
        ] {
            let mut scene = scene(1, &chambers, &schedule);
            scene["material"] = neo_hookean(0.11, bulk);
            list.push(Extreme {
                against: Against::Incompressible { slope: 10. },
                ..ok(
                    "K/mu",
                    format!("1e{exponent}, {what}"),
                    scene,
                    "far below every limit; a bulk modulus changes an answer by its inverse, not whether there is one",
                )
            });
        }
    }
    list
}

fn contrasts() -> Vec<Extreme> {
    let mut list = Vec::new();
    for contrast in [1., 10., 100., 1e3, 1e4] {
        let (soft, stiff) = (
            neo_hookean(0.11, 1000.),
            neo_hookean(0.11 * contrast, 1000.),
        );
        for (what, materials) in [
            ("one soft unit between stiff ones", [&stiff, &soft, &stiff]),
            ("one stiff unit between soft ones", [&soft, &stiff, &soft]),
        ] {
            let mut scene = scene(3, &moderate(), &json!([[0, 0], [15, 0]]));
            scene["unit_materials"] = json!(materials);
            list.push(ok(
                "stiffness contrast",
                format!("{contrast:e}, {what}"),
                scene,
                "stiffening a unit takes no equilibrium away",
            ));
        }
    }
    list
}

fn wall_thicknesses() -> Vec<Extreme> {
    let mut list = Vec::new();
    for (t, safe, beyond) in [(0.5, 5., 60.), (1., 10., 120.), (2., 15., 240.)] {
        let chamber = json!([rectangle(20., t, 60., 20. + t)]);
        list.push(ok(
            "wall",
            format!("{t} mm outside, {safe} kPa"),
            scene(1, &chamber, &json!([[0], [safe]])),
            "less than half of the membrane's asymptote 2 pi mu t / L, L = 40 mm",
        ));
        // Between rigid ends 17.3 t / (0.5 mm) kPa; at an averaged stretch of 6, where an asymptote is told, 86 % of it, and
        // the corners give way.
        list.push(limit(
            "wall",
            format!("{t} mm outside, {beyond} kPa"),
            scene(1, &chamber, &json!([[0], [beyond]])),
            (27.4 * t, 0.2),
            "3.5 times the membrane's asymptote 2 pi mu t / L, which it reaches to 86 % at a stretch of 6",
        ));
    }
    for t in [5., 10., 20.] {
        let chamber = json!([rectangle(20., t, 60., 20. + t)]);
        list.push(ok(
            "wall",
            format!("{t} mm outside, 15 kPa"),
            scene(1, &chamber, &json!([[0], [15]])),
            "less than a tenth of the membrane's asymptote 2 pi mu t / L",
        ));
    }
    list.push(ok(
        "wall",
        "0.5 mm all around, 1 kPa".into(),
        scene(1, &walls(0.5), &json!([[0, 0], [1, 0]])),
        "a quarter of the limit of 76 x 37 mm scaled by thickness over width",
    ));
    list.push(limit(
        "wall",
        "0.5 mm all around, 15 kPa".into(),
        scene(1, &walls(0.5), &json!([[0, 0], [15, 0]])),
        (4.0, 0.25),
        "4 times the limit of 76 x 37 mm scaled by thickness over width, 3.3 kPa, and less than half of 2 pi mu t / L = 8.7 kPa",
    ));
    let hole = central(4., 4.);
    list.push(ok(
        "wall",
        "38 mm all around, 15 kPa".into(),
        scene(1, &hole, &json!([[0], [15]])),
        "a fortieth of mu ln(B/A)",
    ));
    list.push(limit(
        "wall",
        "38 mm all around, 2000 kPa".into(),
        scene(1, &hole, &json!([[0], [2000]])),
        (659., 0.15),
        "3 times mu ln(B/A) = 659 kPa of circles of the same areas",
    ));
    list
}

fn chamber_sizes() -> Vec<Extreme> {
    let mut list = Vec::new();
    for size in [0.01, 0.1, 1., 10., 30.] {
        let h = 0.5 * size;
        let at = |y: f64| rectangle(40. - h, y - h, 40. + h, y + h);
        list.push(ok(
            "chamber",
            format!("{size} x {size} mm, 15 kPa"),
            scene(1, &json!([at(20.5), at(59.5)]), &json!("hold")),
            "a hole opens at p = mu ln(B/A) or more, 5 times the pressure at least",
        ));
    }
    list.push(ok(
        "chamber",
        "76 x 37 mm, 1.5 kPa".into(),
        scene(
            1,
            &walls(2.),
            &json!([[0, 0], [1.5, 0], [1.5, 1.5], [0, 0]]),
        ),
        "a ninth of the limit 13.75 kPa",
    ));
    list.push(ok(
        "chamber",
        "76 x 76 mm, 1.5 kPa".into(),
        scene(1, &central(76., 76.), &json!([[0], [1.5]])),
        "a sixth of the closed membrane's mu t / R = 9.1 kPa",
    ));
    list
}

fn aspect_ratios() -> Vec<Extreme> {
    let mut list = Vec::new();
    for (width, height) in [(70., 7.), (7., 70.), (70., 0.7), (0.7, 70.), (20., 0.2)] {
        list.push(ok(
            "aspect ratio",
            format!("chamber of {width} x {height} mm, 15 kPa"),
            scene(1, &central(width, height), &json!([[0], [15]])),
            "walls of 5 mm and more: a tenth of 2 pi mu t / L or less",
        ));
    }
    for (pressure, name) in [
        (1.7, "chamber of 200 x 2 mm between walls of 1 mm, 1.7 kPa"),
        (10., "chamber of 200 x 2 mm between walls of 1 mm, 10 kPa"),
    ] {
        let mut scene = scene(
            1,
            &json!([rectangle(10., 1., 210., 3.)]),
            &json!([[0], [pressure]]),
        );
        scene["actuator"]["unit_mm"] = json!([220, 4]);
        scene["probes"] = json!({"tip": [220, 2]});
        list.push(if pressure < 3. {
            ok(
                "aspect ratio",
                name.into(),
                scene,
                "half of the closed membrane's mu t / R = 3.42 kPa, R = 404 mm / (2 pi)",
            )
        } else {
            limit(
                "aspect ratio",
                name.into(),
                scene,
                (3.42, 0.2),
                "3 times the closed membrane's mu t / R = 3.42 kPa, R = 404 mm / (2 pi)",
            )
        });
    }
    list
}

fn pressures() -> Vec<Extreme> {
    let mut list = Vec::new();
    for factor in [0.25, 0.5, 0.9] {
        list.push(ok(
            "pressure",
            format!("{factor} of the limit of 76 x 37 mm, three units"),
            scene(
                3,
                &walls(2.),
                &json!([[0, 0], [factor * THIN_LIMIT_KPA, 0]]),
            ),
            "below the limit, 13.6 to 13.9 kPa by either element on two meshes",
        ));
    }
    for factor in [1.1, 1.5, 2., 3.] {
        list.push(limit(
            "pressure",
            format!("{factor} of the limit of 76 x 37 mm, three units"),
            scene(
                3,
                &walls(2.),
                &json!([[0, 0], [factor * THIN_LIMIT_KPA, 0]]),
            ),
            (THIN_LIMIT_KPA, 0.02),
            "the limit does not depend on the pressure that is aimed at",
        ));
    }
    list
}

fn load_steps() -> Vec<Extreme> {
    [1, 2, 3, 10, 30, 100]
        .into_iter()
        .map(|steps| {
            let bellows = json!([rectangle(15., 2., 65., 39.), rectangle(15., 41., 65., 78.)]);
            let mut scene = scene(1, &bellows, &json!("hold"));
            scene["actuation"]["load_steps_per_leg"] = json!(steps);
            Extreme {
                against: Against::OtherSteps(5),
                ..ok(
                    "load steps",
                    format!("{steps} a leg, 50 x 37 mm, 15 kPa"),
                    scene,
                    "its equilibrium depends on the pressures alone",
                )
            }
        })
        .collect()
}

fn unit_counts() -> Vec<Extreme> {
    [1, 2, 3, 9, 30]
        .into_iter()
        .map(|units| {
            ok(
                "units",
                format!("{units}, 40 x 15 mm, 15 kPa"),
                scene(units, &moderate(), &json!([[0, 0], [15, 0]])),
                "a chain without weight is as strong as one unit",
            )
        })
        .collect()
}

//! Material laws in documents: a record's name, or a law with its parameters.

use serde_json::{Map, Value, json};

use super::actuator::MAX_UNITS;
use crate::document::{Node, Object};
use crate::material::ogden::{MAX_EXPONENT, MAX_TERMS};
use crate::material::records::{self, DEFAULT_BULK_OVER_SHEAR};
use crate::material::stability::{SEARCHED_STRETCH, Stability};
use crate::material::{HyperelasticModel, MaterialLaw, Ogden, OgdenForm, OgdenTerm};

const LARGEST_MPA: f64 = 1e9;
/// Fields of every law.
const COMMON: [&str; 3] = ["model", "bulk_over_shear", "fit_stretch"];

/// Reads a record's name or a full law.
pub fn read_material(node: &Node<'_>) -> Option<MaterialLaw> {
    if let Some(name) = node.value().as_str() {
        return match records::find(name) {
            Some(record) => Some(record.law),
            None => node.fault(unknown_record(name)),
        };
    }
    let object = node.open()?;
    let name = object.required("model").and_then(|m| {
        let name = m.text()?;
        match name {
            "neo_hookean" | "mooney_rivlin" | "yeoh" | "ogden" => Some(name),
            _ => m.fault(format!(
                "expected \"neo_hookean\", \"mooney_rivlin\", \"yeoh\" or \"ogden\", found \"{name}\""
            )),
        }
    });
    let model = name.and_then(|name| match name {
        "neo_hookean" => neo_hookean(&object),
        "mooney_rivlin" => mooney_rivlin(&object),
        "yeoh" => yeoh(&object),
        _ => ogden(&object),
    });
    let bulk_over_shear = object.or("bulk_over_shear", DEFAULT_BULK_OVER_SHEAR, bulk_over_shear);
    let fit_stretch = object.optional("fit_stretch", fit_stretch);
    let law = MaterialLaw {
        model: model?,
        bulk_over_shear: bulk_over_shear?,
        fit_stretch: fit_stretch?,
    };
    check_stability(&object, &law)?;
    Some(law)
}

/// Reads a list with one entry for each unit; `units` is `None` where their number could not be read.
pub fn read_per_unit<T>(
    node: &Node<'_>,
    units: Option<usize>,
    read: impl FnMut(&Node<'_>) -> Option<T>,
) -> Option<Vec<T>> {
    let entries = node.each(0, MAX_UNITS, read);
    let given = node.value().as_array()?.len();
    if let Some(units) = units
        && given != units
    {
        return node.fault(format!(
            "expected one material for each of the {units} units, found {given}"
        ));
    }
    entries
}

/// A law that is unstable within the range that its own document claims is a fault.
fn check_stability(object: &Object<'_>, law: &MaterialLaw) -> Option<()> {
    let Some(range) = law.fit_stretch else {
        return Some(());
    };
    match Stability::of(law).lost_within(range) {
        None => Some(()),
        Some((what, at)) => {
            object.fault(
                "fit_stretch",
                format!("the law loses {what} at stretch {at:.4}, within its range up to {range}"),
            );
            None
        }
    }
}

/// The message for a record's name that nobody knows.
pub fn unknown_record(name: &str) -> String {
    let names: Vec<_> = records::RECORDS.iter().map(|r| r.name).collect();
    format!(
        "no record is named \"{name}\"; there are {}",
        names.join(", ")
    )
}

/// The document form of a law; [`read_material`] reads it back to the same law.
pub fn material_document(law: &MaterialLaw) -> Value {
    let mut map = match law.model {
        HyperelasticModel::NeoHookean { c10_mpa } => {
            fields(&[("model", json!("neo_hookean")), ("c10_mpa", json!(c10_mpa))])
        }
        HyperelasticModel::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            c20_mpa,
        } => fields(&[
            ("model", json!("mooney_rivlin")),
            ("c10_mpa", json!(c10_mpa)),
            ("c01_mpa", json!(c01_mpa)),
            ("c20_mpa", json!(c20_mpa)),
        ]),
        HyperelasticModel::Yeoh { c_mpa } => {
            fields(&[("model", json!("yeoh")), ("c_mpa", json!(c_mpa))])
        }
        HyperelasticModel::Ogden(ogden) => {
            let list =
                |of: fn(&OgdenTerm) -> f64| json!(ogden.terms().iter().map(of).collect::<Vec<_>>());
            fields(&[
                ("model", json!("ogden")),
                ("form", json!(ogden.form)),
                ("mu_mpa", list(|t| t.mu_mpa)),
                ("alpha", list(|t| t.alpha)),
            ])
        }
    };
    map.insert("bulk_over_shear".into(), json!(law.bulk_over_shear));
    if let Some(stretch) = law.fit_stretch {
        map.insert("fit_stretch".into(), json!(stretch));
    }
    Value::Object(map)
}

fn fields(list: &[(&str, Value)]) -> Map<String, Value> {
    list.iter()
        .map(|(name, value)| ((*name).to_string(), value.clone()))
        .collect()
}

fn bulk_over_shear(node: &Node<'_>) -> Option<f64> {
    let v = node.positive()?;
    node.expect(v <= 1e9, "must be at most 1e9")?;
    Some(v)
}

fn fit_stretch(node: &Node<'_>) -> Option<f64> {
    let v = node.number()?;
    node.expect(
        v > 1.0 && v <= SEARCHED_STRETCH,
        &format!("a range of stretch ends above 1 and at most at {SEARCHED_STRETCH}, found {v}"),
    )?;
    Some(v)
}

fn allow(object: &Object<'_>, own: &[&str]) {
    object.allow(&[&COMMON[..1], own, &COMMON[1..]].concat());
}

fn modulus(object: &Object<'_>, name: &str) -> Option<f64> {
    let node = object.required(name)?;
    let v = node.positive()?;
    node.expect(v <= LARGEST_MPA, "must be at most 1e9 MPa")?;
    Some(v)
}

fn neo_hookean(object: &Object<'_>) -> Option<HyperelasticModel> {
    allow(object, &["c10_mpa"]);
    Some(HyperelasticModel::NeoHookean {
        c10_mpa: modulus(object, "c10_mpa")?,
    })
}

fn mooney_rivlin(object: &Object<'_>) -> Option<HyperelasticModel> {
    allow(object, &["c10_mpa", "c01_mpa", "c20_mpa"]);
    let c10 = object.required("c10_mpa").and_then(|n| n.number());
    let c01 = object.required("c01_mpa").and_then(|n| n.number());
    let c20 = object.or("c20_mpa", 0.0, Node::number);
    let (c10_mpa, c01_mpa, c20_mpa) = (c10?, c01?, c20?);
    let mu = 2.0 * (c10_mpa + c01_mpa);
    object.node().expect(
        mu > 0.0 && mu <= 2.0 * LARGEST_MPA,
        &format!("the shear modulus mu = 2 (c10 + c01) must be above zero, found {mu} MPa"),
    )?;
    Some(HyperelasticModel::MooneyRivlin {
        c10_mpa,
        c01_mpa,
        c20_mpa,
    })
}

fn yeoh(object: &Object<'_>) -> Option<HyperelasticModel> {
    allow(object, &["c_mpa"]);
    let node = object.required("c_mpa")?;
    let c = node.numbers(3, 3)?;
    node.expect(
        c[0] > 0.0 && c[0] <= LARGEST_MPA,
        &format!(
            "the shear modulus mu = 2 C1 must be above zero, found {} MPa",
            2.0 * c[0]
        ),
    )?;
    Some(HyperelasticModel::Yeoh {
        c_mpa: [c[0], c[1], c[2]],
    })
}

fn ogden(object: &Object<'_>) -> Option<HyperelasticModel> {
    allow(object, &["form", "mu_mpa", "alpha"]);
    let form = object
        .required("form")
        .and_then(|n| n.choice(&[("m", OgdenForm::M), ("a", OgdenForm::A)]));
    let mu = object
        .required("mu_mpa")
        .and_then(|n| n.each(1, MAX_TERMS, |n| n.number_in(-LARGEST_MPA, LARGEST_MPA)));
    let alpha = object
        .required("alpha")
        .and_then(|n| n.each(1, MAX_TERMS, exponent));
    let (form, mu, alpha) = (form?, mu?, alpha?);
    if mu.len() != alpha.len() {
        object.fault(
            "alpha",
            format!(
                "expected one exponent for each of the {} moduli, found {}",
                mu.len(),
                alpha.len()
            ),
        );
        return None;
    }
    let terms: Vec<OgdenTerm> = mu
        .into_iter()
        .zip(alpha)
        .map(|(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha })
        .collect();
    let law = Ogden::new(form, &terms)?;
    let mu = law.shear_modulus_mpa();
    if mu <= 0.0 {
        let relation = match form {
            OgdenForm::M => "sum mu_p alpha_p / 2 in form m",
            OgdenForm::A => "sum mu_p in form a",
        };
        object.fault(
            "mu_mpa",
            format!("the shear modulus mu = {relation} must be above zero, found {mu} MPa"),
        );
        return None;
    }
    Some(HyperelasticModel::Ogden(law))
}

fn exponent(node: &Node<'_>) -> Option<f64> {
    let alpha = node.number()?;
    node.expect(
        (1e-3..=MAX_EXPONENT).contains(&alpha.abs()),
        &format!("an exponent is not zero and at most {MAX_EXPONENT} in size (at least 0.001), found {alpha}"),
    )?;
    Some(alpha)
}

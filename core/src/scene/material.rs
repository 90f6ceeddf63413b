//! Material laws in documents: a record's name, or a law with its parameters.

use serde_json::{Map, Value, json};

use crate::document::{Node, Object};
use crate::material::records::{self, DEFAULT_BULK_OVER_SHEAR};
use crate::material::{HyperelasticModel, MaterialLaw};

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
            "neo_hookean" | "mooney_rivlin" | "yeoh" => Some(name),
            "ogden" => m.fault("\"ogden\" is not supported yet"),
            _ => m.fault(format!(
                "expected \"neo_hookean\", \"mooney_rivlin\", \"yeoh\" or \"ogden\", found \"{name}\""
            )),
        }
    });
    let Some(name) = name else {
        object.or("bulk_over_shear", 0.0, bulk_over_shear);
        return None;
    };
    let model = match name {
        "neo_hookean" => neo_hookean(&object),
        "mooney_rivlin" => mooney_rivlin(&object),
        _ => yeoh(&object),
    };
    let bulk_over_shear = object.or("bulk_over_shear", DEFAULT_BULK_OVER_SHEAR, bulk_over_shear);
    Some(MaterialLaw {
        model: model?,
        bulk_over_shear: bulk_over_shear?,
    })
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
    };
    map.insert("bulk_over_shear".into(), json!(law.bulk_over_shear));
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

fn modulus(object: &Object<'_>, name: &str) -> Option<f64> {
    let node = object.required(name)?;
    let v = node.positive()?;
    node.expect(v <= 1e9, "must be at most 1e9 MPa")?;
    Some(v)
}

fn neo_hookean(object: &Object<'_>) -> Option<HyperelasticModel> {
    object.allow(&["model", "c10_mpa", "bulk_over_shear"]);
    Some(HyperelasticModel::NeoHookean {
        c10_mpa: modulus(object, "c10_mpa")?,
    })
}

fn mooney_rivlin(object: &Object<'_>) -> Option<HyperelasticModel> {
    object.allow(&["model", "c10_mpa", "c01_mpa", "c20_mpa", "bulk_over_shear"]);
    let c10 = object.required("c10_mpa").and_then(|n| n.number());
    let c01 = object.required("c01_mpa").and_then(|n| n.number());
    let c20 = object.or("c20_mpa", 0.0, Node::number);
    let (c10_mpa, c01_mpa, c20_mpa) = (c10?, c01?, c20?);
    let mu = 2.0 * (c10_mpa + c01_mpa);
    object.node().expect(
        mu > 0.0 && mu <= 2e9,
        &format!("the shear modulus mu = 2 (c10 + c01) must be above zero, found {mu} MPa"),
    )?;
    Some(HyperelasticModel::MooneyRivlin {
        c10_mpa,
        c01_mpa,
        c20_mpa,
    })
}

fn yeoh(object: &Object<'_>) -> Option<HyperelasticModel> {
    object.allow(&["model", "c_mpa", "bulk_over_shear"]);
    let node = object.required("c_mpa")?;
    let c = node.numbers(3, 3)?;
    node.expect(
        c[0] > 0.0 && c[0] <= 1e9,
        &format!(
            "the shear modulus mu = 2 C1 must be above zero, found {} MPa",
            2.0 * c[0]
        ),
    )?;
    Some(HyperelasticModel::Yeoh {
        c_mpa: [c[0], c[1], c[2]],
    })
}

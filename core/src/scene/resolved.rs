//! A scene as the document that reads back to it: what acted, with every default filled in.

use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use super::actuation::actuation_document;
use super::actuator::actuator_document;
use super::material::material_document;
use super::mesh_file::{group_material_document, support_document};
use super::obstacle::obstacle_document;
use super::{Body, Scene};

impl Scene {
    /// The document of `resolved`; [`super::read_scene`] reads it back to an equal scene.
    pub fn document(&self) -> Value {
        let mut map = Map::new();
        let mut put = |name: &str, value: Value| {
            map.insert(name.to_string(), value);
        };
        put("version", json!(1));
        match &self.body {
            Body::Actuator(body) => {
                put("actuator", actuator_document(&body.actuator));
                match body.materials.first() {
                    Some(first) if body.materials.iter().all(|m| m == first) => {
                        put("material", material_document(first));
                    }
                    _ => put(
                        "unit_materials",
                        body.materials.iter().map(material_document).collect(),
                    ),
                }
            }
            Body::MeshFile(body) => {
                put("mesh_file", json!(body.path.to_string_lossy()));
                put("material", material_document(&body.material));
                put(
                    "materials",
                    body.materials.iter().map(group_material_document).collect(),
                );
                put(
                    "supports",
                    body.supports.iter().map(support_document).collect(),
                );
                put("tractions", json!(body.tractions));
                put("pressures", json!(body.pressures));
                put("contact_pairs", json!(body.contact_pairs));
            }
        }
        put("actuation", actuation_document(&self.actuation));
        put("mesh", json!(self.mesh));
        put("contact", json!(self.contact));
        put("contact_activation_mm", json!(self.contact_activation_mm));
        put(
            "obstacles",
            self.obstacles.iter().map(obstacle_document).collect(),
        );
        put(
            "relative_residual_force_tolerance",
            json!(self.relative_residual_force_tolerance),
        );
        let probes: Map<_, _> = self
            .probes
            .iter()
            .map(|p| (p.name.clone(), json!(p.at_mm)))
            .collect();
        put("probes", Value::Object(probes));
        put(
            "objective",
            json!(
                self.objective
                    .as_ref()
                    .map(|o| o.document("", |p| json!(p)))
            ),
        );
        Value::Object(map)
    }
}

impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.document().serialize(serializer)
    }
}

//! Reads a scene document and answers every fault at once.

use std::path::Path;

use serde_json::Value;

use super::actuation::read_actuation;
use super::actuator::read_actuator;
use super::material::{read_material, read_per_unit};
use super::mesh_file::read_groups;
use super::obstacle::read_obstacles;
use super::shape::strictly_inside;
use super::target::{MeasureReader, read_one_orientation};
use super::{
    ActuatorBody, Body, ContactMode, ElementChoice, Goal, MeshFileBody, MeshRequest, Probe, Scene,
};
use crate::actuation::ActuationCycle;
use crate::document::{Node, Object, read};
use crate::fault::Faults;
use crate::geometry::{Actuator, Point};

/// Tolerance where the document gives none.
pub const DEFAULT_TOLERANCE: f64 = 1e-8;
const MAX_PROBES: usize = 1000;
/// A mesh with more elements than this would not fit the memory of any machine that runs it.
const MAX_ELEMENTS: f64 = 2e6;

/// Activation distance of contact where the document gives none, mm.
pub const DEFAULT_ACTIVATION_MM: f64 = 0.1;
/// Least activation distance, mm.
pub const LEAST_ACTIVATION_MM: f64 = 1e-3;

const COMMON: [&str; 10] = [
    "version",
    "material",
    "actuation",
    "mesh",
    "contact",
    "contact_activation_mm",
    "obstacles",
    "relative_residual_force_tolerance",
    "probes",
    "objective",
];

/// Reads a scene; `folder` is where a mesh file's relative path starts.
pub fn read_scene(document: &Value, folder: &Path) -> Result<Scene, Faults> {
    read(document, |node| read_root(node, folder))
}

fn read_root(node: &Node<'_>, folder: &Path) -> Option<Scene> {
    let root = node.open()?;
    let from_file = root.has("mesh_file");
    let own: &[&str] = match (from_file, root.has("actuator")) {
        (true, false) => &[
            "mesh_file",
            "materials",
            "supports",
            "tractions",
            "pressures",
            "contact_pairs",
        ],
        (false, _) => &["actuator", "unit_materials"],
        (true, true) => {
            root.fault("mesh_file", "either actuator or mesh_file, not both");
            &[
                "actuator",
                "unit_materials",
                "mesh_file",
                "materials",
                "supports",
                "tractions",
                "pressures",
                "contact_pairs",
            ]
        }
    };
    root.allow(&[&COMMON[..], own].concat());
    let version = root.required("version").and_then(|n| {
        let version = n.number()?;
        n.expect(version == 1.0, "only version 1 is known")
    });
    let actuation = root.required("actuation").and_then(|n| read_actuation(&n));
    let body = if from_file {
        read_mesh_file(&root, folder, actuation.as_ref()).map(Body::MeshFile)
    } else {
        read_actuator_body(&root, actuation.as_ref()).map(Body::Actuator)
    };
    let actuator = match &body {
        Some(Body::Actuator(body)) => Some(&body.actuator),
        _ => None,
    };
    let mesh = root.or("mesh", MeshRequest::default(), |n| {
        read_mesh_request(n, actuator)
    });
    let contact = root.or("contact", ContactMode::Auto, read_contact);
    let activation = root.or(
        "contact_activation_mm",
        DEFAULT_ACTIVATION_MM,
        read_activation,
    );
    let obstacles = root.or("obstacles", Vec::new(), |n| {
        read_obstacles(n, actuation.as_ref(), actuator)
    });
    if let (Some(ContactMode::Off), Some([_, ..])) = (contact, obstacles.as_deref()) {
        root.fault("contact", "is off, so obstacles would not act");
    }
    if let (Some(ContactMode::Off), Some(Body::MeshFile(body))) = (contact, &body)
        && !body.contact_pairs.is_empty()
    {
        root.fault("contact", "is off, so contact_pairs would not act");
    }
    let tolerance = root.or(
        "relative_residual_force_tolerance",
        DEFAULT_TOLERANCE,
        read_tolerance,
    );
    let probes = root.or("probes", Vec::new(), |n| read_probes(n, actuator));
    let objective = root.optional("objective", |n| {
        read_objective(n, probes.as_deref(), actuation.as_ref())
    });
    version?;
    Some(Scene {
        body: body?,
        actuation: actuation?,
        mesh: mesh?,
        contact: contact?,
        contact_activation_mm: activation?,
        obstacles: obstacles?,
        relative_residual_force_tolerance: tolerance?,
        probes: probes?,
        objective: objective?,
    })
}

/// Reads a relative residual force tolerance.
pub fn read_tolerance(node: &Node<'_>) -> Option<f64> {
    let tolerance = node.positive()?;
    node.expect(tolerance <= 1.0, "must be at most 1")?;
    Some(tolerance)
}

/// Reads the contact setting.
pub fn read_contact(node: &Node<'_>) -> Option<ContactMode> {
    node.choice(&[
        ("auto", ContactMode::Auto),
        ("off", ContactMode::Off),
        ("on", ContactMode::On),
    ])
}

/// Reads an activation distance, mm.
pub fn read_activation(node: &Node<'_>) -> Option<f64> {
    node.number_in(LEAST_ACTIVATION_MM, 10.0)
}

/// Reads an element's name.
pub fn read_element(node: &Node<'_>) -> Option<ElementChoice> {
    node.choice(&[
        ("auto", ElementChoice::Auto),
        ("quad4", ElementChoice::Quad4),
        ("quad9", ElementChoice::Quad9),
    ])
}

/// Reads an element size, mm, that keeps the mesh of `area_mm2` within reason.
pub fn read_max_size(node: &Node<'_>, area_mm2: Option<f64>) -> Option<f64> {
    let size = node.positive()?;
    let elements = area_mm2.unwrap_or(0.0) / (size * size);
    node.expect(
        elements <= MAX_ELEMENTS,
        &format!("would need about {elements:.0} elements; at most {MAX_ELEMENTS:.0} are made"),
    )?;
    Some(size)
}

/// Faults both of the two ways to give a size.
pub fn expect_one_size(object: &Object<'_>) {
    let given = |name| object.nullable(name).is_some();
    if given("max_size_mm") && given("mean_size_mm") {
        object.fault(
            "mean_size_mm",
            "either max_size_mm or mean_size_mm, not both",
        );
    }
}

fn read_mesh_request(node: &Node<'_>, actuator: Option<&Actuator>) -> Option<MeshRequest> {
    let object = node.object(&["element", "max_size_mm", "mean_size_mm"])?;
    let area = actuator.map(|a| a.unit_mm[0] * a.unit_mm[1] * a.units.len() as f64);
    let element = object.or("element", ElementChoice::Auto, read_element);
    let max_size_mm = object.optional("max_size_mm", |n| read_max_size(n, area));
    let mean_size_mm = object.optional("mean_size_mm", |n| read_max_size(n, area));
    expect_one_size(&object);
    Some(MeshRequest {
        element: element?,
        max_size_mm: max_size_mm?,
        mean_size_mm: mean_size_mm?,
    })
}

fn read_actuator_body(
    root: &Object<'_>,
    actuation: Option<&ActuationCycle>,
) -> Option<ActuatorBody> {
    let node = root.get("actuator");
    if node.is_none() {
        root.fault("actuator", "is required (or mesh_file)");
    }
    let actuator = node.as_ref().and_then(read_actuator);
    if let (Some(node), Some(actuator), Some(cycle)) = (&node, &actuator, actuation) {
        check_channels(node, actuator, cycle)?;
    }
    let units = actuator.as_ref().map(|a| a.units.len());
    let material = root.nullable("material").map(|n| read_material(&n));
    let materials = match (root.nullable("unit_materials"), material) {
        (Some(list), _) => read_per_unit(&list, units, read_material),
        (None, Some(law)) => law.and_then(|law| Some(vec![law; units?])),
        (None, None) => {
            root.fault("material", "is required (or unit_materials)");
            None
        }
    };
    Some(ActuatorBody {
        actuator: actuator?,
        materials: materials?,
    })
}

/// Chamber i is driven by channel i: a chamber without a channel is a fault, not a void at rest.
fn check_channels(node: &Node<'_>, actuator: &Actuator, cycle: &ActuationCycle) -> Option<()> {
    let object = node.open()?;
    let mut sound = true;
    for (k, unit) in actuator.units.iter().enumerate() {
        let (chambers, channels) = (unit.chambers_mm.len(), cycle.channels());
        if chambers > channels {
            let path = if actuator.repeated {
                "chambers_mm".to_string()
            } else {
                format!("units[{k}].chambers_mm")
            };
            object.fault(
                &path,
                format!("has {chambers} chambers, but the schedule has {channels} channels: chamber i is driven by channel i"),
            );
            sound = false;
        }
        if actuator.repeated {
            break;
        }
    }
    sound.then_some(())
}

fn read_mesh_file(
    root: &Object<'_>,
    folder: &Path,
    actuation: Option<&ActuationCycle>,
) -> Option<MeshFileBody> {
    let path = root
        .required("mesh_file")
        .and_then(|n| Some(folder.join(n.text()?)));
    let material = root.required("material").and_then(|n| read_material(&n));
    let groups = read_groups(root, actuation)?;
    Some(MeshFileBody {
        path: path?,
        material: material?,
        materials: groups.materials,
        supports: groups.supports,
        tractions: groups.tractions,
        pressures: groups.pressures,
        contact_pairs: groups.contact_pairs,
    })
}

fn read_probes(node: &Node<'_>, actuator: Option<&Actuator>) -> Option<Vec<Probe>> {
    let object = node.open()?;
    if object.names().count() > MAX_PROBES {
        return node.fault(format!("at most {MAX_PROBES} probes"));
    }
    crate::document::all(object.names().map(|name| {
        let at = object.required(name)?;
        let at_mm = at.pair()?;
        if let Some(actuator) = actuator {
            check_in_solid(&at, at_mm, actuator)?;
        }
        Some(Probe {
            name: name.to_string(),
            at_mm,
        })
    }))
}

/// The unit in which a point of an actuator lies, and its place there; a fault outside all units.
pub fn find_unit(
    node: &Node<'_>,
    [x, y]: Point,
    [w, h]: [f64; 2],
    units: usize,
) -> Option<(usize, Point)> {
    let length = w * units as f64;
    if !((0.0..=length).contains(&x) && (0.0..=h).contains(&y)) {
        return node.fault(format!(
            "the point is outside the actuator, 0 <= x <= {length} and 0 <= y <= {h}"
        ));
    }
    let k = ((x / w) as usize).min(units - 1);
    Some((k, [x - k as f64 * w, y]))
}

/// Notes a fault unless the point is in the closed solid of the actuator.
pub fn check_in_solid(node: &Node<'_>, point: Point, actuator: &Actuator) -> Option<()> {
    let (k, local) = find_unit(node, point, actuator.unit_mm, actuator.units.len())?;
    for (i, chamber) in actuator.units[k].chambers_mm.iter().enumerate() {
        if strictly_inside(chamber, local) {
            return node.fault(format!(
                "the point is inside chamber {i} of unit {k}, not in the solid"
            ));
        }
    }
    Some(())
}

fn read_objective(
    node: &Node<'_>,
    probes: Option<&[Probe]>,
    actuation: Option<&ActuationCycle>,
) -> Option<Goal<String>> {
    let probe = |n: &Node<'_>| {
        let name = n.text()?;
        if probes.is_some_and(|list| list.iter().all(|p| p.name != name)) {
            return n.fault(format!("no probe is named \"{name}\""));
        }
        Some(name.to_string())
    };
    MeasureReader {
        suffix: "",
        probe: &probe,
        orientation: &read_one_orientation,
        actuation,
    }
    .goal(node)
}

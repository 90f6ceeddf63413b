//! Reads what acts on the groups of a mesh file. Whether the groups exist is known once the file is read.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::material::{material_document, read_material};
use super::{GroupMaterial, GroupPressure, GroupSupport, GroupTraction};
use crate::actuation::ActuationCycle;
use crate::document::{Node, Object};

const MAX_GROUPS: usize = 1000;
/// Groups that pairs of partners may name: they are the bits of a number.
const MAX_PARTNERS: usize = 64;

/// What a scene says of a mesh file's groups.
pub struct Groups {
    /// Laws by group.
    pub materials: Vec<GroupMaterial>,
    /// Prescribed displacements.
    pub supports: Vec<GroupSupport>,
    /// Dead tractions.
    pub tractions: Vec<GroupTraction>,
    /// Follower pressures.
    pub pressures: Vec<GroupPressure>,
    /// Partners in contact.
    pub contact_pairs: Vec<[String; 2]>,
}

/// Reads the fields `materials`, `supports`, `tractions`, `pressures` and `contact_pairs` of a scene.
pub fn read_groups(scene: &Object<'_>, cycle: Option<&ActuationCycle>) -> Option<Groups> {
    let materials = scene.or("materials", Vec::new(), |n| {
        n.each(0, MAX_GROUPS, read_group_material)
    });
    let supports = scene
        .required("supports")
        .and_then(|n| read_supports(&n, cycle));
    let tractions = scene.or("tractions", Vec::new(), |n| {
        n.each(0, MAX_GROUPS, |t| read_traction(t, cycle))
    });
    let pressures = scene.or("pressures", Vec::new(), |n| {
        n.each(0, MAX_GROUPS, |p| read_pressure(p, cycle))
    });
    let contact_pairs = scene.or("contact_pairs", Vec::new(), read_contact_pairs);
    let materials = materials?;
    for (i, entry) in materials.iter().enumerate() {
        if materials[..i].iter().any(|e| e.group == entry.group) {
            scene.fault(
                &format!("materials[{i}].group"),
                format!("group \"{}\" has a material already", entry.group),
            );
        }
    }
    Some(Groups {
        materials,
        supports: supports?,
        tractions: tractions?,
        pressures: pressures?,
        contact_pairs: contact_pairs?,
    })
}

fn read_contact_pairs(node: &Node<'_>) -> Option<Vec<[String; 2]>> {
    let pairs = node.each(0, MAX_GROUPS, |pair| {
        let names = pair.each(2, 2, |name| Some(name.text()?.to_owned()))?;
        <[String; 2]>::try_from(names).ok()
    })?;
    let names: BTreeSet<&String> = pairs.iter().flatten().collect();
    let few = names.len() <= MAX_PARTNERS;
    node.expect(few, &format!("names more than {MAX_PARTNERS} groups"))?;
    Some(pairs)
}

/// Document form of supports.
pub fn support_document(support: &GroupSupport) -> Value {
    let fix: Vec<_> = ["x", "y"]
        .into_iter()
        .zip(support.fix)
        .filter_map(|(name, fixed)| fixed.then_some(name))
        .collect();
    json!({"group": support.group, "fix": fix, "displacement_mm": support.displacement_mm, "channel": support.channel})
}

/// Document form of a group's law.
pub fn group_material_document(entry: &GroupMaterial) -> Value {
    json!({"group": entry.group, "material": material_document(&entry.material)})
}

fn read_group_material(node: &Node<'_>) -> Option<GroupMaterial> {
    let object = node.object(&["group", "material"])?;
    let group = read_group(&object);
    let material = object.required("material").and_then(|n| read_material(&n));
    Some(GroupMaterial {
        group: group?,
        material: material?,
    })
}

fn read_group(object: &Object<'_>) -> Option<String> {
    Some(object.required("group")?.text()?.to_string())
}

/// A channel of the schedule (0 where not given), which must be actuated where something ramps with it.
pub(super) fn read_channel(
    object: &Object<'_>,
    cycle: Option<&ActuationCycle>,
    ramps: bool,
) -> Option<usize> {
    let channel = object.or("channel", 0, |n| n.count(0, 63))?;
    let Some(cycle) = cycle else {
        return Some(channel);
    };
    if channel >= cycle.channels() {
        object.fault(
            "channel",
            format!(
                "channel {channel} is out of range: the schedule has {}",
                cycle.channels()
            ),
        );
        return None;
    }
    if ramps && cycle.rows_kpa.iter().all(|row| row[channel] == 0.0) {
        object.fault(
            "channel",
            format!(
                "channel {channel} is zero throughout the schedule, so nothing can ramp with it"
            ),
        );
        return None;
    }
    Some(channel)
}

fn read_supports(node: &Node<'_>, cycle: Option<&ActuationCycle>) -> Option<Vec<GroupSupport>> {
    let supports = node.each(0, MAX_GROUPS, |s| read_support(s, cycle))?;
    let mut held = true;
    for (component, name) in ["x", "y"].into_iter().enumerate() {
        if !supports.iter().any(|s| s.fix[component]) {
            node.fault::<()>(format!("nothing holds the body in {name}"));
            held = false;
        }
    }
    held.then_some(supports)
}

fn read_support(node: &Node<'_>, cycle: Option<&ActuationCycle>) -> Option<GroupSupport> {
    let object = node.object(&["group", "fix", "displacement_mm", "channel"])?;
    let group = read_group(&object);
    let fix = object.required("fix").and_then(|n| {
        let components = n.each(1, 2, |c| c.choice(&[("x", 0), ("y", 1)]))?;
        let mut fix = [false; 2];
        for c in components {
            n.expect(!fix[c], "names a component twice")?;
            fix[c] = true;
        }
        Some(fix)
    });
    let displacement = object.or("displacement_mm", [0.0; 2], |n| {
        let displacement = n.pair()?;
        let fix = fix?;
        n.expect(
            (0..2).all(|c| fix[c] || displacement[c] == 0.0),
            "a component that is not fixed cannot have a displacement",
        )?;
        Some(displacement)
    });
    let ramps = displacement.is_some_and(|d| d != [0.0; 2]);
    let channel = read_channel(&object, cycle, ramps);
    Some(GroupSupport {
        group: group?,
        fix: fix?,
        displacement_mm: displacement?,
        channel: channel?,
    })
}

fn read_traction(node: &Node<'_>, cycle: Option<&ActuationCycle>) -> Option<GroupTraction> {
    let object = node.object(&["group", "mpa", "channel"])?;
    let group = read_group(&object);
    let mpa = object.required("mpa").and_then(|n| n.pair());
    let channel = read_channel(&object, cycle, mpa.is_some_and(|t| t != [0.0; 2]));
    Some(GroupTraction {
        group: group?,
        mpa: mpa?,
        channel: channel?,
    })
}

fn read_pressure(node: &Node<'_>, cycle: Option<&ActuationCycle>) -> Option<GroupPressure> {
    let object = node.object(&["group", "channel"])?;
    let group = read_group(&object);
    let channel = read_channel(&object, cycle, false);
    Some(GroupPressure {
        group: group?,
        channel: channel?,
    })
}

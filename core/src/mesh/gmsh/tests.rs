//! A quarter of a ring in every element kind, and every way in which a file can be wrong.

use std::f64::consts::{FRAC_PI_2, PI};

use super::model::build;
use super::*;
use crate::fault::Faults;
use crate::material::{HyperelasticModel, MaterialLaw};
use crate::mesh::{Cavity, ElementKind};
use crate::scene::{
    ElementChoice, GroupMaterial, GroupPressure, GroupSupport, GroupTraction, MeshFileBody,
};

const SURFACES: [GmshElementKind; 5] = [
    GmshElementKind::Triangle3,
    GmshElementKind::Triangle6,
    GmshElementKind::Quad4,
    GmshElementKind::Quad8,
    GmshElementKind::Quad9,
];

/// Radii 1 to 2, angle 0 to 90 degrees: `left` is the bore, `bottom` lies on y = 0, `top` on x = 0.
fn ring(kind: GmshElementKind, cells: [usize; 2]) -> GmshFile {
    structured(kind, cells, |s, t| {
        let (radius, angle) = (1.0 + s, t * FRAC_PI_2);
        [radius * angle.cos(), radius * angle.sin()]
    })
}

fn law(c10_mpa: f64) -> MaterialLaw {
    MaterialLaw {
        model: HyperelasticModel::NeoHookean { c10_mpa },
        bulk_over_shear: 1000.0,
        fit_stretch: None,
    }
}

fn support(group: &str, fix: [bool; 2]) -> GroupSupport {
    GroupSupport {
        group: group.into(),
        fix,
        displacement_mm: [0.0; 2],
        channel: 0,
    }
}

fn pressure(group: &str) -> GroupPressure {
    GroupPressure {
        group: group.into(),
        channel: 0,
    }
}

fn ring_body() -> MeshFileBody {
    MeshFileBody {
        path: "ring.msh".into(),
        material: law(0.5),
        materials: Vec::new(),
        supports: vec![
            support("bottom", [false, true]),
            support("top", [true, false]),
        ],
        tractions: Vec::new(),
        pressures: vec![pressure("left")],
        contact_pairs: Vec::new(),
    }
}

fn model(file: &GmshFile, body: &MeshFileBody) -> Result<MeshFileModel, Faults> {
    build(file, body, 1, ElementChoice::Auto)
}

fn only_fault(result: Result<MeshFileModel, Faults>) -> (String, String) {
    let faults = result.expect_err("expected a fault").0;
    assert_eq!(faults.len(), 1, "{faults:?}");
    (faults[0].path.clone(), faults[0].message.clone())
}

/// The closed area of a cavity, mm^2, as the solver takes it.
fn area(cavity: &Cavity, at: &[[f64; 2]]) -> f64 {
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let at = |n: u32| at[n as usize];
    let mut area: f64 = cavity
        .edges
        .iter()
        .map(|e| match e.mid {
            None => cross(at(e.ends[0]), at(e.ends[1])) / 2.0,
            Some(m) => {
                (4.0 * cross(at(e.ends[0]), at(m)) + 4.0 * cross(at(m), at(e.ends[1]))
                    - cross(at(e.ends[0]), at(e.ends[1])))
                    / 6.0
            }
        })
        .sum();
    let mut from = at(cavity.edges[cavity.edges.len() - 1].ends[1]);
    for point in &cavity.closing_points_mm {
        area += cross(from, *point) / 2.0;
        from = *point;
    }
    area + cross(from, at(cavity.edges[0].ends[0])) / 2.0
}

#[test]
fn what_is_written_reads_back() {
    for kind in SURFACES {
        let file = ring(kind, [2, 3]);
        let text = write(&file).unwrap();
        let mut read = parse(text.as_bytes()).unwrap();
        read.elements.sort_by_key(|e| e.tag);
        assert_eq!(file, read, "{kind:?}");
    }
}

#[test]
fn a_quarter_ring_has_its_cavity_and_outline() {
    for kind in SURFACES {
        let model = model(&ring(kind, [2, 12]), &ring_body()).unwrap();
        let body = &model.discretisation;
        let curved = !matches!(kind, GmshElementKind::Triangle3 | GmshElementKind::Quad4);
        assert_eq!(body.cavities.len(), 1);
        assert!(!body.cavities[0].closed);
        // Both ends slide, on lines that meet in the centre of the bore.
        assert_eq!(body.cavities[0].closing_points_mm.len(), 1);
        assert!(
            body.cavities[0].closing_points_mm[0]
                .iter()
                .all(|x| x.abs() < 1e-15)
        );
        let error = area(&body.cavities[0], &body.mesh.nodes) / (PI / 4.0) - 1.0;
        assert!(
            error.abs() < if curved { 1e-5 } else { 5e-3 },
            "{kind:?}: {error}"
        );
        assert_eq!(body.boundary.len(), 1);
        let corners = body.boundary[0]
            .starts_at_corner
            .iter()
            .filter(|c| **c)
            .count();
        assert_eq!(corners, 4, "{kind:?}");
        let expected = match kind {
            GmshElementKind::Quad4 => ElementKind::Quad4,
            GmshElementKind::Quad8 | GmshElementKind::Quad9 => ElementKind::Quad9,
            _ => ElementKind::Tri7,
        };
        assert!(body.mesh.blocks.iter().all(|b| b.kind == expected));
        // Every node of a supported line is held, added mid-side nodes included.
        for support in &body.supports {
            assert!(
                body.mesh.nodes[support.node as usize][support.component as usize].abs() < 1e-12
            );
        }
        let per_line = if expected == ElementKind::Quad4 { 3 } else { 5 };
        assert_eq!(body.supports.len(), 2 * per_line);
    }
}

#[test]
fn raising_adds_each_node_once_and_pulls_gradients_back() {
    let model = model(&ring(GmshElementKind::Triangle3, [2, 3]), &ring_body()).unwrap();
    let nodes = &model.discretisation.mesh.nodes;
    // Euler: 12 corners, 23 edges, 12 triangles.
    assert_eq!(nodes.len(), 12 + 23 + 12);
    // The gradient of the sum of all x: moving every file node by one moves every node by one.
    let mut gradient = vec![[1.0, 0.0]; nodes.len()];
    model.pull_back(&mut gradient);
    let total: f64 = gradient.iter().map(|g| g[0]).sum();
    assert!((total - nodes.len() as f64).abs() < 1e-12);
    for (node, origin) in model.origins.iter().enumerate() {
        assert!(matches!(origin, NodeOrigin::File(_)) || gradient[node] == [0.0; 2]);
    }
    assert_eq!(model.pressure_nodes().len(), 4);
}

#[test]
fn quads_beside_triangles_are_raised_to_conform() {
    let mut file = ring(GmshElementKind::Quad4, [2, 2]);
    let quad = file.elements.pop().unwrap();
    let [a, b, c, d] = quad.nodes[..] else {
        panic!()
    };
    for (tag, nodes) in [(100, vec![a, b, c]), (101, vec![a, c, d])] {
        file.elements.push(GmshElement {
            tag,
            kind: GmshElementKind::Triangle3,
            nodes,
            groups: quad.groups.clone(),
        });
    }
    let model = model(&file, &ring_body()).unwrap();
    let kinds: Vec<_> = model
        .discretisation
        .mesh
        .blocks
        .iter()
        .map(|b| (b.kind, b.len()))
        .collect();
    assert_eq!(kinds, [(ElementKind::Quad9, 3), (ElementKind::Tri7, 2)]);
    // 9 corners, 13 edges, 5 centres: no node is doubled along the shared edges.
    assert_eq!(model.discretisation.mesh.nodes.len(), 9 + 13 + 5);
}

#[test]
fn a_clockwise_mesh_is_reversed_as_a_whole() {
    for kind in SURFACES {
        let mirrored = structured(kind, [2, 3], |s, t| {
            let (radius, angle) = (1.0 + s, (1.0 - t) * FRAC_PI_2);
            [radius * angle.cos(), radius * angle.sin()]
        });
        // `bottom` now lies on x = 0 and `top` on y = 0.
        let mut body = ring_body();
        body.supports = vec![
            support("bottom", [true, false]),
            support("top", [false, true]),
        ];
        let model = model(&mirrored, &body).unwrap();
        let cavity = &model.discretisation.cavities[0];
        assert!(
            area(cavity, &model.discretisation.mesh.nodes) > 0.7,
            "{kind:?}"
        );
    }
}

#[test]
fn one_element_turned_or_folded_is_named() {
    let mut turned = ring(GmshElementKind::Quad4, [3, 3]);
    let last = turned.elements.last_mut().unwrap();
    last.nodes.reverse();
    let tag = last.tag;
    let (path, message) = only_fault(model(&turned, &ring_body()));
    assert_eq!(path, "mesh_file");
    assert!(
        message.contains("1 of 9 elements") && message.contains(&tag.to_string()),
        "{message}"
    );

    let mut folded = ring(GmshElementKind::Quad9, [3, 3]);
    let element = folded.elements.last().unwrap().clone();
    let [near, far] = [element.nodes[4], element.nodes[1]];
    let far = folded.nodes.iter().find(|n| n.tag == far).unwrap().at_mm;
    folded
        .nodes
        .iter_mut()
        .find(|n| n.tag == near)
        .unwrap()
        .at_mm = far.map(|x| x * 1.0);
    let (path, message) = only_fault(model(&folded, &ring_body()));
    assert_eq!(path, "mesh_file");
    assert!(
        message.contains("Jacobian") && message.contains(&element.tag.to_string()),
        "{message}"
    );
}

#[test]
fn every_cut_of_a_file_is_an_error() {
    let text = write(&ring(GmshElementKind::Quad9, [1, 2])).unwrap();
    let whole = text.trim_end().len();
    for cut in 0..whole {
        assert!(parse(&text.as_bytes()[..cut]).is_err(), "cut at byte {cut}");
    }
    // A line less: always noticed, by the announced counts.
    let lines: Vec<&str> = text.lines().collect();
    for skipped in 0..lines.len() {
        if lines[skipped].starts_with('1') && lines[skipped].ends_with('"') {
            continue;
        }
        let mut rest = lines.clone();
        rest.remove(skipped);
        assert!(
            parse(rest.join("\n").as_bytes()).is_err(),
            "without line {}: {}",
            skipped + 1,
            lines[skipped]
        );
    }
}

#[test]
fn other_formats_are_told_apart() {
    let text = write(&ring(GmshElementKind::Quad4, [1, 1])).unwrap();
    let message = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
    assert!(message(b"# vtk DataFile Version 3.0\n").contains("not a Gmsh mesh"));
    assert!(message(text.replace("4.1 0 8", "2.2 0 8").as_bytes()).contains("version 2.2"));
    let mut binary = text.replace("4.1 0 8", "4.1 1 8").into_bytes();
    binary.extend_from_slice(&[0xff, 0xfe, 0x00]);
    assert!(message(&binary).contains("binary"));
    let mut no_text = text.clone().into_bytes();
    no_text.extend_from_slice(&[0xff, 0xfe]);
    assert!(message(&no_text).contains("not text"));
    assert!(
        message(
            text.replace(
                "
2 0 0
",
                "
nan 0 0
"
            )
            .as_bytes()
        )
        .contains("finite coordinate")
    );
    assert!(message(text.replace("2 1 3 1\n", "2 1 4 1\n").as_bytes()).contains("element type 4"));
    let (path, message) = only_fault(load(&ring_body(), 1, ElementChoice::Auto));
    assert!(
        path == "mesh_file" && message.contains("ring.msh"),
        "{message}"
    );
}

#[test]
fn parametric_nodes_foreign_sections_and_unused_nodes_are_passed_over() {
    let file = ring(GmshElementKind::Quad4, [1, 1]);
    let text = write(&file).unwrap();
    let mut out = String::new();
    let mut in_nodes = false;
    for line in text.lines() {
        in_nodes = (in_nodes || line == "$Nodes") && line != "$EndNodes";
        let line = match line {
            "2 1 0 4" if in_nodes => "2 1 1 4".to_owned(),
            _ if in_nodes && line.split(' ').count() == 3 => format!("{line} 0.25 0.5"),
            _ => line.to_owned(),
        };
        out += &format!("{line}\r\n");
    }
    out += "$Periodic\r\n0\r\n$EndPeriodic\r\n";
    let mut read = parse(out.as_bytes()).unwrap();
    read.elements.sort_by_key(|e| e.tag);
    assert_eq!(read, file);

    let mut unused = file;
    unused.nodes.insert(
        0,
        GmshNode {
            tag: 99,
            at_mm: [0.0; 3],
        },
    );
    let model = model(&unused, &ring_body()).unwrap();
    assert_eq!(model.discretisation.mesh.nodes.len(), 4);
}

#[test]
fn every_fault_of_the_groups_has_its_path() {
    let mut body = ring_body();
    body.supports.push(support("clamp", [true, true]));
    body.supports.push(GroupSupport {
        displacement_mm: [0.0, 1.0],
        ..support("bottom", [false, true])
    });
    body.tractions.push(GroupTraction {
        group: "solid".into(),
        mpa: [1.0, 0.0],
        channel: 3,
    });
    body.pressures.push(pressure("left"));
    body.materials.push(GroupMaterial {
        group: "right".into(),
        material: law(1.0),
    });
    let faults = model(&ring(GmshElementKind::Quad9, [2, 2]), &body).unwrap_err();
    let paths: Vec<&str> = faults.0.iter().map(|f| f.path.as_str()).collect();
    assert_eq!(
        paths,
        [
            "supports[2].group",
            "tractions[0].channel",
            "materials[0].group",
            "supports[3]",
            "tractions[0].group",
            "pressures[1].group",
        ],
        "{faults}"
    );
}

#[test]
fn an_open_chain_needs_ends_that_are_held() {
    let file = ring(GmshElementKind::Quad9, [2, 2]);
    let mut free = ring_body();
    free.supports.pop();
    let (path, message) = only_fault(model(&file, &free));
    assert!(
        path == "pressures[0].group" && message.contains("neither fixed"),
        "{message}"
    );

    let mut moving = ring_body();
    moving.supports[1].displacement_mm = [0.1, 0.0];
    let (_, message) = only_fault(model(&file, &moving));
    assert!(message.contains("stands still"), "{message}");

    let mut fixed = ring_body();
    fixed.supports = vec![
        support("bottom", [true, true]),
        support("top", [true, true]),
    ];
    let fixed = model(&file, &fixed).unwrap();
    assert!(
        fixed.discretisation.cavities[0]
            .closing_points_mm
            .is_empty()
    );

    let mut mixed = ring_body();
    mixed.supports[0].fix = [true, true];
    let mixed = model(&file, &mixed).unwrap();
    let closing = &mixed.discretisation.cavities[0].closing_points_mm;
    assert!(closing.len() == 1 && closing[0].iter().all(|x| x.abs() < 1e-15));
}

#[test]
fn outside_pressure_and_closed_bores_run_the_other_way_round() {
    let hole = square_with_hole();
    let body = MeshFileBody {
        supports: vec![support("outline", [true, true])],
        pressures: vec![
            pressure("hole"),
            GroupPressure {
                group: "outline".into(),
                channel: 0,
            },
        ],
        ..ring_body()
    };
    let model = model(&hole, &body).unwrap();
    let body = &model.discretisation;
    let areas: Vec<f64> = body
        .cavities
        .iter()
        .map(|c| area(c, &body.mesh.nodes))
        .collect();
    assert!(body.cavities.iter().all(|c| c.closed));
    assert!(
        (areas[0] - 1.0).abs() < 1e-12 && (areas[1] + 9.0).abs() < 1e-12,
        "{areas:?}"
    );
    let loops: Vec<usize> = body.boundary.iter().map(|l| l.edges.len()).collect();
    assert_eq!(loops, [12, 4]);
    assert_eq!(
        body.boundary[0]
            .starts_at_corner
            .iter()
            .filter(|c| **c)
            .count(),
        4
    );
}

/// Three by three cells without the middle one.
fn square_with_hole() -> GmshFile {
    let mut file = structured(GmshElementKind::Quad4, [3, 3], |s, t| [3.0 * s, 3.0 * t]);
    let middle = file.elements.iter().position(|e| e.tag == 12 + 5).unwrap();
    let middle = file.elements.remove(middle);
    file.groups = ["outline", "hole"]
        .iter()
        .enumerate()
        .map(|(i, name)| PhysicalGroup {
            dimension: 1,
            tag: i as u32 + 1,
            name: (*name).to_owned(),
        })
        .collect();
    for element in &mut file.elements {
        element.groups = if element.kind == GmshElementKind::Line2 {
            vec![0]
        } else {
            Vec::new()
        };
    }
    for side in 0..4 {
        file.elements.push(GmshElement {
            tag: 200 + side as u64,
            kind: GmshElementKind::Line2,
            nodes: vec![middle.nodes[side], middle.nodes[(side + 1) % 4]],
            groups: vec![1],
        });
    }
    file
}

#[test]
fn the_element_is_the_files_own() {
    let file = ring(GmshElementKind::Quad8, [1, 1]);
    assert!(build(&file, &ring_body(), 1, ElementChoice::Quad9).is_ok());
    let (path, message) = only_fault(build(&file, &ring_body(), 1, ElementChoice::Quad4));
    assert!(
        path == "mesh.element" && message.contains("quad9"),
        "{message}"
    );
}

#[test]
fn laws_go_to_groups_and_clash_only_when_they_differ() {
    let file = ring(GmshElementKind::Quad4, [2, 2]);
    let mut body = ring_body();
    let stiff = |group: &str, c10| GroupMaterial {
        group: group.into(),
        material: law(c10),
    };
    body.materials = vec![stiff("solid", 2.0), stiff("solid", 2.0)];
    let model_ = model(&file, &body).unwrap();
    assert_eq!(model_.laws, [law(0.5), law(2.0)]);
    assert!(
        model_.discretisation.mesh.blocks[0]
            .material
            .iter()
            .all(|m| *m == 1)
    );
    body.materials[1] = stiff("solid", 3.0);
    let (path, message) = only_fault(model(&file, &body));
    assert!(
        path == "materials[1].group" && message.contains("materials[0]"),
        "{message}"
    );
}

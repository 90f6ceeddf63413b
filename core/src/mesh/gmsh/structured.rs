//! A mapped rectangle as a Gmsh file: verification problems and refinement studies.

use super::file::{GmshElement, GmshElementKind, GmshFile, GmshNode, PhysicalGroup};

/// Names of the edges of the unit square, in the order of its sides, counter-clockwise from y = 0.
const SIDES: [&str; 4] = ["bottom", "right", "top", "left"];

/// The unit square cut into `cells` = [along s, along t] and mapped by `place(s, t)`, mm. Groups: the lines `bottom`
/// (t = 0), `right` (s = 1), `top`, `left`, and the surface `solid`. Every node lies on the map, mid-side nodes too. A
/// cell holds one quadrilateral or, for triangles, two. `kind` is one of the surface kinds; others give no elements.
pub fn structured(
    kind: GmshElementKind,
    cells: [usize; 2],
    place: impl Fn(f64, f64) -> [f64; 2],
) -> GmshFile {
    use GmshElementKind::{Line2, Line3, Quad4, Quad8, Quad9, Triangle3, Triangle6};
    let quadratic = matches!(kind, Triangle6 | Quad8 | Quad9);
    // On a grid of half cells; kinds without a node at a point leave it out.
    let [nx, ny] = cells.map(|n| 2 * n);
    let tag = |i: usize, k: usize| (1 + i + k * (nx + 1)) as u64;
    let mut elements = Vec::new();
    let mut add = |kind: GmshElementKind, nodes: Vec<u64>, group: usize| {
        elements.push(GmshElement {
            tag: elements.len() as u64 + 1,
            kind,
            nodes,
            groups: vec![group],
        });
    };
    let mut edge = |a: [usize; 2], b: [usize; 2], group: usize| {
        let mut nodes = vec![tag(a[0], a[1]), tag(b[0], b[1])];
        if quadratic {
            nodes.push(tag(
                usize::midpoint(a[0], b[0]),
                usize::midpoint(a[1], b[1]),
            ));
        }
        add(if quadratic { Line3 } else { Line2 }, nodes, group);
    };
    for i in (0..nx).step_by(2) {
        edge([i, 0], [i + 2, 0], 0);
        edge([nx - i, ny], [nx - i - 2, ny], 2);
    }
    for k in (0..ny).step_by(2) {
        edge([nx, k], [nx, k + 2], 1);
        edge([0, ny - k], [0, ny - k - 2], 3);
    }
    for k in (0..ny).step_by(2) {
        for i in (0..nx).step_by(2) {
            // Corners, mid-sides and centre of the cell.
            let c = [tag(i, k), tag(i + 2, k), tag(i + 2, k + 2), tag(i, k + 2)];
            let m = [
                tag(i + 1, k),
                tag(i + 2, k + 1),
                tag(i + 1, k + 2),
                tag(i, k + 1),
            ];
            let centre = tag(i + 1, k + 1);
            match kind {
                Quad4 => add(kind, c.to_vec(), 4),
                Quad8 => add(kind, [c, m].concat(), 4),
                Quad9 => add(kind, [&c[..], &m, &[centre]].concat(), 4),
                Triangle3 => {
                    add(kind, vec![c[0], c[1], c[2]], 4);
                    add(kind, vec![c[0], c[2], c[3]], 4);
                }
                Triangle6 => {
                    add(kind, vec![c[0], c[1], c[2], m[0], m[1], centre], 4);
                    add(kind, vec![c[0], c[2], c[3], centre, m[2], m[3]], 4);
                }
                _ => {}
            }
        }
    }
    let used: std::collections::HashSet<u64> = elements
        .iter()
        .flat_map(|e| e.nodes.iter().copied())
        .collect();
    let mut nodes = Vec::new();
    for k in 0..=ny {
        for i in 0..=nx {
            if used.contains(&tag(i, k)) {
                let [x, y] = place(i as f64 / nx as f64, k as f64 / ny as f64);
                nodes.push(GmshNode {
                    tag: tag(i, k),
                    at_mm: [x, y, 0.0],
                });
            }
        }
    }
    let groups = SIDES
        .iter()
        .map(|name| (1, *name))
        .chain([(2, "solid")])
        .enumerate()
        .map(|(i, (dimension, name))| PhysicalGroup {
            dimension,
            tag: i as u32 + 1,
            name: name.to_owned(),
        })
        .collect();
    GmshFile {
        groups,
        nodes,
        elements,
    }
}

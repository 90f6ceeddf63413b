//! VTU files (VTK XML unstructured grid) for ParaView and its kin: the mesh with data on nodes and elements.
//!
//! Arrays are inline base64 of little-endian numbers, each behind its length in bytes as `UInt64`. Cell types: 9 for
//! `Quad4`, 28 (biquadratic quadrilateral) for `Quad9`, 22 (quadratic triangle) for `Tri7`, whose bubble stays in the
//! list of points but not in its cell: few readers know VTK's triangle of seven nodes (meshio does not), and the bubble
//! moves nothing on the element's edges. VTK numbers the nodes of all three as we do.
//!
//! Source: VTK file formats, "XML file formats", and `vtkCellType.h`.

use std::fmt::Write as _;

use super::{ElementBlock, ElementKind, Mesh};

/// Numbers on every node or on every element.
#[derive(Clone, Debug, PartialEq)]
pub struct VtuData {
    /// Its name in the viewer, with its unit.
    pub name: String,
    /// Numbers per node or element: 1, 2 (a plane vector, written with z = 0) or more.
    pub components: usize,
    /// `components` numbers per node or element; elements block by block.
    pub values: Vec<f64>,
}

/// Why a file cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VtuError {
    /// The numbers do not fit the mesh.
    #[error("\"{name}\" has {found} numbers; expected {expected}")]
    Length {
        /// The data's name.
        name: String,
        /// Components times nodes or elements.
        expected: usize,
        /// What was given.
        found: usize,
    },
}

/// Displacements (x, y per node, mm) of several states as data `displacement_mm_000`, `displacement_mm_001`, ...
pub fn displacement_states<'a>(states: impl IntoIterator<Item = &'a [f64]>) -> Vec<VtuData> {
    states
        .into_iter()
        .enumerate()
        .map(|(i, values)| VtuData {
            name: format!("displacement_mm_{i:03}"),
            components: 2,
            values: values.to_vec(),
        })
        .collect()
}

/// The text of a file: reference positions, elements with their `material` and `tag`, and the given data.
pub fn vtu(mesh: &Mesh, on_nodes: &[VtuData], on_elements: &[VtuData]) -> Result<String, VtuError> {
    let elements: usize = mesh.blocks.iter().map(ElementBlock::len).sum();
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    out += "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n";
    out += "<UnstructuredGrid>\n";
    line(
        &mut out,
        format_args!(
            "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{elements}\">",
            mesh.nodes.len()
        ),
    );
    out += "<PointData>\n";
    for data in on_nodes {
        add(&mut out, data, mesh.nodes.len())?;
    }
    out += "</PointData>\n<CellData>\n";
    let blocks = &mesh.blocks;
    integers(
        &mut out,
        "material",
        blocks
            .iter()
            .flat_map(|b| b.material.iter().map(|m| i64::from(*m))),
    );
    integers(
        &mut out,
        "tag",
        blocks
            .iter()
            .flat_map(|b| b.tag.iter().map(|t| i64::from(*t))),
    );
    for data in on_elements {
        add(&mut out, data, elements)?;
    }
    out += "</CellData>\n<Points>\n";
    let positions = mesh.nodes.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    array(
        &mut out,
        "Float64",
        "position_mm",
        3,
        positions.map(f64::to_le_bytes),
    );
    out += "</Points>\n<Cells>\n";
    let cells: Vec<(u8, &[u32])> = blocks.iter().flat_map(cells).collect();
    let nodes = cells.iter().flat_map(|(_, nodes)| nodes.iter());
    integers(&mut out, "connectivity", nodes.map(|n| i64::from(*n)));
    let mut end = 0;
    let offsets = cells.iter().map(|(_, nodes)| {
        end += nodes.len() as i64;
        end
    });
    integers(&mut out, "offsets", offsets);
    array(
        &mut out,
        "UInt8",
        "types",
        1,
        cells.iter().map(|(kind, _)| [*kind]),
    );
    out += "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
    Ok(out)
}

/// VTK's type and nodes of each element.
fn cells(block: &ElementBlock) -> impl Iterator<Item = (u8, &[u32])> {
    let (kind, nodes) = match block.kind {
        ElementKind::Quad4 => (9, 4),
        ElementKind::Quad9 => (28, 9),
        ElementKind::Tri7 => (22, 6),
    };
    block
        .nodes
        .chunks(block.kind.nodes())
        .map(move |element| (kind, &element[..nodes]))
}

fn add(out: &mut String, data: &VtuData, items: usize) -> Result<(), VtuError> {
    let expected = data.components * items;
    if data.values.len() != expected {
        return Err(VtuError::Length {
            name: data.name.clone(),
            expected,
            found: data.values.len(),
        });
    }
    let name = data
        .name
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;");
    let bytes = |x: &f64| x.to_le_bytes();
    if data.components == 2 {
        let padded = data.values.chunks(2).flat_map(|v| [v[0], v[1], 0.0]);
        array(out, "Float64", &name, 3, padded.map(f64::to_le_bytes));
    } else {
        array(
            out,
            "Float64",
            &name,
            data.components,
            data.values.iter().map(bytes),
        );
    }
    Ok(())
}

fn integers(out: &mut String, name: &str, values: impl Iterator<Item = i64>) {
    array(out, "Int64", name, 1, values.map(i64::to_le_bytes));
}

fn array<const N: usize>(
    out: &mut String,
    kind: &str,
    name: &str,
    components: usize,
    values: impl Iterator<Item = [u8; N]>,
) {
    // The length goes in front once it is known.
    let mut bytes = vec![0; 8];
    for value in values {
        bytes.extend_from_slice(&value);
    }
    let length = (bytes.len() - 8) as u64;
    bytes[..8].copy_from_slice(&length.to_le_bytes());
    line(
        out,
        format_args!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">"
        ),
    );
    base64(out, &bytes);
    out.push_str("\n</DataArray>\n");
}

fn line(out: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = writeln!(out, "{text}");
}

/// RFC 4648, with padding.
fn base64(out: &mut String, bytes: &[u8]) {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0_u32, |word, i| {
            word << 8 | u32::from(*chunk.get(i).unwrap_or(&0))
        });
        for i in 0..4 {
            out.push(if i <= chunk.len() {
                LETTERS[(word >> (18 - 6 * i) & 63) as usize] as char
            } else {
                '='
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_matches_the_rfc() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            let mut out = String::new();
            base64(&mut out, plain.as_bytes());
            assert_eq!(out, coded);
        }
    }

    #[test]
    fn data_must_fit_the_mesh() {
        let mesh = Mesh {
            nodes: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            blocks: vec![ElementBlock {
                kind: ElementKind::Quad4,
                nodes: vec![0, 1, 2, 3],
                material: vec![0],
                tag: vec![7],
            }],
        };
        let states = displacement_states([&[0.0; 8][..], &[1.0; 8]]);
        let text = vtu(&mesh, &states, &[]).unwrap();
        assert_eq!(text.matches("<DataArray").count(), 2 + 2 + 1 + 3);
        let short = displacement_states([&[0.0; 6][..]]);
        assert_eq!(
            vtu(&mesh, &short, &[]),
            Err(VtuError::Length {
                name: "displacement_mm_000".into(),
                expected: 8,
                found: 6
            })
        );
    }
}

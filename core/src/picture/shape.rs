//! The undeformed shape in grey, the deformed mesh in black and the path of the tip in red (the paper's Fig. 8); where the
//! tip should be in blue.

use std::collections::HashSet;

use super::panel::scale_bar;
use super::svg::{Anchor, Svg, pair, polyline};
use super::text;
use crate::geometry::Point;
use crate::mesh::{BoundaryEdge, BoundaryLoop, ElementKind, Mesh};

const MARGIN: f64 = 24.0;
const DRAWING: f64 = 912.0;
const INSET: [f64; 2] = [210.0, 170.0];
const RED: &str = "#d00000";
/// Okabe and Ito's blue.
const BLUE: &str = "#0072b2";

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct ShapePicture<'a> {
    /// Over the picture.
    pub title: &'a str,
    /// Reference positions and elements.
    pub mesh: &'a Mesh,
    /// The loops of its boundary.
    pub boundary: &'a [BoundaryLoop],
    /// Displacement of every node, mm; `None`: the undeformed mesh alone.
    pub displacement_mm: Option<&'a [[f64; 2]]>,
    /// Positions of the tip over the cycle, mm, closed by a straight segment; may be empty.
    pub tip_path_mm: &'a [Point],
    /// Where the tip should be over the cycle, mm; may be empty.
    pub target_path_mm: &'a [Point],
    /// Lines under the picture: state, p/mu, schedule, units, tip and limits.
    pub caption: &'a [String],
}

/// mm to px.
struct View {
    corner_mm: [f64; 2],
    scale: f64,
    origin: [f64; 2],
}

impl View {
    fn at(&self, p: [f64; 2]) -> [f64; 2] {
        [
            self.origin[0] + (p[0] - self.corner_mm[0]) * self.scale,
            self.origin[1] - (p[1] - self.corner_mm[1]) * self.scale,
        ]
    }
}

impl ShapePicture<'_> {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let reference = &self.mesh.nodes;
        let deformed: Vec<[f64; 2]> = match self.displacement_mm {
            None => reference.clone(),
            Some(u) => (reference.iter().zip(u))
                .map(|(x, u)| [x[0] + u[0], x[1] + u[1]])
                .collect(),
        };
        let (low, high) = extent(
            reference
                .iter()
                .chain(&deformed)
                .chain(self.tip_path_mm)
                .chain(self.target_path_mm),
        );
        let size = [0, 1].map(|i| (high[i] - low[i]).max(1e-9));
        let scale = (DRAWING / size[0]).min(DRAWING / size[1]);
        let drawing = size.map(|s| s * scale);
        let width = DRAWING.max(drawing[0]) + 2.0 * MARGIN;
        let inset = self.inset_scale(scale);
        let caption_width = width
            - 2.0 * MARGIN
            - if inset.is_some() {
                INSET[0] + 20.0
            } else {
                0.0
            };
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, caption_width, 13.0))
            .collect();
        let foot = 40.0 + drawing[1] + 14.0;
        let band = (60.0 + 18.0 * caption.len() as f64).max(if inset.is_some() {
            INSET[1] + 20.0
        } else {
            0.0
        });
        let mut svg = Svg::new([width, foot + band], self.title);
        let view = View {
            corner_mm: low,
            scale,
            origin: [(width - drawing[0]) / 2.0, 40.0 + drawing[1]],
        };
        svg.text(
            [MARGIN, 24.0],
            15.0,
            Anchor::Start,
            "fill=\"#222222\" font-weight=\"bold\"",
            &text::shortened_bold(self.title, width - 2.0 * MARGIN, 15.0),
        );
        let outline = |at: &[[f64; 2]]| loops(self.boundary, at, &view);
        let grey = "fill=\"#e4e4e4\" fill-rule=\"evenodd\" stroke=\"#a8a8a8\" stroke-width=\"1.2\"";
        svg.path(&outline(reference), grey);
        let lines = "fill=\"none\" stroke=\"#000000\" stroke-width=\"0.35\"";
        svg.path(&element_edges(self.mesh, &deformed, &view), lines);
        let solid =
            "fill=\"none\" stroke=\"#000000\" stroke-width=\"1.1\" stroke-linejoin=\"round\"";
        svg.path(&outline(&deformed), solid);
        self.tip(&mut svg, &view, 2.0);
        scale_bar(&mut svg, [MARGIN, foot + 18.0], scale, 180.0);
        for (i, line) in caption.iter().enumerate() {
            let y = foot + 50.0 + 18.0 * i as f64;
            svg.text([MARGIN, y], 13.0, Anchor::Start, "fill=\"#222222\"", line);
        }
        if let Some(magnified) = inset {
            self.inset(
                &mut svg,
                [width - MARGIN - INSET[0], foot + 8.0],
                magnified,
                magnified / scale,
            );
        }
        svg.finish()
    }

    fn tip(&self, svg: &mut Svg, view: &View, width: f64) {
        let target: Vec<[f64; 2]> = self.target_path_mm.iter().map(|p| view.at(*p)).collect();
        if !target.is_empty() {
            let style = format!(
                "fill=\"none\" stroke=\"{BLUE}\" stroke-width=\"{width}\" stroke-dasharray=\"5 3\" stroke-linejoin=\"round\""
            );
            svg.path(&polyline(&target, false), &style);
            for p in &target {
                svg.disc(*p, 1.3 * width, &format!("fill=\"{BLUE}\""));
            }
        }
        let points: Vec<[f64; 2]> = self.tip_path_mm.iter().map(|p| view.at(*p)).collect();
        let style = format!(
            "fill=\"{RED}\" fill-opacity=\"0.12\" fill-rule=\"evenodd\" stroke=\"{RED}\" stroke-width=\"{width}\" stroke-linejoin=\"round\""
        );
        svg.path(&polyline(&points, true), &style);
        if let Some(start) = points.first() {
            svg.disc(*start, 1.6 * width, &format!("fill=\"{RED}\""));
        }
    }

    /// The scale of a magnified tip path, px per mm, if the path is too small to be seen in the drawing.
    fn inset_scale(&self, scale: f64) -> Option<f64> {
        if self.tip_path_mm.len() < 3 {
            return None;
        }
        let (low, high) = extent(self.tip_path_mm.iter().chain(self.target_path_mm));
        let size = [0, 1].map(|i| high[i] - low[i]);
        let largest = size[0].max(size[1]);
        let fits = ((INSET[0] - 50.0) / size[0]).min((INSET[1] - 70.0) / size[1]);
        (largest > 1e-9 && largest * scale < 60.0).then_some(fits)
    }

    fn inset(&self, svg: &mut Svg, at: [f64; 2], scale: f64, magnified: f64) {
        svg.rectangle(
            at,
            INSET,
            "fill=\"#ffffff\" stroke=\"#888888\" stroke-width=\"1\"",
        );
        let label = format!("tip path, {} times", significant(magnified));
        svg.text(
            [at[0] + 10.0, at[1] + 18.0],
            12.0,
            Anchor::Start,
            "fill=\"#222222\"",
            &label,
        );
        let (low, high) = extent(self.tip_path_mm.iter().chain(self.target_path_mm));
        let drawn = [0, 1].map(|i| (high[i] - low[i]) * scale);
        let view = View {
            corner_mm: low,
            scale,
            origin: [
                at[0] + (INSET[0] - drawn[0]) / 2.0,
                at[1] + 28.0 + f64::midpoint(INSET[1] - 60.0, drawn[1]),
            ],
        };
        self.tip(svg, &view, 1.5);
        scale_bar(svg, [at[0] + 10.0, at[1] + INSET[1] - 12.0], scale, 80.0);
    }
}

/// Two digits, without an exponent.
fn significant(x: f64) -> String {
    let unit = 10_f64.powf(x.log10().floor() - 1.0);
    let rounded = (x / unit).round() * unit;
    if unit >= 1.0 {
        format!("{rounded:.0}")
    } else {
        format!("{rounded:.1}")
    }
}

fn extent<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> ([f64; 2], [f64; 2]) {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for p in points {
        for i in 0..2 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    if low[0] > high[0] {
        ([0.0; 2], [1.0; 2])
    } else {
        (low, high)
    }
}

/// Appends the rest of an edge after its first point: a line, or the parabola through the mid-side node.
fn edge(data: &mut String, ends: [[f64; 2]; 2], mid: Option<[f64; 2]>, view: &View) {
    let [a, b] = ends;
    if let Some(m) = mid {
        data.push('Q');
        let control = [0, 1].map(|i| 2.0 * m[i] - f64::midpoint(a[i], b[i]));
        pair(data, view.at(control));
        data.push(' ');
    } else {
        data.push('L');
    }
    pair(data, view.at(b));
}

fn loops(boundary: &[BoundaryLoop], at: &[[f64; 2]], view: &View) -> String {
    let mut data = String::new();
    for l in boundary {
        for (i, BoundaryEdge { ends, mid }) in l.edges.iter().enumerate() {
            let ends = ends.map(|n| at[n as usize]);
            if i == 0 {
                data.push('M');
                pair(&mut data, view.at(ends[0]));
            }
            edge(&mut data, ends, mid.map(|m| at[m as usize]), view);
        }
        data.push('Z');
    }
    data
}

/// Every edge of the elements, each once.
fn element_edges(mesh: &Mesh, at: &[[f64; 2]], view: &View) -> String {
    let mut data = String::new();
    let mut drawn = HashSet::new();
    for block in &mesh.blocks {
        let n = if block.kind == ElementKind::Tri7 {
            3
        } else {
            4
        };
        for nodes in block.nodes.chunks(block.kind.nodes()) {
            for side in 0..n {
                let (a, b) = (nodes[side], nodes[(side + 1) % n]);
                if !drawn.insert([a.min(b), a.max(b)]) {
                    continue;
                }
                let mid = (block.kind != ElementKind::Quad4).then(|| at[nodes[n + side] as usize]);
                data.push('M');
                pair(&mut data, view.at(at[a as usize]));
                edge(&mut data, [at[a as usize], at[b as usize]], mid, view);
            }
        }
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementBlock;

    #[test]
    fn each_edge_is_drawn_once_and_bends_through_its_mid_side_node() {
        let mesh = Mesh {
            nodes: vec![
                [0.0, 0.0],
                [1.0, 0.0],
                [1.0, 1.0],
                [0.0, 1.0],
                [2.0, 0.0],
                [2.0, 1.0],
            ],
            blocks: vec![ElementBlock {
                kind: ElementKind::Quad4,
                nodes: vec![0, 1, 2, 3, 1, 4, 5, 2],
                material: vec![0, 0],
                tag: vec![1, 2],
            }],
        };
        let view = View {
            corner_mm: [0.0; 2],
            scale: 1.0,
            origin: [0.0; 2],
        };
        assert_eq!(
            element_edges(&mesh, &mesh.nodes, &view)
                .matches('M')
                .count(),
            7
        );
        let mut data = String::new();
        edge(&mut data, [[0.0, 0.0], [2.0, 0.0]], Some([1.0, 0.5]), &view);
        assert_eq!(data, "Q1 -1 2 0");
    }

    #[test]
    fn a_small_tip_path_is_magnified() {
        let mesh = Mesh {
            nodes: vec![[0.0, 0.0], [240.0, 80.0]],
            blocks: Vec::new(),
        };
        let mut picture = ShapePicture {
            title: "a <b>",
            mesh: &mesh,
            boundary: &[],
            displacement_mm: None,
            tip_path_mm: &[[160.0, 40.0], [160.4, 40.5], [160.0, 40.5]],
            target_path_mm: &[],
            caption: &[],
        };
        let svg = picture.svg();
        assert!(svg.contains("tip path, ") && svg.contains("a &lt;b&gt;"));
        picture.tip_path_mm = &[[160.0, 40.0], [190.0, 40.5], [160.0, 60.5]];
        assert!(!picture.svg().contains("tip path, "));
        assert!(!picture.svg().contains(BLUE));
        picture.target_path_mm = &[[160.0, 40.0], [170.0, 50.0]];
        assert_eq!(picture.svg().matches(BLUE).count(), 3);
    }
}

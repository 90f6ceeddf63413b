//! Where a point is over the plane of two pressures: lines on which one of them is constant, and the path of a schedule.

use super::axis::{Axis, Ruler};
use super::frame::{self, COLOURS};
use super::labels::Labels;
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN: [f64; 2] = [92.0, 44.0];
const PLOT: [f64; 2] = [640.0, 460.0];
const RIGHT: f64 = 36.0;
const RED: &str = "#d00000";
/// Of the texts in the plot.
const LABEL: f64 = 11.0;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PressurePlanePicture {
    /// Over the picture.
    pub title: String,
    /// For the first and the second pressure, lines on which it is constant: its value in kPa and displacements, mm.
    pub lines: [Vec<(f64, Vec<[f64; 2]>)>; 2],
    /// Names of the two pressures.
    pub names: [String; 2],
    /// Displacements of the states that were solved, mm.
    pub states: Vec<[f64; 2]>,
    /// Displacements over a schedule, closed by a straight line, mm; may be empty.
    pub path: Vec<[f64; 2]>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

impl PressurePlanePicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let all = |c: usize| {
            let lines = self.lines.iter().flatten().flat_map(|l| &l.1);
            lines
                .chain(&self.states)
                .chain(&self.path)
                .map(move |u| u[c])
        };
        let (right, bottom) = (MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]);
        let x = Axis::around(all(0), [MARGIN[0], right], 6);
        let y = Axis::around(all(1), [bottom, MARGIN[1]], 6);
        let place = |u: &[f64; 2]| [x.pixel(u[0]), y.pixel(u[1])];
        let width = right + RIGHT;
        let caption: Vec<String> = (self.caption.iter())
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = bottom + 56.0;
        let height = foot + 16.0 * (caption.len() + 1) as f64 + 14.0;
        let mut svg = Svg::new([width, height], &self.title);
        for (axis, across) in [(&x, true), (&y, false)] {
            let ruler = Ruler::Linear(axis.clone());
            for (at, label) in ruler.ticks() {
                let (from, to, text, anchor) = if across {
                    (
                        [at, bottom],
                        [at, MARGIN[1]],
                        [at, bottom + 18.0],
                        Anchor::Middle,
                    )
                } else {
                    (
                        [MARGIN[0], at],
                        [right, at],
                        [MARGIN[0] - 8.0, at + 4.5],
                        Anchor::End,
                    )
                };
                svg.line(from, to, "stroke=\"#e2e2e2\" stroke-width=\"1\"");
                svg.text(text, 13.0, anchor, "fill=\"#222222\"", &label);
            }
        }
        let axes = ["u_x (mm)", "u_y (mm)"];
        frame::draw(&mut svg, MARGIN, PLOT, &self.title, axes);
        let mut labels = Labels::new([MARGIN, [right, bottom]]);
        let mut ends = Vec::new();
        for (family, colour) in self.lines.iter().zip(COLOURS) {
            for (pressure, line) in family {
                let points: Vec<[f64; 2]> = line.iter().map(place).collect();
                let stroke = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\"");
                svg.path(&polyline(&points, false), &stroke);
                labels.lines(&points);
                if let Some(end) = points.last() {
                    let fill = format!("fill=\"{colour}\"");
                    ends.push((
                        *end,
                        format!("{}", (pressure * 100.0).round() / 100.0),
                        fill,
                    ));
                }
            }
        }
        for state in &self.states {
            svg.disc(place(state), 2.0, "fill=\"#222222\"");
        }
        let path: Vec<[f64; 2]> = self.path.iter().map(place).collect();
        let stroke =
            format!("fill=\"none\" stroke=\"{RED}\" stroke-width=\"2\" stroke-dasharray=\"7 4\"");
        svg.path(&polyline(&path, true), &stroke);
        labels.lines(&path);
        for (at, label, fill) in ends {
            let (at, anchor) = labels.beside(at, &label, LABEL);
            svg.text(at, LABEL, anchor, &fill, &label);
        }
        self.key(&mut svg, foot);
        frame::caption(&mut svg, foot + 16.0, &caption);
        svg.finish()
    }

    /// The line under the plot that says what its lines are.
    fn key(&self, svg: &mut Svg, foot: f64) {
        let mut at = 20.0;
        let mut entry = |colour: &str, dashes: &str, label: &str| {
            let y = foot + 12.0;
            let stroke = format!("stroke=\"{colour}\" stroke-width=\"2\" {dashes}");
            svg.line([at, y], [at + 24.0, y], &stroke);
            let dark = "fill=\"#333333\"";
            svg.text([at + 30.0, y + 4.0], 12.0, Anchor::Start, dark, label);
            at += 30.0 + text::width(label, 12.0) + 18.0;
        };
        for (name, colour) in self.names.iter().zip(COLOURS) {
            entry(colour, "", &format!("{name} constant (kPa)"));
        }
        if !self.path.is_empty() {
            entry(RED, "stroke-dasharray=\"7 4\"", "schedule");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_states_and_path_are_drawn_and_named() {
        let line = |p: f64| (p, vec![[0.0, p], [p, 2.0 * p]]);
        let picture = PressurePlanePicture {
            title: "a & b".into(),
            lines: [vec![line(0.0), line(7.5)], vec![line(15.0)]],
            names: ["lower".into(), "upper".into()],
            states: vec![[0.0, 0.0], [1.0, 3.0]],
            path: vec![[0.0, 0.0], [1.0, 1.0]],
            caption: vec!["a line".into()],
        };
        let svg = picture.svg();
        for part in [
            ">7.5<",
            ">15<",
            "lower constant",
            "upper constant",
            "schedule",
            ">a line<",
            RED,
        ] {
            assert!(svg.contains(part), "{part}");
        }
        let bare = PressurePlanePicture::default().svg();
        assert!(!bare.contains("schedule") && !bare.contains("NaN"));
    }
}

//! The hierarchical framework of a study as it ran (Figs. 1 and 3 of the paper): levels from top to bottom, the forward pass on
//! the left, the backward pass on the right, what each step took from others as arrows.

use super::frame;
use super::svg::{Anchor, Svg};
use super::text;

/// Width of a step's box, and the room between two of them, px.
const BOX: f64 = 236.0;
const GAP: [f64; 2] = [56.0, 62.0];
const MARGIN: f64 = 24.0;
/// Room for the names of the levels.
const LEVELS: f64 = 84.0;
const TITLE: f64 = 70.0;
const LINE: f64 = 16.0;
const SIZE: f64 = 12.0;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GraphPicture {
    /// Over the picture.
    pub title: String,
    /// Hierarchical steps.
    pub steps: Vec<GraphStep>,
    /// What was taken: indices of the giving and of the taking step, and as what.
    pub takes: Vec<(usize, usize, String)>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

/// A hierarchical step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GraphStep {
    /// Its name.
    pub id: String,
    /// Level, 1 on top.
    pub level: usize,
    /// Whether it belongs to the forward pass.
    pub forward: bool,
    /// Whether it has ended with candidates; else its frame is dashed.
    pub done: bool,
    /// What it is and what it found.
    pub lines: Vec<String>,
}

/// A box in the picture.
struct Placed {
    at: [f64; 2],
    height: f64,
    lines: Vec<String>,
}

impl Placed {
    fn middle(&self) -> [f64; 2] {
        [self.at[0] + 0.5 * BOX, self.at[1] + 0.5 * self.height]
    }
}

impl GraphPicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let mut levels: Vec<usize> = self.steps.iter().map(|s| s.level).collect();
        levels.sort_unstable();
        levels.dedup();
        let of = |level: usize, forward: bool| {
            let on = move |s: &&(usize, &GraphStep)| (s.1.level, s.1.forward) == (level, forward);
            let steps: Vec<_> = self.steps.iter().enumerate().collect();
            steps
                .iter()
                .filter(on)
                .map(|(i, _)| *i)
                .collect::<Vec<usize>>()
        };
        let widest = |forward: bool| {
            let counts = levels.iter().map(|level| of(*level, forward).len());
            counts.max().unwrap_or(0)
        };
        let passes = [widest(true), widest(false)];
        let across = |count: usize| count as f64 * (BOX + GAP[0]);
        let starts = [MARGIN + LEVELS, MARGIN + LEVELS + across(passes[0])];
        let width = (starts[1] + across(passes[1]) - GAP[0] + MARGIN).max(480.0);
        let mut placed: Vec<Option<Placed>> = self.steps.iter().map(|_| None).collect();
        let mut rows = Vec::new();
        let mut y = TITLE;
        for level in &levels {
            let mut tallest = 0.0_f64;
            for (pass, forward) in [true, false].into_iter().enumerate() {
                for (k, step) in of(*level, forward).into_iter().enumerate() {
                    let lines: Vec<String> = self.steps[step]
                        .lines
                        .iter()
                        .flat_map(|line| text::wrap(line, BOX - 20.0, SIZE))
                        .collect();
                    let height = LINE * (lines.len() + 1) as f64 + 18.0;
                    tallest = tallest.max(height);
                    placed[step] = Some(Placed {
                        at: [starts[pass] + across(k), y],
                        height,
                        lines,
                    });
                }
            }
            rows.push((y, tallest));
            y += tallest + GAP[1];
        }
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, width - 40.0, SIZE))
            .collect();
        let foot = y - GAP[1] + 18.0;
        let size = [width, foot + LINE * caption.len() as f64 + 16.0];
        let mut svg = Svg::new(size, &self.title);
        let dark = "fill=\"#222222\"";
        let bold = format!("{dark} font-weight=\"bold\"");
        let title = text::shortened_bold(&self.title, width - MARGIN - 12.0, 15.0);
        svg.text([MARGIN, 26.0], 15.0, Anchor::Start, &bold, &title);
        for (pass, name) in ["forward pass: simplify", "backward pass: solve"]
            .iter()
            .enumerate()
        {
            if passes[pass] > 0 {
                svg.text([starts[pass], 54.0], 13.0, Anchor::Start, dark, name);
            }
        }
        for (level, (top, tallest)) in levels.iter().zip(&rows) {
            let middle = top + 0.5 * tallest + 5.0;
            svg.text(
                [MARGIN, middle],
                14.0,
                Anchor::Start,
                &bold,
                &format!("level {level}"),
            );
        }
        for (from, to, label) in &self.takes {
            let ends = [from, to].map(|i| placed.get(*i).and_then(Option::as_ref));
            if let [Some(a), Some(b)] = ends {
                arrow(&mut svg, a, b, label);
            }
        }
        for (step, place) in self.steps.iter().zip(&placed) {
            if let Some(place) = place {
                draw(&mut svg, step, place);
            }
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }
}

fn draw(svg: &mut Svg, step: &GraphStep, place: &Placed) {
    let colour = if step.forward {
        frame::COLOURS[0]
    } else {
        frame::COLOURS[1]
    };
    let dash = if step.done {
        ""
    } else {
        " stroke-dasharray=\"6 4\""
    };
    let stroke =
        format!("fill=\"#ffffff\" stroke=\"{colour}\" stroke-width=\"1.6\" rx=\"6\"{dash}");
    svg.rectangle(place.at, [BOX, place.height], &stroke);
    let x = place.at[0] + 10.0;
    let mut y = place.at[1] + 20.0;
    let bold = "fill=\"#222222\" font-weight=\"bold\"";
    let id = text::shortened_bold(&step.id, BOX - 20.0, 13.0);
    svg.text([x, y], 13.0, Anchor::Start, bold, &id);
    for line in &place.lines {
        y += LINE;
        svg.text([x, y], SIZE, Anchor::Start, "fill=\"#333333\"", line);
    }
}

/// From the side of a box that faces the other one, to the facing side of that.
fn arrow(svg: &mut Svg, a: &Placed, b: &Placed, label: &str) {
    let (from, to) = (a.middle(), b.middle());
    let beside = (a.at[1] - b.at[1]).abs() < 1.0;
    let end = |of: &Placed, other: [f64; 2]| {
        let middle = of.middle();
        if beside {
            let right = other[0] > middle[0];
            let y = of.at[1] + 0.5 * a.height.min(b.height);
            [if right { of.at[0] + BOX } else { of.at[0] }, y]
        } else {
            // Apart from each other where several arrows meet: towards the side from which they come.
            let lean = (other[0] - middle[0]).clamp(-0.3 * BOX, 0.3 * BOX);
            let below = other[1] > middle[1];
            [
                middle[0] + lean,
                if below {
                    of.at[1] + of.height
                } else {
                    of.at[1]
                },
            ]
        }
    };
    let (start, tip) = (end(a, to), end(b, from));
    let stroke = "fill=\"none\" stroke=\"#444444\" stroke-width=\"1.4\"";
    svg.line(start, tip, stroke);
    let [dx, dy] = [tip[0] - start[0], tip[1] - start[1]];
    let length = dx.hypot(dy).max(1e-9);
    let (ux, uy) = (dx / length, dy / length);
    let wing = |side: f64| {
        [
            tip[0] - 9.0 * ux - side * 4.0 * uy,
            tip[1] - 9.0 * uy + side * 4.0 * ux,
        ]
    };
    let head = super::svg::polyline(&[wing(1.0), tip, wing(-1.0)], true);
    svg.path(&head, "fill=\"#444444\"");
    let wide = text::width(label, 11.0);
    let at = [start[0] + 0.5 * dx, start[1] + 0.5 * dy];
    let at = if beside { [at[0], at[1] - 8.0] } else { at };
    // A white ground keeps the label legible over its arrow.
    svg.rectangle(
        [at[0] - 0.5 * wide, at[1] - 10.0],
        [wide, 14.0],
        "fill=\"#ffffff\"",
    );
    svg.text(
        [at[0], at[1] + 1.0],
        11.0,
        Anchor::Middle,
        "fill=\"#444444\"",
        label,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(id: &str, level: usize, forward: bool, done: bool) -> GraphStep {
        GraphStep {
            id: id.to_owned(),
            level,
            forward,
            done,
            lines: vec!["a < b".to_owned()],
        }
    }

    #[test]
    fn every_step_and_every_take_is_drawn() {
        let picture = GraphPicture {
            title: "a framework".to_owned(),
            steps: vec![
                step("reduced", 2, true, true),
                step("layout", 3, false, true),
                step("chain", 1, false, false),
            ],
            takes: vec![(0, 1, "behaviour".into()), (1, 2, "starts".into())],
            caption: vec!["a caption".to_owned()],
        };
        let svg = picture.svg();
        for text in [
            "level 1",
            "level 2",
            "level 3",
            "reduced",
            "behaviour",
            "starts",
            "a &lt; b",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        // The one that has not ended, and no other.
        assert_eq!(svg.matches("stroke-dasharray").count(), 1);
        assert_eq!(svg.matches("rx=\"6\"").count(), 3);
    }
}

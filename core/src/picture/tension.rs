//! A tension test and the laws fitted to it: nominal stress against stretch.

use super::axis::{Ruler, Scale};
use super::frame::{self, COLOURS};
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN: [f64; 2] = [92.0, 44.0];
const PLOT: [f64; 2] = [600.0, 420.0];
const LEGEND_TEXT: f64 = 44.0;
/// Patterns of lines beyond the colours.
const DASHES: [&str; 3] = ["", " stroke-dasharray=\"7 4\"", " stroke-dasharray=\"2 3\""];

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TensionPicture {
    /// Over the picture.
    pub title: String,
    /// Stretch and stress (MPa) of all rows.
    pub points: Vec<[f64; 2]>,
    /// Laws by their names, as points of their curves.
    pub curves: Vec<(String, Vec<[f64; 2]>)>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

impl TensionPicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let ([left, top], [right, bottom]) = (MARGIN, [MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]]);
        let all = |k: usize| self.points.iter().map(move |p| p[k]);
        let x = Ruler::new(Scale::Linear, all(0).chain([1.0]), [left, right]);
        // A law may leave the data far behind; its curve ends at the frame.
        let y = Ruler::new(Scale::Linear, all(1).chain([0.0]), [bottom, top]);
        let widest = self.curves.iter().map(|c| text::width(&c.0, 12.0));
        let width = right + LEGEND_TEXT + widest.fold(0.0, f64::max) + 12.0;
        let caption: Vec<String> = (self.caption.iter())
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = bottom + 56.0;
        let height = foot + 16.0 * caption.len() as f64 + 14.0;
        let mut svg = Svg::new([width, height], &self.title);
        let (dark, grey) = ("fill=\"#222222\"", "stroke=\"#cccccc\" stroke-width=\"1\"");
        for (at, label) in x.ticks() {
            svg.line([at, bottom], [at, top], grey);
            svg.text([at, bottom + 18.0], 13.0, Anchor::Middle, dark, &label);
        }
        for (at, label) in y.ticks() {
            svg.line([left, at], [right, at], grey);
            svg.text([left - 8.0, at + 4.5], 13.0, Anchor::End, dark, &label);
        }
        let labels = ["stretch", "nominal stress (MPa)"];
        frame::draw(&mut svg, MARGIN, PLOT, &self.title, labels);
        let place = |p: &[f64; 2]| Some([x.pixel(p[0])?, y.pixel(p[1])?]);
        for p in self.points.iter().filter_map(place) {
            svg.disc(
                p,
                2.5,
                "fill=\"none\" stroke=\"#222222\" stroke-width=\"1\"",
            );
        }
        for (i, (name, points)) in self.curves.iter().enumerate() {
            let stroke = format!(
                "fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}",
                COLOURS[i % COLOURS.len()],
                DASHES[(i + i / COLOURS.len()) % DASHES.len()]
            );
            let placed: Vec<[f64; 2]> = points.iter().filter_map(place).collect();
            let inside = |p: &[f64; 2]| (top..=bottom).contains(&p[1]);
            for run in placed.split(|p| !inside(p)) {
                svg.path(&polyline(run, false), &stroke);
            }
            let at = [right + 14.0, top + 14.0 + 22.0 * i as f64];
            svg.line([at[0], at[1] - 4.0], [at[0] + 24.0, at[1] - 4.0], &stroke);
            svg.text(
                [right + LEGEND_TEXT, at[1]],
                12.0,
                Anchor::Start,
                dark,
                name,
            );
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_end_at_the_frame_and_every_row_is_drawn() {
        let picture = TensionPicture {
            points: vec![[1.0, 0.0], [1.5, 0.3], [2.0, 0.5]],
            curves: vec![("a & b".into(), vec![[1.0, 0.0], [1.5, 0.2], [2.0, 90.0]])],
            ..TensionPicture::default()
        };
        let svg = picture.svg();
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(svg.contains("a &amp; b") && !svg.contains("NaN"));
        let curve = svg
            .lines()
            .find(|l| l.contains("stroke-width=\"1.8\""))
            .expect("a curve");
        assert_eq!(curve.matches('L').count(), 1);
    }
}

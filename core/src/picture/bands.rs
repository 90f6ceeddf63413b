//! Staircases with bands: what several methods have reached for what they cost.

use super::axis::{Ruler, Scale};
use super::frame::{self, COLOURS};
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN: [f64; 2] = [92.0, 44.0];
const PLOT: [f64; 2] = [600.0, 380.0];
/// Where the legend's texts begin, from the plot.
const LEGEND_TEXT: f64 = 54.0;
/// Widest text of the legend: longer ones are broken.
const LEGEND_WIDTH: f64 = 310.0;
/// What is right of the plot without a legend: half of a tick's label and more.
const RIGHT: f64 = 30.0;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BandPicture {
    /// Over the picture.
    pub title: String,
    /// Under the horizontal axis, with its unit.
    pub x_label: String,
    /// Beside the vertical axis, with its unit.
    pub y_label: String,
    /// Scales of the horizontal and of the vertical axis.
    pub scales: [Scale; 2],
    /// Values that the vertical axis holds in any case.
    pub within: Vec<f64>,
    /// Where the vertical axis ends: what is above is drawn at its end.
    pub top: Option<f64>,
    /// One for each method.
    pub series: Vec<BandSeries>,
    /// A horizontal line with its label.
    pub level: Option<(f64, String)>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

/// A staircase.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BandSeries {
    /// Its name in the legend, which is left out where there is but one.
    pub label: String,
    /// Points in ascending order; each holds until the next.
    pub steps: Vec<BandStep>,
}

/// A point of a staircase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BandStep {
    /// Cost.
    pub at: f64,
    /// The line; `None`: not drawn here.
    pub middle: Option<f64>,
    /// Ends of the band; without a high end it is open upwards, without a low one there is no band.
    pub band: [Option<f64>; 2],
}

impl BandStep {
    /// A point without a band.
    pub fn plain(at: f64, middle: f64) -> Self {
        let middle = Some(middle);
        let band = [None; 2];
        Self { at, middle, band }
    }
}

struct Axes {
    x: Ruler,
    y: Ruler,
}

impl Axes {
    /// What is above the frame stands at its edge.
    fn y(&self, value: f64) -> Option<f64> {
        Some(self.y.pixel(value)?.max(MARGIN[1]))
    }
}

impl BandPicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let (right, bottom) = (MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]);
        let steps = || self.series.iter().flat_map(|s| &s.steps);
        let zero = (self.scales[0] == Scale::Linear).then_some(0.0);
        let values = steps().flat_map(|s| [s.middle, s.band[0], s.band[1]]);
        let values = values.flatten().chain(self.level.iter().map(|l| l.0));
        let top = self.top.unwrap_or(f64::INFINITY);
        let values = values.map(|value| value.min(top));
        let axes = Axes {
            x: Ruler::new(
                self.scales[0],
                steps().map(|s| s.at).chain(zero),
                [MARGIN[0], right],
            ),
            y: Ruler::new(
                self.scales[1],
                values.chain(self.within.iter().copied()),
                [bottom, MARGIN[1]],
            ),
        };
        let legend = self.legend();
        let widest = legend.iter().flatten().map(|line| text::width(line, 12.0));
        let widest = widest.reduce(f64::max);
        let width = right + widest.map_or(RIGHT, |w| LEGEND_TEXT + w + 12.0);
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let below = |lines: &Vec<String>| 8.0 + 15.0 * lines.len() as f64;
        let foot = (bottom + 56.0).max(MARGIN[1] + legend.iter().map(below).sum::<f64>());
        let height = foot + 16.0 * caption.len() as f64 + 14.0;
        let mut svg = Svg::new([width, height], &self.title);
        self.grid(&mut svg, &axes);
        for (i, series) in self.series.iter().enumerate() {
            series.band(&mut svg, &axes, COLOURS[i % COLOURS.len()]);
        }
        let level = self.level.as_ref();
        if let Some((at, label)) = level.and_then(|(v, label)| Some((axes.y.pixel(*v)?, label))) {
            let dashes = "stroke=\"#444444\" stroke-width=\"1\" stroke-dasharray=\"6 4\"";
            svg.line([MARGIN[0], at], [right, at], dashes);
            let place = [right - 6.0, at - 5.0];
            svg.text(place, 11.0, Anchor::End, "fill=\"#444444\"", label);
        }
        for (i, series) in self.series.iter().enumerate() {
            for run in series.runs(&axes) {
                svg.path(&polyline(&run, false), &frame::stroke(i));
            }
        }
        let mut y = MARGIN[1] + 10.0;
        for (i, lines) in legend.iter().enumerate() {
            svg.line([right + 16.0, y], [right + 46.0, y], &frame::stroke(i));
            for (k, line) in lines.iter().enumerate() {
                let at = [right + LEGEND_TEXT, y + 4.0 + 15.0 * k as f64];
                svg.text(at, 12.0, Anchor::Start, "fill=\"#222222\"", line);
            }
            y += below(lines);
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }

    fn legend(&self) -> Vec<Vec<String>> {
        match &self.series[..] {
            [] | [_] => Vec::new(),
            all => all
                .iter()
                .map(|s| text::wrap(&s.label, LEGEND_WIDTH, 12.0))
                .collect(),
        }
    }

    fn grid(&self, svg: &mut Svg, axes: &Axes) {
        let ([left, top], [right, bottom]) = (MARGIN, [MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]]);
        let dark = "fill=\"#222222\"";
        let grey = |shade: &str| format!("stroke=\"#{shade}\" stroke-width=\"1\"");
        for at in axes.x.minor() {
            svg.line([at, bottom], [at, top], &grey("f0f0f0"));
        }
        for (at, label) in axes.x.ticks() {
            svg.line([at, bottom], [at, top], &grey("e0e0e0"));
            svg.text([at, bottom + 18.0], 13.0, Anchor::Middle, dark, &label);
        }
        for (at, label) in axes.y.ticks() {
            svg.line([left, at], [right, at], &grey("e0e0e0"));
            svg.text([left - 8.0, at + 4.5], 13.0, Anchor::End, dark, &label);
        }
        let labels = [self.x_label.as_str(), self.y_label.as_str()];
        frame::draw(svg, [left, top], PLOT, &self.title, labels);
    }
}

impl BandSeries {
    /// From each step to the next, in px.
    fn spans<'a>(&'a self, axes: &'a Axes) -> impl Iterator<Item = (&'a BandStep, [f64; 2])> + 'a {
        let ends = self.steps.iter().skip(1).chain(self.steps.last());
        let spans = self.steps.iter().zip(ends);
        spans
            .filter_map(|(step, end)| Some((step, [axes.x.pixel(step.at)?, axes.x.pixel(end.at)?])))
    }

    /// The bands of steps that follow on each other are one shape. What the axis cannot show, as 0 of a logarithmic one, is at its foot.
    fn band(&self, svg: &mut Svg, axes: &Axes, colour: &str) {
        let fill = format!("fill=\"{colour}\" fill-opacity=\"0.18\" stroke=\"none\"");
        let spans: Vec<_> = self.spans(axes).collect();
        for run in spans.split(|(step, _)| step.band[0].is_none()) {
            let (mut lower, mut upper) = (Vec::new(), Vec::new());
            for (step, [from, to]) in run {
                let low = step.band[0].and_then(|v| axes.y(v));
                let low = low.unwrap_or(MARGIN[1] + PLOT[1]);
                let high = step.band[1].and_then(|v| axes.y(v));
                let high = high.unwrap_or(MARGIN[1]);
                lower.extend([[*from, low], [*to, low]]);
                upper.extend([[*from, high], [*to, high]]);
            }
            if lower.is_empty() {
                continue;
            }
            upper.reverse();
            svg.path(&polyline(&[lower, upper].concat(), true), &fill);
        }
    }

    /// The line as a staircase, cut where it is not known.
    fn runs(&self, axes: &Axes) -> Vec<Vec<[f64; 2]>> {
        let mut runs: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
        for (step, [from, to]) in self.spans(axes) {
            match step.middle.and_then(|v| axes.y(v)) {
                Some(at) => runs
                    .last_mut()
                    .unwrap_or(&mut Vec::new())
                    .extend([[from, at], [to, at]]),
                None => runs.push(Vec::new()),
            }
        }
        runs.retain(|run| !run.is_empty());
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(label: &str) -> BandSeries {
        let step = |at, middle, low, high| BandStep {
            at,
            middle,
            band: [low, high],
        };
        BandSeries {
            label: label.into(),
            steps: vec![
                step(1.0, None, Some(3.0), None),
                step(2.0, Some(4.0), Some(2.0), None),
                step(4.0, Some(2.0), Some(1.0), Some(5.0)),
                step(8.0, Some(2.0), Some(1.0), Some(3.0)),
            ],
        }
    }

    #[test]
    fn a_line_is_cut_and_a_band_open_where_they_are_not_known() {
        let axes = Axes {
            x: Ruler::new(Scale::Linear, [0.0, 10.0].into_iter(), [0.0, 10.0]),
            y: Ruler::new(Scale::Linear, [0.0, 10.0].into_iter(), [144.0, 44.0]),
        };
        let one = series("a");
        let line = [[2.0, 104.0], [4.0, 104.0], [4.0, 124.0], [8.0, 124.0]];
        let runs = one.runs(&axes);
        assert_eq!(runs.len(), 1);
        assert_eq!(runs[0][..4], line);
        let mut svg = Svg::new([10.0, 200.0], "");
        one.band(&mut svg, &axes, "#000");
        let svg = svg.finish();
        assert!(svg.contains("M1 114L2 114L2 124L4 124L4 134"), "{svg}");
        assert!(svg.contains("L2 44L1 44Z"), "open upwards: {svg}");
        assert_eq!(axes.y(90.0), Some(44.0));
        // Two bands with a step between them that has none.
        let mut two = series("b");
        two.steps[1].band = [None; 2];
        let mut svg = Svg::new([10.0, 200.0], "");
        two.band(&mut svg, &axes, "#000");
        assert_eq!(svg.finish().matches("<path").count(), 2);
    }

    #[test]
    fn one_method_has_no_legend_and_nothing_is_still_a_picture() {
        let mut picture = BandPicture {
            series: vec![series("first & only"), series("second")],
            level: Some((2.0, "target".into())),
            ..BandPicture::default()
        };
        let svg = picture.svg();
        assert!(svg.contains("first &amp; only") && svg.contains(">target<"));
        assert!(svg.contains("stroke-dasharray=\"9 4\""));
        picture.series.pop();
        assert!(!picture.svg().contains("first"));
        let empty = BandPicture::default().svg();
        assert!(empty.ends_with("</svg>\n") && !empty.contains("NaN"));
    }
}

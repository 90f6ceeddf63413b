//! Points on logarithmic or linear axes: error against run time, an optimum against what was swept.

use super::axis::{Ruler, Scale};
use super::frame::{self, COLOURS};
use super::labels::Labels;
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN: [f64; 2] = [92.0, 44.0];
const PLOT: [f64; 2] = [600.0, 420.0];
/// Where the legend's texts begin, from the plot.
const LEGEND_TEXT: f64 = 30.0;
/// What is right of the plot without a legend: half of a tick's label and more.
const RIGHT: f64 = 30.0;
/// Of the texts beside points.
const LABEL: f64 = 11.0;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterPicture {
    /// Over the picture.
    pub title: String,
    /// Under the horizontal axis, with its unit.
    pub x_label: String,
    /// Beside the vertical axis, with its unit.
    pub y_label: String,
    /// Scales of the two axes.
    pub scales: [Scale; 2],
    /// Families of points.
    pub series: Vec<ScatterSeries>,
    /// A horizontal line with its label.
    pub level: Option<(f64, String)>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

/// A family of points; those that an axis cannot show are left out: not finite, or not positive on a logarithmic one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterSeries {
    /// Its name in the legend, which is left out where there is but one family.
    pub label: String,
    /// Points with the text beside them.
    pub points: Vec<([f64; 2], String)>,
    /// Whether a line joins them in their order.
    pub joined: bool,
}

impl ScatterPicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let all = |k: usize| {
            let points = self.series.iter().flat_map(|s| &s.points);
            points.map(move |p| p.0[k])
        };
        let level = self.level.as_ref().map(|l| l.0);
        let (right, bottom) = (MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]);
        let [x_scale, y_scale] = self.scales;
        let x = Ruler::new(x_scale, all(0), [MARGIN[0], right]);
        let y = Ruler::new(y_scale, all(1).chain(level), [bottom, MARGIN[1]]);
        let legend: &[ScatterSeries] = match &self.series[..] {
            [_] => &[],
            all => all,
        };
        let widest = legend.iter().map(|s| text::width(&s.label, 12.0));
        let widest = widest.reduce(f64::max);
        let width = right + widest.map_or(RIGHT, |w| LEGEND_TEXT + w + 12.0);
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = bottom + 56.0;
        let mut svg = Svg::new(
            [width, foot + 16.0 * caption.len() as f64 + 14.0],
            &self.title,
        );
        self.axes(&mut svg, &x, &y);
        let mut labels = Labels::new([MARGIN, [right, bottom]]);
        let level = self.level.as_ref();
        let level = level.and_then(|(value, label)| Some((y.pixel(*value)?, label)));
        if let Some((at, _)) = level {
            let dashes = "stroke=\"#444444\" stroke-width=\"1\" stroke-dasharray=\"6 4\"";
            svg.line([MARGIN[0], at], [right, at], dashes);
            labels.lines(&[[MARGIN[0], at], [right, at]]);
        }
        let mut texts = Vec::new();
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let fill = format!("fill=\"{colour}\"");
            let (points, beside): (Vec<[f64; 2]>, Vec<&String>) = series
                .points
                .iter()
                .filter_map(|(p, label)| Some(([x.pixel(p[0])?, y.pixel(p[1])?], label)))
                .unzip();
            if series.joined {
                let stroke = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"");
                svg.path(&polyline(&points, false), &stroke);
                labels.lines(&points);
            }
            for (p, label) in points.into_iter().zip(beside) {
                svg.disc(p, 3.5, &fill);
                labels.disc(p, 4.5);
                if !label.is_empty() {
                    texts.push((p, label, fill.clone()));
                }
            }
        }
        if let Some((at, label)) = level {
            let ends = [
                ([right - 6.0, at - 5.0], Anchor::End),
                ([right - 6.0, at + 13.0], Anchor::End),
                ([MARGIN[0] + 6.0, at - 5.0], Anchor::Start),
                ([MARGIN[0] + 6.0, at + 13.0], Anchor::Start),
            ];
            let (at, anchor) = labels.best(&ends, label, 12.0);
            svg.text(at, 12.0, anchor, "fill=\"#444444\"", label);
        }
        for (p, label, fill) in texts {
            let (at, anchor) = labels.beside(p, label, LABEL);
            svg.text(at, LABEL, anchor, &fill, label);
        }
        for (i, series) in legend.iter().enumerate() {
            let at = [right + 18.0, MARGIN[1] + 14.0 + 22.0 * i as f64];
            let colour = COLOURS[i % COLOURS.len()];
            svg.disc([at[0], at[1] - 4.0], 4.0, &format!("fill=\"{colour}\""));
            svg.text(
                [right + LEGEND_TEXT, at[1]],
                12.0,
                Anchor::Start,
                "fill=\"#222222\"",
                &series.label,
            );
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }

    fn axes(&self, svg: &mut Svg, x: &Ruler, y: &Ruler) {
        let ([left, top], [right, bottom]) = (MARGIN, [MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]]);
        let dark = "fill=\"#222222\"";
        let shade = |minor: bool| {
            let grey = if minor { "#f0f0f0" } else { "#cccccc" };
            format!("stroke=\"{grey}\" stroke-width=\"1\"")
        };
        for at in x.minor() {
            svg.line([at, bottom], [at, top], &shade(true));
        }
        for at in y.minor() {
            svg.line([left, at], [right, at], &shade(true));
        }
        for (at, label) in x.ticks() {
            svg.line([at, bottom], [at, top], &shade(false));
            svg.text([at, bottom + 18.0], 13.0, Anchor::Middle, dark, &label);
        }
        for (at, label) in y.ticks() {
            svg.line([left, at], [right, at], &shade(false));
            svg.text([left - 8.0, at + 4.5], 13.0, Anchor::End, dark, &label);
        }
        frame::draw(
            svg,
            [left, top],
            PLOT,
            &self.title,
            [&self.x_label, &self.y_label],
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_a_logarithm_are_left_out() {
        let picture = ScatterPicture {
            series: vec![ScatterSeries {
                label: "a & b".into(),
                points: vec![
                    ([1.0, 0.1], "one".into()),
                    ([2.0, 0.0], "none".into()),
                    ([f64::NAN, 1.0], "neither".into()),
                ],
                joined: true,
            }],
            ..ScatterPicture::default()
        };
        let svg = picture.svg();
        assert!(svg.contains(">one<") && !svg.contains("none<") && !svg.contains("NaN"));
        let linear = ScatterPicture {
            scales: [Scale::Linear; 2],
            ..picture
        };
        let svg = linear.svg();
        assert!(svg.contains(">none<") && !svg.contains("NaN") && !svg.contains("neither"));
    }

    #[test]
    fn a_legend_fits_and_one_family_has_none() {
        let family = |label: &str| ScatterSeries {
            label: label.into(),
            points: vec![([1.0, 1.0], String::new())],
            joined: false,
        };
        let long = "enclosed area of the best design (mm\u{b2}) & more";
        let mut picture = ScatterPicture {
            series: vec![family(long), family("short")],
            ..ScatterPicture::default()
        };
        let svg = picture.svg();
        let width = svg.split('"').nth(3).expect("a width");
        let width: f64 = width.parse().expect("px");
        assert!(width >= MARGIN[0] + PLOT[0] + LEGEND_TEXT + text::width(long, 12.0));
        assert!(svg.contains("& more".replace('&', "&amp;").as_str()));
        picture.series.pop();
        assert!(!picture.svg().contains("enclosed"));
    }
}

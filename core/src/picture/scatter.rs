//! Points on two logarithmic axes: error against run time.

use super::frame::{self, COLOURS};
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN: [f64; 2] = [92.0, 44.0];
const PLOT: [f64; 2] = [600.0, 420.0];
const LEGEND: f64 = 230.0;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterPicture {
    /// Over the picture.
    pub title: String,
    /// Under the horizontal axis, with its unit.
    pub x_label: String,
    /// Beside the vertical axis, with its unit.
    pub y_label: String,
    /// Families of points.
    pub series: Vec<ScatterSeries>,
    /// A horizontal line with its label.
    pub level: Option<(f64, String)>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

/// A family of points; those that are not positive are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterSeries {
    /// Its name in the legend.
    pub label: String,
    /// Points with the text beside them.
    pub points: Vec<([f64; 2], String)>,
    /// Whether a line joins them in their order.
    pub joined: bool,
}

/// Whole decades that hold all positive values.
fn decades(values: impl Iterator<Item = f64>) -> [i32; 2] {
    let (low, high) = values
        .filter(|v| v.is_finite() && *v > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    if high == 0.0 {
        return [-1, 0];
    }
    let ends = [low.log10().floor() as i32, high.log10().ceil() as i32];
    [ends[0], ends[1].max(ends[0] + 1)]
}

impl ScatterPicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let all = || self.series.iter().flat_map(|s| &s.points);
        let x = decades(all().map(|p| p.0[0]));
        let level = self.level.as_ref().map(|l| l.0);
        let y = decades(all().map(|p| p.0[1]).chain(level));
        let width = MARGIN[0] + PLOT[0] + LEGEND;
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = MARGIN[1] + PLOT[1] + 56.0;
        let mut svg = Svg::new(
            [width, foot + 16.0 * caption.len() as f64 + 14.0],
            &self.title,
        );
        let place = |[a, b]: [f64; 2]| {
            let along =
                |v: f64, [from, to]: [i32; 2]| (v.log10() - f64::from(from)) / f64::from(to - from);
            [
                MARGIN[0] + PLOT[0] * along(a, x),
                MARGIN[1] + PLOT[1] * (1.0 - along(b, y)),
            ]
        };
        self.axes(&mut svg, x, y, &place);
        if let Some((value, label)) = &self.level {
            let [_, at] = place([10_f64.powi(x[0]), *value]);
            let right = MARGIN[0] + PLOT[0];
            let dashes = "stroke=\"#444444\" stroke-width=\"1\" stroke-dasharray=\"6 4\"";
            svg.line([MARGIN[0], at], [right, at], dashes);
            let grey = "fill=\"#444444\"";
            svg.text([right - 6.0, at - 5.0], 12.0, Anchor::End, grey, label);
        }
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let points: Vec<([f64; 2], &String)> = series
                .points
                .iter()
                .filter(|(p, _)| p.iter().all(|v| v.is_finite() && *v > 0.0))
                .map(|(p, label)| (place(*p), label))
                .collect();
            if series.joined {
                let line: Vec<[f64; 2]> = points.iter().map(|(p, _)| *p).collect();
                let stroke = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"");
                svg.path(&polyline(&line, false), &stroke);
            }
            for (p, label) in &points {
                svg.disc(*p, 3.5, &format!("fill=\"{colour}\""));
                let fill = format!("fill=\"{colour}\"");
                svg.text([p[0] + 6.0, p[1] - 5.0], 11.0, Anchor::Start, &fill, label);
            }
            let at = [
                MARGIN[0] + PLOT[0] + 18.0,
                MARGIN[1] + 14.0 + 22.0 * i as f64,
            ];
            svg.disc([at[0], at[1] - 4.0], 4.0, &format!("fill=\"{colour}\""));
            let dark = "fill=\"#222222\"";
            svg.text(
                [at[0] + 12.0, at[1]],
                12.0,
                Anchor::Start,
                dark,
                &series.label,
            );
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }

    fn axes(&self, svg: &mut Svg, x: [i32; 2], y: [i32; 2], place: &impl Fn([f64; 2]) -> [f64; 2]) {
        let ([left, top], [right, bottom]) = (MARGIN, [MARGIN[0] + PLOT[0], MARGIN[1] + PLOT[1]]);
        let dark = "fill=\"#222222\"";
        let shade = |minor: bool| {
            let grey = if minor { "#f0f0f0" } else { "#cccccc" };
            format!("stroke=\"{grey}\" stroke-width=\"1\"")
        };
        let label = |power: i32| match power {
            -3..=3 => format!("{}", 10_f64.powi(power)),
            _ => format!("1e{power}").replace('-', "\u{2212}"),
        };
        for minor in [true, false] {
            for power in x[0]..=x[1] {
                for m in if minor { 2..=9 } else { 1..=1 } {
                    let at = place([f64::from(m) * 10_f64.powi(power), 1.0])[0];
                    if at <= right + 0.5 {
                        svg.line([at, bottom], [at, top], &shade(minor));
                    }
                    if !minor {
                        svg.text(
                            [at, bottom + 18.0],
                            13.0,
                            Anchor::Middle,
                            dark,
                            &label(power),
                        );
                    }
                }
            }
            for power in y[0]..=y[1] {
                for m in if minor { 2..=9 } else { 1..=1 } {
                    let at = place([1.0, f64::from(m) * 10_f64.powi(power)])[1];
                    if at >= top - 0.5 {
                        svg.line([left, at], [right, at], &shade(minor));
                    }
                    if !minor {
                        svg.text(
                            [left - 8.0, at + 4.5],
                            13.0,
                            Anchor::End,
                            dark,
                            &label(power),
                        );
                    }
                }
            }
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
    fn decades_hold_the_values() {
        assert_eq!(decades([0.02, 3.0].into_iter()), [-2, 1]);
        assert_eq!(decades([1.0].into_iter()), [0, 1]);
        assert_eq!(decades([f64::NAN, 0.0].into_iter()), [-1, 0]);
    }

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
        assert!(svg.contains("a &amp; b") && svg.contains(">one<"));
        assert!(!svg.contains("none<") && !svg.contains("NaN"));
    }
}

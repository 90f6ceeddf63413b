//! Run time against objective (the paper's Fig. 10): each restart dotted, the best so far solid, parts where walls
//! overlap dashed and labelled.

use super::axis::Axis;
use super::svg::{Anchor, Svg, polyline, wrap};

/// Okabe and Ito's colours without yellow and black.
const COLOURS: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00",
];
const MARGIN_LEFT: f64 = 92.0;
const MARGIN_TOP: f64 = 44.0;
const PLOT: [f64; 2] = [600.0, 380.0];
const LEGEND: f64 = 236.0;

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurvePicture {
    /// Over the picture.
    pub title: String,
    /// Under the horizontal axis, with its unit.
    pub time_label: String,
    /// Beside the vertical axis, with its unit.
    pub objective_label: String,
    /// One for each restart.
    pub restarts: Vec<CurveSeries>,
    /// The best so far over all restarts; empty: not drawn.
    pub best: Vec<CurvePoint>,
    /// Lines under the picture: p/mu, schedule, units, tip and limits.
    pub caption: Vec<String>,
}

/// A line of the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveSeries {
    /// Its name in the legend.
    pub label: String,
    /// Points in ascending time; between two points the earlier value holds.
    pub points: Vec<CurvePoint>,
}

/// A point of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvePoint {
    /// Time or count.
    pub at: f64,
    /// Objective; points that are not finite are left out.
    pub objective: f64,
    /// Whether walls overlap from here to the next point.
    pub overlapped: bool,
}

impl CurvePicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let width = MARGIN_LEFT + PLOT[0] + LEGEND;
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = MARGIN_TOP + PLOT[1] + 56.0;
        let height = foot + 16.0 * caption.len() as f64 + 14.0;
        let mut svg = Svg::new([width, height], &self.title);
        let all = || {
            self.restarts
                .iter()
                .flat_map(|s| &s.points)
                .chain(&self.best)
        };
        let time = Axis::around(
            all().map(|p| p.at).chain([0.0]),
            [MARGIN_LEFT, MARGIN_LEFT + PLOT[0]],
            7,
        );
        let objective = Axis::around(
            all().map(|p| p.objective),
            [MARGIN_TOP + PLOT[1], MARGIN_TOP],
            7,
        );
        self.axes(&mut svg, &time, &objective);
        let end = all()
            .map(|p| p.at)
            .filter(|t| t.is_finite())
            .fold(0.0, f64::max);
        // The restarts lie over the best, which then shows through their dots.
        for run in runs(&self.best, end) {
            let points: Vec<[f64; 2]> = run
                .points
                .iter()
                .map(|[t, f]| [time.pixel(*t), objective.pixel(*f)])
                .collect();
            svg.path(
                &polyline(&points, false),
                &stroke("#000000", run.overlapped, true),
            );
        }
        let mut first_overlap: Option<[f64; 2]> = None;
        for (i, series) in self.restarts.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let last = series.points.last().map_or(0.0, |p| p.at);
            for run in runs(&series.points, last) {
                let points: Vec<[f64; 2]> = run
                    .points
                    .iter()
                    .map(|[t, f]| [time.pixel(*t), objective.pixel(*f)])
                    .collect();
                if run.overlapped {
                    first_overlap = first_overlap.or(points.first().copied());
                }
                svg.path(
                    &polyline(&points, false),
                    &stroke(colour, run.overlapped, false),
                );
            }
            if let Some(p) = series.points.iter().rfind(|p| p.objective.is_finite()) {
                svg.disc(
                    [time.pixel(p.at), objective.pixel(p.objective)],
                    2.6,
                    &format!("fill=\"{colour}\""),
                );
            }
        }
        if let Some([x, y]) = first_overlap {
            let x = x.min(MARGIN_LEFT + PLOT[0] - 90.0);
            let white = "fill=\"#ffffff\" fill-opacity=\"0.85\"";
            svg.rectangle([x, y - 18.0], [82.0, 15.0], white);
            svg.text(
                [x + 2.0, y - 6.0],
                12.0,
                Anchor::Start,
                "fill=\"#333333\"",
                "walls overlap",
            );
        }
        self.legend(&mut svg, first_overlap.is_some());
        for (i, line) in caption.iter().enumerate() {
            let y = foot + 16.0 * (i + 1) as f64;
            svg.text([20.0, y], 12.0, Anchor::Start, "fill=\"#333333\"", line);
        }
        svg.finish()
    }

    fn axes(&self, svg: &mut Svg, time: &Axis, objective: &Axis) {
        let [left, right] = time.pixels;
        let [bottom, top] = objective.pixels;
        let (grid, dark) = ("stroke=\"#e0e0e0\" stroke-width=\"1\"", "fill=\"#222222\"");
        for (value, label) in time.ticks() {
            let x = time.pixel(value);
            svg.line([x, bottom], [x, top], grid);
            svg.text([x, bottom + 18.0], 13.0, Anchor::Middle, dark, &label);
        }
        for (value, label) in objective.ticks() {
            let y = objective.pixel(value);
            svg.line([left, y], [right, y], grid);
            svg.text([left - 8.0, y + 4.5], 13.0, Anchor::End, dark, &label);
        }
        let frame = "fill=\"none\" stroke=\"#444444\" stroke-width=\"1\"";
        svg.rectangle([left, top], [right - left, bottom - top], frame);
        let middle = [f64::midpoint(left, right), f64::midpoint(top, bottom)];
        svg.text(
            [middle[0], bottom + 42.0],
            14.0,
            Anchor::Middle,
            dark,
            &self.time_label,
        );
        let turned = format!("{dark} transform=\"rotate(-90 22 {:.1})\"", middle[1]);
        svg.text(
            [22.0, middle[1]],
            14.0,
            Anchor::Middle,
            &turned,
            &self.objective_label,
        );
        let bold = format!("{dark} font-weight=\"bold\"");
        svg.text([left, 26.0], 15.0, Anchor::Start, &bold, &self.title);
    }

    fn legend(&self, svg: &mut Svg, overlaps: bool) {
        const SHOWN: usize = 18;
        let x = MARGIN_LEFT + PLOT[0] + 16.0;
        let mut y = MARGIN_TOP + 10.0;
        let mut entry = |svg: &mut Svg, style: &str, label: &str| {
            svg.line([x, y], [x + 30.0, y], style);
            svg.text(
                [x + 38.0, y + 4.0],
                12.0,
                Anchor::Start,
                "fill=\"#222222\"",
                label,
            );
            y += 19.0;
        };
        if !self.best.is_empty() {
            entry(svg, &stroke("#000000", false, true), "best so far");
        }
        for (i, series) in self.restarts.iter().take(SHOWN).enumerate() {
            let style = stroke(COLOURS[i % COLOURS.len()], false, false);
            entry(svg, &style, &series.label);
        }
        if self.restarts.len() > SHOWN {
            let more = format!("and {} more restarts", self.restarts.len() - SHOWN);
            entry(svg, "stroke=\"none\"", &more);
        }
        if overlaps {
            entry(
                svg,
                &stroke("#555555", true, false),
                "walls overlap: not counted",
            );
        }
    }
}

/// Solid for the best, dotted for a restart, dashed where walls overlap.
fn stroke(colour: &str, overlapped: bool, best: bool) -> String {
    let (width, dashes) = match (overlapped, best) {
        (true, _) => (1.8, " stroke-dasharray=\"8 5\""),
        (false, true) => (2.6, ""),
        (false, false) => (2.0, " stroke-dasharray=\"0.1 4\" stroke-linecap=\"round\""),
    };
    format!(
        "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}"
    )
}

struct Run {
    overlapped: bool,
    points: Vec<[f64; 2]>,
}

/// The staircase of a line, cut where the walls begin or cease to overlap; the last value holds until `end`.
fn runs(points: &[CurvePoint], end: f64) -> Vec<Run> {
    let finite: Vec<&CurvePoint> = points
        .iter()
        .filter(|p| p.objective.is_finite() && p.at.is_finite())
        .collect();
    let mut runs: Vec<Run> = Vec::new();
    for (i, point) in finite.iter().enumerate() {
        let next = finite.get(i + 1).map_or(end.max(point.at), |p| p.at);
        let corner = [point.at, point.objective];
        let hold = [next, point.objective];
        match runs.last_mut() {
            Some(run) if run.overlapped == point.overlapped => {
                run.points.extend([corner, hold]);
            }
            _ => {
                // The riser belongs to the part that it ends in.
                let riser = runs.last().and_then(|run| run.points.last().copied());
                runs.push(Run {
                    overlapped: point.overlapped,
                    points: riser.into_iter().chain([corner, hold]).collect(),
                });
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(at: f64, objective: f64, overlapped: bool) -> CurvePoint {
        CurvePoint {
            at,
            objective,
            overlapped,
        }
    }

    #[test]
    fn a_staircase_is_cut_where_walls_overlap() {
        let points = [
            point(0.0, 1.0, false),
            point(1.0, f64::NAN, false),
            point(2.0, -3.0, false),
            point(3.0, -5.0, true),
        ];
        let runs = runs(&points, 4.0);
        let flat: Vec<(bool, Vec<[f64; 2]>)> =
            runs.into_iter().map(|r| (r.overlapped, r.points)).collect();
        assert_eq!(
            flat,
            [
                (
                    false,
                    vec![[0.0, 1.0], [2.0, 1.0], [2.0, -3.0], [3.0, -3.0]]
                ),
                (true, vec![[3.0, -3.0], [3.0, -5.0], [4.0, -5.0]]),
            ]
        );
    }

    #[test]
    fn a_picture_of_nothing_is_still_a_picture() {
        let svg = CurvePicture::default().svg();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}

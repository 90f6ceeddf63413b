//! Run time against objective (the paper's Fig. 10): each restart dotted, the best so far solid, parts where walls
//! overlap dashed and labelled.

use super::axis::Axis;
use super::frame::{self, COLOURS};
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN_LEFT: f64 = 92.0;
const MARGIN_TOP: f64 = 44.0;
const PLOT: [f64; 2] = [600.0, 380.0];
/// Where the legend's texts begin, from the plot.
const LEGEND_TEXT: f64 = 54.0;
/// Widths of these texts: longer ones are broken.
const LEGEND_WIDTH: [f64; 2] = [150.0, 300.0];
/// An error band, grey as the best's line is black.
const BAND: &str = "fill=\"#000000\" fill-opacity=\"0.2\"";
/// A tie's open marker.
const TIE: &str = "fill=\"#ffffff\" stroke=\"#000000\" stroke-width=\"1.6\"";
/// Restarts that the legend names.
const NAMED: usize = 18;

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
    pub best: Vec<BestPoint>,
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

/// A point of the best so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BestPoint {
    /// Time or count.
    pub at: f64,
    /// Objective; points that are not finite are left out.
    pub objective: f64,
    /// Lower and upper end of its error band, where it is known.
    pub band: Option<(f64, f64)>,
    /// Whether it lies within the band of the point before it.
    pub tie: bool,
}

impl BestPoint {
    fn plain(&self) -> CurvePoint {
        CurvePoint {
            at: self.at,
            objective: self.objective,
            overlapped: false,
        }
    }
}

impl CurvePicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let legend = self.legend();
        let widest = legend
            .iter()
            .flat_map(|entry| &entry.lines)
            .map(|line| text::width(line, 12.0))
            .fold(LEGEND_WIDTH[0], f64::max);
        let width = MARGIN_LEFT + PLOT[0] + LEGEND_TEXT + widest + 12.0;
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = (MARGIN_TOP + PLOT[1] + 56.0)
            .max(MARGIN_TOP + legend.iter().map(Entry::height).sum::<f64>());
        let height = foot + 16.0 * caption.len() as f64 + 14.0;
        let mut svg = Svg::new([width, height], &self.title);
        let best: Vec<CurvePoint> = self.best.iter().map(BestPoint::plain).collect();
        let all = || self.restarts.iter().flat_map(|s| &s.points).chain(&best);
        let ends = self.best.iter().filter_map(|b| b.band);
        let ends = ends.flat_map(|(low, high)| [low, high]);
        let time = Axis::around(
            all().map(|p| p.at).chain([0.0]),
            [MARGIN_LEFT, MARGIN_LEFT + PLOT[0]],
            7,
        );
        let objective = Axis::around(
            all().map(|p| p.objective).chain(ends),
            [MARGIN_TOP + PLOT[1], MARGIN_TOP],
            7,
        );
        self.axes(&mut svg, &time, &objective);
        let end = all()
            .map(|p| p.at)
            .filter(|t| t.is_finite())
            .fold(0.0, f64::max);
        self.bands(&mut svg, &time, &objective, end);
        // The restarts lie over the best, which then shows through their dots.
        for run in runs(&best, end) {
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
        for point in self.drawn_ties() {
            svg.disc(
                [time.pixel(point.at), objective.pixel(point.objective)],
                4.0,
                TIE,
            );
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
        draw_legend(&mut svg, &legend);
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }

    /// A light area about each piece of the best's line, from its point to the next.
    fn bands(&self, svg: &mut Svg, time: &Axis, objective: &Axis, end: f64) {
        for (i, point) in self.best.iter().enumerate() {
            let next = self.best.get(i + 1).map_or(end.max(point.at), |p| p.at);
            let Some((low, high)) = point.band else {
                continue;
            };
            if !(low.is_finite() && high.is_finite() && point.at.is_finite()) {
                continue;
            }
            let [left, right] = [point.at, next].map(|t| time.pixel(t));
            let [top, bottom] = [high, low].map(|f| objective.pixel(f));
            // One thinner than a hair, or of the last point, still shows that it is known.
            svg.rectangle(
                [left, top],
                [(right - left).max(3.0), (bottom - top).max(0.5)],
                BAND,
            );
        }
    }

    /// Ties, each once: the last point of a curve repeats its best.
    fn drawn_ties(&self) -> impl Iterator<Item = &BestPoint> {
        let new = |i: usize| i == 0 || self.best[i - 1].objective != self.best[i].objective;
        let best = self.best.iter().enumerate();
        best.filter(move |(i, p)| p.tie && p.objective.is_finite() && new(*i))
            .map(|(_, p)| p)
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
        frame::draw(
            svg,
            [left, top],
            [right - left, bottom - top],
            &self.title,
            [&self.time_label, &self.objective_label],
        );
    }

    fn legend(&self) -> Vec<Entry> {
        let mut entries = Vec::new();
        let mut add = |style: String, label: &str, marker: Option<&'static str>| {
            entries.push(Entry {
                style,
                marker,
                lines: text::wrap(label, LEGEND_WIDTH[1], 12.0),
            });
        };
        if !self.best.is_empty() {
            add(stroke("#000000", false, true), "best so far", None);
        }
        if self.best.iter().any(|p| p.band.is_some()) {
            let words = "error band of the best (two meshes)";
            add("stroke=\"#c8c8c8\" stroke-width=\"10\"".into(), words, None);
        }
        if self.drawn_ties().next().is_some() {
            let line = stroke("#000000", false, true);
            add(line, "tie: within the band before it", Some(TIE));
        }
        for (i, series) in self.restarts.iter().take(NAMED).enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            add(stroke(colour, false, false), &series.label, None);
        }
        if self.restarts.len() > NAMED {
            let more = format!("and {} more restarts", self.restarts.len() - NAMED);
            add("stroke=\"none\"".into(), &more, None);
        }
        let overlaps = |series: &CurveSeries| {
            let mut drawn = series.points.iter().filter(|p| p.objective.is_finite());
            drawn.any(|p| p.overlapped)
        };
        if self.restarts.iter().any(overlaps) {
            let words = "walls overlap: not counted";
            add(stroke("#555555", true, false), words, None);
        }
        entries
    }
}

/// A line of the legend.
struct Entry {
    style: String,
    /// Of a disc on the line.
    marker: Option<&'static str>,
    lines: Vec<String>,
}

impl Entry {
    fn height(&self) -> f64 {
        4.0 + 15.0 * self.lines.len() as f64
    }
}

fn draw_legend(svg: &mut Svg, entries: &[Entry]) {
    let x = MARGIN_LEFT + PLOT[0];
    let mut y = MARGIN_TOP + 10.0;
    for entry in entries {
        svg.line([x + 16.0, y], [x + 46.0, y], &entry.style);
        if let Some(marker) = entry.marker {
            svg.disc([x + 31.0, y], 4.0, marker);
        }
        for (i, line) in entry.lines.iter().enumerate() {
            let at = [x + LEGEND_TEXT, y + 4.0 + 15.0 * i as f64];
            svg.text(at, 12.0, Anchor::Start, "fill=\"#222222\"", line);
        }
        y += entry.height();
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

    /// Where each upright text ends, by its estimated width, within the picture's size.
    fn all_texts_fit(svg: &str) {
        let number = |text: &str, name: &str| -> f64 {
            let from = text.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
            text[from..].split('"').next().unwrap().parse().unwrap()
        };
        let [width, height] = ["width", "height"].map(|name| number(svg, name));
        let mut texts = 0;
        for line in svg
            .lines()
            .filter(|l| l.starts_with("<text") && !l.contains("rotate"))
        {
            let [x, y, size] = ["x", "y", "font-size"].map(|name| number(line, name));
            let words = line.split(['<', '>']).nth(2).unwrap();
            let long = text::width(words, size);
            let (start, end) = if line.contains("anchor=\"start") {
                (x, x + long)
            } else if line.contains("anchor=\"end") {
                (x - long, x)
            } else {
                (x - long / 2.0, x + long / 2.0)
            };
            assert!(start >= 0.0 && end <= width && y + 3.0 <= height, "{line}");
            texts += 1;
        }
        assert!(texts > 10);
    }

    #[test]
    fn long_labels_stay_in_the_picture() {
        let labels = [
            "restart 0 (paper, counter-clockwise)".to_owned(),
            "restart 1 (random, the larger sense at each point, of a study with a long name)"
                .into(),
            "unbroken".repeat(20),
        ];
        let picture = |labels: &[String], copies: usize| CurvePicture {
            title: "a study of a very long name: ".repeat(8),
            time_label: "CPU time (s): of the restart; of the study for the best so far".into(),
            objective_label: "best feasible objective so far (mm\u{b2})".into(),
            restarts: (0..copies)
                .flat_map(|_| labels)
                .map(|label| CurveSeries {
                    label: label.clone(),
                    points: vec![point(0.0, 1.0, false), point(2.0, -3e6, true)],
                })
                .collect(),
            best: vec![BestPoint {
                at: 0.0,
                objective: 1.0,
                band: Some((0.5, 1.5)),
                tie: true,
            }],
            caption: vec!["limits of the counted designs; ".repeat(12)],
        };
        all_texts_fit(&picture(&labels, 1).svg());
        all_texts_fit(&picture(&labels, 12).svg());
        let short = picture(&["restart 0".to_owned()], 1).svg();
        all_texts_fit(&short);
        assert!(short.contains("walls overlap: not counted"));
        assert!(short.contains("error band of the best") && short.contains("tie: within"));
        assert_eq!(
            short.matches(TIE).count(),
            2,
            "in the plot and in the legend"
        );
        assert_eq!(short.matches(BAND).count(), 1);
    }
}

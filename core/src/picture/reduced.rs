//! The reduced model, as the paper's Fig. 4: a unit and a chain under their transformations; FE paths of the tip against
//! what is foretold; and the design space.

use super::axis::{Axis, round_below};
use super::frame::{self, COLOURS};
use super::panel::Panel;
use super::svg::{Anchor, Svg, polyline};
use super::text;
use crate::geometry::{Point, polygon};
use crate::reduced::{AreaMap, LinearTransform, corners, tip};

const WIDTH: f64 = 1180.0;
const MARGIN: f64 = 28.0;
/// Heights of the three rows.
const ROWS: [f64; 3] = [330.0, 354.0, 360.0];
const TOP: f64 = 44.0;
/// What a panel leaves for its title and its scale bar or legend.
const HEAD: f64 = 34.0;
const FOOT: f64 = 64.0;
const DARK: &str = "fill=\"#222222\"";
const GREY: &str = "fill=\"#eeeeee\" stroke=\"#a8a8a8\" stroke-width=\"1.2\"";
const RED: &str = "#d00000";
const DASHES: [&str; 3] = ["8 4", "3 3", "10 3 3 3"];

/// What is drawn.
#[derive(Clone, Debug)]
pub struct ReducedPicture<'a> {
    /// Over the picture.
    pub title: &'a str,
    /// Width and height of a unit, mm.
    pub unit_mm: [f64; 2],
    /// Chambers of the unit at rest, mm.
    pub chambers_mm: &'a [Vec<Point>],
    /// Rows of the schedule with their transformations.
    pub rows: &'a [(String, LinearTransform)],
    /// Units of the cascade.
    pub units: usize,
    /// Paths of tips; two have a place.
    pub paths: &'a [TipPaths<'a>],
    /// Largest area for 1, 2, ... actuations, mm^2.
    pub largest_mm2: &'a [f64],
    /// Areas over two entries, and those to be marked.
    pub map: Option<(&'a AreaMap, [f64; 2])>,
    /// Lines under the picture.
    pub caption: &'a [String],
}

/// Paths of one tip.
#[derive(Clone, Debug)]
pub struct TipPaths<'a> {
    /// Over the panel.
    pub title: String,
    /// In FE, mm.
    pub fe_mm: &'a [Point],
    /// Foretold, with a name each, mm.
    pub foretold_mm: Vec<(String, &'a [Point])>,
}

/// The largest round factor by which moves may be drawn so that they stay below a share of a length.
fn magnification(moved: f64, wanted: f64) -> f64 {
    // Below this it is rounding that would be drawn.
    if moved > 1e-9 && moved < wanted {
        round_below(wanted / moved).max(1.0)
    } else {
        1.0
    }
}

fn magnified(transform: &LinearTransform, factor: f64) -> LinearTransform {
    LinearTransform::IDENTITY.towards(transform, factor)
}

/// " (moves drawn n times)", or nothing.
fn times(factor: f64) -> String {
    if factor == 1.0 {
        String::new()
    } else {
        format!(" (moves drawn {factor} times)")
    }
}

impl ReducedPicture<'_> {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let caption: Vec<String> = (self.caption.iter())
            .flat_map(|line| text::wrap(line, WIDTH - 40.0, 12.0))
            .collect();
        // Without FE there is nothing to hold the paths against.
        let rows = [
            ROWS[0],
            if self.paths.is_empty() { 0.0 } else { ROWS[1] },
            ROWS[2],
        ];
        let foot = TOP + rows.iter().sum::<f64>();
        let height = foot + 16.0 * caption.len() as f64 + 20.0;
        let mut svg = Svg::new([WIDTH, height], self.title);
        let bold = format!("{DARK} font-weight=\"bold\"");
        let title = text::shortened_bold(self.title, WIDTH - 2.0 * MARGIN, 15.0);
        svg.text([MARGIN, 26.0], 15.0, Anchor::Start, &bold, &title);
        let width = WIDTH - 3.0 * MARGIN;
        let narrow = 0.32 * width;
        self.unit(&mut svg, [MARGIN, TOP], [narrow, ROWS[0]]);
        let right = [2.0 * MARGIN + narrow, TOP];
        self.cascade(&mut svg, right, [width - narrow, ROWS[0]]);
        let half = 0.5 * width;
        for (i, paths) in self.paths.iter().take(2).enumerate() {
            let at = [MARGIN + i as f64 * (half + MARGIN), TOP + ROWS[0]];
            let letter = ["(c)", "(d)"][i];
            tip_paths(&mut svg, at, [half, ROWS[1]], letter, paths);
        }
        let lower = TOP + rows[0] + rows[1];
        // Letters go on without a gap.
        let letters = if self.paths.is_empty() {
            ["(c)", "(d)"]
        } else {
            ["(e)", "(f)"]
        };
        self.largest(&mut svg, [MARGIN, lower], [half, ROWS[2]], letters[0]);
        if let Some(map) = self.map {
            let at = [2.0 * MARGIN + half, lower];
            heat_map(&mut svg, at, [half, ROWS[2]], letters[1], map);
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }

    /// (a) The right-hand nodes of a unit under each row's transformation.
    fn unit(&self, svg: &mut Svg, at: [f64; 2], size: [f64; 2]) {
        let [w, h] = self.unit_mm;
        let rest = LinearTransform::IDENTITY;
        let moved = self
            .rows
            .iter()
            .map(|(_, t)| t.node_distance_mm(&rest, self.unit_mm));
        let factor = magnification(moved.fold(0.0, f64::max), 0.12 * w);
        let units: Vec<[Point; 4]> = (self.rows.iter())
            .map(|(_, t)| corners(&[magnified(t, factor)], self.unit_mm)[0])
            .collect();
        let outline = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
        let all = outline.iter().chain(units.iter().flatten());
        let panel = Panel::around(all, [at[0], at[1] + HEAD], [size[0], size[1] - HEAD - FOOT]);
        let title = format!("(a) one unit{}", times(factor));
        heading(svg, at, &title);
        svg.path(&polyline(&panel.all(&outline), true), GREY);
        let hollow = "fill=\"#ffffff\" stroke=\"#c8c8c8\" stroke-width=\"1\"";
        for chamber in self.chambers_mm {
            svg.path(&polyline(&panel.all(chamber), true), hollow);
        }
        for (i, unit) in units.iter().enumerate() {
            let places = panel.all(unit);
            svg.path(&polyline(&places, true), &stroke(i, 1.8));
            for (from, to) in [(outline[1], places[1]), (outline[2], places[2])] {
                let thin = format!("stroke=\"{}\" stroke-width=\"0.8\"", colour(i));
                svg.line(panel.at(from), to, &thin);
                svg.disc(to, 4.0, &format!("fill=\"{}\"", colour(i)));
            }
        }
        for node in [outline[1], outline[2]] {
            svg.disc(panel.at(node), 3.5, "fill=\"#888888\"");
        }
        panel.scale_bar(svg, [at[0], at[1] + size[1] - 40.0], 90.0);
    }

    /// (b) The chain under each row's transformation.
    fn cascade(&self, svg: &mut Svg, at: [f64; 2], size: [f64; 2]) {
        let chain = |t: &LinearTransform| vec![*t; self.units];
        let rest = chain(&LinearTransform::IDENTITY);
        let start = tip(&rest, self.unit_mm);
        let moved = self.rows.iter().map(|(_, t)| {
            let end = tip(&chain(t), self.unit_mm);
            polygon::distance(start, end)
        });
        let length = self.unit_mm[0] * self.units as f64;
        let factor = magnification(moved.fold(0.0, f64::max), 0.15 * length);
        let chains: Vec<Vec<[Point; 4]>> = (self.rows.iter())
            .map(|(_, t)| corners(&chain(&magnified(t, factor)), self.unit_mm))
            .collect();
        let still = corners(&rest, self.unit_mm);
        let all = chains.iter().flatten().chain(&still).flatten();
        let panel = Panel::around(all, [at[0], at[1] + HEAD], [size[0], size[1] - HEAD - FOOT]);
        let title = format!("(b) a cascade of {}{}", self.units, times(factor));
        heading(svg, at, &title);
        for unit in &still {
            svg.path(&polyline(&panel.all(unit), true), GREY);
        }
        for (i, units) in chains.iter().enumerate() {
            for unit in units {
                let places = panel.all(unit);
                svg.path(&polyline(&places, true), &stroke(i, 1.4));
                for node in &places[1..3] {
                    svg.disc(*node, 2.2, &format!("fill=\"{}\"", colour(i)));
                }
            }
        }
        let foot = at[1] + size[1] - 40.0;
        panel.scale_bar(svg, [at[0], foot], 140.0);
        let labels = self.rows.iter().map(|(label, _)| label.as_str());
        let marks = labels.enumerate().map(|(i, l)| (colour(i), dashes(i), l));
        legend(svg, [at[0] + 230.0, foot + 4.5], at[0] + size[0], marks);
    }

    /// Largest area by number of actuations.
    fn largest(&self, svg: &mut Svg, at: [f64; 2], size: [f64; 2], letter: &str) {
        let title = format!(
            "{letter} largest area of {} units against the number of actuations",
            self.units
        );
        heading(svg, at, &title);
        let (left, right) = (at[0] + 84.0, at[0] + size[0] - 10.0);
        let (top, bottom) = (at[1] + HEAD + 6.0, at[1] + size[1] - 58.0);
        let values = || self.largest_mm2.iter().copied();
        let axis = Axis::around(values().chain([0.0]), [bottom, top], 5);
        for (y, label) in axis.ticks() {
            let y = axis.pixel(y);
            let shade = "stroke=\"#cccccc\" stroke-width=\"1\"";
            svg.line([left, y], [right, y], shade);
            svg.text([left - 8.0, y + 4.5], 12.0, Anchor::End, DARK, &label);
        }
        let count = self.largest_mm2.len().max(1) as f64;
        let places: Vec<[f64; 2]> = values()
            .enumerate()
            .map(|(i, value)| {
                let x = left + (i as f64 + 0.5) / count * (right - left);
                [x, axis.pixel(value)]
            })
            .collect();
        let line = format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"",
            COLOURS[0]
        );
        svg.path(&polyline(&places, false), &line);
        for (i, place) in places.iter().enumerate() {
            svg.disc(*place, 4.0, &format!("fill=\"{}\"", COLOURS[0]));
            let number = (i + 1).to_string();
            svg.text(
                [place[0], bottom + 18.0],
                13.0,
                Anchor::Middle,
                DARK,
                &number,
            );
        }
        let edge = "fill=\"none\" stroke=\"#444444\" stroke-width=\"1\"";
        svg.rectangle([left, top], [right - left, bottom - top], edge);
        let middle = 0.5 * (top + bottom);
        let below = [0.5 * (left + right), bottom + 38.0];
        svg.text(below, 13.0, Anchor::Middle, DARK, "actuations");
        let x = at[0] + 10.0;
        let turned = format!("{DARK} transform=\"rotate(-90 {x:.1} {middle:.1})\"");
        svg.text(
            [x, middle],
            13.0,
            Anchor::Middle,
            &turned,
            "area (mm\u{b2})",
        );
    }
}

fn colour(i: usize) -> &'static str {
    COLOURS[i % COLOURS.len()]
}

/// Solid first, then dashes.
fn dashes(i: usize) -> &'static str {
    match i % 4 {
        0 => "none",
        i => DASHES[i - 1],
    }
}

fn stroke(i: usize, width: f64) -> String {
    let (colour, dashes) = (colour(i), dashes(i));
    format!(
        "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-dasharray=\"{dashes}\" stroke-linejoin=\"round\""
    )
}

fn heading(svg: &mut Svg, at: [f64; 2], title: &str) {
    svg.text([at[0], at[1] + 16.0], 13.0, Anchor::Start, DARK, title);
}

/// Lines with their names, from left to right, on a new line where they do not fit.
fn legend<'a>(
    svg: &mut Svg,
    from: [f64; 2],
    right: f64,
    marks: impl Iterator<Item = (&'a str, &'a str, &'a str)>,
) {
    let mut at = from;
    for (colour, dashes, label) in marks {
        let wide = 42.0 + text::width(label, 12.0);
        if at[0] > from[0] && at[0] + wide > right {
            at = [from[0], at[1] + 18.0];
        }
        let style = format!("stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dashes}\"");
        svg.line([at[0], at[1] - 4.0], [at[0] + 24.0, at[1] - 4.0], &style);
        svg.text([at[0] + 30.0, at[1]], 12.0, Anchor::Start, DARK, label);
        at[0] += wide + 12.0;
    }
}

/// Paths of tips alone, `columns` panels a row, with lines under the picture.
pub fn tip_paths_svg(
    title: &str,
    panels: &[TipPaths<'_>],
    columns: usize,
    caption: &[String],
) -> String {
    const PANEL: [f64; 2] = [430.0, 272.0];
    let columns = columns.max(1);
    let width = MARGIN + columns as f64 * (PANEL[0] + MARGIN);
    let caption: Vec<String> = (caption.iter())
        .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
        .collect();
    let foot = TOP + panels.len().div_ceil(columns) as f64 * PANEL[1];
    let height = foot + 16.0 * caption.len() as f64 + 20.0;
    let mut svg = Svg::new([width, height], title);
    let bold = format!("{DARK} font-weight=\"bold\"");
    let title = text::shortened_bold(title, width - 2.0 * MARGIN, 15.0);
    svg.text([MARGIN, 26.0], 15.0, Anchor::Start, &bold, &title);
    for (i, paths) in panels.iter().enumerate() {
        let (column, row) = (i % columns, i / columns);
        let at = [
            MARGIN + column as f64 * (PANEL[0] + MARGIN),
            TOP + row as f64 * PANEL[1],
        ];
        tip_paths(&mut svg, at, PANEL, "", paths);
    }
    frame::caption(&mut svg, foot, &caption);
    svg.finish()
}

/// (c), (d): the path of a tip in FE in red, what is foretold in dashes.
fn tip_paths(svg: &mut Svg, at: [f64; 2], size: [f64; 2], letter: &str, paths: &TipPaths<'_>) {
    heading(svg, at, format!("{letter} {}", paths.title).trim_start());
    let foretold = || paths.foretold_mm.iter().map(|(_, path)| *path);
    let all = paths.fe_mm.iter().chain(foretold().flatten());
    let from = [at[0] + 6.0, at[1] + HEAD];
    let panel = Panel::around(all, from, [size[0] - 12.0, size[1] - HEAD - FOOT - 10.0]);
    let fe = panel.all(paths.fe_mm);
    let red = format!(
        "fill=\"{RED}\" fill-opacity=\"0.10\" fill-rule=\"evenodd\" stroke=\"{RED}\" stroke-width=\"2\" stroke-linejoin=\"round\""
    );
    svg.path(&polyline(&fe, true), &red);
    for place in &fe {
        svg.disc(*place, 2.4, &format!("fill=\"{RED}\""));
    }
    for (i, path) in foretold().enumerate() {
        let places = panel.all(path);
        let dashes = DASHES[i % DASHES.len()];
        let style = format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" stroke-dasharray=\"{dashes}\" stroke-linejoin=\"round\"",
            colour(i)
        );
        svg.path(&polyline(&places, true), &style);
        for place in places {
            svg.disc(place, 1.8, &format!("fill=\"{}\"", colour(i)));
        }
    }
    let foot = at[1] + size[1] - 46.0;
    panel.scale_bar(svg, [at[0], foot], 100.0);
    let names = paths.foretold_mm.iter().enumerate();
    let names = names.map(|(i, (name, _))| (colour(i), DASHES[i % DASHES.len()], name.as_str()));
    let marks = std::iter::once((RED, "none", "FE")).chain(names);
    legend(svg, [at[0] + 190.0, foot + 4.5], at[0] + size[0], marks);
}

/// White at zero, blue below, orange above.
fn shade(value: f64, largest: f64) -> String {
    const ENDS: [[f64; 3]; 2] = [[0.0, 114.0, 178.0], [213.0, 94.0, 0.0]];
    let share = if largest > 0.0 { value / largest } else { 0.0 };
    let end = ENDS[usize::from(share > 0.0)];
    let [r, g, b] = end.map(|c| (255.0 + share.abs().min(1.0) * (c - 255.0)).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Areas over two entries; `these` is marked.
fn heat_map(
    svg: &mut Svg,
    at: [f64; 2],
    size: [f64; 2],
    letter: &str,
    (map, these): (&AreaMap, [f64; 2]),
) {
    let name = |k: usize| {
        let axis = &map.axes[k];
        format!(
            "{} of actuation {}",
            axis.entry.symbol(),
            axis.actuation + 1
        )
    };
    heading(
        svg,
        at,
        &format!("{letter} area over {} and {}", name(0), name(1)),
    );
    let side = (size[1] - HEAD - 64.0).min(size[0] - 190.0);
    let (left, top) = (at[0] + 84.0, at[1] + HEAD + 6.0);
    let (right, bottom) = (left + side, top + side);
    let ends = |k: usize| {
        let values = &map.axes[k].values;
        let (first, last) = (values.first().copied(), values.last().copied());
        [first.unwrap_or(0.0), last.unwrap_or(1.0)]
    };
    let rulers =
        [(ends(0), [left, right]), (ends(1), [bottom, top])].map(|(values, pixels)| Axis {
            values,
            pixels,
            step: 1.0,
        });
    let largest = (map.area_mm2.iter().flatten()).fold(0.0, |m: f64, a| m.max(a.abs()));
    let cells =
        [map.axes[0].values.len(), map.axes[1].values.len()].map(|n| side / n.max(1) as f64);
    for (j, row) in map.area_mm2.iter().enumerate() {
        for (i, area) in row.iter().enumerate() {
            let corner = [
                left + i as f64 * cells[0],
                bottom - (j + 1) as f64 * cells[1],
            ];
            let fill = shade(*area, largest);
            let crisp = format!("fill=\"{fill}\" shape-rendering=\"crispEdges\"");
            svg.rectangle(corner, cells, &crisp);
        }
    }
    let edge = "fill=\"none\" stroke=\"#444444\" stroke-width=\"1\"";
    svg.rectangle([left, top], [side, side], edge);
    for (k, ruler) in rulers.iter().enumerate() {
        let ticks = Axis::around(ruler.values, ruler.pixels, 3).ticks();
        let inside = |v: f64| v >= ruler.values[0] && v <= ruler.values[1];
        for (value, label) in ticks.into_iter().filter(|(v, _)| inside(*v)) {
            let p = ruler.pixel(value);
            if k == 0 {
                svg.text([p, bottom + 16.0], 12.0, Anchor::Middle, DARK, &label);
            } else {
                svg.text([left - 6.0, p + 4.0], 12.0, Anchor::End, DARK, &label);
            }
        }
    }
    let below = [0.5 * (left + right), bottom + 34.0];
    svg.text(below, 13.0, Anchor::Middle, DARK, &name(0));
    let (x, middle) = (at[0] + 12.0, 0.5 * (top + bottom));
    let turned = format!("{DARK} transform=\"rotate(-90 {x:.1} {middle:.1})\"");
    svg.text([x, middle], 13.0, Anchor::Middle, &turned, &name(1));
    let mark = [rulers[0].pixel(these[0]), rulers[1].pixel(these[1])];
    svg.disc(
        mark,
        5.0,
        "fill=\"#ffffff\" stroke=\"#000000\" stroke-width=\"1.6\"",
    );
    // The scale, and what the mark is.
    for step in 0..=8 {
        let value = largest * (f64::from(step) / 4.0 - 1.0);
        let y = bottom - 20.0 * f64::from(step) - 40.0;
        let fill = format!(
            "fill=\"{}\" stroke=\"#bbbbbb\" stroke-width=\"0.5\"",
            shade(value, largest)
        );
        svg.rectangle([right + 16.0, y], [16.0, 20.0], &fill);
        if step % 4 == 0 {
            let label = format!("{value:.3e}");
            let label = if (1.0..1e6).contains(&largest) {
                format!("{value:.0}")
            } else {
                label
            };
            let label = label.replace("-0", "0").replace('-', "\u{2212}");
            svg.text([right + 38.0, y + 14.0], 12.0, Anchor::Start, DARK, &label);
        }
    }
    svg.text(
        [right + 16.0, bottom - 216.0],
        12.0,
        Anchor::Start,
        DARK,
        "area (mm\u{b2})",
    );
    svg.disc(
        [right + 22.0, bottom - 4.0],
        5.0,
        "fill=\"#ffffff\" stroke=\"#000000\" stroke-width=\"1.6\"",
    );
    svg.text([right + 34.0, bottom], 12.0, Anchor::Start, DARK, "these");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reduced::{Entry, MapAxis, area_map};

    #[test]
    fn small_moves_are_magnified_and_it_is_said() {
        let rows = [(
            "(15, 0) kPa".to_owned(),
            LinearTransform::from_slice(&[1.001, -0.0005, 0.0, 1.0]),
        )];
        let axis = |actuation| MapAxis {
            actuation,
            entry: Entry::XSh,
            values: vec![-0.1, 0.0, 0.1],
        };
        let two = [
            rows[0].1,
            LinearTransform::from_slice(&[1.0, 0.0, 0.01, 1.0]),
        ];
        let map = area_map(&two, [axis(0), axis(1)], [80.0; 2], 9).unwrap();
        let path = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        let paths = [TipPaths {
            title: "tip".into(),
            fe_mm: &path,
            foretold_mm: vec![("one & only".into(), &path)],
        }];
        let picture = ReducedPicture {
            title: "a unit",
            unit_mm: [80.0; 2],
            chambers_mm: &[vec![[20.0, 20.0], [60.0, 20.0], [60.0, 60.0]]],
            rows: &rows,
            units: 9,
            paths: &paths,
            largest_mm2: &[0.0, 4.0, 5.0],
            map: Some((&map, [0.0, 0.0])),
            caption: &["a line".into()],
        };
        let svg = picture.svg();
        assert!(svg.contains("moves drawn 50 times") && svg.contains("one &amp; only"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        // Nothing to show is no reason to fail.
        let empty = ReducedPicture {
            rows: &[],
            paths: &[],
            largest_mm2: &[],
            map: None,
            ..picture
        };
        assert!(!empty.svg().contains("NaN"));
        let large = LinearTransform::from_slice(&[1.2, 0.0, 0.0, 1.0]);
        let empty = ReducedPicture {
            rows: &[("large".into(), large)],
            ..empty
        };
        assert!(!empty.svg().contains("times"));
        let alone = tip_paths_svg("paths", &[paths[0].clone(), paths[0].clone()], 3, &[]);
        assert_eq!(alone.matches("one &amp; only").count(), 2);
    }
}

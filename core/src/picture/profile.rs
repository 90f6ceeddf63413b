//! Profiles: shares that grow as staircases over a logarithmic axis, one panel under the other.

use super::axis::{Ruler, Scale};
use super::frame;
use super::svg::{Anchor, Svg, polyline};
use super::text;

const MARGIN: [f64; 2] = [76.0, 66.0];
const PLOT: [f64; 2] = [600.0, 260.0];
/// Between the tops of two panels.
const PITCH: f64 = 350.0;
/// A legend's line, and where its text begins, from the plot.
const LEGEND: [f64; 3] = [14.0, 46.0, 54.0];

/// What is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfilePicture {
    /// Over the picture.
    pub title: String,
    /// Under the horizontal axes.
    pub x_label: String,
    /// Beside the vertical axes, which go from 0 to 1.
    pub y_label: String,
    /// The panels, on one range of the horizontal axis.
    pub panels: Vec<ProfilePanel>,
    /// Lines under the picture.
    pub caption: Vec<String>,
}

/// One panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfilePanel {
    /// Over its plot.
    pub heading: String,
    /// Names, each with (k, share) where its share grows. The same names in each panel.
    pub series: Vec<(String, Vec<(f64, f64)>)>,
}

impl ProfilePicture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        let right = MARGIN[0] + PLOT[0];
        let all = self.panels.iter().flat_map(|panel| &panel.series);
        let at = all.flat_map(|(_, steps)| steps.iter().map(|(k, _)| *k));
        let x = Ruler::new(Scale::Logarithmic, at, [MARGIN[0], right]);
        let names = self.panels.first().map_or(&[][..], |panel| &panel.series);
        let widest = names.iter().map(|(name, _)| text::width(name, 12.0));
        let width = right + LEGEND[2] + widest.fold(0.0, f64::max) + 12.0;
        let caption: Vec<String> = self
            .caption
            .iter()
            .flat_map(|line| text::wrap(line, width - 40.0, 12.0))
            .collect();
        let foot = MARGIN[1] + PITCH * self.panels.len() as f64 - 34.0;
        let height = foot + 16.0 * caption.len() as f64 + 14.0;
        let mut svg = Svg::new([width, height], &self.title);
        for (i, panel) in self.panels.iter().enumerate() {
            let title = if i == 0 { self.title.as_str() } else { "" };
            self.panel(&mut svg, panel, &x, MARGIN[1] + PITCH * i as f64, title);
        }
        for (i, (name, _)) in names.iter().enumerate() {
            let y = MARGIN[1] + 14.0 + 22.0 * i as f64;
            let line = [LEGEND[0], LEGEND[1]].map(|along| [right + along, y - 4.0]);
            svg.path(&polyline(&line, false), &frame::stroke(i));
            let dark = "fill=\"#222222\"";
            svg.text([right + LEGEND[2], y], 12.0, Anchor::Start, dark, name);
        }
        frame::caption(&mut svg, foot, &caption);
        svg.finish()
    }

    fn panel(&self, svg: &mut Svg, panel: &ProfilePanel, x: &Ruler, top: f64, title: &str) {
        let [left, right] = [MARGIN[0], MARGIN[0] + PLOT[0]];
        let bottom = top + PLOT[1];
        let height = |share: f64| bottom - PLOT[1] * share;
        let dark = "fill=\"#222222\"";
        let grid = |shade: &str| format!("stroke=\"{shade}\" stroke-width=\"1\"");
        for at in x.minor() {
            svg.line([at, bottom], [at, top], &grid("#f0f0f0"));
        }
        for (at, label) in x.ticks() {
            svg.line([at, bottom], [at, top], &grid("#cccccc"));
            svg.text([at, bottom + 18.0], 13.0, Anchor::Middle, dark, &label);
        }
        for fifth in 0..=5 {
            let share = f64::from(fifth) / 5.0;
            let y = height(share);
            svg.line([left, y], [right, y], &grid("#cccccc"));
            let label = format!("{share:.1}");
            svg.text([left - 8.0, y + 4.5], 13.0, Anchor::End, dark, &label);
        }
        for (i, (_, steps)) in panel.series.iter().enumerate() {
            let (mut points, mut share) = (vec![[left, height(0.0)]], 0.0);
            for (k, next) in steps {
                if let Some(at) = x.pixel(*k) {
                    points.extend([[at, height(share)], [at, height(*next)]]);
                    share = *next;
                }
            }
            points.push([right, height(share)]);
            svg.path(&polyline(&points, false), &frame::stroke(i));
        }
        let labels = [self.x_label.as_str(), self.y_label.as_str()];
        frame::draw(svg, [left, top], PLOT, title, labels);
        let at = [left, top - 8.0];
        svg.text(at, 13.0, Anchor::Start, dark, &panel.heading);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_has_every_line_and_a_legend_names_them() {
        let series = vec![
            ("a & b".to_owned(), vec![(2.0, 0.5), (20.0, 1.0)]),
            ("none".to_owned(), Vec::new()),
        ];
        let panel = |heading: &str| ProfilePanel {
            heading: heading.into(),
            series: series.clone(),
        };
        let picture = ProfilePicture {
            title: "profiles".into(),
            panels: vec![panel("one"), panel("two")],
            ..ProfilePicture::default()
        };
        let svg = picture.svg();
        assert_eq!(svg.matches("stroke-width=\"2.2\"").count(), 2 * 2 + 2);
        assert_eq!(svg.matches("a &amp; b").count(), 1);
        // Up to one half at 2 of 1 to 100, and on to the end.
        let half = MARGIN[1] + 0.5 * PLOT[1];
        let at = MARGIN[0] + PLOT[0] * 0.5 * 2.0_f64.log10();
        assert!(
            svg.contains(&polyline(&[[at, half]], false)[1..]),
            "{at} {half}"
        );
        assert!(!ProfilePicture::default().svg().contains("<path"));
    }
}

//! What every diagram has around its plot: frame, title, labels of the axes, lines under it.

use super::svg::{Anchor, Svg};
use super::text;

/// Okabe and Ito's colours without yellow and black.
pub(super) const COLOURS: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00",
];

/// Dashes tell the lines apart without colours.
const DASHES: [&str; 4] = ["", "9 4", "2 3", "9 3 2 3"];

/// How the line of the i-th series is drawn: colour and dashes.
pub(super) fn stroke(i: usize) -> String {
    let colour = COLOURS[i % COLOURS.len()];
    let dashes = match DASHES[i % DASHES.len()] {
        "" => String::new(),
        dashes => format!(" stroke-dasharray=\"{dashes}\""),
    };
    format!(
        "fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\" stroke-linejoin=\"round\"{dashes}"
    )
}

/// Draws the frame of a plot from its upper left corner, with its labels and a title that ends where the picture does.
pub(super) fn draw(
    svg: &mut Svg,
    [left, top]: [f64; 2],
    size: [f64; 2],
    title: &str,
    labels: [&str; 2],
) {
    let dark = "fill=\"#222222\"";
    let stroke = "fill=\"none\" stroke=\"#444444\" stroke-width=\"1\"";
    svg.rectangle([left, top], size, stroke);
    let middle = [left + 0.5 * size[0], top + 0.5 * size[1]];
    let below = [middle[0], top + size[1] + 42.0];
    svg.text(below, 14.0, Anchor::Middle, dark, labels[0]);
    let turned = format!("{dark} transform=\"rotate(-90 22 {:.1})\"", middle[1]);
    svg.text([22.0, middle[1]], 14.0, Anchor::Middle, &turned, labels[1]);
    let bold = format!("{dark} font-weight=\"bold\"");
    let title = text::shortened_bold(title, svg.width - left - 12.0, 15.0);
    svg.text([left, 26.0], 15.0, Anchor::Start, &bold, &title);
}

/// Writes lines under a picture, the first one 16 px below `foot`.
pub(super) fn caption(svg: &mut Svg, foot: f64, lines: &[String]) {
    for (i, line) in lines.iter().enumerate() {
        let y = foot + 16.0 * (i + 1) as f64;
        svg.text([20.0, y], 12.0, Anchor::Start, "fill=\"#333333\"", line);
    }
}

//! A little SVG writer.

use std::fmt::Write as _;

/// Sans-serif faces that are there on most machines.
const FONT: &str = "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\"";

/// A picture under construction; positions in px from the upper left corner.
pub(super) struct Svg {
    /// Width, px.
    pub width: f64,
    body: String,
}

/// Where a text stands relative to its point.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    /// An empty picture on white with a title for screen readers.
    pub fn new(size: [f64; 2], title: &str) -> Self {
        let width = size[0];
        let [w, h] = size.map(number);
        let body = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" role=\"img\" {FONT}>\n<title>{}</title>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n",
            escape(title)
        );
        Self { width, body }
    }

    /// A path with attributes such as `stroke="#000"`.
    pub fn path(&mut self, data: &str, attributes: &str) {
        if !data.is_empty() {
            self.push(format_args!("<path d=\"{data}\" {attributes}/>"));
        }
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], attributes: &str) {
        self.path(&polyline(&[from, to], false), attributes);
    }

    /// A disc.
    pub fn disc(&mut self, at: [f64; 2], radius: f64, attributes: &str) {
        let [x, y] = at.map(number);
        self.push(format_args!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\" {attributes}/>",
            number(radius)
        ));
    }

    /// A rectangle.
    pub fn rectangle(&mut self, at: [f64; 2], size: [f64; 2], attributes: &str) {
        let ([x, y], [w, h]) = (at.map(number), size.map(number));
        self.push(format_args!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" {attributes}/>"
        ));
    }

    /// A line of text; `size` in px.
    pub fn text(&mut self, at: [f64; 2], size: f64, anchor: Anchor, attributes: &str, text: &str) {
        let [x, y] = at.map(number);
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.push(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{anchor}\" {attributes}>{}</text>",
            number(size),
            escape(text)
        ));
    }

    /// The finished text.
    pub fn finish(mut self) -> String {
        self.body.push_str("</svg>\n");
        self.body
    }

    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = writeln!(self.body, "{text}");
    }
}

/// Path data through points.
pub(super) fn polyline(points: &[[f64; 2]], closed: bool) -> String {
    let mut data = String::new();
    for (i, [x, y]) in points.iter().enumerate() {
        data.push(if i == 0 { 'M' } else { 'L' });
        pair(&mut data, [*x, *y]);
    }
    if closed && !points.is_empty() {
        data.push('Z');
    }
    data
}

/// Appends "x y" with two decimals.
pub(super) fn pair(data: &mut String, at: [f64; 2]) {
    let _ = write!(data, "{} {}", number(at[0]), number(at[1]));
}

/// At most two decimals, without trailing zeros.
fn number(x: f64) -> String {
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

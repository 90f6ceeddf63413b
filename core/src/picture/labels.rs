//! Where texts beside points stand: in the frame, and clear of points, lines and each other where there is such a place.

use super::svg::Anchor;
use super::text;

/// Least and largest corner, px.
pub(super) type Rectangle = [[f64; 2]; 2];

/// Places beside a point in the order in which they are liked: from the point, px. Farther ones look as if they belonged to
/// another point.
const BESIDE: [([f64; 2], Anchor); 8] = [
    ([6.0, -5.0], Anchor::Start),
    ([-6.0, -5.0], Anchor::End),
    ([6.0, 13.0], Anchor::Start),
    ([-6.0, 13.0], Anchor::End),
    ([8.0, 4.0], Anchor::Start),
    ([-8.0, 4.0], Anchor::End),
    ([0.0, -9.0], Anchor::Middle),
    ([0.0, 18.0], Anchor::Middle),
];

/// What is drawn already.
pub(super) struct Labels {
    frame: Rectangle,
    taken: Vec<Rectangle>,
    lines: Vec<[[f64; 2]; 2]>,
}

impl Labels {
    pub(super) fn new(frame: Rectangle) -> Self {
        Self {
            frame,
            taken: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// A disc to keep clear of.
    pub(super) fn disc(&mut self, [x, y]: [f64; 2], radius: f64) {
        self.taken
            .push([[x - radius, y - radius], [x + radius, y + radius]]);
    }

    /// Lines to keep clear of, one behind the other.
    pub(super) fn lines(&mut self, points: &[[f64; 2]]) {
        self.lines.extend(points.windows(2).map(|p| [p[0], p[1]]));
    }

    /// The place of a text beside a point; it is taken from then on.
    pub(super) fn beside(&mut self, [x, y]: [f64; 2], text: &str, size: f64) -> ([f64; 2], Anchor) {
        let places = BESIDE.map(|([dx, dy], anchor)| ([x + dx, y + dy], anchor));
        self.best(&places, text, size)
    }

    /// The best of some places of a text, the first of those that are equally good.
    pub(super) fn best(
        &mut self,
        places: &[([f64; 2], Anchor)],
        text: &str,
        size: f64,
    ) -> ([f64; 2], Anchor) {
        let mut best = (places[0], bounds(places[0], text, size));
        let mut least = usize::MAX;
        for place in places {
            let taken = bounds(*place, text, size);
            let cost = self.cost(&taken);
            if cost < least {
                (best, least) = ((*place, taken), cost);
            }
        }
        self.taken.push(best.1);
        best.0
    }

    fn cost(&self, text: &Rectangle) -> usize {
        let inside =
            (0..2).all(|c| text[0][c] >= self.frame[0][c] && text[1][c] <= self.frame[1][c]);
        let covered = self.taken.iter().filter(|t| overlap(t, text)).count();
        let crossed = self.lines.iter().filter(|l| crosses(l, text)).count();
        usize::from(!inside) * 100 + 10 * covered + crossed
    }
}

/// What a line of text covers.
fn bounds(([x, y], anchor): ([f64; 2], Anchor), text: &str, size: f64) -> Rectangle {
    let width = text::width(text, size);
    let left = match anchor {
        Anchor::Start => x,
        Anchor::Middle => x - 0.5 * width,
        Anchor::End => x - width,
    };
    [[left, y - 0.8 * size], [left + width, y + 0.2 * size]]
}

fn overlap(a: &Rectangle, b: &Rectangle) -> bool {
    (0..2).all(|c| a[0][c] < b[1][c] && b[0][c] < a[1][c])
}

/// Whether a segment has a part in a rectangle.
fn crosses([from, to]: &[[f64; 2]; 2], rectangle: &Rectangle) -> bool {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for c in 0..2 {
        let along = to[c] - from[c];
        let [low, high] = [rectangle[0][c] - from[c], rectangle[1][c] - from[c]];
        if along == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        enters = enters.max((low / along).min(high / along));
        leaves = leaves.min((low / along).max(high / along));
    }
    enters < leaves
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Rectangle = [[0.0, 0.0], [600.0, 400.0]];

    #[test]
    fn segments_meet_rectangles() {
        let unit = [[0.0, 0.0], [1.0, 1.0]];
        for (segment, meets) in [
            ([[-1.0, 0.5], [2.0, 0.5]], true),
            ([[0.5, 0.5], [0.6, 0.6]], true),
            ([[-1.0, 0.5], [0.5, 2.0]], false),
            ([[-1.0, 2.0], [2.0, 2.0]], false),
            ([[0.5, -2.0], [0.5, -1.0]], false),
        ] {
            assert_eq!(crosses(&segment, &unit), meets, "{segment:?}");
        }
    }

    #[test]
    fn texts_stay_in_the_frame_and_apart() {
        let mut labels = Labels::new(FRAME);
        let points = [[600.0, 3.0], [598.0, 30.0], [300.0, 200.0], [303.0, 200.0]];
        for point in points {
            labels.disc(point, 4.0);
        }
        labels.lines(&[[300.0, 200.0], [600.0, 100.0]]);
        let mut taken: Vec<Rectangle> = Vec::new();
        for point in points {
            let text = bounds(labels.beside(point, "size rule", 11.0), "size rule", 11.0);
            assert!(text[1][0] <= 600.0 && text[0][1] >= 0.0, "{text:?}");
            assert!(!taken.iter().any(|t| overlap(t, &text)), "{text:?}");
            assert!(!labels.lines.iter().any(|l| crosses(l, &text)), "{text:?}");
            taken.push(text);
        }
    }
}

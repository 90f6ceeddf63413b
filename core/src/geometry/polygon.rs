//! Polygons: area, centroid, simplicity, star shape, distances with derivatives. Corners in order, closed implicitly.

use super::Point;

/// Cross product.
pub fn cross(u: Point, v: Point) -> f64 {
    u[0] * v[1] - u[1] * v[0]
}

/// b - a.
pub fn difference(a: Point, b: Point) -> Point {
    [b[0] - a[0], b[1] - a[1]]
}

/// Distance of two points.
pub fn distance(a: Point, b: Point) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Edges as pairs of corners.
pub fn edges(corners: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]))
}

/// Signed area, counter-clockwise positive.
pub fn signed_area(corners: &[Point]) -> f64 {
    let Some(origin) = corners.first() else {
        return 0.0;
    };
    edges(corners)
        .map(|(a, b)| 0.5 * cross(difference(*origin, a), difference(*origin, b)))
        .sum()
}

/// Derivatives of [`signed_area`] with respect to the corners.
pub fn signed_area_gradient(corners: &[Point]) -> Vec<Point> {
    let n = corners.len();
    (0..n)
        .map(|i| {
            let (before, after) = (corners[(i + n - 1) % n], corners[(i + 1) % n]);
            [0.5 * (after[1] - before[1]), 0.5 * (before[0] - after[0])]
        })
        .collect()
}

/// Centroid of the enclosed area; the mean of the corners where that area is zero.
pub fn centroid(corners: &[Point]) -> Point {
    let n = corners.len() as f64;
    let mean = [0, 1].map(|i| corners.iter().map(|p| p[i]).sum::<f64>() / n);
    let (mut area, mut moment) = (0.0, [0.0; 2]);
    for (a, b) in edges(corners) {
        let (u, v) = (difference(mean, a), difference(mean, b));
        let twice = cross(u, v);
        area += twice;
        for i in 0..2 {
            moment[i] += twice * (u[i] + v[i]) / 3.0;
        }
    }
    if area == 0.0 {
        return mean;
    }
    [mean[0] + moment[0] / area, mean[1] + moment[1] / area]
}

/// Lowest and highest coordinates.
pub fn bounding_box(corners: &[Point]) -> [Point; 2] {
    let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for p in corners {
        for i in 0..2 {
            bounds[0][i] = bounds[0][i].min(p[i]);
            bounds[1][i] = bounds[1][i].max(p[i]);
        }
    }
    bounds
}

fn segments_meet(a: (Point, Point), b: (Point, Point)) -> bool {
    let side = |s: (Point, Point), p: Point| cross(difference(s.0, s.1), difference(s.0, p));
    let (d1, d2) = (side(a, b.0), side(a, b.1));
    let (d3, d4) = (side(b, a.0), side(b, a.1));
    if d1 * d2 < 0.0 && d3 * d4 < 0.0 {
        return true;
    }
    let on = |s: (Point, Point), p: Point, d: f64| {
        d == 0.0 && (0..2).all(|i| p[i] >= s.0[i].min(s.1[i]) && p[i] <= s.0[i].max(s.1[i]))
    };
    on(a, b.0, d1) || on(a, b.1, d2) || on(b, a.0, d3) || on(b, a.1, d4)
}

/// Whether no two edges meet except neighbours at their common corner.
pub fn is_simple(corners: &[Point]) -> bool {
    let n = corners.len();
    let all: Vec<_> = edges(corners).collect();
    if n < 3 || all.iter().any(|(a, b)| a == b) {
        return false;
    }
    for i in 0..n {
        for j in i + 1..n {
            let neighbours = j == i + 1 || (i == 0 && j == n - 1);
            if neighbours {
                let (first, second) = if j == i + 1 { (i, j) } else { (j, i) };
                let u = difference(all[first].0, all[first].1);
                let v = difference(all[second].0, all[second].1);
                // Folding back onto the edge before.
                if cross(u, v) == 0.0 && u[0] * v[0] + u[1] * v[1] < 0.0 {
                    return false;
                }
            } else if segments_meet(all[i], all[j]) {
                return false;
            }
        }
    }
    true
}

/// Whether every edge turns counter-clockwise about the point.
pub fn is_star_shaped(corners: &[Point], about: Point) -> bool {
    edges(corners).all(|(a, b)| cross(difference(about, a), difference(about, b)) > 0.0)
}

/// Whether a point lies inside (boundary points may go either way).
pub fn contains(corners: &[Point], p: Point) -> bool {
    edges(corners)
        .filter(|(a, b)| (a[1] > p[1]) != (b[1] > p[1]))
        .filter(|(a, b)| p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]))
        .count()
        % 2
        == 1
}

/// Distance of a point to a segment, with its derivatives with respect to the point and the segment's two ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSegment {
    /// Least distance.
    pub distance: f64,
    /// The foot's place on the segment, 0 at its start and 1 at its end.
    pub fraction: f64,
    /// Unit vector from the foot to the point; zero at distance zero.
    pub direction: Point,
}

impl PointSegment {
    /// The least distance of `p` to the segment from `a` to `b`.
    pub fn new(p: Point, a: Point, b: Point) -> Self {
        let along = difference(a, b);
        let to = difference(a, p);
        let squared = along[0] * along[0] + along[1] * along[1];
        let fraction = if squared > 0.0 {
            ((to[0] * along[0] + to[1] * along[1]) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let foot = [a[0] + fraction * along[0], a[1] + fraction * along[1]];
        let offset = difference(foot, p);
        let distance = offset[0].hypot(offset[1]);
        let direction = if distance > 0.0 {
            [offset[0] / distance, offset[1] / distance]
        } else {
            [0.0; 2]
        };
        Self {
            distance,
            fraction,
            direction,
        }
    }

    /// Derivatives with respect to the point, the segment's start and its end.
    pub fn derivatives(&self) -> [Point; 3] {
        let d = self.direction;
        let scaled = |f: f64| [f * d[0], f * d[1]];
        [d, scaled(self.fraction - 1.0), scaled(-self.fraction)]
    }
}

/// The shortest way from one polygon to another: which corner of which polygon, which edge of the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolygonGap {
    /// Whether the corner belongs to the first polygon (else to the second).
    pub corner_of_first: bool,
    /// Its index.
    pub corner: usize,
    /// The edge of the other polygon.
    pub edge: usize,
    /// Distance and derivatives.
    pub gap: PointSegment,
}

/// Least distance of the boundaries of two polygons that do not cross.
pub fn polygon_gap(first: &[Point], second: &[Point]) -> Option<PolygonGap> {
    let mut best: Option<PolygonGap> = None;
    for (corner_of_first, from, to) in [(true, first, second), (false, second, first)] {
        for (corner, p) in from.iter().enumerate() {
            for (edge, (a, b)) in edges(to).enumerate() {
                let gap = PointSegment::new(*p, a, b);
                if best.is_none_or(|found| gap.distance < found.gap.distance) {
                    best = Some(PolygonGap {
                        corner_of_first,
                        corner,
                        edge,
                        gap,
                    });
                }
            }
        }
    }
    best
}

/// Whether the interiors of two simple polygons overlap or their boundaries meet.
pub fn overlap(first: &[Point], second: &[Point]) -> bool {
    edges(first).any(|a| edges(second).any(|b| segments_meet(a, b)))
        || contains(first, second[0])
        || contains(second, first[0])
}

/// The direction along which two disjoint polygons are farthest apart, times that gap: from the first to the second.
/// `None` where they touch or overlap. An axis direction wins where it separates.
pub fn separation(first: &[Point], second: &[Point]) -> Option<Point> {
    if overlap(first, second) {
        return None;
    }
    let ([a_low, a_high], [b_low, b_high]) = (bounding_box(first), bounding_box(second));
    let along = |i: usize| {
        let (up, down) = (b_low[i] - a_high[i], a_low[i] - b_high[i]);
        if up > 0.0 {
            up
        } else if down > 0.0 {
            -down
        } else {
            0.0
        }
    };
    let axes = [along(0), along(1)];
    if axes != [0.0; 2] {
        return Some(axes);
    }
    let gap = polygon_gap(first, second)?;
    let sign = if gap.corner_of_first { -1.0 } else { 1.0 };
    Some(gap.gap.direction.map(|d| sign * gap.gap.distance * d))
}

/// Least scaled Jacobian over the corners of a quadrilateral: the sine of its corner angle, -1 to 1.
pub fn scaled_jacobian(x: &[Point; 4]) -> f64 {
    (0..4)
        .map(|k| {
            let (u, v) = (
                difference(x[k], x[(k + 1) % 4]),
                difference(x[k], x[(k + 3) % 4]),
            );
            let lengths = u[0].hypot(u[1]) * v[0].hypot(v[1]);
            if lengths > 0.0 {
                cross(u, v) / lengths
            } else {
                0.0
            }
        })
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARROW: [Point; 4] = [[0.0, 0.0], [4.0, -2.0], [1.5, 0.0], [4.0, 2.0]];

    #[test]
    fn area_and_centroid_of_known_shapes() {
        let square = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
        assert_eq!(signed_area(&square), 4.0);
        assert_eq!(centroid(&square), [2.0, 2.0]);
        let mut clockwise = square;
        clockwise.reverse();
        assert_eq!(signed_area(&clockwise), -4.0);
        // The arrow is the triangle (0, 0), (4, -2), (4, 2) less the notch (1.5, 0), (4, -2), (4, 2).
        assert!((signed_area(&ARROW) - 3.0).abs() < 1e-14);
        let x = (8.0 * 8.0 / 3.0 - 5.0 * 9.5 / 3.0) / 3.0;
        assert!((centroid(&ARROW)[0] - x).abs() < 1e-14);
    }

    #[test]
    fn simple_and_star_shaped() {
        assert!(is_simple(&ARROW));
        assert!(is_star_shaped(&ARROW, [1.0, 0.0]));
        assert!(!is_star_shaped(&ARROW, [3.0, 1.3]));
        let bow_tie = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        assert!(!is_simple(&bow_tie));
        let folded_back = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert!(!is_simple(&folded_back));
        let touching = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        assert!(!is_simple(&touching));
    }

    #[test]
    fn gaps_and_separations() {
        let low = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]];
        let high = [[1.0, 3.5], [2.0, 3.0], [3.0, 3.5]];
        let gap = polygon_gap(&low, &high).unwrap();
        assert_eq!((gap.corner_of_first, gap.corner, gap.edge), (false, 1, 2));
        assert_eq!((gap.gap.distance, gap.gap.fraction), (2.0, 0.5));
        assert_eq!(separation(&low, &high), Some([0.0, 2.0]));
        assert_eq!(separation(&high, &low), Some([0.0, -2.0]));
        let across = [[3.0, 0.5], [5.0, 0.5], [5.0, 3.0]];
        assert!(overlap(&low, &across) && separation(&low, &across).is_none());
        let within = [[1.0, 0.2], [2.0, 0.2], [2.0, 0.4]];
        assert!(overlap(&low, &within) && overlap(&within, &low));
        assert!(contains(&ARROW, [1.0, 0.0]) && !contains(&ARROW, [3.0, 0.0]));
    }

    #[test]
    fn distance_to_a_segment_has_exact_derivatives() {
        let x = [1.0, 2.0, 0.3, 0.1, 3.0, -0.5];
        let distance_of =
            |x: &[f64; 6]| PointSegment::new([x[0], x[1]], [x[2], x[3]], [x[4], x[5]]);
        let slopes = distance_of(&x).derivatives();
        for k in 0..6 {
            let at = |h: f64| {
                let mut y = x;
                y[k] += h;
                distance_of(&y).distance
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((difference - slopes[k / 2][k % 2]).abs() < 1e-9);
        }
    }
}

//! Whether chamber polygons are sound: simple, counter-clockwise, inside the unit, apart from each other.

use crate::geometry::Point;
use crate::geometry::polygon::{PointSegment, contains, distance, edges, signed_area};

/// Two boundaries nearer than this (mm) touch.
const TOUCH_MM: f64 = 1e-9;

/// What is wrong with one chamber in a unit of the given size, all of it.
pub fn chamber_faults(chamber: &[Point], unit_mm: Option<[f64; 2]>) -> Vec<String> {
    let mut faults = Vec::new();
    let unit = unit_mm.filter(|[w, h]| {
        let inside =
            |[x, y]: Point| x > TOUCH_MM && x < w - TOUCH_MM && y > TOUCH_MM && y < h - TOUCH_MM;
        !chamber.iter().copied().all(inside)
    });
    if let Some([w, h]) = unit {
        faults.push(format!(
            "the chamber is not inside its unit, 0 < x < {w} and 0 < y < {h}"
        ));
    }
    match simple(chamber) {
        Err(message) => faults.push(message),
        Ok(()) if signed_area(chamber) <= 0.0 => {
            faults.push("the corners run clockwise; counter-clockwise is expected".into());
        }
        Ok(()) => {}
    }
    faults
}

/// Whether two simple polygons cross, touch, or lie one in the other.
pub fn meet(a: &[Point], b: &[Point]) -> bool {
    if boxes_apart(a, b) {
        return false;
    }
    edges(a).any(|p| edges(b).any(|q| touch(p, q))) || contains(a, b[0]) || contains(b, a[0])
}

/// Whether a point lies strictly inside a simple polygon (on the boundary is outside).
pub fn strictly_inside(polygon: &[Point], point: Point) -> bool {
    contains(polygon, point)
        && edges(polygon).all(|(p, q)| distance_to_segment(point, p, q) > TOUCH_MM)
}

fn simple(polygon: &[Point]) -> Result<(), String> {
    let n = polygon.len();
    for i in 0..n {
        let (p, q, r) = (polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]);
        if distance(p, q) <= TOUCH_MM {
            return Err(format!("corners {i} and {} coincide", (i + 1) % n));
        }
        // The side that follows runs back over this one.
        let (u, v) = ([p[0] - q[0], p[1] - q[1]], [r[0] - q[0], r[1] - q[1]]);
        let (cross, dot) = (u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]);
        if dot > 0.0 && cross.abs() <= 1e-12 * dot {
            return Err(format!(
                "the sides at corner {} lie on each other",
                (i + 1) % n
            ));
        }
    }
    let sides: Vec<_> = edges(polygon).collect();
    for i in 0..n {
        for j in i + 2..n {
            let neighbours = i == 0 && j == n - 1;
            if !neighbours && touch(sides[i], sides[j]) {
                return Err(format!("sides {i} and {j} cross or touch"));
            }
        }
    }
    Ok(())
}

fn boxes_apart(a: &[Point], b: &[Point]) -> bool {
    let range = |polygon: &[Point], c: usize| {
        polygon
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                (low.min(p[c]), high.max(p[c]))
            })
    };
    (0..2).any(|c| {
        let ((a0, a1), (b0, b1)) = (range(a, c), range(b, c));
        a1 + TOUCH_MM < b0 || b1 + TOUCH_MM < a0
    })
}

fn distance_to_segment(point: Point, p: Point, q: Point) -> f64 {
    PointSegment::new(point, p, q).distance
}

fn touch((a, b): (Point, Point), (c, d): (Point, Point)) -> bool {
    let side = |p: Point, q: Point, r: Point| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let crosses = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
    crosses
        || distance_to_segment(a, c, d) <= TOUCH_MM
        || distance_to_segment(b, c, d) <= TOUCH_MM
        || distance_to_segment(c, a, b) <= TOUCH_MM
        || distance_to_segment(d, a, b) <= TOUCH_MM
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Point; 4] = [[10., 10.], [30., 10.], [30., 30.], [10., 30.]];

    fn faults(chamber: &[Point]) -> Vec<String> {
        chamber_faults(chamber, Some([80., 80.]))
    }

    #[test]
    fn sound_chambers_have_no_faults() {
        assert!(faults(&SQUARE).is_empty());
        assert!(faults(&[[10., 10.], [30., 10.], [12., 12.], [10., 30.]]).is_empty());
    }

    #[test]
    fn each_kind_of_fault_is_seen() {
        let mut clockwise = SQUARE;
        clockwise.reverse();
        assert!(faults(&clockwise)[0].contains("clockwise"));
        assert!(faults(&[[10., 10.], [30., 30.], [30., 10.], [10., 30.]])[0].contains("cross"));
        assert!(faults(&[[10., 10.], [10., 10.], [30., 30.]])[0].contains("coincide"));
        assert!(faults(&[[10., 10.], [30., 10.], [20., 10.]])[0].contains("lie on each other"));
        assert!(faults(&[[0., 10.], [30., 10.], [30., 30.]])[0].contains("inside its unit"));
        assert_eq!(faults(&[[-5., 10.], [30., 30.], [30., 10.]]).len(), 2);
    }

    #[test]
    fn chambers_that_meet_are_seen() {
        let moved = |dx: f64| SQUARE.map(|[x, y]| [x + dx, y]);
        assert!(meet(&SQUARE, &moved(10.)));
        assert!(meet(&SQUARE, &moved(20.)));
        assert!(!meet(&SQUARE, &moved(20.001)));
        assert!(meet(&SQUARE, &[[15., 15.], [20., 15.], [15., 20.]]));
        assert!(strictly_inside(&SQUARE, [20., 20.]));
        assert!(!strictly_inside(&SQUARE, [10., 20.]));
        assert!(!strictly_inside(&SQUARE, [9., 20.]));
    }
}

//! Rotation of a line between two points of the body, counter-clockwise positive, degrees.
//!
//! With a the line in the reference shape and b = a + u_to - u_from the deformed one, the angle is that from a to b. It is
//! continued along the path, so that it is smooth where the line passes half a turn: between two states it turns by less
//! than that.

/// Angle from `a` to `b` in (-180, 180], degrees.
fn between(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] * b[1] - a[1] * b[0])
        .atan2(a[0] * b[0] + a[1] * b[1])
        .to_degrees()
}

/// The rotation at the last of the states, given the line in the reference shape and in the states up to it.
pub fn angle_deg(reference: [f64; 2], lines: &[[f64; 2]]) -> f64 {
    let mut before = reference;
    let mut angle = 0.0;
    for line in lines {
        angle += between(before, *line);
        before = *line;
    }
    angle
}

/// d angle / d line at its state, degrees per mm; at the far end of the line it acts as it is, at the near end negated.
pub fn gradient(line: [f64; 2]) -> [f64; 2] {
    let square = line[0] * line[0] + line[1] * line[1];
    [-line[1] / square, line[0] / square].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_and_stretched_line_has_turned_by_its_angle_even_beyond_half_a_turn() {
        let reference = [0.3, 0.4];
        let turned = |degrees: f64, stretch: f64| {
            let (s, c) = degrees.to_radians().sin_cos();
            [
                stretch * (c * reference[0] - s * reference[1]),
                stretch * (s * reference[0] + c * reference[1]),
            ]
        };
        for last in [-260.0_f64, -90.0, 0.0, 30.0, 200.0, 400.0] {
            let lines: Vec<_> = (0..=8)
                .map(|k| turned(last * f64::from(k) / 8.0, 1.0 + 0.1 * f64::from(k)))
                .collect();
            assert!(
                (angle_deg(reference, &lines) - last).abs() < 1e-10,
                "{last}"
            );
        }
    }

    #[test]
    fn gradient_matches_differences() {
        let (line, h) = ([-3.0, 5.0], 1e-5);
        for k in 0..2 {
            let at = |s: f64| {
                let mut moved = line;
                moved[k] += s;
                angle_deg([0.0, 1.0], &[moved])
            };
            let difference = (at(h) - at(-h)) / (2.0 * h);
            assert!((difference - gradient(line)[k]).abs() < 1e-8);
        }
    }
}

//! The design space of the reduced model: how much area can so many actuations enclose, and how it depends on two entries.

use serde::{Deserialize, Serialize};

use super::{Entry, LinearTransform, area};

/// A box of transformations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Least entries.
    pub lower: LinearTransform,
    /// Largest entries.
    pub upper: LinearTransform,
}

impl Bounds {
    /// The least box that holds some transformations and rest.
    pub fn around(transforms: &[LinearTransform]) -> Self {
        let of = |pick: fn(f64, f64) -> f64| {
            let rest = LinearTransform::IDENTITY.entries();
            let entries = transforms.iter().map(LinearTransform::entries);
            let entries = entries.fold(rest, |m, e| std::array::from_fn(|i| pick(m[i], e[i])));
            LinearTransform::from_slice(&entries)
        };
        Self {
            lower: of(f64::min),
            upper: of(f64::max),
        }
    }

    /// Where in the box, each entry from 0 to 1.
    fn at(&self, z: &[f64; 4]) -> LinearTransform {
        let (low, high) = (self.lower.entries(), self.upper.entries());
        // Rounding shall not leave the box.
        let entry = |i: usize| (low[i] + z[i] * (high[i] - low[i])).min(high[i]);
        LinearTransform::from_slice(&std::array::from_fn(entry))
    }

    fn widths(&self) -> [f64; 4] {
        let (low, high) = (self.lower.entries(), self.upper.entries());
        std::array::from_fn(|i| high[i] - low[i])
    }
}

/// The best that was found for a number of actuations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Explored {
    /// Number of actuations.
    pub actuations: usize,
    /// Enclosed area, mm^2. Reversing the order of the actuations changes its sign, so it is the largest of either sense.
    pub area_mm2: f64,
    /// The transformations in their order, counter-clockwise.
    pub transforms: Vec<LinearTransform>,
}

/// Steps of one ascent.
const STEPS: usize = 300;

/// Largest areas of 1 to `most` actuations within bounds, for `units` equal units: projected gradient ascent from `starts`
/// places spread evenly over the box, and from the best of one actuation less with its last one repeated, so that the areas
/// never fall. Local: lower bounds of what there is.
pub fn largest_areas(
    most: usize,
    bounds: &Bounds,
    unit_mm: [f64; 2],
    units: usize,
    starts: usize,
) -> Vec<Explored> {
    let mut found: Vec<(f64, Vec<[f64; 4]>)> = Vec::new();
    for count in 1..=most {
        let one_less = found.last().map(|(_, z)| {
            let mut start = z.clone();
            start.extend(z.last().copied());
            start
        });
        let spread = (1..=starts).map(|index| spread(index, count));
        let ends = one_less.into_iter().chain(spread).map(|start| {
            ascent(start, |z| {
                let transforms: Vec<LinearTransform> = z.iter().map(|z| bounds.at(z)).collect();
                let (value, mut gradient) = area(&transforms, unit_mm, units);
                let widths = bounds.widths();
                for g in &mut gradient {
                    *g = std::array::from_fn(|i| g[i] * widths[i]);
                }
                (value, gradient)
            })
        });
        let best = ends.fold((0.0, vec![[0.0; 4]; count]), |best, end| {
            if end.0 > best.0 { end } else { best }
        });
        found.push(best);
    }
    found
        .into_iter()
        .map(|(area_mm2, z)| Explored {
            actuations: z.len(),
            area_mm2,
            transforms: z.iter().map(|z| bounds.at(z)).collect(),
        })
        .collect()
}

/// Point `index` of an additive recurrence with the generalised golden ratio g^(d+1) = g + 1 of d = 4 `count`, which fills the
/// cube evenly for any number of points (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
fn spread(index: usize, count: usize) -> Vec<[f64; 4]> {
    let d = 4 * count;
    let mut ratio = 2.0_f64;
    for _ in 0..60 {
        ratio = (1.0 + ratio).powf(1.0 / (d as f64 + 1.0));
    }
    let place = |k: usize| (0.5 + index as f64 * ratio.powi(-(k as i32 + 1))).fract();
    (0..count)
        .map(|a| std::array::from_fn(|i| place(4 * a + i)))
        .collect()
}

type Valued = (f64, Vec<[f64; 4]>);

/// Climbs in the unit cube: steps along the gradient, projected, longer after a rise and shorter after none (Armijo's rule).
fn ascent(mut z: Vec<[f64; 4]>, of: impl Fn(&[[f64; 4]]) -> Valued) -> Valued {
    let (mut value, mut gradient) = of(&z);
    let largest = |g: &[[f64; 4]]| g.iter().flatten().fold(0.0, |m: f64, g| m.max(g.abs()));
    let steepest = largest(&gradient);
    if steepest == 0.0 || !value.is_finite() {
        return (value, z);
    }
    let mut step = 0.25 / steepest;
    for _ in 0..STEPS {
        let moved: Vec<[f64; 4]> = (z.iter().zip(&gradient))
            .map(|(z, g)| std::array::from_fn(|i| (z[i] + step * g[i]).clamp(0.0, 1.0)))
            .collect();
        let pairs = || moved.iter().flatten().zip(z.iter().flatten());
        let expected: f64 = (pairs().zip(gradient.iter().flatten()))
            .map(|((m, z), g)| (m - z) * g)
            .sum();
        let far = pairs().fold(0.0, |far: f64, (m, z)| far.max((m - z).abs()));
        if far < 1e-12 {
            break;
        }
        let (higher, slope) = of(&moved);
        if higher >= value + 1e-4 * expected {
            (z, value, gradient) = (moved, higher, slope);
            step *= 2.0;
        } else {
            step *= 0.3;
        }
    }
    (value, z)
}

/// An axis of a map: the values of one entry of one actuation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapAxis {
    /// The actuation, from 0.
    pub actuation: usize,
    /// Its entry.
    pub entry: Entry,
    /// The values.
    pub values: Vec<f64>,
}

/// Areas over two entries.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AreaMap {
    /// The two axes.
    pub axes: [MapAxis; 2],
    /// Signed areas, mm^2: a row for each value of the second axis.
    pub area_mm2: Vec<Vec<f64>>,
}

/// Why there is no map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an axis names actuation {asked} (from 0) of {count}")]
pub struct CannotMap {
    /// The actuation that an axis names.
    pub asked: usize,
    /// How many there are.
    pub count: usize,
}

/// The area over two entries, all others as in `actuations`.
///
/// # Errors
/// An axis of an actuation that is not there.
pub fn area_map(
    actuations: &[LinearTransform],
    axes: [MapAxis; 2],
    unit_mm: [f64; 2],
    units: usize,
) -> Result<AreaMap, CannotMap> {
    let count = actuations.len();
    if let Some(axis) = axes.iter().find(|a| a.actuation >= count) {
        return Err(CannotMap {
            asked: axis.actuation,
            count,
        });
    }
    let at = |values: [f64; 2]| {
        let mut entries: Vec<[f64; 4]> = actuations.iter().map(LinearTransform::entries).collect();
        for (axis, value) in axes.iter().zip(values) {
            entries[axis.actuation][axis.entry as usize] = value;
        }
        let moved: Vec<_> = entries.iter().map(LinearTransform::from_slice).collect();
        area(&moved, unit_mm, units).0
    };
    let row = |second: &f64| {
        axes[0]
            .values
            .iter()
            .map(|first| at([*first, *second]))
            .collect()
    };
    let area_mm2 = axes[1].values.iter().map(row).collect();
    Ok(AreaMap { axes, area_mm2 })
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [f64; 2] = [80.0; 2];

    /// Two units whose edges do not turn: the tip moves over a rectangle of 160 (x_scl - 1) by 160 y_sh.
    #[test]
    fn without_turns_the_areas_are_those_of_polygons_in_a_rectangle() {
        let bounds = Bounds {
            lower: LinearTransform::from_slice(&[1.0, 0.0, 0.0, 1.0]),
            upper: LinearTransform::from_slice(&[1.2, 0.0, 0.1, 1.0]),
        };
        let found = largest_areas(5, &bounds, UNIT, 2, 12);
        let rectangle = 32.0 * 16.0;
        for (explored, share) in found.iter().zip([0.0, 0.5, 1.0, 1.0, 1.0]) {
            let difference = explored.area_mm2 - share * rectangle;
            assert!(difference.abs() < 1e-9, "{explored:?}");
            assert_eq!(explored.transforms.len(), explored.actuations);
        }
    }

    #[test]
    fn two_actuations_are_needed_and_more_never_enclose_less() {
        let bounds = Bounds::around(&[
            LinearTransform::from_slice(&[0.98, -0.06, -0.02, 0.99]),
            LinearTransform::from_slice(&[1.08, 0.06, 0.03, 1.02]),
        ]);
        let found = largest_areas(5, &bounds, UNIT, 9, 8);
        assert_eq!(found[0].area_mm2, 0.0);
        assert!(found[1].area_mm2 > 1e3);
        for pair in found.windows(2) {
            assert!(pair[1].area_mm2 >= pair[0].area_mm2);
        }
        assert_eq!(found, largest_areas(5, &bounds, UNIT, 9, 8));
        for explored in &found {
            let (again, _) = area(&explored.transforms, UNIT, 9);
            assert!((again - explored.area_mm2).abs() <= 1e-9 * again.abs());
            for t in &explored.transforms {
                let within = Bounds::around(&[bounds.lower, bounds.upper, *t]);
                assert_eq!(within, bounds);
            }
        }
    }

    #[test]
    fn a_map_has_the_areas_of_its_axes() {
        let two = [
            LinearTransform::from_slice(&[1.02, -0.05, 0.01, 1.0]),
            LinearTransform::from_slice(&[1.05, 0.02, 0.01, 1.0]),
        ];
        let axis = |actuation, values: &[f64]| MapAxis {
            actuation,
            entry: Entry::XSh,
            values: values.to_vec(),
        };
        let axes = [axis(0, &[-0.05, 0.0, 0.05]), axis(1, &[0.02, 0.04])];
        let map = area_map(&two, axes, UNIT, 9).unwrap();
        assert_eq!(map.area_mm2.len(), 2);
        assert_eq!(map.area_mm2[0][0], area(&two, UNIT, 9).0);
        assert_ne!(map.area_mm2[1][2], map.area_mm2[0][2]);
        let wrong = area_map(&two, [axis(0, &[0.0]), axis(2, &[0.0])], UNIT, 9);
        assert_eq!(wrong, Err(CannotMap { asked: 2, count: 2 }));
    }
}

//! Axes: round numbers and where they stand.

/// A range of values on a range of px.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Values at the two ends.
    pub values: [f64; 2],
    /// Pixels at the two ends.
    pub pixels: [f64; 2],
    /// Distance of the ticks.
    pub step: f64,
}

/// The largest of 1, 2, 5 times a power of ten that is not above a positive number.
pub fn round_below(x: f64) -> f64 {
    let power = 10_f64.powf(x.log10().floor());
    [5.0, 2.0]
        .into_iter()
        .map(|m| m * power)
        .find(|round| *round <= x * (1.0 + 1e-12))
        .unwrap_or(power)
}

impl Axis {
    /// An axis that holds all finite values with about `ticks` ticks; its ends are ticks.
    pub fn around(values: impl IntoIterator<Item = f64>, pixels: [f64; 2], ticks: usize) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.into_iter().filter(|v| v.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let spread = high - low;
        if spread <= 1e-12 * high.abs().max(low.abs()) {
            let half = if high == 0.0 { 0.5 } else { high.abs() / 2.0 };
            (low, high) = (low - half, high + half);
        }
        let mut step = round_below((high - low) / ticks as f64);
        if (high - low) / step > 1.5 * ticks as f64 {
            step = round_below(2.6 * step);
        }
        Self {
            values: [(low / step).floor() * step, (high / step).ceil() * step],
            pixels,
            step,
        }
    }

    /// Where a value stands.
    pub fn pixel(&self, value: f64) -> f64 {
        let [low, high] = self.values;
        let [from, to] = self.pixels;
        from + (value - low) / (high - low) * (to - from)
    }

    /// Ticks with their labels.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let count = ((self.values[1] - self.values[0]) / self.step).round() as usize;
        let decimals = (-self.step.log10().floor()).clamp(0.0, 12.0) as usize;
        let first = (self.values[0] / self.step).round();
        (0..=count)
            .map(|i| (first + i as f64) * self.step)
            .map(|value| (value, label(value, decimals, self.step)))
            .collect()
    }
}

/// How values lie on an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// By their logarithm; values that are not positive have no place.
    #[default]
    Logarithmic,
    /// As they are.
    Linear,
}

impl Scale {
    /// Logarithmic for positive values that span more than a factor of 30.
    pub fn fitting(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        if low > 0.0 && high > 30.0 * low {
            Self::Logarithmic
        } else {
            Self::Linear
        }
    }
}

/// An axis of either scale.
#[derive(Clone, Debug)]
pub enum Ruler {
    /// Whole decades on a range of px.
    Logarithmic([i32; 2], [f64; 2]),
    /// Round numbers.
    Linear(Axis),
}

impl Ruler {
    /// An axis that holds all values that it can show.
    pub fn new(scale: Scale, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        match scale {
            Scale::Logarithmic => Self::Logarithmic(decades(values), pixels),
            Scale::Linear => Self::Linear(Axis::around(values, pixels, 6)),
        }
    }

    /// Where a value stands; `None` for one that it cannot show.
    pub fn pixel(&self, value: f64) -> Option<f64> {
        match self {
            Self::Logarithmic([low, high], [from, to]) => {
                let along = (value.log10() - f64::from(*low)) / f64::from(high - low);
                (value.is_finite() && value > 0.0).then_some(from + (to - from) * along)
            }
            Self::Linear(axis) => value.is_finite().then(|| axis.pixel(value)),
        }
    }

    /// Pixels of the ticks with their labels.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        match self {
            Self::Logarithmic([low, high], _) => (*low..=*high)
                .filter_map(|power| {
                    let label = match power {
                        -3..=3 => format!("{}", 10_f64.powi(power)),
                        _ => format!("1e{power}").replace('-', "\u{2212}"),
                    };
                    Some((self.pixel(10_f64.powi(power))?, label))
                })
                .collect(),
            Self::Linear(axis) => axis
                .ticks()
                .into_iter()
                .map(|(value, label)| (axis.pixel(value), label))
                .collect(),
        }
    }

    /// Pixels of the lines between the ticks.
    pub fn minor(&self) -> Vec<f64> {
        match self {
            Self::Logarithmic([low, high], _) => (*low..*high)
                .flat_map(|power| (2..=9).map(move |m| f64::from(m) * 10_f64.powi(power)))
                .filter_map(|value| self.pixel(value))
                .collect(),
            Self::Linear(_) => Vec::new(),
        }
    }
}

/// Whole decades that hold all positive values.
fn decades(values: impl Iterator<Item = f64>) -> [i32; 2] {
    let (low, high) = values
        .filter(|v| v.is_finite() && *v > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    if high == 0.0 {
        return [-1, 0];
    }
    let ends = [low.log10().floor() as i32, high.log10().ceil() as i32];
    [ends[0], ends[1].max(ends[0] + 1)]
}

fn label(value: f64, decimals: usize, step: f64) -> String {
    if value != 0.0 && (value.abs() >= 1e6 || step < 1e-4) {
        return format!("{value:e}").replace('-', "\u{2212}");
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        // A typographic minus; no sign on zero.
        Some(rest) if rest.bytes().any(|b| (b'1'..=b'9').contains(&b)) => format!("\u{2212}{rest}"),
        Some(rest) => rest.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_the_values() {
        assert_eq!(decades([0.02, 3.0].into_iter()), [-2, 1]);
        assert_eq!(decades([1.0].into_iter()), [0, 1]);
        assert_eq!(decades([f64::NAN, 0.0].into_iter()), [-1, 0]);
    }

    #[test]
    fn wide_ranges_are_logarithmic() {
        let fitting = |values: &[f64]| Scale::fitting(values.iter().copied());
        assert_eq!(fitting(&[0.1, 50.0, f64::NAN]), Scale::Logarithmic);
        assert_eq!(fitting(&[0.02, 0.07]), Scale::Linear);
        assert_eq!(fitting(&[0.0, 50.0]), Scale::Linear);
        assert_eq!(fitting(&[]), Scale::Linear);
    }

    #[test]
    fn ticks_are_round_and_hold_the_values() {
        for values in [
            vec![0.0, 843.0],
            vec![-342.0, -0.2],
            vec![1e-6, 3e-6],
            vec![5.0],
            vec![0.0],
            vec![],
            vec![f64::NAN, 2.0, 7.0],
        ] {
            let axis = Axis::around(values.clone(), [0.0, 100.0], 6);
            let ticks = axis.ticks();
            assert!((3..=11).contains(&ticks.len()), "{values:?}: {ticks:?}");
            for value in values.into_iter().filter(|v| v.is_finite()) {
                assert!((-1e-9..=100.0 + 1e-9).contains(&axis.pixel(value)));
            }
        }
        let axis = Axis::around([-342.0, 10.0], [0.0, 1.0], 6);
        let labels: Vec<String> = axis.ticks().into_iter().map(|t| t.1).collect();
        assert_eq!(
            labels,
            [
                "\u{2212}350",
                "\u{2212}300",
                "\u{2212}250",
                "\u{2212}200",
                "\u{2212}150",
                "\u{2212}100",
                "\u{2212}50",
                "0",
                "50"
            ]
        );
    }
}

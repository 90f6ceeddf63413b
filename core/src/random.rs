//! Reproducible random numbers: SplitMix64 (Steele, Lea and Flood 2014), the same on every machine and for ever.

use serde::{Deserialize, Serialize};

/// A stream of 64-bit numbers; as a record it is its place in the sequence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number in [0, 1) with 53 random bits.
    pub fn next_unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A normal deviate of mean 0 and variance 1 (polar method: Marsaglia and Bray 1964). Made of operations that IEEE 754
    /// rounds in one way only, so that a stream gives the same bits with every mathematical library.
    pub fn next_normal(&mut self) -> f64 {
        loop {
            let u = 2.0 * self.next_unit() - 1.0;
            let v = 2.0 * self.next_unit() - 1.0;
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * (-2.0 * ln(s) / s).sqrt();
            }
        }
    }
}

/// The natural logarithm of a normal positive number, to a few units in the last place: x = m 2^e with m around 1, and
/// ln m = 2 artanh((m - 1) / (m + 1)) by its series.
fn ln(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) & 0x7FF) as i64 - 1023;
    let mantissa = f64::from_bits((x.to_bits() & ((1 << 52) - 1)) | (1023 << 52));
    let (m, e) = if mantissa > std::f64::consts::SQRT_2 {
        (0.5 * mantissa, exponent + 1)
    } else {
        (mantissa, exponent)
    };
    let t = (m - 1.0) / (m + 1.0);
    // |t| < 0.172: the first term left out is below 2e-18 of the sum.
    let series = (0..12)
        .rev()
        .fold(0.0, |sum, k| sum * t * t + 1.0 / (2 * k + 1) as f64);
    2.0 * t * series + e as f64 * std::f64::consts::LN_2
}

/// The seed of the k-th random start: 53 bits, so that every reader of JSON keeps it.
pub fn start_seed(seed: u64, k: usize) -> u64 {
    let mut stream = SplitMix64::new(seed);
    let base = stream.next_u64();
    SplitMix64::new(base ^ (k as u64).wrapping_mul(0xD1B5_4A32_D192_ED03)).next_u64() >> 11
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_that_of_the_published_algorithm() {
        // Reference values of the public-domain C code for the seed 1234567.
        let mut stream = SplitMix64::new(1_234_567);
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(expected.map(|_| stream.next_u64()), expected);
    }

    #[test]
    fn normal_deviates_have_the_moments_and_tails_of_their_distribution() {
        let mut stream = SplitMix64::new(7);
        let n = 200_000;
        let deviates: Vec<f64> = (0..n).map(|_| stream.next_normal()).collect();
        let moment = |k: i32| deviates.iter().map(|z| z.powi(k)).sum::<f64>() / n as f64;
        let share =
            |limit: f64| deviates.iter().filter(|z| z.abs() > limit).count() as f64 / n as f64;
        // Within four standard errors.
        for (found, expected, error) in [
            (moment(1), 0.0, 1.0),
            (moment(2), 1.0, 1.42),
            (moment(3), 0.0, 3.88),
            (moment(4), 3.0, 9.8),
            (share(1.0), 0.317_311, 0.466),
            (share(3.0), 0.002_699_8, 0.052),
        ] {
            let allowed = 4.0 * error / (n as f64).sqrt();
            assert!((found - expected).abs() < allowed, "{found}, {expected}");
        }
    }

    #[test]
    fn the_logarithm_is_that_of_the_library() {
        let mut stream = SplitMix64::new(3);
        for _ in 0..10_000 {
            let x = stream.next_unit() + 1e-300;
            let y = 1.0 / x;
            for x in [x, y] {
                let error = (ln(x) - x.ln()).abs() / x.ln().abs().max(1e-3);
                assert!(error < 1e-15, "ln {x}: {error:e}");
            }
        }
    }

    #[test]
    fn starts_have_their_own_seeds() {
        let seeds: std::collections::BTreeSet<_> = (0..1000).map(|k| start_seed(1, k)).collect();
        assert_eq!(seeds.len(), 1000);
        assert!(seeds.iter().all(|s| *s < 1 << 53));
        assert_ne!(start_seed(1, 0), start_seed(2, 0));
    }
}

//! Reproducible random numbers: SplitMix64 (Steele, Lea and Flood 2014), the same on every machine and for ever.

/// A stream of 64-bit numbers.
#[derive(Clone, Debug)]
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
    fn starts_have_their_own_seeds() {
        let seeds: std::collections::BTreeSet<_> = (0..1000).map(|k| start_seed(1, k)).collect();
        assert_eq!(seeds.len(), 1000);
        assert!(seeds.iter().all(|s| *s < 1 << 53));
        assert_ne!(start_seed(1, 0), start_seed(2, 0));
    }
}

//! Counter-based random numbers: Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2,
//! 3", SC 2011). Every number is a function of seed, stream and index, so the order of computation does not matter.

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Stream {
    key: [u32; 2],
    counter: [u32; 4],
    words: [u32; 4],
    used: usize,
}

/// Computes ten rounds of Philox.
const fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    const MULTIPLIERS: [u64; 2] = [0xD251_1F53, 0xCD9E_8D57];
    const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
    let mut round = 0;
    while round < 10 {
        let products = [MULTIPLIERS[0] * counter[0] as u64, MULTIPLIERS[1] * counter[2] as u64];
        counter = [
            high(products[1]) ^ counter[1] ^ key[0],
            low(products[1]),
            high(products[0]) ^ counter[3] ^ key[1],
            low(products[0]),
        ];
        key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
        round += 1;
    }
    counter
}

const fn high(product: u64) -> u32 {
    (product >> 32) as u32
}

#[expect(clippy::cast_possible_truncation, reason = "the lower half")]
const fn low(product: u64) -> u32 {
    product as u32
}

impl Stream {
    /// Starts a stream with a seed.
    pub(crate) const fn new(seed: u64, stream: u64) -> Self {
        Self { key: [low(seed), high(seed)], counter: [0, 0, low(stream), high(stream)], words: [0; 4], used: 4 }
    }

    fn word(&mut self) -> u32 {
        if self.used == 4 {
            self.words = philox(self.counter, self.key);
            self.counter[0] = self.counter[0].wrapping_add(1);
            self.counter[1] = self.counter[1].wrapping_add(u32::from(self.counter[0] == 0));
            self.used = 0;
        }
        self.used += 1;
        self.words[self.used - 1]
    }

    /// Returns a uniform number in [0, 1), in steps of 2⁻⁵³.
    pub(crate) fn share(&mut self) -> f64 {
        let bits = u64::from(self.word()) << 32 | u64::from(self.word());
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a uniform whole number below `count`, which is small.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the number of items")]
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Returns a standard normal number (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        // The argument of the logarithm is never 0.
        let radius = (-2.0 * (1.0 - self.share()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.share()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::{Stream, philox};

    /// Test vectors of the authors' Random123.
    #[test]
    fn rounds_match_known_answers() {
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox([u32::MAX; 4], [u32::MAX; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
        let counter = [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344];
        let known = [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1];
        assert_eq!(philox(counter, [0xa409_3822, 0x299f_31d0]), known);
    }

    #[test]
    fn numbers_have_their_distributions() {
        const COUNT: u32 = 100_000;
        let mut stream = Stream::new(7, 3);
        let shares: f64 = (0..COUNT).map(|_| stream.share()).sum();
        assert!((shares / f64::from(COUNT) - 0.5).abs() < 0.004);
        let (sum, squares) =
            (0..COUNT).map(|_| stream.normal()).fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
        assert!((sum / f64::from(COUNT)).abs() < 0.014 && (squares / f64::from(COUNT) - 1.0).abs() < 0.02);
    }
}

//! Random choices for networks that tests make up, and how many of them to make.

/// A generator of numbers (xorshift): the same seed, which is not 0, gives the same numbers.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// The generator of a network with this number; its first numbers, which are alike for
    /// neighbouring seeds, are left out.
    pub(crate) fn of_network(number: u64) -> Random {
        let mut random = Random(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..4 {
            random.below(2);
        }
        random
    }

    /// A number below the limit.
    pub(crate) fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 20) % limit as u64) as usize
    }

    /// Yes, in so many of a hundred cases.
    pub(crate) fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    /// One of the texts.
    pub(crate) fn one_of<'t>(&mut self, texts: &[&'t str]) -> &'t str {
        texts[self.below(texts.len())]
    }
}

/// The number in the environment variable `NETWORKS`, or the usual one.
pub(crate) fn networks(usual: u64) -> u64 {
    std::env::var("NETWORKS").map_or(usual, |number| {
        number.parse().expect("NETWORKS is a number")
    })
}

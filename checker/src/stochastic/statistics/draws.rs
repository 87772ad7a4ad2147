//! Random values with known means, for tests of coverage.

/// Random numbers: the generator of G. L. Steele et al., "Fast splittable pseudorandom number
/// generators", OOPSLA 2014.
pub(in crate::stochastic) struct Draws(u64);

impl Draws {
    pub(in crate::stochastic) fn new(seed: u64) -> Draws {
        Draws(seed.wrapping_mul(0xa076_1d64_78bd_642f))
    }

    /// A number between 0 and 1.
    pub(in crate::stochastic) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A mean, and what draws a value between 0 and 1 that has it.
pub(in crate::stochastic) type Kind = (f64, fn(&mut Draws) -> f64);

/// Values of several forms: a fair coin, a rare 1, all numbers alike, mostly small numbers, two
/// near ones.
pub(in crate::stochastic) const KINDS: [Kind; 5] = [
    (0.5, |draws| f64::from(draws.next() < 0.5)),
    (0.02, |draws| f64::from(draws.next() < 0.02)),
    (0.5, Draws::next),
    (0.1, |draws| draws.next().powi(9)),
    (0.75, |draws| if draws.next() < 0.5 { 0.7 } else { 0.8 }),
];

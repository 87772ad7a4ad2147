//! Random numbers of runs: the generator, and the table of the random functions of the language.
//!
//! The generator is Philox4x32-10: block number `n` of run `k` with seed `s` is a function of these
//! three numbers alone. So a run is the same whatever ran before it, and on whichever thread. All
//! that it has to remember lies in [`STREAM_WORDS`] words of the state, which are copied with it.
//!
//! The distributions are those of the crate `rand_distr`. A new random function is one row in the
//! table of [`Distribution`].
//!
//! Reference: Salmon, Moraes, Dror and Shaw, "Parallel Random Numbers: As Easy as 1, 2, 3" (2011).
//! Cost: some 2 ns for a word of 32 random bits.

use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;

use rand_core::{Rng, TryRng};
use rand_distr::{
    Beta, Distribution as _, Exp1, Gamma, Normal, OpenClosed01, Poisson, StandardUniform,
    Triangular, Uniform, Weibull,
};

/// The words that a stream of random numbers takes in the state.
pub const STREAM_WORDS: usize = BLOCK + BUFFER_WORDS;

/// The random functions have at most this number of parameters.
pub(crate) const MOST_PARAMETERS: usize = 3;

// Where the parts of a stream lie in its words. Numbers of 64 bits have the low word first.
const SEED: usize = 0;
const RUN: usize = 2;
/// How many words were drawn.
pub(crate) const POSITION: usize = 4;
/// The blocks around the last word that was drawn, if they have further ones.
pub(crate) const BLOCK: usize = 6;
const BLOCK_WORDS: usize = 4;
/// So many blocks are made together: a processor can work on all of them at once.
const BLOCKS: usize = 4;
/// How many words of blocks there are; a power of 2.
pub(crate) const BUFFER_WORDS: usize = BLOCKS * BLOCK_WORDS;

/// The random numbers of a run, over the words that hold their state. Words that are all 0 are the
/// start of run 0 with seed 0.
#[derive(Debug)]
pub struct Stream<'a>(&'a mut [i32]);

impl<'a> Stream<'a> {
    /// The stream that these [`STREAM_WORDS`] words hold.
    #[inline]
    pub fn of(words: &'a mut [i32]) -> Stream<'a> {
        Stream(&mut words[..STREAM_WORDS])
    }

    /// Makes the first [`STREAM_WORDS`] words the start of a run, and returns its stream.
    pub fn start(words: &'a mut [i32], seed: u64, run: u64) -> Stream<'a> {
        let mut stream = Stream::of(words);
        stream.0.fill(0);
        stream.set_number(SEED, seed);
        stream.set_number(RUN, run);
        stream
    }

    /// A number in `[0, 1)`, one of the 2^53 equidistant ones.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        StandardUniform.sample(self)
    }

    /// A number in `(0, 1]`, one of 2^53 equidistant ones.
    #[inline]
    pub fn open_uniform(&mut self) -> f64 {
        OpenClosed01.sample(self)
    }

    /// An exponentially distributed number. The rate is greater than 0.
    #[inline]
    pub fn exponential(&mut self, rate: f64) -> f64 {
        let one: f64 = Exp1.sample(self);
        one / rate
    }

    /// An integer less than `n`, each with the same probability. `n` is not 0.
    #[inline]
    pub fn below(&mut self, n: u32) -> u32 {
        let range = Uniform::new(0, n).expect("some integer is less than the bound");
        range.sample(self)
    }

    #[inline]
    fn number(&self, place: usize) -> u64 {
        let (low, high) = (self.0[place] as u32, self.0[place + 1] as u32);
        u64::from(high) << 32 | u64::from(low)
    }

    #[inline]
    fn set_number(&mut self, place: usize, number: u64) {
        self.0[place] = number as i32;
        self.0[place + 1] = (number >> 32) as i32;
    }

    /// Makes the words of the blocks from this one on.
    fn fill(&mut self, first: u64) {
        let (run, seed) = (self.number(RUN), self.number(SEED));
        let counters: [_; BLOCKS] =
            std::array::from_fn(|block| words_of(first.wrapping_add(block as u64), run));
        let random = philox(counters, [seed as u32, (seed >> 32) as u32]);
        for (target, word) in self.0[BLOCK..].iter_mut().zip(random.as_flattened()) {
            *target = *word as i32;
        }
    }

    #[inline]
    fn next_word(&mut self) -> u32 {
        let position = self.number(POSITION);
        let word = (position % BUFFER_WORDS as u64) as usize;
        if word == 0 {
            self.fill(position / BLOCK_WORDS as u64);
        }
        self.set_number(POSITION, position.wrapping_add(1));
        self.0[BLOCK + word] as u32
    }

    /// Two words, the first one low.
    #[inline]
    fn next_pair(&mut self) -> u64 {
        let position = self.number(POSITION);
        let word = (position % BUFFER_WORDS as u64) as usize;
        if word + 1 == BUFFER_WORDS {
            let low = u64::from(self.next_word());
            return u64::from(self.next_word()) << 32 | low;
        }
        if word == 0 {
            self.fill(position / BLOCK_WORDS as u64);
        }
        self.set_number(POSITION, position.wrapping_add(2));
        self.number(BLOCK + word)
    }
}

impl TryRng for Stream<'_> {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next_word())
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.next_pair())
    }

    fn try_fill_bytes(&mut self, target: &mut [u8]) -> Result<(), Infallible> {
        for bytes in target.chunks_mut(size_of::<u32>()) {
            bytes.copy_from_slice(&self.next_u32().to_le_bytes()[..bytes.len()]);
        }
        Ok(())
    }
}

#[inline]
fn words_of(low: u64, high: u64) -> [u32; 4] {
    [
        low as u32,
        (low >> 32) as u32,
        high as u32,
        (high >> 32) as u32,
    ]
}

const ROUNDS: usize = 10;
const MULTIPLIERS: [u32; 2] = [0xd251_1f53, 0xcd9e_8d57];
/// What is added to the key from round to round.
const WEYL: [u32; 2] = [0x9e37_79b9, 0xbb67_ae85];

/// Philox4x32-10 of several counters.
#[inline]
fn philox<const N: usize>(mut counters: [[u32; 4]; N], key: [u32; 2]) -> [[u32; 4]; N] {
    let [mut left, mut right] = key;
    for _ in 0..ROUNDS {
        for counter in &mut counters {
            let [a, b, c, d] = *counter;
            let first = u64::from(MULTIPLIERS[0]) * u64::from(a);
            let second = u64::from(MULTIPLIERS[1]) * u64::from(c);
            *counter = [
                (second >> 32) as u32 ^ b ^ left,
                second as u32,
                (first >> 32) as u32 ^ d ^ right,
                first as u32,
            ];
        }
        left = left.wrapping_add(WEYL[0]);
        right = right.wrapping_add(WEYL[1]);
    }
    counters
}

macro_rules! distributions {
    ($(
        $(#[$doc:meta])*
        $variant:ident $name:literal $(| $older:literal)? $code:ident($($parameter:ident),+),
    )*) => {
        /// A random function of the language. Its parameters and its result are doubles.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Distribution {
            $($(#[$doc])* $variant,)*
        }

        impl Distribution {
            /// All of them.
            pub const ALL: &[Distribution] = &[$(Distribution::$variant),*];

            /// The function of this name.
            pub fn named(name: &str) -> Option<Distribution> {
                Some(match name {
                    $($name $(| $older)? => Distribution::$variant,)*
                    _ => return None,
                })
            }

            /// Its name in the language.
            pub fn name(self) -> &'static str {
                match self {
                    $(Distribution::$variant => $name,)*
                }
            }

            /// How many parameters it has.
            pub fn arity(self) -> usize {
                match self {
                    $(Distribution::$variant => [$(stringify!($parameter)),+].len(),)*
                }
            }

            /// What is wrong where it has no result.
            pub(crate) fn failure(self) -> &'static str {
                match self {
                    $(Distribution::$variant => {
                        concat!("a parameter of `", $name, "` is out of its domain")
                    })*
                }
            }

            /// Draws a number; `None` if an argument is out of the domain of its parameter. It is
            /// never a NaN.
            #[inline]
            pub fn sample(self, stream: &mut Stream<'_>, arguments: &[f64]) -> Option<f64> {
                if !arguments.iter().all(|argument| argument.is_finite()) {
                    return None;
                }
                let value = match self {
                    $(Distribution::$variant => {
                        let &[$($parameter),+] = arguments else {
                            unreachable!("there are as many arguments as parameters")
                        };
                        self::$code(stream, $($parameter),+)?
                    })*
                };
                // The sum is the same number, but never the negative 0.
                (!value.is_nan()).then_some(value + 0.0)
            }
        }
    };
}

distributions! {
    /// Uniform in `[0, max)`; in `(max, 0]` if `max` is negative; 0 if it is 0.
    Uniform "random" uniform(max),
    /// The deviation is not negative.
    Normal "random_normal" | "normal" normal(mean, deviation),
    /// The rate is not negative, and at most 1.844e19.
    Poisson "random_poisson" poisson(rate),
    /// `low` is at most `high`.
    Arcsine "random_arcsine" arcsine(low, high),
    /// Both parameters are positive.
    Beta "random_beta" beta(alpha, beta),
    /// Both parameters are positive.
    Gamma "random_gamma" gamma(shape, scale),
    /// `mode` lies between `low` and `high`.
    Triangular "random_tri" triangular(low, mode, high),
    /// Both parameters are positive.
    Weibull "random_weibull" weibull(shape, scale),
    // Those of the delays and choices of runs, by names that no model can call.
    /// The rate is positive.
    Exponential "an exponential delay" exponential(rate),
    /// An integer less than `count`, each with the same probability; `count` is at least 1, and
    /// below 2^32.
    Below "a choice" below(count),
}

#[inline]
#[expect(clippy::unnecessary_wraps, reason = "the table wants it so")]
fn uniform(stream: &mut Stream<'_>, max: f64) -> Option<f64> {
    Some(max * stream.uniform())
}

#[inline]
fn exponential(stream: &mut Stream<'_>, rate: f64) -> Option<f64> {
    (rate > 0.0).then(|| stream.exponential(rate))
}

#[inline]
fn below(stream: &mut Stream<'_>, count: f64) -> Option<f64> {
    (1.0..=f64::from(u32::MAX))
        .contains(&count)
        .then(|| stream.below(count as u32).into())
}

fn normal(stream: &mut Stream<'_>, mean: f64, deviation: f64) -> Option<f64> {
    if deviation < 0.0 {
        return None;
    }
    Some(Normal::new(mean, deviation).ok()?.sample(stream))
}

fn poisson(stream: &mut Stream<'_>, rate: f64) -> Option<f64> {
    if rate == 0.0 {
        return Some(0.0);
    }
    Some(Poisson::new(rate).ok()?.sample(stream))
}

/// `rand_distr` does not have this one: the inverse of its distribution function is applied.
fn arcsine(stream: &mut Stream<'_>, low: f64, high: f64) -> Option<f64> {
    let range = high - low;
    if range < 0.0 || range.is_infinite() {
        return None;
    }
    let sine = (FRAC_PI_2 * stream.uniform()).sin();
    Some(low + range * sine * sine)
}

fn beta(stream: &mut Stream<'_>, alpha: f64, beta: f64) -> Option<f64> {
    Some(Beta::new(alpha, beta).ok()?.sample(stream))
}

fn gamma(stream: &mut Stream<'_>, shape: f64, scale: f64) -> Option<f64> {
    Some(Gamma::new(shape, scale).ok()?.sample(stream))
}

fn triangular(stream: &mut Stream<'_>, low: f64, mode: f64, high: f64) -> Option<f64> {
    if (high - low).is_infinite() {
        return None;
    }
    Some(Triangular::new(low, high, mode).ok()?.sample(stream))
}

fn weibull(stream: &mut Stream<'_>, shape: f64, scale: f64) -> Option<f64> {
    Some(Weibull::new(scale, shape).ok()?.sample(stream))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vectors that come with Random123.
    #[test]
    fn the_generator_gives_the_published_numbers() {
        let pi = [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344];
        let cases = [
            (
                [0; 4],
                [0; 2],
                [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8],
            ),
            (
                [u32::MAX; 4],
                [u32::MAX; 2],
                [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd],
            ),
            (
                pi,
                [0xa409_3822, 0x299f_31d0],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ];
        for (counter, key, expected) in cases {
            assert_eq!(philox([counter], key), [expected]);
        }
    }

    #[test]
    fn a_stream_gives_the_blocks_of_its_run_in_order() {
        let (seed, run) = (0x0123_4567_89ab_cdef, 0xfedc_ba98_7654_3210);
        let mut words = [7; STREAM_WORDS];
        let mut stream = Stream::start(&mut words, seed, run);
        let drawn: Vec<u32> = (0..40).map(|_| stream.next_u32()).collect();
        let blocks = (0..10).flat_map(|block| {
            let counter = [block, 0, 0x7654_3210, 0xfedc_ba98];
            philox([counter], [0x89ab_cdef, 0x0123_4567])[0]
        });
        assert!(blocks.eq(drawn));
    }

    /// A block number of more than 32 bits.
    #[test]
    fn a_stream_goes_on_behind_many_words() {
        let mut words = [0; STREAM_WORDS];
        let mut stream = Stream::start(&mut words, 3, 4);
        stream.set_number(POSITION, (1 << 34) - 1);
        stream.next_u32();
        assert_eq!(stream.next_u32(), philox([[0, 1, 4, 0]], [3, 0])[0][0]);
    }

    #[test]
    fn bytes_and_pairs_are_those_of_the_words() {
        let [mut first, mut second] = [[0; STREAM_WORDS]; 2];
        let mut bytes = [0; 14];
        Stream::of(&mut first).fill_bytes(&mut bytes);
        let mut stream = Stream::of(&mut second);
        assert_eq!(bytes[..8], stream.next_u64().to_le_bytes());
        assert_eq!(bytes[8..12], stream.next_u32().to_le_bytes());
        assert_eq!(bytes[12..], stream.next_u32().to_le_bytes()[..2]);
        assert_eq!(first, second);
    }

    #[test]
    fn every_name_is_found() {
        for &one in Distribution::ALL {
            assert_eq!(Distribution::named(one.name()), Some(one));
            assert!(one.failure().contains(one.name()));
            assert!((1..=MOST_PARAMETERS).contains(&one.arity()));
        }
        assert_eq!(Distribution::named("normal"), Some(Distribution::Normal));
        assert_eq!(Distribution::named("random_walk"), None);
    }
}

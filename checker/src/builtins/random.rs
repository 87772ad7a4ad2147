//! Random numbers of runs: the generator, and the table of the random functions of the language.
//!
//! The generator is Philox4x64-10: block number `n` of run `k` with seed `s` is a function of these
//! three numbers alone. So a run is the same whatever ran before it, and on whichever thread. All
//! that it has to remember lies in [`STREAM_WORDS`] words of the state, which are copied with it.
//! The generator `numpy.random.Philox` gives the same numbers, with key `(s, 0)` and counter
//! `(n, k, 0, 0)`; it takes the successor of the counter first.
//!
//! Invariant: unless the buffer must be filled, what was read beforehand of the next number is what
//! the buffer says of it. Interpreted and compiled code read different parts.
//!
//! The distributions are those of the crate `rand_distr`. A new random function is one row in the
//! table of [`Distribution`].
//!
//! Reference: Salmon, Moraes, Dror and Shaw, "Parallel Random Numbers: As Easy as 1, 2, 3" (2011).
//! Cost: some 2 ns for a number of 64 random bits.

use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

use rand_core::TryRng;
use rand_distr::{
    Beta, Distribution as _, Exp1, Gamma, Normal, Poisson, StandardUniform, Triangular, Uniform,
    Weibull,
};

/// The words that a stream of random numbers takes in the state.
pub const STREAM_WORDS: usize = BUFFER + 2 * BUFFERED;

/// The random functions have at most this number of parameters.
pub(crate) const MOST_PARAMETERS: usize = 3;

// Where the parts of a stream lie in its words. All are numbers of 64 bits, the low word first.
const SEED: usize = 0;
const RUN: usize = 2;
/// How many numbers were drawn.
pub(crate) const POSITION: usize = 4;
/// The number that is drawn next, unless the buffer must be filled before; it is one of those in
/// the buffer, read beforehand for code that waits for it.
pub(crate) const NEXT: usize = 6;
/// What a double needs of that number: its upper 53 bits as a whole number, which is a double.
pub(crate) const NEXT_WHOLE: usize = 8;
/// The numbers around the last one that was drawn, if they have further ones.
pub(crate) const BUFFER: usize = 10;
/// The numbers of a block.
const BLOCK: usize = 4;
/// So many blocks are made together: a processor can work on all of them at once.
const BLOCKS: usize = 2;
/// How many numbers of blocks there are; a power of 2.
pub(crate) const BUFFERED: usize = BLOCKS * BLOCK;

/// The bits of a number that are not used for a double.
pub(crate) const LOW_BITS: u32 = u64::BITS - f64::MANTISSA_DIGITS;

/// The random numbers of a run, over the words that hold their state. Words that are all 0 are the
/// start of run 0 with seed 0.
#[derive(Debug)]
pub struct Stream<'a>(&'a mut [i32; STREAM_WORDS]);

impl<'a> Stream<'a> {
    /// The stream that these [`STREAM_WORDS`] words hold.
    #[inline]
    pub fn of(words: &'a mut [i32]) -> Stream<'a> {
        let words = words.first_chunk_mut();
        Stream(words.expect("a state has all words of its stream"))
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

    /// An exponentially distributed number. The rate is greater than 0.
    #[inline]
    pub fn exponential(&mut self, rate: f64) -> f64 {
        let one: f64 = Exp1.sample(self);
        one * (1.0 / rate)
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

    /// Makes the numbers that come next, where none is left.
    pub(crate) fn fill(&mut self) {
        let first = self.number(POSITION) / BLOCK as u64;
        let (run, seed) = (self.number(RUN), self.number(SEED));
        let counters: [_; BLOCKS] =
            std::array::from_fn(|block| [first.wrapping_add(block as u64), run, 0, 0]);
        let random = philox(counters, [seed, 0]);
        for (place, &number) in random.as_flattened().iter().enumerate() {
            self.set_number(BUFFER + 2 * place, number);
        }
        self.read_next(0);
    }

    /// Reads the number that is drawn next from its place in the buffer.
    #[inline]
    fn read_next(&mut self, place: usize) {
        let next = self.number(BUFFER + 2 * place);
        self.set_number(NEXT, next);
        let whole = (next >> LOW_BITS) as f64;
        self.set_number(NEXT_WHOLE, whole.to_bits());
    }

    #[inline]
    fn next_number(&mut self) -> u64 {
        let position = self.number(POSITION);
        if position.is_multiple_of(BUFFERED as u64) {
            self.fill();
        }
        let number = self.number(NEXT);
        let after = position.wrapping_add(1);
        self.set_number(POSITION, after);
        self.read_next((after % BUFFERED as u64) as usize);
        number
    }
}

impl TryRng for Stream<'_> {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok((self.next_number() >> 32) as u32)
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.next_number())
    }

    fn try_fill_bytes(&mut self, target: &mut [u8]) -> Result<(), Infallible> {
        for bytes in target.chunks_mut(size_of::<u64>()) {
            bytes.copy_from_slice(&self.next_number().to_le_bytes()[..bytes.len()]);
        }
        Ok(())
    }
}

/// The layers of the ziggurat by which exponential numbers are drawn; a power of 2.
pub(crate) const LAYERS: usize = 256;

/// Where the layers of the ziggurat end that [`Exp1`] draws from, the widest first; behind them the
/// end of none, 0. A number below the next end is drawn with one multiplication (J. A. Doornik, "An
/// improved ziggurat method to generate normal random samples", 2005).
///
/// The distribution does not tell them, but a stream can ask: the smallest number that it draws
/// from a layer is its end, but for a power of 2.
pub(crate) fn exponential_edges() -> &'static [f64; LAYERS + 1] {
    static EDGES: LazyLock<[f64; LAYERS + 1]> = LazyLock::new(|| {
        std::array::from_fn(|layer| {
            if layer == LAYERS {
                return 0.0;
            }
            let mut words = [0; STREAM_WORDS];
            let mut stream = Stream::of(&mut words);
            // The number that chooses the layer; then one that accepts it, should it be asked for.
            stream.set_number(POSITION, 1);
            stream.set_number(NEXT, layer as u64);
            stream.set_number(BUFFER + 4, u64::MAX);
            let least: f64 = Exp1.sample(&mut stream);
            least * (1_u64 << 53) as f64
        })
    });
    &EDGES
}

const ROUNDS: usize = 10;
const MULTIPLIERS: [u64; 2] = [0xd2e7_470e_e14c_6c93, 0xca5a_8263_9512_1157];
/// What is added to the key from round to round.
const WEYL: [u64; 2] = [0x9e37_79b9_7f4a_7c15, 0xbb67_ae85_84ca_a73b];

/// Philox4x64-10 of several counters.
#[inline]
fn philox<const N: usize>(mut counters: [[u64; 4]; N], key: [u64; 2]) -> [[u64; 4]; N] {
    let [mut left, mut right] = key;
    for _ in 0..ROUNDS {
        for counter in &mut counters {
            let [a, b, c, d] = *counter;
            let first = u128::from(MULTIPLIERS[0]) * u128::from(a);
            let second = u128::from(MULTIPLIERS[1]) * u128::from(c);
            *counter = [
                (second >> 64) as u64 ^ b ^ left,
                second as u64,
                (first >> 64) as u64 ^ d ^ right,
                first as u64,
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
    use rand_core::Rng;

    use super::*;

    /// The vectors that come with Random123; `numpy` gives them too.
    #[test]
    fn the_generator_gives_the_published_numbers() {
        let pi = [
            0x243f_6a88_85a3_08d3,
            0x1319_8a2e_0370_7344,
            0xa409_3822_299f_31d0,
            0x082e_fa98_ec4e_6c89,
        ];
        let cases = [
            (
                [0; 4],
                [0; 2],
                [
                    0x1655_4d9e_ca36_314c,
                    0xdb20_fe9d_672d_0fdc,
                    0xd7e7_72ce_e186_176b,
                    0x7e68_b68a_ec7b_a23b,
                ],
            ),
            (
                [u64::MAX; 4],
                [u64::MAX; 2],
                [
                    0x87b0_92c3_013f_e90b,
                    0x438c_3c67_be8d_0224,
                    0x9cc7_d7c6_9cd7_77b6,
                    0xa09c_aebf_594f_0ba0,
                ],
            ),
            (
                pi,
                [0x4528_21e6_38d0_1377, 0xbe54_66cf_34e9_0c6c],
                [
                    0xa528_f454_03e6_1d95,
                    0x38c7_2dbd_566e_9788,
                    0xa5a1_610e_72fd_18b5,
                    0x57bd_43b5_e52b_7fe6,
                ],
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
        let drawn: Vec<u64> = (0..40).map(|_| stream.next_u64()).collect();
        let blocks = (0..10).flat_map(|block| philox([[block, run, 0, 0]], [seed, 0])[0]);
        assert!(blocks.eq(drawn));
    }

    /// A block number of more than 32 bits.
    #[test]
    fn a_stream_goes_on_behind_many_numbers() {
        let mut words = [0; STREAM_WORDS];
        let mut stream = Stream::start(&mut words, 3, 4);
        stream.set_number(POSITION, (1 << 40) - 1);
        stream.next_u64();
        let expected = philox([[1 << 38, 4, 0, 0]], [3, 0]);
        assert_eq!(stream.next_u64(), expected[0][0]);
    }

    #[test]
    fn bytes_and_words_are_parts_of_the_numbers() {
        let [mut first, mut second, mut third] = [[0; STREAM_WORDS]; 3];
        let mut bytes = [0; 14];
        Stream::of(&mut first).fill_bytes(&mut bytes);
        let mut stream = Stream::of(&mut second);
        let numbers = [stream.next_u64(), stream.next_u64()];
        assert_eq!(bytes[..8], numbers[0].to_le_bytes());
        assert_eq!(bytes[8..], numbers[1].to_le_bytes()[..6]);
        let mut stream = Stream::of(&mut third);
        for number in numbers {
            assert_eq!(u64::from(stream.next_u32()), number >> 32);
        }
        assert_eq!(first, second);
        assert_eq!(first, third);
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

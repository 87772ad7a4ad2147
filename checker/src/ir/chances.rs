//! What a network has in the stochastic reading only: clocks as words, rates, weights.
//!
//! There a clock is four words of the state: its value and its rate, both doubles. A guard or an
//! invariant returns a *mask*: bit 0 says whether it holds after the time that the word `ahead`
//! holds, if nothing happens until then; bit 1 whether it holds in the open interval behind that
//! moment. If it is timed, it leaves at `result` for how long bit 1 stays as it is, at least.
//!
//! A condition may be *curved*: not linear in time even where all its clocks are. Then, and where
//! the rates of its clocks change as time passes, only bit 0 is of use, with `ahead` at 0; and
//! a timed condition leaves at `signature` a number that stays the same as long as no comparison in
//! it changes its side.

use super::ids::FunctionId;

/// Where the words lie that all functions share, and which words are clocks.
#[derive(Clone, Debug, Default)]
pub struct Chances {
    /// The words of the random numbers: `STREAM_WORDS` of them.
    pub stream: u32,
    /// The double that functions leave.
    pub result: u32,
    /// The double that says how far ahead conditions are asked.
    pub ahead: u32,
    /// The double that tells which sides of its comparisons are greater, as a condition leaves it.
    pub signature: u32,
    /// The first word of each clock, in order.
    pub clocks: Vec<u32>,
}

/// What a location says of chances.
#[derive(Clone, Debug, Default)]
pub struct LocationChances {
    /// Leaves the rate of the exponential delay as a double.
    pub exponential_rate: Option<FunctionId>,
    /// Sets the rates of `rated_clocks`.
    pub rates: Option<FunctionId>,
    /// The first words of the clocks whose rates it sets; all other clocks run at rate 1.
    pub rated_clocks: Vec<u32>,
    /// Of each of them, whether its rate may change as time passes.
    pub flows: Vec<bool>,
}

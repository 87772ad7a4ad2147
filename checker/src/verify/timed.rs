//! States together with the resolution of their clock values, so that every fraction of a unit can
//! be waited.

use super::moves::State;

/// The finest resolution: constants of clocks stay far from the ends of the integers in it.
pub const MOST_TICKS_PER_UNIT: i64 = 1 << 30;

/// A state with its own resolution of time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Timed {
    /// The state, clock values in ticks.
    pub state: State,
    /// How many ticks make one unit of time.
    pub ticks_per_unit: i64,
}

impl Timed {
    /// The same at the coarsest resolution that is a multiple of this one; `None` if there is none
    /// below the finest.
    #[must_use]
    pub fn at_multiple_of(&self, ticks_per_unit: i64) -> Option<Timed> {
        let clocks = self.state.clocks.iter();
        let common = clocks.fold(self.ticks_per_unit, |common, &clock| {
            greatest_divisor(common, clock)
        });
        let needed = self.ticks_per_unit / common;
        let wanted = least_multiple(needed, ticks_per_unit)?;
        let factor = wanted / needed;
        let clocks = self.state.clocks.iter().map(|clock| {
            let coarse = clock / common;
            coarse.checked_mul(factor)
        });
        Some(Timed {
            state: State {
                words: self.state.words.clone(),
                clocks: clocks.collect::<Option<Vec<i64>>>()?,
            },
            ticks_per_unit: wanted,
        })
    }
}

/// The greatest common divisor of a positive number and another one.
pub fn greatest_divisor(one: i64, other: i64) -> i64 {
    let (mut one, mut other) = (one, other.abs());
    while other != 0 {
        (one, other) = (other, one % other);
    }
    one
}

/// The least common multiple of two positive numbers, unless it is finer than any resolution.
pub fn least_multiple(one: i64, other: i64) -> Option<i64> {
    let multiple = (one / greatest_divisor(one, other)).checked_mul(other)?;
    (multiple <= MOST_TICKS_PER_UNIT).then_some(multiple)
}

//! A set of clocks in a fixed number of machine words, so that operations on zones need no allocation.

/// A set of clock indices below [`ClockSet::CAPACITY`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ClockSet {
    words: [u64; ClockSet::WORDS],
}

impl ClockSet {
    const WORDS: usize = 4;
    /// The greatest dimension of a zone, the reference clock included; a model with more clocks is to be refused.
    pub const CAPACITY: usize = 64 * ClockSet::WORDS;
    /// The set without clocks.
    pub const EMPTY: ClockSet = ClockSet {
        words: [0; ClockSet::WORDS],
    };

    /// The clocks `1..dimension`, without the reference clock.
    pub fn all(dimension: usize) -> ClockSet {
        (1..dimension).collect()
    }

    /// Adds a clock.
    ///
    /// # Panics
    /// If the index is not below [`ClockSet::CAPACITY`].
    pub fn insert(&mut self, clock: usize) {
        self.words[clock / 64] |= 1 << (clock % 64);
    }

    /// Takes a clock out.
    ///
    /// # Panics
    /// If the index is not below [`ClockSet::CAPACITY`].
    pub fn remove(&mut self, clock: usize) {
        self.words[clock / 64] &= !(1 << (clock % 64));
    }

    /// Whether the clock is in the set; an index beyond the capacity is not.
    pub fn contains(&self, clock: usize) -> bool {
        self.words
            .get(clock / 64)
            .is_some_and(|word| word >> (clock % 64) & 1 == 1)
    }

    /// Whether the set has no clocks.
    pub fn is_empty(&self) -> bool {
        self.words == [0; ClockSet::WORDS]
    }

    /// The number of clocks.
    pub fn len(&self) -> usize {
        self.words
            .iter()
            .map(|word| word.count_ones() as usize)
            .sum()
    }

    /// The clocks that are in both sets.
    #[must_use]
    pub fn intersection(&self, other: &ClockSet) -> ClockSet {
        ClockSet {
            words: std::array::from_fn(|word| self.words[word] & other.words[word]),
        }
    }

    /// The clocks that are in one of the sets.
    #[must_use]
    pub fn union(&self, other: &ClockSet) -> ClockSet {
        ClockSet {
            words: std::array::from_fn(|word| self.words[word] | other.words[word]),
        }
    }

    /// The clocks in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + use<> {
        let words = self.words;
        (0..ClockSet::WORDS)
            .flat_map(move |index| Ones(words[index]).map(move |bit| 64 * index + bit))
    }
}

impl FromIterator<usize> for ClockSet {
    fn from_iter<I: IntoIterator<Item = usize>>(clocks: I) -> ClockSet {
        let mut set = ClockSet::EMPTY;
        for clock in clocks {
            set.insert(clock);
        }
        set
    }
}

/// The positions of the ones in a word, ascending.
struct Ones(u64);

impl Iterator for Ones {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let bit = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (bit < 64).then_some(bit)
    }
}

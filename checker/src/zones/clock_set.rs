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
    #[inline]
    pub fn iter(&self) -> Clocks {
        Clocks {
            words: self.words,
            index: 0,
        }
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

impl IntoIterator for &ClockSet {
    type Item = usize;
    type IntoIter = Clocks;

    #[inline]
    fn into_iter(self) -> Clocks {
        self.iter()
    }
}

/// The clocks of a set in ascending order.
#[derive(Clone, Debug)]
pub struct Clocks {
    /// What is left of each word; the words before `index` are used up.
    words: [u64; ClockSet::WORDS],
    index: usize,
}

impl Iterator for Clocks {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        loop {
            let word = self.words.get_mut(self.index)?;
            if *word != 0 {
                let bit = word.trailing_zeros() as usize;
                *word &= *word - 1;
                return Some(64 * self.index + bit);
            }
            self.index += 1;
        }
    }
}

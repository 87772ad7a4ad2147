//! A set of clocks as a bit set. The first 256 clocks are stored in the set itself, so operations
//! on zones of few clocks need no allocation. The other clocks are stored in a list.

/// How many machine words the set itself stores.
const INLINE_WORDS: usize = 4;

/// A set of clock indices.
///
/// Invariant: the last word beyond the inline ones is not 0, so that equal sets have equal fields.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct ClockSet {
    words: [u64; INLINE_WORDS],
    more: Vec<u64>,
}

impl ClockSet {
    /// The set without clocks.
    pub const EMPTY: ClockSet = ClockSet {
        words: [0; INLINE_WORDS],
        more: Vec::new(),
    };

    /// The clocks `1..dimension`, without the reference clock.
    pub fn all(dimension: usize) -> ClockSet {
        (1..dimension).collect()
    }

    /// Adds a clock.
    pub fn insert(&mut self, clock: usize) {
        let index = clock / 64;
        let word = if let Some(word) = self.words.get_mut(index) {
            word
        } else {
            let index = index - INLINE_WORDS;
            if self.more.len() <= index {
                self.more.resize(index + 1, 0);
            }
            &mut self.more[index]
        };
        *word |= 1 << (clock % 64);
    }

    /// Removes a clock.
    pub fn remove(&mut self, clock: usize) {
        let mut words = self.words.iter_mut().chain(&mut self.more);
        if let Some(word) = words.nth(clock / 64) {
            *word &= !(1 << (clock % 64));
        }
        self.trim();
    }

    /// Whether the clock is in the set.
    pub fn contains(&self, clock: usize) -> bool {
        self.word(clock / 64) >> (clock % 64) & 1 == 1
    }

    /// Whether the set has no clocks.
    pub fn is_empty(&self) -> bool {
        self.words == [0; INLINE_WORDS] && self.more.is_empty()
    }

    /// The number of clocks.
    pub fn len(&self) -> usize {
        let words = self.words.iter().chain(&self.more);
        words.map(|word| word.count_ones() as usize).sum()
    }

    /// The clocks that are in both sets.
    #[must_use]
    pub fn intersection(&self, other: &ClockSet) -> ClockSet {
        let more = self.more.iter().zip(&other.more).map(|(a, b)| a & b);
        let mut both = ClockSet {
            words: std::array::from_fn(|word| self.words[word] & other.words[word]),
            more: more.collect(),
        };
        both.trim();
        both
    }

    /// The clocks that are in one of the sets.
    #[must_use]
    pub fn union(&self, other: &ClockSet) -> ClockSet {
        let length = self.more.len().max(other.more.len());
        let more = (INLINE_WORDS..INLINE_WORDS + length).map(|at| self.word(at) | other.word(at));
        ClockSet {
            words: std::array::from_fn(|word| self.words[word] | other.words[word]),
            more: more.collect(),
        }
    }

    /// The clocks in ascending order.
    #[inline]
    pub fn iter(&self) -> Clocks<'_> {
        Clocks {
            words: self.words,
            more: &self.more,
            index: 0,
        }
    }

    /// The word with this index; 0 beyond the last.
    #[inline]
    fn word(&self, index: usize) -> u64 {
        match self.words.get(index) {
            Some(word) => *word,
            None => self.more.get(index - INLINE_WORDS).copied().unwrap_or(0),
        }
    }

    fn trim(&mut self) {
        while self.more.last() == Some(&0) {
            self.more.pop();
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

impl<'s> IntoIterator for &'s ClockSet {
    type Item = usize;
    type IntoIter = Clocks<'s>;

    #[inline]
    fn into_iter(self) -> Clocks<'s> {
        self.iter()
    }
}

/// The clocks of a set in ascending order.
#[derive(Clone, Debug)]
pub struct Clocks<'s> {
    /// The remaining bits of the current four words. The words before `index` are used up; words of
    /// `more` take their places.
    words: [u64; INLINE_WORDS],
    more: &'s [u64],
    index: usize,
}

impl Iterator for Clocks<'_> {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        loop {
            if let Some(word) = self.words.get_mut(self.index % INLINE_WORDS)
                && *word != 0
            {
                let bit = word.trailing_zeros() as usize;
                *word &= *word - 1;
                return Some(64 * self.index + bit);
            }
            self.index += 1;
            if self.index >= INLINE_WORDS {
                // A later word takes the place of the one that is used up.
                let next = *self.more.get(self.index - INLINE_WORDS)?;
                self.words[self.index % INLINE_WORDS] = next;
            }
        }
    }
}

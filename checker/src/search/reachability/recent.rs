//! The committed states that were explored last, so that a state with several paths to it is
//! explored once.
//!
//! Committed states are not stored; this is a cache of bounded size.
//!
//! Invariants:
//! * What is found in it was entered before, with equal words and equal bounds. What is not found
//!   may have been entered before too.
//! * It takes at most [`MOST_BYTES`], however large states are: with thousands of clocks it has few
//!   places, or none.
//!
//! Cost: one hash and one comparison for each state.

use crate::zones::{Bound, dbm};

use crate::search::store::hashing::{hash_bytes, spread};

/// The least and the greatest number of places.
const FEWEST_PLACES: usize = 1 << 8;
const MOST_PLACES: usize = 1 << 14;

/// The most bytes of all places.
const MOST_BYTES: usize = 8 << 20;

/// States that were explored lately.
#[derive(Debug)]
pub(super) struct RecentStates {
    /// The bytes of the words of each place.
    words: Vec<u8>,
    /// The zone of each place; one that is marked as empty where there is no state.
    zones: Vec<Bound>,
    places: usize,
}

impl RecentStates {
    /// An empty cache, which takes no memory until a state is entered.
    pub(super) fn new() -> RecentStates {
        RecentStates {
            words: Vec::new(),
            zones: Vec::new(),
            places: 0,
        }
    }

    /// The bytes that the cache takes.
    pub(super) fn bytes(&self) -> usize {
        self.words.len() + self.zones.len() * size_of::<Bound>()
    }

    /// Enters a state, packed words and a zone; returns whether it was there already. The cache
    /// grows with the number of stored states, and forgets everything when it does.
    pub(super) fn enter(&mut self, words: &[u8], zone: &[Bound], stored: usize) -> bool {
        let place_bytes = words.len() + size_of_val(zone);
        let Some(most) = (MOST_BYTES / place_bytes).min(MOST_PLACES).checked_ilog2() else {
            return false;
        };
        let most = 1 << most;
        if self.places < most && 2 * self.places < stored.max(FEWEST_PLACES) {
            self.places = (2 * self.places).max(FEWEST_PLACES).min(most);
            // The old places are freed before new ones are allocated.
            (self.words, self.zones) = (Vec::new(), Vec::new());
            self.words = vec![0; self.places * words.len()];
            self.zones = vec![Bound::LT_ZERO; self.places * zone.len()];
        }
        let hash = spread(hash_bytes(words)) ^ dbm::hash(zone);
        let place = (hash >> 40) as usize & (self.places - 1);
        let known_words = &mut self.words[place * words.len()..][..words.len()];
        let known_zone = &mut self.zones[place * zone.len()..][..zone.len()];
        if known_words == words && dbm::is_equal(known_zone, zone) {
            return true;
        }
        known_words.copy_from_slice(words);
        known_zone.copy_from_slice(zone);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zones::Zone;

    fn enter_twice(dimension: usize, states: u8) -> (RecentStates, usize) {
        let mut recent = RecentStates::new();
        let zone = Zone::zero(dimension);
        let mut known = 0;
        for round in 0..2 {
            for state in 0..states {
                let is_known = recent.enter(&[state, 1], zone.bounds(), 0);
                assert!(round > 0 || !is_known, "state {state} is new");
                known += usize::from(is_known);
                assert!(recent.bytes() <= MOST_BYTES);
            }
        }
        (recent, known)
    }

    #[test]
    fn states_with_few_clocks_are_remembered() {
        let (recent, known) = enter_twice(4, 20);
        assert_eq!(recent.places, FEWEST_PLACES);
        assert!(known > 10, "{known} of 20 are found again");
    }

    #[test]
    fn states_with_many_clocks_take_bounded_memory() {
        let (recent, known) = enter_twice(500, 2);
        assert!(recent.places < FEWEST_PLACES);
        assert!(known > 0, "{known} of 2 are found again");
        let (recent, known) = enter_twice(2000, 2);
        assert_eq!((recent.bytes(), known), (0, 0));
    }
}

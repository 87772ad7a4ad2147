//! The committed states that were explored last, so that a state to which several ways lead is explored once.
//!
//! Committed states are not stored; this is a cache of bounded size. Invariant: what is found in it was entered before,
//! word by word and bound by bound. What is not found may have been entered before as well.
//!
//! Cost: one hash and one comparison for each state.

use crate::zones::{Bound, dbm};

use super::store::{hash_bytes, spread};

/// The least and the greatest number of places.
const FEWEST_PLACES: usize = 1 << 8;
const MOST_PLACES: usize = 1 << 14;

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

    /// Enters a state, packed words and a zone; returns whether it was there already. With the number of stored states the
    /// cache grows, and forgets everything then.
    pub(super) fn enter(&mut self, words: &[u8], zone: &[Bound], stored: usize) -> bool {
        if self.places < MOST_PLACES && 2 * self.places < stored.max(FEWEST_PLACES) {
            self.places = (2 * self.places).max(FEWEST_PLACES);
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

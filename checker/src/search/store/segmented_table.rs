//! A hash table that grows piece by piece, so that the old and the new copy of the whole table
//! never exist together.
//!
//! The hash of an entry decides its piece, and each piece is a table that grows alone. So a search
//! takes hardly more memory while a table grows than afterwards. The memory limit needs this.
//!
//! Invariant: `bytes` is what the pieces have allocated.
//!
//! Cost: a look-up is that in a table, and one more load that is nearly always in the cache.

use hashbrown::HashTable;
use hashbrown::hash_table::OccupiedEntry;

/// How many pieces there are.
const PIECES: usize = 16;

/// Where a hash has the bits that decide the piece: between the bits that the tables use.
const PIECE_SHIFT: u32 = 48;

/// Entries by their hashes.
#[derive(Debug)]
pub(super) struct PiecedTable<T> {
    pieces: [HashTable<T>; PIECES],
    bytes: usize,
}

impl<T> PiecedTable<T> {
    /// An empty table, which takes no memory.
    pub(super) fn new() -> PiecedTable<T> {
        PiecedTable {
            pieces: std::array::from_fn(|_| HashTable::new()),
            bytes: 0,
        }
    }

    /// The entry with this hash that is the one looked for.
    #[inline]
    pub(super) fn find(&self, hash: u64, is_it: impl FnMut(&T) -> bool) -> Option<&T> {
        self.pieces[piece(hash)].find(hash, is_it)
    }

    /// The same, to be removed.
    pub(super) fn find_entry(
        &mut self,
        hash: u64,
        is_it: impl FnMut(&T) -> bool,
    ) -> Option<OccupiedEntry<'_, T>> {
        self.pieces[piece(hash)].find_entry(hash, is_it).ok()
    }

    /// Enters what is not there yet.
    #[inline]
    pub(super) fn insert_unique(&mut self, hash: u64, value: T, hash_of: impl Fn(&T) -> u64) {
        let piece = &mut self.pieces[piece(hash)];
        if piece.len() < piece.capacity() {
            piece.insert_unique(hash, value, hash_of);
            return;
        }
        self.bytes -= piece.allocation_size();
        piece.insert_unique(hash, value, hash_of);
        self.bytes += piece.allocation_size();
    }

    /// Removes all entries.
    pub(super) fn drain(&mut self) -> impl Iterator<Item = T> {
        self.pieces.iter_mut().flat_map(HashTable::drain)
    }

    /// How many entries there are.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.pieces.iter().map(HashTable::len).sum()
    }

    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }
}

fn piece(hash: u64) -> usize {
    (hash >> PIECE_SHIFT) as usize % PIECES
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash_of(value: u64) -> u64 {
        value.wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }

    #[test]
    fn entries_are_found_until_they_are_removed_and_bytes_are_counted() {
        let mut table = PiecedTable::new();
        for value in 0..5000_u64 {
            table.insert_unique(hash_of(value), value, |&one| hash_of(one));
            if value % 3 == 0 {
                let entry = table.find_entry(hash_of(value), |&one| one == value);
                entry.expect("it was entered").remove();
            }
        }
        for value in 0..6000_u64 {
            let found = table.find(hash_of(value), |&one| one == value);
            let is_there = value < 5000 && value % 3 != 0;
            assert_eq!(found.copied(), is_there.then_some(value));
        }
        let allocated: usize = table.pieces.iter().map(HashTable::allocation_size).sum();
        assert_eq!(table.bytes(), allocated);
        assert_eq!(table.drain().count(), 3333);
    }
}

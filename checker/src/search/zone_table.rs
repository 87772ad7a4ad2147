//! Zones, each stored once: states share them.
//!
//! Invariant: two zones get the same [`ZoneId`] exactly if their closed matrices are equal, that is, if they are the same set.

use hashbrown::HashTable;

use crate::zones::{Bound, dbm};

/// The index of a stored zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ZoneId(pub u32);

/// Stored zones of one dimension.
#[derive(Debug)]
pub struct ZoneTable {
    size: usize,
    bounds: Vec<Bound>,
    table: HashTable<u32>,
    count: u32,
}

impl ZoneTable {
    /// An empty table of zones of this dimension.
    pub fn new(dimension: usize) -> ZoneTable {
        ZoneTable {
            size: dimension * dimension,
            bounds: Vec::new(),
            table: HashTable::new(),
            count: 0,
        }
    }

    /// The zone with this id.
    pub fn get(&self, id: ZoneId) -> &[Bound] {
        &self.bounds[id.0 as usize * self.size..][..self.size]
    }

    /// The id of a zone.
    pub fn intern(&mut self, zone: &[Bound]) -> ZoneId {
        let (bounds, size) = (&self.bounds, self.size);
        let of = |id: u32| &bounds[id as usize * size..][..size];
        let hash = dbm::hash(zone);
        if let Some(&id) = self.table.find(hash, |&id| of(id) == zone) {
            return ZoneId(id);
        }
        let id = self.count;
        self.count += 1;
        self.table.insert_unique(hash, id, |&id| dbm::hash(of(id)));
        self.bounds.extend_from_slice(zone);
        ZoneId(id)
    }

    /// The bytes that the table takes.
    pub fn bytes(&self) -> usize {
        self.bounds.capacity() * size_of::<Bound>() + self.table.capacity() * 5 * 8 / 7
    }
}

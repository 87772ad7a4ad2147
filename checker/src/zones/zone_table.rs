//! A table that stores each zone once, so that states share it.
//!
//! Invariant: two zones get the same [`ZoneId`] exactly if their closed matrices are equal, that
//! is, if they are the same set.

use hashbrown::HashTable;

use super::{Bound, dbm};
use crate::cancellation;

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
    /// The greatest number of bounds that were stored before zones were forgotten.
    most_bounds: usize,
}

impl ZoneTable {
    /// An empty table of zones of this dimension.
    pub fn new(dimension: usize) -> ZoneTable {
        ZoneTable::of_size(dimension * dimension)
    }

    /// An empty table for zones with data of their own: each entry takes `size` bounds in all.
    pub fn of_size(size: usize) -> ZoneTable {
        ZoneTable {
            size,
            bounds: Vec::new(),
            table: HashTable::new(),
            count: 0,
            most_bounds: 0,
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
        if let Some(&id) = self.table.find(hash, |&id| dbm::is_equal(of(id), zone)) {
            return ZoneId(id);
        }
        let id = cancellation::number(self.count as usize);
        self.count += 1;
        self.table.insert_unique(hash, id, |&id| dbm::hash(of(id)));
        self.bounds.extend_from_slice(zone);
        ZoneId(id)
    }

    /// How many zones there are.
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Forgets all zones and keeps the memory.
    pub fn clear(&mut self) {
        self.most_bounds = self.most_bounds.max(self.bounds.len());
        self.bounds.clear();
        self.table.clear();
        self.count = 0;
    }

    /// The bytes that the table takes. Reserved room takes none until it is written to.
    pub fn bytes(&self) -> usize {
        let bounds = self.bounds.len().max(self.most_bounds);
        bounds * size_of::<Bound>() + self.table.allocation_size()
    }
}

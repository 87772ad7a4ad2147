//! Records of one length, of bytes or of numbers, side by side in blocks that are never moved. Full
//! blocks can be put on disk; one that is written to comes back.

use std::io;

use bytemuck::Pod;

use super::disk::{Cold, Disk, Extent};
use crate::cancellation;

/// Bytes in one block, at least; a block holds a power of two of records.
const BLOCK_BYTES: usize = 1 << 16;

/// When blocks are put on disk, one in so many, the newest ones, stay in memory.
const STAYS: usize = 4;

/// Records of one length, by number from 0, in blocks that are never moved.
#[derive(Debug)]
pub(in crate::search) struct Records<T> {
    /// How many parts a record has.
    size: usize,
    /// Records in a block, as a power of two.
    block_bits: u32,
    blocks: Vec<Block<T>>,
    count: u32,
    /// How many blocks are on disk.
    on_disk: usize,
    /// How many blocks, the first ones, were given back.
    released: usize,
}

#[derive(Debug)]
enum Block<T> {
    Memory(Vec<T>),
    Disk(Extent),
}

impl<T: Pod> Block<T> {
    #[inline]
    fn parts(&self) -> &[T] {
        match self {
            Block::Memory(parts) => parts,
            Block::Disk(extent) => bytemuck::cast_slice(extent.bytes()),
        }
    }
}

impl<T: Pod> Records<T> {
    /// No records, of so many parts, at least one.
    pub(in crate::search) fn new(size: usize) -> Records<T> {
        Records {
            size,
            block_bits: (BLOCK_BYTES / size_of::<T>() / size).max(1).ilog2(),
            blocks: Vec::new(),
            count: 0,
            on_disk: 0,
            released: 0,
        }
    }

    /// How many parts a record has.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// The first part of a record; 0 if there is no such record.
    #[inline]
    pub(in crate::search) fn first(&self, id: u32) -> T {
        let (block, first) = self.place(id);
        let part = self.blocks.get(block);
        let part = part.and_then(|block| block.parts().get(first));
        part.copied().unwrap_or(T::zeroed())
    }

    #[inline]
    pub(in crate::search) fn get(&self, id: u32) -> &[T] {
        let (block, first) = self.place(id);
        &self.blocks[block].parts()[first..first + self.size]
    }

    pub(in crate::search) fn get_mut(&mut self, id: u32) -> &mut [T] {
        let (block, first) = self.place(id);
        let range = first..first + self.size;
        &mut self.in_memory(block)[range]
    }

    /// The parts of a block, which comes back from disk if it is there.
    fn in_memory(&mut self, block: usize) -> &mut Vec<T> {
        let block = &mut self.blocks[block];
        if let Block::Disk(_) = block {
            self.on_disk -= 1;
            *block = Block::Memory(block.parts().to_vec());
        }
        match block {
            Block::Memory(parts) => parts,
            Block::Disk(_) => unreachable!("it came back"),
        }
    }

    /// The block of a record, and where it begins there.
    #[inline]
    fn place(&self, id: u32) -> (usize, usize) {
        let within = id as usize & ((1 << self.block_bits) - 1);
        (id as usize >> self.block_bits, within * self.size)
    }

    pub(in crate::search) fn push(&mut self, record: &[T]) -> u32 {
        let id = cancellation::number(self.count as usize);
        self.count += 1;
        let block = id as usize >> self.block_bits;
        if block == self.blocks.len() {
            let parts = Vec::with_capacity(self.size << self.block_bits);
            self.blocks.push(Block::Memory(parts));
        }
        self.in_memory(block).extend_from_slice(record);
        id
    }

    /// Removes the last record.
    pub(super) fn pop(&mut self) {
        self.count -= 1;
        let (block, first) = self.place(self.count);
        self.in_memory(block).truncate(first);
        // The block itself is kept: a record is likely to come.
        self.blocks.truncate(block + 1);
    }

    /// Gives back the blocks that have only records before this one; these are not there any more.
    pub(super) fn release_before(&mut self, id: u32) {
        let end = id as usize >> self.block_bits;
        for block in &mut self.blocks[self.released..end] {
            if let Block::Disk(_) = std::mem::replace(block, Block::Memory(Vec::new())) {
                self.on_disk -= 1;
            }
        }
        self.released = end;
    }

    /// Removes all records.
    pub(super) fn clear(&mut self) {
        *self = Records::new(self.size);
    }

    /// How many there are.
    pub(in crate::search) fn len(&self) -> usize {
        self.count as usize
    }

    /// The bytes that they take in memory.
    pub(in crate::search) fn bytes(&self) -> usize {
        self.blocks_in_memory() * self.block_bytes()
    }

    fn blocks_in_memory(&self) -> usize {
        self.blocks.len() - self.on_disk - self.released
    }

    /// The parts for which there is room in memory.
    #[cfg(test)]
    pub(super) fn room(&self) -> usize {
        let room = self.blocks.iter().map(|block| match block {
            Block::Memory(parts) => parts.capacity(),
            Block::Disk(_) => 0,
        });
        room.sum()
    }

    fn block_bytes(&self) -> usize {
        (self.size << self.block_bits) * size_of::<T>()
    }

    /// As [`Records::get`], where records are read one after the other: those that are on disk do
    /// not stay in memory.
    pub(super) fn get_in_order(&self, id: u32) -> &[T] {
        let (block, first) = self.place(id);
        if first == 0
            && let Some(Block::Disk(extent)) = self.blocks[..block].last()
        {
            extent.let_go();
        }
        self.get(id)
    }

    /// The blocks that may be put on disk: full ones in memory, but the newest.
    fn cold(&self) -> impl Iterator<Item = usize> {
        let full = self.count as usize >> self.block_bits;
        let in_memory = |&block: &usize| matches!(self.blocks[block], Block::Memory(_));
        let stay = self.blocks_in_memory().div_ceil(STAYS);
        (self.released..full.saturating_sub(stay)).filter(in_memory)
    }
}

impl<T: Pod> Cold for Records<T> {
    fn cold_bytes(&self) -> usize {
        self.cold().count() * self.block_bytes()
    }

    fn spill(&mut self, disk: &Disk) -> io::Result<()> {
        let cold: Vec<usize> = self.cold().collect();
        if cold.is_empty() {
            return Ok(());
        }
        let parts = cold.iter().map(|&block| self.blocks[block].parts());
        let parts: Vec<&[u8]> = parts.map(bytemuck::cast_slice).collect();
        let extents = disk.write(&parts)?;
        self.on_disk += cold.len();
        for (block, extent) in cold.into_iter().zip(extents) {
            self.blocks[block] = Block::Disk(extent);
        }
        Ok(())
    }
}

impl Records<u8> {
    /// Doubles the bytes of entries, block by block, so that the old and the new blocks never exist
    /// together. All are in memory then.
    pub(super) fn widen(&mut self, widened: impl Fn(&[u8], &mut Vec<u8>)) {
        cancellation::ask_for(self.blocks.len() * self.block_bytes());
        self.size *= 2;
        for block in &mut self.blocks {
            let mut wide = Vec::with_capacity(self.size << self.block_bits);
            widened(block.parts(), &mut wide);
            *block = Block::Memory(wide);
        }
        self.on_disk = 0;
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::disk::test_place;
    use super::*;

    #[test]
    fn records_on_disk_are_as_they_were_and_come_back_to_be_changed() {
        let place = test_place("records");
        let disk = Disk::new(&place, Some(1 << 20)).expect("there is room");
        let mut records = Records::<u32>::new(3);
        let record = |id: u32| [id, id / 7, !id];
        for id in 0..200_000 {
            assert_eq!(records.push(&record(id)), id);
            if id % 30_000 == 29_999 {
                let (before, cold) = (records.bytes(), records.cold_bytes());
                records.spill(&disk).expect("there is room");
                assert_eq!(records.bytes(), before - cold);
            }
        }
        assert!(records.bytes() < 200_000 * 12 / 3);
        records.get_mut(5)[1] = 9;
        assert_eq!(records.get(5), [5, 9, !5]);
        for id in (0..200_000).filter(|&id| id != 5) {
            assert_eq!(records.get(id), record(id));
        }
        drop((records, disk));
        fs::remove_dir(place).expect("it is empty");
    }
}

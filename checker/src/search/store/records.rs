//! Records of one length, of bytes or of numbers, side by side in blocks that are never moved.

use crate::cancellation;

/// Bytes in one block, at least; a block holds a power of two of records.
const BLOCK_BYTES: usize = 1 << 16;

/// Records of one length, by number from 0, in blocks that are never moved.
#[derive(Debug)]
pub(super) struct Records<T> {
    /// How many parts a record has.
    size: usize,
    /// Records in a block, as a power of two.
    block_bits: u32,
    pub(super) blocks: Vec<Vec<T>>,
    count: u32,
}

impl<T: Copy> Records<T> {
    /// No records, of so many parts, at least one.
    pub(super) fn new(size: usize) -> Records<T> {
        Records {
            size,
            block_bits: (BLOCK_BYTES / size_of::<T>() / size).max(1).ilog2(),
            blocks: Vec::new(),
            count: 0,
        }
    }

    /// How many parts a record has.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// The first part of a record; 0 if there is no such record.
    #[inline]
    pub(super) fn first(&self, id: u32) -> T
    where
        T: Default,
    {
        let (block, first) = self.place(id);
        let part = self.blocks.get(block).and_then(|block| block.get(first));
        part.copied().unwrap_or_default()
    }

    #[inline]
    pub(super) fn get(&self, id: u32) -> &[T] {
        let (block, first) = self.place(id);
        &self.blocks[block][first..first + self.size]
    }

    pub(super) fn get_mut(&mut self, id: u32) -> &mut [T] {
        let (block, first) = self.place(id);
        &mut self.blocks[block][first..first + self.size]
    }

    /// The block of a record, and where it begins there.
    #[inline]
    fn place(&self, id: u32) -> (usize, usize) {
        let within = id as usize & ((1 << self.block_bits) - 1);
        (id as usize >> self.block_bits, within * self.size)
    }

    pub(super) fn push(&mut self, record: &[T]) -> u32 {
        let id = cancellation::number(self.count as usize);
        self.count += 1;
        if id as usize >> self.block_bits == self.blocks.len() {
            self.blocks
                .push(Vec::with_capacity(self.size << self.block_bits));
        }
        let block = self.blocks.last_mut();
        block
            .expect("a block was just made if there was none")
            .extend_from_slice(record);
        id
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count as usize
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.blocks.len() * (self.size << self.block_bits) * size_of::<T>()
    }
}

impl Records<u8> {
    /// Doubles the bytes of entries, block by block, so that the old and the new blocks never exist
    /// together.
    pub(super) fn widen(&mut self, widened: impl Fn(&[u8], &mut Vec<u8>)) {
        cancellation::ask_for(self.bytes());
        self.size *= 2;
        for block in &mut self.blocks {
            let mut wide = Vec::with_capacity(self.size << self.block_bits);
            widened(block, &mut wide);
            *block = wide;
        }
    }
}

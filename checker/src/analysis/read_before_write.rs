//! Which variables a function may read before it has surely written them, and which it surely
//! writes.
//!
//! Only some words of the state are looked at, and each has a number. A word counts as written
//! after an instruction that writes just it on all ways that lead there; a write whose place is
//! computed proves nothing, and a read whose place is not known reads all.
//!
//! Cost: the instructions of the functions, a few times, and two bits for each function and word.

use crate::ir::{
    Access, Base, BlockId, Function, FunctionId, Instruction, Network, Operand, Terminator,
};

use super::function_reads::state_words;

/// A set of words that are looked at, by number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct WordSet(Vec<u64>);

impl WordSet {
    pub(super) fn empty(count: usize) -> WordSet {
        WordSet(vec![0; count.div_ceil(64)])
    }

    pub(super) fn full(count: usize) -> WordSet {
        let mut all = WordSet::empty(count);
        (0..count).for_each(|number| all.insert(number));
        all
    }

    pub(super) fn insert(&mut self, number: usize) {
        self.0[number / 64] |= 1 << (number % 64);
    }

    pub(super) fn contains(&self, number: usize) -> bool {
        self.0[number / 64] & 1 << (number % 64) != 0
    }

    /// Adds those of another set; returns whether there are more now.
    pub(super) fn unite(&mut self, other: &WordSet) -> bool {
        let mut grows = false;
        for (own, other) in self.0.iter_mut().zip(&other.0) {
            grows |= other & !*own != 0;
            *own |= other;
        }
        grows
    }

    pub(super) fn intersect(&mut self, other: &WordSet) {
        for (own, other) in self.0.iter_mut().zip(&other.0) {
            *own &= other;
        }
    }

    pub(super) fn subtract(&mut self, other: &WordSet) {
        for (own, other) in self.0.iter_mut().zip(&other.0) {
            *own &= !other;
        }
    }
}

/// What a function does to the words that are looked at.
#[derive(Clone, Debug)]
pub(super) struct Exposure {
    /// It may read them before it has surely written them.
    pub(super) reads: WordSet,
    /// It has surely written them when it returns.
    pub(super) writes: WordSet,
}

impl Exposure {
    fn nothing(count: usize) -> Exposure {
        Exposure {
            reads: WordSet::empty(count),
            writes: WordSet::empty(count),
        }
    }

    /// What this and then another function do.
    pub(super) fn then(mut self, next: &Exposure) -> Exposure {
        let mut reads = next.reads.clone();
        reads.subtract(&self.writes);
        self.reads.unite(&reads);
        self.writes.unite(&next.writes);
        self
    }
}

/// The exposures of functions, worked out when they are asked for.
#[derive(Debug)]
pub(super) struct Exposures<'n> {
    network: &'n Network,
    /// By word of the state: its number, if it is looked at.
    numbers: &'n [Option<u32>],
    count: usize,
    known: Vec<Option<Exposure>>,
}

impl<'n> Exposures<'n> {
    pub(super) fn new(network: &'n Network, numbers: &'n [Option<u32>], count: usize) -> Self {
        Exposures {
            network,
            numbers,
            count,
            known: vec![None; network.functions.len()],
        }
    }

    /// The exposure of a function; without one, of nothing at all.
    pub(super) fn of(&mut self, function: Option<FunctionId>) -> Exposure {
        let Some(function) = function else {
            return Exposure::nothing(self.count);
        };
        // Functions that are called come first; none calls itself.
        let mut open = vec![function];
        while let Some(&one) = open.last() {
            let code = &self.network.functions[one.0 as usize];
            let before = open.len();
            if self.known[one.0 as usize].is_none() {
                let is_unknown = |callee: &FunctionId| self.known[callee.0 as usize].is_none();
                open.extend(code.callees().filter(is_unknown));
            }
            if open.len() == before {
                if self.known[one.0 as usize].is_none() {
                    self.known[one.0 as usize] = Some(self.work_out(code));
                }
                open.pop();
            }
        }
        let known = &self.known[function.0 as usize];
        known.clone().expect("the loop ends when it is known")
    }

    fn work_out(&self, code: &Function) -> Exposure {
        let entries = self.written_on_entry(code);
        let mut exposure = Exposure {
            reads: WordSet::empty(self.count),
            writes: WordSet::full(self.count),
        };
        for (block, entry) in code.blocks.iter().zip(entries) {
            // A block without one is never reached.
            let Some(mut written) = entry else { continue };
            for instruction in &block.instructions {
                let mut reads = WordSet::empty(self.count);
                self.add_reads(code, instruction, &mut reads);
                reads.subtract(&written);
                exposure.reads.unite(&reads);
                self.add_writes(instruction, &mut written);
            }
            if matches!(block.terminator, Terminator::Return(_)) {
                exposure.writes.intersect(&written);
            }
        }
        exposure
    }

    /// By block: what is surely written where it begins.
    fn written_on_entry(&self, code: &Function) -> Vec<Option<WordSet>> {
        let mut entries = vec![None; code.blocks.len()];
        entries[0] = Some(WordSet::empty(self.count));
        let mut open = vec![BlockId(0)];
        while let Some(BlockId(index)) = open.pop() {
            let block = &code.blocks[index as usize];
            let Some(mut written) = entries[index as usize].clone() else {
                continue;
            };
            for instruction in &block.instructions {
                self.add_writes(instruction, &mut written);
            }
            for next in block.terminator.successors() {
                let entry = &mut entries[next.0 as usize];
                let narrowed = match &*entry {
                    None => written.clone(),
                    Some(known) => {
                        let mut both = known.clone();
                        both.intersect(&written);
                        both
                    }
                };
                if entry.as_ref() != Some(&narrowed) {
                    *entry = Some(narrowed);
                    open.push(next);
                }
            }
        }
        entries
    }

    fn add_reads(&self, code: &Function, instruction: &Instruction, reads: &mut WordSet) {
        instruction.each_operand(&mut |operand| match operand {
            Operand::Memory(&address, Access::Read(count) | Access::Update(count)) => {
                match state_words(code, address, count, self.numbers.len()) {
                    Some(words) => self.numbered(words).for_each(|number| reads.insert(number)),
                    None => *reads = WordSet::full(self.count),
                }
            }
            // The analysis does not follow where the address is used.
            Operand::Memory(address, Access::Take) if address.base == Base::State => {
                *reads = WordSet::full(self.count);
            }
            _ => {}
        });
        if let Instruction::Call { function, .. } = instruction
            && let Some(callee) = &self.known[function.0 as usize]
        {
            reads.unite(&callee.reads);
        }
    }

    fn add_writes(&self, instruction: &Instruction, written: &mut WordSet) {
        instruction.each_operand(&mut |operand| {
            if let Operand::Memory(address, Access::Write(count) | Access::Update(count)) = operand
                && address.base == Base::State
                && address.index.is_none()
            {
                self.numbered(address.offset..address.offset + count)
                    .for_each(|number| written.insert(number));
            }
        });
        if let Instruction::Call { function, .. } = instruction
            && let Some(callee) = &self.known[function.0 as usize]
        {
            written.unite(&callee.writes);
        }
    }

    /// The numbers of those of the words that are looked at.
    fn numbered(&self, words: std::ops::Range<u32>) -> impl Iterator<Item = usize> {
        let numbers = self.numbers.get(words.start as usize..words.end as usize);
        numbers
            .unwrap_or_default()
            .iter()
            .flatten()
            .map(|&number| number as usize)
    }
}

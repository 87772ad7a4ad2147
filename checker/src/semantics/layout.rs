//! The final layout of the state: locations, variables, `meta` variables.
//!
//! How many processes there are is known only at the end, when the global functions have long been
//! lowered. Until then the offsets of variables count from 0, those of `meta` variables from
//! [`META_WORDS`], those of locations from [`LOCATION_WORDS`]; [`Relocation`] turns them into
//! offsets of words.

use super::typed::{LOCATION_WORDS, META_WORDS};
use super::types::Type;
use crate::ir::{Address, Base, Function, Instruction, Network, Shape};

/// Provisional offsets of the words that the stochastic reading puts before all variables.
pub(super) mod chance_words {
    use crate::ir::STREAM_WORDS;

    /// The state of the random numbers.
    pub(in crate::semantics) const STREAM: u32 = 0;
    /// Where functions leave a double: a time or a rate.
    pub(in crate::semantics) const RESULT: u32 = STREAM + STREAM_WORDS as u32;
    /// How far ahead of the state conditions are asked.
    pub(in crate::semantics) const AHEAD: u32 = RESULT + 2;
    /// Where conditions leave their signature.
    pub(in crate::semantics) const SIGNATURE: u32 = AHEAD + 2;
    /// All of them.
    pub(in crate::semantics) const COUNT: u32 = SIGNATURE + 2;
}

/// From provisional offsets to those of the final layout.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Relocation {
    /// How many processes there are.
    pub(super) locations: u32,
    /// How many words the variables take.
    pub(super) variables: u32,
}

impl Relocation {
    /// The final offset of a provisional one.
    pub(super) fn offset(self, offset: u32) -> u32 {
        if offset >= LOCATION_WORDS {
            offset - LOCATION_WORDS
        } else if offset >= META_WORDS {
            offset - META_WORDS + self.locations + self.variables
        } else {
            offset + self.locations
        }
    }

    fn address(self, address: &mut Address) {
        if address.base == Base::State {
            address.offset = self.offset(address.offset);
        }
    }

    /// Relocates the code of functions.
    pub(super) fn functions(self, functions: &mut [Function]) {
        let blocks = functions.iter_mut().flat_map(|f| &mut f.blocks);
        for instruction in blocks.flat_map(|block| &mut block.instructions) {
            match instruction {
                Instruction::LoadInteger { address, .. }
                | Instruction::LoadDouble { address, .. }
                | Instruction::StoreInteger { address, .. }
                | Instruction::StoreDouble { address, .. }
                | Instruction::AddressOf { address, .. } => self.address(address),
                Instruction::Random { stream, .. } => self.address(stream),
                Instruction::CopyWords { target, source, .. } => {
                    self.address(target);
                    self.address(source);
                }
                Instruction::EqualWords { left, right, .. } => {
                    self.address(left);
                    self.address(right);
                }
                _ => {}
            }
        }
    }

    /// Relocates what the network says about words.
    pub(super) fn network(self, network: &mut Network) {
        self.functions(&mut network.functions);
        let chances = &mut network.chances;
        let words = [
            &mut chances.stream,
            &mut chances.result,
            &mut chances.ahead,
            &mut chances.signature,
        ];
        for process in &mut network.processes {
            let locations = process.locations.iter_mut().map(|one| &mut one.invariant);
            let edges = process.edges.iter_mut().map(|one| &mut one.guard);
            let parts = locations.chain(edges).filter_map(|one| one.parts.as_mut());
            for comparison in parts.flat_map(|parts| &mut parts.comparisons) {
                comparison.clock = self.offset(comparison.clock);
            }
        }
        let locations = network.processes.iter_mut().flat_map(|p| &mut p.locations);
        let rated = locations.flat_map(|location| &mut location.chances.rated_clocks);
        for offset in words.into_iter().chain(&mut chances.clocks).chain(rated) {
            *offset = self.offset(*offset);
        }
        for variable in &mut network.layout.variables {
            variable.offset = self.offset(variable.offset);
        }
        network
            .layout
            .variables
            .sort_by_key(|variable| variable.offset);
        for update in network.updates_mut() {
            for (offset, _) in &mut update.writes {
                *offset = self.offset(*offset);
            }
            update.writes.sort_unstable();
        }
    }
}

/// Appends the first words of the real clocks of a variable that lies at `offset`.
pub(super) fn real_clocks(ty: &Type, offset: u32, clocks: &mut Vec<u32>) {
    match ty {
        Type::RealClock => clocks.push(offset),
        Type::Array(array) if ty.any(&|part| *part == Type::RealClock) => {
            let stride = array.part.size().words;
            for i in 0..array.index.length {
                real_clocks(&array.part, offset + i * stride, clocks);
            }
        }
        Type::Struct(record) => {
            let mut offset = offset;
            for (_, ty) in &record.fields {
                real_clocks(ty, offset, clocks);
                offset += ty.size().words;
            }
        }
        _ => {}
    }
}

/// Ascending disjoint ranges that cover the same words.
pub(super) fn merge_ranges(mut ranges: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    ranges.sort_unstable();
    let mut merged: Vec<(u32, u32)> = Vec::new();
    for (start, count) in ranges {
        match merged.last_mut() {
            Some((last, length)) if start <= *last + *length => {
                *length = (*length).max(start + count - *last);
            }
            _ => merged.push((start, count)),
        }
    }
    merged
}

/// The shape of the words of a type; clocks and channels have none.
pub(super) fn shape(ty: &Type) -> Shape {
    match ty {
        Type::Bool => Shape::Bool,
        Type::Double => Shape::Double,
        Type::RealClock => Shape::Struct(vec![
            (String::from("value"), Shape::Double),
            (String::from("rate"), Shape::Double),
        ]),
        Type::Scalar { set, size } => Shape::Scalar {
            size: *size,
            set: *set,
        },
        Type::Array(array) => Shape::Array {
            part: Box::new(shape(&array.part)),
            length: array.index.length,
            first: array.index.first,
            set: array.index.set,
        },
        Type::Struct(record) => Shape::Struct(
            record
                .fields
                .iter()
                .filter(|(_, ty)| ty.size().words > 0)
                .map(|(name, ty)| (name.clone(), shape(ty)))
                .collect(),
        ),
        _ => {
            let (low, high) = ty.bounds();
            Shape::Integer { low, high }
        }
    }
}

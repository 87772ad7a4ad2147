//! Where places lie in their memory.

use super::typed::{Expr, Kind, Root};
use super::types::Memory;

/// So many parts of constant arrays are looked at for the interval of their values.
const MOST_VALUES: usize = 4096;

/// Where a place lies in its memory, if all indices are known and inside.
pub(super) fn known_offset(expr: &Expr, memory: Memory) -> Option<u32> {
    match &expr.kind {
        Kind::Variable(place) => Some(place.base.of(memory)),
        Kind::Field { record, offset } => Some(known_offset(record, memory)? + offset.of(memory)),
        Kind::Index(element) => {
            let offset = known_offset(&element.array, memory)?;
            Some(offset + element.position()? * element.stride.of(memory))
        }
        _ => None,
    }
}

/// Where a part of the state lies in its memory, if all indices are known and inside.
pub(super) fn state_offset(expr: &Expr, memory: Memory) -> Option<u32> {
    let place = expr.variable().filter(|place| place.root == Root::State);
    place.and_then(|_| known_offset(expr, memory))
}

/// Where in the constant memory a place may lie, wherever its indices are inside; `None` if these
/// are too many.
pub(super) fn possible_offsets(expr: &Expr) -> Option<Vec<u32>> {
    match &expr.kind {
        Kind::Variable(place) => Some(vec![place.base.of(Memory::Words)]),
        Kind::Field { record, offset } => {
            let mut offsets = possible_offsets(record)?;
            for base in &mut offsets {
                *base += offset.of(Memory::Words);
            }
            Some(offsets)
        }
        Kind::Index(element) => {
            let position = |index: i32| {
                let position = i64::from(index) - i64::from(element.first);
                position.clamp(-1, i64::from(element.length)) as i32
            };
            let (low, high) = element.index.interval;
            let positions = position(low).max(0)..=position(high).min(element.length as i32 - 1);
            let bases = possible_offsets(&element.array)?;
            let count = positions.clone().count().saturating_mul(bases.len());
            let stride = element.stride.of(Memory::Words);
            let each = |base: u32| positions.clone().map(move |at| base + at as u32 * stride);
            (count <= MOST_VALUES).then(|| bases.into_iter().flat_map(each).collect())
        }
        _ => None,
    }
}

//! The innermost loops: the rows of a matrix, and the step from which all closing is made.
//!
//! Rows are relaxed as vectors of four entries. The last vector may overlap the one before it; this
//! is sound because relaxing is idempotent, and so short rows need no scalar loop at the end.
//! Everything here is inlined into loops whose bounds are constants for small dimensions.

#![expect(
    clippy::inline_always,
    reason = "the dimension is a constant at some calls"
)]

use super::{Bound, wide};

/// Calls a function with the dimension as its last argument. For small dimensions the argument is a
/// constant.
///
/// Most zones are small, and with a constant their rows unroll into a few vectors.
macro_rules! for_small_dimension {
    ($dimension:expr, $function:ident($($argument:expr),*)) => {
        match $dimension {
            2 => $function($($argument,)* 2),
            3 => $function($($argument,)* 3),
            4 => $function($($argument,)* 4),
            5 => $function($($argument,)* 5),
            6 => $function($($argument,)* 6),
            7 => $function($($argument,)* 7),
            8 => $function($($argument,)* 8),
            dimension => $function($($argument,)* dimension),
        }
    };
}
pub(super) use for_small_dimension;

/// The rows of a matrix, like `chunks_exact_mut`, but without its division: that would take a good
/// part of the time of an operation.
#[inline(always)]
pub(super) fn rows_mut(
    matrix: &mut [Bound],
    dimension: usize,
) -> impl Iterator<Item = &mut [Bound]> {
    let mut rest = matrix;
    std::iter::from_fn(move || {
        let (row, others) = std::mem::take(&mut rest).split_at_mut_checked(dimension)?;
        rest = others;
        Some(row)
    })
}

/// The rows of a matrix that is only read, like [`rows_mut`].
#[inline(always)]
pub(super) fn rows(matrix: &[Bound], dimension: usize) -> impl Iterator<Item = &[Bound]> {
    let mut rest = matrix;
    std::iter::from_fn(move || {
        let (row, others) = rest.split_at_checked(dimension)?;
        rest = others;
        Some(row)
    })
}

/// The greatest dimension for which a temporary row needs no allocation.
const MOST_ON_STACK: usize = 256;

/// Calls `action` with a row of infinite bounds that exists during the call.
#[inline(always)]
pub(super) fn with_row<R>(dimension: usize, action: impl FnOnce(&mut [Bound]) -> R) -> R {
    if dimension <= MOST_ON_STACK {
        let mut row = [Bound::INFINITY; MOST_ON_STACK];
        action(&mut row[..dimension])
    } else {
        action(&mut vec![Bound::INFINITY; dimension])
    }
}

/// Tightens every entry of `target` to the sum of `via` and the entry of `source`, if that is less.
#[inline(always)]
pub(super) fn relax_row(target: &mut [Bound], via: Bound, source: &[Bound]) {
    if via.is_infinite() {
        return;
    }
    if wide::is_on() {
        relax_row_in_64_bits(target, via, source);
        return;
    }
    let length = target.len().min(source.len());
    let (target, source) = (&mut target[..length], &source[..length]);
    let Some(tail) = last_relaxed(target, via, source) else {
        for (entry, rest) in target.iter_mut().zip(source) {
            *entry = Bound::relaxed(*entry, via, *rest);
        }
        return;
    };
    let (targets, _) = target.as_chunks_mut::<4>();
    let (sources, _) = source.as_chunks::<4>();
    for (entries, rests) in targets.iter_mut().zip(sources) {
        *entries = relaxed_four(*entries, via, *rests);
    }
    if !length.is_multiple_of(4)
        && let Some(entries) = target.last_chunk_mut::<4>()
    {
        *entries = tail;
    }
}

#[cold]
#[inline(never)]
fn relax_row_in_64_bits(target: &mut [Bound], via: Bound, source: &[Bound]) {
    for (entry, rest) in target.iter_mut().zip(source) {
        if rest.is_finite() {
            let encoded = via.wide_sum(*rest);
            if encoded < i64::from(entry.raw()) || entry.is_infinite() {
                *entry = Bound::fitted(encoded);
            }
        }
    }
}

/// The last four entries after relaxing. They are computed before any other entry is written, so
/// that no load waits for a store that overlaps it. None if the row is shorter.
#[inline(always)]
fn last_relaxed(target: &[Bound], via: Bound, source: &[Bound]) -> Option<[Bound; 4]> {
    Some(relaxed_four(
        *target.last_chunk::<4>()?,
        via,
        *source.last_chunk::<4>()?,
    ))
}

#[inline(always)]
fn relaxed_four(entries: [Bound; 4], via: Bound, rests: [Bound; 4]) -> [Bound; 4] {
    std::array::from_fn(|lane| Bound::relaxed(entries[lane], via, rests[lane]))
}

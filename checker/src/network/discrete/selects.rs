//! The `select` bindings of an edge: combinations of their values, numbered in mixed radix, the
//! last binding fastest.

use crate::ir::Edge;

/// How many combinations of select values an edge has.
pub fn select_count(edge: &Edge) -> u32 {
    edge.select
        .iter()
        .map(|select| (select.high - select.low + 1) as u32)
        .product()
}

/// The select values of a combination.
pub fn select_values(edge: &Edge, mut combination: u32, values: &mut Vec<i32>) {
    values.clear();
    values.resize(edge.select.len(), 0);
    for (value, select) in values.iter_mut().zip(&edge.select).rev() {
        let size = (select.high - select.low + 1) as u32;
        *value = select.low + (combination % size) as i32;
        combination /= size;
    }
}

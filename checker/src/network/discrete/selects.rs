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

/// The combination with the values that `value_of` gives for the names of the bindings; `None` if
/// there is none.
pub fn select_combination(edge: &Edge, value_of: impl Fn(&str) -> Option<i32>) -> Option<u32> {
    edge.select.iter().try_fold(0, |combination, select| {
        let value = value_of(&select.name)?;
        let is_possible = (select.low..=select.high).contains(&value);
        let size = (select.high - select.low + 1) as u32;
        is_possible.then(|| combination * size + (value - select.low) as u32)
    })
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

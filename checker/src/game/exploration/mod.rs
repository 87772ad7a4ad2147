//! What is explored when.

pub(super) mod dead_ends;
pub(super) mod lazy_safety;
pub(super) mod lazy_zero_time;
pub(super) mod waiting;

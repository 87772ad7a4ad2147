//! Searches for the best: shortest and fastest traces, greatest and least values.

pub mod best_first;
pub mod extremum;
pub mod value_goal;

//! Runs without end: emptiness, leads-to, the shortest lasso.

pub(super) mod delay_inside;
pub mod emptiness;
pub mod ending;
pub mod leads_to;
mod nodes;
pub mod shortest_lasso;
mod stack;

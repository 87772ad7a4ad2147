//! Where states are kept: discrete states, packed zones, the passed list.

mod bucket_table;
pub mod discrete_states;
pub mod disk;
mod groups;
pub(super) mod hashing;
pub(super) mod packed_paths;
pub(super) mod packed_zones;
pub(super) mod passed_list;
pub(super) mod queue;
pub(super) mod records;
mod rows;
pub(super) mod segmented_table;
mod signature;
pub(super) mod zone_lists;

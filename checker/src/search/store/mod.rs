//! Where states are kept: discrete states, packed zones, the passed list.

mod bucket_table;
pub mod discrete_states;
mod groups;
pub(super) mod hashing;
pub(super) mod packed_paths;
pub(super) mod packed_zones;
pub(super) mod passed_list;
mod records;
mod rows;
pub(super) mod segmented_table;
mod signature;
pub(super) mod zone_lists;

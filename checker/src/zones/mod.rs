//! Sets of clock valuations: bounds, zones as difference bound matrices, federations,
//! extrapolation.
//!
//! This room knows clocks by index, and bounds. It knows nothing of automata. Clock 0 is the
//! reference clock, whose value is always 0; a zone of *dimension* n describes the n - 1 clocks
//! 1..n. These are the modules in reading order:
//!
//! * [`wide`]: whether sums of bounds need 64 bits;
//! * [`bound`]: one bound `x - y < c` or `x - y <= c` in an `i32`;
//! * [`clock_set`]: a set of clocks as a bit set;
//! * `rows`: the innermost loops;
//! * [`dbm`]: zones on slices, so that callers can keep them in arenas; its module text states the
//!   contract of a zone;
//! * [`clocks`]: operations that move clocks: delay, reset, assignment, freeing, and the preimage
//!   of an update;
//! * [`zone`]: one zone that owns its matrix;
//! * [`zone_table`]: a table that stores each zone once;
//! * [`minimal`]: the least set of constraints that makes a zone;
//! * [`extrapolate`]: the abstractions that make the zone graph finite;
//! * [`simulation`]: inclusion up to what comparisons can distinguish;
//! * [`federation`]: finite unions of zones, with exact subtraction and inclusion;
//! * [`past`]: the safe timed predecessors of timed games;
//! * [`future`]: their mirror image, and delays that a barrier stops;
//! * [`instants`]: what lies just before and just after a set.
//!
//! Sources: J. Bengtsson, W. Yi, "Timed Automata: Semantics, Algorithms and Tools", 2004, for the
//! operations on zones. The modules name the other sources.

pub mod bound;
pub mod clock_set;
mod rows;
pub mod wide;

pub mod dbm;

pub mod clocks;
pub mod zone;
pub mod zone_table;

pub mod minimal;

pub mod extrapolate;
pub mod simulation;

pub mod federation;
pub mod future;
pub mod instants;
pub mod past;

#[cfg(test)]
mod tests;

pub use bound::Bound;
pub use clock_set::ClockSet;
pub use federation::Federation;
pub use zone::Zone;

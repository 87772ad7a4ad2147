//! Bounds of the least costs, and what they are found for.

use super::process::Process;

/// The bounds, and who attains the upper one.
#[derive(Debug)]
pub(super) struct Solution {
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
    /// By node: the best choice.
    pub(super) policy: Vec<u32>,
    /// Whether no state comes again.
    pub(super) is_acyclic: bool,
}

/// Why there are no bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unsolved {
    /// The cost falls without bound.
    Unbounded,
    /// Costs of both signs lie on cycles.
    MixedCycles,
    /// Bounds do not come near enough to each other.
    Slow,
}

/// A component.
pub(super) struct Cyclic<'s> {
    pub(super) process: &'s Process,
    pub(super) nodes: &'s [u32],
    /// By node of the process: room for its place in the component; all `u32::MAX`.
    pub(super) places: &'s mut [u32],
    /// Known behind the component.
    pub(super) solution: &'s mut Solution,
    /// How near the bounds are to be, as a part of the greatest value.
    pub(super) precision: f64,
}

//! A sample of the finite decision process that a partition makes of remembered decisions.

/// What a decision was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// The action in its cell.
    pub(super) slot: u32,
    /// The stand behind it.
    pub(super) next: u32,
    pub(super) cost: f64,
    /// Where its point begins, among those of all samples.
    pub(super) point: u32,
    /// When it was taken in its run.
    pub(super) at: f64,
    /// Whether the sample behind it is the next decision of the run.
    pub(super) is_followed: bool,
    /// Which half of the runs its run belongs to: 0 or 1.
    pub(super) half: u8,
}

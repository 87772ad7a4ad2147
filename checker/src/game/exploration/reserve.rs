//! The moves of the evader that are not explored where time does not pass: see
//! [`super::lazy_zero_time`].

/// The nodes from which some moves of the evader are kept in reserve.
#[derive(Debug, Default)]
pub(in crate::game) struct Reserve {
    /// Whether anything more is to be kept.
    pub(in crate::game) is_kept: bool,
    /// Whether anything was ever kept.
    pub(in crate::game) is_used: bool,
    /// For each node: whether it leads to something in reserve.
    pub(super) sources: Vec<bool>,
    /// The number of nodes that were visited to find those in play.
    pub(super) looks: u64,
}

impl Reserve {
    pub(super) fn add_node(&mut self) {
        self.sources.push(false);
    }

    pub(super) fn forget_nodes(&mut self) {
        self.sources.clear();
    }

    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        self.sources.len()
    }
}

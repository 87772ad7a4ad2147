//! Which words updates write; for static analysis.

use super::{Network, Update};

impl Network {
    /// All updates: of edges, of their branches, and those around every transition.
    pub fn updates(&self) -> impl Iterator<Item = &Update> {
        let of_edges = self.edges().flat_map(|edge| {
            let branches = edge.branches.iter().map(|branch| &branch.update);
            std::iter::once(&edge.update).chain(branches)
        });
        of_edges
            .chain(&self.before_update)
            .chain(&self.after_update)
    }

    /// The same, to change them.
    pub(crate) fn updates_mut(&mut self) -> impl Iterator<Item = &mut Update> {
        let edges = self.processes.iter_mut().flat_map(|one| &mut one.edges);
        let of_edges = edges.flat_map(|edge| {
            let branches = edge.branches.iter_mut().map(|branch| &mut branch.update);
            std::iter::once(&mut edge.update).chain(branches)
        });
        of_edges
            .chain(&mut self.before_update)
            .chain(&mut self.after_update)
    }

    /// By word: whether some update may write it. Locations always count as written.
    pub fn written_words(&self) -> Vec<bool> {
        let mut written = vec![false; self.layout.words as usize];
        written[..self.processes.len()].fill(true);
        for &(first, count) in self.updates().flat_map(|update| &update.writes) {
            written[first as usize..(first + count) as usize].fill(true);
        }
        written
    }
}

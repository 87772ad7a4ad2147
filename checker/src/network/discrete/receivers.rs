//! Which processes may receive on which channels.

use std::ops::Range;

use crate::ir::{Network, Sync};

/// For each channel: the processes with an edge that may receive on it, ascending.
#[derive(Debug)]
pub struct Receivers(Vec<Vec<u32>>);

impl Receivers {
    /// The receivers of a network.
    #[must_use]
    pub fn new(network: &Network) -> Receivers {
        let mut receivers = vec![Vec::new(); network.channels.len()];
        for (process, known) in (0..).zip(&network.processes) {
            let syncs = known.edges.iter().filter_map(|edge| edge.sync);
            for channel in syncs.filter(|sync| !sync.send).flat_map(Sync::channels) {
                let list: &mut Vec<u32> = &mut receivers[channel as usize];
                if list.last() != Some(&process) {
                    list.push(process);
                }
            }
        }
        Receivers(receivers)
    }

    /// The processes that may receive on a channel, ascending.
    #[must_use]
    pub fn on(&self, channel: u32) -> &[u32] {
        &self.0[channel as usize]
    }

    /// The processes that may receive on one of some channels, ascending.
    #[must_use]
    pub fn on_any(&self, channels: Range<u32>) -> Vec<u32> {
        let mut all: Vec<u32> = channels
            .flat_map(|channel| self.on(channel))
            .copied()
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

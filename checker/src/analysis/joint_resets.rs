//! Which clocks a synchronisation certainly resets, with any partner.
//!
//! An edge that synchronises is taken together with another one: a sender on a channel that is no
//! broadcast with one receiver, a receiver with the sender. What all edges that can stand on the
//! other side reset is reset with it.

use crate::ir::{Branch, Edge, Network, Update};

/// In networks with more channels, or more pairs of channel and clock, nothing is found out.
const MOST_CHANNELS: usize = 4096;
/// See [`MOST_CHANNELS`].
const MOST_ENTRIES: usize = 1 << 20;

/// The clocks that all edges on a channel reset, by channel and clock.
#[derive(Debug)]
pub(super) struct Partners {
    clocks: usize,
    /// What all senders reset; without any sender, all clocks.
    senders: Vec<bool>,
    /// What all receivers reset.
    receivers: Vec<bool>,
    is_broadcast: Vec<bool>,
}

impl Partners {
    pub(super) fn new(network: &Network) -> Option<Partners> {
        let clocks = network.clocks.len().max(1);
        let channels = network.channels.len();
        if channels == 0 || channels > MOST_CHANNELS || channels * clocks > MOST_ENTRIES {
            return None;
        }
        let mut partners = Partners {
            clocks,
            senders: vec![true; channels * clocks],
            receivers: vec![true; channels * clocks],
            is_broadcast: network.channels.iter().map(|c| c.broadcast).collect(),
        };
        for edge in network.edges() {
            partners.add(edge);
        }
        Some(partners)
    }

    fn add(&mut self, edge: &Edge) {
        let Some(sync) = edge.sync.filter(|_| !edge.guard.never_holds) else {
            return;
        };
        let resets: Vec<bool> = (0..self.clocks)
            .map(|clock| {
                edge.branches
                    .iter()
                    .all(|branch| resets(edge, branch, clock))
            })
            .collect();
        let side = if sync.send {
            &mut self.senders
        } else {
            &mut self.receivers
        };
        for channel in sync.channels() {
            let all = &mut side[channel as usize * self.clocks..][..self.clocks];
            for (all, resets) in all.iter_mut().zip(&resets) {
                *all &= resets;
            }
        }
    }

    /// Whether every process that takes part in the edge's synchronisation resets the clock.
    pub(super) fn reset(&self, edge: &Edge, clock: usize) -> bool {
        let Some(sync) = edge.sync else {
            return false;
        };
        let mut channels = sync.channels();
        channels.all(|channel| {
            let channel = channel as usize;
            let entry = channel * self.clocks + clock;
            if sync.send {
                !self.is_broadcast[channel] && self.receivers[entry]
            } else {
                self.senders[entry]
            }
        })
    }
}

/// Whether the edge certainly sets the clock to a constant if it ends in this branch.
pub(super) fn resets(edge: &Edge, branch: &Branch, clock: usize) -> bool {
    is_certain(&edge.update, clock) || is_certain(&branch.update, clock)
}

fn is_certain(update: &Update, clock: usize) -> bool {
    update
        .fixed
        .iter()
        .any(|&(target, _)| target.0 as usize == clock)
}

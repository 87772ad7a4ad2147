//! Which processes may synchronise with each other on the channels of an array.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::ir::{ChannelId, Network};

use super::edge_tables::EdgeEntry;
use super::receivers::Receivers;
use super::select_cache::SetId;

/// A pair that synchronises.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<'a> {
    /// The place of the sender's instance in its set.
    pub(super) own: u32,
    pub(super) receiver: u32,
    pub(super) receive: EdgeEntry<'a>,
    pub(super) set: SetId,
    /// The place of the receiver's instance.
    pub(super) other: u32,
}

/// The processes that may receive on one of the channels of an array. Only arrays on which edges
/// with several instances send are here.
pub(super) type Partners = FxHashMap<(ChannelId, u32), Arc<[u32]>>;

/// Finds the partners by the receivers of each channel.
pub(super) fn partners(network: &Network, receivers: &Receivers) -> Partners {
    let mut partners = Partners::default();
    let edges = network.processes.iter().flat_map(|process| &process.edges);
    for edge in edges {
        let Some(sync) = edge
            .sync
            .filter(|sync| sync.send && !edge.select.is_empty())
        else {
            continue;
        };
        partners
            .entry((sync.channel, sync.count))
            .or_insert_with(|| receivers.on_any(sync.channels()).into());
    }
    partners
}

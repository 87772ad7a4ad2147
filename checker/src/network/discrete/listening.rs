//! Which instances of a receiving edge listen to a channel, evaluated at most once for each state.
//!
//! Every sender of a state asks all its receivers; where the channel is chosen by an expression
//! over `select` values, asking anew for each sender costs the product of both.

use std::ops::Range;

/// The receiving instances of one process by channel, in the state at hand.
#[derive(Debug, Default)]
pub(super) struct Listening {
    /// The state that it holds for, by its number.
    round: u64,
    /// By receiving edge of the location: where its instances lie in `instances`, if they were
    /// evaluated.
    edges: Vec<Option<Range<usize>>>,
    /// Channels with instances; in the range of an edge, ascending.
    instances: Vec<(u32, u32)>,
}

impl Listening {
    /// Forgets what holds for another state; `edges` leave the location and receive.
    pub(super) fn turn_to(&mut self, round: u64, edges: usize) {
        if self.round != round {
            self.round = round;
            self.instances.clear();
            self.edges.clear();
            self.edges.resize(edges, None);
        }
    }

    /// Whether the instances of an edge were evaluated.
    pub(super) fn knows(&self, edge: usize) -> bool {
        self.edges[edge].is_some()
    }

    /// Takes the channels of all instances of an edge, in order.
    pub(super) fn learn(&mut self, edge: usize, channels: &[u32]) {
        let start = self.instances.len();
        self.instances.extend(channels.iter().copied().zip(0..));
        self.instances[start..].sort_unstable();
        self.edges[edge] = Some(start..self.instances.len());
    }

    /// Where the instances of an edge lie that listen to a channel.
    pub(super) fn listeners(&self, edge: usize, channel: u32) -> Range<usize> {
        let Some(range) = self.edges[edge].clone() else {
            return 0..0;
        };
        let instances = &self.instances[range.clone()];
        let first = instances.partition_point(|&(heard, _)| heard < channel);
        let count = instances[first..].partition_point(|&(heard, _)| heard == channel);
        range.start + first..range.start + first + count
    }

    /// The instance at a place that [`Listening::listeners`] gives.
    pub(super) fn instance(&self, place: usize) -> u32 {
        self.instances[place].1
    }
}

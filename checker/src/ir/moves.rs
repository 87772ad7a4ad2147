//! Moves of a network by numbers: who takes which edge, and what a machine proposes.

use super::ids::ChannelId;

/// The part of one process in a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Part {
    /// Index of the process.
    pub process: u32,
    /// Index of the edge in its process.
    pub edge: u32,
    /// Index of the branch of the edge.
    pub branch: u32,
    /// Which combination of `select` values: the mixed-radix number over the bindings, the last
    /// binding fastest.
    pub select: u32,
}

/// What the controller proposes where it sees predicates only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Action {
    /// Nothing.
    Wait,
    /// A synchronisation on this channel between controllable edges.
    Channel(ChannelId),
    /// A controllable edge without a channel, or one to a branch point whose legs have channels;
    /// all legs have the name of the first. The branch is 0.
    Edge(Part),
}

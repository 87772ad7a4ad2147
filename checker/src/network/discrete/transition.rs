//! Moves, each a composed transition, in flat buffers that are reused for the next state.

use crate::exec::EmittedConstraint;
use crate::ir::ChannelId;
pub use crate::ir::Part;
use crate::network::failure::Failure;
use crate::zones::federation::block_bytes;

/// The greatest number of moves of a state: the choices of the receivers of a broadcast multiply.
const MOST_MOVES: usize = 1 << 20;

/// The index of cached moves. Each belongs to one location vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MoveListId(pub(super) u32);

/// Ranges into the buffers of [`Moves`].
#[derive(Clone, Copy, Debug)]
struct Header {
    parts: (u32, u32),
    constraints: (u32, u32),
    excluded: (u32, u32),
    label: Label,
}

/// The facts about a move that are not its parts and constraints.
#[derive(Clone, Copy, Debug)]
pub(in crate::network) struct Label {
    /// The channel of the synchronisation.
    pub(super) channel: Option<ChannelId>,
    /// Whether the controller owns it.
    pub(super) controllable: bool,
    /// See [`MoveRef::rank`].
    pub(super) rank: u64,
    /// Whether it is known that its guards leave something of the zone for which the moves were
    /// computed.
    pub(in crate::network) is_possible: bool,
}

impl Label {
    /// The same for a move whose constraints were changed.
    pub(in crate::network) fn unsettled(self) -> Label {
        Label {
            is_possible: false,
            ..self
        }
    }
}

/// The moves of a state, by ascending rank.
#[derive(Clone, Debug, Default)]
pub struct Moves {
    headers: Vec<Header>,
    parts: Vec<Part>,
    constraints: Vec<EmittedConstraint>,
    /// Ranges of `constraints`: conjunctions that must *not* hold, from clock-guarded broadcast
    /// receivers that abstain.
    excluded: Vec<(u32, u32)>,
    /// The move list, if the moves are cached.
    pub(super) list: Option<MoveListId>,
}

/// One move of [`Moves`].
#[derive(Clone, Copy, Debug)]
pub struct MoveRef<'a> {
    /// The parts: the sender (or the only process) first, then receivers in process order.
    pub parts: &'a [Part],
    /// The clock constraints of the participants' guards.
    pub constraints: &'a [EmittedConstraint],
    /// The channel of the synchronisation; `None` for an internal edge.
    pub channel: Option<ChannelId>,
    /// Whether the controller owns the move: all participating edges are controllable.
    pub controllable: bool,
    /// The place of the move among all that the locations and variables of the state allow, for any
    /// zone.
    pub rank: u64,
    pub(in crate::network) label: Label,
    /// For cached moves: the move list and the place in it.
    pub(in crate::network) listed: Option<(MoveListId, u32)>,
    moves: &'a Moves,
    excluded: (u32, u32),
}

impl<'a> MoveRef<'a> {
    /// The conjunctions of clock constraints that must not hold.
    pub fn excluded(&self) -> impl Iterator<Item = &'a [EmittedConstraint]> {
        let moves = self.moves;
        moves.excluded[self.excluded.0 as usize..self.excluded.1 as usize]
            .iter()
            .map(move |&(first, last)| &moves.constraints[first as usize..last as usize])
    }

    /// Whether the move is possible at every clock valuation.
    pub fn is_unconditional(&self) -> bool {
        self.constraints.is_empty() && self.excluded.0 == self.excluded.1
    }
}

impl Moves {
    /// Forgets all moves and keeps the memory.
    pub fn clear(&mut self) {
        self.headers.clear();
        self.parts.clear();
        self.constraints.clear();
        self.excluded.clear();
        self.list = None;
    }

    /// The bytes that the moves take, without the value itself.
    pub(crate) fn heap_bytes(&self) -> usize {
        block_bytes(size_of_val(&*self.headers))
            + block_bytes(size_of_val(&*self.parts))
            + block_bytes(size_of_val(&*self.constraints))
            + block_bytes(size_of_val(&*self.excluded))
    }

    /// Replaces the moves by others and keeps the memory.
    pub fn copy_from(&mut self, other: &Moves) {
        self.headers.clone_from(&other.headers);
        self.parts.clone_from(&other.parts);
        self.constraints.clone_from(&other.constraints);
        self.excluded.clone_from(&other.excluded);
        self.list = other.list;
    }

    /// How many moves there are.
    pub fn len(&self) -> usize {
        self.headers.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.headers.is_empty()
    }

    /// Fails if there are too many.
    pub(super) fn check_count(&self) -> Result<(), Failure> {
        if self.len() > MOST_MOVES {
            return Err(Failure::Moves(MOST_MOVES));
        }
        Ok(())
    }

    /// The move with this index.
    pub fn get(&self, index: usize) -> MoveRef<'_> {
        let header = self.headers[index];
        MoveRef {
            parts: &self.parts[header.parts.0 as usize..header.parts.1 as usize],
            constraints: &self.constraints
                [header.constraints.0 as usize..header.constraints.1 as usize],
            channel: header.label.channel,
            controllable: header.label.controllable,
            rank: header.label.rank,
            label: header.label,
            listed: self.list.map(|list| (list, index as u32)),
            moves: self,
            excluded: header.excluded,
        }
    }

    /// All moves, in order.
    pub fn iter(&self) -> impl Iterator<Item = MoveRef<'_>> {
        (0..self.len()).map(|index| self.get(index))
    }

    /// The move with this rank.
    pub fn with_rank(&self, rank: u64) -> Option<MoveRef<'_>> {
        let found = self
            .headers
            .binary_search_by_key(&rank, |header| header.label.rank);
        found.ok().map(|index| self.get(index))
    }

    /// Adds a move.
    pub(in crate::network) fn push<'c>(
        &mut self,
        parts: &[Part],
        constraints: impl IntoIterator<Item = &'c [EmittedConstraint]>,
        excluded: impl IntoIterator<Item = &'c [EmittedConstraint]>,
        label: Label,
    ) {
        let first_part = self.parts.len() as u32;
        self.parts.extend_from_slice(parts);
        let first_constraint = self.constraints.len() as u32;
        for group in constraints {
            self.constraints.extend_from_slice(group);
        }
        let last_constraint = self.constraints.len() as u32;
        let first_excluded = self.excluded.len() as u32;
        for group in excluded {
            let first = self.constraints.len() as u32;
            self.constraints.extend_from_slice(group);
            self.excluded.push((first, self.constraints.len() as u32));
        }
        self.headers.push(Header {
            parts: (first_part, self.parts.len() as u32),
            constraints: (first_constraint, last_constraint),
            excluded: (first_excluded, self.excluded.len() as u32),
            label,
        });
    }
}

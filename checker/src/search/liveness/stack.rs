//! The stack of a depth-first search, of which only the top is held as states.
//!
//! A run may have as many states as there are. Those near the top are held with their words, zones
//! and moves. Of those below, only the node and the number of the next move are kept: when the
//! search comes back to one, its state is loaded and its moves are found again.
//!
//! Cost: eight bytes for each state that is not near the top, and finding its moves once more.

use crate::network::{Failure, KnownZone, Moves, Part, Symbolic};
use crate::zones::{Bound, Zone};

/// So many states are held. When there are more, the lower half of them is let go.
const HELD: usize = 512;

/// A state on the stack.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) node: u32,
    pub(super) words: Vec<i32>,
    pub(super) zone: Zone,
    /// The number by which moves from the zone can be looked up.
    pub(super) known: Option<KnownZone>,
    pub(super) moves: Moves,
    pub(super) next_move: usize,
    /// The target of the current move, and its zones that are still to be visited.
    pub(super) target: Vec<i32>,
    pub(super) pending: Vec<Zone>,
}

impl Frame {
    /// The processes that take part in the current move.
    pub(super) fn parts(&self) -> &[Part] {
        self.moves.get(self.next_move - 1).parts
    }

    fn bytes(&self) -> usize {
        let words = size_of_val(&*self.words) + size_of_val(&*self.target);
        let zones = (1 + self.pending.len()) * size_of_val(self.zone.bounds());
        size_of::<Frame>() + words + zones + self.moves.heap_bytes()
    }
}

/// A state that is not held.
#[derive(Clone, Copy, Debug)]
pub(super) struct Below {
    pub(super) node: u32,
    pub(super) next_move: u32,
}

/// The stack.
#[derive(Debug, Default)]
pub(super) struct Stack {
    below: Vec<Below>,
    /// For the states that are not held and have some: how many states are below, and how many
    /// zones of the target of the current move are still to be visited.
    pending: Vec<(u32, u32)>,
    /// The states that are held, the top last, and then those that can be used again.
    frames: Vec<Frame>,
    held: usize,
}

impl Stack {
    /// How many states there are.
    pub(super) fn len(&self) -> usize {
        self.below.len() + self.held
    }

    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        let frames = self.frames.iter().map(Frame::bytes);
        self.below.capacity() * size_of::<Below>()
            + self.pending.capacity() * size_of::<(u32, u32)>()
            + frames.sum::<usize>()
    }

    /// The top, if it is held.
    pub(super) fn top(&mut self) -> Option<&mut Frame> {
        self.frames[..self.held].last_mut()
    }

    /// Adds a state, and finds its moves.
    pub(super) fn push(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        node: u32,
        words: &[i32],
        zone: &[Bound],
        known: Option<KnownZone>,
    ) -> Result<(), Failure> {
        if self.held == HELD {
            self.let_go();
        }
        if self.frames.len() == self.held {
            self.frames.push(Frame {
                node,
                words: words.to_vec(),
                zone: Zone::from_bounds(symbolic.dimension(), zone),
                known,
                moves: Moves::default(),
                next_move: 0,
                target: words.to_vec(),
                pending: Vec::new(),
            });
        }
        let frame = &mut self.frames[self.held];
        self.held += 1;
        frame.node = node;
        frame.words.copy_from_slice(words);
        frame.zone.bounds_mut().copy_from_slice(zone);
        frame.known = known.or_else(|| symbolic.know(zone));
        frame.next_move = 0;
        frame.pending.clear();
        symbolic.moves_within(&mut frame.words, zone, &mut frame.moves)
    }

    /// How many states are below that of a node on the stack.
    pub(super) fn depth(&self, node: u32) -> usize {
        let below = self.below.iter().map(|one| one.node);
        let held = self.frames[..self.held].iter().map(|one| one.node);
        let mut nodes = below.chain(held);
        nodes
            .position(|one| one == node)
            .expect("the node is on the stack")
    }

    /// Lets the lower half of the states go.
    fn let_go(&mut self) {
        let count = HELD / 2;
        for frame in &self.frames[..count] {
            if !frame.pending.is_empty() {
                let below = self.below.len() as u32;
                self.pending.push((below, frame.pending.len() as u32));
            }
            self.below.push(Below {
                node: frame.node,
                next_move: frame.next_move as u32,
            });
        }
        self.frames[..self.held].rotate_left(count);
        self.held -= count;
    }

    /// Removes the top, which is held.
    pub(super) fn pop(&mut self) {
        self.held -= 1;
    }

    /// Takes the top out, which is not held, with the number of zones of the target of its current
    /// move that are still to be visited.
    pub(super) fn pop_below(&mut self) -> Option<(Below, usize)> {
        let top = self.below.pop()?;
        let is_of_top = |&mut (below, _): &mut (u32, u32)| below as usize == self.below.len();
        let pending = self.pending.pop_if(is_of_top);
        Some((top, pending.map_or(0, |(_, pending)| pending as usize)))
    }

    /// Removes all states.
    pub(super) fn clear(&mut self) {
        self.below.clear();
        self.pending.clear();
        self.held = 0;
    }

    /// The states that are not held, and those that are, the top last.
    pub(super) fn all(&self) -> (&[Below], &[Frame]) {
        (&self.below, &self.frames[..self.held])
    }
}

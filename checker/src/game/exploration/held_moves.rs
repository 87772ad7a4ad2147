//! The moves of the evader that are held back where time passes: see [`super::lazy_safety`].

/// Whether the evader uses a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::game) enum Hold {
    /// Always.
    None,
    /// Not yet.
    Held,
    /// It was held back, and is used.
    Used,
}

/// What is held back.
#[derive(Debug, Default)]
pub(in crate::game) struct HeldMoves {
    /// For each edge; edges after the last entry are not held.
    pub(in crate::game) holds: Vec<Hold>,
    /// For each node: the processes that take part in the moves by which the seeker wins a part of
    /// it, as in [`Edge::movers`].
    pub(in crate::game) attackers: Vec<u32>,
    /// The processes that take part in most moves, so that they give no information.
    pub(super) hubs: u32,
    /// The number of edges at which hubs are counted again.
    pub(super) next_count: usize,
    /// Nodes that were undefended at their last computation, and others.
    pub(in crate::game) undefended: Vec<u32>,
    /// Whether weak moves are used too.
    pub(in crate::game) uses_weak: bool,
}

/// What the evader does against a threat.
#[derive(Clone, Debug, Default)]
pub(in crate::game) struct Defence {
    /// The moves that it must use, counted from the first edge of the node.
    pub(super) moves: Box<[u32]>,
    /// Whether only weak moves help against the rest.
    pub(super) is_undefended: bool,
}

impl HeldMoves {
    /// The bytes that it takes.
    pub(in crate::game) fn bytes(&self) -> usize {
        self.holds.len() + (self.attackers.len() + self.undefended.len()) * size_of::<u32>()
    }

    /// Whether a move is held back.
    pub(in crate::game) fn holds(&self, edge: usize) -> bool {
        self.holds.get(edge) == Some(&Hold::Held)
    }

    /// Forgets all nodes; afterwards nothing is held back.
    pub(in crate::game) fn forget_nodes(&mut self) {
        *self = HeldMoves::default();
    }

    /// Lets the evader use all held moves.
    pub(super) fn release(&mut self) {
        self.holds.clear();
        self.undefended.clear();
    }

    /// Makes room for one more node that nobody attacks.
    pub(in crate::game) fn add_node(&mut self) {
        self.attackers.push(0);
    }
}

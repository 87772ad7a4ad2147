//! The heuristics that can be switched off, one row each.
//!
//! A heuristic changes how long an answer takes and how many states are explored, but no verdict
//! and no value. So each of them has a row here, which a user, a test or a benchmark may switch off
//! (`make ablation` measures what each gains). The code of a heuristic asks for the value of its
//! row where it begins; nothing else depends on this table.

use std::fmt;

macro_rules! parts {
    ($($name:ident: $says:literal;)*) => {
        /// Which heuristics are used. All are, unless one is switched off.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct Tuning {
            $(#[doc = $says] pub $name: bool,)*
        }

        /// The names of all heuristics, each with what it does.
        pub const PARTS: &[(&str, &str)] = &[$((stringify!($name), $says)),*];

        impl Default for Tuning {
            fn default() -> Tuning {
                Tuning { $($name: true),* }
            }
        }

        impl Tuning {
            /// The switch with this name.
            fn switch(&mut self, name: &str) -> Option<&mut bool> {
                match name {
                    $(stringify!($name) => Some(&mut self.$name),)*
                    _ => None,
                }
            }
        }
    };
}

parts! {
    // Moves of a state.
    transition_cache: "Keep the moves of a location vector, by the answers of guards.";
    select_cache: "Keep the enabled instances of edges with select, by the words they read.";
    pairing: "Pair the kept instances of senders and receivers at once.";
    broadcast_filter: "Leave out combinations of receivers that the zone does not allow.";
    broadcast_receivers: "Look for the receivers of a broadcast once for all its senders.";
    // Zones.
    successor_cache: "Keep what moves make of zones.";
    constant_effect: "Keep the effects of moves that only locations decide.";
    deadlock_witness: "Look first for a move that shows that a state has no deadlock.";
    // Analyses before a search.
    location_splitting: "Tell clock bounds apart by flags that only one process writes.";
    joint_resets: "Count clocks as reset that all partners of a synchronisation reset.";
    simulation: "Leave a state out if a stored one can do all that it can do.";
    coarser_first: "Look in coarser zones first for deadlocks and runs without end.";
    time_stoppers: "Reduce orders of moves also where invariants and urgent channels stop time.";
    zero_time_cycles: "Reduce orders of moves also without a new state, where no loop can be.";
    // Searches.
    recent_states: "Keep committed states that were explored lately, to explore them once.";
    signatures: "Tell most zones apart by digests.";
    split_lists: "Take long lists of zones apart by their digests.";
    narrow_zones: "Store bounds in as few bytes as they need.";
    kept_signatures: "Keep the packed form of zones that the successor cache knows.";
    // Games: the graph.
    chains: "Make one edge of moves that follow without a choice.";
    chain_cache: "Keep what such chains do to clocks.";
    dead_ends: "Leave out what follows after states that locations show to be lost.";
    discrete_nodes: "Use one node for each discrete state where there are many zones for each.";
    // Games: what is explored when.
    dives: "Follow random moves as far as they go, and start again from random nodes.";
    spoilers: "Expand first what the opponent may move to from nodes that are won in part.";
    lazy_zero_time: "Explore one move of the opponent after the other where time stands still.";
    lazy_safety: "Explore moves of the opponent only against threats where time passes.";
    losing_untimed: "End a game once the graph shows that nothing open leads to a win.";
    losing_timed: "End a game once zones show that nothing open leads to a win.";
    relevance: "Expand only nodes of which some predecessor may still win more.";
    // Games: what is won.
    delayed_zones: "Compute with zones only when the graph has grown by a part of itself.";
    full_backward: "Explore the whole graph first where all of it is to be computed.";
    exact_first: "Try games that compare two clocks without abstraction first.";
    // Code.
    compiled_runs: "Compile whole random runs once many moves were made.";
    interpret_first: "Compile functions only once they have run for a while.";
}

/// A name that no heuristic has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownPart(String);

impl fmt::Display for UnknownPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = PARTS.iter().map(|part| part.0).collect();
        let names = names.join(", ");
        write!(f, "{:?} is no heuristic; there are {names}", self.0)
    }
}

impl std::error::Error for UnknownPart {}

impl Tuning {
    /// All heuristics but those with these names.
    ///
    /// # Errors
    /// One of the names is unknown.
    pub fn without(names: impl IntoIterator<Item = String>) -> Result<Tuning, UnknownPart> {
        let mut tuning = Tuning::default();
        for name in names {
            match tuning.switch(&name) {
                Some(switch) => *switch = false,
                None => return Err(UnknownPart(name)),
            }
        }
        Ok(tuning)
    }
}

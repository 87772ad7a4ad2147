//! What follows after dead ends ([`crate::game::forward::dead_ends`]), where a strategy must say
//! what to do there too.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch, states_between_looks};

use crate::game::solver::Solver;

/// Expanded nodes between two looks at the limits, at most.
const BETWEEN_LOOKS: u64 = 64;

impl Solver<'_, '_, '_> {
    /// Explores what follows after dead ends if the evader has won: its strategy says what to do
    /// there too.
    ///
    /// # Errors
    /// The model fails in a state that follows.
    pub fn explore_dead_ends(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        if self.is_won() {
            return Ok(None);
        }
        // What follows after a dead end is a dead end, so all of it is made now.
        let mut next = self.graph.nodes.len();
        let look_every = states_between_looks(BETWEEN_LOOKS, self.graph.dimension()) as usize;
        self.graph.go_on_in_dead_ends()?;
        self.adopt_new_nodes();
        while let Some(node) = self.graph.nodes.get(next) {
            if !node.is_expanded && !self.is_decided(next as u32) {
                self.graph.expand(next as u32)?;
                self.adopt_new_nodes();
            }
            next += 1;
            if next.is_multiple_of(look_every)
                && let Some(reason) = self.look(watch)
            {
                return Ok(Some(reason));
            }
        }
        Ok(None)
    }
}

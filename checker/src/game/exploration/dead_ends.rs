//! What follows after dead ends ([`crate::game::forward::dead_ends`]), where a strategy must say
//! what to do there too.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch, states_between_checks};

use crate::game::solver::Solver;

/// The greatest number of expanded nodes between two checks of the limits.
const BETWEEN_LOOKS: u64 = 64;

impl Solver<'_, '_, '_> {
    /// Explores what follows after dead ends if the evader has won, because its strategy says what
    /// to do there too.
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
        // Everything after a dead end is a dead end, so all of it is made now.
        let mut next = self.graph.nodes.len();
        let look_every = states_between_checks(BETWEEN_LOOKS, self.graph.dimension()) as usize;
        for (count, node) in self.graph.take_dead_ends()?.into_iter().enumerate() {
            self.graph.expand(node)?;
            self.adopt_new_nodes();
            if (count + 1).is_multiple_of(look_every)
                && let Some(reason) = self.look(watch)
            {
                return Ok(Some(reason));
            }
        }
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

//! The one node that stands for all dead ends: its edges, and how to undo it.

use crate::network::Failure;
use crate::zones::Zone;

use super::clock_programs::ProgramId;
use super::dead_ends::DeadEnds;
use super::graph::Graph;
use super::node::{Origin, Standing};

impl Graph<'_, '_> {
    /// Adds an edge of `length` moves to the node of all dead ends.
    pub(super) fn end_dead(
        &mut self,
        words: &[i32],
        program: ProgramId,
        origin: Origin,
        length: u32,
    ) {
        let node = self.dead_ends.node.unwrap_or_else(|| {
            let zone = Zone::universe(self.dimension());
            let id = self.zones.intern(zone.bounds());
            let discrete = self.discrete_of(words);
            self.push_node(discrete, id, Standing::Dead)
        });
        self.dead_ends.node = Some(node);
        self.link(origin, node, program, length, false);
    }

    /// Undoes that dead ends are left out: returns the nodes that lead to one, which are to be
    /// expanded again.
    pub(in crate::game) fn take_dead_ends(&mut self) -> Result<Vec<u32>, Failure> {
        let DeadEnds { node, .. } = std::mem::take(&mut self.dead_ends);
        let edges = node.into_iter().flat_map(|node| self.edges_into(node));
        let mut sources: Vec<u32> = edges.map(|edge| edge.source).collect();
        // The edges of a node into the same target are successive.
        sources.dedup();
        if self.nodes[0].standing == Standing::Dead {
            self.reevaluate(0)?;
            sources.push(0);
        }
        Ok(sources)
    }
}

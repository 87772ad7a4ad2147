//! The entry of a move, as strategies name it.

use super::program::Instance;
use super::restriction::Entry;
use crate::ir::Network;

/// The edge of an instance with the number of its values; of a leg that is an edge, the first leg
/// of its entry, as [`crate::network::entry_of`] names it.
pub(super) fn entry(network: &Network, instance: &Instance<'_>) -> Entry {
    let edge = instance.edge;
    let bindings = edge
        .leg
        .as_ref()
        .map_or(edge.select.len(), |leg| leg.bindings);
    let select = edge.select[..bindings].iter().zip(&instance.values);
    let select = select.fold(0, |number, (range, value)| {
        number * (range.high - range.low + 1) as u32 + (value - range.low) as u32
    });
    let edges = &network.processes[instance.process as usize].edges;
    let first = edge.leg.as_ref().map_or(instance.id, |leg| leg.first);
    let leg = edges[first.0 as usize].leg.as_ref();
    Entry {
        process: instance.process,
        edge: first.0,
        select: select * leg.map_or(1, |leg| leg.combinations),
    }
}

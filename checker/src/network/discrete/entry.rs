//! The *entry* of a move: what is chosen of it, where the rest is chance.
//!
//! The edge to a branch point is chosen, the leg is not. So the entry of a move is its edges with
//! their `select` values, without the branches, and of a leg that is an edge ([`crate::ir::Leg`])
//! with those of its entry only. Where the leg of the sender synchronises, and not its entry, who
//! receives is chance too: then the entry is the sender's alone.

use crate::ir::Network;

use super::transition::Part;

/// The parts of a move that name its entry: first branches, of the first leg.
pub fn entry_of(network: &Network, parts: &[Part]) -> Vec<Part> {
    named(network, parts).collect()
}

/// Whether two moves have the same entry.
pub fn is_same_entry(network: &Network, one: &[Part], other: &[Part]) -> bool {
    if network.features.legs {
        return named(network, one).eq(named(network, other));
    }
    let key = |part: &Part| (part.process, part.edge, part.select);
    one.len() == other.len() && one.iter().map(key).eq(other.iter().map(key))
}

fn named<'p>(network: &'p Network, parts: &'p [Part]) -> impl Iterator<Item = Part> + 'p {
    let edges = |part: &Part| &network.processes[part.process as usize].edges;
    let leg = move |part: &Part| edges(part)[part.edge as usize].leg.as_ref();
    let is_alone = parts
        .first()
        .and_then(leg)
        .is_some_and(|leg| !leg.follows_sync);
    let named = if is_alone { &parts[..1] } else { parts };
    named.iter().map(move |part| {
        let Some(own) = leg(part) else {
            return Part { branch: 0, ..*part };
        };
        let first = edges(part)[own.first.0 as usize].leg.as_ref();
        let combinations = first.map_or(1, |leg| leg.combinations);
        Part {
            process: part.process,
            edge: own.first.0,
            branch: 0,
            select: part.select / own.combinations * combinations,
        }
    })
}

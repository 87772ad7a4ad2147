//! The edges of a network, sorted by the questions that every state asks.

use crate::ir::{Edge, Guard, Location, Process, Urgency};

use super::selects::select_count;

/// An edge with the facts that are needed most.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeEntry<'a> {
    pub(super) index: u32,
    /// How many combinations of select values it has.
    pub(super) instances: u32,
    pub(super) edge: &'a Edge,
}

/// The edges that leave a location, sorted by the events that they need.
#[derive(Debug)]
pub(super) struct LocationTable<'a> {
    pub(super) internal: Vec<EdgeEntry<'a>>,
    pub(super) sends: Vec<EdgeEntry<'a>>,
    pub(super) receives: Vec<EdgeEntry<'a>>,
    pub(super) urgency: Urgency,
    /// Its invariant, if there is one.
    pub(super) invariant: Option<&'a Guard>,
}

impl<'a> LocationTable<'a> {
    pub(super) fn new(process: &'a Process, location: &'a Location) -> LocationTable<'a> {
        let urgency = location.urgency;
        let (internal, sends, receives) = (Vec::new(), Vec::new(), Vec::new());
        let mut table = LocationTable {
            internal,
            sends,
            receives,
            urgency,
            invariant: Some(&location.invariant).filter(|invariant| !invariant.is_trivial()),
        };
        for index in &location.edges {
            let edge = &process.edges[index.0 as usize];
            let entry = EdgeEntry {
                index: index.0,
                instances: select_count(edge),
                edge,
            };
            match edge.sync {
                None => table.internal.push(entry),
                Some(sync) if sync.send => table.sends.push(entry),
                Some(_) => table.receives.push(entry),
            }
        }
        table
    }

    pub(super) fn is_committed(&self) -> bool {
        self.urgency == Urgency::Committed
    }
}

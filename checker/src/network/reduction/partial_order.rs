//! Facts about a network that a search with partial-order reduction needs; see
//! [`super::stubborn_sets`].

use std::sync::Arc;

use crate::analysis::dependence::greatest_values;
use crate::analysis::visibility::Watched;
use crate::analysis::zero_time_cycles::recurrent_edges;
use crate::ir::{Network, Predicate, Urgency};
use crate::tuning::Tuning;

use super::time_stoppers::Holders;

/// Networks with more locations are not reduced: the tables grow with the square of this number.
const MOST_LOCATIONS: usize = 2048;

/// What a search needs for the reduction; its threads share it.
#[derive(Debug)]
pub struct PartialOrder {
    pub(super) watched: Watched,
    /// For each clock: the greatest value that it is set to.
    pub(super) greatest: Vec<i32>,
    /// For each process and edge: whether it may be taken again and again while time stands still.
    pub(super) recurrent: Vec<Vec<bool>>,
    pub(super) holders: Holders,
}

impl PartialOrder {
    /// What a search for a state with the predicate needs for the reduction. `None` if nothing can
    /// be gained, or if the reduction is not known to be sound.
    pub fn new(network: &Network, goal: &Predicate, tuning: Tuning) -> Option<Arc<PartialOrder>> {
        let locations: usize = network
            .processes
            .iter()
            .map(|process| process.locations.len())
            .sum();
        let holders = Holders::new(network, tuning);
        let may_commit = network.processes.iter().filter(|process| {
            let mut locations = process.locations.iter();
            locations.any(|location| location.urgency == Urgency::Committed)
        });
        // In a committed state every move needs a committed process.
        let may_gain =
            network.processes.len() > 1 && (holders.are_possible() || may_commit.count() > 1);
        let is_known = !network.features.priorities
            && network.before_update.is_none()
            && network.after_update.is_none()
            && locations <= MOST_LOCATIONS;
        if !may_gain || !is_known {
            return None;
        }
        let watched = Watched::new(network, goal)?;
        let greatest = greatest_values(network);
        Some(Arc::new(PartialOrder {
            watched,
            recurrent: if tuning.zero_time_cycles {
                recurrent_edges(network, &greatest)
            } else {
                let processes = network.processes.iter();
                processes.map(|one| vec![true; one.edges.len()]).collect()
            },
            greatest,
            holders,
        }))
    }
}

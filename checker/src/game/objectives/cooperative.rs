//! Games in which both players cooperate first: `E<> control: …`.
//!
//! The graph is explored everywhere, even where a player has won, and without chains, so that every
//! state is a node. If the controller wins from some state, its strategy begins there, and a search
//! finds the path to it. If it wins nowhere, the environment has a strategy from everywhere.

use crate::network::{Failure, Symbolic};
use crate::search::StateStore;
use crate::search::reachability::goal::Goal;
use crate::zones::{Federation, Zone};

use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::solver::Solver;

/// Where the controller wins, by words; a search for such a state ends at the first one.
#[derive(Debug)]
pub struct Winning {
    store: StateStore,
    /// For each state of the store: the nodes with its words, and what is won of them.
    parts: Vec<Vec<(u32, Federation)>>,
}

impl Winning {
    /// What the controller wins in a solved game.
    pub fn of(solver: &Solver<'_, '_, '_>) -> Winning {
        let network = solver.graph.symbolic.stepper.network();
        let mut winning = Winning {
            store: StateStore::new(network),
            parts: Vec::new(),
        };
        let mut words = network.initial.clone();
        for node in 0..solver.graph.nodes.len() as u32 {
            let win = match solver.seeker {
                Player::Controller => solver.won.win[node as usize].clone(),
                Player::Environment => solver.won.lost(node),
            };
            if matches!(win, Win::Nothing) {
                continue;
            }
            solver.graph.load(node, &mut words);
            let (id, is_new) = winning.store.intern(&words);
            if is_new {
                winning.parts.push(Vec::new());
            }
            winning.parts[id.0 as usize].push((node, solver.federation_of(node, &win)));
        }
        winning
    }

    /// What is won of the nodes with these words.
    fn parts(&self, words: &[i32]) -> &[(u32, Federation)] {
        match self.store.find(words) {
            Some(id) => &self.parts[id.0 as usize],
            None => &[],
        }
    }

    /// A zone of the won part of a state.
    pub fn zone_in(&self, words: &[i32], zone: &Zone) -> Option<Zone> {
        let mut parts = self.parts(words).iter();
        parts.find_map(|(_, won)| {
            let mut part = won.clone();
            part.intersect_zone(zone.bounds());
            part.to_zones().next()
        })
    }

    /// The node in which this valuation is won; values are in ticks.
    pub fn node(&self, words: &[i32], clocks: &[i64], ticks_per_unit: i64) -> Option<u32> {
        let mut parts = self.parts(words).iter();
        let found = parts.find(|(_, won)| won.contains(clocks, ticks_per_unit));
        found.map(|(node, _)| *node)
    }
}

impl Goal for Winning {
    fn confirms(
        &mut self,
        _: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        Ok(self.zone_in(words, zone).is_some())
    }
}

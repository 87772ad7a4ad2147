//! Where time stops, and which player must move there.

use crate::network::{Failure, Symbolic};
use crate::zones::{Bound, Federation};

use super::predecessors::Situation;
use crate::game::solver::Solver;
use crate::game::{Forced, Player};

impl Solver<'_, '_, '_> {
    /// The valuations in which time stops, and the environment has a move and must take one. The
    /// valuations that are bad for the controller are left out.
    pub(super) fn forced_environment(
        &self,
        node: u32,
        bad: &Federation,
        situation: &Situation,
    ) -> Federation {
        let opponent = self.enabled_moves(node, Player::Environment);
        if opponent.is_empty() {
            return opponent;
        }
        let mut all = Federation::empty(self.graph.dimension());
        for (component, stop) in &situation.stops {
            let mut stop = stop.intersection(&opponent).minus(bad);
            for (mover, edge) in &situation.movers {
                let blocks = match (self.forced, *component) {
                    (Forced::Neutral, _) => false,
                    (Forced::Tiga, Some(component)) => mover.contains(&component),
                    (Forced::Product, _) | (Forced::Tiga, None) => true,
                };
                if blocks {
                    stop.subtract(&self.enabled(&self.graph.edges[*edge]));
                }
            }
            all.unite(&stop);
        }
        if let Some(urgent) = self.graph.urgent(node) {
            all.subtract(&urgent.obliged);
        }
        all
    }

    /// The valuations in which the controller must move: where it is obliged to, and where time
    /// stops, it has a move, and the environment need not move.
    pub(in crate::game) fn forced_controller(
        &self,
        node: u32,
        situation: &Situation,
    ) -> Federation {
        let mut forced = self.enabled_moves(node, Player::Controller);
        if !forced.is_empty() {
            forced = forced.intersection(&self.standstill(situation));
        }
        if !forced.is_empty() {
            let nothing = Federation::empty(self.graph.dimension());
            let others = self.forced_environment(node, &nothing, situation);
            forced.subtract(&others);
        }
        if let Some(urgent) = self.graph.urgent(node) {
            forced.unite(&urgent.obliged.intersection(&urgent.reached));
        }
        forced
    }

    /// Whether the controller is obliged to move somewhere in a node.
    pub(super) fn is_obliged(&self, node: u32) -> bool {
        let urgent = self.graph.urgent(node);
        urgent.is_some_and(|urgent| !urgent.obliged.is_empty())
    }

    /// The valuations of a node in which time cannot pass.
    pub(in crate::game) fn standstill(&self, situation: &Situation) -> Federation {
        let mut all = Federation::empty(self.graph.dimension());
        for (_, stop) in &situation.stops {
            all.unite(stop);
        }
        all
    }

    /// The valuations of a node in which a player has a move.
    pub(super) fn enabled_moves(&self, node: u32, player: Player) -> Federation {
        let mut enabled = Federation::empty(self.graph.dimension());
        let edges = self.graph.edges_from(node).iter();
        for edge in edges.filter(|edge| player.owns(edge.controllable)) {
            enabled.unite(&self.enabled(edge));
        }
        enabled
    }

    /// The valuations in which time cannot pass, with the process that stops it (`None`: an urgent
    /// channel).
    pub(super) fn stops(
        &mut self,
        node: u32,
        words: &mut [i32],
    ) -> Result<Vec<(Option<u32>, Federation)>, Failure> {
        let delays = self.graph.nodes[node as usize].delays;
        let whole = self.whole(node);
        let zone = self.graph.zone(node).to_vec();
        let mut stops = stops(self.graph.symbolic, words, &zone, &whole, delays)?;
        if let Some(urgent) = self.graph.urgent(node) {
            stops.push((None, urgent.standstill()));
        }
        Ok(stops)
    }

    /// The controllable edges of a node, each with the processes that take part in its first move.
    /// None if they do not matter: the environment has no move there, or must move whatever the
    /// controller can do.
    pub(super) fn controllable_movers(
        &mut self,
        node: u32,
        words: &mut [i32],
    ) -> Result<Vec<(Vec<u32>, usize)>, Failure> {
        let mut has_owner = [false; 2];
        for edge in self.graph.edges_from(node) {
            has_owner[usize::from(edge.controllable)] = true;
        }
        if has_owner != [true; 2] || self.forced == Forced::Neutral {
            return Ok(Vec::new());
        }
        let mut moves = crate::network::Moves::default();
        self.graph.symbolic.remembered_moves(words, &mut moves)?;
        let edges = self
            .graph
            .edges_of(node)
            .filter(|&index| self.graph.edges[index].controllable);
        Ok(edges
            .map(|index| {
                let parts = moves.get(self.graph.edges[index].ordinal as usize).parts;
                (parts.iter().map(|part| part.process).collect(), index)
            })
            .collect())
    }
}

/// The valuations of a state in which time cannot pass, with the process that stops it (`None`: an
/// urgent channel without clock guards). `whole` is the relevant part of the state's zone, and
/// `delays` says whether locations and such channels allow time to pass.
pub(in crate::game) fn stops(
    symbolic: &mut Symbolic<'_>,
    words: &mut [i32],
    zone: &[Bound],
    whole: &Federation,
    delays: bool,
) -> Result<Vec<(Option<u32>, Federation)>, Failure> {
    let dimension = symbolic.dimension();
    let network = symbolic.stepper.network();
    let mut stops = Vec::new();
    for (index, process) in network.processes.iter().enumerate() {
        let urgency = process.locations[words[index] as usize].urgency;
        if urgency != crate::ir::Urgency::Normal {
            stops.push((Some(index as u32), whole.clone()));
        }
    }
    if stops.is_empty() && !delays {
        stops.push((None, whole.clone()));
    }
    let stopped = symbolic.stopped(words)?;
    for (process, bound) in symbolic.upper_bounds(words)? {
        let mut faces = Federation::empty(dimension);
        faces.add_upper_faces(zone, &[bound], &stopped);
        stops.push((Some(process), faces));
    }
    Ok(stops)
}

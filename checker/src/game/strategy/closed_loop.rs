//! The closed loop: a network in which one player follows a strategy.
//!
//! A strategy becomes a [`Restriction`] of the network, so that any search explores only the closed
//! loop. In each valuation the decisions that count are allowed: a wait lets time pass, and a move
//! is possible. All other moves of the player are forbidden, and time stops if waiting is not
//! allowed. Where a strategy has no decision, and where play has ended, everything is allowed. So
//! the closed loop contains every run of every player that follows the strategy.

use std::sync::Arc;

use crate::cancellation;
use crate::ir::{ClockAtom, ClockId, FixedConstraint, Network};
use crate::network::{Allowed, Part, Restriction, is_same_entry};
use crate::search::StateStore;
use crate::zones::future::Barriers;
use crate::zones::{Bound, Federation};

use super::{Decision, Selection, Strategy};
use crate::game::Player;

/// A strategy as a restriction.
#[derive(Debug)]
pub struct ClosedLoop {
    owner: Player,
    store: StateStore,
    /// For each state of the store; `None` where play has ended.
    states: Vec<Option<Arc<Allowed>>>,
    atoms: Vec<ClockAtom>,
}

impl ClosedLoop {
    /// The restriction of its network for a strategy. The network must have the clock that measures
    /// time if the strategy uses it.
    pub fn new(network: &Network, strategy: &Strategy) -> ClosedLoop {
        let mut store = StateStore::new(network);
        let mut atoms = Vec::new();
        let mut states = Vec::new();
        for one in joined(network, strategy) {
            store.intern(one.words);
            for decision in one.decisions.iter().chain(&one.legs) {
                collect_atoms(&decision.zones, &mut atoms);
            }
            let allowed = || allowed(network, &one, strategy.owner, strategy.selection);
            states.push((!one.is_goal).then(|| Arc::new(allowed())));
        }
        atoms.sort_by_key(|one| (one.left.first, one.right.first, one.low, one.strict));
        atoms.dedup();
        ClosedLoop {
            owner: strategy.owner,
            store,
            states,
            atoms,
        }
    }
}

impl Restriction for ClosedLoop {
    fn allowed(&self, words: &[i32]) -> Option<Arc<Allowed>> {
        let id = self.store.find(words)?;
        self.states[id.0 as usize].clone()
    }

    fn owns(&self, controllable: bool) -> bool {
        self.owner.owns(controllable)
    }

    fn atoms(&self) -> &[ClockAtom] {
        &self.atoms
    }
}

/// What a strategy says about the states with some words.
#[derive(Debug)]
pub struct Joined<'s> {
    /// The words.
    pub words: &'s [i32],
    /// Whether play has ended.
    pub is_goal: bool,
    /// The decisions, in the order in which they apply.
    pub decisions: Vec<&'s Decision>,
    /// The legs that are picked, in the order in which they apply.
    pub legs: Vec<&'s Decision>,
}

/// What it takes to find a state among others, without its words: see [`cancellation::work`].
const UNITS_FOR_STATE: usize = 256;

/// A strategy by words.
pub fn joined<'s>(network: &Network, strategy: &'s Strategy) -> Vec<Joined<'s>> {
    let mut store = StateStore::new(network);
    let mut joined: Vec<Joined<'_>> = Vec::new();
    for state in &strategy.states {
        cancellation::work(UNITS_FOR_STATE + state.words.len());
        let (id, is_new) = store.intern(&state.words);
        if is_new {
            joined.push(Joined {
                words: &state.words,
                is_goal: true,
                decisions: Vec::new(),
                legs: Vec::new(),
            });
        }
        let entry = &mut joined[id.0 as usize];
        // Where the goal depends on clocks, only some of the states with these words are in it.
        entry.is_goal &= state.is_goal;
        entry.decisions.extend(&state.decisions);
        entry.legs.extend(&state.legs);
    }
    for one in &mut joined {
        one.decisions.sort_by_key(|decision| decision.rank);
        one.legs.sort_by_key(|leg| leg.rank);
    }
    joined
}

/// For each leg, the part in which it is picked: among those with the same entry, the first counts.
pub fn picked<'d>(network: &Network, legs: &[&'d Decision]) -> Vec<(&'d [Part], Federation)> {
    let dimension = network.clocks.len().max(1);
    let mut picked: Vec<(&[Part], Federation)> = Vec::new();
    for leg in legs {
        let parts = leg.action.as_deref().unwrap_or_default();
        let mut part = leg.zones.clone();
        let before = picked
            .iter()
            .filter(|one| is_same_entry(network, one.0, parts));
        let before = before.fold(Federation::empty(dimension), |mut all, one| {
            all.unite(&one.1);
            all
        });
        part.subtract(&before);
        part.reduce();
        match picked.iter_mut().find(|one| one.0 == parts) {
            Some(one) => _ = one.1.unite(&part),
            None => picked.push((parts, part)),
        }
    }
    picked.retain(|one| !one.1.is_empty());
    picked
}

/// The parts of the decisions in which they count.
pub fn counting<'d>(
    decisions: &[&'d Decision],
    selection: Selection,
    dimension: usize,
) -> Vec<(&'d Decision, Federation)> {
    let mut decided = Federation::empty(dimension);
    let parts = decisions.iter().map(|&decision| {
        let mut part = decision.zones.clone();
        if selection == Selection::First {
            part.subtract(&decided);
            part.reduce();
            decided.unite(&decision.zones);
        }
        (decision, part)
    });
    parts.collect()
}

/// What is allowed in the states with some words, by what a strategy says about them.
pub fn allowed(
    network: &Network,
    joined: &Joined<'_>,
    owner: Player,
    selection: Selection,
) -> Allowed {
    let dimension = network.clocks.len().max(1);
    let counting = counting(&joined.decisions, selection, dimension);
    let mut decided = Federation::empty(dimension);
    let mut waiting = Federation::empty(dimension);
    for (decision, part) in &counting {
        decided.unite(part);
        if decision.action.is_none() {
            waiting.unite(part);
        }
    }
    let mut barriers = Barriers::none(dimension);
    let mut moves: Vec<(Vec<Part>, Federation)> = Vec::new();
    for (decision, part) in counting {
        let Some(parts) = &decision.action else {
            continue;
        };
        // A move of the controller is known by its entry, which may have two names.
        let is_it = |one: &[Part]| match owner {
            Player::Controller => is_same_entry(network, one, parts),
            Player::Environment => one == parts,
        };
        match moves.iter_mut().find(|one| is_it(&one.0)) {
            Some(one) => _ = one.1.unite(&part),
            None => moves.push((parts.clone(), part.clone())),
        }
        let stop = part.minus(&waiting);
        barriers.stops.unite(&stop);
        if stop.zones().any(|zone| has_open_side(zone, dimension)) {
            barriers.open.push(stop);
        }
    }
    decided.reduce();
    let forbidden = moves.into_iter().map(|(parts, here)| {
        let mut forbidden = decided.clone().minus(&here);
        forbidden.reduce();
        (parts, forbidden)
    });
    let legs = picked(network, &joined.legs).into_iter();
    let legs = legs.map(|(parts, here)| (parts.to_vec(), here));
    Allowed {
        barriers,
        forbidden: forbidden.collect(),
        others: decided,
        legs: legs.collect(),
    }
}

/// Whether time may run into the zone without a first moment, because it has a strict lower bound.
fn has_open_side(zone: &[Bound], dimension: usize) -> bool {
    zone[1..dimension].iter().any(|bound| bound.is_strict())
}

/// Adds the comparisons that distinguish the zones from the rest, in both directions. Comparisons
/// of two clocks that follow from those of each with a constant are left out.
fn collect_atoms(zones: &Federation, atoms: &mut Vec<ClockAtom>) {
    let dimension = zones.dimension();
    for zone in zones.zones() {
        for left in 0..dimension {
            for right in 0..dimension {
                let bound = zone[left * dimension + right];
                let follows =
                    left != 0 && right != 0 && zone[left * dimension] + zone[right] <= bound;
                if left == right || bound.is_infinite() || follows {
                    continue;
                }
                atoms.push(atom(left, right, bound));
                atoms.push(atom(right, left, bound.negated()));
            }
        }
    }
}

fn atom(left: usize, right: usize, bound: Bound) -> ClockAtom {
    ClockAtom::from(FixedConstraint {
        left: ClockId(left as u32),
        right: ClockId(right as u32),
        bound: bound.value(),
        strict: bound.is_strict(),
    })
}

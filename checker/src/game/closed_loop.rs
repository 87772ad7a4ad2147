//! The closed loop: a network one of whose players follows a strategy.
//!
//! A strategy becomes a [`Restriction`] of the network, so that any search runs over what is left. In each valuation the
//! decisions that count are allowed: to wait lets time pass, a move is possible; all other moves of the player are forbidden, and
//! time stops if waiting is not allowed. Where a strategy has no decision, and where play has ended, it says nothing, and
//! everything is allowed. So the closed loop holds every run of every player that follows the strategy.

use crate::ir::{ClockAtom, ClockId, ClockRange, Network};
use crate::network::{Allowed, Part, Restriction};
use crate::search::StateStore;
use crate::zones::future::Barriers;
use crate::zones::{Bound, Federation};

use super::Player;
use super::strategy::{Decision, Selection, Strategy};

/// A strategy as a restriction.
#[derive(Debug)]
pub struct ClosedLoop {
    owner: Player,
    store: StateStore,
    /// By state of the store; `None` where play has ended.
    states: Vec<Option<Allowed>>,
    atoms: Vec<ClockAtom>,
}

impl ClosedLoop {
    /// The restriction that a strategy is of its network, which has the clock that measures time if the strategy looks at it.
    pub fn new(network: &Network, strategy: &Strategy) -> ClosedLoop {
        let dimension = network.clocks.len().max(1);
        let mut store = StateStore::new(network);
        let mut atoms = Vec::new();
        let mut states = Vec::new();
        for (words, is_goal, decisions) in joined(network, strategy) {
            store.intern(words);
            for decision in &decisions {
                collect_atoms(&decision.zones, &mut atoms);
            }
            states.push((!is_goal).then(|| allowed(&decisions, strategy.selection, dimension)));
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
    fn allowed(&self, words: &[i32]) -> Option<&Allowed> {
        let id = self.store.find(words)?;
        self.states[id.0 as usize].as_ref()
    }

    fn owns(&self, controllable: bool) -> bool {
        self.owner.owns(controllable)
    }

    fn atoms(&self) -> &[ClockAtom] {
        &self.atoms
    }
}

/// The decisions of a strategy by words, in the order in which they apply, with whether play has ended.
pub fn joined<'s>(
    network: &Network,
    strategy: &'s Strategy,
) -> Vec<(&'s [i32], bool, Vec<&'s Decision>)> {
    let mut store = StateStore::new(network);
    let mut joined: Vec<(&[i32], bool, Vec<&Decision>)> = Vec::new();
    for state in &strategy.states {
        let (id, is_new) = store.intern(&state.words);
        if is_new {
            joined.push((&state.words, true, Vec::new()));
        }
        let entry = &mut joined[id.0 as usize];
        // Where the goal depends on clocks, only some of the states with these words are in it.
        entry.1 &= state.is_goal;
        entry.2.extend(&state.decisions);
    }
    for (_, _, decisions) in &mut joined {
        decisions.sort_by_key(|decision| decision.rank);
    }
    joined
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

fn allowed(decisions: &[&Decision], selection: Selection, dimension: usize) -> Allowed {
    let counting = counting(decisions, selection, dimension);
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
        match moves.iter_mut().find(|one| &one.0 == parts) {
            Some(one) => _ = one.1.unite(&part),
            None => moves.push((parts.clone(), part.clone())),
        }
        let mut stop = part;
        stop.subtract(&waiting);
        barriers.stops.unite(&stop);
        if stop.zones().any(|zone| has_open_side(zone, dimension)) {
            barriers.open.push(stop);
        }
    }
    decided.reduce();
    let forbidden = moves.into_iter().map(|(parts, here)| {
        let mut forbidden = decided.clone();
        forbidden.subtract(&here);
        forbidden.reduce();
        (parts, forbidden)
    });
    Allowed {
        barriers,
        forbidden: forbidden.collect(),
        others: decided,
    }
}

/// Whether time may run into the zone without a first moment: it has a strict lower bound.
fn has_open_side(zone: &[Bound], dimension: usize) -> bool {
    zone[1..dimension].iter().any(|bound| bound.is_strict())
}

/// Adds the comparisons that tell the zones from the rest, in both directions. Comparisons of two clocks that follow from those of
/// each with a constant are left out.
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
    let clock = |index: usize| ClockRange {
        first: ClockId(index as u32),
        count: 1,
    };
    ClockAtom {
        left: clock(left),
        right: clock(right),
        low: bound.value(),
        high: bound.value(),
        strict: bound.is_strict(),
    }
}

//! Strategies as tables: of each discrete state, one rule for each thing that is done in it.
//!
//! A strategy lists decisions by rank, and which counts may depend on their order. In a table the
//! order says nothing: each rule has the clock values for which it counts, in as few and as large
//! zones as are found. So it is shorter than the strategy, and reads line by line.

use crate::game::strategy::Strategy;
use crate::game::strategy::closed_loop;
use crate::ir::Network;
use crate::network::Part;
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Federation, Zone, minimal};

/// Zones of a rule up to which they are made larger; the effort grows with the square of their
/// number.
const MOST_GROWN_ZONES: usize = 64;

/// Something that is done, and where.
#[derive(Clone, Debug)]
pub struct Rule {
    /// The move to take; `None` is to wait.
    pub action: Option<Vec<Part>>,
    /// The clock values for which it is taken. The zones may overlap.
    pub zones: Federation,
}

/// What is done in a discrete state.
#[derive(Clone, Debug)]
pub struct StateRules<'s> {
    /// The words.
    pub words: &'s [i32],
    /// Whether play has ended here, won, whatever the clocks say.
    pub is_goal: bool,
    /// What is done: waiting first, then moves in the order of their ranks. Of a strategy of which
    /// the first decision counts, rules have no clock values in common.
    pub rules: Vec<Rule>,
    /// If the strategy is the environment's: the legs that it picks, in no particular order; those
    /// of one entry have no clock values in common.
    pub legs: Vec<Rule>,
}

/// The table of a strategy of this network, which has the clock that measures time if the strategy
/// looks at it: the states about which it says something, in its order.
pub fn entries<'s>(network: &Network, strategy: &'s Strategy) -> Vec<StateRules<'s>> {
    let dimension = network.clocks.len().max(1);
    let joined = closed_loop::joined(network, strategy).into_iter();
    let entries = joined.map(|joined| {
        let (words, is_goal) = (joined.words, joined.is_goal);
        let mut rules: Vec<Rule> = Vec::new();
        let counting = closed_loop::counting(&joined.decisions, strategy.selection, dimension);
        let counting = if is_goal { Vec::new() } else { counting };
        for (decision, part) in counting {
            match rules.iter_mut().find(|one| one.action == decision.action) {
                Some(rule) => _ = rule.zones.unite(&part),
                None => rules.push(Rule {
                    action: decision.action.clone(),
                    zones: part,
                }),
            }
        }
        rules.retain(|rule| !rule.zones.is_empty());
        rules.sort_by_key(|rule| rule.action.is_some());
        for rule in &mut rules {
            simplify(&mut rule.zones);
        }
        let picked = closed_loop::picked(network, &joined.legs).into_iter();
        let legs = picked.filter(|_| !is_goal).map(|(parts, mut zones)| {
            simplify(&mut zones);
            Rule {
                action: Some(parts.to_vec()),
                zones,
            }
        });
        StateRules {
            words,
            is_goal,
            rules,
            legs: legs.collect(),
        }
    });
    entries
        .filter(|entry| entry.is_goal || !entry.rules.is_empty() || !entry.legs.is_empty())
        .collect()
}

/// Describes the same set by fewer and larger zones.
fn simplify(federation: &mut Federation) {
    federation.reduce();
    let whole = federation.clone();
    if whole.zone_count() > 1 {
        simplify_inside(federation, &whole);
    }
}

/// Describes a set by fewer and larger zones, which may reach into another set.
pub fn simplify_within(federation: &mut Federation, other: &Federation) {
    let mut whole = federation.clone();
    whole.unite(other);
    simplify_inside(federation, &whole);
}

fn simplify_inside(federation: &mut Federation, whole: &Federation) {
    if whole.zone_count() > MOST_GROWN_ZONES {
        return;
    }
    let mut grown = Federation::empty(whole.dimension());
    for zone in federation.zones() {
        grown.add(&grow(zone, whole));
    }
    grown.reduce();
    *federation = grown;
}

/// A zone inside the federation that contains this one and has no constraint that could be left
/// out.
fn grow(zone: &[Bound], whole: &Federation) -> Vec<Bound> {
    let dimension = whole.dimension();
    let mut constraints: Vec<Constraint> = Vec::new();
    minimal::for_each_minimal(zone, dimension, |one| constraints.push(one));
    let mut grown = zone.to_vec();
    let mut index = 0;
    while index < constraints.len() {
        let mut fewer = constraints.clone();
        fewer.remove(index);
        let larger = Zone::of_constraints(dimension, &fewer);
        if whole.includes_zone(larger.bounds()) {
            constraints = fewer;
            grown = larger.bounds().to_vec();
        } else {
            index += 1;
        }
    }
    grown
}

//! What a strategy says about the states with some words, on sets of clock values.
//!
//! The states are cut into *pieces*: where play is over, and where a decision of the strategy
//! applies. A state belongs to the first piece that contains it, or, if the strategy is permissive
//! and play is not over, to all of them. So the pieces need not be disjoint, and each is as simple
//! as it was written.

use std::mem::size_of_val;

use crate::exec::EmittedAssignment;
use crate::ir::{Network, Predicate, Urgency};

use super::moves::{Error, Part, is_same_entry};
use super::rules::{Aim, Decision, Decisions, Forcing, Owner, Rules};
use super::symbolic::{
    Possible, Symbolic, by_priority, guarded, within_all, without_all, without_conjunctions,
};
use super::zone::{Comparison, Zone};

/// Comparisons that all hold, within the invariants.
pub(super) type Conjunction = Box<[Comparison]>;

/// What is done in a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Play is over.
    Over,
    /// The owner makes the move of the decision with this index.
    Acts(usize),
    /// The owner makes one of the moves that its machine proposes at the stage.
    Proposes,
    /// The owner waits.
    Waits,
    /// The machine sees something else, and comes to this stage.
    Turns(u32),
    /// All moves are possible, and time passes where it can: no strategy is followed.
    Anything,
}

/// The states of a piece that are not known to be won.
#[derive(Clone, Debug)]
pub(super) enum Rest {
    Nothing,
    Everything,
    Parts(Vec<Zone>),
}

impl Rest {
    pub(super) fn of(parts: Vec<Zone>) -> Rest {
        if parts.is_empty() {
            Rest::Nothing
        } else {
            Rest::Parts(parts)
        }
    }
}

/// A part of the states with some words.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) rank: u32,
    pub(super) zones: Vec<Conjunction>,
    pub(super) kind: Kind,
    /// What is not known to be won.
    pub(super) rest: Rest,
    /// The same for what comes after a goal that is to recur.
    pub(super) outer: Rest,
}

impl Piece {
    /// One of the first rank.
    pub(super) fn new(kind: Kind, zones: Vec<Conjunction>, rest: &Rest, outer: &Rest) -> Piece {
        Piece {
            rank: 0,
            zones,
            kind,
            rest: rest.clone(),
            outer: outer.clone(),
        }
    }
}

/// Where a move leads to.
#[derive(Debug)]
pub(super) enum Target {
    /// To these words; nothing has led to the move yet.
    Words(Box<[i32]>),
    /// To the place with this index.
    Place(u32),
}

/// A move that is possible somewhere.
#[derive(Debug)]
pub(super) struct Move {
    pub(super) parts: Box<[Part]>,
    pub(super) channel: Option<u32>,
    pub(super) controllable: bool,
    /// Where it is possible.
    pub(super) enabled: Vec<Conjunction>,
    pub(super) assignments: Box<[EmittedAssignment]>,
    pub(super) target: Target,
}

/// The states with some words.
pub(super) struct Place<'a> {
    /// The stage of the machine; 0 if none is followed.
    pub(super) stage: u32,
    pub(super) words: Box<[i32]>,
    pub(super) invariant: Conjunction,
    pub(super) decisions: Option<&'a Decisions>,
    pub(super) pieces: Vec<Piece>,
    pub(super) moves: Vec<Move>,
    /// Where the goal holds that is to recur.
    pub(super) goal: Vec<Conjunction>,
    /// Whether locations stop time.
    pub(super) is_urgent: bool,
    /// Where time is stopped otherwise.
    pub(super) stops: Vec<Conjunction>,
    /// The processes that stop time by an urgent location, or where a bound of their invariant is
    /// reached, with the place of that.
    stoppers: Vec<(u32, Conjunction)>,
    /// Where urgent synchronisations are possible.
    urgent: Vec<Conjunction>,
    /// Where the controller is not allowed to wait.
    obliged: Vec<Conjunction>,
}

impl<'a> Place<'a> {
    /// A place nothing is known of.
    pub(super) fn unknown(words: Box<[i32]>) -> Place<'a> {
        Place {
            stage: 0,
            words,
            invariant: Box::default(),
            decisions: None,
            pieces: Vec::new(),
            moves: Vec::new(),
            goal: Vec::new(),
            is_urgent: false,
            stops: Vec::new(),
            stoppers: Vec::new(),
            urgent: Vec::new(),
            obliged: Vec::new(),
        }
    }

    /// What is said about the states with some words; the moves also where play is over, if they go
    /// on there. `rest` and `outer` are what is not known to be won before anything is looked at.
    pub(super) fn new(
        symbolic: &Symbolic<'_>,
        rules: &Rules<'a>,
        words: Box<[i32]>,
        goes_on: bool,
        rest: &Rest,
        outer: &Rest,
    ) -> Result<Place<'a>, Error> {
        let Some(invariant) = symbolic.invariant(&words)? else {
            return Err(Error::InitialInvariant);
        };
        let hull = Zone::universe(symbolic.clocks).within(invariant.iter().copied());
        let mut place = Place {
            invariant: invariant.into(),
            ..Place::unknown(words)
        };
        let is_over = place.add_ends(symbolic, rules, &hull)?;
        if is_over && !goes_on {
            return Ok(place);
        }
        place.add_moves(symbolic, rules, &hull)?;
        place.decisions = rules.decisions_of(&place.words);
        let Some(decisions) = place.decisions else {
            return Ok(place);
        };
        let piece = |rank: u32, zones: Vec<Conjunction>, kind: Kind| Piece {
            rank,
            ..Piece::new(kind, zones, rest, outer)
        };
        let zones = |decision: &Decision| -> Vec<Conjunction> {
            let zones = decision.zones.iter();
            zones
                .map(|zone| zone.iter().map(Comparison::from).collect())
                .collect()
        };
        let is_permissive = rules.claim.is_permissive;
        if is_permissive {
            // One piece, so that what follows while waiting is seen at once.
            let waits = decisions.decisions.iter();
            let waits = waits.filter(|one| one.action.is_none());
            let rank = waits.clone().map(|one| one.rank).max();
            let all = waits.flat_map(zones).collect();
            let waiting = rank.map(|rank| piece(rank, all, Kind::Waits));
            place.pieces.extend(waiting);
        }
        for (index, decision) in decisions.decisions.iter().enumerate() {
            let kind = match decision.action {
                Some(_) => Kind::Acts(index),
                None if is_permissive => continue,
                None => Kind::Waits,
            };
            place
                .pieces
                .push(piece(decision.rank, zones(decision), kind));
        }
        Ok(place)
    }

    /// Adds where play is over, and where the goal holds that is to recur; whether play is over
    /// everywhere.
    fn add_ends(
        &mut self,
        symbolic: &Symbolic<'_>,
        rules: &Rules<'_>,
        hull: &Zone,
    ) -> Result<bool, Error> {
        let claim = rules.claim;
        let holds = |predicate: &Predicate| -> Result<Vec<Zone>, Error> {
            let deadlock = |_: &Zone| Err(Error::Unsupported("the predicate deadlock"));
            let parts = symbolic.part(predicate, &self.words, hull, &deadlock)?;
            Ok(parts.into_iter().filter(|part| !part.is_empty()).collect())
        };
        let goal = claim.goal.map(holds).transpose()?.unwrap_or_default();
        let goal_conjunctions: Vec<Conjunction> =
            goal.iter().map(|zone| conjunction(zone, hull)).collect();
        let kept = claim.keep.map(holds).transpose()?;
        let mut left = vec![hull.clone()];
        if claim.aim == Aim::Recur {
            self.goal = goal_conjunctions;
        } else if !goal.is_empty() {
            self.end(goal_conjunctions, claim.owner == Owner::Controller);
            left = without_all(left, &goal);
        }
        if let Some(kept) = kept {
            let broken = without_all(vec![hull.clone()], &kept);
            if !broken.is_empty() {
                let zones = broken.iter().map(|zone| conjunction(zone, hull));
                self.end(zones.collect(), claim.owner == Owner::Environment);
                left = without_all(left, &broken);
            }
        }
        Ok(left.is_empty())
    }

    fn end(&mut self, zones: Vec<Conjunction>, is_won: bool) {
        let rest = if is_won {
            Rest::Nothing
        } else {
            Rest::Everything
        };
        self.pieces
            .push(Piece::new(Kind::Over, zones, &rest, &rest));
    }

    /// Adds the moves, and where time stops.
    fn add_moves(
        &mut self,
        symbolic: &Symbolic<'_>,
        rules: &Rules<'_>,
        hull: &Zone,
    ) -> Result<(), Error> {
        let (mut moves, simple) = self.possible_moves(symbolic, hull)?;
        let has_priorities = rules.claim.has_priorities && symbolic.network().features.priorities;
        if has_priorities {
            let enabled = by_priority(&moves);
            for (one, enabled) in moves.iter_mut().zip(enabled) {
                one.enabled = enabled;
            }
        }
        let under = rules.allowed_of(&self.words);
        if let Some(under) = under {
            let is_permissive = rules.claim.under.is_some_and(|(_, permissive)| permissive);
            self.oblige(under, is_permissive, hull);
            for one in &mut moves {
                if symbolic.code.is_controllable(&one.parts) {
                    one.enabled =
                        allowed(rules.semantics.network(), one, under, is_permissive, hull);
                }
            }
        }
        for (one, simple) in moves.into_iter().zip(simple) {
            let zones = one.enabled.iter();
            let simple = simple.filter(|_| !has_priorities && under.is_none());
            self.moves.push(Move {
                controllable: symbolic.code.is_controllable(&one.parts),
                enabled: match simple {
                    Some(conjunction) => vec![conjunction],
                    None => zones.map(|zone| conjunction(zone, hull)).collect(),
                },
                parts: one.parts.into(),
                channel: one.channel,
                assignments: one.effect.assignments.into(),
                target: Target::Words(one.effect.target.into()),
            });
        }
        self.add_stops(symbolic, hull)
    }

    /// The moves without regard to priorities, each with the conjunction where it is possible, if
    /// it is one; adds where urgent moves are possible, and where a move fails.
    fn possible_moves(
        &mut self,
        symbolic: &Symbolic<'_>,
        hull: &Zone,
    ) -> Result<(Vec<Possible>, Vec<Option<Conjunction>>), Error> {
        let candidates = symbolic.candidates(&self.words)?;
        let combinations = symbolic.combinations(&candidates, &self.words, hull)?;
        drop(candidates);
        let (mut moves, mut simple, mut failing) = (Vec::new(), Vec::new(), Vec::new());
        for one in &combinations {
            let guard = guarded(&one.guard, &one.excluded, hull);
            if guard.is_empty() {
                continue;
            }
            if symbolic.is_urgent(one) {
                let zones = guard.iter().map(|zone| conjunction(zone, hull));
                self.urgent.extend(zones);
            }
            let effect = match symbolic.effect(&one.parts, &self.words) {
                Ok(Some(effect)) => effect,
                Ok(None) => continue,
                Err(Error::Unsupported(what)) => return Err(Error::Unsupported(what)),
                Err(_) => {
                    failing.extend(guard.iter().map(|zone| conjunction(zone, hull)));
                    continue;
                }
            };
            let enabled = within_all(&guard, &effect.needed);
            if enabled.is_empty() {
                continue;
            }
            let asked = one.guard.iter().map(Comparison::from);
            let asked = asked.chain(effect.needed.iter().copied());
            let asked = asked.filter(|&comparison| !hull.implies(comparison));
            simple.push(one.excluded.is_empty().then(|| asked.collect()));
            moves.push(Possible {
                parts: one.parts.clone(),
                channel: one.channel,
                level: symbolic.code.level(&one.parts, one.channel),
                enabled,
                effect,
            });
        }
        if !failing.is_empty() {
            self.end(failing, false);
        }
        Ok((moves, simple))
    }

    fn add_stops(&mut self, symbolic: &Symbolic<'_>, hull: &Zone) -> Result<(), Error> {
        for process in 0..symbolic.network().processes.len() {
            if symbolic.code.urgency(process, &self.words) != Urgency::Normal {
                self.is_urgent = true;
                self.stoppers.push((process as u32, Box::default()));
                continue;
            }
            let invariant = symbolic.code.invariant(process, &self.words)?;
            let ends = invariant.iter().flatten();
            for end in ends.filter_map(|one| Comparison::from(one).at_end()) {
                if !hull.misses(&[end]) {
                    self.stoppers.push((process as u32, Box::new([end])));
                    self.stops.push(Box::new([end]));
                }
            }
        }
        // No time passes to a synchronisation that is possible at all moments that follow: there is
        // no first one.
        let following = self.urgent.iter().map(|one| just_after(one));
        let urgent: Vec<Conjunction> = self.urgent.iter().cloned().chain(following).collect();
        self.stops.extend(urgent);
        self.stops.extend(self.obliged.iter().cloned());
        Ok(())
    }

    /// Adds where the controller is not allowed to wait by a strategy that it is under.
    fn oblige(&mut self, under: &Decisions, is_permissive: bool, hull: &Zone) {
        let mut decided = Vec::new();
        let mut waiting = Vec::new();
        for (action, zones) in counting(under, is_permissive, hull) {
            if action.is_none() {
                waiting.extend(zones.iter().cloned());
            }
            decided.extend(zones);
        }
        let obliged = without_all(decided, &waiting);
        self.obliged = obliged.iter().map(|zone| conjunction(zone, hull)).collect();
    }

    /// The bytes that it takes, about.
    pub(super) fn bytes(&self) -> usize {
        let of = |zones: &[Conjunction]| -> usize {
            zones.iter().map(|one| 16 + size_of_val(&**one)).sum()
        };
        let moves = self.moves.iter().map(|one| {
            let target = match &one.target {
                Target::Words(words) => size_of_val(&**words),
                Target::Place(_) => 0,
            };
            size_of_val(one)
                + size_of_val(&*one.parts)
                + size_of_val(&*one.assignments)
                + of(&one.enabled)
                + target
        });
        let pieces = self.pieces.iter();
        let pieces = pieces.map(|one| size_of_val(one) + of(&one.zones));
        size_of_val(self)
            + 2 * size_of_val(&*self.words)
            + moves.sum::<usize>()
            + pieces.sum::<usize>()
            + of(&self.stops)
            + of(&self.urgent)
    }

    /// The states in which play is not stopped by locations.
    pub(super) fn hull(&self, clocks: usize) -> Zone {
        Zone::universe(clocks).within(self.invariant.iter().copied())
    }

    /// Where in a zone in which time is stopped the controller may stay: the environment has to
    /// move, or play stops, won by the controller. Everywhere else it is the environment who may.
    pub(super) fn controller_may_rest(&self, rules: &Rules<'_>, zone: &Zone) -> Vec<Zone> {
        let of = |owner: bool| -> Vec<Zone> {
            let moves = self.moves.iter().filter(|one| one.controllable == owner);
            moves.flat_map(|one| parts_in(zone, &one.enabled)).collect()
        };
        let (own, others) = (of(true), of(false));
        let mut found = match rules.claim.forcing {
            Forcing::Always => others,
            Forcing::Network => without_all(others, &own),
            Forcing::Component => self.forced_by_components(rules, zone, &own, &others),
        };
        let kept = match rules.claim.aim {
            Aim::Keep => vec![zone.clone()],
            // Where play stops at a goal that is to recur, nothing is owed.
            Aim::Recur => parts_in(zone, &self.goal),
            Aim::Reach => Vec::new(),
        };
        found.extend(without_all(kept, &own));
        without_conjunctions(found, &self.obliged)
    }

    /// Where something stops time to which the controller has no move.
    fn forced_by_components(
        &self,
        rules: &Rules<'_>,
        zone: &Zone,
        own: &[Zone],
        others: &[Zone],
    ) -> Vec<Zone> {
        let mut found = Vec::new();
        if rules.semantics.network().features.clock_guarded_urgent {
            found = without_all(others.to_vec(), own);
        } else {
            for urgent in &self.urgent {
                found.extend(without_all(within_all(others, urgent), own));
            }
        }
        for (process, stop) in &self.stoppers {
            let mut stopped = within_all(others, stop);
            let takes_part = |one: &&Move| one.parts.iter().any(|part| part.process == *process);
            let own = self.moves.iter().filter(|one| one.controllable);
            for one in own.filter(takes_part) {
                stopped = without_all(stopped, &parts_in(zone, &one.enabled));
            }
            found.extend(stopped);
        }
        found
    }
}

/// The decisions with the zones in which they count.
fn counting<'d>(
    decisions: &'d Decisions,
    is_permissive: bool,
    hull: &Zone,
) -> Vec<(Option<&'d [Part]>, Vec<Zone>)> {
    let mut decided: Vec<Zone> = Vec::new();
    let mut found = Vec::new();
    for one in &decisions.decisions {
        let zones = one.zones.iter();
        let zones = zones.map(|zone| hull.within(zone.iter().map(Comparison::from)));
        let mut zones: Vec<Zone> = zones.filter(|zone| !zone.is_empty()).collect();
        if !is_permissive {
            let all = zones.clone();
            zones = without_all(zones, &decided);
            decided.extend(all);
        }
        found.push((one.action.as_deref(), zones));
    }
    found
}

/// Where a strategy allows a move of the controller: where a decision for it counts, and where it
/// decides nothing.
fn allowed(
    network: &Network,
    one: &Possible,
    under: &Decisions,
    is_permissive: bool,
    hull: &Zone,
) -> Vec<Zone> {
    let counting = counting(under, is_permissive, hull);
    let mut free = one.enabled.clone();
    let mut found = Vec::new();
    for (action, zones) in counting {
        if action.is_some_and(|action| is_same_entry(network, action, &one.parts)) {
            for zone in &zones {
                let both = one.enabled.iter().map(|enabled| enabled.intersection(zone));
                found.extend(both.filter(|both| !both.is_empty()));
            }
        }
        free = without_all(free, &zones);
    }
    found.extend(free);
    found
}

/// A zone as comparisons within another one that contains it.
pub(super) fn conjunction(zone: &Zone, hull: &Zone) -> Conjunction {
    let comparisons = zone.comparisons().into_iter();
    comparisons.filter(|&one| !hull.implies(one)).collect()
}

/// Where a conjunction holds at all moments that follow.
pub(super) fn just_after(conjunction: &[Comparison]) -> Conjunction {
    conjunction.iter().map(|one| one.just_after()).collect()
}

/// The parts of a zone in which some conjunction holds.
pub(super) fn parts_in(zone: &Zone, conjunctions: &[Conjunction]) -> Vec<Zone> {
    let parts = conjunctions.iter().filter(|one| !zone.misses(one));
    parts.map(|one| zone.within(one.iter().copied())).collect()
}

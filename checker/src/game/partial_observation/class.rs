//! The play inside one observation: the knowledge sets to which an action leads from a given one.
//!
//! The search explores symbolic states; their zones are those on entry. From each state, time
//! passes until the goal holds, the observation changes, or the action is possible. Then the
//! environment moves, or the action is taken.
//!
//! A cycle of this graph is a run without end only if states are compared by equality of zones:
//! with inclusion, an edge to a state with a larger zone can close a cycle that no run takes. So
//! the graph is first made with inclusion, which gives a smaller graph. If it has no cycle, the
//! graph with equality has none either. Source: A. Laarman, M. C. Olesen, A. E. Dalsgaard, K. G.
//! Larsen, J. van de Pol, "Multi-core Emptiness Checking of Timed Büchi Automata Using Inclusion
//! Abstraction", CAV 2013 (what inclusion does to cycles).

use std::collections::BTreeMap;
use std::rc::Rc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::network::{Failure, Symbolic};
use crate::search::limits::StopReason;
use crate::zones::future::{self, Barriers};
use crate::zones::{Bound, ClockSet, Federation, Zone, dbm};

use super::knowledge::{Knowledge, Observation};
use super::machine::{Action, Question};
use super::place::{Place, Places};
use crate::game::Forced;

/// Where an action leads.
pub(super) enum Consequence {
    /// To one of these knowledge sets, or past the goal.
    Next(Vec<Knowledge>),
    /// The environment can win before the observation changes, or prevent the change.
    Lost,
    /// A limit came first.
    Stopped(StopReason),
}

/// Checks the limits while play inside an observation is explored, given the number of states that
/// it has until now.
pub(super) type Look<'l> = dyn FnMut(usize, usize) -> Option<StopReason> + 'l;

/// Explores play inside observations.
pub(super) struct Explorer<'e, 'a, 'q> {
    pub(super) symbolic: &'e mut Symbolic<'a>,
    pub(super) question: Question<'q>,
    pub(super) places: Places,
    /// States that were explored.
    pub(super) explored: u64,
}

/// How states are compared.
#[derive(Clone, Copy, PartialEq)]
enum Sameness {
    /// A state stands for those with the same words and a smaller zone.
    Inclusion,
    /// A state stands for itself.
    Equality,
}

/// A symbolic state on entry.
struct Entry {
    place: Rc<Place>,
    zone: Zone,
}

/// The play until now.
struct Class<'c> {
    observation: &'c Observation,
    action: Action,
    sameness: Sameness,
    entries: Vec<Entry>,
    /// The states with these words.
    known: FxHashMap<Box<[i32]>, Vec<usize>>,
    /// For each state: the states in which play continues.
    edges: Vec<Vec<usize>>,
    exits: BTreeMap<Observation, Knowledge>,
    /// The actions that are possible somewhere.
    offers: FxHashSet<Action>,
    is_lost: bool,
}

impl Explorer<'_, '_, '_> {
    /// The result of an action in a knowledge set. For [`Action::Wait`] the actions that become
    /// possible meanwhile are added to `offers`: any other action has the same result as waiting.
    pub(super) fn outcome(
        &mut self,
        knowledge: &Knowledge,
        action: Action,
        offers: &mut Vec<Action>,
        look: &mut Look<'_>,
    ) -> Result<Consequence, Failure> {
        let mut class = match self.explore(knowledge, action, Sameness::Inclusion, look)? {
            Ok(class) => class,
            Err(reason) => return Ok(Consequence::Stopped(reason)),
        };
        offers.extend(class.offers.drain());
        offers.sort_unstable();
        if self.question.must_reach && !class.is_lost && has_cycle(&class.edges) {
            let again = self.explore(knowledge, action, Sameness::Equality, look)?;
            match again {
                Ok(again) => class.is_lost = has_cycle(&again.edges),
                Err(reason) => return Ok(Consequence::Stopped(reason)),
            }
        }
        if class.is_lost {
            return Ok(Consequence::Lost);
        }
        let mut exits: Vec<Knowledge> = class.exits.into_values().collect();
        exits.iter_mut().for_each(Knowledge::reduce);
        Ok(Consequence::Next(exits))
    }

    fn explore<'c>(
        &mut self,
        knowledge: &'c Knowledge,
        action: Action,
        sameness: Sameness,
        look: &mut Look<'_>,
    ) -> Result<Result<Class<'c>, StopReason>, Failure> {
        let mut class = Class {
            observation: &knowledge.observation,
            action,
            sameness,
            entries: Vec::new(),
            known: FxHashMap::default(),
            edges: Vec::new(),
            exits: BTreeMap::new(),
            offers: FxHashSet::default(),
            is_lost: false,
        };
        for (words, zones) in &knowledge.states {
            let place = self.places.at(self.symbolic, &self.question, words)?;
            for zone in zones.to_zones() {
                class.enter(&place, zone);
            }
        }
        let mut next = 0;
        while next < class.entries.len() && !(class.is_lost && action != Action::Wait) {
            if let Some(reason) = look(class.entries.len(), self.places.bytes()) {
                return Ok(Err(reason));
            }
            self.expand(&mut class, next)?;
            self.explored += 1;
            next += 1;
        }
        Ok(Ok(class))
    }

    /// Lets time pass from a state, and takes the moves that are then possible.
    fn expand(&mut self, class: &mut Class<'_>, index: usize) -> Result<(), Failure> {
        let place = Rc::clone(&class.entries[index].place);
        let from = Federation::of_zone(
            self.symbolic.dimension(),
            class.entries[index].zone.bounds(),
        );
        let Some(cell) = place.cell(class.observation) else {
            return Ok(());
        };
        let elsewhere = Federation::of_zone(from.dimension(), place.zone.bounds()).minus(cell);
        let free = passing(&place, &from, &elsewhere);
        let own = self.enabled(&place, &free, |one| one == Some(class.action))?;
        let mut stops = elsewhere;
        stops.unite(&own);
        let reached = if own.is_empty() {
            free
        } else {
            passing(&place, &from, &stops)
        };
        class.is_lost |= reached.intersects(&place.broken);
        for (observation, part) in &place.cells {
            if observation != class.observation {
                let leaving = reached.intersection(part);
                self.leave(class, observation, &place, &leaving);
            }
        }
        let inside = reached.intersection(cell);
        class.is_lost |= self.may_stay(&place, &inside, &own)?;
        for (which, &action) in place.actions.iter().enumerate() {
            match action {
                None => self.take(class, index, &place, which, &inside)?,
                Some(action) if action == class.action => {
                    self.take(class, index, &place, which, &inside)?;
                }
                Some(action) if class.action == Action::Wait => {
                    let taken = place.taken(self.symbolic, which, &inside)?;
                    if taken.is_some_and(|taken| taken.enabled.intersects(&inside)) {
                        class.offers.insert(action);
                    }
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// Where moves with such actions are possible. It covers only those moves whose guards `from`
    /// meets.
    fn enabled(
        &mut self,
        place: &Place,
        from: &Federation,
        is_meant: impl Fn(Option<Action>) -> bool,
    ) -> Result<Federation, Failure> {
        let mut enabled = Federation::empty(from.dimension());
        for (which, &action) in place.actions.iter().enumerate() {
            if is_meant(action)
                && let Some(taken) = place.taken(self.symbolic, which, from)?
            {
                enabled.unite(&taken.enabled);
            }
        }
        Ok(enabled)
    }

    /// Whether play may be lost by staying in one of these states: by waiting for ever, or where
    /// time stops. `own` is where the action is possible.
    fn may_stay(
        &mut self,
        place: &Place,
        inside: &Federation,
        own: &Federation,
    ) -> Result<bool, Failure> {
        let idle = inside.clone().minus(own);
        if idle.is_empty() {
            return Ok(false);
        }
        if self.question.must_reach && place.delays && may_wait_for_ever(&idle) {
            return Ok(true);
        }
        let mut at_rest = Federation::empty(idle.dimension());
        for (_, stop) in &place.stops {
            at_rest.unite(&stop.intersection(&idle));
        }
        if at_rest.is_empty() {
            return Ok(false);
        }
        let others = self.enabled(place, &at_rest, |one| one.is_none())?;
        let forced = self.forced(place, &at_rest, &others)?;
        if !self.question.must_reach {
            // If keeping is enough, play may stop where the controller has no move.
            let controller = self.enabled(place, &at_rest, |one| one.is_some())?;
            at_rest = at_rest.intersection(&controller);
        }
        at_rest.subtract(&forced);
        Ok(!at_rest.is_empty())
    }

    /// Where time stops and the environment must move. `others` is where it can.
    fn forced(
        &mut self,
        place: &Place,
        at_rest: &Federation,
        others: &Federation,
    ) -> Result<Federation, Failure> {
        let mut all = Federation::empty(others.dimension());
        for (component, stop) in &place.stops {
            let mut stop = stop.intersection(others);
            for (which, _) in place
                .actions
                .iter()
                .enumerate()
                .filter(|(_, one)| one.is_some())
            {
                let blocks = match (self.question.forced, *component) {
                    (Forced::Neutral, _) => false,
                    (Forced::Tiga, Some(process)) => place.takes_part(which, process),
                    (Forced::Product, _) | (Forced::Tiga, None) => true,
                };
                if blocks && let Some(taken) = place.taken(self.symbolic, which, at_rest)? {
                    stop.subtract(&taken.enabled);
                }
            }
            all.unite(&stop);
        }
        Ok(all)
    }

    /// Takes a move from the states that time has reached.
    fn take(
        &mut self,
        class: &mut Class<'_>,
        source: usize,
        place: &Rc<Place>,
        which: usize,
        inside: &Federation,
    ) -> Result<(), Failure> {
        let dimension = inside.dimension();
        let Some(taken) = place.taken(self.symbolic, which, inside)? else {
            return Ok(());
        };
        let mut entered = Federation::empty(dimension);
        let mut entries = Vec::new();
        for zone in inside.zones() {
            taken.effect.entry_zones(zone, dimension, &mut entries);
            for zone in &entries {
                entered.add(zone.bounds());
            }
        }
        if entered.is_empty() {
            return Ok(());
        }
        let target = self
            .places
            .at(self.symbolic, &self.question, &taken.words)?;
        entered.subtract(&target.goal);
        for (observation, part) in &target.cells {
            let part = entered.intersection(part);
            if observation == class.observation {
                for zone in self.extrapolated(&target, &part) {
                    let state = class.enter(&target, zone);
                    class.edges[source].push(state);
                }
            } else {
                self.leave(class, observation, &target, &part);
            }
        }
        Ok(())
    }

    /// Adds states in which the observation has changed.
    fn leave(
        &mut self,
        class: &mut Class<'_>,
        observation: &Observation,
        place: &Place,
        part: &Federation,
    ) {
        if part.is_empty() {
            return;
        }
        let zones = self.extrapolated(place, part);
        let exit = class
            .exits
            .entry(Observation::clone(observation))
            .or_insert_with(|| Knowledge::empty(Observation::clone(observation)));
        for zone in zones {
            exit.add(&place.words, zone.bounds(), part.dimension());
        }
    }

    fn extrapolated(&mut self, place: &Place, part: &Federation) -> Vec<Zone> {
        let mut zones = part.to_zones().collect();
        self.symbolic.extrapolate_all(&place.words, &mut zones);
        zones
    }
}

impl Class<'_> {
    /// The state for a zone on entry.
    fn enter(&mut self, place: &Rc<Place>, zone: Zone) -> usize {
        if !self.known.contains_key(&place.words) {
            self.known.insert(place.words.clone(), Vec::new());
        }
        let known = self.known.get_mut(&place.words).expect("it is there now");
        let found = known.iter().copied().find(|&state| {
            let other = &self.entries[state].zone;
            match self.sameness {
                Sameness::Inclusion => dbm::is_subset(zone.bounds(), other.bounds()),
                Sameness::Equality => zone == *other,
            }
        });
        if let Some(state) = found {
            return state;
        }
        let state = self.entries.len();
        known.push(state);
        self.entries.push(Entry {
            place: Rc::clone(place),
            zone,
        });
        self.edges.push(Vec::new());
        state
    }
}

/// What time reaches before the goal, up to the first moment in one of the states that stop time.
fn passing(place: &Place, from: &Federation, stops: &Federation) -> Federation {
    if !place.delays || from.dimension() == 1 {
        return from.clone();
    }
    let barriers = Barriers {
        stops: stops.clone(),
        open: Vec::new(),
    };
    let mut reached = future::successors(from, &place.goal, &barriers);
    reached.intersect_zone(place.zone.bounds());
    reached
}

/// Whether time may pass for ever inside a set.
fn may_wait_for_ever(idle: &Federation) -> bool {
    let dimension = idle.dimension();
    let is_bounded = |zone: &[Bound]| dbm::is_delay_bounded(zone, dimension, &ClockSet::EMPTY);
    if dimension > 1 && idle.zones().all(is_bounded) {
        return false;
    }
    let mut ends = idle.complement();
    ends.down(&ClockSet::EMPTY);
    !idle.is_subset(&ends)
}

/// Whether a graph has a cycle.
fn has_cycle(edges: &[Vec<usize>]) -> bool {
    #[derive(Clone, Copy, PartialEq)]
    enum Mark {
        New,
        Open,
        Done,
    }
    let mut marks = vec![Mark::New; edges.len()];
    for root in 0..edges.len() {
        if marks[root] != Mark::New {
            continue;
        }
        let mut path = vec![(root, 0)];
        marks[root] = Mark::Open;
        while let Some((state, next)) = path.last_mut() {
            let Some(&target) = edges[*state].get(*next) else {
                marks[*state] = Mark::Done;
                path.pop();
                continue;
            };
            *next += 1;
            match marks[target] {
                Mark::Open => return true,
                Mark::New => {
                    marks[target] = Mark::Open;
                    path.push((target, 0));
                }
                Mark::Done => {}
            }
        }
    }
    false
}

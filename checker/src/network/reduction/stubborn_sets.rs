//! Partial-order reduction: where time stands still, independent processes need not be interleaved
//! in every order.
//!
//! In a state in which time cannot pass, a set P of processes is *stubborn* if no process outside,
//! whatever it may do while time stands still, gets in the way of an edge that leaves the current
//! location of a process in P, or takes part in a move with it ([`crate::analysis::dependence`]),
//! and if P has a process that keeps time from passing ([`super::time_stoppers`]), by staying in a
//! committed location if there are any. As long as no process of P moves, time stands still and the
//! moves of P stay what they are. So of every run from the state, the first move of P can be taken
//! first, and if it has none, one of P can be put before it. Moves of P that cannot make what is
//! looked for false again, or that nothing outside P can make true, are enough then to find it.
//!
//! A run in which none of P takes part would be put off for ever where moves of P make a loop. So
//! they are enough only if one of them is possible in the whole zone, and either leads to a state
//! that is still to be explored, or cannot be on a loop in which no time passes
//! ([`crate::analysis::zero_time_cycles`]); else all moves are taken. This keeps failures and
//! deadlocks too: every failure that a search of all moves meets has its like, though perhaps
//! another is met first.
//!
//! Sources: A. Valmari, "Stubborn Sets for Reduced State Space Generation", 1991; D. Bošnački, G.
//! J. Holzmann, "Improving SPIN's Partial-Order Reduction for Breadth-First Search", SPIN 2005 (the
//! condition on loops); K. G. Larsen, M. Mikučionis, M. Muñiz, J. Srba, "Urgent Partial Order
//! Reduction for Extended Timed Automata", ATVA 2020 (states in which time stands still). Here sets
//! are of processes and not of edges, and what they depend on is asked of locations only, so that
//! it is remembered.
//!
//! Cost: for some sets of a state a look-up for each pair of processes; given up where it seldom
//! helps ([`LEAST_SHARE`]).

use std::sync::Arc;

use crate::ir::Network;
use crate::zones::{Zone, dbm};

use super::independence::{Interference, Situation};
use super::partial_order::PartialOrder;
use crate::analysis::dependence::Ground;
use crate::network::Failure;
use crate::network::discrete::stepper::Stepper;
use crate::network::discrete::transition::{MoveRef, Moves, Part};
use crate::network::symbolic::clock_effect::to_constraint;
use crate::network::trial::Trial;

/// Sets that are tried in a state, at most.
const MOST_SETS: u32 = 8;

/// A search gives up looking for sets after a trial, unless the set of one state in this many was
/// enough.
const LEAST_SHARE: u32 = 16;

/// Which of the moves of a state are taken first, and whether these are enough.
#[derive(Clone, Debug, Default)]
pub(crate) struct Agenda {
    /// The indices of the moves in the order in which they are taken; empty if that is the order
    /// that they have.
    order: Vec<u32>,
    /// How many moves of a stubborn set stand first.
    first: usize,
    are_enough: bool,
}

impl Agenda {
    /// All moves in the order that they have.
    pub(crate) fn clear(&mut self) {
        self.order.clear();
        self.first = 0;
        self.are_enough = false;
    }

    /// The index of the move that comes at this place.
    #[inline]
    pub(crate) fn index(&self, place: usize) -> usize {
        match self.order.get(place) {
            Some(&index) => index as usize,
            None => place,
        }
    }

    /// How many of the possible moves must be taken.
    #[inline]
    pub(crate) fn end(&self, moves: usize) -> usize {
        if self.are_enough { self.first } else { moves }
    }

    /// Whether the move at this place could make those of its set enough.
    #[inline]
    pub(crate) fn is_open(&self, place: usize) -> bool {
        place < self.first && !self.are_enough
    }

    /// The moves of the set are enough.
    pub(crate) fn close(&mut self) {
        self.are_enough = true;
    }
}

/// Chooses the processes whose moves are taken first. Holds what was learnt, so one per thread.
#[derive(Debug)]
pub(crate) struct StubbornSets {
    order: Arc<PartialOrder>,
    interference: Interference,
    /// For each process: its situation in the current state, and whether it keeps time from
    /// passing.
    situations: Vec<Situation>,
    holds: Vec<bool>,
    /// The moves that each clock constraint for itself leaves possible.
    possible: Vec<u32>,
    /// For each process: whether it is in the current set.
    is_member: Vec<bool>,
    /// The processes of the current set.
    members: Vec<u32>,
    /// By process: whether it is in the best set so far.
    best: Vec<bool>,
    trial: Trial,
    is_given_up: bool,
}

impl StubbornSets {
    pub(crate) fn new(network: &Network, order: Arc<PartialOrder>) -> StubbornSets {
        StubbornSets {
            order,
            interference: Interference::new(network),
            situations: Vec::new(),
            holds: Vec::new(),
            possible: Vec::new(),
            is_member: Vec::new(),
            members: Vec::new(),
            best: Vec::new(),
            trial: Trial::default(),
            is_given_up: false,
        }
    }

    /// Puts the moves of a stubborn set first, if the state with these words, zone and moves has
    /// one with fewer than all.
    pub(crate) fn choose(
        &mut self,
        stepper: &mut Stepper<'_>,
        words: &mut [i32],
        zone: &Zone,
        moves: &Moves,
        agenda: &mut Agenda,
    ) -> Result<(), Failure> {
        agenda.clear();
        if moves.len() < 2 || self.is_given_up {
            return Ok(());
        }
        let order = Arc::clone(&self.order);
        let holders = &order.holders;
        let Some(still) = holders.find(stepper, words, zone, moves, &mut self.holds)? else {
            return Ok(());
        };
        self.possible.clear();
        let possible = (0..)
            .zip(moves.iter())
            .filter(|(_, one)| may_be_possible(*one, zone));
        self.possible
            .extend(possible.map(|(index, _): (u32, _)| index));
        if self.possible.len() < 2 {
            return Ok(());
        }
        self.is_given_up = self.trial.fails(LEAST_SHARE);
        let ground = Ground {
            network: stepper.network(),
            watched: &order.watched,
            greatest: &order.greatest,
            still,
        };
        let situations = &mut self.situations;
        self.interference
            .situations(ground, words, zone, situations);
        if !self.find_best(ground, moves, zone) {
            return Ok(());
        }
        let is_first = |index: u32| self.best[moves.get(index as usize).parts[0].process as usize];
        let indices = 0..moves.len() as u32;
        let first = indices.clone().filter(|&index| is_first(index));
        agenda.order.extend(first);
        agenda.first = agenda.order.len();
        agenda
            .order
            .extend(indices.filter(|&index| !is_first(index)));
        Ok(())
    }

    /// Whether a move cannot be taken again and again while time stands still.
    pub(crate) fn is_passing(&self, parts: &[Part]) -> bool {
        let recurrent = &self.order.recurrent;
        parts
            .iter()
            .any(|part| !recurrent[part.process as usize][part.edge as usize])
    }

    /// Counts the state if the moves of its set were enough.
    pub(crate) fn count(&mut self, agenda: &Agenda) {
        if agenda.are_enough {
            self.trial.gain();
        }
    }

    /// Looks for the stubborn set with the fewest possible moves, which is left in `best`; returns
    /// whether there is one with fewer than all.
    fn find_best(&mut self, ground: Ground<'_>, moves: &Moves, zone: &Zone) -> bool {
        let all = self.possible.len();
        let mut fewest = all;
        let mut tried = 0;
        let mut last = None;
        for place in 0..all {
            let one = moves.get(self.possible[place] as usize);
            // Moves come by their first process.
            let process = one.parts[0].process;
            if fewest == 1 || tried == MOST_SETS || last.replace(process) == Some(process) {
                continue;
            }
            let holds = |part: &&Part| self.holds[part.process as usize];
            let Some(holder) = one.parts.iter().find(holds) else {
                continue;
            };
            tried += 1;
            self.close(ground, holder.process);
            if let Some(count) = self.moves_of_set(ground, moves, zone)
                && count < fewest
            {
                fewest = count;
                std::mem::swap(&mut self.best, &mut self.is_member);
            }
        }
        fewest < all
    }

    /// Makes the least stubborn set with a process.
    fn close(&mut self, ground: Ground<'_>, process: u32) {
        self.is_member.clear();
        self.is_member.resize(self.situations.len(), false);
        self.members.clear();
        self.is_member[process as usize] = true;
        self.members.push(process);
        let mut next = 0;
        while let Some(&member) = self.members.get(next) {
            next += 1;
            let member = self.situations[member as usize];
            for (other, &situation) in self.situations.iter().enumerate() {
                if !self.is_member[other] && self.interference.meets(ground, member, situation) {
                    self.is_member[other] = true;
                    self.members.push(other as u32);
                }
            }
        }
    }

    /// The number of possible moves in the current set; `None` if they cannot be enough.
    fn moves_of_set(&mut self, ground: Ground<'_>, moves: &Moves, zone: &Zone) -> Option<usize> {
        let mut count = 0;
        let mut has_sure_one = false;
        for &index in &self.possible {
            let one = moves.get(index as usize);
            if self.is_member[one.parts[0].process as usize] {
                count += 1;
                has_sure_one |= is_sure(one, zone);
            }
        }
        if !has_sure_one || count == self.possible.len() {
            return None;
        }
        let interference = &mut self.interference;
        let mut spoils = |situation| interference.now(ground, situation).may_spoil;
        let processes = || self.situations.iter().zip(&self.is_member);
        let is_spoilt = processes().any(|(&situation, &is_in)| is_in && spoils(situation));
        let mut fulfils = |situation| {
            let future = self.interference.future(ground, situation);
            future.may_fulfil
        };
        let is_enough =
            !is_spoilt || !processes().any(|(&situation, &is_in)| !is_in && fulfils(situation));
        is_enough.then_some(count)
    }
}

/// Whether the guards of a move hold in the whole zone.
fn is_sure(one: MoveRef<'_>, zone: &Zone) -> bool {
    one.excluded().next().is_none()
        && one.constraints.iter().all(|emitted| {
            to_constraint(emitted).is_ok_and(|one| zone.bound(one.left, one.right) <= one.bound)
        })
}

/// Whether each clock constraint of a move, for itself, leaves something of the zone.
fn may_be_possible(one: MoveRef<'_>, zone: &Zone) -> bool {
    one.constraints.iter().all(|emitted| {
        to_constraint(emitted).map_or(true, |constraint| {
            dbm::satisfies(zone.bounds(), zone.dimension(), &constraint)
        })
    })
}

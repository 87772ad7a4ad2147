//! What is claimed about a strategy, and the rules of the two sides: who may do what in a state,
//! who must, and who has won.
//!
//! [`super::strategy`] and [`super::observed`] close their loops by them, [`super::play`] lets a
//! person play by them.

use std::collections::HashMap;

use crate::ir::{FixedConstraint, Network, Predicate};

use super::concrete::Semantics;
use super::machine::Machine;
use super::moves::{Error, Move, Part, State, is_same_entry};
use super::zone::Comparison;

/// What to do in some zones.
#[derive(Clone, Debug)]
pub struct Decision {
    /// Decisions of lower ranks are looked at first. Nothing else hangs on it: what is wrong here
    /// costs time alone.
    pub rank: u32,
    /// Where it applies: in one of these conjunctions.
    pub zones: Vec<Vec<FixedConstraint>>,
    /// The move to take; `None` is to wait. For a move of the controller only the edges and their
    /// `select` values count: the environment picks the branches.
    pub action: Option<Vec<Part>>,
}

impl Decision {
    /// Whether it applies to these clock values, in ticks.
    fn applies(&self, clocks: &[i64], ticks_per_unit: i64) -> bool {
        let holds = |one: &FixedConstraint| Comparison::from(one).holds(clocks, ticks_per_unit);
        self.zones.iter().any(|zone| zone.iter().all(holds))
    }
}

/// The decisions of the states with some words, in order: the first whose zones contain the clock
/// values applies.
#[derive(Clone, Debug)]
pub struct Decisions {
    /// The words.
    pub words: Vec<i32>,
    /// The decisions.
    pub decisions: Vec<Decision>,
    /// The moves of the controller whose branches the environment picks, if the strategy is its: of
    /// those with the same edges and `select` values the first that applies. Without one it picks
    /// any.
    pub legs: Vec<Decision>,
}

impl Decisions {
    /// The decisions that apply at clock values in ticks, by index; only the first of them unless
    /// the strategy is permissive.
    pub(super) fn indices_at(
        &self,
        clocks: &[i64],
        ticks_per_unit: i64,
        is_permissive: bool,
    ) -> Vec<usize> {
        let decisions = self.decisions.iter().enumerate();
        let applying = decisions.filter(|(_, decision)| decision.applies(clocks, ticks_per_unit));
        let most = if is_permissive { usize::MAX } else { 1 };
        applying.map(|(index, _)| index).take(most).collect()
    }

    /// The same decisions themselves.
    fn at(&self, clocks: &[i64], ticks_per_unit: i64, is_permissive: bool) -> Vec<&Decision> {
        let indices = self.indices_at(clocks, ticks_per_unit, is_permissive);
        let indices = indices.into_iter();
        indices.map(|index| &self.decisions[index]).collect()
    }
}

/// When the environment must move at a point where time cannot pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forcing {
    /// If something stops time to which the controller has no move: a process by its location or
    /// invariant, or the network by an urgent channel.
    Component,
    /// If the controller has no move at all.
    Network,
    /// Always.
    Always,
}

/// The player who uses the strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The controller.
    Controller,
    /// The environment.
    Environment,
}

/// What the controller is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// To reach the goal.
    Reach,
    /// To keep what must be kept forever, or until the goal.
    Keep,
    /// To keep it forever, and have the goal again and again.
    Recur,
}

/// What is claimed: that the owner of the strategy wins, by getting the controller to its aim, or
/// by keeping it from it.
#[derive(Clone, Copy, Debug)]
pub struct Claim<'a> {
    /// The player who uses the strategy.
    pub owner: Owner,
    /// Whether every decision that applies is allowed; else the first counts.
    pub is_permissive: bool,
    /// What the controller is asked for.
    pub aim: Aim,
    /// Where play ends, for the controller, unless the goal is to recur; `None` without such an
    /// end.
    pub goal: Option<&'a Predicate>,
    /// What holds until then.
    pub keep: Option<&'a Predicate>,
    /// When the environment must move.
    pub forcing: Forcing,
    /// What the controller is allowed, by a strategy of its, and whether that allows every decision
    /// that applies; `None` is everything. Where it decides nothing, everything is allowed.
    pub under: Option<(&'a [Decisions], bool)>,
    /// Whether priorities count.
    pub has_priorities: bool,
    /// The greatest constant, in absolute value, of the clock comparisons of the two predicates.
    pub constant: i64,
    /// Whether the predicates compare differences of clocks.
    pub has_differences: bool,
}

impl Claim<'_> {
    /// Whether plays that go on forever, without the goal if that is to recur, are lost for the
    /// owner.
    pub(super) fn must_end(&self) -> bool {
        (self.owner == Owner::Controller) == (self.aim != Aim::Keep)
    }

    /// Whether a move is one of the owner of the strategy.
    pub(super) fn owns(&self, controllable: bool) -> bool {
        controllable == (self.owner == Owner::Controller)
    }
}

/// Who may do what in a state, and who has won.
pub(super) struct Rules<'a> {
    pub(super) semantics: Semantics<'a>,
    strategy: HashMap<&'a [i32], &'a Decisions>,
    under: HashMap<&'a [i32], &'a Decisions>,
    /// What is followed instead of a strategy, if the controller goes by observations.
    pub(super) machine: Option<Machine<'a>>,
    pub(super) claim: &'a Claim<'a>,
}

/// What becomes of play where time cannot pass and nobody wants to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rest {
    /// This player has to move nevertheless.
    Must(Owner),
    /// Play stops, and this player has won.
    Won(Owner),
}

impl<'a> Rules<'a> {
    /// The rules for a strategy and what is claimed of it, at this resolution of time.
    pub(super) fn new(
        network: &'a Network,
        ticks_per_unit: i64,
        strategy: &'a [Decisions],
        claim: &'a Claim<'a>,
    ) -> Rules<'a> {
        let by_words = |strategy: &'a [Decisions]| {
            let states = strategy.iter();
            let states = states.map(|state| (identity(network, &state.words), state));
            states.collect::<HashMap<_, _>>()
        };
        Rules {
            semantics: Semantics::new(network, ticks_per_unit),
            strategy: by_words(strategy),
            under: by_words(claim.under.map_or(&[], |(under, _)| under)),
            machine: None,
            claim,
        }
    }

    /// The same rules for a machine.
    pub(super) fn with_machine(self, machine: Machine<'a>) -> Rules<'a> {
        Rules {
            machine: Some(machine),
            ..self
        }
    }

    /// Who has won in a state; `None` if play goes on.
    pub(super) fn winner(&self, state: &State) -> Result<Option<Owner>, Error> {
        if self.claim.aim != Aim::Recur && self.is_goal(state)? {
            return Ok(Some(Owner::Controller));
        }
        Ok(match self.claim.keep {
            Some(keep) if !self.semantics.holds(keep, state)? => Some(Owner::Environment),
            _ => None,
        })
    }

    pub(super) fn is_goal(&self, state: &State) -> Result<bool, Error> {
        match self.claim.goal {
            Some(goal) => self.semantics.holds(goal, state),
            None => Ok(false),
        }
    }

    /// The moves whose targets satisfy the invariants, with these; if priorities count, those of
    /// the highest among them.
    pub(super) fn possible<'m>(
        &self,
        state: &State,
        moves: &'m [Move],
    ) -> Result<Vec<(&'m Move, State)>, Error> {
        let mut possible = Vec::new();
        for one in moves {
            if let Some(target) = self.semantics.take(state, &one.parts)? {
                possible.push((one, target));
            }
        }
        if self.claim.has_priorities {
            let highest = possible.iter().map(|(one, _)| one.level).max();
            possible.retain(|(one, _)| Some(one.level) == highest);
        }
        let allowed = self.allowed(state);
        if !allowed.is_empty() {
            let network = self.semantics.network();
            let is_allowed = |one: &Move| {
                allowed
                    .iter()
                    .filter_map(|decision| decision.action.as_ref())
                    .any(|action| is_same_entry(network, action, &one.parts))
            };
            possible.retain(|(one, _)| !one.controllable || is_allowed(one));
        }
        Ok(possible)
    }

    /// The decisions that the controller is allowed; none is all.
    fn allowed(&self, state: &State) -> Vec<&'a Decision> {
        let unit = self.semantics.ticks_per_unit();
        match (self.allowed_of(&state.words), self.claim.under) {
            (Some(decisions), Some((_, is_permissive))) => {
                decisions.at(&state.clocks, unit, is_permissive)
            }
            _ => Vec::new(),
        }
    }

    /// Whether the controller is not allowed to wait.
    pub(super) fn is_obliged(&self, state: &State) -> bool {
        let allowed = self.allowed(state);
        !allowed.is_empty() && allowed.iter().all(|one| one.action.is_some())
    }

    /// All that the controller may be allowed in states with these words.
    pub(super) fn allowed_of(&self, words: &[i32]) -> Option<&'a Decisions> {
        let words = identity(self.semantics.network(), words);
        self.under.get(words).copied()
    }

    /// Whether an action of the strategy means the move with these parts.
    pub(super) fn is_meant(&self, action: &[Part], parts: &[Part]) -> bool {
        match self.claim.owner {
            Owner::Controller => is_same_entry(self.semantics.network(), action, parts),
            Owner::Environment => action == parts,
        }
    }

    /// The possible moves that an action of the owner stands for: of the controller's all with the
    /// same edges, since the environment picks the branches.
    pub(super) fn moves_of_action<'m, 'p>(
        &self,
        action: &[Part],
        possible: &'p [(&'m Move, State)],
    ) -> Vec<&'p (&'m Move, State)> {
        let own = possible
            .iter()
            .filter(|(one, _)| self.claim.owns(one.controllable));
        own.filter(|(one, _)| self.is_meant(action, &one.parts))
            .collect()
    }

    /// The possible moves of the opponent, where the owner picks their branches those that it
    /// picks; `None` if it picks one that is not possible.
    pub(super) fn others<'m, 'p>(
        &self,
        state: &State,
        possible: &'p [(&'m Move, State)],
    ) -> Option<Vec<&'p (&'m Move, State)>> {
        let others = possible
            .iter()
            .filter(|(one, _)| !self.claim.owns(one.controllable));
        let others: Vec<_> = others.collect();
        let legs = self
            .decisions_of(&state.words)
            .map_or(&[][..], |decisions| &decisions.legs);
        if legs.is_empty() || self.claim.owner == Owner::Controller {
            return Some(others);
        }
        let unit = self.semantics.ticks_per_unit();
        let picked = |one: &Move| {
            let mut legs = legs.iter().filter_map(|leg| {
                let action = leg.action.as_ref()?;
                let is_meant = leg.applies(&state.clocks, unit)
                    && is_same_entry(self.semantics.network(), action, &one.parts);
                is_meant.then_some(action)
            });
            legs.next()
        };
        let mut left = Vec::new();
        for other in &others {
            match picked(other.0) {
                None => left.push(*other),
                Some(leg) if *leg == other.0.parts => left.push(*other),
                Some(leg) if others.iter().any(|(one, _)| one.parts == *leg) => {}
                Some(_) => return None,
            }
        }
        Some(left)
    }

    /// Whether the owner may wait in a state in which time cannot pass.
    pub(super) fn may_rest(
        &self,
        state: &State,
        later: &State,
        moves: &[Move],
        possible: &[(&Move, State)],
    ) -> Result<bool, Error> {
        let owner = self.claim.owner;
        Ok(match self.rest(state, later, moves, possible)? {
            Rest::Must(player) => player != owner,
            Rest::Won(player) => player == owner,
        })
    }

    /// What becomes of play in a state in which time cannot pass if nobody wants to move. `later`
    /// is the state a little later, `moves` are those whose guards hold.
    pub(super) fn rest(
        &self,
        state: &State,
        later: &State,
        moves: &[Move],
        possible: &[(&Move, State)],
    ) -> Result<Rest, Error> {
        if self.is_obliged(state) {
            return Ok(Rest::Must(Owner::Controller));
        }
        let has_own = possible.iter().any(|(one, _)| one.controllable);
        let has_other = possible.iter().any(|(one, _)| !one.controllable);
        // Where play stops at a goal that is to recur, nothing is owed.
        let aim = match self.claim.aim {
            Aim::Recur if self.is_goal(state)? => Aim::Keep,
            other => other,
        };
        if has_other && self.is_forced(state, later, moves, possible)? {
            return Ok(Rest::Must(Owner::Environment));
        }
        Ok(match aim {
            Aim::Keep if has_own => Rest::Must(Owner::Controller),
            Aim::Keep => Rest::Won(Owner::Controller),
            Aim::Reach | Aim::Recur => Rest::Won(Owner::Environment),
        })
    }

    /// The decisions that apply.
    pub(super) fn decisions(&self, state: &State) -> Vec<&'a Decision> {
        let (unit, is_permissive) = (self.semantics.ticks_per_unit(), self.claim.is_permissive);
        let decisions = self.decisions_of(&state.words);
        decisions.map_or_else(Vec::new, |all| all.at(&state.clocks, unit, is_permissive))
    }

    /// All decisions for words.
    pub(super) fn decisions_of(&self, words: &[i32]) -> Option<&'a Decisions> {
        let words = identity(self.semantics.network(), words);
        self.strategy.get(words).copied()
    }

    /// Whether the environment must move in a state in which time cannot pass.
    fn is_forced(
        &self,
        state: &State,
        later: &State,
        moves: &[Move],
        possible: &[(&Move, State)],
    ) -> Result<bool, Error> {
        let mut own = possible.iter().filter(|(one, _)| one.controllable);
        match self.claim.forcing {
            Forcing::Always => return Ok(true),
            Forcing::Network => return Ok(own.next().is_none()),
            Forcing::Component => {}
        }
        // An urgent synchronisation with clock guards may stop time before it is possible.
        let may_be_channel = self.semantics.network().features.clock_guarded_urgent
            || moves.iter().any(|one| one.is_urgent);
        if own.clone().next().is_none() && may_be_channel {
            return Ok(true);
        }
        for process in 0..self.semantics.network().processes.len() {
            let stops = self.semantics.is_urgent(process, state)
                || !self.semantics.invariant_holds(process, later)?;
            let takes_part = |one: &Move| {
                one.parts
                    .iter()
                    .any(|part| part.process as usize == process)
            };
            if stops && !own.clone().any(|(one, _)| takes_part(one)) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn identity<'w>(network: &Network, words: &'w [i32]) -> &'w [i32] {
    &words[..network.layout.identity_words as usize]
}

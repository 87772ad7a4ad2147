//! Closing the loop of a strategy that goes by observations: the machine against every move of the
//! environment.
//!
//! As long as the observation stays the same, so does the state of the machine, and its action is
//! proposed: where it is possible, it is taken or the environment moves; elsewhere the environment
//! moves, or time passes. When the observation changes, the machine goes to the state that it has
//! for the new one. It is right if
//! * it has a state for every observation that is met before the goal, and what must be kept holds
//!   until then;
//! * where time cannot pass and its action is not possible, the environment has to move, or, if the
//!   controller has only to keep something, may stop: as for a strategy that waits there
//!   ([`super::strategy`]);
//! * if the goal has to be reached, no play continues forever without it.
//!
//! From which states the machine wins is computed on sets of clock values ([`super::winning`]), at
//! each of its stages ([`super::machine`]). Where it does not win from where play begins, a run
//! over regions shows it (see [`super::regions`]), whose constants include those of the
//! observations: the first one that is wrong, or goes in a circle before the goal. With strict
//! invariants, play is followed over regions alone, and a machine is right if no run is wrong.
//!
//! What the machine says that it knows is not used.
//!
//! Cost: that of [`super::winning`], for each stage. On regions each pair of a state of the machine
//! and a region, and its moves, are visited once; memory for each pair.

use std::collections::HashMap;

use crate::ir::{Network, Predicate};

use super::defects::MOST_REGIONS;
use super::effort::{Effort, GivenUp};
use super::machine::{Machine, proposes};
use super::moves::{Error, State};
use super::outcome::{Coverage, Defect, Kind, Outcome, Step, Violation};
use super::regions::Regions;
use super::rules::{Aim, Claim, Owner, Rest, Rules};
use super::winning::Winning;

pub use super::machine::{Action, MachineState};

/// Checks a machine of the controller, who sees `observations`, with this effort: each zone that is
/// judged counts. The constants of the observations must be among those of the claim.
pub fn verify(
    network: &Network,
    machine: &[MachineState],
    observations: &[Predicate],
    claim: &Claim<'_>,
    effort: &mut Effort<'_>,
) -> Result<Outcome, Error> {
    let unit = Regions::ticks_per_unit(network);
    let mut play = Play {
        rules: Rules::new(network, unit, &[], claim),
        regions: Regions::new(network, claim.constant, claim.has_differences)?,
        machine,
        observations,
        seen: HashMap::new(),
        path: Vec::new(),
        coverage: Coverage {
            kind: Kind::Regions,
            ..Coverage::default()
        },
    };
    if machine.is_empty() || network.features.strict_invariants {
        return play.run(u64::MAX, effort);
    }
    let mut first = play.rules.semantics.initial()?;
    let seen = play.observe(&first)?;
    let machine = Machine::new(machine, observations, seen);
    let rules = Rules::new(network, unit, &[], claim).with_machine(machine);
    play.regions.represent_state(&mut first);
    let mut winning = match Winning::new(&rules, &first.words, false, effort)? {
        Ok(winning) => winning,
        Err((why, coverage)) => return Ok(Outcome::GivenUp(why, coverage)),
    };
    let coverage = winning.coverage();
    effort.restart_count();
    match winning.solve((&first.words, &first.clocks), effort)? {
        Ok(true) => return Ok(Outcome::Verified(coverage)),
        Ok(false) => {}
        Err(why) => return Ok(Outcome::GivenUp(why, coverage)),
    }
    effort.restart_count();
    if let Outcome::Violated(violation, _) = play.run(MOST_REGIONS, effort)? {
        return Ok(Outcome::Violated(violation, coverage));
    }
    let violation = Violation {
        defect: Defect::Lost,
        states: vec![first],
        steps: Vec::new(),
        ticks_per_unit: unit,
    };
    Ok(Outcome::Violated(Box::new(violation), coverage))
}

/// Where play stands: the state of the machine, and the region.
type Place = (usize, State);

/// A step with where it leads to; the number is missing where the machine has no state for what is
/// observed there.
type Successor = (Step, Option<usize>, State);

/// A place on the path, with its successors that must still be visited.
struct Frame {
    place: Place,
    successors: Vec<Successor>,
    taken: Option<Step>,
}

struct Play<'a> {
    rules: Rules<'a>,
    regions: Regions,
    machine: &'a [MachineState],
    observations: &'a [Predicate],
    /// By place: whether all plays from it are right; if not, it is on the path.
    seen: HashMap<Place, bool>,
    path: Vec<Frame>,
    coverage: Coverage,
}

impl Play<'_> {
    /// Follows play over at most so many regions.
    fn run(&mut self, most: u64, effort: &mut Effort<'_>) -> Result<Outcome, Error> {
        let mut initial = self.rules.semantics.initial()?;
        self.regions.represent_state(&mut initial);
        let first = (!self.machine.is_empty()).then_some(0);
        if let Some(defect) = self.enter(first, &initial)? {
            return Ok(self.violated(defect));
        }
        while let Some(frame) = self.path.last_mut() {
            let Some((step, number, target)) = frame.successors.pop() else {
                let frame = self.path.pop().expect("the path has an end");
                self.seen.insert(frame.place, true);
                continue;
            };
            frame.taken = Some(step);
            if let Some(number) = number {
                let place = (number, target.clone());
                match self.seen.get(&place) {
                    Some(false) if self.rules.claim.aim != Aim::Keep => {
                        self.push(place);
                        return Ok(self.violated(Defect::Endless));
                    }
                    Some(_) => continue,
                    None => {}
                }
            }
            let is_over = effort.is_over(self.coverage.parts);
            let is_long = (self.coverage.parts >= most).then_some(GivenUp::TooLarge);
            if let Some(why) = is_over.or(is_long) {
                return Ok(Outcome::GivenUp(why, self.coverage));
            }
            if let Some(defect) = self.enter(number, &target)? {
                return Ok(self.violated(defect));
            }
        }
        Ok(Outcome::Verified(self.coverage))
    }

    fn push(&mut self, place: Place) {
        self.path.push(Frame {
            place,
            successors: Vec::new(),
            taken: None,
        });
    }

    fn violated(&mut self, defect: Defect) -> Outcome {
        let (mut states, mut steps) = (Vec::new(), Vec::new());
        for frame in self.path.drain(..) {
            states.push(frame.place.1);
            steps.extend(frame.taken);
        }
        let violation = Violation {
            defect,
            states,
            steps,
            ticks_per_unit: self.rules.semantics.ticks_per_unit(),
        };
        Outcome::Violated(Box::new(violation), self.coverage)
    }

    /// Puts a new place on the path, with its successors; what is wrong with it.
    fn enter(&mut self, number: Option<usize>, state: &State) -> Result<Option<Defect>, Error> {
        self.coverage.parts += 1;
        let place = (number.unwrap_or(self.machine.len()), state.clone());
        self.push(place.clone());
        match self.rules.winner(state)? {
            Some(Owner::Controller) => self.coverage.goals += 1,
            Some(Owner::Environment) => return Ok(Some(Defect::Broken)),
            None => {
                let Some(number) = number else {
                    return Ok(Some(Defect::NoDecision));
                };
                match self.successors(number, state)? {
                    Err(defect) => return Ok(Some(defect)),
                    Ok(successors) => {
                        let frame = self.path.last_mut().expect("it was just put there");
                        frame.successors = successors;
                    }
                }
            }
        }
        self.seen.insert(place, false);
        Ok(None)
    }

    /// Where play may go from a place.
    fn successors(
        &mut self,
        number: usize,
        state: &State,
    ) -> Result<Result<Vec<Successor>, Defect>, Error> {
        let moves = self.rules.semantics.moves(state)?;
        let possible = self.rules.possible(state, &moves)?;
        let action = self.machine[number].action;
        let mut steps = Vec::new();
        let mut is_possible = false;
        for (one, target) in &possible {
            let network = self.rules.semantics.network();
            let is_own = one.controllable && proposes(network, action, &one.parts, one.channel);
            if is_own {
                self.coverage.own_moves += 1;
                is_possible = true;
            } else if one.controllable {
                continue;
            } else {
                self.coverage.opponent_moves += 1;
            }
            let mut target = target.clone();
            self.regions.represent_state(&mut target);
            steps.push((Step::Move((*one).clone()), target));
        }
        if !is_possible {
            let mut later = state.clone();
            self.regions.pass(&mut later.clocks);
            if !self.rules.semantics.is_time_stopped(state, &moves)
                && self.rules.semantics.invariants_hold(&later)?
            {
                steps.push((Step::Time, later));
            } else {
                match self.rules.rest(state, &later, &moves, &possible)? {
                    Rest::Must(Owner::Environment) | Rest::Won(Owner::Controller) => {}
                    Rest::Must(Owner::Controller) | Rest::Won(Owner::Environment) => {
                        return Ok(Err(Defect::Stuck));
                    }
                }
            }
        }
        let before = self.observe(state)?;
        let mut successors = Vec::with_capacity(steps.len());
        for (step, target) in steps {
            let seen = self.observe(&target)?;
            let next = if seen == before {
                Some(number)
            } else {
                let mut next = self.machine[number].next.iter();
                next.find(|(one, _)| *one == seen).map(|(_, next)| *next)
            };
            successors.push((step, next, target));
        }
        Ok(Ok(successors))
    }

    /// What the controller sees in a state.
    fn observe(&self, state: &State) -> Result<Vec<bool>, Error> {
        let observations = self.observations.iter();
        observations
            .map(|one| self.rules.semantics.holds(one, state))
            .collect()
    }
}

//! Closing the loop of a strategy that goes by observations: the machine against every move of the
//! environment.
//!
//! The play goes over pairs of a state of the machine and a region (see [`super::regions`]), whose
//! constants include those of the observations. As long as the observation stays the same, so does
//! the state of the machine, and its action is proposed: where it is possible, it is taken or the
//! environment moves; elsewhere the environment moves, or time passes to the next region. When the
//! observation changes, the machine goes to the state that it has for the new one. It is right if
//! * it has a state forevery observation that is met before the goal, and what must be kept holds
//!   until then;
//! * where time cannot pass and its action is not possible, the environment has to move, or, if the
//!   controller has only to keep something, may stop: as for a strategy that waits there
//!   ([`super::strategy`]);
//! * if the goal has to be reached, the graph up to the goals has no cycle, not even a region
//!   without end.
//!
//! What the machine says that it knows is not used.
//!
//! Cost: each pair and its moves are visited once; memory for each pair.

use std::collections::HashMap;

use crate::ir::{Network, Predicate};

use super::effort::Effort;
use super::moves::{Error, Move, Part, State};
use super::outcome::{Coverage, Defect, Kind, Outcome, Step, Violation};
use super::regions::Regions;
use super::rules::{Aim, Claim, Owner, Rest, Rules, entry};

/// What the controller proposes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing.
    Wait,
    /// Synchronisations on the channel with this index between controllable edges.
    Channel(u32),
    /// A controllable edge without a channel.
    Edge {
        /// Index of the process.
        process: u32,
        /// Index of the edge in its process.
        edge: u32,
        /// Which combination of `select` values.
        select: u32,
    },
}

/// A state of the machine; the first one is the initial one.
#[derive(Clone, Debug)]
pub struct MachineState {
    /// What is proposed.
    pub action: Action,
    /// By next observation: the index of the next state.
    pub next: Vec<(Vec<bool>, usize)>,
}

/// Checks a machine of the controller, who sees `observations`, with this effort: each pair of a
/// state of it and a region counts. The constants of the observations must be among those of the
/// claim.
pub fn verify(
    network: &Network,
    machine: &[MachineState],
    observations: &[Predicate],
    claim: &Claim<'_>,
    effort: &mut Effort<'_>,
) -> Result<Outcome, Error> {
    let mut play = Play {
        rules: Rules::new(network, Regions::ticks_per_unit(network), &[], claim),
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
    play.run(effort)
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
    fn run(&mut self, effort: &mut Effort<'_>) -> Result<Outcome, Error> {
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
            if let Some(why) = effort.is_over(self.coverage.parts) {
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
            let is_own = proposes(self.rules.semantics.network(), action, one);
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

/// Whether an action proposes a move.
fn proposes(network: &Network, action: Action, one: &Move) -> bool {
    let part = one.parts[0];
    let edge = &network.processes[part.process as usize].edges[part.edge as usize];
    // Legs with channels are proposed by their entry.
    let is_edge = match &edge.leg {
        Some(leg) if !leg.follows_sync => true,
        _ => one.channel.is_none(),
    };
    one.controllable
        && match action {
            Action::Wait => false,
            Action::Channel(channel) => !is_edge && one.channel == Some(channel),
            Action::Edge {
                process,
                edge,
                select,
            } => {
                let proposed = Part {
                    process,
                    edge,
                    branch: 0,
                    select,
                };
                is_edge && entry(network, &[part]) == entry(network, &[proposed])
            }
        }
}

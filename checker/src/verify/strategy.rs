//! Closing the loop: a strategy against every move of the environment.
//!
//! The play goes over regions (see [`super::regions`]), whose constants include those of the strategy, so that each region has
//! one decision. From a region in which the strategy waits, the environment may make any of its moves, or time passes to the
//! next region; from one in which it acts, the environment may still be first. The strategy is right if
//! * every region that is met before the goal satisfies what must be kept and has a decision;
//! * every action is one of the moves of the state, is the controller's, and its target satisfies the invariants;
//! * where the strategy waits and time cannot pass, the environment has a move and must take it (see [`Forcing`]);
//! * no play goes on for ever without the goal: the graph up to the goals has no cycle, not even a region without end.
//!
//! Cost: one look at each region and move of the closed loop; memory for each region.

use std::collections::HashMap;

use crate::ir::{Network, Predicate};

use super::concrete::{Error, Move, Part, Semantics, State};
use super::regions::Regions;

/// `left - right < bound`, or `<=` if not strict; clocks by index, 0 for the reference clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the formula says it")]
pub struct Constraint {
    pub left: usize,
    pub right: usize,
    pub bound: i32,
    pub strict: bool,
}

/// What to do in some zones.
#[derive(Clone, Debug)]
pub struct Decision {
    /// Where it applies: in one of these conjunctions.
    pub zones: Vec<Vec<Constraint>>,
    /// The move to take; `None` is to wait.
    pub action: Option<Vec<Part>>,
}

/// The decisions of the states with some words, in order: the first whose zones contain the clock values applies.
#[derive(Clone, Debug)]
pub struct Decisions {
    /// The words.
    pub words: Vec<i32>,
    /// The decisions.
    pub decisions: Vec<Decision>,
}

/// When the environment must move at a point where time cannot pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forcing {
    /// If something stops time to which the controller has no move: a process by its location or invariant, or the network
    /// by an urgent channel.
    Component,
    /// If the controller has no move at all.
    Network,
    /// Always.
    Always,
}

/// What is claimed.
#[derive(Clone, Copy, Debug)]
pub struct Claim<'a> {
    /// What is reached.
    pub goal: &'a Predicate,
    /// What holds until then.
    pub keep: Option<&'a Predicate>,
    /// When the environment must move.
    pub forcing: Forcing,
    /// The greatest constant, in absolute value, of the clock comparisons of the two predicates.
    pub constant: i64,
    /// Whether the predicates compare differences of clocks.
    pub has_differences: bool,
}

/// What was looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// Regions of the closed loop, goals included.
    pub regions: u64,
    /// Moves of the controller that the strategy makes.
    pub own_moves: u64,
    /// Moves of the environment that it is met by.
    pub opponent_moves: u64,
    /// Regions in which play ends because the goal holds.
    pub goals: u64,
}

/// What is wrong with a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// There is no decision.
    NoDecision,
    /// The move of the decision is not possible, or not the controller's.
    ImpossibleAction,
    /// What must be kept does not hold.
    Broken,
    /// The strategy waits, time cannot pass, and nobody must move.
    Stuck,
    /// The play goes on for ever without the goal.
    Endless,
}

/// A step of a run.
#[derive(Clone, Debug)]
pub enum Step {
    /// Time passes into the next region.
    Time,
    /// A move.
    Move(Move),
}

/// A run that shows a defect: it begins in the initial state.
#[derive(Clone, Debug)]
pub struct Violation {
    /// What is wrong in the last state.
    pub defect: Defect,
    /// The states, with the values of one valuation of each region in ticks.
    pub states: Vec<State>,
    /// The steps between them, one less.
    pub steps: Vec<Step>,
    /// How many ticks make one unit of time.
    pub ticks_per_unit: i64,
}

/// How a check ended.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The strategy does what is claimed.
    Verified(Coverage),
    /// It does not.
    Violated(Box<Violation>, Coverage),
    /// More regions than allowed.
    TooLarge(Coverage),
}

/// Checks a strategy; gives up above `most_regions`.
pub fn verify(
    network: &Network,
    strategy: &[Decisions],
    claim: &Claim<'_>,
    most_regions: u64,
) -> Result<Outcome, Error> {
    let all = strategy.iter().flat_map(|state| &state.decisions);
    let zones = all.flat_map(|decision| decision.zones.iter().flatten());
    let constants = zones.clone().map(|one| i64::from(one.bound).abs());
    let constant = constants.max().unwrap_or(0).max(claim.constant);
    let mut zones = zones;
    let has_differences = claim.has_differences || zones.any(|one| one.left != 0 && one.right != 0);
    let mut play = Play {
        semantics: Semantics::new(network, Regions::ticks_per_unit(network)),
        regions: Regions::new(network, constant, has_differences)?,
        strategy: strategy
            .iter()
            .map(|state| (identity(network, &state.words), state))
            .collect(),
        claim,
        seen: HashMap::new(),
        path: Vec::new(),
        coverage: Coverage::default(),
    };
    play.run(most_regions)
}

fn identity<'w>(network: &Network, words: &'w [i32]) -> &'w [i32] {
    &words[..network.layout.identity_words as usize]
}

/// Where a region stands in the depth-first search.
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    /// On the path at hand.
    Open,
    /// All plays from it reach the goal.
    Done,
}

/// A region on the path, with its successors that are still to be looked at.
struct Frame {
    state: State,
    successors: Vec<(Step, State)>,
    taken: Option<Step>,
}

struct Play<'a> {
    semantics: Semantics<'a>,
    regions: Regions,
    strategy: HashMap<&'a [i32], &'a Decisions>,
    claim: &'a Claim<'a>,
    seen: HashMap<State, Mark>,
    path: Vec<Frame>,
    coverage: Coverage,
}

impl<'a> Play<'a> {
    fn run(&mut self, most_regions: u64) -> Result<Outcome, Error> {
        let mut initial = self.semantics.initial()?;
        self.regions.represent_state(&mut initial);
        if let Some(defect) = self.enter(initial)? {
            return Ok(self.violated(defect));
        }
        while let Some(frame) = self.path.last_mut() {
            let Some((step, target)) = frame.successors.pop() else {
                let frame = self.path.pop().expect("the path has an end");
                self.seen.insert(frame.state, Mark::Done);
                continue;
            };
            frame.taken = Some(step);
            match self.seen.get(&target) {
                Some(Mark::Done) => continue,
                Some(Mark::Open) => {
                    self.push(target, Vec::new());
                    return Ok(self.violated(Defect::Endless));
                }
                None => {}
            }
            if self.coverage.regions >= most_regions {
                return Ok(Outcome::TooLarge(self.coverage));
            }
            if let Some(defect) = self.enter(target)? {
                return Ok(self.violated(defect));
            }
        }
        Ok(Outcome::Verified(self.coverage))
    }

    fn push(&mut self, state: State, successors: Vec<(Step, State)>) {
        self.path.push(Frame {
            state,
            successors,
            taken: None,
        });
    }

    fn violated(&mut self, defect: Defect) -> Outcome {
        let mut states = Vec::new();
        let mut steps = Vec::new();
        for frame in self.path.drain(..) {
            states.push(frame.state);
            steps.extend(frame.taken);
        }
        let violation = Violation {
            defect,
            states,
            steps,
            ticks_per_unit: self.semantics.ticks_per_unit(),
        };
        Outcome::Violated(Box::new(violation), self.coverage)
    }

    /// Puts a new region on the path, with its successors in the closed loop; what is wrong with it.
    fn enter(&mut self, state: State) -> Result<Option<Defect>, Error> {
        self.coverage.regions += 1;
        self.seen.insert(state.clone(), Mark::Open);
        if self.semantics.holds(self.claim.goal, &state)? {
            self.coverage.goals += 1;
            self.push(state, Vec::new());
            return Ok(None);
        }
        self.push(state.clone(), Vec::new());
        if let Some(keep) = self.claim.keep
            && !self.semantics.holds(keep, &state)?
        {
            return Ok(Some(Defect::Broken));
        }
        match self.successors(&state)? {
            Err(defect) => Ok(Some(defect)),
            Ok(successors) => {
                let frame = self.path.last_mut().expect("the region was just put there");
                frame.successors = successors;
                Ok(None)
            }
        }
    }

    /// Where play may go from a region under the strategy.
    fn successors(&mut self, state: &State) -> Result<Result<Vec<(Step, State)>, Defect>, Error> {
        let Some(decision) = self.decision(state) else {
            return Ok(Err(Defect::NoDecision));
        };
        let moves = self.semantics.moves(state)?;
        let mut targets = Vec::new();
        for one in &moves {
            if let Some(mut target) = self.semantics.take(state, &one.parts)? {
                self.regions.represent_state(&mut target);
                targets.push((one, target));
            }
        }
        let opponent = targets.iter().filter(|(one, _)| !one.controllable);
        let mut successors: Vec<(Step, State)> = opponent
            .map(|(one, target)| (Step::Move((*one).clone()), target.clone()))
            .collect();
        self.coverage.opponent_moves += successors.len() as u64;
        if let Some(action) = &decision.action {
            let mut own = targets.into_iter();
            let Some((one, target)) = own.find(|(one, _)| one.controllable && one.parts == *action)
            else {
                return Ok(Err(Defect::ImpossibleAction));
            };
            self.coverage.own_moves += 1;
            successors.push((Step::Move(one.clone()), target));
            return Ok(Ok(successors));
        }
        let mut later = state.clone();
        self.regions.pass(&mut later.clocks);
        if !self.semantics.is_time_stopped(state, &moves)
            && self.semantics.invariants_hold(&later)?
        {
            successors.push((Step::Time, later));
        } else if successors.is_empty() || !self.is_forced(state, &later, &moves, &targets)? {
            return Ok(Err(Defect::Stuck));
        }
        Ok(Ok(successors))
    }

    /// The decision that applies.
    fn decision(&self, state: &State) -> Option<&'a Decision> {
        let words = identity(self.semantics.network(), &state.words);
        let unit = self.semantics.ticks_per_unit();
        let holds = |one: &Constraint| {
            let difference = state.clocks[one.left] - state.clocks[one.right];
            let bound = i64::from(one.bound) * unit;
            difference < bound || (!one.strict && difference == bound)
        };
        let decisions: &'a Decisions = self.strategy.get(words)?;
        let applies =
            |decision: &&Decision| decision.zones.iter().any(|zone| zone.iter().all(holds));
        decisions.decisions.iter().find(applies)
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
        if own.clone().next().is_none() && moves.iter().any(|one| one.is_urgent) {
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

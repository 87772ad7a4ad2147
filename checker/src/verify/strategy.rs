//! Closing the loop: a strategy against every move of its opponent.
//!
//! The play goes over regions (see [`super::regions`]), whose constants include those of the
//! strategy, so that each region has one list of decisions. From a region in which the strategy
//! waits, the opponent may make any of its moves, or time passes to the next region. Where the
//! controller acts, the environment may still be first; where the environment acts, it is first. A
//! strategy of the controller is right if
//! * every region that is met before the goal satisfies what must be kept and has a decision;
//! * every action is one of the moves of the state, is the controller's, and its target satisfies
//!   the invariants; whichever branches of its edges the environment picks, play continues
//!   correctly;
//! * where it waits and time cannot pass, the environment has a move and must take it (see
//!   [`Forcing`]); if it has only to keep something, play may also stop there, if the controller
//!   has no move;
//! * if it has to reach the goal, no play continues forever without it: the graph up to the goals
//!   has no cycle, not even a region without end; if the goal must recur, the same holds from each
//!   goal on.
//!
//! One of the environment, which may say which branches of the controller's edges it picks, is
//! right if no play meets the goal before what must be kept is broken, every decision is there and
//! possible, and
//! * against a controller that has to reach the goal, it never waits where it must move;
//! * against one that has to keep something, every play ends in a region in which that is broken;
//! * against one whose goal is to recur, no cycle of the graph has a goal in it, and no play stops
//!   at one.
//!
//! If the game is played under a strategy of the controller ([`Claim::under`]), the controller has
//! only the moves that this strategy allows. Where it does not allow waiting, no time passes: the
//! controller must move, and has lost if it cannot.
//!
//! Cost: each region and move of the closed loop is visited once; memory for each region.

use std::collections::{HashMap, HashSet};

use crate::ir::Network;

use super::effort::{Effort, GivenUp};
use super::moves::{Error, Move, State};
use super::regions::Regions;
use super::rules::Rules;
use super::timed::{Timed, least_multiple};

pub use super::rules::{Aim, Claim, Constraint, Decision, Decisions, Forcing, Owner};

/// What was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// Regions of the closed loop, goals included.
    pub regions: u64,
    /// Moves that the strategy makes.
    pub own_moves: u64,
    /// Moves of the opponent that it is met by.
    pub opponent_moves: u64,
    /// Regions in which play ends, won.
    pub goals: u64,
}

/// What is wrong with a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// There is no decision.
    NoDecision,
    /// The move of the decision is not possible, or not the owner's.
    ImpossibleAction,
    /// What must be kept does not hold.
    Broken,
    /// The goal holds, against the environment.
    GoalReached,
    /// The strategy waits where time cannot pass, although play may stop there, lost, or it must
    /// move itself.
    Stuck,
    /// Play continues forever without what the owner wants.
    Endless,
    /// The goal comes again and again, against the environment.
    Recurring,
    /// The strategy is for another start or time limit than what is asked.
    OtherGame,
    /// The way to where it begins is not possible.
    ImpossibleWay,
}

/// A step of a run.
#[derive(Clone, Debug)]
pub enum Step {
    /// Time passes into the next region.
    Time,
    /// A move.
    Move(Move),
}

/// Where play begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In the initial state.
    Initial,
    /// In this state.
    State(Timed),
    /// In every state that the model can get to: the strategy must win from each.
    Anywhere,
}

/// A run that shows a defect: it begins where play does.
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
    /// There is more to check than is allowed.
    GivenUp(GivenUp, Coverage),
}

/// Checks a strategy, with this effort.
pub fn verify(
    network: &Network,
    strategy: &[Decisions],
    claim: &Claim<'_>,
    start: &Origin,
    effort: &mut Effort<'_>,
) -> Result<Outcome, Error> {
    let under = claim.under.map_or(&[][..], |(under, _)| under);
    let all = strategy.iter().chain(under);
    let all = all.flat_map(|state| state.decisions.iter().chain(&state.legs));
    let zones = all.flat_map(|decision| decision.zones.iter().flatten());
    let constants = zones.clone().map(|one| i64::from(one.bound).abs());
    let constant = constants.max().unwrap_or(0).max(claim.constant);
    let mut zones = zones;
    let has_differences = claim.has_differences || zones.any(|one| one.left != 0 && one.right != 0);
    let mut ticks_per_unit = Regions::ticks_per_unit(network);
    if let Origin::State(timed) = start {
        ticks_per_unit = least_multiple(ticks_per_unit, timed.ticks_per_unit)
            .ok_or(Error::Unsupported("times so fine"))?;
    }
    let rules = Rules::new(network, ticks_per_unit, strategy, claim);
    let regions = Regions::new(network, constant, has_differences)?;
    let regions = regions.with_ticks_per_unit(ticks_per_unit);
    let mut first = match start {
        Origin::Initial | Origin::Anywhere => rules.semantics.initial()?,
        Origin::State(timed) => {
            let timed = timed
                .at_multiple_of(ticks_per_unit)
                .filter(|timed| timed.ticks_per_unit == ticks_per_unit);
            timed.ok_or(Error::Unsupported("times so fine"))?.state
        }
    };
    regions.represent_state(&mut first);
    let mut play = Play {
        rules,
        regions,
        start: first.clone(),
        seen: HashMap::new(),
        path: Vec::new(),
        followed: HashSet::new(),
        goals: Vec::new(),
        is_from_goal: false,
        coverage: Coverage::default(),
    };
    if *start != Origin::Anywhere {
        return play.run(vec![first], effort);
    }
    match play.reachable(first, effort)? {
        Ok(regions) => play.run(regions, effort),
        Err(why) => Ok(Outcome::GivenUp(why, play.coverage)),
    }
}

/// Where a region stands in the depth-first search.
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    /// On the current path.
    Open,
    /// All plays from it are right.
    Done,
}

/// A region on the path, with its successors that must still be visited.
struct Frame {
    state: State,
    successors: Vec<(Step, State)>,
    taken: Option<Step>,
}

struct Play<'a> {
    rules: Rules<'a>,
    regions: Regions,
    /// The region in which play begins, or from which those are reached in which it may.
    start: State,
    seen: HashMap<State, Mark>,
    path: Vec<Frame>,
    /// The regions that the searches back from goals which must not recur have met.
    followed: HashSet<State>,
    /// Goals that are to recur and were met, with their successors.
    goals: Vec<(State, Vec<(Step, State)>)>,
    /// Whether the path begins in a goal and not where play does.
    is_from_goal: bool,
    coverage: Coverage,
}

impl Play<'_> {
    /// The regions that the model can get to, the last one first, unless they are too many.
    fn reachable(
        &mut self,
        first: State,
        effort: &mut Effort<'_>,
    ) -> Result<Result<Vec<State>, GivenUp>, Error> {
        let mut found = HashSet::from([first.clone()]);
        let mut all = vec![first];
        let mut next = 0;
        while let Some(state) = all.get(next).cloned() {
            next += 1;
            let moves = self.rules.semantics.moves(&state)?;
            let possible = self.rules.possible(&state, &moves)?;
            let mut targets: Vec<State> = possible.into_iter().map(|(_, target)| target).collect();
            targets.extend(self.later(&state, &moves)?);
            for mut target in targets {
                self.regions.represent_state(&mut target);
                if found.insert(target.clone()) {
                    all.push(target);
                }
            }
            if let Some(why) = effort.is_over(all.len() as u64) {
                self.coverage.regions = all.len() as u64;
                return Ok(Err(why));
            }
        }
        all.reverse();
        effort.restart_count();
        Ok(Ok(all))
    }

    /// Follows play from these regions, the last one first.
    fn run(&mut self, mut starts: Vec<State>, effort: &mut Effort<'_>) -> Result<Outcome, Error> {
        loop {
            let Some(frame) = self.path.last_mut() else {
                if let Some(start) = starts.pop() {
                    if !self.seen.contains_key(&start)
                        && let Some(defect) = self.enter(&start)?
                    {
                        return self.violated(defect);
                    }
                    continue;
                }
                // From each goal that is to recur, play is followed again.
                let Some((goal, successors)) = self.goals.pop() else {
                    return Ok(Outcome::Verified(self.coverage));
                };
                self.push(goal, successors);
                self.is_from_goal = true;
                continue;
            };
            let Some((step, target)) = frame.successors.pop() else {
                if let Some(outcome) = self.leave()? {
                    return Ok(outcome);
                }
                let frame = self.path.pop().expect("the path has an end");
                self.seen.insert(frame.state, Mark::Done);
                continue;
            };
            frame.taken = Some(step);
            match self.seen.get(&target) {
                Some(Mark::Done) => continue,
                Some(Mark::Open) if !self.rules.claim.must_end() => continue,
                Some(Mark::Open) => {
                    self.push(target, Vec::new());
                    return self.violated(Defect::Endless);
                }
                None => {}
            }
            if let Some(why) = effort.is_over(self.coverage.regions) {
                return Ok(Outcome::GivenUp(why, self.coverage));
            }
            if let Some(defect) = self.enter(&target)? {
                return self.violated(defect);
            }
        }
    }

    /// Looks for a way back from the last region of the path to itself or one before it, if it is a
    /// goal that the environment is to keep from recurring. All regions behind it were looked at.
    /// Source: C. Courcoubetis, M. Vardi, P. Wolper, M. Yannakakis, "Memory-Efficient Algorithms
    /// for the Verification of Temporal Properties", FMSD 1, 1992 (nested search).
    fn leave(&mut self) -> Result<Option<Outcome>, Error> {
        let claim = self.rules.claim;
        if claim.aim != Aim::Recur || claim.owner == Owner::Controller {
            return Ok(None);
        }
        let Some(last) = self.path.last() else {
            return Ok(None);
        };
        let goal = last.state.clone();
        if self.rules.winner(&goal)?.is_some() || !self.rules.is_goal(&goal)? {
            return Ok(None);
        }
        let coverage = self.coverage;
        let outer = self.path.len();
        // The frame of the goal stands for the first steps of the second search.
        self.path[outer - 1].successors = self.successors(&goal)?.unwrap_or_default();
        let mut found = None;
        while found.is_none() && self.path.len() >= outer {
            let frame = self.path.last_mut().expect("the path is long enough");
            let Some((step, target)) = frame.successors.pop() else {
                if self.path.len() == outer {
                    break;
                }
                self.path.pop();
                continue;
            };
            frame.taken = Some(step);
            if self.seen.get(&target) == Some(&Mark::Open) {
                self.push(target, Vec::new());
                found = Some(self.violated(Defect::Recurring)?);
            } else if self.followed.insert(target.clone()) {
                let successors = match self.rules.winner(&target)? {
                    Some(_) => Vec::new(),
                    None => self.successors(&target)?.unwrap_or_default(),
                };
                self.push(target, successors);
            }
        }
        self.coverage = coverage;
        Ok(found)
    }

    fn push(&mut self, state: State, successors: Vec<(Step, State)>) {
        self.path.push(Frame {
            state,
            successors,
            taken: None,
        });
    }

    fn violated(&mut self, defect: Defect) -> Result<Outcome, Error> {
        let mut states = Vec::new();
        let mut steps = Vec::new();
        if self.is_from_goal {
            let start = self.path[0].state.clone();
            (states, steps) = self.way_to(&start)?;
        }
        for frame in self.path.drain(..) {
            states.push(frame.state);
            steps.extend(frame.taken);
        }
        let violation = Violation {
            defect,
            states,
            steps,
            ticks_per_unit: self.rules.semantics.ticks_per_unit(),
        };
        Ok(Outcome::Violated(Box::new(violation), self.coverage))
    }

    /// A run of the closed loop from its start to a region that it reaches; the last state is left
    /// out.
    fn way_to(&mut self, end: &State) -> Result<(Vec<State>, Vec<Step>), Error> {
        let start = self.start.clone();
        let mut origins: HashMap<State, Option<(State, Step)>> = HashMap::new();
        let mut waiting = std::collections::VecDeque::from([start.clone()]);
        origins.insert(start, None);
        while let Some(state) = waiting.pop_front().filter(|state| state != end) {
            let Ok(successors) = self.successors(&state)? else {
                continue;
            };
            for (step, target) in successors {
                if !origins.contains_key(&target) {
                    origins.insert(target.clone(), Some((state.clone(), step)));
                    waiting.push_back(target);
                }
            }
        }
        let (mut states, mut steps) = (Vec::new(), Vec::new());
        let mut last = end.clone();
        while let Some(Some((state, step))) = origins.remove(&last) {
            states.insert(0, state.clone());
            steps.insert(0, step);
            last = state;
        }
        Ok((states, steps))
    }

    /// Puts a new region on the path, with its successors in the closed loop; what is wrong with
    /// it.
    fn enter(&mut self, state: &State) -> Result<Option<Defect>, Error> {
        self.coverage.regions += 1;
        self.seen.insert(state.clone(), Mark::Open);
        self.push(state.clone(), Vec::new());
        if let Some(winner) = self.rules.winner(state)? {
            return Ok(if winner == self.rules.claim.owner {
                self.coverage.goals += 1;
                None
            } else if winner == Owner::Controller {
                Some(Defect::GoalReached)
            } else {
                Some(Defect::Broken)
            });
        }
        match self.successors(state)? {
            Err(defect) => Ok(Some(defect)),
            Ok(successors)
                if self.rules.claim.aim == Aim::Recur
                    && self.rules.claim.owner == Owner::Controller
                    && self.rules.is_goal(state)? =>
            {
                self.coverage.goals += 1;
                self.goals.push((state.clone(), successors));
                Ok(None)
            }
            Ok(successors) => {
                let frame = self.path.last_mut().expect("the region was just put there");
                frame.successors = successors;
                Ok(None)
            }
        }
    }

    /// Where play may go from a region under the strategy.
    fn successors(&mut self, state: &State) -> Result<Result<Vec<(Step, State)>, Defect>, Error> {
        let moves = self.rules.semantics.moves(state)?;
        let mut possible = self.rules.possible(state, &moves)?;
        for (_, target) in &mut possible {
            self.regions.represent_state(target);
        }
        let decisions = self.rules.decisions(state);
        if decisions.is_empty() {
            return Ok(Err(Defect::NoDecision));
        }
        let mut successors: Vec<(Step, State)> = Vec::new();
        let mut acts_first = false;
        for action in decisions.iter().filter_map(|one| one.action.as_ref()) {
            let meant = self.rules.moves_of_action(action, &possible);
            if meant.is_empty() {
                return Ok(Err(Defect::ImpossibleAction));
            }
            self.coverage.own_moves += 1;
            acts_first = self.rules.claim.owner == Owner::Environment;
            let legs = meant.into_iter();
            successors
                .extend(legs.map(|(one, target)| (Step::Move((*one).clone()), target.clone())));
        }
        if !acts_first {
            let Some(others) = self.rules.others(state, &possible) else {
                return Ok(Err(Defect::ImpossibleAction));
            };
            let others = others.into_iter();
            let others = others.map(|(one, target)| (Step::Move((*one).clone()), target.clone()));
            let before = successors.len();
            successors.extend(others);
            self.coverage.opponent_moves += (successors.len() - before) as u64;
        }
        if decisions.iter().any(|one| one.action.is_none()) {
            if let Some(later) = self.later(state, &moves)? {
                successors.push((Step::Time, later));
            } else {
                let mut later = state.clone();
                self.regions.pass(&mut later.clocks);
                if !self.rules.may_rest(state, &later, &moves, &possible)? {
                    return Ok(Err(Defect::Stuck));
                }
            }
        }
        Ok(Ok(successors))
    }

    /// The region to which time passes; `None` if it cannot. `moves` are those whose guards hold.
    fn later(&self, state: &State, moves: &[Move]) -> Result<Option<State>, Error> {
        let mut later = state.clone();
        self.regions.pass(&mut later.clocks);
        let can_pass = !self.rules.semantics.is_time_stopped(state, moves)
            && !self.is_stopped_at_once(state, &later)?
            && !self.rules.is_obliged(state)
            && self.rules.semantics.invariants_hold(&later)?;
        Ok(can_pass.then_some(later))
    }

    /// Whether an urgent synchronisation is possible at all moments that follow a region: there is
    /// no first one to which time could pass.
    fn is_stopped_at_once(&self, state: &State, later: &State) -> Result<bool, Error> {
        let semantics = &self.rules.semantics;
        Ok(semantics.network().features.clock_guarded_urgent
            && self.regions.opens(&state.clocks)
            && semantics.moves(later)?.iter().any(|one| one.is_urgent))
    }
}

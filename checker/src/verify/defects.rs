//! A run that shows what is wrong with a strategy that does not win.
//!
//! Play is followed over regions (see [`super::regions`]), whose constants include those of the
//! strategy, so that each region has one list of decisions. Regions that are known to be won are
//! left out. What is found is read off concrete states and the rules, so that it holds whatever
//! said that the strategy does not win.
//!
//! Cost: each region and move of the closed loop that is not known to be won is visited once, until
//! something is found; memory for each region.

use std::collections::{HashMap, HashSet};

use super::effort::Effort;
use super::moves::{Error, Move, State};
use super::outcome::{Defect, Step, Violation};
use super::regions::Regions;
use super::rules::{Aim, Owner, Rules};

/// Regions that are looked at for a run: with more it could not be read either.
pub(super) const MOST_REGIONS: u64 = 200_000;

/// A run that shows that the owner of a strategy does not win from a state, or, if it has to win
/// from everywhere, from one that the model can get to from there. `is_won` knows of some states
/// that the owner wins from them. `None` if the run is too long.
pub(super) fn find(
    rules: &Rules<'_>,
    regions: Regions,
    start: State,
    is_everywhere: bool,
    is_won: &dyn Fn(&State) -> bool,
    effort: &mut Effort<'_>,
) -> Result<Option<Violation>, Error> {
    let mut play = Play {
        rules,
        regions,
        is_won,
        start: start.clone(),
        seen: HashMap::new(),
        path: Vec::new(),
        followed: HashSet::new(),
        goals: Vec::new(),
        is_from_goal: false,
        visited: 0,
    };
    effort.restart_count();
    if !is_everywhere {
        return play.run(vec![start], effort);
    }
    match play.reachable(start, effort)? {
        Some(regions) => play.run(regions, effort),
        None => Ok(None),
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

struct Play<'r, 'a> {
    rules: &'r Rules<'a>,
    regions: Regions,
    is_won: &'r dyn Fn(&State) -> bool,
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
    /// Regions that were visited.
    visited: u64,
}

impl Play<'_, '_> {
    /// The regions that the model can get to, the last one first, unless they are too many.
    fn reachable(
        &mut self,
        first: State,
        effort: &mut Effort<'_>,
    ) -> Result<Option<Vec<State>>, Error> {
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
            if all.len() as u64 >= MOST_REGIONS || effort.is_over(all.len() as u64).is_some() {
                return Ok(None);
            }
        }
        all.reverse();
        effort.restart_count();
        Ok(Some(all))
    }

    /// Follows play from these regions, the last one first.
    fn run(
        &mut self,
        mut starts: Vec<State>,
        effort: &mut Effort<'_>,
    ) -> Result<Option<Violation>, Error> {
        loop {
            let Some(frame) = self.path.last_mut() else {
                if let Some(start) = starts.pop() {
                    if !self.seen.contains_key(&start)
                        && let Some(defect) = self.enter(&start)?
                    {
                        return self.violated(defect).map(Some);
                    }
                    continue;
                }
                // From each goal that is to recur, play is followed again.
                let Some((goal, successors)) = self.goals.pop() else {
                    return Ok(None);
                };
                self.push(goal, successors);
                self.is_from_goal = true;
                continue;
            };
            let Some((step, target)) = frame.successors.pop() else {
                if let Some(violation) = self.leave()? {
                    return Ok(Some(violation));
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
                    return self.violated(Defect::Endless).map(Some);
                }
                None if (self.is_won)(&target) => continue,
                None => {}
            }
            if self.visited >= MOST_REGIONS || effort.is_over(self.visited).is_some() {
                return Ok(None);
            }
            if let Some(defect) = self.enter(&target)? {
                return self.violated(defect).map(Some);
            }
        }
    }

    /// Looks for a way back from the last region of the path to itself or one before it, if it is a
    /// goal that the environment is to keep from recurring. All regions behind it were looked at.
    /// Source: C. Courcoubetis, M. Vardi, P. Wolper, M. Yannakakis, "Memory-Efficient Algorithms
    /// for the Verification of Temporal Properties", FMSD 1, 1992 (nested search).
    fn leave(&mut self) -> Result<Option<Violation>, Error> {
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
        Ok(found)
    }

    fn push(&mut self, state: State, successors: Vec<(Step, State)>) {
        self.path.push(Frame {
            state,
            successors,
            taken: None,
        });
    }

    fn violated(&mut self, defect: Defect) -> Result<Violation, Error> {
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
        Ok(violation)
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
        self.visited += 1;
        self.seen.insert(state.clone(), Mark::Open);
        self.push(state.clone(), Vec::new());
        if let Some(winner) = self.rules.winner(state)? {
            return Ok(if winner == self.rules.claim.owner {
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
        let step = |(one, target): &(&Move, State)| (Step::Move((*one).clone()), target.clone());
        let mut successors: Vec<(Step, State)> = Vec::new();
        let mut acts_first = false;
        for action in decisions.iter().filter_map(|one| one.action.as_ref()) {
            let meant = self.rules.moves_of_action(action, &possible);
            if meant.is_empty() {
                return Ok(Err(Defect::ImpossibleAction));
            }
            acts_first = self.rules.claim.owner == Owner::Environment;
            successors.extend(meant.into_iter().map(step));
        }
        if !acts_first {
            let Some(others) = self.rules.others(state, &possible) else {
                return Ok(Err(Defect::ImpossibleAction));
            };
            successors.extend(others.into_iter().map(step));
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

    /// Whether an urgent synchronisation is possible at all moments that follow a region: time
    /// could not pass to a first one.
    fn is_stopped_at_once(&self, state: &State, later: &State) -> Result<bool, Error> {
        let semantics = &self.rules.semantics;
        Ok(semantics.network().features.clock_guarded_urgent
            && self.regions.opens(&state.clocks)
            && semantics.moves(later)?.iter().any(|one| one.is_urgent))
    }
}

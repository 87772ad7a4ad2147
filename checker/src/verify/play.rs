//! Playing against a strategy: what it does next, what its opponent can do until then, and who has
//! won.
//!
//! In a state with exact clock values both players lie in wait: the strategy acts at the first
//! moment at which it does not decide to wait, its opponent at any moment before. At the same
//! instant the environment is first. Where the strategy acts without a first moment, one is chosen
//! for it. Moves, forced moves and ends of play are those of [`super::strategy`].

use crate::ir::{ClockAtom, Network, Predicate};

use super::choices::doubled;
use super::concrete::Semantics;
use super::moments::{Moments, Stretch};
use super::moves::{Error, Move, Part, State, is_same_entry};
use super::rules::{Aim, Claim, Decisions, Owner, Rest, Rules};
use super::timed::Timed;

/// What a strategy does in a state if nothing else happens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Advice {
    /// The decisions that apply, by index.
    pub now: Vec<usize>,
    /// If one of them is to wait: for how long, and what then.
    pub waiting: Option<Waiting>,
}

/// How long a strategy waits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Waiting {
    /// The half ticks after which it no longer waits, or the first moment that was chosen for it;
    /// `None` if it waits forever.
    pub half_ticks: Option<i64>,
    /// The decisions that apply then, by index.
    pub then: Vec<usize>,
}

/// What the decisions for the words of a state say.
pub fn advice(
    network: &Network,
    decisions: &Decisions,
    is_permissive: bool,
    timed: &Timed,
) -> Result<Advice, Error> {
    let unit = 2 * timed.ticks_per_unit;
    let semantics = Semantics::new(network, unit);
    let state = doubled(&timed.state);
    let is_stopped = semantics.stopped(&state)?;
    let moments = constants_of(network, decisions);
    let is_wait = |index: &usize| decisions.decisions[*index].action.is_none();
    let applying = |clocks: &[i64]| {
        let mut indices = decisions.indices_at(clocks, unit, is_permissive);
        let mut actions = Vec::new();
        // States that the solver distinguishes may allow the same.
        indices.retain(|&index| {
            let action = &decisions.decisions[index].action;
            let is_new = !actions.contains(&action);
            actions.push(action);
            is_new
        });
        indices
    };
    let mut advice = Advice {
        now: applying(&state.clocks),
        waiting: None,
    };
    if !advice.now.iter().any(is_wait) {
        return Ok(advice);
    }
    let mut waiting = Waiting {
        half_ticks: None,
        then: Vec::new(),
    };
    for stretch in moments.stretches(&state, &is_stopped, unit)? {
        let later = semantics.after(&state, stretch.moment)?;
        let then = applying(&later.clocks);
        if !then.iter().any(is_wait) {
            // Where nothing applies any more there is no moment to choose.
            let end = if then.is_empty() {
                stretch.first
            } else {
                first_tick(&stretch)
            };
            waiting.half_ticks = Some(end);
            waiting.then = then;
            break;
        }
    }
    advice.waiting = Some(waiting);
    Ok(advice)
}

/// The first moment of a stretch; of one without, the half tick after its beginning, which lies in
/// each such stretch of the wait however finely it is cut.
fn first_tick(stretch: &Stretch) -> i64 {
    stretch.first + i64::from(stretch.is_open())
}

/// The constants that distinguish the decisions for some words.
fn constants_of(network: &Network, decisions: &Decisions) -> Moments {
    let decisions = decisions.decisions.iter().chain(&decisions.legs);
    let zones = decisions.flat_map(|one| &one.zones);
    let constraints: Vec<_> = zones.flatten().collect();
    let constants = constraints.iter().flat_map(|one| {
        let bound = i64::from(one.bound);
        [bound, -bound]
    });
    let mut atoms = constraints.iter().map(|one| ClockAtom::from(**one));
    let has_differences = atoms.any(|atom| atom.is_difference());
    Moments::of_constants(network, constants.collect(), has_differences)
}

/// Moments of a wait at which something is possible, in half ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Where it begins.
    pub first: i64,
    /// Whether it begins only after that.
    pub is_first_open: bool,
    /// Where it ends; `None` without an end.
    pub last: Option<i64>,
    /// Whether it ends before that.
    pub is_last_open: bool,
}

impl Window {
    fn of(stretch: &Stretch) -> Window {
        Window {
            first: stretch.first,
            is_first_open: stretch.is_open(),
            last: stretch.last,
            is_last_open: stretch.is_open(),
        }
    }

    /// Whether it contains a fraction of a half tick.
    pub fn contains(&self, numerator: i128, denominator: i128) -> bool {
        let end = |end: i64| i128::from(end) * denominator;
        let is_after = |first| numerator > first || numerator == first && !self.is_first_open;
        let is_before = |last| numerator < last || numerator == last && !self.is_last_open;
        is_after(end(self.first)) && self.last.map(end).is_none_or(is_before)
    }
}

/// A move and when it is possible.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Its participants, the sender first.
    pub parts: Vec<Part>,
    /// When, in ascending order.
    pub windows: Vec<Window>,
}

/// Why play is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The goal holds.
    Goal,
    /// What must be kept does not hold.
    Broken,
    /// Time cannot pass, and nobody has to move.
    Stopped,
    /// Time passes forever.
    Endless,
}

/// What a strategy lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gap {
    /// It has no decision.
    NoDecision,
    /// Its action is not possible.
    ImpossibleAction,
    /// It waits where its owner has to move.
    MustMove,
}

/// What happens next if the opponent does not move.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Next {
    /// The strategy acts.
    Acts {
        /// What it says.
        action: Vec<Part>,
        /// The moves that this may be: several if the opponent picks among branches. These are
        /// replies too then.
        legs: Vec<Vec<Part>>,
    },
    /// Play is over, and this player has won.
    Won(Owner, Ending),
    /// The opponent has to move before.
    Must,
    /// The strategy does not say how to go on.
    Fails(Gap),
}

/// What can happen in a state.
#[derive(Clone, Debug)]
pub struct Situation {
    /// The moves of the opponent.
    pub replies: Vec<Timing>,
    /// The moves that the strategy allows its owner, if it is permissive.
    pub allowed: Vec<Timing>,
    /// For how long nothing need happen.
    pub waits: Window,
    /// What happens after [`Situation::half_ticks`] if the opponent does not move.
    pub next: Next,
    /// When, in half ticks; `None` if time passes forever.
    pub half_ticks: Option<i64>,
    /// Whether the goal holds now.
    pub is_goal: bool,
}

/// What can happen in a state if the owner of the claim follows the strategy. The network must hold
/// the code of the claim.
pub fn look(
    network: &Network,
    strategy: &[Decisions],
    claim: &Claim<'_>,
    timed: &Timed,
) -> Result<Situation, Error> {
    let unit = 2 * timed.ticks_per_unit;
    let rules = Rules::new(network, unit, strategy, claim);
    let state = doubled(&timed.state);
    let predicates: Vec<&Predicate> = claim.goal.into_iter().chain(claim.keep).collect();
    let mut moments = Moments::new(network, &predicates)?;
    let deciding = [
        rules.decisions_of(&state.words),
        rules.allowed_of(&state.words),
    ];
    for decisions in deciding.into_iter().flatten() {
        moments = moments.with(&constants_of(network, decisions));
    }
    let is_stopped = rules.semantics.stopped(&state)?;
    let stretches = moments.stretches(&state, &is_stopped, unit)?;
    let mut view = View {
        situation: Situation {
            replies: Vec::new(),
            allowed: Vec::new(),
            waits: Window::of(&stretches[0]),
            next: Next::Must,
            half_ticks: Some(0),
            is_goal: rules.is_goal(&state)?,
        },
        rules,
    };
    view.follow(&state, &stretches)?;
    Ok(view.situation)
}

struct View<'a> {
    rules: Rules<'a>,
    situation: Situation,
}

/// A stretch of the wait with its state and moves.
struct Passed {
    now: State,
    moves: Vec<super::Move>,
    is_time_stopped: bool,
}

impl View<'_> {
    /// Goes through the stretches until something has to happen.
    fn follow(&mut self, state: &State, stretches: &[Stretch]) -> Result<(), Error> {
        let mut before: Option<Passed> = None;
        for stretch in stretches {
            let now = self.rules.semantics.after(state, stretch.moment)?;
            let can_pass = self.rules.semantics.invariants_hold(&now)?;
            let moves = if can_pass {
                self.rules.semantics.moves(&now)?
            } else {
                Vec::new()
            };
            let is_time_stopped = self.rules.semantics.is_time_stopped(&now, &moves);
            if let Some(before) = before.take()
                && (!can_pass || before.is_time_stopped || (stretch.is_open() && is_time_stopped))
            {
                return self.rest(&before, &now);
            }
            let is_time_stopped = is_time_stopped || self.rules.is_obliged(&now);
            let here = Passed {
                now,
                moves,
                is_time_stopped,
            };
            if self.ends(stretch, &here)? {
                return Ok(());
            }
            before = Some(here);
        }
        let last = before.expect("a wait has a stretch");
        let is_won = match self.rules.claim.aim {
            Aim::Keep => true,
            Aim::Reach => false,
            Aim::Recur => self.rules.is_goal(&last.now)?,
        };
        let winner = if is_won {
            Owner::Controller
        } else {
            Owner::Environment
        };
        self.situation.next = Next::Won(winner, Ending::Endless);
        self.situation.half_ticks = None;
        Ok(())
    }

    /// Whether something happens in a stretch at the latest; notes what, and what is possible
    /// before.
    fn ends(&mut self, stretch: &Stretch, here: &Passed) -> Result<bool, Error> {
        let mut window = Window::of(stretch);
        self.situation.waits.last = window.last;
        self.situation.waits.is_last_open = window.is_last_open;
        let moment = first_tick(stretch);
        self.situation.half_ticks = Some(moment);
        let until_moment = |window: &mut Window| {
            window.last = Some(moment);
            window.is_last_open = false;
        };
        if let Some(winner) = self.rules.winner(&here.now)? {
            until_moment(&mut self.situation.waits);
            let ending = match winner {
                Owner::Controller => Ending::Goal,
                Owner::Environment => Ending::Broken,
            };
            self.situation.next = Next::Won(winner, ending);
            return Ok(true);
        }
        let decisions = self.rules.decisions(&here.now);
        let possible = self.rules.possible(&here.now, &here.moves)?;
        let waits = decisions.iter().any(|one| one.action.is_none());
        let action = decisions.iter().find_map(|one| one.action.as_ref());
        if !waits {
            until_moment(&mut window);
            until_moment(&mut self.situation.waits);
            self.situation.next = match action {
                None => Next::Fails(Gap::NoDecision),
                Some(action) => {
                    let at_moment = Window {
                        first: moment,
                        is_first_open: false,
                        ..window
                    };
                    self.acts(action, &possible, at_moment)
                }
            };
        }
        if self.rules.claim.is_permissive {
            let actions = decisions.iter().filter_map(|one| one.action.as_ref());
            self.note_allowed(&actions.collect::<Vec<_>>(), &possible, window);
        }
        // Where the environment acts the controller comes too late.
        let is_late = !waits && action.is_some() && self.rules.claim.owner == Owner::Environment;
        if !is_late {
            let Some(others) = self.rules.others(&here.now, &possible) else {
                self.situation.next = Next::Fails(Gap::ImpossibleAction);
                return Ok(true);
            };
            for (one, _) in others {
                add(&mut self.situation.replies, &one.parts, window);
            }
        }
        Ok(!waits)
    }

    /// What an action comes to; if several legs are possible, notes them as replies.
    fn acts(&mut self, action: &[Part], possible: &[(&Move, State)], at_moment: Window) -> Next {
        let meant = self.rules.moves_of_action(action, possible).into_iter();
        let legs: Vec<Vec<Part>> = meant.map(|(one, _)| one.parts.clone()).collect();
        if legs.is_empty() {
            return Next::Fails(Gap::ImpossibleAction);
        }
        if legs.len() > 1 {
            for leg in &legs {
                add(&mut self.situation.replies, leg, at_moment);
            }
        }
        let action = action.to_vec();
        Next::Acts { action, legs }
    }

    /// Notes the moves that actions of a permissive strategy allow, each entry once.
    fn note_allowed(
        &mut self,
        actions: &[&Vec<Part>],
        possible: &[(&Move, State)],
        window: Window,
    ) {
        let network = self.rules.semantics.network();
        for (index, action) in actions.iter().enumerate() {
            let mut before = actions[..index].iter();
            if before.all(|one| !is_same_entry(network, one, action)) {
                for (one, _) in self.rules.moves_of_action(action, possible) {
                    add(&mut self.situation.allowed, &one.parts, window);
                }
            }
        }
    }

    /// Notes what becomes of play where time cannot pass on: `later` is beyond.
    fn rest(&mut self, last: &Passed, later: &State) -> Result<(), Error> {
        let possible = self.rules.possible(&last.now, &last.moves)?;
        let rest = self.rules.rest(&last.now, later, &last.moves, &possible)?;
        self.situation.next = match rest {
            Rest::Won(winner) => Next::Won(winner, Ending::Stopped),
            Rest::Must(player) if player == self.rules.claim.owner => Next::Fails(Gap::MustMove),
            Rest::Must(_) => Next::Must,
        };
        Ok(())
    }
}

/// Adds a window to a move, or to the last window of it if they touch.
fn add(replies: &mut Vec<Timing>, parts: &[Part], window: Window) {
    let Some(reply) = replies.iter_mut().find(|one| one.parts == parts) else {
        replies.push(Timing {
            parts: parts.to_vec(),
            windows: vec![window],
        });
        return;
    };
    match reply.windows.last_mut() {
        Some(last)
            if last.last == Some(window.first) && last.is_last_open != window.is_first_open =>
        {
            last.last = window.last;
            last.is_last_open = window.is_last_open;
        }
        _ => reply.windows.push(window),
    }
}

/// The state after a wait in half ticks, and then a move if one is given; `None` if its target
/// breaks an invariant.
pub fn after(
    network: &Network,
    timed: &Timed,
    half_ticks: i64,
    parts: Option<&[Part]>,
) -> Result<Option<Timed>, Error> {
    let unit = 2 * timed.ticks_per_unit;
    let semantics = Semantics::new(network, unit);
    let mut state = semantics.after(&doubled(&timed.state), half_ticks)?;
    if let Some(parts) = parts {
        match semantics.take(&state, parts)? {
            Some(target) => state = target,
            None => return Ok(None),
        }
    }
    Ok(Some(Timed {
        state,
        ticks_per_unit: unit,
    }))
}

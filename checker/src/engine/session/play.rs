//! Strategies that are followed: what one says in a state with exact clock values, and playing
//! against it.
//!
//! Whatever happens here is computed by [`crate::verify`], so that playing does not depend on the
//! solver.

use std::borrow::Cow;
use std::hash::BuildHasher as _;
use std::sync::Arc;

use hashbrown::HashTable;
use hashbrown::hash_table::Entry;
use rustc_hash::FxBuildHasher;
use serde_json::{Map, Value as Json, json};

use crate::game::Priorities;
use crate::game::strategy::closed_loop;
use crate::game::strategy::{Selection, Start, Strategy};
use crate::ir::{Network, Query};
use crate::verify::play::{self, Ending, Gap, Next, Situation, Timing, Window};
use crate::verify::replay::{End, Moment, Run, Step};
use crate::verify::strategy::Owner;
use crate::verify::timed::{Timed, least_multiple};
use crate::verify::{self, Effort, Part, Semantics};

use crate::engine::evidence::checked::Checked;
use crate::engine::evidence::strategy_check::{self, Played};
use crate::engine::format::json_reader::Mismatch;
use crate::engine::format::{json, strategy_json};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Rules;
use crate::engine::query::time_clock;
use crate::engine::rejection::Rejection;

/// A strategy that can be followed.
#[derive(Debug)]
pub struct Follower {
    /// The text of the query that it answers.
    pub query: String,
    /// The strategy.
    pub strategy: Arc<Strategy>,
    /// For the words that distinguish states: the index of the first state in the strategy with
    /// these words.
    by_words: HashTable<u32>,
    /// For each state: the index of the next one with the same words, [`NONE`] without one.
    next: Vec<u32>,
}

/// No state.
const NONE: u32 = u32::MAX;

/// The hash of the words that distinguish states.
fn hash(words: &[i32]) -> u64 {
    FxBuildHasher.hash_one(words)
}

/// Why a strategy says nothing of a state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unadvised {
    /// The state is none of the model.
    Mismatch(Mismatch),
    /// Its clock values cannot be represented.
    TooFine,
    /// Its words are not among the states of the strategy.
    UnknownState,
    /// The strategy has decisions for its words, but not for its clock values.
    NoDecision,
    /// The model fails in it.
    Failed(verify::Error),
}

impl From<Mismatch> for Unadvised {
    fn from(mismatch: Mismatch) -> Unadvised {
        Unadvised::Mismatch(mismatch)
    }
}

impl Follower {
    /// A strategy of the network, for the query with this text.
    pub fn new(network: &Network, query: String, strategy: Arc<Strategy>) -> Follower {
        let words_of = |index: u32| identity(network, &strategy.states[index as usize].words);
        let mut by_words = HashTable::with_capacity(strategy.states.len());
        let mut next = vec![NONE; strategy.states.len()];
        for index in (0..strategy.states.len() as u32).rev() {
            let words = words_of(index);
            let same = |&first: &u32| words_of(first) == words;
            match by_words.entry(hash(words), same, |&first| hash(words_of(first))) {
                Entry::Occupied(mut known) => {
                    next[index as usize] = std::mem::replace(known.get_mut(), index);
                }
                Entry::Vacant(free) => {
                    free.insert(index);
                }
            }
        }
        Follower {
            query,
            strategy,
            by_words,
            next,
        }
    }

    /// How many discrete states it has.
    pub fn state_count(&self) -> usize {
        self.by_words.len()
    }

    /// The part of the strategy for some words; without a state if it has none for them.
    fn at(&self, network: &Network, words: &[i32]) -> Strategy {
        let states = &self.strategy.states;
        let words = identity(network, words);
        let same = |&first: &u32| identity(network, &states[first as usize].words) == words;
        let first = self.by_words.find(hash(words), same).copied();
        let following = |&index: &u32| Some(self.next[index as usize]).filter(|&next| next != NONE);
        let indices = std::iter::successors(first, following);
        Strategy {
            owner: self.strategy.owner,
            selection: self.strategy.selection,
            time_limit: self.strategy.time_limit,
            under: None,
            start: Start::Initial,
            states: indices
                .map(|index| states[index as usize].clone())
                .collect(),
        }
    }

    /// Where play begins, as JSON: "initial", "anywhere", or the run that leads there; null if it
    /// is not possible.
    pub fn start(&self, network: &Network, priorities: Priorities) -> Result<Json, verify::Error> {
        Ok(match &self.strategy.start {
            Start::Initial => json!("initial"),
            Start::Anywhere => json!("anywhere"),
            Start::After(way) => match strategy_check::follow(network, way, priorities)? {
                Some((run, states)) => json!({ "run": json::run(network, &run, &states) }),
                None => Json::Null,
            },
        })
    }

    /// The entry of the strategy's file for the locations and variables of this JSON.
    pub fn state(&self, network: &Network, state: &Json) -> Result<Json, Unadvised> {
        let words = strategy_json::read_words(network, state)?;
        let network = &*time_clock::network_of(network, &self.strategy);
        let part = self.at(network, &words);
        let joined = closed_loop::joined(network, &part);
        let entry = joined.first().ok_or(Unadvised::UnknownState)?;
        Ok(strategy_json::state(network, entry))
    }

    /// What the strategy says in a state, as JSON: whether play is `over` there; the decisions that
    /// apply `now`, each with its `edges` (null: it waits) and its `rank`; and if one of them is to
    /// wait, for how many `ticks` of `ticks_per_unit` (null: for ever), and the decisions that
    /// apply `then`.
    pub fn advice(&self, network: &Network, state: &Json) -> Result<Json, Unadvised> {
        let network = &*time_clock::network_of(network, &self.strategy);
        let words = strategy_json::read_words(network, state)?;
        let part = self.at(network, &words);
        let joined = closed_loop::joined(network, &part);
        let Some(joined) = joined.first() else {
            return Err(Unadvised::UnknownState);
        };
        let ranked = &joined.decisions;
        if joined.is_goal {
            return Ok(json!({ "over": true, "now": [] }));
        }
        let timed = read_timed(network, state, words)?;
        let decisions = strategy_check::decisions(network, &part).swap_remove(0);
        let is_permissive = self.strategy.selection == Selection::Any;
        let advice =
            play::advice(network, &decisions, is_permissive, &timed).map_err(Unadvised::Failed)?;
        if advice.now.is_empty() {
            return Err(Unadvised::NoDecision);
        }
        let described = |indices: &[usize]| {
            let described = indices.iter().map(|&one| {
                let action = decisions.decisions[one].action.as_ref();
                json!({
                    "edges": action.map(|parts| json::parts(network, parts)),
                    "rank": ranked[one].rank,
                })
            });
            described.collect::<Vec<_>>()
        };
        let waiting = advice.waiting.map(|waiting| {
            json!({
                "ticks": waiting.half_ticks,
                "ticks_per_unit": 2 * timed.ticks_per_unit,
                "then": described(&waiting.then),
            })
        });
        Ok(json!({ "over": false, "now": described(&advice.now), "waiting": waiting }))
    }

    /// Checks in closed loop that the owner wins.
    pub fn verify(
        &self,
        model: &mut LoadedModel,
        rules: Rules,
        effort: &mut Effort<'_>,
    ) -> Result<Checked, Rejection> {
        let text = model.add_query(&self.query);
        let decisions = strategy_check::decisions(model.network(), &self.strategy);
        let played = Played::new(&self.strategy, &decisions);
        let result = model.verify_strategy(&text, played, rules, effort)?;
        Ok(Checked::of_strategy(model.network(), &result))
    }
}

fn identity<'w>(network: &Network, words: &'w [i32]) -> &'w [i32] {
    &words[..network.layout.identity_words as usize]
}

/// A state of these words with `clocks` from JSON, each value a pair of numerator and denominator.
fn read_timed(network: &Network, state: &Json, words: Vec<i32>) -> Result<Timed, Unadvised> {
    let wrong = |message: String| {
        Unadvised::Mismatch(Mismatch {
            place: "clocks".to_owned(),
            message,
            help: None,
        })
    };
    let empty = Map::new();
    let given = state["clocks"].as_object().unwrap_or(&empty);
    let clocks = || network.clocks.iter().skip(1);
    if let Some(name) = given
        .keys()
        .find(|name| !clocks().any(|clock| clock.name == **name))
    {
        return Err(wrong(format!("the model has no clock {name}")));
    }
    let mut values = Vec::new();
    let mut unit = 1;
    for clock in clocks() {
        let Some(value) = given.get(&clock.name) else {
            return Err(wrong(format!(
                "the value of clock {} is missing",
                clock.name
            )));
        };
        let (Some(numerator), Some(denominator)) = (value[0].as_i64(), value[1].as_i64()) else {
            return Err(Unadvised::TooFine);
        };
        if numerator < 0 || denominator < 1 {
            return Err(wrong(format!(
                "the value of clock {} is negative",
                clock.name
            )));
        }
        unit = least_multiple(unit, denominator).ok_or(Unadvised::TooFine)?;
        values.push((numerator, denominator));
    }
    let ticks = values.into_iter();
    let ticks = ticks.map(|(numerator, denominator)| {
        let ticks = numerator.checked_mul(unit / denominator)?;
        (ticks < i64::MAX / 4).then_some(ticks)
    });
    let mut clocks = vec![0];
    clocks.extend(
        ticks
            .collect::<Option<Vec<i64>>>()
            .ok_or(Unadvised::TooFine)?,
    );
    Ok(Timed {
        state: verify::State { words, clocks },
        ticks_per_unit: unit,
    })
}

/// A wait as a fraction of the unit of time: numerator and denominator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wait {
    /// Not negative.
    pub numerator: i64,
    /// At least 1.
    pub denominator: i64,
}

/// Why a step is not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// It is not possible, or not then.
    Impossible,
    /// The wait cannot be represented.
    TooFine,
    /// The model fails.
    Failed(verify::Error),
}

impl From<verify::Error> for Refused {
    fn from(error: verify::Error) -> Refused {
        Refused::Failed(error)
    }
}

/// What is done after a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// Nothing.
    Nothing,
    /// The move of the strategy's opponent with this index.
    Reply(usize),
    /// The move that a permissive strategy allows with this index.
    Allowed(usize),
}

/// A play against a strategy, from where that begins.
#[derive(Debug)]
pub struct Play {
    follower: Arc<Follower>,
    /// The strategy that the game is played under.
    under: Option<Follower>,
    query: Query,
    query_text: String,
    rules: Rules,
    /// How many steps lead to where it begins.
    start: usize,
    states: Vec<Timed>,
    /// Between the states: the wait in ticks of the state before, doubled, and the edges; none if
    /// it is a wait alone.
    steps: Vec<(i64, Vec<Part>)>,
}

impl LoadedModel {
    /// Begins a play. The strategy must be for the objective of the query, which its owner tries to
    /// reach or to prevent.
    pub fn play(
        &mut self,
        follower: Arc<Follower>,
        query: &str,
        rules: Rules,
    ) -> Result<Result<Play, verify::Error>, Rejection> {
        let text = self.add_query(query);
        let (query, _) = self.compile(text.span)?;
        let Some(control) = query.kind.full_game() else {
            return Err(Rejection::without_place(format!(
                "error: {} is no game: it does not begin with control:",
                text.text
            )));
        };
        let strategy = &follower.strategy;
        match strategy_check::is_for(self.network(), control, &Played::new(strategy, &[])) {
            Ok(true) => {}
            Ok(false) => {
                return Err(Rejection::without_place(format!(
                    "error: the strategy is for another start or time limit than {}",
                    text.text
                )));
            }
            Err(error) => return Ok(Err(error)),
        }
        let network = time_clock::network_of(self.network(), strategy);
        let (states, steps) = match beginning(&network, &strategy.start, rules.priorities) {
            Ok(Some(beginning)) => beginning,
            Ok(None) => {
                let message = "error: the way to where the strategy begins is not possible";
                return Err(Rejection::without_place(message.to_owned()));
            }
            Err(error) => return Ok(Err(error)),
        };
        let under = strategy.under.as_ref().map(|under| {
            let strategy = Arc::clone(&under.strategy);
            Follower::new(self.network(), under.query.clone(), strategy)
        });
        Ok(Ok(Play {
            start: steps.len(),
            under,
            follower,
            query,
            query_text: text.text,
            rules,
            states,
            steps,
        }))
    }
}

/// States, and the steps between them.
type History = (Vec<Timed>, Vec<(i64, Vec<Part>)>);

/// The states and steps with which a play begins; `None` if they are not possible.
fn beginning(
    network: &Network,
    start: &Start,
    priorities: Priorities,
) -> Result<Option<History>, verify::Error> {
    let Start::After(way) = start else {
        let first = Timed {
            state: Semantics::new(network, 1).initial()?,
            ticks_per_unit: 1,
        };
        return Ok(Some((vec![first], Vec::new())));
    };
    let Some((run, states)) = strategy_check::follow(network, way, priorities)? else {
        return Ok(None);
    };
    let states = states.into_iter().map(|state| Timed {
        state,
        ticks_per_unit: way.ticks_per_unit,
    });
    let moves = run.steps.into_iter();
    let mut steps: Vec<_> = moves.map(|step| (2 * step.wait, step.parts)).collect();
    if way.wait > 0 {
        steps.push((2 * way.wait, Vec::new()));
    }
    Ok(Some((states.collect(), steps)))
}

impl Play {
    fn game<'n>(&'n self, network: &'n Network) -> time_clock::LimitedGame<'n> {
        let control = self.query.kind.full_game().expect("only games are played");
        time_clock::game(network, control, self.follower.strategy.time_limit)
    }

    fn network<'n>(&self, network: &'n Network) -> Cow<'n, Network> {
        time_clock::network_of(network, &self.follower.strategy)
    }

    fn now(&self) -> &Timed {
        self.states.last().expect("a play has a state")
    }

    fn look(&self, network: &Network, timed: &Timed) -> Result<Situation, verify::Error> {
        let strategy = &self.follower.strategy;
        let (owner, selection) = (strategy.owner, strategy.selection);
        let game = self.game(network);
        let claim = strategy_check::claim(&game.objective, owner, selection, self.rules);
        let part = self.follower.at(network, &timed.state.words);
        let decisions = strategy_check::decisions(network, &part);
        let mut claim = claim;
        let allowed = self.under.as_ref().map(|under| {
            let part = under.at(network, &timed.state.words);
            (
                strategy_check::decisions(network, &part),
                under.strategy.selection,
            )
        });
        if let Some((allowed, selection)) = &allowed {
            claim.under = Some((allowed, *selection == Selection::Any));
        }
        play::look(&game.network, &decisions, &claim, timed)
    }

    /// How many steps were made since it began.
    pub fn length(&self) -> usize {
        self.steps.len() - self.start
    }

    /// The state as JSON, and how many of its ticks make a unit of time.
    pub fn state(&self, network: &Network) -> (Json, i64) {
        let now = self.now();
        let network = self.network(network);
        (json::state(&network, &now.state), now.ticks_per_unit)
    }

    /// What can happen in the state, as JSON.
    ///
    /// `replies` are the moves of the strategy's opponent: of each the `edges` and the `windows` in
    /// which it is possible. A window is a list: where it begins, whether it begins only after
    /// that, where it ends (null: never), and whether it ends before that. It may wait within
    /// `waits`. Where the strategy takes an edge to a branch point, its opponent picks the leg:
    /// then the legs are replies at the moment of `next`. `allowed` are likewise the moves that a
    /// permissive strategy allows its owner. `next` is what happens after `ticks` (null: never) if
    /// it does not move: `kind` "acts" with the `edges` of the strategy; "won" with the `winner`,
    /// and `by` "goal", "broken", "stopped" or "endless"; "must", if it has to move before;
    /// "fails", if the strategy does not say how to go on, with `gap`. All times are in ticks of
    /// which `ticks_per_unit` make a unit of time. `goal` is whether the goal holds now.
    pub fn situation(&self, network: &Network) -> Result<Json, verify::Error> {
        let now = self.now();
        let situation = self.look(network, now)?;
        let window =
            |one: &Window| json!([one.first, one.is_first_open, one.last, one.is_last_open]);
        let timings = |moves: &[Timing]| {
            let moves = moves.iter().map(|one| {
                let windows = one.windows.iter().map(window);
                json!({ "edges": json::parts(network, &one.parts), "windows": windows.collect::<Vec<_>>() })
            });
            moves.collect::<Vec<_>>()
        };
        let next = match &situation.next {
            Next::Acts { action, .. } => {
                json!({ "kind": "acts", "edges": json::parts(network, action) })
            }
            Next::Won(winner, ending) => json!({
                "kind": "won",
                "winner": owner_name(*winner),
                "by": match ending {
                    Ending::Goal => "goal",
                    Ending::Broken => "broken",
                    Ending::Stopped => "stopped",
                    Ending::Endless => "endless",
                },
            }),
            Next::Must => json!({ "kind": "must" }),
            Next::Fails(gap) => json!({
                "kind": "fails",
                "gap": match gap {
                    Gap::NoDecision => "it has no decision here",
                    Gap::ImpossibleAction => "its action is not possible here",
                    Gap::MustMove => "it waits where its owner has to move",
                },
            }),
        };
        Ok(json!({
            "ticks_per_unit": 2 * now.ticks_per_unit,
            "replies": timings(&situation.replies),
            "allowed": timings(&situation.allowed),
            "waits": window(&situation.waits),
            "ticks": situation.half_ticks,
            "next": next,
            "goal": situation.is_goal,
        }))
    }

    /// Lets so much time pass, and then something be done.
    pub fn pass(&mut self, network: &Network, wait: Wait, done: Done) -> Result<(), Refused> {
        let Wait {
            numerator,
            denominator,
        } = wait;
        let now = self.now();
        let situation = self.look(network, now)?;
        let timing = match done {
            Done::Nothing => None,
            Done::Reply(index) => Some(situation.replies.get(index).ok_or(Refused::Impossible)?),
            Done::Allowed(index) => Some(situation.allowed.get(index).ok_or(Refused::Impossible)?),
        };
        let (parts, windows) = match timing {
            Some(timing) => (timing.parts.clone(), timing.windows.clone()),
            None => (Vec::new(), vec![situation.waits]),
        };
        let half_ticks = i128::from(numerator) * 2 * i128::from(now.ticks_per_unit);
        let is_in = |window: &Window| window.contains(half_ticks, denominator.into());
        if !windows.iter().any(is_in) {
            return Err(Refused::Impossible);
        }
        let now = least_multiple(now.ticks_per_unit, denominator)
            .and_then(|unit| now.at_multiple_of(unit))
            .ok_or(Refused::TooFine)?;
        let wait = numerator
            .checked_mul(2 * now.ticks_per_unit / denominator)
            .filter(|wait| *wait < i64::MAX / 8)
            .ok_or(Refused::TooFine)?;
        if parts.is_empty() && wait == 0 {
            return Ok(());
        }
        self.step(network, &now, wait, parts)
    }

    /// The strategy continues: time passes until it acts. Then it takes its action by the first leg
    /// that is possible.
    pub fn follow(&mut self, network: &Network) -> Result<(), Refused> {
        let now = self.now().clone();
        let situation = self.look(network, &now)?;
        match (situation.next, situation.half_ticks) {
            (Next::Acts { legs, .. }, Some(wait)) => {
                let first = legs.into_iter().next().ok_or(Refused::Impossible)?;
                self.step(network, &now, wait, first)
            }
            _ => Err(Refused::Impossible),
        }
    }

    fn step(
        &mut self,
        network: &Network,
        now: &Timed,
        wait: i64,
        parts: Vec<Part>,
    ) -> Result<(), Refused> {
        let action = (!parts.is_empty()).then_some(&parts[..]);
        let network = self.network(network);
        let later = play::after(&network, now, wait, action)?.ok_or(Refused::Impossible)?;
        let later = later.at_multiple_of(1).ok_or(Refused::TooFine)?;
        let last = self.states.len() - 1;
        self.states[last] = now.clone();
        self.states.push(later);
        self.steps.push((wait, parts));
        Ok(())
    }

    /// Takes back the last steps until only this number is left.
    pub fn undo(&mut self, length: usize) {
        self.steps.truncate(self.start + length);
        self.states.truncate(self.start + length + 1);
    }

    /// The play until now, as a trace that [`LoadedModel::verify_evidence`] checks; `None` if its
    /// times have no common resolution.
    pub fn trace(&self, network: &Network) -> Result<Option<Json>, verify::Error> {
        let units = self.states.iter().map(|state| 2 * state.ticks_per_unit);
        let unit = units.into_iter().try_fold(1, least_multiple);
        let Some(unit) = unit else {
            return Ok(None);
        };
        let mut steps = Vec::new();
        let mut states = Vec::new();
        let mut wait = 0;
        for (index, timed) in self.states.iter().enumerate() {
            if wait == 0 || index == self.steps.len() {
                states.push(timed.at_multiple_of(unit).map(|timed| timed.state));
            }
            let Some((half_ticks, parts)) = self.steps.get(index) else {
                break;
            };
            wait += half_ticks * (unit / (2 * timed.ticks_per_unit));
            if !parts.is_empty() {
                steps.push(Step {
                    wait: std::mem::take(&mut wait),
                    parts: parts.clone(),
                });
            }
        }
        let Some(states) = states.into_iter().collect::<Option<Vec<_>>>() else {
            return Ok(None);
        };
        let situation = self.look(network, self.now())?;
        let (winner, is_endless) = match (situation.next, situation.half_ticks) {
            (Next::Won(winner, ending), Some(0)) => {
                let is_shown = matches!(ending, Ending::Goal | Ending::Broken);
                (is_shown.then_some(winner), false)
            }
            (Next::Won(_, Ending::Endless), None) => (None, true),
            _ => (None, false),
        };
        let run = Run {
            ticks_per_unit: unit,
            steps,
            end: if is_endless {
                End::Waits(wait)
            } else {
                End::After(wait)
            },
            from: Moment { state: 0, wait: 0 },
        };
        let network = &*self.network(network);
        let mut trace = json!({
            "format": json::TRACE_FORMAT,
            "version": 1,
            "query": self.query_text,
            "kind": "play",
            "winner": winner.map(owner_name),
            "priorities": match self.rules.priorities {
                Priorities::Ignored => "ignore",
                Priorities::Kept => "keep",
            },
            "run": json::run(network, &run, &states),
        });
        if let Some(limit) = self.follower.strategy.time_limit {
            trace["time_limit"] = json!(limit);
        }
        Ok(Some(trace))
    }
}

/// The name of an owner in files.
pub fn owner_name(owner: Owner) -> &'static str {
    match owner {
        Owner::Controller => "controller",
        Owner::Environment => "environment",
    }
}

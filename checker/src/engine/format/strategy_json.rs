//! Strategies as files: written as JSON, and read again for a model.
//!
//! The format is described in `docs/strategy.md`. In short: an object with `format`
//! "ntagen-strategy", `version` 1, the `query`, the `owner`, the `selection`, and `states`, each
//! with `locations` by process, `variables` by name, `goal`, `decisions` with the `zones` where
//! they apply, and `legs` if the environment picks some. Reading looks names up in the model and
//! refuses what is not in it, so a file fits every model with the same processes, locations,
//! variables, clocks and edges.

use std::sync::Arc;

use serde_json::{Value as Json, json};

use crate::game::Player;
use crate::game::strategy::closed_loop::{self, Joined};
use crate::game::strategy::{Decision, Selection, Start, Strategy, StrategyState, Under, Way};
use crate::ir::{EdgeId, Network, Shape};
use crate::network::Part;
use crate::network::discrete::selects::select_combination;
use crate::verify::timed::MOST_TICKS_PER_UNIT;
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Federation, Zone};

use super::json;
use super::json_reader::{At, MACHINE_FORMAT, Mismatch, SEE_FORMAT, WRITE_ONE, integer};
use super::text::{self, ValuePlace};
use super::{learned_json, shield_json};
use crate::engine::query::time_clock;
use crate::engine::query_form::without_under;

/// The name of the format.
pub const FORMAT: &str = "ntagen-strategy";

/// The version of the format that is written, and the only one that is read.
pub const VERSION: u64 = 1;

const OTHER_MODEL: &str =
    "the strategy was made for another model, or the model has changed: synthesise it again";

/// A strategy as the text of JSON. Decisions of states with the same words are joined and come in
/// the order of their ranks. It is made state by state, since the whole takes twenty times the
/// memory of the text.
pub fn text(network: &Network, strategy: &Strategy, query: &str) -> String {
    let network = &*time_clock::network_of(network, strategy);
    let frame = frame(network, strategy, query).to_string();
    // Quotes inside of strings are escaped, so that only the fields themselves are found.
    let (before, after) = frame
        .split_once(NO_STATES)
        .expect("a frame has a field for states");
    let mut text = format!("{before}\"states\":[");
    for (index, one) in closed_loop::joined(network, strategy).iter().enumerate() {
        if index > 0 {
            text.push(',');
        }
        text.push_str(&json::written(&state(network, one)));
    }
    text.push(']');
    match (&strategy.under, after.split_once(NO_UNDER)) {
        (Some(under), Some((before, after))) => {
            let whole = self::text(network, &under.strategy, &under.query);
            text.extend([before, "\"under\":", &whole, after]);
        }
        _ => text.push_str(after),
    }
    text
}

/// The field of the states of a frame.
const NO_STATES: &str = "\"states\":[]";

/// The field of the strategy that a game is played under, of a frame.
const NO_UNDER: &str = "\"under\":null";

/// A discrete state with its joined decisions.
pub(crate) fn state(network: &Network, joined: &Joined<'_>) -> Json {
    let all = |decisions: &[&Decision]| -> Vec<Json> {
        let decisions = decisions.iter();
        decisions.map(|one| decision(network, one)).collect()
    };
    let mut state = json!({
        "locations": json::locations(network, joined.words),
        "variables": json::variables(network, joined.words),
        "goal": joined.is_goal,
        "decisions": all(&joined.decisions),
    });
    if !joined.legs.is_empty() {
        state["legs"] = all(&joined.legs).into();
    }
    state
}

/// The JSON of a strategy without its states, and without the strategy that it is played under.
fn frame(network: &Network, strategy: &Strategy, query: &str) -> Json {
    let mut file = json!({
        "format": FORMAT,
        "version": VERSION,
        "query": query,
        "owner": strategy.owner.name(),
        "selection": match strategy.selection {
            Selection::First => "first",
            Selection::Any => "any",
        },
        "states": [],
    });
    if let Some(limit) = strategy.time_limit {
        file["time_limit"] = json!(limit);
    }
    if strategy.under.is_some() {
        file["query"] = json!(without_under(query));
        file["under"] = Json::Null;
    }
    match &strategy.start {
        Start::Initial => {}
        Start::Anywhere => file["start"] = json!({ "kind": "anywhere" }),
        Start::After(way) => {
            let moves = way
                .moves
                .iter()
                .map(|(wait, parts)| json!({ "wait": wait, "edges": json::parts(network, parts) }));
            file["start"] = json!({
                "kind": "after",
                "ticks_per_unit": way.ticks_per_unit,
                "steps": moves.collect::<Vec<_>>(),
                "wait": way.wait,
            });
        }
    }
    file
}

fn decision(network: &Network, decision: &Decision) -> Json {
    let action = decision.action.as_ref();
    json!({
        "zones": zones(network, &decision.zones),
        "action": action.map(|parts| json::parts(network, parts)),
        "rank": decision.rank,
    })
}

/// The zones of a federation, each as a list of constraints that all hold.
pub fn zones(network: &Network, federation: &Federation) -> Vec<Json> {
    let dimension = federation.dimension();
    let zones = federation.zones().map(|bounds| {
        let zone = Zone::from_bounds(dimension, bounds);
        json!(text::zone_constraints(network, &zone))
    });
    zones.collect()
}

/// Reads a strategy; gives the query that it answers, and the strategy.
///
/// # Errors
/// The bytes are no JSON of the format, or name what the network does not have.
pub fn read(network: &Network, bytes: &[u8]) -> Result<(String, Strategy), Mismatch> {
    let file: Json = serde_json::from_slice(bytes).map_err(|error| Mismatch {
        place: String::new(),
        message: format!("this is no JSON: {error}"),
        help: Some(WRITE_ONE),
    })?;
    read_parsed(network, &file)
}

/// Reads a strategy as [`read`] does, after its JSON was parsed.
///
/// # Errors
/// It is not of the format, or names what the network does not have.
pub fn read_parsed(network: &Network, file: &Json) -> Result<(String, Strategy), Mismatch> {
    read_whole(network, &At::whole(file))
}

fn read_whole(network: &Network, whole: &At<'_>) -> Result<(String, Strategy), Mismatch> {
    let file = whole.0;
    let format = whole.text("format").unwrap_or_default();
    if format == MACHINE_FORMAT {
        let message = "this is a machine that goes by observations, and no strategy over states";
        return Err(whole.wrong(message, "`ntagen verify MODEL FILE` checks it"));
    }
    if learned_json::is_one(file) {
        let message = "this is a learned strategy, which says what actions are worth";
        let help = "the query strategy S = loadStrategy(\"…\") reads it";
        return Err(whole.wrong(message, help));
    }
    if shield_json::is_one(file) {
        let message = "this is a shield, which allows moves by cells of a grid";
        let help = "the query strategy S = loadStrategy(\"…\") reads it";
        return Err(whole.wrong(message, help));
    }
    if format != FORMAT {
        let message = format!("this is no strategy of ntagen: its \"format\" is not \"{FORMAT}\"");
        return Err(whole.wrong(message, WRITE_ONE));
    }
    whole.only(&[
        "format",
        "version",
        "query",
        "owner",
        "selection",
        "states",
        "time_limit",
        "under",
        "start",
    ])?;
    let version = whole.field("version")?;
    if version.0.as_u64() != Some(VERSION) {
        let message = format!("version {} of the format is not known", version.0);
        return Err(version.wrong(message, "this ntagen reads version 1"));
    }
    let query = whole.text("query")?;
    let owner = match whole.text("owner")?.as_str() {
        "controller" => Player::Controller,
        "environment" => Player::Environment,
        other => {
            let message = format!("nobody is the {other}");
            let help = "write \"controller\" or \"environment\"";
            return Err(whole.field("owner")?.wrong(message, help));
        }
    };
    let selection = match whole.text("selection")?.as_str() {
        "first" => Selection::First,
        "any" => Selection::Any,
        other => {
            let message = format!("there is no selection {other}");
            let help = "write \"first\" or \"any\"";
            return Err(whole.field("selection")?.wrong(message, help));
        }
    };
    let time_limit = match file.get("time_limit") {
        None | Some(Json::Null) => None,
        Some(limit) => Some(time_limit(&At(limit, "time_limit".to_owned()))?),
    };
    let network = &*time_clock::with_limit(network, time_limit);
    let reader = NetworkReader { network, owner };
    let mut strategy = Strategy {
        owner,
        selection,
        time_limit,
        under: under(network, whole)?,
        start: start(network, file)?,
        states: Vec::new(),
    };
    for state in whole.list("states")? {
        strategy.states.push(reader.state(&state)?);
    }
    Ok((query, strategy))
}

/// The strategy under which the game is played.
fn under(network: &Network, whole: &At<'_>) -> Result<Option<Arc<Under>>, Mismatch> {
    if whole.0.get("under").is_none_or(Json::is_null) {
        return Ok(None);
    }
    let at = whole.field("under")?;
    let (query, strategy) = read_whole(network, &at)?;
    if strategy.owner == Player::Environment || strategy.time_limit.is_some() {
        let help = "a game is played under a strategy of the controller without a time limit";
        return Err(at.wrong("no game is played under this strategy", help));
    }
    Ok(Some(Arc::new(Under {
        query,
        strategy: Arc::new(strategy),
    })))
}

/// Where play begins.
fn start(network: &Network, file: &Json) -> Result<Start, Mismatch> {
    let at = match file.get("start") {
        None | Some(Json::Null) => return Ok(Start::Initial),
        Some(start) => At(start, "start".to_owned()),
    };
    at.only(&["kind", "ticks_per_unit", "steps", "wait"])?;
    match at.text("kind")?.as_str() {
        "anywhere" => return Ok(Start::Anywhere),
        "after" => {}
        other => {
            let message = format!("play does not begin {other}");
            let help = "write \"after\" or \"anywhere\", or leave \"start\" out";
            return Err(at.field("kind")?.wrong(message, help));
        }
    }
    let ticks = |at: &At<'_>, name: &str| {
        at.typed(name, "number of ticks", |value| {
            value
                .as_i64()
                .filter(|ticks| (0..=i64::MAX / 8).contains(ticks))
        })
    };
    let mut moves = Vec::new();
    for step in at.list("steps")? {
        step.only(&["wait", "edges"])?;
        let edges = step.list("edges")?;
        let parts = edges
            .iter()
            .map(|edge| NetworkReader::new(network).part(edge));
        moves.push((
            ticks(&step, "wait")?,
            parts.collect::<Result<Vec<Part>, _>>()?,
        ));
    }
    let ticks_per_unit = ticks(&at, "ticks_per_unit")?;
    if !(1..=MOST_TICKS_PER_UNIT).contains(&ticks_per_unit) {
        let message = format!("{ticks_per_unit} ticks cannot be a unit of time");
        return Err(at.field("ticks_per_unit")?.wrong(message, SEE_FORMAT));
    }
    Ok(Start::After(Way {
        ticks_per_unit,
        moves,
        wait: ticks(&at, "wait")?,
    }))
}

/// A time limit, which zones can compare a clock with; -1 is one that nobody keeps.
fn time_limit(at: &At<'_>) -> Result<i32, Mismatch> {
    let limit = at.0.as_i64().and_then(|limit| i32::try_from(limit).ok());
    let limit = limit.filter(|&limit| limit >= -1 && Bound::is_allowed(limit));
    limit.ok_or_else(|| at.wrong(format!("{} is no time limit", at.0), SEE_FORMAT))
}

/// The words of a state that is given as an object with `locations` and `variables`, as in a
/// strategy.
///
/// # Errors
/// It is none of the network.
pub(crate) fn read_words(network: &Network, state: &Json) -> Result<Vec<i32>, Mismatch> {
    let reader = NetworkReader::new(network);
    let mut words = network.initial.clone();
    let state = At::whole(state);
    reader.locations(&state, &mut words)?;
    reader.variables(&state, &mut words)?;
    Ok(words)
}

/// Reads parts of a file for a network.
pub(crate) struct NetworkReader<'n> {
    network: &'n Network,
    owner: Player,
}

impl<'n> NetworkReader<'n> {
    /// A reader of what the controller does.
    pub(crate) fn new(network: &'n Network) -> NetworkReader<'n> {
        NetworkReader {
            network,
            owner: Player::Controller,
        }
    }
}

impl NetworkReader<'_> {
    fn state(&self, state: &At<'_>) -> Result<StrategyState, Mismatch> {
        state.only(&["locations", "variables", "goal", "decisions", "legs"])?;
        let mut words = self.network.initial.clone();
        self.locations(state, &mut words)?;
        self.variables(state, &mut words)?;
        let mut decisions = Vec::new();
        for decision in state.list("decisions")? {
            decisions.push(self.decision(&decision, &words, self.owner)?);
        }
        let mut legs = Vec::new();
        if state.0.get("legs").is_some_and(|legs| !legs.is_null()) {
            if self.owner == Player::Controller {
                let help = "a strategy of the controller names the edge, and the environment picks the leg";
                return Err(state
                    .field("legs")?
                    .wrong("the controller picks no legs", help));
            }
            for leg in state.list("legs")? {
                let picked = self.decision(&leg, &words, Player::Controller)?;
                if picked.action.is_none() {
                    let help = "name the edges with the branches that are picked";
                    return Err(leg.field("action")?.wrong("a leg is no waiting", help));
                }
                legs.push(picked);
            }
        }
        Ok(StrategyState {
            words,
            decisions,
            legs,
            is_goal: state.typed("goal", "truth value", Json::as_bool)?,
        })
    }

    fn locations(&self, state: &At<'_>, words: &mut [i32]) -> Result<(), Mismatch> {
        let given = state.map("locations")?;
        let place = state.field("locations")?;
        for (index, process) in self.network.processes.iter().enumerate() {
            let Some(name) = given.get(&process.name) else {
                let message = format!("the model's process {} is missing", process.name);
                return Err(place.wrong(message, OTHER_MODEL));
            };
            let found = process
                .locations
                .iter()
                .position(|one| Some(one.name.as_str()) == name.as_str());
            let Some(location) = found else {
                let message = format!("process {} has no location {name}", process.name);
                return Err(place.wrong(message, OTHER_MODEL));
            };
            words[index] = location as i32;
        }
        let processes = &self.network.processes;
        match given
            .keys()
            .find(|name| !processes.iter().any(|one| &&one.name == name))
        {
            Some(name) => Err(place.wrong(format!("the model has no process {name}"), OTHER_MODEL)),
            None => Ok(()),
        }
    }

    fn variables(&self, state: &At<'_>, words: &mut [i32]) -> Result<(), Mismatch> {
        let given = state.map("variables")?;
        let at = state.field("variables")?;
        let mut known = 0;
        let mut wrong = None;
        text::for_each_place(self.network, |name, place| {
            let Some(value) = given.get(name) else {
                wrong.get_or_insert(format!("the model's variable {name} is missing"));
                return;
            };
            known += 1;
            if !set_value(place, value, words) {
                wrong.get_or_insert(format!("variable {name} cannot be {value}"));
            }
        });
        if wrong.is_none() && known < given.len() {
            let mut unknown: Vec<&str> = given.keys().map(String::as_str).collect();
            text::for_each_place(self.network, |name, _| unknown.retain(|one| *one != name));
            wrong = unknown
                .first()
                .map(|name| format!("the model has no variable {name}"));
        }
        match wrong {
            Some(message) => Err(at.wrong(message, OTHER_MODEL)),
            None => Ok(()),
        }
    }

    /// A decision whose move is the `owner`'s.
    fn decision(
        &self,
        decision: &At<'_>,
        words: &[i32],
        owner: Player,
    ) -> Result<Decision, Mismatch> {
        decision.only(&["zones", "action", "rank"])?;
        let dimension = self.network.clocks.len().max(1);
        let mut zones = Federation::empty(dimension);
        for zone in decision.list("zones")? {
            let mut constraints = Vec::new();
            for one in zone.entries()? {
                self.constraint(&one, &mut constraints)?;
            }
            zones.push(Zone::of_constraints(dimension, &constraints).bounds());
        }
        let action = decision.field("action")?;
        let action = if action.0.is_null() {
            None
        } else {
            let edges = action.entries()?;
            let parts = edges.iter().map(|edge| self.part_in(edge, words));
            let parts: Result<Vec<Part>, Mismatch> = parts.collect();
            let parts = parts?;
            if parts.is_empty() {
                let help = "write null for waiting";
                return Err(action.wrong("the action has no edge", help));
            }
            let is_controllable = |part: &Part| {
                let process = &self.network.processes[part.process as usize];
                process.edges[part.edge as usize].controllable
            };
            if !owner.owns(parts.iter().all(is_controllable)) {
                let message = if owner == self.owner {
                    "the move is not one of the player who owns the strategy"
                } else {
                    "the move is not one of the controller, whose legs the environment picks"
                };
                return Err(action.wrong(message, OTHER_MODEL));
            }
            Some(parts)
        };
        Ok(Decision {
            zones,
            action,
            rank: decision.index("rank")?,
        })
    }

    /// Adds the constraints that a text such as `x-y <= 3` stands for.
    pub(crate) fn constraint(
        &self,
        at: &At<'_>,
        into: &mut Vec<Constraint>,
    ) -> Result<(), Mismatch> {
        let text = at.0.as_str().unwrap_or_default();
        let relations = ["<=", ">=", "==", "<", ">"];
        let parts = relations.iter().find_map(|relation| {
            let (terms, value) = text.split_once(relation)?;
            let value: i32 = value.trim().parse().ok()?;
            Some((terms.trim(), *relation, value))
        });
        let Some((terms, relation, value)) = parts else {
            let message = format!("{} is no comparison of clocks with a number", at.0);
            return Err(at.wrong(message, SEE_FORMAT));
        };
        let Some((left, right)) = self.clocks(terms) else {
            let message = format!("the model has no clocks {terms}");
            return Err(at.wrong(message, OTHER_MODEL));
        };
        let is_strict = !relation.ends_with('=');
        let bound = |value: i32| {
            let bound = if is_strict {
                Bound::strict(value)
            } else {
                Bound::weak(value)
            };
            bound.ok_or_else(|| at.wrong(format!("{value} is too large for a zone"), SEE_FORMAT))
        };
        if !relation.starts_with('>') {
            let bound = bound(value)?;
            into.push(Constraint { left, right, bound });
        }
        if !relation.starts_with('<') {
            let bound = bound(value.saturating_neg())?;
            into.push(Constraint {
                left: right,
                right: left,
                bound,
            });
        }
        Ok(())
    }

    /// The clocks of `x` (then the right one is the reference clock) or `x-y`.
    fn clocks(&self, terms: &str) -> Option<(usize, usize)> {
        let clock = |name: &str| {
            let mut clocks = self.network.clocks.iter().enumerate().skip(1);
            clocks
                .find(|(_, clock)| clock.name == name)
                .map(|(index, _)| index)
        };
        if let Some(clock) = clock(terms) {
            return Some((clock, 0));
        }
        let (left, right) = terms.split_once('-')?;
        Some((clock(left.trim())?, clock(right.trim())?))
    }

    /// An edge that leaves a location of a state.
    fn part_in(&self, at: &At<'_>, words: &[i32]) -> Result<Part, Mismatch> {
        let part = self.part(at)?;
        let process = &self.network.processes[part.process as usize];
        let source = process.edges[part.edge as usize].source.0;
        if words[part.process as usize] == source as i32 {
            return Ok(part);
        }
        let (name, source) = (&process.name, &process.locations[source as usize].name);
        let message = format!("process {name} is not in {source} in this state");
        Err(at.wrong(message, SEE_FORMAT))
    }

    /// An edge with its branch and the values of its `select`.
    pub(crate) fn part(&self, at: &At<'_>) -> Result<Part, Mismatch> {
        at.only(&[
            "process",
            "edge",
            "source",
            "target",
            "branch",
            "select",
            "guard",
            "sync",
            "update",
            "controllable",
        ])?;
        let name = at.text("process")?;
        let mut processes = self.network.processes.iter().enumerate();
        let Some((index, process)) = processes.find(|(_, one)| one.name == name) else {
            return Err(at.wrong(format!("the model has no process {name}"), OTHER_MODEL));
        };
        let edge_index = at.index("edge")?;
        let (source, target) = (at.text("source")?, at.text("target")?);
        let location = |id: u32| process.locations[id as usize].name.as_str();
        let edge = process
            .edges
            .get(EdgeId(edge_index).0 as usize)
            .filter(|edge| location(edge.source.0) == source);
        let Some(edge) = edge else {
            let message = format!("edge {edge_index} of process {name} does not leave {source}");
            return Err(at.wrong(message, OTHER_MODEL));
        };
        let labels = [
            ("guard", json!(edge.labels.guard)),
            ("sync", json!(edge.labels.sync)),
            ("update", json!(edge.labels.update)),
            ("controllable", json!(edge.controllable)),
        ];
        for (field, right) in labels {
            if at.0.get(field).is_some_and(|shown| *shown != right) {
                let message = format!("in the model this is {right}");
                return Err(at.field(field)?.wrong(message, OTHER_MODEL));
            }
        }
        let branch = at.index("branch")?;
        let target_of = edge.branches.get(branch as usize);
        if target_of.is_none_or(|branch| location(branch.target.0) != target) {
            let message = format!(
                "edge {edge_index} of process {name} does not lead to {target} by branch {branch}"
            );
            return Err(at.wrong(message, OTHER_MODEL));
        }
        let given = at.map("select")?;
        let select = select_combination(edge, |name| integer(given.get(name)?));
        let Some(select) = select.filter(|_| given.len() == edge.select.len()) else {
            let message = format!(
                "edge {edge_index} of process {name} has no select values {}",
                json!(given)
            );
            return Err(at.wrong(message, OTHER_MODEL));
        };
        Ok(Part {
            process: index as u32,
            edge: edge_index,
            branch,
            select,
        })
    }
}

/// Sets the words of a scalar part of a variable; returns false if it cannot have the value.
fn set_value(place: ValuePlace<'_>, value: &Json, words: &mut [i32]) -> bool {
    let offset = place.offset;
    if let Shape::Double = place.shape {
        let Some(value) = value.as_f64() else {
            return false;
        };
        let bits = value.to_bits();
        words[offset] = bits as u32 as i32;
        words[offset + 1] = (bits >> 32) as u32 as i32;
        return true;
    }
    let (low, high) = match *place.shape {
        Shape::Integer { low, high } => (i64::from(low), i64::from(high)),
        Shape::Scalar { size, .. } => (0, i64::from(size) - 1),
        _ => (0, 1),
    };
    match value.as_i64().filter(|value| (low..=high).contains(value)) {
        Some(value) => {
            words[offset] = value as i32;
            true
        }
        None => false,
    }
}

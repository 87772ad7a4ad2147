//! Strategies that go by observations, as files: written as JSON and as text, and read again to be
//! checked.
//!
//! The format is described in `docs/observations.md`. In short: an object with `format`
//! "ntagen-machine", `version` 1, the `query`, the `observations`, and `states`, the initial one
//! first, each with what is seen in it, the action that is proposed, the next state for each next
//! observation, and what the controller knows on entry. What is known, and what is seen in a state
//! itself, is for people: reading passes over it.

use std::fmt::Write as _;

use serde_json::{Value as Json, json};

use crate::game::partial_observation::{Knowledge, Machine};
use crate::ir::{Action, ChannelId, Network};
use crate::network::entry_of;
use crate::verify::observed as check;
use crate::zones::{Federation, Zone};

use super::json_reader::{At, Difference, MACHINE_FORMAT, Mismatch, compare};
use super::strategy_json::{self, NetworkReader};
use super::{json, text};
use crate::engine::query_form::observations;

/// The version of the format that is written, and the only one that is read.
pub const VERSION: u64 = 1;

const SEE_FORMAT: &str = "docs/observations.md describes the format";

const OTHER_MODEL: &str =
    "the machine was made for another model or query, or they have changed: synthesise it again";

/// A machine as JSON.
pub fn write(network: &Network, machine: &Machine, query: &str) -> Json {
    let states = machine.states.iter().map(|state| {
        let next = state
            .next
            .iter()
            .map(|(observation, next)| json!({ "observation": observation[..], "state": next }));
        let next: Vec<Json> = next.collect();
        json!({
            "observation": state.knowledge.observation[..],
            "action": action(network, state.action),
            "next": next,
            "knowledge": knowledge(network, &state.knowledge),
        })
    });
    let states: Vec<Json> = states.collect();
    json!({
        "format": MACHINE_FORMAT,
        "version": VERSION,
        "query": query,
        "observations": observations(query),
        "states": states,
    })
}

fn action(network: &Network, action: Action) -> Json {
    match action {
        Action::Wait => Json::Null,
        Action::Channel(channel) => json!({ "channel": network.channels[channel.0 as usize].name }),
        Action::Edge(part) => json!({ "edge": json::part(network, part) }),
    }
}

fn knowledge(network: &Network, knowledge: &Knowledge) -> Vec<Json> {
    let states = knowledge.states.iter().map(|(words, zones)| {
        json!({
            "locations": json::locations(network, words),
            "variables": json::variables(network, words),
            "zones": strategy_json::zones(network, zones),
        })
    });
    states.collect()
}

/// Reads what a machine does; gives the query that it answers, and its states. `seen` is the number
/// of observations of the query.
///
/// # Errors
/// It is no JSON of the format, or names what the network does not have.
pub fn read(
    network: &Network,
    file: &Json,
    seen: usize,
) -> Result<Vec<check::MachineState>, Mismatch> {
    let whole = At::whole(file);
    whole.only(&["format", "version", "query", "observations", "states"])?;
    let names = whole.list("observations")?.len();
    if names != seen {
        let message = format!("there are {names} observations, and the query has {seen}");
        return Err(whole.field("observations")?.wrong(message, OTHER_MODEL));
    }
    let right = observations(&whole.text("query")?);
    if let Err(Difference::False(text) | Difference::Unknown(text)) =
        compare(&file["observations"], &json!(right), "observations")
    {
        return Err(whole.field("observations")?.wrong(text, OTHER_MODEL));
    }
    let states = whole.list("states")?;
    let count = states.len();
    let states = states.iter().map(|state| {
        state.only(&["observation", "action", "next", "knowledge"])?;
        let mut next = Vec::new();
        for one in state.list("next")? {
            one.only(&["observation", "state"])?;
            let observation = one.list("observation")?;
            let values = observation.iter().map(|value| {
                let truth = value.0.as_bool();
                truth.ok_or_else(|| value.wrong("this is no truth value", SEE_FORMAT))
            });
            let values: Vec<bool> = values.collect::<Result<_, _>>()?;
            if values.len() != seen {
                let message = "it has another number of values than the query has observations";
                return Err(one.field("observation")?.wrong(message, OTHER_MODEL));
            }
            let target = one.index("state")? as usize;
            if target >= count {
                let message = format!("there is no state {target}");
                return Err(one.field("state")?.wrong(message, SEE_FORMAT));
            }
            next.push((values, target));
        }
        Ok(check::MachineState {
            action: read_action(network, &state.field("action")?)?,
            next,
        })
    });
    states.collect()
}

fn read_action(network: &Network, at: &At<'_>) -> Result<Action, Mismatch> {
    if at.0.is_null() {
        return Ok(Action::Wait);
    }
    at.only(&["channel", "edge"])?;
    if at.0.get("channel").is_some() {
        let name = at.text("channel")?;
        let mut channels = network.channels.iter();
        let Some(channel) = channels.position(|one| one.name == name) else {
            return Err(at.wrong(format!("the model has no channel {name}"), OTHER_MODEL));
        };
        return Ok(Action::Channel(ChannelId(channel as u32)));
    }
    let part = NetworkReader::new(network).part(&at.field("edge")?)?;
    Ok(Action::Edge(entry_of(network, &[part])[0]))
}

/// What a machine does, for the check.
pub fn to_check(machine: &Machine) -> Vec<check::MachineState> {
    let states = machine.states.iter();
    let states = states.map(|state| check::MachineState {
        action: state.action,
        next: state
            .next
            .iter()
            .map(|(observation, next)| (observation.to_vec(), *next))
            .collect(),
    });
    states.collect()
}

/// A machine as text: a paragraph for each state, with what is seen in it, what is proposed, where
/// each next observation leads, and where play may be on entry.
pub fn text(network: &Network, machine: &Machine, query: &str) -> String {
    let names = observations(query);
    let seen = |values: &[bool]| {
        let values = names.iter().zip(values);
        let values = values.map(|(name, &value)| {
            if value {
                name.clone()
            } else {
                format!("not ({name})")
            }
        });
        let values: Vec<String> = values.collect();
        if values.is_empty() {
            "nothing".to_owned()
        } else {
            values.join(", ")
        }
    };
    let mut text = "Strategy over observations:\n".to_owned();
    if machine.states.is_empty() {
        text.push_str("\nPlay has ended before it begins.\n");
    }
    for (number, state) in machine.states.iter().enumerate() {
        // Writing to a string cannot fail.
        let observation = seen(&state.knowledge.observation);
        let _ = writeln!(text, "\nState {number}: seeing {observation}");
        for (words, zones) in &state.knowledge.states {
            let place = text::words_line(network, words);
            let _ = writeln!(
                text,
                "  perhaps in {place} with {}",
                zones_text(network, zones)
            );
        }
        let _ = writeln!(text, "  {}", action_text(network, state.action));
        for (observation, next) in &state.next {
            let _ = writeln!(text, "  when seeing {}, go to {next}", seen(observation));
        }
    }
    text
}

/// What a state of a machine does.
pub fn action_text(network: &Network, action: Action) -> String {
    match action {
        Action::Wait => "wait".to_owned(),
        Action::Channel(channel) => {
            format!("propose {}", network.channels[channel.0 as usize].name)
        }
        Action::Edge(part) => format!("propose {}", text::entry_text(network, part)),
    }
}

fn zones_text(network: &Network, federation: &Federation) -> String {
    let zones = federation.zones().map(|bounds| {
        let zone = Zone::from_bounds(federation.dimension(), bounds);
        let constraints = text::minimal_constraints(network, &zone);
        if constraints.is_empty() {
            "any clock values".to_owned()
        } else {
            constraints.join(" and ")
        }
    });
    zones.collect::<Vec<_>>().join(", or ")
}

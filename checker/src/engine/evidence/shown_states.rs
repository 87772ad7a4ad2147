//! What files of evidence show in addition to what their check uses: states, labels of edges,
//! zones. All of it must agree with what was checked. A name that nothing here knows is refused, so
//! that nobody reads something false in a file.

use serde_json::Value as Json;

use crate::ir::Network;
use crate::verify::State;
use crate::verify::replay::{End, Run};
use crate::zones::dbm::Constraint;

use crate::engine::format::json;
use crate::engine::format::json_reader::{At, Difference, compare, only};
use crate::engine::format::strategy_json::NetworkReader;

/// Compares all that a trace shows with the run in it, which was replayed; what of it is not
/// checked, by name.
pub(super) fn compare_trace(
    network: &Network,
    trace: &Json,
    run: &Run,
    states: &[State],
) -> Result<Vec<&'static str>, Difference> {
    compare(&trace["run"], &json::run(network, run, states), "run")?;
    let whole = At::whole(trace);
    let mut unchecked = Vec::new();
    if trace.get("title").is_some() {
        unchecked.push("titles");
    }
    if trace["kind"] == "failure" {
        unchecked.push("that the model fails in the last state");
    }
    if trace.get("failing").is_some() {
        for edge in whole.list("failing")? {
            NetworkReader::new(network).part(&edge)?;
        }
    }
    if trace.get("transitions").is_none() && trace.get("states").is_none() {
        return Ok(unchecked);
    }
    let (moves, shown) = (whole.list("transitions")?, whole.list("states")?);
    let start = match trace["ending"]["kind"].as_str() {
        Some("loop") => Some(whole.field("ending")?.index("loop")? as usize),
        _ => None,
    };
    compare_ending(&trace["ending"], run.end)?;
    let fits = if start.is_some() {
        moves.len() <= run.steps.len()
    } else {
        moves.len() == run.steps.len()
    };
    if !fits || shown.len() != moves.len() + 1 || start.is_some_and(|start| start >= moves.len()) {
        let text = "its symbolic states and transitions are not those of its run";
        return Err(Difference::False(text.to_owned()));
    }
    // In a run without end, a zone holds the valuations in which something stays true, or those of
    // another round. Where zones are split, a state has a part that its run need not enter.
    let features = &network.features;
    let is_split = features.clock_guarded_urgent
        || features.guarded_receivers
        || features.priorities
        || features.diagonals;
    let has_whole_zones = trace["ending"].is_null() && !is_split;
    // The run may go round a loop more often than it is shown.
    let shown_at = |index: usize| match start {
        Some(start) if index > moves.len() => start + (index - start) % (moves.len() - start),
        _ => index,
    };
    for (index, step) in run.steps.iter().enumerate() {
        let place = match start {
            Some(start) if index == moves.len() => start,
            _ => shown_at(index),
        };
        let right = json::parts(network, &step.parts);
        compare(moves[place].0, &right, &format!("transitions[{place}]"))?;
    }
    for (index, state) in states.iter().take(run.steps.len() + 1).enumerate() {
        let place = shown_at(index);
        let mut discrete = shown[place].0.clone();
        if let Some(fields) = discrete.as_object_mut() {
            fields.remove("zone");
        }
        let right = json::discrete(network, &state.words);
        compare(&discrete, &right, &format!("states[{place}]"))?;
        let is_met = contains(network, &shown[place], state, run.ticks_per_unit)?;
        if let Some(text) = is_met.err().filter(|_| has_whole_zones) {
            return Err(Difference::False(text));
        }
    }
    unchecked.push(if has_whole_zones {
        "that zones hold nothing else than can be reached"
    } else {
        "zones"
    });
    Ok(unchecked)
}

/// Whether a symbolic run is said to end as the run with exact times does.
fn compare_ending(ending: &Json, end: End) -> Result<(), Difference> {
    let kind = match end {
        End::After(_) => None,
        End::Loop(_) => Some("loop"),
        End::Waits(_) => Some("waits"),
        End::Stuck(_) => Some("stuck"),
    };
    only(ending, &["kind", "loop"], "ending").map_err(Difference::Unknown)?;
    if ending["kind"].as_str() == kind {
        return Ok(());
    }
    let text = "ending is another one than that of its run";
    Err(Difference::False(text.to_owned()))
}

/// Whether the zone of a symbolic state, if it shows one, contains the clock values of a state on
/// entry.
fn contains(
    network: &Network,
    shown: &At<'_>,
    state: &State,
    ticks_per_unit: i64,
) -> Result<Result<(), String>, Difference> {
    if shown.0.get("zone").is_none() {
        return Ok(Ok(()));
    }
    let reader = NetworkReader::new(network);
    let mut violated = None;
    for one in shown.list("zone")? {
        let mut constraints = Vec::new();
        reader.constraint(&one, &mut constraints)?;
        let holds = |one: &Constraint| {
            let difference = state.clocks[one.left] - state.clocks[one.right];
            let bound = i64::from(one.bound.value()).saturating_mul(ticks_per_unit);
            if one.bound.is_strict() {
                difference < bound
            } else {
                difference <= bound
            }
        };
        if !constraints.iter().all(holds) {
            violated.get_or_insert(format!("{} does not hold in its run", one.0));
        }
    }
    Ok(violated.map_or(Ok(()), Err))
}

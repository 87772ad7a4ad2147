//! Answers as JSON: traces, values and plans in the words of the model. Strategies are in
//! [`super::strategy_json`].

use std::io;

use serde_json::{Map, Value as Json, json};

use crate::cancellation;
use crate::game::strategy::plan_list::PlanStep;
use crate::ir::Network;
use crate::learning::Comparison;
use crate::network::Part;
use crate::search::liveness::ending::RunEnding;
use crate::search::optimum::extremum::{Extreme, Extremes};
use crate::stochastic::Estimate;
use crate::verify::State;
use crate::verify::choices::Choice;
use crate::verify::replay::{End, Run};

use super::text::{self, Value};
use crate::engine::answer::{Optimised, Shielded, Values};
use crate::engine::evidence::witness::{Proof, Witness, WitnessKind};

/// An edge.
pub fn part(network: &Network, part: Part) -> Json {
    let process = &network.processes[part.process as usize];
    let edge = &process.edges[part.edge as usize];
    let target = edge.branches[part.branch as usize].target;
    let select: Map<String, Json> = text::selects(network, part)
        .into_iter()
        .map(|(name, value)| (name.to_owned(), json!(value)))
        .collect();
    json!({
        "process": process.name,
        "edge": part.edge,
        "source": process.locations[edge.source.0 as usize].name,
        "target": process.locations[target.0 as usize].name,
        "branch": part.branch,
        "select": select,
        "guard": edge.labels.guard,
        "sync": edge.labels.sync,
        "update": edge.labels.update,
        "controllable": edge.controllable,
    })
}

/// The text of a value. Large ones take long, so that their bytes are counted.
pub fn written(json: &Json) -> String {
    counted(|text| serde_json::to_writer(text, json))
}

/// The text of pairs of numbers; those that are not finite become null.
pub fn written_pairs(pairs: &[(f64, f64)]) -> String {
    counted(|text| serde_json::to_writer(text, pairs))
}

fn counted(write: impl FnOnce(&mut Counted) -> serde_json::Result<()>) -> String {
    let mut text = Counted(Vec::new());
    write(&mut text).expect("memory can be written to");
    String::from_utf8(text.0).expect("JSON is UTF-8")
}

/// Bytes whose writing is work: see [`cancellation::work`].
struct Counted(Vec<u8>);

impl io::Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        cancellation::work(UNITS_FOR_BYTE * bytes.len());
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What it takes to write a byte of a value, and to give back what it was made of.
const UNITS_FOR_BYTE: usize = 8;

/// The edges of a move.
pub fn parts(network: &Network, list: &[Part]) -> Json {
    Json::Array(list.iter().map(|&one| part(network, one)).collect())
}

/// What it takes to write the location of a process, with its share of the state: see
/// [`cancellation::work`].
const UNITS_FOR_LOCATION: usize = 256;

/// The location of each process.
pub fn locations(network: &Network, words: &[i32]) -> Json {
    cancellation::work(UNITS_FOR_LOCATION * network.processes.len());
    let entries = network.processes.iter().enumerate();
    Json::Object(
        entries
            .map(|(index, process)| {
                (
                    process.name.clone(),
                    json!(text::location_name(network, index, words)),
                )
            })
            .collect(),
    )
}

/// The value of each scalar part of each variable.
pub fn variables(network: &Network, words: &[i32]) -> Json {
    let mut values = Map::new();
    text::for_each_value(network, words, |name, value| {
        let value = match value {
            Value::Integer(value) => json!(value),
            Value::Double(value) => json!(value),
        };
        values.insert(name.to_owned(), value);
    });
    Json::Object(values)
}

/// The values of a query for them: of one item its value, of several a list. A value is a number,
/// or "inf" without a greatest one, or null if no state counts; for `bounds` it is the pair of the
/// least and the greatest.
pub fn values(values: &Values) -> Json {
    let one = |extreme: Option<Extreme>| match extreme {
        None => Json::Null,
        Some(Extreme::Infinite) => json!("inf"),
        Some(Extreme::Value { value, .. }) => json!(value),
    };
    let item = |item: &Extremes| match (values.least, values.greatest) {
        (true, true) if *item == Extremes::default() => Json::Null,
        (true, true) => json!([one(item.least), one(item.greatest)]),
        (true, false) => one(item.least),
        _ => one(item.greatest),
    };
    match values.items.as_slice() {
        [only] => item(only),
        items => Json::Array(items.iter().map(item).collect()),
    }
}

/// A number; one that is not finite is null.
pub fn real(value: f64) -> Json {
    if value.is_finite() {
        json!(value)
    } else {
        Json::Null
    }
}

/// What a statistical query found out: `lower` and `upper` bound the interval at this `confidence`;
/// expectations have no `satisfied_runs`. `compared` is the estimate of the second probability of a
/// comparison, with its value.
pub fn estimate(estimate: &Estimate) -> Json {
    let compared = estimate.compared.as_deref().map(|compared| {
        let mut object = self::estimate(compared);
        object["value"] = real(compared.value);
        object
    });
    json!({
        "lower": real(estimate.lower),
        "upper": real(estimate.upper),
        "confidence": real(estimate.confidence),
        "method": estimate.method.name(),
        "runs": estimate.runs,
        "satisfied_runs": estimate.satisfied_runs,
        "compared": compared,
    })
}

/// How the best strategy was found. `judged` is its value by the runs that chose it, `uniform` what
/// runs are worth in which all is chosen uniformly, and `comparison` says whether it is better.
pub fn optimised(optimised: &Optimised) -> Json {
    let uniform = optimised.uniform.as_ref().map(|uniform| {
        let mut object = estimate(uniform);
        object["value"] = real(uniform.value);
        object
    });
    let comparison = optimised.comparison.map(|comparison| match comparison {
        Comparison::Better => "better",
        Comparison::Worse => "worse",
        Comparison::Alike => "alike",
    });
    json!({
        "runs": optimised.runs,
        "iterations": optimised.iterations,
        "iterations_in_last_reset": optimised.iterations_in_last_reset,
        "resets": optimised.resets,
        "judged": real(optimised.judged.value),
        "uniform": uniform,
        "comparison": comparison,
        "is_complete": optimised.is_complete,
        "leaves": optimised.leaves,
    })
}

/// What is known of a shield. `trial` says in how many fresh runs under it what it must keep was
/// broken.
pub fn shielded(shielded: &Shielded) -> Json {
    let trial = shielded.tried.as_ref().map(|tried| {
        let mut object = estimate(tried);
        object["value"] = real(tried.value);
        object
    });
    let facts = &shielded.facts;
    json!({
        "cells": facts.cells,
        "safe_cells": facts.safe_cells,
        "choice_cells": facts.seen_cells,
        "unseen_pairs": facts.unseen_pairs,
        "stuck_runs": facts.stuck,
        "moves": shielded.moves,
        "trial": trial,
    })
}

/// The witnesses of an answer: one object, or, for values, one with a list of `traces`.
///
/// A trace has `format` "ntagen-trace" and `version` 1. `kind` is "failure" where it leads to a
/// failure of the model, and `value` says which value it shows. `states` are symbolic,
/// `transitions` the edges between them, `ending` says why the run never ends: `loop` is the index
/// of the state that its last state leads back to. `run` has exact times, in ticks of which
/// `ticks_per_unit` make a unit of time: its `steps` each wait and take edges, `end` says what
/// comes then, `from` from which moment on what must stay does, and `states` are those on entry,
/// with the one after the last wait. On the way to an error, `failing` has the edges of the
/// transition that fails in the last state; it is not there if looking at guards, invariants or the
/// query fails.
pub fn witnesses(network: &Network, witnesses: &[Witness], query: &str) -> Json {
    let mut json = json!({ "format": TRACE_FORMAT, "version": 1, "query": query });
    let traces = witnesses.iter().map(|one| witness(network, one));
    match (witnesses, &mut json) {
        ([only], Json::Object(fields)) if only.title.is_none() => {
            if let Json::Object(more) = witness(network, only) {
                fields.extend(more);
            }
        }
        _ => json["traces"] = traces.collect(),
    }
    json
}

/// What a file with traces says that it is.
pub const TRACE_FORMAT: &str = "ntagen-trace";

fn witness(network: &Network, witness: &Witness) -> Json {
    let states = witness.trace.states.iter().map(|(words, zone)| {
        json!({
            "locations": locations(network, words),
            "variables": variables(network, words),
            "zone": text::zone_constraints(network, zone),
        })
    });
    let moves = witness.trace.moves.iter().map(|one| parts(network, one));
    let mut json = json!({});
    if let Some(title) = &witness.title {
        json["title"] = json!(title);
    }
    match witness.kind {
        WitnessKind::Failure => json["kind"] = json!("failure"),
        WitnessKind::Predicate => {}
        WitnessKind::Value(item, shown) => {
            json["value"] = json!({
                "item": item,
                "value": shown.value,
                "greatest": shown.is_greatest,
                "reached": shown.is_reached,
            });
        }
    }
    json["states"] = states.collect();
    json["transitions"] = moves.collect();
    if let Some(failing) = &witness.failing {
        json["failing"] = parts(network, failing);
    }
    if let Some(ending) = witness.ending {
        json["ending"] = match ending {
            RunEnding::Loop(start) => json!({ "kind": "loop", "loop": start }),
            RunEnding::Waits => json!({ "kind": "waits" }),
            RunEnding::Stuck => json!({ "kind": "stuck" }),
        };
    }
    if let Some(Proof::Replayed(exact, states, _)) = &witness.run {
        json["run"] = run(network, exact, states);
    }
    json
}

/// A run with exact times.
pub fn run(network: &Network, run: &Run, states: &[State]) -> Json {
    let steps = run
        .steps
        .iter()
        .map(|step| json!({ "wait": step.wait, "edges": parts(network, &step.parts) }));
    let end = match run.end {
        End::After(wait) => json!({ "kind": "after", "wait": wait }),
        End::Loop(state) => json!({ "kind": "loop", "state": state }),
        End::Waits(wait) => json!({ "kind": "waits", "wait": wait }),
        End::Stuck(wait) => json!({ "kind": "stuck", "wait": wait }),
    };
    let states = states.iter().map(|one| state(network, one));
    json!({
        "ticks_per_unit": run.ticks_per_unit,
        "steps": steps.collect::<Vec<_>>(),
        "end": end,
        "from": { "state": run.from.state, "wait": run.from.wait },
        "states": states.collect::<Vec<_>>(),
    })
}

/// A state with clock values in ticks.
pub fn state(network: &Network, state: &State) -> Json {
    let clocks = network.clocks.iter().zip(&state.clocks).skip(1);
    let clocks = clocks.map(|(clock, value)| (clock.name.clone(), json!(value)));
    json!({
        "locations": locations(network, &state.words),
        "variables": variables(network, &state.words),
        "clocks": clocks.collect::<Map<_, _>>(),
    })
}

/// The discrete part of a state.
pub fn discrete(network: &Network, words: &[i32]) -> Json {
    json!({ "locations": locations(network, words), "variables": variables(network, words) })
}

/// What can happen in a state: of each choice the edges, and the windows of waits in ticks, null
/// for one without end.
pub fn choices(network: &Network, choices: &[Choice]) -> Json {
    let list = choices
        .iter()
        .map(|choice| json!({ "edges": parts(network, &choice.parts), "windows": choice.windows }));
    list.collect()
}

/// A plan that ends with these words: the transitions that leave a state without committed
/// locations; all others follow from them.
pub fn plan<'p>(network: &Network, steps: impl Iterator<Item = &'p PlanStep>, end: &[i32]) -> Json {
    let steps = steps.filter(|step| !step.was_committed);
    let steps = steps.map(|step| json!({ "edges": parts(network, &step.parts) }));
    json!({ "steps": steps.collect::<Vec<_>>(), "end": discrete(network, end) })
}

/// What stands before the plans in a list of them, and what after them.
pub fn around_plans(query: &str, count: u64, has_more: bool) -> (String, &'static str) {
    let head = json!({
        "format": "ntagen-model-plans",
        "version": 1,
        "query": query,
        "count": count,
        "complete": !has_more,
    });
    let head = head.to_string();
    let head = head.trim_end_matches('}');
    (format!("{head},\"plans\":["), "]}")
}

//! What is in a model, as JSON: the object that `ntagen info --json` prints and that Python's
//! `Model` is made of.
//!
//! It has `format` "ntagen-model" and `version` 1, and then
//! * `templates` as written: `name`, `parameters` (texts), `locations`, `branch_points`, `edges`. A
//!   location has `id`, `name` (empty without one), `kind` ("normal", "urgent", "committed"),
//!   `initial`, `invariant` and `rate` as text; a branch point has `id`; an edge has `source` and
//!   `target` (ids), `controllable`, `select`, `guard`, `sync`, `update` and `weight` as text,
//!   `nails`. All three say where they are drawn, if the file says so: `position`, `color`, and
//!   `labels`, a position by kind of label. Positions are pairs in the editor's units, x to the
//!   right and y down.
//! * `processes` after instantiation: `name`, `template`, `priority`, and how many `locations` and
//!   `edges` they have; the legs of a branch point are one edge.
//! * `variables`: `name`, `process` (null if global), `type`, `dimensions`, `meta`, `words`;
//!   constants are none.
//! * `clocks`: `name`, `process`, `hybrid`; `channels`: `name`, `broadcast`, `urgent`, `priority`;
//!   arrays of both part by part.
//! * `features`: names of what the model uses beyond plain timed automata.
//! * `scalar_sets`: `size`, whether symmetry reduction applies (`reduced`), and else why not
//!   (`obstacle`, a text) and, if something tells members apart, its place and text (`place`,
//!   `at`), or null.
//! * `state`: the 32-bit `words` of the discrete state, and of these the `location_words`,
//!   `variable_words`, `meta_words`. On request it also says what a search stores of a state:
//!   `stored_bits`, the `padding_bits` that fill up the record, the `constant_words` (not stored,
//!   since nothing writes them), and the `reset_words` (they have their initial value wherever
//!   nothing may still read them, unless the query reads them). If only random runs have a meaning,
//!   nothing is stored, and these are null. `parts` are the locations of processes, then the
//!   variables, then all variables that only random runs know: `kind` ("location", "variable",
//!   "left out"), `name` (empty for the last), `process` (null if global), `meta`, `words`,
//!   `stored_bits`, `constant_words`, `reset_words`, and `live_locations`: in how many locations of
//!   all processes any of the latter may still be read.
//! * `queries`: `text`, `comment`, `expect` (the verdict that the file states, or null), and where
//!   the text begins: `path`, `line`, `column`.
//! * `warnings` as text, and `load_seconds`.

use serde_json::{Map, Value as Json, json};

use crate::cancellation;
use crate::diagnostics::{SourceMap, Span};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::stored_state::{PartOf, StoredPart, StoredState};
use crate::ir::{Features, Network, ProcessId, Shape, Urgency};
use crate::network::{Obstacle, Symmetry};
use crate::syntax::ast::{
    Edge, Expectation, Expr, LabelKind, Location, Parameter, Point, QueryText, Template,
};
use crate::syntax::{print_dimension, print_type};

/// The range of `int` without bounds.
const INT_RANGE: (i32, i32) = (-32768, 32767);

/// What it takes to write a location or an edge: see [`cancellation::work`].
const UNITS_FOR_OBJECT: usize = 2_000;

/// What is in a model; what its states consist of only if that is wanted, since it takes long.
pub fn facts(model: &LoadedModel, with_stored: bool) -> Json {
    let state = if with_stored {
        stored_state(model)
    } else {
        state(model.network())
    };
    let network = model.network();
    let templates = model.templates.iter();
    json!({
        "format": "ntagen-model",
        "version": 1,
        "templates": templates.map(|one| template(one, &model.sources)).collect::<Vec<_>>(),
        "processes": processes(network),
        "variables": variables(network),
        "clocks": clocks(network),
        "channels": channels(network),
        "features": features(model),
        "scalar_sets": scalar_sets(model),
        "state": state,
        "queries": queries(model, &model.queries),
        "warnings": model.warnings,
        "load_seconds": model.load_seconds,
    })
}

fn scalar_sets(model: &LoadedModel) -> Vec<Json> {
    let network = model.network();
    let sets = network.scalar_sets.iter().zip(Symmetry::obstacles(network));
    let facts = sets.map(|(set, obstacle)| {
        let place = match obstacle {
            Some(Obstacle::ToldApart(span)) => Some(model.place(span)),
            _ => None,
        };
        json!({
            "size": set.size,
            "reduced": obstacle.is_none(),
            "obstacle": obstacle.map(obstacle_text),
            "place": place.as_ref().map(|(place, _)| place),
            "at": place.as_ref().map(|(_, text)| text),
        })
    });
    facts.collect()
}

fn obstacle_text(obstacle: Obstacle) -> String {
    match obstacle {
        Obstacle::ToldApart(_) => "something tells its members apart".to_owned(),
        Obstacle::OneMember => "it has one member".to_owned(),
        Obstacle::ManyMembers(most) => format!("it has more than {most} members"),
        Obstacle::OrderedReceivers => {
            "receivers of a broadcast run updates whose order matters".to_owned()
        }
        Obstacle::FirstValues => {
            "values that never change, or processes, differ between members".to_owned()
        }
        Obstacle::Unused => "nothing in a state depends on its members".to_owned(),
    }
}

fn template(template: &Template, sources: &SourceMap) -> Json {
    let initial = template.initial.as_ref().map(|name| name.text.as_str());
    let locations = template.locations.iter();
    let points = template
        .branchpoints
        .iter()
        .map(|one| json!({ "id": one.id, "position": one.position.map(pair) }));
    let edges = template.edges.iter();
    json!({
        "name": template.name.text,
        "parameters": template.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "locations": locations.map(|one| location(one, initial, sources)).collect::<Vec<_>>(),
        "branch_points": points.collect::<Vec<_>>(),
        "edges": edges.map(|one| edge(one, sources)).collect::<Vec<_>>(),
    })
}

fn parameter(parameter: &Parameter) -> String {
    let dimensions = parameter.dimensions.iter().map(print_dimension);
    format!(
        "{} {}{}{}",
        print_type(&parameter.ty),
        if parameter.reference { "&" } else { "" },
        parameter.name.text,
        dimensions.collect::<String>()
    )
}

fn location(location: &Location, initial: Option<&str>, sources: &SourceMap) -> Json {
    cancellation::work(UNITS_FOR_OBJECT);
    let kind = if location.committed {
        "committed"
    } else if location.urgent {
        "urgent"
    } else {
        "normal"
    };
    json!({
        "id": location.id,
        "name": location.name.as_ref().map_or("", |name| name.text.as_str()),
        "kind": kind,
        "initial": initial == Some(location.id.as_str()),
        "invariant": written(location.invariant.as_ref(), sources),
        "rate": written(location.exponential_rate.as_ref(), sources),
        "position": location.position.map(pair),
        "labels": labels(&location.labels),
        "color": location.color.map(color),
    })
}

fn edge(edge: &Edge, sources: &SourceMap) -> Json {
    cancellation::work(UNITS_FOR_OBJECT);
    let select = match (edge.select.first(), edge.select.last()) {
        (Some((first, _)), Some((_, last))) => sources.text(first.span.to(last.span)),
        _ => "",
    };
    let update = match (edge.update.first(), edge.update.last()) {
        (Some(first), Some(last)) => sources.text(first.span.to(last.span)),
        _ => "",
    };
    let sync = edge.sync.as_ref().map_or(String::new(), |sync| {
        let direction = if sync.send { '!' } else { '?' };
        format!("{}{direction}", lines(sources, sync.channel.span))
    });
    let nails: Vec<Json> = edge.nails.iter().copied().map(pair).collect();
    json!({
        "source": edge.source.text,
        "target": edge.target.text,
        "controllable": edge.controllable,
        "select": trimmed_lines(select),
        "guard": written(edge.guard.as_ref(), sources),
        "sync": sync,
        "update": trimmed_lines(update),
        "weight": written(edge.probability.as_ref(), sources),
        "nails": nails,
        "labels": labels(&edge.labels),
        "color": edge.color.map(color),
    })
}

fn pair(point: Point) -> Json {
    json!([point.x, point.y])
}

fn color(color: u32) -> String {
    format!("#{color:06x}")
}

fn labels(labels: &[(LabelKind, Point)]) -> Json {
    let entries = labels.iter().map(|&(kind, point)| {
        let kind = match kind {
            LabelKind::Name => "name",
            LabelKind::Invariant => "invariant",
            LabelKind::ExponentialRate => "rate",
            LabelKind::Select => "select",
            LabelKind::Guard => "guard",
            LabelKind::Synchronisation => "sync",
            LabelKind::Update => "update",
            LabelKind::Probability => "weight",
        };
        (kind.to_owned(), pair(point))
    });
    Json::Object(entries.collect::<Map<_, _>>())
}

/// An expression as written, its lines kept.
fn written(expr: Option<&Expr>, sources: &SourceMap) -> String {
    expr.map_or_else(String::new, |expr| lines(sources, expr.span))
}

fn lines(sources: &SourceMap, span: Span) -> String {
    trimmed_lines(sources.text(span))
}

fn trimmed_lines(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    lines.join("\n")
}

fn processes(network: &Network) -> Vec<Json> {
    let processes = network.processes.iter().map(|process| {
        cancellation::work(UNITS_FOR_OBJECT);
        let edges = process.edges.iter().enumerate();
        let entries = edges.filter(|(number, edge)| {
            let leg = edge.leg.as_ref();
            leg.is_none_or(|leg| leg.first.0 as usize == *number)
        });
        json!({
            "name": process.name,
            "template": process.template,
            "priority": process.priority,
            "locations": process.locations.len(),
            "edges": entries.count(),
        })
    });
    processes.collect()
}

fn owner(network: &Network, owner: Option<ProcessId>) -> Option<&str> {
    let process = network.processes.get(owner?.0 as usize)?;
    Some(&process.name)
}

fn variables(network: &Network) -> Vec<Json> {
    let variables = network.layout.variables.iter().map(|variable| {
        let mut shape = &variable.shape;
        let mut dimensions = Vec::new();
        while let Shape::Array { part, length, .. } = shape {
            dimensions.push(*length);
            shape = part;
        }
        json!({
            "name": variable.name,
            "process": owner(network, variable.owner),
            "type": type_text(shape),
            "dimensions": dimensions,
            "meta": variable.meta,
            "words": variable.shape.words(),
        })
    });
    variables.collect()
}

/// A type as it would be declared; scalar sets have no names here.
fn type_text(shape: &Shape) -> String {
    match shape {
        Shape::Integer { low, high } if (*low, *high) == INT_RANGE => "int".to_owned(),
        Shape::Integer { low, high } => format!("int[{low},{high}]"),
        Shape::Bool => "bool".to_owned(),
        Shape::Double => "double".to_owned(),
        Shape::Scalar { size, .. } => format!("scalar[{size}]"),
        Shape::Array { part, length, .. } => format!("{}[{length}]", type_text(part)),
        Shape::Struct(fields) => {
            let fields = fields
                .iter()
                .map(|(name, shape)| format!("{} {name};", type_text(shape)));
            format!("struct {{ {} }}", fields.collect::<Vec<_>>().join(" "))
        }
    }
}

fn clocks(network: &Network) -> Vec<Json> {
    // The first clock is the reference clock.
    let clocks = network.clocks.iter().skip(1).map(|clock| {
        json!({
            "name": clock.name,
            "process": owner(network, clock.owner),
            "hybrid": clock.hybrid,
        })
    });
    clocks.collect()
}

fn channels(network: &Network) -> Vec<Json> {
    let channels = network.channels.iter().map(|channel| {
        json!({
            "name": channel.name,
            "broadcast": channel.broadcast,
            "urgent": channel.urgent,
            "priority": channel.priority,
        })
    });
    channels.collect()
}

fn state(network: &Network) -> Json {
    let locations = network.processes.len() as u32;
    let layout = &network.layout;
    json!({
        "words": layout.words,
        "location_words": locations,
        "variable_words": layout.identity_words - locations,
        "meta_words": layout.words - layout.identity_words,
    })
}

/// How large a state is, and what is stored of it.
pub fn stored_state(model: &LoadedModel) -> Json {
    let network = model.network();
    let stored = (!model.has_only_random_runs()).then(|| StoredState::new(network));
    let parts = stored.iter().flat_map(|stored| &stored.parts);
    let parts: Vec<Json> = parts.map(|part| stored_part(network, part)).collect();
    let mut state = state(network);
    let stored = stored.as_ref();
    state["stored_bits"] = json!(stored.map(StoredState::stored_bits));
    state["padding_bits"] = json!(stored.map(|stored| stored.padding_bits));
    state["constant_words"] = json!(stored.map(StoredState::constant_words));
    state["reset_words"] = json!(stored.map(StoredState::reset_words));
    state["parts"] = json!(parts);
    state
}

fn stored_part(network: &Network, part: &StoredPart) -> Json {
    cancellation::work(UNITS_FOR_OBJECT);
    let (kind, name, process, meta) = match part.of {
        PartOf::Location(index) => {
            let name = network.processes[index].name.as_str();
            ("location", name, Some(name), false)
        }
        PartOf::Variable(index) => {
            let variable = &network.layout.variables[index];
            let process = owner(network, variable.owner);
            ("variable", variable.name.as_str(), process, variable.meta)
        }
        PartOf::LeftOut { meta } => ("left out", "", None, meta),
    };
    json!({
        "kind": kind,
        "name": name,
        "process": process,
        "meta": meta,
        "words": part.words,
        "stored_bits": part.stored_bits,
        "constant_words": part.constant_words,
        "reset_words": part.reset_words,
        "live_locations": part.live_locations,
    })
}

/// The names of what a model uses beyond plain timed automata, in a fixed order.
fn features(model: &LoadedModel) -> Vec<&'static str> {
    let network = model.network();
    let is_used = |template: &&Template| {
        let mut processes = network.processes.iter();
        processes.any(|process| process.template == template.name.text)
    };
    let used = || model.templates.iter().filter(is_used);
    let shapes = |wanted: fn(&Shape) -> bool| {
        let mut variables = network.layout.variables.iter();
        variables.any(|variable| holds(&variable.shape, wanted))
    };
    let Features {
        priorities,
        default_priority: _,
        diagonals,
        stopwatches,
        strict_invariants,
        guarded_receivers,
        clock_guarded_urgent,
        clock_copies,
        doubles,
        hybrid_clocks,
        uncontrollable,
        legs: _,
    } = &network.features;
    let has_urgency = |wanted| network.locations().any(|one| one.urgency == wanted);
    let has_rates = used().any(|template| {
        let mut locations = template.locations.iter();
        locations.any(|location| location.exponential_rate.is_some())
    });
    let mut names = vec![
        (
            "broadcast-channels",
            network.channels.iter().any(|one| one.broadcast),
        ),
        (
            "urgent-channels",
            network.channels.iter().any(|one| one.urgent),
        ),
        ("urgent-locations", has_urgency(Urgency::Urgent)),
        ("committed-locations", has_urgency(Urgency::Committed)),
        ("priorities", *priorities),
        (
            "select-bindings",
            network.edges().any(|edge| !edge.select.is_empty()),
        ),
        (
            "branch-points",
            used().any(|one| !one.branchpoints.is_empty()),
        ),
        ("uncontrollable-edges", *uncontrollable),
        ("stopwatches", *stopwatches),
        ("hybrid-clocks", *hybrid_clocks),
        ("clock-differences", *diagonals),
        ("clock-copies", *clock_copies),
        ("strict-invariants", *strict_invariants),
        ("clock-guards-on-receivers", *guarded_receivers),
        ("clock-guards-on-urgent-channels", *clock_guarded_urgent),
        ("exponential-rates", has_rates),
        ("structs", shapes(|shape| matches!(shape, Shape::Struct(_)))),
        (
            "scalars",
            shapes(|shape| matches!(shape, Shape::Scalar { .. })),
        ),
        ("doubles", *doubles),
        (
            "meta-variables",
            network.layout.variables.iter().any(|one| one.meta),
        ),
        ("before-update", network.before_update.is_some()),
        ("after-update", network.after_update.is_some()),
    ];
    names.retain(|&(_, is_used)| is_used);
    names.into_iter().map(|(name, _)| name).collect()
}

/// Whether a type or a part of it is wanted.
fn holds(shape: &Shape, wanted: fn(&Shape) -> bool) -> bool {
    let in_parts = match shape {
        Shape::Array { part, .. } => holds(part, wanted),
        Shape::Struct(fields) => fields.iter().any(|(_, shape)| holds(shape, wanted)),
        _ => false,
    };
    in_parts || wanted(shape)
}

/// Queries of a file of the model, as they stand in [`facts`].
pub fn queries(model: &LoadedModel, queries: &[QueryText]) -> Vec<Json> {
    let one = |text| query(text, &model.sources);
    queries.iter().map(one).collect()
}

/// The verdict that a file states for a query.
pub(super) fn expected(expectation: &Expectation) -> Json {
    match expectation {
        Expectation::True => json!("satisfied"),
        Expectation::False => json!("not satisfied"),
        Expectation::MaybeTrue => json!("maybe satisfied"),
        Expectation::MaybeFalse => json!("maybe not satisfied"),
        Expectation::Error => json!("error"),
        Expectation::Number(value) => json!(value),
    }
}

fn query(query: &QueryText, sources: &SourceMap) -> Json {
    let expect = query.expect.as_ref().map(expected);
    let place = sources.position(query.span);
    let options = query.options.iter();
    let options: serde_json::Map<String, Json> = options
        .map(|(key, value)| (key.clone(), json!(value)))
        .collect();
    json!({
        "text": query.text,
        "comment": query.comment,
        "expect": expect,
        "options": options,
        "path": *sources.get(query.span.source).path,
        "line": place.line,
        "column": place.column,
    })
}

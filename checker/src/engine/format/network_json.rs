//! The network as JSON: what a model is after instantiation, by numbers. Files in which other tools
//! number clocks, variables, locations and edges are made of it.
//!
//! It has
//! * `clocks`: the names, without the reference clock;
//! * `variables`: `name`, `low`, `high`, `initial`, `meta` of every part that is an integer, truth
//!   value or scalar, in the order of their words; doubles are left out;
//! * `processes`: `name`, `initial` (a location), `locations` and `edges`. A location has `name`,
//!   `kind` ("normal", "urgent", "committed") and `invariant` as text; an edge has `source`,
//!   `targets` (a location for each leg of its branch point; only one without), `select` (the
//!   names), and `guard`, `sync`, `update` as text, empty where there is none. Parameters stand in
//!   these texts as the template has them.

use serde_json::{Value as Json, json};

use super::text::{self, ValuePlace};
use crate::engine::loaded_model::LoadedModel;
use crate::ir::{Network, Process, Shape, Urgency};
use crate::syntax::ast::Template;

/// The network of a model.
pub fn network(model: &LoadedModel) -> Json {
    let network = model.network();
    let processes = network.processes.iter();
    json!({
        "clocks": network.clocks.iter().skip(1).map(|clock| &clock.name).collect::<Vec<_>>(),
        "variables": variables(network),
        "processes": processes.map(|one| process(model, one)).collect::<Vec<_>>(),
    })
}

fn variables(network: &Network) -> Vec<Json> {
    let mut found = Vec::new();
    for variable in &network.layout.variables {
        let offset = variable.offset as usize;
        text::visit_shape(
            &variable.shape,
            &variable.name,
            offset,
            &mut |name, place| {
                let ValuePlace { shape, offset } = place;
                let (low, high) = match shape {
                    Shape::Integer { low, high } => (i64::from(*low), i64::from(*high)),
                    Shape::Bool => (0, 1),
                    Shape::Scalar { size, .. } => (0, i64::from(*size) - 1),
                    _ => return,
                };
                found.push(json!({
                    "name": name,
                    "low": low,
                    "high": high,
                    "initial": network.initial[offset],
                    "meta": variable.meta,
                }));
            },
        );
    }
    found
}

fn process(model: &LoadedModel, process: &Process) -> Json {
    let mut templates = model.templates.iter();
    let template = templates.find(|one| one.name.text == process.template);
    let locations = process.locations.iter().enumerate().map(|(index, one)| {
        let kind = match one.urgency {
            Urgency::Normal => "normal",
            Urgency::Urgent => "urgent",
            Urgency::Committed => "committed",
        };
        json!({ "name": one.name, "kind": kind, "invariant": invariant(model, template, index) })
    });
    let edges = process.edges.iter().map(|edge| {
        let targets = edge.branches.iter().map(|leg| leg.target.0);
        let select = edge.select.iter().map(|one| &one.name);
        json!({
            "source": edge.source.0,
            "targets": targets.collect::<Vec<_>>(),
            "select": select.collect::<Vec<_>>(),
            "guard": edge.labels.guard,
            "sync": edge.labels.sync,
            "update": edge.labels.update,
        })
    });
    json!({
        "name": process.name,
        "initial": process.initial.0,
        "locations": locations.collect::<Vec<_>>(),
        "edges": edges.collect::<Vec<_>>(),
    })
}

/// The invariant of a location as its template has it, blanks collapsed.
fn invariant(model: &LoadedModel, template: Option<&Template>, location: usize) -> String {
    let invariant = template
        .and_then(|template| template.locations.get(location))
        .and_then(|location| location.invariant.as_ref());
    let words = invariant.map_or("", |invariant| model.sources.text(invariant.span));
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

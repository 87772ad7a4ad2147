//! What edges of a template join: locations and branch points.

use rustc_hash::FxHashMap;

use crate::ir::{self, LocationId};
use crate::syntax::ast;

/// The most edges that the select bindings of one may stand for.
pub(super) const SELECT_LIMIT: u64 = 1 << 20;

/// What an edge can lead to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Endpoint {
    Location(u32),
    Branchpoint(usize),
}

/// What an edge joins.
#[derive(Clone, Copy)]
pub(super) struct Ends<'t> {
    pub(super) template: &'t ast::Template,
    pub(super) nodes: &'t FxHashMap<&'t str, Endpoint>,
    pub(super) source: LocationId,
}

/// What the ids of a template stand for.
pub(super) fn nodes(template: &ast::Template) -> FxHashMap<&str, Endpoint> {
    let mut nodes = FxHashMap::default();
    for (i, location) in template.locations.iter().enumerate() {
        nodes
            .entry(location.id.as_str())
            .or_insert(Endpoint::Location(i as u32));
    }
    for (i, branchpoint) in template.branchpoints.iter().enumerate() {
        nodes
            .entry(branchpoint.id.as_str())
            .or_insert(Endpoint::Branchpoint(i));
    }
    nodes
}

/// The name of a location as it is shown.
pub(super) fn node_name<'t>(
    template: &'t ast::Template,
    nodes: &FxHashMap<&str, Endpoint>,
    id: &'t str,
) -> &'t str {
    let name = match nodes.get(id) {
        Some(&Endpoint::Location(i)) => template.locations[i as usize].name.as_ref(),
        _ => None,
    };
    name.map_or(id, |name| name.text.as_str())
}

/// Whether every binding of an edge has a value.
pub(super) fn has_instances(edge: &ir::Edge) -> bool {
    edge.select.iter().all(|select| select.low <= select.high)
}

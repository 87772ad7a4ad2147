//! Legs of branch points that send: the process chooses the leg, and then sends before anything
//! else that takes time. So such a leg leads to a committed location, and an edge that sends leads
//! on from there with the update of the leg.
//!
//! That is as published models mean it where nothing can keep the edge from being taken: the
//! channel must be a broadcast one, which is seen to where its type is known. A leg that receives,
//! or sends for an edge that has synchronised already, is refused as it stands.

use std::borrow::Cow;

use rustc_hash::FxHashSet;

use crate::syntax::ast::{Document, Edge, Location, Name, Template};

/// Why a leg is refused that synchronises otherwise.
pub(super) const SYNCHRONISES: &str =
    "synchronisations on the legs of branch points are not supported";

/// The document in which no leg sends, as far as that can be written.
pub(super) fn without_sending_legs(document: &Document) -> Cow<'_, Document> {
    if !document
        .templates
        .iter()
        .any(|one| !senders(one).is_empty())
    {
        return Cow::Borrowed(document);
    }
    let mut document = document.clone();
    document.templates.iter_mut().for_each(rewrite);
    Cow::Owned(document)
}

/// Whether an edge leads on from a leg that sends.
pub(super) fn leads_on(edge: &Edge) -> bool {
    // Such an edge begins where the synchronisation of the leg stands; others where their own
    // source stands, or where they begin.
    edge.sync
        .as_ref()
        .is_some_and(|sync| edge.source.span == sync.span)
}

/// The legs that send and can be written otherwise, by their place among the edges.
fn senders(template: &Template) -> Vec<usize> {
    let points: FxHashSet<&str> = template
        .branchpoints
        .iter()
        .map(|point| point.id.as_str())
        .collect();
    if points.is_empty() {
        return Vec::new();
    }
    let has_sent: FxHashSet<&str> = template
        .edges
        .iter()
        .filter(|edge| edge.sync.is_some())
        .map(|edge| edge.target.text.as_str())
        .collect();
    let legs = template.edges.iter().enumerate().filter(|(_, leg)| {
        let sends = leg.sync.as_ref().is_some_and(|sync| sync.send);
        let point = leg.source.text.as_str();
        sends
            && leg.guard.is_none()
            && leg.select.is_empty()
            && points.contains(point)
            && !has_sent.contains(point)
    });
    legs.map(|(place, _)| place).collect()
}

fn rewrite(template: &mut Template) {
    let mut ids: FxHashSet<String> = template
        .locations
        .iter()
        .flat_map(|one| [Some(&one.id), one.name.as_ref().map(|name| &name.text)])
        .flatten()
        .chain(template.branchpoints.iter().map(|point| &point.id))
        .cloned()
        .collect();
    for place in senders(template) {
        let leg = &template.edges[place];
        let Some(sync) = leg.sync.clone() else {
            continue;
        };
        let point = leg.source.text.clone();
        // Whoever owns the edges that lead to the branch point owns its legs.
        let mut entries = template.edges.iter().filter(|one| one.target.text == point);
        let controllable = entries.all(|entry| entry.controllable);
        let drawn = template.branchpoints.iter().find(|one| one.id == point);
        let position = drawn.and_then(|one| one.position);
        let mut number = 1;
        let id = loop {
            let id = format!("{point}_{number}");
            if ids.insert(id.clone()) {
                break id;
            }
            number += 1;
        };
        let between = Name {
            text: id.clone(),
            span: sync.span,
        };
        let span = sync.span;
        let leg = &mut template.edges[place];
        let behind = Edge {
            source: between.clone(),
            target: std::mem::replace(&mut leg.target, between),
            sync: leg.sync.take(),
            update: std::mem::take(&mut leg.update),
            select: Vec::new(),
            guard: None,
            probability: None,
            controllable,
            nails: Vec::new(),
            labels: Vec::new(),
            color: leg.color,
            span: leg.span,
        };
        template.edges.push(behind);
        template.locations.push(Location {
            id,
            name: None,
            invariant: None,
            exponential_rate: None,
            urgent: false,
            committed: true,
            position,
            labels: Vec::new(),
            color: None,
            span,
        });
    }
}

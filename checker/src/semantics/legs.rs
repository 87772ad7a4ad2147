//! Branch points. The edge to one, the *entry*, and one of its legs are one transition, with one
//! synchronisation: the guards of both hold before it, and the entry is updated first.
//!
//! Where all legs of a branch point are always possible they are the branches of one edge of the
//! network. Where some leg has a guard or synchronises, each makes an edge together with the entry:
//! then everything that asks what is possible need not know of branch points. Who asks what is
//! chosen, and what is chance, finds the edges of the same entry by [`ir::Leg`].
//!
//! Expressions of a leg do not see the `select` bindings of the entry, and the other way round.

use rustc_hash::FxHashMap;

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::dynamic::exits;
use super::labels::Select;
use super::nodes::{Endpoint, Ends, SELECT_LIMIT, has_instances, node_name};
use super::scope::{Entity, Scope};
use super::typed::{Expr, LocalId};
use super::types::Type;
use crate::cancellation;
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::{self, EdgeId, FunctionId, LocationId};
use crate::syntax::ast::{self, BinaryOp, ExprKind};

/// What it takes to join an edge and a leg, without their labels: see [`cancellation::work`].
const UNITS_FOR_EDGE: usize = 1 << 12;

/// The most branches that the select bindings of one leg may stand for.
const BRANCH_LIMIT: u64 = 1 << 16;

/// What names of code call an edge with a leg.
fn place_of_leg(ends: &Ends<'_>, entry: &ast::Edge, leg: &ast::Edge) -> String {
    let template = ends.template;
    let name = |node| node_name(template, ends.nodes, node);
    format!(
        "template {}, edge {} → {} → {}",
        template.name.text,
        name(&entry.source.text),
        name(&entry.target.text),
        name(&leg.target.text)
    )
}

/// The bindings of an edge and of its leg; a name that both have gets a mark in the leg.
fn joined(entry: Vec<Select>, own: Vec<Select>) -> Vec<ir::Select> {
    let mut joined: Vec<ir::Select> = entry.into_iter().map(|select| select.range).collect();
    for Select { mut range, .. } in own {
        if joined.iter().any(|other| other.name == range.name) {
            range.name.push('\'');
        }
        joined.push(range);
    }
    joined
}

/// The legs of a branch point, in the order of the file.
fn legs_of<'t>(
    template: &'t ast::Template,
    branchpoint: &'t ast::Branchpoint,
) -> impl Iterator<Item = &'t ast::Edge> {
    let edges = template.edges.iter();
    edges.filter(|leg| leg.source.text == branchpoint.id)
}

/// The legs behind an edge, if each makes an edge of its own.
pub(super) fn legs_apart<'t>(
    template: &'t ast::Template,
    edge: &ast::Edge,
    nodes: &FxHashMap<&str, Endpoint>,
) -> Option<Vec<&'t ast::Edge>> {
    let Some(&Endpoint::Branchpoint(place)) = nodes.get(edge.target.text.as_str()) else {
        return None;
    };
    let legs: Vec<_> = legs_of(template, &template.branchpoints[place]).collect();
    let mut labelled = legs
        .iter()
        .filter(|leg| leg.guard.is_some() || leg.sync.is_some());
    labelled.next().is_some().then_some(legs)
}

impl Checker<'_> {
    /// The edges that an entry makes with each of the legs. The first of them is to have this
    /// number.
    pub(super) fn edges_of_legs(
        &mut self,
        ends: &Ends<'_>,
        entry: &ast::Edge,
        legs: &[&ast::Edge],
        first: EdgeId,
    ) -> Vec<ir::Edge> {
        let mut edges = Vec::new();
        for leg in legs {
            let Some(target) = self.end_of_leg(leg, ends.nodes) else {
                continue;
            };
            let (edge, combinations) = self.edge_of_leg(ends, entry, leg, target);
            edges.push((edge, combinations));
        }
        edges.retain(|(edge, _)| has_instances(edge));
        let is_certain = matches!(edges[..], [(_, 1)]);
        let edges = edges.into_iter().map(|(mut edge, combinations)| {
            edge.leg = (!is_certain).then(|| {
                Box::new(ir::Leg {
                    first,
                    bindings: entry.select.len(),
                    combinations,
                    follows_sync: entry.sync.is_some(),
                    entry: self.edge_labels(entry),
                })
            });
            edge
        });
        edges.collect()
    }

    /// The edge that an entry and a leg make, and how many combinations of `select` values the leg
    /// has.
    fn edge_of_leg(
        &mut self,
        ends: &Ends<'_>,
        entry: &ast::Edge,
        leg: &ast::Edge,
        target: LocationId,
    ) -> (ir::Edge, u32) {
        cancellation::work(UNITS_FOR_EDGE);
        self.locals.clear();
        let template = ends.template;
        let place = place_of_leg(ends, entry, leg);
        self.scopes.push(Scope::default());
        let own = self.selects(&leg.select);
        let scope_of_leg = self.scopes.pop().unwrap_or_default();
        self.scopes.push(Scope::default());
        let selects = self.selects(&entry.select);
        let combinations = self.combinations(&selects, &own, leg);
        let bindings = selects.iter().chain(&own);
        let locals: Vec<LocalId> = bindings.map(|select| select.local).collect();
        let mut conditions = self.conditions_of(entry);
        let mut sync = self.sync_of(entry, &locals, &place);
        let mut effects = self.effects(&entry.update);
        self.scopes.pop();
        self.scopes.push(scope_of_leg);
        conditions.extend(self.conditions_of(leg));
        if let (Some(second), Some(_)) = (&leg.sync, &entry.sync) {
            self.report_second_sync(second.span);
        }
        sync = sync.or(self.sync_of(leg, &locals, &place));
        effects.extend(self.effects(&leg.update));
        let weight = self.weight(leg, &locals, &place);
        self.scopes.pop();
        let guard = self.make_guard(&conditions, &locals, &format!("{place}, guard"));
        let update = self.make_update(&effects, &locals, &format!("{place}, update"));
        let target = self.unless_exit(template, &leg.update, exits(&entry.update), target);
        let target = self.unless_exit(template, &entry.update, 0, target);
        let edge = ir::Edge {
            source: ends.source,
            select: joined(selects, own),
            guard,
            sync,
            update,
            branches: vec![ir::Branch {
                target,
                update: ir::Update::default(),
                weight,
            }],
            leg: None,
            controllable: entry.controllable,
            labels: self.labels_of_leg(entry, leg),
            span: leg.span,
        };
        (edge, combinations)
    }

    fn report_second_sync(&mut self, span: Span) {
        self.report(
            Diagnostic::new(
                codes::SYNCHRONISES_TWICE,
                span,
                "the edge to this branch point synchronises too",
            )
            .note("an edge and a leg are one transition, which synchronises once")
            .help("synchronise on the edge, or on its legs"),
        );
    }

    fn conditions_of(&mut self, edge: &ast::Edge) -> Vec<Expr> {
        let guard = edge.guard.as_ref();
        let conditions = guard.and_then(|guard| self.conditions(guard));
        conditions.unwrap_or_default()
    }

    fn sync_of(&mut self, edge: &ast::Edge, locals: &[LocalId], place: &str) -> Option<ir::Sync> {
        let sync = edge.sync.as_ref()?;
        self.synchronisation(sync, locals, &format!("{place}, synchronisation"))
    }

    /// How many combinations the bindings of a leg have, if those of the edge are not too many.
    fn combinations(&mut self, entry: &[Select], own: &[Select], leg: &ast::Edge) -> u32 {
        let count = |selects: &[Select]| {
            let counts = selects.iter().map(|select| {
                let (low, high) = (i64::from(select.range.low), i64::from(select.range.high));
                u64::try_from(high - low + 1).unwrap_or(0)
            });
            counts.fold(1, u64::saturating_mul)
        };
        let of_leg = count(own);
        if of_leg.saturating_mul(count(entry)) > SELECT_LIMIT {
            self.error(
                codes::RANGE_TOO_LARGE,
                leg.span,
                format!("the selects of this leg and of its edge stand for more than {SELECT_LIMIT} edges"),
                "use smaller ranges",
            );
            return 1;
        }
        of_leg as u32
    }

    /// The labels of an entry and a leg, as those of one edge.
    fn labels_of_leg(&self, entry: &ast::Edge, leg: &ast::Edge) -> ir::EdgeLabels {
        let (mut labels, own) = (self.edge_labels(entry), self.edge_labels(leg));
        let join = |first: &mut String, second: String, between| {
            if !first.is_empty() && !second.is_empty() {
                first.push_str(between);
            }
            first.push_str(&second);
        };
        join(&mut labels.select, own.select, ", ");
        join(&mut labels.update, own.update, ", ");
        join(&mut labels.sync, own.sync, " ");
        let both = entry.guard.is_some() && leg.guard.is_some();
        let conjunct = |text: String, guard: &Option<ast::Expr>| match guard {
            Some(guard) if both && !binds_strongly(guard) => format!("({text})"),
            _ => text,
        };
        labels.guard = conjunct(labels.guard, &entry.guard);
        join(&mut labels.guard, conjunct(own.guard, &leg.guard), " && ");
        labels
    }

    /// How an edge can end: in its target, or by the legs of its branch point.
    pub(super) fn branches(
        &mut self,
        template: &ast::Template,
        edge: &ast::Edge,
        nodes: &FxHashMap<&str, Endpoint>,
        parameters: usize,
        place: &str,
    ) -> Vec<ir::Branch> {
        let branchpoint = match self.node(nodes, &edge.target) {
            None => return Vec::new(),
            Some(Endpoint::Location(target)) => {
                return vec![ir::Branch {
                    target: LocationId(target),
                    update: ir::Update::default(),
                    weight: None,
                }];
            }
            Some(Endpoint::Branchpoint(i)) => &template.branchpoints[i],
        };
        let mut branches = Vec::new();
        for leg in legs_of(template, branchpoint) {
            let Some(target) = self.end_of_leg(leg, nodes) else {
                continue;
            };
            let updates = self.leg(leg, parameters, place);
            let others = exits(&edge.update);
            let target = self.unless_exit(template, &leg.update, others, target);
            branches.extend(updates.into_iter().map(|(update, weight)| ir::Branch {
                target,
                update,
                weight,
            }));
        }
        if branches.is_empty() {
            self.leads_nowhere(branchpoint);
        }
        branches
    }

    fn end_of_leg(
        &mut self,
        leg: &ast::Edge,
        nodes: &FxHashMap<&str, Endpoint>,
    ) -> Option<LocationId> {
        if let Endpoint::Location(target) = self.node(nodes, &leg.target)? {
            return Some(LocationId(target));
        }
        self.refused(
            codes::BRANCH_POINT_OPEN,
            leg.target.span,
            "a leg of a branch point must end in a location",
            "let one branch point have all legs, with the products of the weights",
        )
    }

    fn leads_nowhere(&mut self, branchpoint: &ast::Branchpoint) {
        self.error(
            codes::BRANCH_POINT_OPEN,
            branchpoint.span,
            "the branch point leads nowhere",
            "add a leg that ends in a location, or let the edge end in one",
        );
    }

    /// The updates and weights of a leg: one for each combination of the values of its `select`
    /// bindings.
    fn leg(
        &mut self,
        leg: &ast::Edge,
        parameters: usize,
        place: &str,
    ) -> Vec<(ir::Update, Option<FunctionId>)> {
        let mut ranges = Vec::new();
        for (name, ty) in &leg.select {
            let span = ty.span;
            let Some((ty, _)) = self.iterated(ty) else {
                return Vec::new();
            };
            // Each value is a branch of its own, which exchanging members would renumber.
            self.distinguish_members(&ty, span);
            ranges.push((name, ty));
        }
        let types: Vec<Type> = ranges.iter().map(|(_, ty)| ty.clone()).collect();
        let counts = types.iter().map(|ty| {
            let (low, high) = ty.bounds();
            u64::try_from(i64::from(high) - i64::from(low) + 1).unwrap_or(0)
        });
        if counts.fold(1, u64::saturating_mul) > BRANCH_LIMIT {
            self.error(
                codes::RANGE_TOO_LARGE,
                leg.span,
                "the select of this leg ranges over too many values",
                "use smaller ranges",
            );
            return Vec::new();
        }
        let mut updates = Vec::new();
        for values in super::instantiate::combinations(&types) {
            self.scopes.push(Scope::default());
            for ((name, ty), value) in ranges.iter().zip(values) {
                let value = Expr::int(value, ty.clone(), name.span);
                self.declare(name, Entity::Constant { value, free: false });
            }
            updates.push(self.leg_update(leg, parameters, place));
            self.scopes.pop();
        }
        updates
    }

    fn leg_update(
        &mut self,
        leg: &ast::Edge,
        parameters: usize,
        place: &str,
    ) -> (ir::Update, Option<FunctionId>) {
        // The functions of a leg take the values of the entry's select bindings too, but its
        // expressions do not see them.
        self.locals.clear();
        let unseen: Vec<LocalId> = (0..parameters)
            .map(|_| self.new_local(Type::ANY_INT))
            .collect();
        let weight = self.weight(leg, &unseen, place);
        let place = format!("{place}, update of a branch");
        (self.update(&leg.update, &unseen, &place), weight)
    }

    /// What gives the weight of a leg, in the stochastic reading.
    fn weight(&mut self, leg: &ast::Edge, locals: &[LocalId], place: &str) -> Option<FunctionId> {
        let before = self.unknowns.len();
        let weight = self.expression(leg.probability.as_ref()?);
        self.expect_number(&weight, "a weight");
        if weight.ty == Type::Bool {
            self.error(
                codes::NUMBER_EXPECTED,
                weight.span,
                "a weight must be a number, but this is a truth value",
                "write the weight as an integer or a double",
            );
        }
        self.unknowns.truncate(before);
        if self.reading == Reading::Symbolic {
            return None;
        }
        self.make_real(weight, locals, format!("{place}, weight of a branch"))
    }
}

/// Whether a condition needs no parentheses as a part of a conjunction.
fn binds_strongly(guard: &ast::Expr) -> bool {
    match &guard.kind {
        ExprKind::Binary(operator, ..) => {
            !matches!(operator, BinaryOp::Or | BinaryOp::Xor | BinaryOp::Imply)
        }
        ExprKind::Ternary(..) | ExprKind::Assign(..) | ExprKind::Quantifier { .. } => false,
        _ => true,
    }
}

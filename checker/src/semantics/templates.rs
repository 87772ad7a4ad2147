//! Templates: locations and edges of one process.

use rustc_hash::FxHashMap;

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::labels::Select;
use super::legs::legs_apart;
use super::nodes::{Endpoint, Ends, SELECT_LIMIT, has_instances, node_name, nodes};
use super::operators::is_clock_term;
use super::scope::{Entity, Scope};
use super::typed::{Expr, Kind, LocalId, Place, conjuncts};
use super::types::{Class, Type};
use crate::cancellation;
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::{self, ClockId, EdgeId, FunctionId, Guard, LocationChances, LocationId, Urgency};
use crate::syntax::ast;

/// What it takes to check a location or an edge, without its labels: see [`cancellation::work`].
const UNITS_FOR_EDGE: usize = 1 << 12;

/// The rates of clocks that an invariant sets: in the symbolic reading by clock, and in the
/// stochastic one.
type Rates = (Vec<(ClockId, FunctionId)>, LocationChances);

impl Checker<'_> {
    /// Checks a template whose parameters are declared in the innermost scope, and makes a process
    /// of it.
    pub(super) fn template(&mut self, template: &ast::Template, priority: u32) -> ir::Process {
        self.declarations(&template.declarations);
        for (i, location) in template.locations.iter().enumerate() {
            if let Some(name) = &location.name {
                self.declare(name, Entity::Location(i as u32));
            }
        }
        self.expect_different_branchpoints(template);
        let nodes = nodes(template);
        let locations = template.locations.iter();
        let mut locations: Vec<ir::Location> = locations
            .map(|location| self.location(template, location))
            .collect();
        let edges = self.edges(template, &nodes);
        for (number, edge) in edges.iter().enumerate() {
            let source = &mut locations[edge.source.0 as usize];
            source.edges.push(EdgeId(number as u32));
        }
        let initial = template
            .initial
            .as_ref()
            .map(|name| self.node(&nodes, name));
        let initial = match initial.flatten() {
            Some(Endpoint::Location(i)) => LocationId(i),
            Some(Endpoint::Branchpoint(_)) => {
                self.error(
                    codes::INITIAL_LOCATION,
                    template.name.span,
                    "a branch point cannot be the initial location",
                    "let a location be initial",
                );
                LocationId(0)
            }
            None => LocationId(0),
        };
        ir::Process {
            name: match &self.process {
                Some((_, name)) => name.clone(),
                None => template.name.text.clone(),
            },
            template: template.name.text.clone(),
            locations,
            edges,
            initial,
            priority,
            group: ir::ProcessId(0),
            coordinates: Vec::new(),
        }
    }

    fn edges(
        &mut self,
        template: &ast::Template,
        nodes: &FxHashMap<&str, Endpoint>,
    ) -> Vec<ir::Edge> {
        let mut edges = Vec::new();
        for edge in &template.edges {
            let Some(Endpoint::Location(source)) = self.node(nodes, &edge.source) else {
                continue;
            };
            let source = LocationId(source);
            let made = match legs_apart(template, edge, nodes) {
                Some(legs) => {
                    let ends = Ends {
                        template,
                        nodes,
                        source,
                    };
                    self.edges_of_legs(&ends, edge, &legs, EdgeId(edges.len() as u32))
                }
                None => vec![self.edge(template, edge, nodes, source)],
            };
            // If a binding has no value, there is no edge at all.
            edges.extend(made.into_iter().filter(has_instances));
        }
        edges
    }

    /// Refuses branch points that edges cannot tell from one another or from a location.
    fn expect_different_branchpoints(&mut self, template: &ast::Template) {
        let locations = template.locations.iter();
        let mut ids: FxHashMap<&str, Span> = locations
            .map(|location| (location.id.as_str(), location.span))
            .collect();
        for branchpoint in &template.branchpoints {
            let Some(first) = ids.insert(&branchpoint.id, branchpoint.span) else {
                continue;
            };
            let place = self.sources.position(first);
            self.report(
                Diagnostic::new(
                    codes::NAME_DECLARED_TWICE,
                    branchpoint.span,
                    format!("the branch point '{}' is declared twice", branchpoint.id),
                )
                .note(format!("first declared in line {}", place.line))
                .help("give it another name"),
            );
        }
    }

    pub(super) fn node(
        &mut self,
        nodes: &FxHashMap<&str, Endpoint>,
        name: &ast::Name,
    ) -> Option<Endpoint> {
        let node = nodes.get(name.text.as_str()).copied();
        if node.is_none() {
            self.error(
                codes::LOCATION_UNKNOWN,
                name.span,
                format!("there is no location '{}'", name.text),
                "name a location or a branch point of this template",
            );
        }
        node
    }

    fn location(&mut self, template: &ast::Template, location: &ast::Location) -> ir::Location {
        cancellation::work(UNITS_FOR_EDGE);
        let name = match &location.name {
            Some(name) => name.text.clone(),
            None => format!("_{}", location.id),
        };
        let urgency = if location.committed {
            Urgency::Committed
        } else if location.urgent {
            Urgency::Urgent
        } else {
            Urgency::Normal
        };
        let place = format!("template {}, location {name}", template.name.text);
        let (invariant, rates) = match &location.invariant {
            Some(invariant) => self.invariant(invariant, &place),
            None => (Guard::default(), Rates::default()),
        };
        let (rates, mut chances) = rates;
        if let Some(rate) = &location.exponential_rate {
            self.locals.clear();
            let before = self.unknowns.len();
            let rate = self.expression(rate);
            self.expect_number(&rate, "an exponential rate");
            if rate.ty.is_clock() {
                self.error(
                    codes::NUMBER_EXPECTED,
                    rate.span,
                    "an exponential rate must be a number, but this is a clock",
                    "use a number",
                );
            }
            self.unknowns.truncate(before);
            if self.reading == Reading::Stochastic {
                chances.exponential_rate =
                    self.make_real(rate, &[], format!("{place}, exponential rate"));
            }
        }
        ir::Location {
            name,
            urgency,
            invariant,
            rates,
            chances,
            edges: Vec::new(),
            span: location.span,
        }
    }

    pub(super) fn expect_number(&mut self, expr: &Expr, what: &str) {
        if expr.is_error() {
            return;
        }
        self.expect_pure(expr, what);
        if !(expr.ty.is_number() || is_clock_term(expr)) {
            self.error(
                codes::NUMBER_EXPECTED,
                expr.span,
                format!(
                    "{what} must be a number, but this is {}",
                    expr.ty.described()
                ),
                "use a number",
            );
        }
    }

    /// The invariant without what it says of rates, and the rates in both readings.
    fn invariant(&mut self, expr: &ast::Expr, place: &str) -> (Guard, Rates) {
        self.locals.clear();
        let before = self.unknowns.len();
        let invariant = self.expression(expr);
        if !self.expect_pure(&invariant, "an invariant") || !self.expect_condition(&invariant) {
            self.unknowns.truncate(before);
            return (Guard::default(), Rates::default());
        }
        if let Type::Constraint(class) = invariant.ty
            && class > Class::InvariantWithRate
        {
            self.error(
                codes::CONDITION_NOT_AN_INVARIANT,
                invariant.span,
                "this cannot be an invariant: equalities, negations and disjunctions of clock conditions are too strong",
                "invariants are conjunctions of clock bounds and conditions on variables",
            );
            return (Guard::default(), Rates::default());
        }
        let mut parts = Vec::new();
        conjuncts(invariant, &mut parts);
        let (rates, conditions): (Vec<Expr>, Vec<Expr>) = parts
            .into_iter()
            .partition(|part| matches!(part.kind, Kind::Rate { .. }));
        let guard = self.make_guard(&conditions, &[], &format!("{place}, invariant"));
        self.warn_of_strictness(&guard, expr.span);
        let place = format!("{place}, rate");
        if self.reading == Reading::Stochastic {
            return (guard, (Vec::new(), self.make_rates(rates, &place)));
        }
        let rates = rates
            .into_iter()
            .filter_map(|rate| self.make_rate(rate, &place))
            .collect();
        (guard, (rates, LocationChances::default()))
    }

    fn warn_of_strictness(&mut self, invariant: &Guard, span: Span) {
        if invariant.atoms.iter().any(ir::ClockAtom::is_strict_upper) {
            self.report(
                crate::diagnostics::Diagnostic::new(
                    codes::INVARIANT_STRICT,
                    span,
                    "this invariant has a strict upper bound, so game queries will be refused",
                )
                .help("use <= instead of <"),
            );
        }
    }

    fn edge(
        &mut self,
        template: &ast::Template,
        edge: &ast::Edge,
        nodes: &FxHashMap<&str, Endpoint>,
        source: LocationId,
    ) -> ir::Edge {
        cancellation::work(UNITS_FOR_EDGE);
        self.locals.clear();
        let place = format!(
            "template {}, edge {} → {}",
            template.name.text,
            node_name(template, nodes, &edge.source.text),
            node_name(template, nodes, &edge.target.text)
        );
        self.scopes.push(Scope::default());
        let selects = self.selects(&edge.select);
        let locals: Vec<LocalId> = selects.iter().map(|select| select.local).collect();
        let guard = match &edge.guard {
            Some(guard) => self.guard(guard, &locals, &format!("{place}, guard")),
            None => Guard::default(),
        };
        let sync = edge.sync.as_ref().and_then(|sync| {
            let place = format!("{place}, synchronisation");
            self.synchronisation(sync, &locals, &place)
        });
        let update = self.update(&edge.update, &locals, &format!("{place}, update"));
        self.scopes.pop();
        let mut branches = self.branches(template, edge, nodes, selects.len(), &place);
        for branch in &mut branches {
            branch.target = self.unless_exit(template, &edge.update, 0, branch.target);
        }
        ir::Edge {
            source,
            select: selects.into_iter().map(|select| select.range).collect(),
            guard,
            sync,
            update,
            branches,
            leg: None,
            controllable: edge.controllable,
            labels: self.edge_labels(edge),
            span: edge.span,
        }
    }

    pub(super) fn selects(&mut self, bindings: &[(ast::Name, ast::TypeExpr)]) -> Vec<Select> {
        let mut selects = Vec::new();
        for (name, ty) in bindings {
            let outer = std::mem::take(&mut self.free_parameter_seen);
            let iterated = self.iterated(ty);
            if self.free_parameter_seen {
                self.error(
                    codes::SIZE_HANGS_ON_FREE_PARAMETER,
                    ty.span,
                    "the range of a select must not depend on a free parameter of a process set",
                    "use the widest range and restrict it in the guard",
                );
            }
            self.free_parameter_seen = outer;
            let Some((ty, (low, high))) = iterated else {
                self.declare(name, Entity::Broken);
                continue;
            };
            let local = self.new_local(ty.clone());
            let place = Place::bound(local);
            let set = ty.scalar_set();
            self.declare(name, Entity::Variable { place, ty });
            let range = ir::Select {
                name: name.text.clone(),
                low,
                high,
                set,
            };
            selects.push(Select { local, range });
        }
        let counts = selects
            .iter()
            .map(|select| u64::from(select.range.high.abs_diff(select.range.low)) + 1);
        if counts.fold(1, u64::saturating_mul) > SELECT_LIMIT {
            self.error(
                codes::RANGE_TOO_LARGE,
                bindings[0].1.span,
                format!("this select stands for more than {SELECT_LIMIT} edges"),
                "use smaller ranges",
            );
        }
        selects
    }
}

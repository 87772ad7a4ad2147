//! Queries: their static rules, and lowering to predicates.
//!
//! A predicate is split only down to clocks and `deadlock`; everything below is one function on the
//! words.

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::labels::collapse;
use super::operators::is_clock_term;
use super::typed::{ClockRelation, Expr, Kind, LOCATION_WORDS, Place, Root};
use super::types::{Memory, Type};
use crate::diagnostics::Span;
use crate::ir::{
    self, ClockChoice, ClockId, ClockPredicate, ClockRange, FunctionId, LocationId, Measure,
    Objective, Predicate, ProcessId, QueryKind, Relation,
};
use crate::syntax::ast;

impl Checker<'_> {
    /// Checks and lowers a query.
    pub(super) fn query(&mut self, query: &ast::Query, strategies: &[String]) -> Option<ir::Query> {
        let is_of_runs = matches!(
            query.kind,
            ast::QueryKind::Statistical(_) | ast::QueryKind::Optimum(_) | ast::QueryKind::Shield(_)
        );
        if is_of_runs && self.reading == Reading::Symbolic {
            return self.refused(
                codes::QUERY_UNSUPPORTED,
                query.formula,
                "a query about random runs has an estimate only, and none is wanted here",
                "ask it on its own, with `check`",
            );
        }
        if let ast::QueryKind::Unsupported(name) = &query.kind {
            return self.refused(
                codes::QUERY_UNSUPPORTED,
                name.span,
                format!("{} queries are not supported", name.text),
                "supported are E<>, A[], E[], A<>, -->, sup, inf, bounds, control:, Pr[<=10](<> p), E[<=10; 1000](max: e) and simulate[<=10; 3]{e}",
            );
        }
        for name in query.under.iter().chain(&query.imitate) {
            self.known_strategy(name, strategies);
        }
        if let Some(first) = query.kind.first_under() {
            self.known_strategy(first, strategies);
            let second = query.under.as_ref();
            if second.is_none_or(|second| second.text != first.text) {
                let other = second.map_or_else(
                    || String::from("no strategy"),
                    |second| format!("'{}'", second.text),
                );
                self.error(
                    codes::QUERY_UNSUPPORTED,
                    first.span,
                    format!(
                        "the first probability is under '{}' and the second under {other}: such comparisons are not supported",
                        first.text
                    ),
                    "compare both under the same strategy, or ask for each probability on its own",
                );
            }
        }
        if let Some(name) = &query.imitate {
            self.error(
                codes::QUERY_UNSUPPORTED,
                name.span,
                "no strategy is imitated: `imitate` is not supported",
                "leave it out, or write `under` for what the controller has to follow",
            );
        }
        let kind = self.query_kind(query, strategies)?;
        let name = |name: &Option<ast::Name>| name.as_ref().map(|name| name.text.clone());
        Some(ir::Query {
            text: collapse(self.sources.text(query.span)),
            strategy: name(&query.strategy),
            under: name(&query.under),
            kind,
            span: query.span,
        })
    }

    fn known_strategy(&mut self, name: &ast::Name, strategies: &[String]) {
        if !strategies.contains(&name.text) {
            let help = if strategies.is_empty() {
                String::from("define it first: strategy S = control: …")
            } else {
                format!("the strategies so far are {}", strategies.join(", "))
            };
            self.error(
                codes::STRATEGY_UNKNOWN,
                name.span,
                format!("there is no strategy '{}'", name.text),
                &help,
            );
        }
    }

    fn query_kind(&mut self, query: &ast::Query, strategies: &[String]) -> Option<QueryKind> {
        if let Some(strategy) = &query.strategy
            && strategies.contains(&strategy.text)
        {
            self.report(
                crate::diagnostics::Diagnostic::new(
                    codes::STRATEGY_TWICE,
                    strategy.span,
                    format!(
                        "there is already a strategy '{}'; this one replaces it",
                        strategy.text
                    ),
                )
                .help("give it another name"),
            );
        }
        match &query.kind {
            ast::QueryKind::Reachable(p) => Some(QueryKind::Reachable(self.predicate(p, true)?)),
            ast::QueryKind::Invariantly(p) => {
                Some(QueryKind::Invariantly(self.predicate(p, true)?))
            }
            ast::QueryKind::PotentiallyAlways(p) => {
                Some(QueryKind::PotentiallyAlways(self.predicate(p, false)?))
            }
            ast::QueryKind::Eventually(p) => Some(QueryKind::Eventually(self.predicate(p, false)?)),
            ast::QueryKind::LeadsTo(p, q) => {
                let (p, q) = (self.predicate(p, false), self.predicate(q, false));
                Some(QueryKind::LeadsTo(p?, q?))
            }
            ast::QueryKind::Extremum {
                extremum,
                predicate,
                items,
            } => self.extremum(*extremum, predicate.as_ref(), items),
            ast::QueryKind::Control(control) => self.control(control, query.span),
            ast::QueryKind::SaveStrategy { file, strategy } => {
                self.known_strategy(strategy, strategies);
                Some(QueryKind::SaveStrategy {
                    file: file.clone(),
                    strategy: strategy.text.clone(),
                })
            }
            ast::QueryKind::LoadStrategy { file, features } => {
                if query.strategy.is_none() {
                    self.error(
                        codes::STRATEGY_WITHOUT_NAME,
                        query.span,
                        "a loaded strategy needs a name",
                        "write strategy S = loadStrategy(…)",
                    );
                }
                Some(QueryKind::LoadStrategy {
                    file: file.clone(),
                    features: features.as_ref().map(|one| self.feature_texts(one)),
                })
            }
            ast::QueryKind::Statistical(asked) => {
                let asked = self.statistical(asked, query.span)?;
                Some(QueryKind::Statistical(Box::new(asked)))
            }
            ast::QueryKind::Optimum(asked) => {
                let optimum = self.optimum(asked, query.span)?;
                Some(QueryKind::Optimum(Box::new(optimum)))
            }
            ast::QueryKind::Shield(asked) => {
                let shield = self.shield(asked, query)?;
                Some(QueryKind::Shield(Box::new(shield)))
            }
            ast::QueryKind::Unsupported(_) => None,
        }
    }

    fn extremum(
        &mut self,
        extremum: ast::Extremum,
        predicate: Option<&ast::Expr>,
        items: &[ast::Expr],
    ) -> Option<QueryKind> {
        let states = match predicate {
            Some(predicate) => self.predicate(predicate, false),
            None => Some(Predicate::Constant(true)),
        };
        let measures: Vec<Option<(Measure, String)>> =
            items.iter().map(|item| self.measure(item)).collect();
        Some(QueryKind::Extremum {
            least: extremum != ast::Extremum::Sup,
            greatest: extremum != ast::Extremum::Inf,
            predicate: states?,
            items: measures.into_iter().collect::<Option<_>>()?,
        })
    }

    /// Checks and lowers what `sup` and `inf` measure, with its text.
    pub(super) fn measure(&mut self, item: &ast::Expr) -> Option<(Measure, String)> {
        let expr = self.expression(item);
        self.report_members(&expr, item.span);
        if expr.is_error() {
            return None;
        }
        self.expect_pure(&expr, "a query");
        if self.refuse_doubles(&expr) {
            return None;
        }
        let text = collapse(self.sources.text(item.span));
        if expr.ty.is_clock() && expr.variable().is_some() {
            let clock = self.clock_choice(&expr)?;
            return Some((Measure::Clock(clock), text));
        }
        if !expr.ty.is_integral() {
            return self.refused(
                codes::MEASURE_EXPECTED,
                expr.span,
                format!(
                    "sup and inf measure clocks and integers, but this is {}",
                    expr.ty.described()
                ),
                "name a clock or an integer expression",
            );
        }
        Some((Measure::Integer(self.query_function(&expr)?), text))
    }

    fn control(&mut self, control: &ast::Control, span: Span) -> Option<QueryKind> {
        self.refuse_strict_invariants(span);
        let objective = self.objective(&control.objective);
        let time_optimal = match &control.time_optimal {
            None => Some(None),
            Some((bound, rest)) => {
                let bound = bound.as_ref().map(|bound| self.time_bound(bound));
                let rest = rest.as_ref().map(|rest| self.time_bound(rest));
                match (bound, rest) {
                    (Some(None), _) | (_, Some(None)) => None,
                    (bound, rest) => Some(Some(ir::TimeBounds {
                        limit: bound.flatten(),
                        rest: rest.flatten(),
                    })),
                }
            }
        };
        let observations = match &control.observations {
            None => Some(None),
            Some(observations) => {
                self.check_observable(span);
                let predicates: Vec<Option<Predicate>> = observations
                    .iter()
                    .map(|observation| self.observation(&observation.predicate))
                    .collect();
                predicates.into_iter().collect::<Option<Vec<_>>>().map(Some)
            }
        };
        Some(QueryKind::Control(ir::Control {
            objective: objective?,
            cooperative: control.cooperative,
            time_optimal: time_optimal?,
            observations: observations?,
        }))
    }

    fn objective(&mut self, objective: &ast::Objective) -> Option<Objective> {
        Some(match objective {
            ast::Objective::Reach(p) => Objective::Reach(self.predicate(p, false)?),
            ast::Objective::Safe(p) => Objective::Safe(self.predicate(p, false)?),
            ast::Objective::Until(p, q) => {
                let (p, q) = (self.predicate(p, false), self.predicate(q, false));
                Objective::Until(p?, q?)
            }
            ast::Objective::WeakUntil(p, q) => {
                let (p, q) = (self.predicate(p, false), self.predicate(q, false));
                Objective::WeakUntil(p?, q?)
            }
            ast::Objective::Buchi(p, q) => {
                let (p, q) = (self.predicate(p, false), self.predicate(q, false));
                Objective::Buchi(p?, q?)
            }
        })
    }

    fn time_bound(&mut self, bound: &ast::Expr) -> Option<FunctionId> {
        let bound = self.expression(bound);
        self.expect_pure(&bound, "a time bound");
        if !self.expect_integer(&bound, "a time bound") {
            return None;
        }
        self.query_function(&bound)
    }

    fn refuse_strict_invariants(&mut self, span: Span) {
        if self.world.network.features.strict_invariants {
            self.error(
                codes::GAME_WITH_STRICT_INVARIANT,
                span,
                "game queries are refused on models with strict invariants",
                "use <= in all invariants: a strict limit has no last moment at which a move can be forced",
            );
        }
    }

    /// With partial observation the controller must not depend on strict lower bounds.
    fn check_observable(&mut self, span: Span) {
        let edges = self.world.network.edges();
        let atoms = |edge: &ir::Edge| edge.guard.atoms.iter().any(ir::ClockAtom::is_strict_lower);
        if edges.filter(|edge| edge.controllable).any(atoms) {
            self.error(
                codes::OBSERVATION_REFUSED,
                span,
                "partial observation needs a model without strict lower bounds on controllable edges",
                "use >= instead of > in the guards of controllable edges",
            );
        }
    }

    fn observation(&mut self, observation: &ast::Expr) -> Option<Predicate> {
        let expr = self.checked_predicate(observation, false)?;
        let is_bad = |e: &Expr| match &e.kind {
            Kind::ClockCompare {
                relation,
                left,
                right,
                ..
            } => !matches!(
                (relation, left.is_some(), right.is_some()),
                (ClockRelation::LessEqual, false, true) | (ClockRelation::Less, true, false)
            ),
            _ => false,
        };
        if expr.any(&is_bad) {
            return self.refused(
                codes::OBSERVATION_REFUSED,
                expr.span,
                "clocks can be observed only by x >= c and x < c",
                "use weak lower and strict upper bounds, and no differences",
            );
        }
        self.lower_predicate(&expr)
    }

    /// A predicate of a query.
    fn predicate(&mut self, expr: &ast::Expr, allows_deadlock: bool) -> Option<Predicate> {
        let expr = self.checked_predicate(expr, allows_deadlock)?;
        self.lower_predicate(&expr)
    }

    /// A condition that a query asks for.
    pub(super) fn query_condition(&mut self, expr: &ast::Expr) -> Option<Expr> {
        let span = expr.span;
        let expr = self.expression(expr);
        self.report_members(&expr, span);
        if !self.expect_condition(&expr) {
            return None;
        }
        self.expect_pure(&expr, "a query");
        Some(expr)
    }

    fn checked_predicate(&mut self, expr: &ast::Expr, allows_deadlock: bool) -> Option<Expr> {
        let span = expr.span;
        let expr = self.query_condition(expr)?;
        self.refuse_doubles(&expr);
        if expr.any(&|e| matches!(e.kind, Kind::Deadlock)) {
            self.check_deadlock(&expr, allows_deadlock);
        }
        if expr.any(&|e| matches!(e.kind, Kind::Rate { .. })) {
            return self.refused(
                codes::RATE_MISPLACED,
                span,
                "the rate of a clock cannot be asked for",
                "leave it out",
            );
        }
        Some(expr)
    }

    /// Reports a member of a process set that is chosen outside a quantifier and cannot be indexed.
    pub(super) fn report_members(&mut self, expr: &Expr, span: Span) {
        if std::mem::take(&mut self.needs_unrolling) && expr.is_error() {
            self.error(
                codes::MEMBER_NOT_CONSTANT,
                span,
                "the members of the process set differ in this, so the number of the process must be constant",
                "write P(0), or let a quantifier run over the numbers",
            );
        }
    }

    fn refuse_doubles(&mut self, expr: &Expr) -> bool {
        let hybrid = Type::Clock { hybrid: true };
        let is_refused = expr.ty == hybrid
            || expr.any(&|e| match &e.kind {
                Kind::CompareWords(_, left, _) => left.ty.any(&|part| *part == Type::Double),
                _ => e.ty == Type::Double,
            });
        if is_refused {
            // What is reported here says it all.
            self.unknowns.clear();
            let computes_with_clocks =
                expr.any(&|e| matches!(&e.kind, Kind::Unknown(from) if is_clock_term(from)));
            if computes_with_clocks {
                self.too_many_clocks(expr.span);
                return true;
            }
            self.error(
                codes::DOUBLE_IN_QUERY,
                expr.span,
                "symbolic and game queries cannot use doubles and hybrid clocks",
                "use an integer in the model instead",
            );
        }
        is_refused
    }

    fn check_deadlock(&mut self, expr: &Expr, allows_deadlock: bool) {
        let features = &self.world.network.features;
        if !allows_deadlock {
            self.error(
                codes::DEADLOCK_MISPLACED,
                expr.span,
                "deadlock is only allowed in E<> and A[] queries",
                "ask E<> deadlock or A[] not deadlock",
            );
        } else if features.priorities || features.guarded_receivers {
            self.error(
                codes::DEADLOCK_UNSUPPORTED,
                expr.span,
                "deadlock cannot be decided on models with priorities or with clock guards on broadcast receivers",
                "remove the priorities, or the clock guards of the receivers",
            );
        }
    }

    fn lower_predicate(&mut self, expr: &Expr) -> Option<Predicate> {
        if let Some(location) = bare_location(expr) {
            return Some(location);
        }
        if let Kind::And(..) | Kind::Or(..) = &expr.kind {
            let is_and = matches!(expr.kind, Kind::And(..));
            let mut parts = Vec::new();
            operands(expr, is_and, &mut parts);
            let is_split = |part: &&Expr| part.mentions_clocks() || bare_location(part).is_some();
            if parts.iter().any(is_split) {
                return self.split(&parts, is_and);
            }
        }
        if !expr.mentions_clocks() {
            return match expr.constant() {
                Some(value) => Some(Predicate::Constant(value != 0)),
                None => Some(Predicate::Data(self.truth_function(expr)?)),
            };
        }
        match &expr.kind {
            Kind::Not(inner) => Some(Predicate::Not(Box::new(self.lower_predicate(inner)?))),
            Kind::Deadlock => Some(Predicate::Deadlock),
            Kind::ClockCompare {
                relation,
                left,
                right,
                bound,
                negated,
            } => self.clock_predicate(
                *relation,
                left.as_deref(),
                right.as_deref(),
                bound,
                *negated,
            ),
            _ => self.refused(
                codes::CONDITION_EXPECTED,
                expr.span,
                "clock conditions are not allowed inside this expression",
                "join them with &&, || and not",
            ),
        }
    }

    /// A conjunction or disjunction; neighbours on the words alone are merged into one function.
    fn split(&mut self, parts: &[&Expr], is_and: bool) -> Option<Predicate> {
        let mut predicates = Vec::new();
        let mut data: Option<Expr> = None;
        for &part in parts {
            let is_data = !part.mentions_clocks() && bare_location(part).is_none();
            if is_data {
                data = Some(match data.take() {
                    None => part.clone(),
                    Some(before) if is_and => self.conjunction(before, part.clone(), part.span),
                    Some(before) => self.disjunction(before, part.clone(), part.span),
                });
                continue;
            }
            if let Some(data) = data.take() {
                predicates.push(self.lower_predicate(&data)?);
            }
            predicates.push(self.lower_predicate(part)?);
        }
        if let Some(data) = data {
            predicates.push(self.lower_predicate(&data)?);
        }
        Some(if is_and {
            Predicate::And(predicates)
        } else {
            Predicate::Or(predicates)
        })
    }

    fn clock_predicate(
        &mut self,
        relation: ClockRelation,
        left: Option<&Expr>,
        right: Option<&Expr>,
        bound: &Expr,
        negated: bool,
    ) -> Option<Predicate> {
        let left = self.clock_or_reference(left)?;
        let right = self.clock_or_reference(right)?;
        let function = self.query_function(bound)?;
        let compare = |left, right, strict| {
            Predicate::Clock(ClockPredicate {
                left,
                right,
                strict,
                bound: function,
                range: bound.interval,
            })
        };
        let not = |predicate| Predicate::Not(Box::new(predicate));
        // With a negated bound, l - r < -b is the same as not (r - l <= b).
        Some(match (relation, negated) {
            (ClockRelation::Less, false) => compare(left, right, true),
            (ClockRelation::LessEqual, false) => compare(left, right, false),
            (ClockRelation::Less, true) => not(compare(right, left, false)),
            (ClockRelation::LessEqual, true) => not(compare(right, left, true)),
            (ClockRelation::Equal | ClockRelation::NotEqual, _) => {
                let (left, right) = if negated {
                    (right, left)
                } else {
                    (left, right)
                };
                let equal = Predicate::And(vec![
                    compare(left, right, false),
                    not(compare(left, right, true)),
                ]);
                if relation == ClockRelation::Equal {
                    equal
                } else {
                    not(equal)
                }
            }
        })
    }

    fn clock_or_reference(&mut self, clock: Option<&Expr>) -> Option<ClockChoice> {
        match clock {
            None => Some(ClockChoice::Fixed(ClockId(0))),
            Some(clock) => self.clock_choice(clock),
        }
    }

    fn clock_choice(&mut self, clock: &Expr) -> Option<ClockChoice> {
        if let Some(clock) = Self::known_clock(clock) {
            return Some(ClockChoice::Fixed(clock));
        }
        if clock.variable().is_none() {
            return self.refused(
                codes::CLOCK_CHOSEN,
                clock.span,
                "the clock of a query cannot be chosen by ?:",
                "name a clock",
            );
        }
        if !self.can_lower() {
            return None;
        }
        let mut builder = self.builder(&[]);
        let (first, count, index) = builder.offset(clock, Memory::Clocks);
        let first = ClockId(first);
        let function = builder.offset_function(String::from("query, clock"), index?);
        Some(ClockChoice::Indexed(ClockRange { first, count }, function))
    }

    fn query_function(&mut self, expr: &Expr) -> Option<FunctionId> {
        if !self.can_lower() {
            return None;
        }
        let builder = self.builder(&[]);
        Some(builder.expression(String::from("query"), expr).0)
    }

    fn truth_function(&mut self, expr: &Expr) -> Option<FunctionId> {
        let truth = super::operators::as_truth(expr.clone(), expr.span);
        self.query_function(&truth)
    }
}

/// The operands of a chain of one operator, from left to right.
fn operands<'e>(expr: &'e Expr, is_and: bool, parts: &mut Vec<&'e Expr>) {
    match &expr.kind {
        Kind::And(left, right) if is_and => {
            operands(left, is_and, parts);
            operands(right, is_and, parts);
        }
        Kind::Or(left, right) if !is_and => {
            operands(left, is_and, parts);
            operands(right, is_and, parts);
        }
        _ => parts.push(expr),
    }
}

/// `P.l` alone.
fn bare_location(expr: &Expr) -> Option<Predicate> {
    let Kind::Compare(Relation::Equal, left, right) = &expr.kind else {
        return None;
    };
    match (&left.kind, right.constant()) {
        (
            Kind::Variable(Place {
                root: Root::State,
                base,
                ..
            }),
            Some(location),
        ) if base.words >= LOCATION_WORDS => Some(Predicate::Location(
            ProcessId(base.words - LOCATION_WORDS),
            LocationId(location as u32),
        )),
        _ => None,
    }
}

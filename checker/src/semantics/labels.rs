//! Guards, invariants, synchronisations and updates: checking, and lowering to what the network
//! runs.

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::layout::merge_ranges;
use super::lower::clocks::{bound_range, comparisons};
use super::lower::horizons::curved;
use super::offsets::state_offset;
use super::operators::to_double;
use super::typed::{ClockEffect, ClockSet, Effects, Expr, Kind, LocalId, conjuncts};
use super::types::{Class, Memory, Type};
use crate::ir::{
    self, AssignedValue, ChannelId, ClockAssignment, ClockAtom, ClockId, ClockRange,
    FixedConstraint, FunctionId, Guard, Relation, Update,
};
use crate::syntax::ast;

/// A `select` binding: the local that stands for it, and its range.
pub(super) struct Select {
    pub(super) local: LocalId,
    pub(super) range: ir::Select,
}

impl Checker<'_> {
    /// Checks and lowers a guard.
    pub(super) fn guard(&mut self, guard: &ast::Expr, locals: &[LocalId], place: &str) -> Guard {
        match self.conditions(guard) {
            Some(parts) => self.make_guard(&parts, locals, place),
            None => Guard::default(),
        }
    }

    /// The conditions whose conjunction a guard is; `None` if it is none.
    pub(super) fn conditions(&mut self, guard: &ast::Expr) -> Option<Vec<Expr>> {
        let before = self.unknowns.len();
        let guard = self.expression(guard);
        if !self.expect_pure(&guard, "a guard") || !self.expect_condition(&guard) {
            self.unknowns.truncate(before);
            return None;
        }
        let sets_rates = guard.any(&|e| matches!(e.kind, Kind::Rate { .. }))
            || guard.ty == Type::Constraint(Class::InvariantWithRate);
        if sets_rates || guard.ty == Type::Constraint(Class::Query) {
            return self.refused(
                codes::CONDITION_NOT_A_GUARD,
                guard.span,
                "this cannot be a guard: inequalities, negations and disjunctions of clock conditions, and rates, are not guards",
                "split the edge into one for each case",
            );
        }
        let mut parts = Vec::new();
        conjuncts(guard, &mut parts);
        Some(parts)
    }

    /// Lowers a conjunction of conditions.
    pub(super) fn make_guard(&mut self, parts: &[Expr], locals: &[LocalId], place: &str) -> Guard {
        for part in parts {
            self.depends_on_clocks(part);
        }
        if self.reading == Reading::Stochastic {
            return self.make_mask(parts, locals, place);
        }
        let mut guard = Guard {
            never_holds: parts.iter().any(|part| part.interval == (0, 0)),
            ..Guard::default()
        };
        if !self.can_lower() {
            guard.atoms = parts
                .iter()
                .flat_map(fixed_constraints)
                .map(ClockAtom::from)
                .collect();
            return guard;
        }
        let mut rest = Vec::new();
        for part in parts {
            let fixed = fixed_constraints(part);
            if fixed.is_empty() {
                rest.push(part);
            }
            guard
                .atoms
                .extend(fixed.iter().copied().map(ClockAtom::from));
            guard.fixed.extend(fixed);
        }
        if rest.is_empty() {
            return guard;
        }
        if guard.never_holds {
            guard.atoms.clear();
        }
        let (function, effects) = self.builder(locals).guard(place.to_owned(), &rest);
        guard.function = Some(function);
        if !guard.never_holds {
            guard.atoms.extend(effects.atoms);
        }
        guard.emits = effects.emits;
        guard
    }

    /// Lowers a conjunction of conditions on real clocks.
    fn make_mask(&mut self, parts: &[Expr], locals: &[LocalId], place: &str) -> Guard {
        if !self.can_lower() || parts.is_empty() {
            return Guard::default();
        }
        let parts_by_reference: Vec<&Expr> = parts.iter().collect();
        let builder = self.builder(locals);
        let (function, is_timed) = builder.mask(place.to_owned(), &parts_by_reference);
        // Offsets in queries are final, those in the model are not: only these are relocated.
        let apart = (is_timed && !self.is_query).then(|| self.guard_parts(parts, locals, place));
        Guard {
            function: Some(function),
            is_timed,
            is_curved: parts.iter().any(|part| curved(part).is_some()),
            parts: apart.flatten().map(Box::new),
            never_holds: parts.iter().any(|part| part.interval == (0, 0)),
            ..Guard::default()
        }
    }

    /// A conjunction in parts, if each of them is a condition on words or compares a clock with a
    /// number that does not change as time passes.
    fn guard_parts(
        &mut self,
        parts: &[Expr],
        locals: &[LocalId],
        place: &str,
    ) -> Option<ir::GuardParts> {
        let (timed, on_words): (Vec<&Expr>, Vec<&Expr>) =
            parts.iter().partition(|part| part.is_timed());
        let compared: Option<Vec<_>> = timed.into_iter().map(clock_with_number).collect();
        let mut comparisons = Vec::new();
        for (clock, relation, bound) in compared? {
            let bound = if let Kind::Double(value) = bound.kind {
                ir::RealBound::Constant(value)
            } else {
                let function = self.make_real(bound.clone(), locals, place.to_owned())?;
                ir::RealBound::Computed(function)
            };
            comparisons.push(ir::RealComparison {
                clock,
                relation,
                bound,
            });
        }
        let on_words = (!on_words.is_empty())
            .then(|| self.builder(locals).mask(place.to_owned(), &on_words).0);
        Some(ir::GuardParts {
            on_words,
            comparisons,
        })
    }

    /// A function that leaves the value of a number as a double.
    pub(super) fn make_real(
        &mut self,
        expr: Expr,
        locals: &[LocalId],
        place: String,
    ) -> Option<FunctionId> {
        if expr.is_error() || !expr.ty.is_number() || !self.can_lower() {
            return None;
        }
        Some(self.builder(locals).real_result(place, &to_double(expr)))
    }

    /// What an invariant says of the rates of real clocks.
    pub(super) fn make_rates(&mut self, rates: Vec<Expr>, place: &str) -> ir::LocationChances {
        let mut chances = ir::LocationChances::default();
        let mut pairs = Vec::new();
        for rate in rates {
            let span = rate.span;
            let Kind::Rate { clock, rate } = rate.kind else {
                continue;
            };
            let Some(offset) = state_offset(&clock, Memory::Words) else {
                self.error(
                    codes::RATE_OF_NO_CLOCK,
                    span,
                    "the rate of a clock that is chosen when the model runs cannot be set",
                    "use a constant index",
                );
                continue;
            };
            let same = chances.rated_clocks.iter().position(|one| *one == offset);
            if let Some(same) = same {
                // A quantifier inside another one says the same several times.
                let (_, first): &(Expr, Expr) = &pairs[same];
                if format!("{:?}", first.kind) == format!("{:?}", rate.kind) {
                    continue;
                }
                self.error(
                    codes::RATE_TWICE,
                    span,
                    "this invariant gives a clock two rates",
                    "leave one of them out",
                );
            }
            chances.flows.push(rate.is_timed());
            chances.rated_clocks.push(offset);
            pairs.push((*clock, *rate));
        }
        if !pairs.is_empty() && self.can_lower() {
            let function = self.builder(&[]).rates(place.to_owned(), &pairs);
            chances.rates = Some(function);
        }
        chances
    }

    /// The clock and the function of `clock' == rate`.
    pub(super) fn make_rate(&mut self, rate: Expr, place: &str) -> Option<(ClockId, FunctionId)> {
        let span = rate.span;
        let Kind::Rate { clock, rate } = rate.kind else {
            return None;
        };
        let Some(clock) = Self::known_clock(&clock) else {
            return self.refused(
                codes::RATE_OF_NO_CLOCK,
                span,
                "the rate of a clock that is chosen when the model runs cannot be set",
                "use a constant index",
            );
        };
        if !self.can_lower() {
            return None;
        }
        let zero_or_one = Type::Int { low: 0, high: 1 };
        let builder = self.builder(&[]);
        let (function, _) = builder.ranged(place.to_owned(), &rate, &zero_or_one);
        Some((clock, function))
    }

    /// Checks and lowers a synchronisation.
    pub(super) fn synchronisation(
        &mut self,
        sync: &ast::Sync,
        locals: &[LocalId],
        place: &str,
    ) -> Option<ir::Sync> {
        let channel = self.expression(&sync.channel);
        self.expect_pure(&channel, "a synchronisation");
        if channel.is_error() {
            return None;
        }
        if matches!(channel.ty, Type::Channel { .. })
            && channel.any(&|e| matches!(e.kind, Kind::Ternary(..)))
        {
            return self.refused(
                codes::CHANNEL_CHOSEN,
                channel.span,
                "the channel of a synchronisation cannot be chosen by ?:",
                "write an edge for each channel and the choice into their guards, or put the channels into an array: c[i]!",
            );
        }
        if !matches!(channel.ty, Type::Channel { .. }) || channel.variable().is_none() {
            return self.refused(
                codes::CHANNEL_EXPECTED,
                channel.span,
                format!(
                    "a channel is needed here, but this is {}",
                    channel.ty.described()
                ),
                "write channel! or channel?",
            );
        }
        if !self.can_lower() {
            return None;
        }
        let functions = self.world.network.functions.len();
        let mut builder = self.builder(locals);
        let (first, count, index) = builder.offset(&channel, super::types::Memory::Channels);
        let index = index.map(|index| builder.offset_function(place.to_owned(), index));
        if index.is_none() {
            self.world.network.functions.truncate(functions);
        }
        Some(ir::Sync {
            send: sync.send,
            channel: ChannelId(first),
            count,
            index,
        })
    }

    /// Checks and lowers an update.
    pub(super) fn update(
        &mut self,
        exprs: &[ast::Expr],
        locals: &[LocalId],
        place: &str,
    ) -> Update {
        let checked = self.effects(exprs);
        self.make_update(&checked, locals, place)
    }

    /// The expressions of an update that have effects.
    pub(super) fn effects(&mut self, exprs: &[ast::Expr]) -> Vec<Expr> {
        let mut checked = Vec::new();
        for expr in exprs {
            let expr = if matches!(expr.kind, ast::ExprKind::Exit) {
                self.exit(expr.span)
            } else {
                self.effect_expression(expr)
            };
            if !matches!(expr.kind, Kind::Int(_)) {
                checked.push(expr);
            }
        }
        checked
    }

    /// Lowers an update. Resets to constants are taken out if nothing else sets or reads clocks.
    pub(super) fn make_update(
        &mut self,
        exprs: &[Expr],
        locals: &[LocalId],
        place: &str,
    ) -> Update {
        if !self.can_lower() || exprs.is_empty() {
            return Update::default();
        }
        let mut update = Update::default();
        let (resets, others): (Vec<Expr>, Vec<Expr>) = exprs
            .iter()
            .cloned()
            .partition(|expr| fixed_reset(expr).is_some());
        let is_separable = !others.iter().any(sets_clocks);
        let rest = if is_separable { &others[..] } else { exprs };
        if is_separable {
            for (clock, value) in resets.iter().filter_map(fixed_reset) {
                update.fixed.retain(|&(earlier, _)| earlier != clock);
                update.fixed.push((clock, value));
            }
        }
        update.assignments = update
            .fixed
            .iter()
            .map(|&(clock, value)| fixed_assignment(clock, value))
            .collect();
        if rest.is_empty() {
            return update;
        }
        let (function, effects) = self.builder(locals).update(place.to_owned(), rest);
        update.function = Some(function);
        update.emits = effects.emits;
        update.assignments.extend(assignments(&effects));
        update.writes = merge_ranges(effects.writes);
        update
    }

    /// The labels of an edge as text.
    pub(super) fn edge_labels(&self, edge: &ast::Edge) -> ir::EdgeLabels {
        let text = |span| collapse(self.sources.text(span));
        let select: Vec<String> = edge
            .select
            .iter()
            .map(|(name, ty)| format!("{} : {}", name.text, text(ty.span)))
            .collect();
        let update: Vec<String> = edge.update.iter().map(|expr| text(expr.span)).collect();
        ir::EdgeLabels {
            select: select.join(", "),
            guard: edge
                .guard
                .as_ref()
                .map(|guard| text(guard.span))
                .unwrap_or_default(),
            sync: edge
                .sync
                .as_ref()
                .map(|sync| {
                    format!(
                        "{}{}",
                        text(sync.channel.span),
                        if sync.send { '!' } else { '?' }
                    )
                })
                .unwrap_or_default(),
            update: update.join(", "),
        }
    }
}

/// A text with its blanks collapsed.
pub(super) fn collapse(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The constraints that a condition stands for, if it compares known clocks with a constant.
fn fixed_constraints(expr: &Expr) -> Vec<FixedConstraint> {
    let Kind::ClockCompare {
        relation,
        left,
        right,
        bound,
        negated,
    } = &expr.kind
    else {
        return Vec::new();
    };
    let known = |clock: &Option<Box<Expr>>| match clock {
        None => Some(ClockId(0)),
        Some(clock) => Checker::known_clock(clock),
    };
    let (Some(left), Some(right), Some(bound)) = (known(left), known(right), bound.constant())
    else {
        return Vec::new();
    };
    let constraint = |(swapped, negated, strict)| {
        let (left, right) = if swapped {
            (right, left)
        } else {
            (left, right)
        };
        FixedConstraint {
            left,
            right,
            bound: bound_range((bound, bound), negated).0,
            strict,
        }
    };
    comparisons(*relation, *negated)
        .into_iter()
        .map(constraint)
        .collect()
}

/// The clock and the value of `clock = constant`, if both are known and legal.
fn fixed_reset(expr: &Expr) -> Option<(ClockId, i32)> {
    let Kind::AssignClock {
        target,
        source: None,
        value: Some(value),
    } = &expr.kind
    else {
        return None;
    };
    let value = value.constant().filter(|&value| value >= 0)?;
    Some((Checker::known_clock(target)?, value))
}

/// Whether an expression sets a clock, itself or in a function that it calls.
fn sets_clocks(expr: &Expr) -> bool {
    expr.any(&|e| match &e.kind {
        Kind::AssignClock { .. } => true,
        Kind::Call { signature, .. } => !signature.effects.assignments.is_empty(),
        _ => false,
    })
}

fn fixed_assignment(clock: ClockId, value: i32) -> ClockAssignment {
    ClockAssignment {
        target: ClockRange::one(clock),
        value: AssignedValue::Integer(value, value),
    }
}

/// The clock assignments of code outside functions, where no clock is a parameter.
fn assignments(effects: &Effects) -> Vec<ClockAssignment> {
    let range = |set: ClockSet| match set {
        ClockSet::Range(range) => range,
        ClockSet::Parameter(_) => unreachable!("updates have no clock parameters"),
    };
    let assignment = |effect: &ClockEffect| ClockAssignment {
        target: range(effect.target),
        value: match effect.source {
            None => AssignedValue::Integer(effect.range.0, effect.range.1),
            Some(source) => AssignedValue::Clock(range(source), effect.range.0, effect.range.1),
        },
    };
    effects.assignments.iter().map(assignment).collect()
}

/// The first word of a clock, its relation to a number, and the number, if that is what a condition
/// is about.
fn clock_with_number(condition: &Expr) -> Option<(u32, Relation, &Expr)> {
    let Kind::CompareReal(relation, left, right) = &condition.kind else {
        return None;
    };
    let (clock, relation, bound) = match (&left.kind, &right.kind) {
        (Kind::ClockReading(clock), _) => (clock, *relation, right),
        (_, Kind::ClockReading(clock)) => (clock, relation.swapped(), left),
        _ => return None,
    };
    let offset = state_offset(clock, Memory::Words)?;
    let is_convex = relation != Relation::NotEqual;
    (is_convex && !bound.is_timed()).then_some((offset, relation, bound))
}

//! The walk through queries.

use super::declared::SymbolKind;
use super::resolver::{Resolver, Shape};
use crate::syntax::ast::{
    Control, Estimated, Features, Formula, Interval, Measured, Name, Objective, Optimum, Path,
    Query, QueryKind, RunBound, RunLimit, Shield, Shown, Statistical,
};

impl Resolver<'_> {
    pub(super) fn query(&mut self, query: &Query) {
        self.note(query.span);
        for name in query.under.iter().chain(&query.imitate) {
            self.strategy_use(name);
        }
        self.query_kind(&query.kind);
        if let Some(name) = &query.strategy {
            let detail = format!("strategy {}", name.text);
            self.declare(
                name,
                SymbolKind::Strategy,
                name.span,
                detail,
                Shape::default(),
            );
        }
    }

    fn query_kind(&mut self, kind: &QueryKind) {
        match kind {
            QueryKind::Reachable(state)
            | QueryKind::Invariantly(state)
            | QueryKind::PotentiallyAlways(state)
            | QueryKind::Eventually(state) => self.value(state),
            QueryKind::LeadsTo(first, then) => {
                self.value(first);
                self.value(then);
            }
            QueryKind::Extremum {
                predicate, items, ..
            } => {
                self.values(predicate);
                self.values(items);
            }
            QueryKind::Control(control) => self.control(control),
            QueryKind::SaveStrategy { strategy, .. } => self.strategy_use(strategy),
            QueryKind::LoadStrategy { features, .. } => {
                if let Some(features) = features {
                    self.features(features);
                }
            }
            QueryKind::Optimum(optimum) => self.optimum(optimum),
            QueryKind::Shield(shield) => self.shield(shield),
            QueryKind::Statistical(statistical) => self.statistical(statistical),
            QueryKind::Unsupported(_) => {}
        }
    }

    fn strategy_use(&mut self, name: &Name) {
        self.use_name(&name.text, name.span);
    }

    fn control(&mut self, control: &Control) {
        match &control.objective {
            Objective::Reach(state) | Objective::Safe(state) => self.value(state),
            Objective::Until(first, then)
            | Objective::WeakUntil(first, then)
            | Objective::Buchi(first, then) => {
                self.value(first);
                self.value(then);
            }
        }
        if let Some((bound, guess)) = &control.time_optimal {
            self.values(bound.iter().chain(guess));
        }
        let seen = control.observations.iter().flatten();
        self.values(seen.map(|one| &one.predicate));
    }

    fn features(&mut self, features: &Features) {
        let seen = features.discrete.iter().chain(&features.continuous);
        self.values(seen);
    }

    fn optimum(&mut self, optimum: &Optimum) {
        if let Measured::Expected(Some(value)) = &optimum.measured {
            self.value(value);
        }
        self.bound_of_run(&optimum.bound);
        if let Some(features) = &optimum.features {
            self.features(features);
        }
        self.values(&optimum.goal);
    }

    fn shield(&mut self, shield: &Shield) {
        self.value(&shield.invariant);
        for axis in &shield.axes {
            self.value(&axis.place);
            let bounds = axis.bounds.iter().flat_map(|bounds| bounds.iter());
            self.values(bounds.chain(&axis.cells));
        }
    }

    fn statistical(&mut self, statistical: &Statistical) {
        match statistical {
            Statistical::Probability(estimated) => self.estimated(estimated),
            Statistical::Hypothesis {
                estimated,
                threshold,
                ..
            } => {
                self.estimated(estimated);
                self.value(threshold);
            }
            Statistical::Comparison { left, right, .. } => {
                self.estimated(left);
                self.estimated(right);
            }
            Statistical::Expectation { bound, value, .. } => {
                self.bound_of_run(bound);
                self.value(value);
            }
            Statistical::Simulation {
                bound,
                items,
                filter,
            } => {
                self.bound_of_run(bound);
                for item in items {
                    self.shown(item);
                }
                if let Some((number, state)) = filter {
                    self.values(number);
                    self.value(state);
                }
            }
        }
    }

    fn shown(&mut self, shown: &Shown) {
        match &shown.each {
            Some((name, ty)) => {
                self.within_bound(name, ty, |resolver| resolver.value(&shown.value));
            }
            None => self.value(&shown.value),
        }
    }

    fn estimated(&mut self, estimated: &Estimated) {
        if let Some(name) = &estimated.under {
            self.strategy_use(name);
        }
        if let Some(bound) = &estimated.bound {
            self.bound_of_run(bound);
        }
        match &estimated.path {
            Path::Eventually(state) | Path::Always(state) => self.value(state),
            Path::Until(first, then) => {
                self.value(first);
                self.value(then);
            }
            Path::Formula(formula) => self.formula(formula),
        }
    }

    fn bound_of_run(&mut self, bound: &RunBound) {
        if let RunLimit::Clock(clock) = &bound.limit {
            self.value(clock);
        }
        self.value(&bound.value);
        self.values(&bound.runs);
    }

    fn formula(&mut self, formula: &Formula) {
        match formula {
            Formula::State(state) => self.value(state),
            Formula::Not(inner) | Formula::Next(inner) => self.formula(inner),
            Formula::And(left, right) | Formula::Or(left, right) => {
                self.formula(left);
                self.formula(right);
            }
            Formula::Eventually(interval, inner) | Formula::Always(interval, inner) => {
                self.interval(interval.as_ref());
                self.formula(inner);
            }
            Formula::Until(interval, left, right) | Formula::Release(interval, left, right) => {
                self.interval(interval.as_ref());
                self.formula(left);
                self.formula(right);
            }
            Formula::Quantified(_, name, ty, inner) => {
                self.within_bound(name, ty, |resolver| resolver.formula(inner));
            }
        }
    }

    fn interval(&mut self, interval: Option<&Interval>) {
        self.values(interval.into_iter().flat_map(|one| [&one.from, &one.to]));
    }
}

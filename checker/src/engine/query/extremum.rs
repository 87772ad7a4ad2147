//! Queries for values: `sup`, `inf` and `bounds`.

use std::sync::Arc;

use crate::analysis::Abstraction;
use crate::cancellation;
use crate::ir::{ClockAtom, Measure};
use crate::network::symbolic::predicate;
use crate::network::{Symbolic, Symmetry};
use crate::search::Outcome;
use crate::search::optimum::extremum::{self, Extreme, Extremes, Question};
use crate::search::optimum::value_goal::Taking;
use crate::search::reachability::search;
use crate::verify::replay::Shown;

use super::optimal_trace::{Sought, best_instead};
use super::problem::{Problem, live_variables, symbolic};
use super::witnesses::{Witnesses, found};
use crate::engine::answer::{Answer, Evidence, Values, Verdict};
use crate::engine::evidence::timed_run::{Shows, Takes};
use crate::engine::evidence::witness::{Witness, WitnessKind};
use crate::engine::limits::LimitWatch;

/// The least and greatest values.
pub(super) fn extremum(
    problem: Problem<'_>,
    question: Question<'_>,
    symmetry: Option<&Arc<Symmetry>>,
    watch: &mut LimitWatch,
) -> Answer {
    let options = problem.options;
    let read = predicate::functions(question.predicate).into_iter();
    let read = read.chain(question.items.iter().filter_map(|(item, _)| match *item {
        Measure::Integer(function) => Some(function),
        Measure::Clock(clock) => predicate::chooser(clock),
    }));
    let live = live_variables(problem, read, symmetry);
    let mut zones = |further: &[ClockAtom]| {
        let predicates = [question.predicate];
        symbolic(problem, &predicates, further, Abstraction::LowerUpper)
            .reduced_by(symmetry.cloned())
            .forgetting(live.clone())
    };
    let report = extremum::search(
        question,
        problem.network,
        &mut zones,
        options.manner(),
        watch,
    );
    let mut evidence = Evidence::default();
    let mut values = None;
    let mut verdict = match report.outcome {
        Ok(extremum::Values::Found(items)) => {
            values = Some(Values {
                least: question.least,
                greatest: question.greatest,
                items,
            });
            Verdict::Satisfied
        }
        Ok(extremum::Values::Stopped(reason)) => Verdict::Unknown(reason),
        Err((failure, trace)) => {
            evidence
                .witnesses
                .push(Witness::new(trace, None, WitnessKind::Failure));
            Verdict::Error(failure)
        }
    };
    let mut message = values
        .as_ref()
        .and_then(|values| remark(values, question.items));
    // Zones that are too large have all that is there; a value is sure if a run has it, and so is
    // that there is none.
    if let Some(values) = &values
        && (options.runs || report.is_approximate)
    {
        let mut runs = Runs {
            problem,
            question,
            witnesses: Vec::new(),
            why_not_best: None,
            are_sure: true,
        };
        runs.add_all(values, &mut zones, watch);
        verdict = found(report.is_approximate && !runs.are_sure);
        if options.runs {
            evidence.witnesses = runs.witnesses;
            let remarks: Vec<String> = message.into_iter().chain(runs.why_not_best).collect();
            message = (!remarks.is_empty()).then(|| remarks.join("; "));
        }
    }
    Answer {
        value: values,
        message,
        evidence,
        ..Answer::new(verdict, report.counters)
    }
}

/// Runs to states with the values that were found.
struct Runs<'q> {
    problem: Problem<'q>,
    question: Question<'q>,
    witnesses: Vec<Witness>,
    /// Why some are any ones where the best were wanted.
    why_not_best: Option<String>,
    /// Whether each value is reached, by a run that was replayed.
    are_sure: bool,
}

impl Runs<'_> {
    /// Adds a run to a state with each of the values; none for a clock without limit, and none
    /// beyond a limit of the search.
    fn add_all<'a>(
        &mut self,
        values: &Values,
        zones: &mut dyn FnMut(&[ClockAtom]) -> Symbolic<'a>,
        watch: &mut LimitWatch,
    ) {
        for (index, item) in values.items.iter().enumerate() {
            for (extreme, is_greatest) in [(item.least, false), (item.greatest, true)] {
                match extreme {
                    None => {}
                    Some(Extreme::Infinite) => self.are_sure = false,
                    Some(Extreme::Value { value, is_reached }) => {
                        let taking = Taking {
                            predicate: self.question.predicate,
                            measure: &self.question.items[index].0,
                            value,
                            is_greatest,
                            is_reached,
                        };
                        let verdict = self.add(index, taking, zones(&taking.atoms()), watch);
                        self.are_sure &= is_reached && verdict == Some(Verdict::Satisfied);
                        if verdict.is_none() {
                            return;
                        }
                    }
                }
            }
        }
    }

    /// Adds a run to a state with a value; the verdict on it, or `None` beyond a limit.
    fn add(
        &mut self,
        item: usize,
        mut taking: Taking<'_>,
        mut symbolic: Symbolic<'_>,
        watch: &mut LimitWatch,
    ) -> Option<Verdict> {
        let options = self.problem.options;
        let search = || search::search_shared(&mut symbolic, &mut taking, options.manner(), watch);
        let report = cancellation::unless_cut(search).ok()?;
        let Ok(Outcome::Found(trace)) = report.outcome else {
            return None;
        };
        let atoms = taking.atoms();
        let sought = Sought {
            target: &mut taking,
            predicate: self.question.predicate,
            atoms,
        };
        let mut witnesses = Witnesses::new(&mut symbolic, options);
        let (trace, deadline) = best_instead(trace, &mut witnesses, self.problem, sought, watch);
        let mut words = trace.states.last()?.0.clone();
        let constraints = taking.constraints(witnesses.symbolic, &mut words).ok()??;
        let shows = Shows::Takes(Takes {
            item,
            measure: taking.measure,
            predicate: taking.predicate,
            shown: Shown {
                value: taking.value.into(),
                is_greatest: taking.is_greatest,
                is_reached: taking.is_reached,
            },
            constraints: &constraints,
            deadline,
        });
        let verdict = witnesses.add(trace, None, shows);
        self.why_not_best = witnesses.message.take().or(self.why_not_best.take());
        let which = if taking.is_greatest {
            "greatest"
        } else {
            "least"
        };
        let text = &self.question.items[item].1;
        let found = witnesses.into_witnesses().into_iter();
        self.witnesses.extend(found.map(|witness| Witness {
            title: Some(format!("{which} {text}")),
            ..witness
        }));
        Some(verdict)
    }
}

/// What the numbers alone do not say: that no state counts, or that a value is not reached.
fn remark(values: &Values, items: &[(Measure, String)]) -> Option<String> {
    let mut remarks = Vec::new();
    for (Extremes { least, greatest }, (_, text)) in values.items.iter().zip(items) {
        if least.is_none() && greatest.is_none() {
            return Some("no reachable state satisfies the condition".to_owned());
        }
        for (extreme, relation) in [(least, '>'), (greatest, '<')] {
            if let Some(Extreme::Value {
                value,
                is_reached: false,
            }) = extreme
            {
                remarks.push(format!(
                    "{text} {relation} {value}: the value itself is not reached"
                ));
            }
        }
    }
    (!remarks.is_empty()).then(|| remarks.join("; "))
}

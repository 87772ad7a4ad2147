//! Queries for values: `sup`, `inf` and `bounds`.

use std::sync::Arc;

use crate::ir::{ClockAtom, Measure};
use crate::network::{Abstraction, Symbolic, Symmetry};
use crate::search::extremum::{self, Extreme, Extremes, Question};
use crate::search::reach::{self, Outcome};
use crate::search::taking::Taking;
use crate::verify::replay::Shown;

use super::Options;
use super::answer::{
    Answer, Evidence, Subject, Values, Verdict, Witnesses, found, new_answer, symbolic,
};
use super::best::{Sought, best, not_the_best};
use super::evidence::{Kind, Shows, Takes, Witness};
use super::limits::LimitWatch;

/// The least and greatest values.
pub(super) fn extremum(
    subject: Subject<'_>,
    question: Question<'_>,
    options: &Options,
    symmetry: Option<&Arc<Symmetry>>,
    watch: &mut LimitWatch,
) -> Answer {
    let mut zones = |further: &[ClockAtom]| {
        let predicates = [question.predicate];
        symbolic(subject, &predicates, further, Abstraction::LowerUpper)
            .reduced_by(symmetry.cloned())
    };
    let report = extremum::search(
        question,
        subject.network,
        &mut zones,
        options.manner(),
        watch,
    );
    let mut evidence = Evidence::default();
    let mut values = None;
    let verdict = match report.outcome {
        Ok(extremum::Outcome::Found(items)) => {
            values = Some(Values {
                least: question.least,
                greatest: question.greatest,
                items,
            });
            found(report.is_approximate)
        }
        Ok(extremum::Outcome::Stopped(reason)) => Verdict::Unknown(reason),
        Err((failure, trace)) => {
            evidence
                .witnesses
                .push(Witness::new(trace, None, Kind::Failure));
            Verdict::Error(failure)
        }
    };
    let mut message = values
        .as_ref()
        .and_then(|values| remark(values, question.items));
    if let Some(values) = &values
        && options.runs
        && verdict == Verdict::Satisfied
    {
        let (witnesses, why_not_best) =
            value_witnesses(subject, question, values, &mut zones, options, watch);
        evidence.witnesses = witnesses;
        let remarks: Vec<String> = message.into_iter().chain(why_not_best).collect();
        message = (!remarks.is_empty()).then(|| remarks.join("; "));
    }
    let mut answer = new_answer(verdict, evidence, report.counters);
    answer.message = message;
    answer.value = values;
    answer
}

/// A run to a state with each of the values, and why some are any ones where the best were wanted; none for a clock without limit, and
/// none beyond a limit of the search.
fn value_witnesses<'a>(
    subject: Subject<'_>,
    question: Question<'_>,
    values: &Values,
    zones: &mut dyn FnMut(&[ClockAtom]) -> Symbolic<'a>,
    options: &Options,
    watch: &mut LimitWatch,
) -> (Vec<Witness>, Option<String>) {
    let mut found = Vec::new();
    let mut why_not_best = None;
    for (index, ((measure, text), item)) in question.items.iter().zip(&values.items).enumerate() {
        for (extreme, is_greatest) in [(item.least, false), (item.greatest, true)] {
            let Some(Extreme::Value { value, is_reached }) = extreme else {
                continue;
            };
            let mut taking = Taking {
                predicate: question.predicate,
                measure,
                value,
                is_greatest,
                is_reached,
            };
            let mut symbolic = zones(&taking.atoms());
            let report = reach::search_shared(&mut symbolic, &mut taking, options.manner(), watch);
            let Ok(Outcome::Found(trace)) = report.outcome else {
                return (found, why_not_best);
            };
            let atoms = taking.atoms();
            let sought = Sought {
                target: &mut taking,
                predicate: question.predicate,
                atoms,
            };
            let (trace, deadline) = match best(subject, &mut symbolic, sought, options, watch) {
                Ok(None) => (trace, None),
                Ok(Some((best, deadline))) => (best, deadline),
                Err(reason) => {
                    why_not_best = Some(not_the_best(&reason));
                    (trace, None)
                }
            };
            let last = trace.states.last().map(|(words, _)| words.clone());
            let mut words = last.unwrap_or_default();
            let Ok(Some(constraints)) = taking.constraints(&mut symbolic, &mut words) else {
                return (found, why_not_best);
            };
            let shown = Shown {
                value: value.into(),
                is_greatest,
                is_reached,
            };
            let shows = Shows::Takes(Takes {
                item: index,
                measure,
                predicate: question.predicate,
                shown,
                constraints: &constraints,
                deadline,
            });
            let mut witnesses = Witnesses::new(&mut symbolic, options);
            witnesses.add(trace, None, shows);
            let which = if is_greatest { "greatest" } else { "least" };
            found.extend(
                witnesses
                    .into_evidence()
                    .witnesses
                    .into_iter()
                    .map(|witness| Witness {
                        title: Some(format!("{which} {text}")),
                        ..witness
                    }),
            );
        }
    }
    (found, why_not_best)
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

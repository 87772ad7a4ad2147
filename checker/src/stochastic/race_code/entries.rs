//! Of several instances one is chosen by its entry, where legs of branch points are edges, and a
//! leg of it by weight. Repeats `by_entry` of `race/transition.rs`.

use std::collections::BTreeMap;

use super::race_writer::RaceWriter;
use super::writer::Writer;
use crate::ir::{BlockId, Distribution, Register, Relation};
use crate::stochastic::condition::Number;
use crate::stochastic::program::Instance;
use crate::stochastic::rules::{self, Backend};

/// An instance that may be enabled.
pub(super) struct Candidate<'i, 'a> {
    pub(super) instance: &'i Instance<'a>,
    /// What stands for it.
    pub(super) number: i32,
    /// Whether it is enabled.
    pub(super) flag: Register,
}

impl<'a> RaceWriter<'_, 'a> {
    /// The number of one of the instances that are enabled; goes elsewhere if there are none.
    pub(super) fn by_entry(
        &self,
        w: &mut Writer<'_>,
        candidates: &[Candidate<'_, 'a>],
        otherwise: BlockId,
    ) -> Register {
        let mut entries: BTreeMap<u32, Vec<&Candidate<'_, 'a>>> = BTreeMap::new();
        for one in candidates {
            entries.entry(one.instance.entry).or_default().push(one);
        }
        let (count, one) = (w.integer(0), w.integer(1));
        let mut flags = Vec::new();
        for legs in entries.values() {
            let flag = w.integer(0);
            for leg in legs {
                w.when(leg.flag, |w| w.copy(flag, one));
            }
            let more = w.add_integers(count, flag);
            w.copy(count, more);
            flags.push(Some(flag));
        }
        w.unless(count, otherwise);
        let (rest, entry) = (w.integer(0), w.integer(0));
        let are_many = w.compare_to(count, Relation::Greater, 1);
        w.when(are_many, |w| {
            let drawn = w.draw_below(count);
            w.copy(rest, drawn);
        });
        let numbers: Vec<Register> = (0..).take(flags.len()).map(|one| w.integer(one)).collect();
        take_one_of(w, numbers.into_iter().zip(flags), rest, entry);
        let (chosen, done) = (w.integer(0), w.block());
        let places: Vec<(i32, BlockId)> = (0..)
            .zip(entries.keys())
            .map(|(place, _)| (place, w.block()))
            .collect();
        w.select(entry, &places);
        for (legs, &(_, block)) in entries.values().zip(&places) {
            w.at(block);
            self.leg(w, legs, chosen);
            w.jump(done);
        }
        w.at(done);
        chosen
    }

    /// Sets `chosen` to the number of one of the legs that are enabled.
    fn leg(&self, w: &mut Writer<'_>, legs: &[&Candidate<'_, 'a>], chosen: Register) {
        if let [only] = legs
            && only.instance.edge.leg.is_none()
        {
            let number = w.integer(only.number);
            w.copy(chosen, number);
            return;
        }
        let wrong = w.block();
        let mut weights = Vec::new();
        for leg in legs {
            let weight = w.real(0.0);
            w.when(leg.flag, |w| {
                let given = self.weight(w, leg.instance, 0, wrong);
                w.copy(weight, given);
            });
            weights.push(weight);
        }
        let place = Self::weighted(w, &weights, wrong);
        for (number, leg) in (0..).zip(legs) {
            let is_it = w.compare_to(place, Relation::Equal, number);
            w.when(is_it, |w| {
                let number = w.integer(leg.number);
                w.copy(chosen, number);
            });
        }
    }

    /// The weight of a branch; goes elsewhere if it is none.
    pub(super) fn weight(
        &self,
        w: &mut Writer<'_>,
        mover: &Instance<'_>,
        branch: usize,
        wrong: BlockId,
    ) -> Register {
        let number = self.program.weight(mover, branch);
        let Ok(weight) = rules::number(w, number, &mover.values);
        if !matches!(number, Number::Known(one) if one >= 0.0 && one.is_finite()) {
            let (zero, infinity) = (w.real(0.0), w.real(f64::INFINITY));
            let is_weight = w.compare_reals(weight, Relation::GreaterEqual, zero);
            w.unless(is_weight, wrong);
            let is_finite = w.compare_reals(weight, Relation::Less, infinity);
            w.unless(is_finite, wrong);
        }
        weight
    }

    /// The place of one of some weights, as likely as it says. Where all are 0, and `wrong`, the
    /// run is given up.
    pub(super) fn weighted(w: &mut Writer<'_>, weights: &[Register], wrong: BlockId) -> Register {
        let (chosen, zero) = (w.integer(0), w.real(0.0));
        let mut total = w.real(0.0);
        for &weight in weights {
            total = w.add(total, weight);
        }
        let rest = w.draw(Distribution::Uniform, total);
        let (none, found) = (w.integer(-1), w.block());
        w.copy(chosen, none);
        for (place, &weight) in (0..).zip(weights) {
            let next = w.block();
            let is_possible = w.compare_reals(weight, Relation::Greater, zero);
            w.unless(is_possible, next);
            let this = w.integer(place);
            w.copy(chosen, this);
            let is_beyond = w.compare_reals(rest, Relation::GreaterEqual, weight);
            w.unless(is_beyond, found);
            let less = w.subtract(rest, weight);
            w.copy(rest, less);
            w.jump(next);
            w.at(next);
        }
        let is_none = w.compare(chosen, Relation::Equal, none);
        w.branch(is_none, wrong, found);
        w.at(wrong);
        w.give_up();
        w.at(found);
        chosen
    }
}

/// Sets `chosen` to one of some numbers: so many of those whose flag is set are passed over as
/// `rest` says, which counts down. A number without a flag counts always.
pub(super) fn take_one_of(
    w: &mut Writer<'_>,
    numbers: impl Iterator<Item = (Register, Option<Register>)>,
    rest: Register,
    chosen: Register,
) {
    let (found, minus_one) = (w.block(), w.integer(-1));
    for (number, flag) in numbers {
        let next = w.block();
        if let Some(flag) = flag {
            w.unless(flag, next);
        }
        w.copy(chosen, number);
        let goes_on = w.block();
        w.branch(rest, goes_on, found);
        w.at(goes_on);
        let less = w.add_integers(rest, minus_one);
        w.copy(rest, less);
        w.jump(next);
        w.at(next);
    }
    w.jump(found);
    w.at(found);
}

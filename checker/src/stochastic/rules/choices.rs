//! Which of several instances moves, and which of its branches it takes.
//!
//! All entries that are enabled are as likely as each other. Where legs of branch points are edges,
//! several instances have one entry, and one of its legs is taken by weight.

use std::cell::Cell;
use std::collections::BTreeMap;

use super::{Backend, Flow, number};
use crate::ir::Relation;
use crate::stochastic::condition::Number;
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Instance, Program};

/// An instance that may be enabled.
#[derive(Clone, Copy)]
pub(in crate::stochastic) struct Candidate<'i, 'a, I> {
    pub(in crate::stochastic) instance: &'i Instance<'a>,
    /// What stands for it.
    pub(in crate::stochastic) number: I,
    /// Whether it is enabled; none if that is known.
    pub(in crate::stochastic) flag: Option<I>,
}

/// The number of one of the instances that are enabled; leaves if there are none.
pub(in crate::stochastic) fn one_of<'i, 'a: 'i, B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    candidates: impl Iterator<Item = Candidate<'i, 'a, B::Integer>> + Clone,
    otherwise: B::Exit,
) -> Flow<B, B::Integer> {
    if candidates
        .clone()
        .all(|one| one.instance.edge.leg.is_none())
    {
        return draw(b, candidates.map(|one| (one.number, one.flag)), otherwise);
    }
    let mut entries: BTreeMap<u32, Vec<Candidate<'_, '_, B::Integer>>> = BTreeMap::new();
    for one in candidates {
        entries.entry(one.instance.entry).or_default().push(one);
    }
    let mut flags = Vec::new();
    for legs in entries.values() {
        let (flag, one) = (b.variable(0), b.integer(1));
        for leg in legs {
            b.when(leg.flag.unwrap_or(one), |b| {
                b.set(&flag, one);
                Ok(())
            })?;
        }
        flags.push(Some(flag.get()));
    }
    let numbers: Vec<_> = (0..).map(|place| b.integer(place)).zip(flags).collect();
    let entry = draw(b, numbers.iter().copied(), otherwise)?;
    let legs: Vec<_> = entries.into_values().collect();
    let chosen = b.variable(0);
    b.cases(entry, legs.len(), |b, place| {
        let number = leg(b, program, &legs[place])?;
        b.set(&chosen, number);
        Ok(())
    })?;
    Ok(chosen.get())
}

/// One of some numbers whose flags are set, all with the same chance; leaves if there are none. A
/// number without a flag counts always.
pub(in crate::stochastic) fn draw<B: Backend>(
    b: &mut B,
    numbers: impl Iterator<Item = (B::Integer, Option<B::Integer>)> + Clone,
    otherwise: B::Exit,
) -> Flow<B, B::Integer> {
    let sure = numbers.clone().filter(|one| one.1.is_none()).count();
    let mut count = b.integer(sure as i32);
    for flag in numbers.clone().filter_map(|one| one.1) {
        count = b.sum(count, flag);
    }
    if sure == 0 {
        b.unless(count, otherwise)?;
    }
    let rest = b.variable(0);
    let are_many = b.compare_to(count, Relation::Greater, 1);
    b.when(are_many, |b| {
        let drawn = b.draw_below(count);
        b.set(&rest, drawn);
        Ok(())
    })?;
    let chosen = b.variable(0);
    b.attempt(|b, found| {
        for (number, flag) in numbers {
            let take = |b: &mut B| {
                b.set(&chosen, number);
                b.unless(rest.get(), found)?;
                let less = b.plus(rest.get(), -1);
                b.set(&rest, less);
                Ok(())
            };
            match flag {
                None => take(b)?,
                Some(flag) => b.when(flag, take)?,
            }
        }
        Ok(())
    })?;
    Ok(chosen.get())
}

/// Does something for one of all that compete, each of them in turn with the same chance so far:
/// the last for which it is done has won.
pub(in crate::stochastic) fn compete<B: Backend>(
    b: &mut B,
    competitors: &Cell<B::Integer>,
    win: impl FnOnce(&mut B) -> Flow<B>,
) -> Flow<B> {
    let count = b.plus(competitors.get(), 1);
    b.set(competitors, count);
    let wins = b.variable(1);
    let are_many = b.compare_to(count, Relation::Greater, 1);
    b.when(are_many, |b| {
        let drawn = b.draw_below(count);
        let is_it = b.compare_to(drawn, Relation::Equal, 0);
        b.set(&wins, is_it);
        Ok(())
    })?;
    b.when(wins.get(), win)
}

/// The number of one of the legs of an entry that are enabled.
fn leg<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    legs: &[Candidate<'_, '_, B::Integer>],
) -> Flow<B, B::Integer> {
    if let [only] = legs
        && only.instance.edge.leg.is_none()
    {
        return Ok(only.number);
    }
    let mut weights = Vec::with_capacity(legs.len());
    for leg in legs {
        let flagged = b.real_variable(0.0);
        let one = b.integer(1);
        b.when(leg.flag.unwrap_or(one), |b| {
            let given = weight(b, program, leg.instance, 0)?;
            b.set_real(&flagged, given);
            Ok(())
        })?;
        weights.push(flagged.get());
    }
    let place = by_weight(b, legs[0].instance, &weights)?;
    let chosen = b.variable(0);
    b.cases(place, legs.len(), |b, place| {
        b.set(&chosen, legs[place].number);
        Ok(())
    })?;
    Ok(chosen.get())
}

/// The branch that a mover takes: by weight.
pub(in crate::stochastic) fn branch<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    mover: &Instance<'_>,
) -> Flow<B, B::Integer> {
    let branches = mover.edge.branches.len();
    if branches < 2 {
        return Ok(b.integer(0));
    }
    let mut weights = Vec::with_capacity(branches);
    for branch in 0..branches {
        weights.push(weight(b, program, mover, branch)?);
    }
    by_weight(b, mover, &weights)
}

/// The weight of a branch.
fn weight<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    mover: &Instance<'_>,
    branch: usize,
) -> Flow<B, B::Real> {
    let known = program.weight(mover, branch);
    let weight = number(b, known, &mover.values)?;
    if matches!(known, Number::Known(one) if one >= 0.0 && one.is_finite()) {
        return Ok(weight);
    }
    let stand = b.stand(mover.process as usize);
    b.insist_on_range(weight, |_| Failure::Weight(stand, mover.id))?;
    Ok(weight)
}

/// The place of one of some weights of an edge, as likely as it says. Where all are 0, the run has
/// no result.
fn by_weight<B: Backend>(
    b: &mut B,
    mover: &Instance<'_>,
    weights: &[B::Real],
) -> Flow<B, B::Integer> {
    let (chosen, mut total) = (b.variable(-1), b.real(0.0));
    for &weight in weights {
        total = b.add(total, weight);
    }
    let rest = Cell::new(b.draw_uniform(total));
    b.attempt(|b, found| {
        for (place, &weight) in (0..).zip(weights) {
            let is_possible = b.compare_real_to(weight, Relation::Greater, 0.0);
            b.when(is_possible, |b| {
                // The last one takes what rounding leaves.
                let place = b.integer(place);
                b.set(&chosen, place);
                let is_beyond = b.compare_reals(rest.get(), Relation::GreaterEqual, weight);
                b.unless(is_beyond, found)?;
                let less = b.subtract(rest.get(), weight);
                b.set_real(&rest, less);
                Ok(())
            })?;
        }
        Ok(())
    })?;
    let stand = b.stand(mover.process as usize);
    let is_some = b.compare_to(chosen.get(), Relation::GreaterEqual, 0);
    b.insist(is_some, |_| Failure::NoWeight(stand, mover.id))?;
    Ok(chosen.get())
}

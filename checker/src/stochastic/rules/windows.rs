//! The delay of a process that is drawn in several windows.

use std::cell::Cell;

use super::{Backend, Flow};
use crate::ir::Relation;

/// A delay in the windows of a plan, of which there are some: by an exponential distribution with a
/// rate, or uniformly if `is_uniform` is not 0. Infinite if it lies behind all of them.
pub(in crate::stochastic) fn delay_in_windows<B: Backend>(
    b: &mut B,
    is_uniform: B::Integer,
    rate: B::Real,
) -> Flow<B, B::Real> {
    sort(b)?;
    join(b)?;
    let length = length(b)?;
    let (delay, passed) = (b.real_variable(0.0), b.real_variable(0.0));
    let has_length = b.compare_real_to(length, Relation::Greater, 0.0);
    b.choose(
        has_length,
        |b| {
            b.choose(
                is_uniform,
                |b| {
                    let drawn = b.draw_uniform(length);
                    b.set_real(&passed, drawn);
                    Ok(())
                },
                |b| {
                    let drawn = b.draw_exponential(rate);
                    b.set_real(&passed, drawn);
                    Ok(())
                },
            )?;
            pass(b, &passed, &delay)
        },
        |b| {
            // All are moments.
            let chosen = b.variable(0);
            b.when(is_uniform, |b| {
                let count = b.window_count();
                let are_many = b.compare_to(count, Relation::Greater, 1);
                b.when(are_many, |b| {
                    let drawn = b.draw_below(count);
                    b.set(&chosen, drawn);
                    Ok(())
                })
            })?;
            let (moment, _) = b.window(chosen.get());
            b.set_real(&delay, moment);
            Ok(())
        },
    )?;
    Ok(delay.get())
}

/// Sorts windows by their low ends.
fn sort<B: Backend>(b: &mut B) -> Flow<B> {
    let (number, count) = (b.variable(1), b.window_count());
    b.repeat(
        |b| b.compare(number.get(), Relation::Less, count),
        |b| {
            let (low, high) = b.window(number.get());
            let free = b.variable(0);
            b.set(&free, number.get());
            b.attempt(|b, out| {
                b.repeat(
                    |b| b.compare_to(free.get(), Relation::Greater, 0),
                    |b| {
                        let before = b.plus(free.get(), -1);
                        let (its_low, its_high) = b.window(before);
                        let is_after = b.compare_reals(its_low, Relation::Greater, low);
                        b.unless(is_after, out)?;
                        b.set_window(free.get(), its_low, its_high);
                        b.set(&free, before);
                        Ok(())
                    },
                )
            })?;
            b.set_window(free.get(), low, high);
            count_up(b, &number);
            Ok(())
        },
    )
}

/// Joins windows that touch.
fn join<B: Backend>(b: &mut B) -> Flow<B> {
    let (last, number) = (b.variable(0), b.variable(1));
    let count = b.window_count();
    b.repeat(
        |b| b.compare(number.get(), Relation::Less, count),
        |b| {
            let (low, high) = b.window(number.get());
            let (last_low, last_high) = b.window(last.get());
            let touches = b.compare_reals(low, Relation::LessEqual, last_high);
            b.choose(
                touches,
                |b| {
                    let end = b.greatest(high, last_high);
                    b.set_window(last.get(), last_low, end);
                    Ok(())
                },
                |b| {
                    count_up(b, &last);
                    b.set_window(last.get(), low, high);
                    Ok(())
                },
            )?;
            count_up(b, &number);
            Ok(())
        },
    )?;
    let count = b.plus(last.get(), 1);
    b.set_window_count(count);
    Ok(())
}

/// How long all windows are together.
fn length<B: Backend>(b: &mut B) -> Flow<B, B::Real> {
    let (length, number) = (b.real_variable(0.0), b.variable(0));
    let count = b.window_count();
    b.repeat(
        |b| b.compare(number.get(), Relation::Less, count),
        |b| {
            let (low, high) = b.window(number.get());
            let part = b.subtract(high, low);
            let sum = b.add(length.get(), part);
            b.set_real(&length, sum);
            count_up(b, &number);
            Ok(())
        },
    )?;
    Ok(length.get())
}

/// Sets the delay to the time at which this much of the windows has passed.
fn pass<B: Backend>(b: &mut B, passed: &Cell<B::Real>, delay: &Cell<B::Real>) -> Flow<B> {
    let (number, count) = (b.variable(0), b.window_count());
    let infinity = b.real(f64::INFINITY);
    b.set_real(delay, infinity);
    b.attempt(|b, inside| {
        b.repeat(
            |b| b.compare(number.get(), Relation::Less, count),
            |b| {
                let (low, high) = b.window(number.get());
                let part = b.subtract(high, low);
                let is_beyond = b.compare_reals(passed.get(), Relation::Greater, part);
                b.choose(
                    is_beyond,
                    |b| {
                        let rest = b.subtract(passed.get(), part);
                        b.set_real(passed, rest);
                        count_up(b, &number);
                        Ok(())
                    },
                    |b| {
                        let moment = b.add(low, passed.get());
                        b.set_real(delay, moment);
                        b.leave(inside)
                    },
                )
            },
        )
    })
}

fn count_up<B: Backend>(b: &mut B, number: &Cell<B::Integer>) {
    let next = b.plus(number.get(), 1);
    b.set(number, next);
}

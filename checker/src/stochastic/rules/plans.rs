//! What processes plan: how long they may stay, and when they try to move.

use std::cell::Cell;

use super::conditions::{Span, require, span};
use super::{Backend, Flow, Held, number};
use crate::ir::{Relation, Urgency};
use crate::stochastic::condition::{Condition, Number};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Instance, Program, Spot};

/// How long a process may stay where it is.
#[derive(Clone, Copy)]
struct Bound<R> {
    end: R,
    /// Whether it is known to be finite.
    is_finite: bool,
}

impl<R: Copy> Bound<R> {
    /// Whether the process may not stay for ever.
    fn has_end<B: Backend<Real = R>>(self, b: &mut B) -> B::Integer {
        b.compare_real_to(self.end, Relation::Less, f64::INFINITY)
    }
}

/// Lets a process plan in a location.
pub(in crate::stochastic) fn plan<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    process: usize,
    spot: &Spot,
) -> Flow<B> {
    let bound = bound(b, program, process, spot)?;
    if spot.urgency != Urgency::Normal {
        let now = b.real(0.0);
        return b.within(
            |b, never| {
                require_some_output(b, program, spot, never)?;
                b.set_plan(process, Some(now), Some(now), false);
                Ok(())
            },
            |b| {
                b.set_plan(process, None, Some(now), true);
                Ok(())
            },
        );
    }
    let stay = bound.map(|bound| bound.end);
    if !b.knows_outputs(program, spot) {
        let attempt = b.other_attempt(program, process, spot, stay)?;
        b.set_plan(process, Some(attempt), stay, true);
        return Ok(());
    }
    let planning = Planning {
        program,
        process,
        spot,
        bound,
    };
    if b.knows_decisions(spot) {
        return planning.for_decisions(b);
    }
    b.within(
        |b, never| {
            if spot.is_plain {
                require_some_output(b, program, spot, never)?;
                planning.in_window(b, Span::ALL, never)
            } else {
                planning.in_windows(b, never)
            }
        },
        |b| {
            b.set_plan(process, None, stay, true);
            Ok(())
        },
    )
}

/// How long a process may stay by its invariant; `None` if for ever.
pub(in crate::stochastic) fn stay<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    process: usize,
    spot: &Spot,
) -> Flow<B, Option<B::Real>> {
    Ok(bound(b, program, process, spot)?.map(|bound| bound.end))
}

fn bound<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    process: usize,
    spot: &Spot,
) -> Flow<B, Option<Bound<B::Real>>> {
    if !b.knows_stay(program, spot) {
        let (end, is_finite) = (b.other_stay(program, process, spot)?, false);
        return Ok(Some(Bound { end, is_finite }));
    }
    let (low, high) = (Cell::new(None), Cell::new(None));
    let stand = b.stand(process);
    b.within(
        |b, broken| {
            let span = span(b, program, spot.invariant, &[], broken)?;
            if let Some(low) = span.low {
                let holds_now = b.compare_real_to(low, Relation::LessEqual, 0.0);
                b.unless(holds_now, broken)?;
            }
            low.set(span.low);
            high.set(span.high);
            Ok(())
        },
        |b| b.fail(|_| Failure::InvariantBroken(stand)),
    )?;
    let (Some(end), Condition::Compared(place)) = (high.get(), spot.invariant) else {
        return Ok(None);
    };
    let bounds = &program.comparisons(place).bounds;
    // A clock with another rate may stand still.
    let mut plain = bounds.iter().filter(|(clock, _, _)| !b.is_rated(*clock));
    let is_finite = plain.any(|(_, relation, number)| {
        let is_upper = matches!(
            relation,
            Relation::Less | Relation::LessEqual | Relation::Equal
        );
        is_upper && matches!(number, Number::Known(number) if number.is_finite())
    });
    Ok(Some(Bound { end, is_finite }))
}

/// Ends the run unless the invariant of a process holds.
pub(in crate::stochastic) fn require_invariant<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    process: usize,
    spot: &Spot,
) -> Flow<B> {
    let stand = b.stand(process);
    b.within(
        |b, broken| require(b, program, spot.invariant, &[], broken),
        |b| b.fail(|_| Failure::InvariantBroken(stand)),
    )
}

/// Goes on if an output of a process is enabled, else leaves.
fn require_some_output<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    spot: &Spot,
    never: B::Exit,
) -> Flow<B> {
    if !b.knows_outputs(program, spot) {
        let is_able = b.other_ability(program, spot)?;
        return b.unless(is_able, never);
    }
    let outputs = program.range(spot.outputs);
    let is_certain = outputs.iter().any(|one| one.guard == Condition::Always);
    if let [only] = outputs {
        return require(b, program, only.guard, &only.values, never);
    }
    let is_some = is_any_enabled(b, program, outputs)?;
    if is_certain {
        return Ok(());
    }
    b.unless(is_some, never)
}

/// Whether one of some instances is enabled. All guards are computed, for each may fail.
pub(in crate::stochastic) fn is_any_enabled<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    instances: &[Instance<'_>],
) -> Flow<B, B::Integer> {
    let some = b.variable(0);
    for one in instances {
        b.attempt(|b, next| {
            require(b, program, one.guard, &one.values, next)?;
            let yes = b.integer(1);
            b.set(&some, yes);
            Ok(())
        })?;
    }
    Ok(some.get())
}

/// A process that plans in a location where time may pass.
struct Planning<'p, 'a, R> {
    program: &'p Program<'a>,
    process: usize,
    spot: &'p Spot,
    bound: Option<Bound<R>>,
}

impl<R: Copy> Planning<'_, '_, R> {
    /// Ends a plan: the process tries to move at a moment that it may stay until.
    fn end_in_time<B: Backend<Real = R>>(&self, b: &mut B, moment: R) {
        let stay = self.bound.map(|bound| bound.end);
        b.set_plan(self.process, Some(moment), stay, false);
    }

    /// Goes on if a moment comes while the process may stay, but for rounding, else leaves.
    fn require_in_time<B: Backend<Real = R>>(
        &self,
        b: &mut B,
        moment: R,
        otherwise: B::Exit,
    ) -> Flow<B> {
        let Some(Bound { end, .. }) = self.bound else {
            return Ok(());
        };
        let latest = tolerant(b, end);
        let is_in_time = b.compare_reals(moment, Relation::LessEqual, latest);
        b.unless(is_in_time, otherwise)
    }

    /// The end of a window, cut where the process may stay no longer.
    fn cut<B: Backend<Real = R>>(&self, b: &mut B, window: Span<R>) -> Option<R> {
        let mut high = window.high;
        if let Some(Bound { end, .. }) = self.bound {
            high = Some(high.map_or(end, |high| b.least(high, end)));
        }
        match (high, window.low) {
            (Some(high), Some(low)) => Some(b.greatest(high, low)),
            (high, _) => high,
        }
    }

    /// Draws the delay in one window, and ends the plan.
    fn in_window<B: Backend<Real = R>>(
        &self,
        b: &mut B,
        window: Span<R>,
        never: B::Exit,
    ) -> Flow<B> {
        if let Some(low) = window.low {
            self.require_in_time(b, low, never)?;
        }
        let end = self.cut(b, window);
        let length = end.map(|end| match window.low {
            None => end,
            Some(low) => b.subtract(end, low),
        });
        if let (Some(bound), Some(length)) = (self.bound, length) {
            if bound.is_finite {
                return self.uniformly(b, window, length);
            }
            let is_bounded = bound.has_end(b);
            return b.choose(
                is_bounded,
                |b| self.uniformly(b, window, length),
                |b| self.by_rate(b, window, Some(length), never),
            );
        }
        self.by_rate(b, window, length, never)
    }

    fn uniformly<B: Backend<Real = R>>(&self, b: &mut B, window: Span<R>, length: R) -> Flow<B> {
        if self.spot.is_plain {
            // A moment of no length is drawn as any other.
            let moment = b.draw_uniform(length);
            self.end_in_time(b, moment);
            return Ok(());
        }
        let moment = window.begin(b);
        let has_length = b.compare_real_to(length, Relation::Greater, 0.0);
        b.when(has_length, |b| {
            let passed = b.draw_uniform(length);
            let at = window.after(b, passed);
            b.set_real(&moment, at);
            Ok(())
        })?;
        self.end_in_time(b, moment.get());
        Ok(())
    }

    fn by_rate<B: Backend<Real = R>>(
        &self,
        b: &mut B,
        window: Span<R>,
        length: Option<R>,
        never: B::Exit,
    ) -> Flow<B> {
        let rate = exponential_rate(b, self.process, self.spot, never)?;
        let Some(length) = length.filter(|_| !self.spot.is_plain) else {
            let passed = b.draw_exponential(rate);
            let moment = window.after(b, passed);
            self.end_in_time(b, moment);
            return Ok(());
        };
        let has_length = b.compare_real_to(length, Relation::NotEqual, 0.0);
        let moment = window.begin(b);
        b.when(has_length, |b| {
            let passed = b.draw_exponential(rate);
            let is_inside = b.compare_reals(passed, Relation::LessEqual, length);
            b.unless(is_inside, never)?;
            let at = window.after(b, passed);
            b.set_real(&moment, at);
            Ok(())
        })?;
        self.end_in_time(b, moment.get());
        Ok(())
    }

    /// Draws the delay in the windows of the outputs, and ends the plan.
    fn in_windows<B: Backend<Real = R>>(&self, b: &mut B, never: B::Exit) -> Flow<B> {
        let outputs = self.program.range(self.spot.outputs);
        if let [only] = outputs
            && !only.may_be_urgent
        {
            let window = span(b, self.program, only.guard, &only.values, never)?;
            return self.in_window(b, window, never);
        }
        let moment = b.real_variable(f64::INFINITY);
        let is_drawn = outputs.iter().any(|output| !output.may_be_urgent);
        if is_drawn {
            let none = b.integer(0);
            b.set_window_count(none);
        }
        for output in outputs {
            b.attempt(|b, next| self.add_window(b, output, &moment, next))?;
        }
        if is_drawn {
            let windows = b.window_count();
            b.when(windows, |b| self.draw_in_windows(b, &moment))?;
        }
        let comes = b.compare_real_to(moment.get(), Relation::Less, f64::INFINITY);
        b.unless(comes, never)?;
        let Some(bound) = self.bound else {
            self.end_in_time(b, moment.get());
            return Ok(());
        };
        let is_in_time = b.compare_reals(moment.get(), Relation::LessEqual, bound.end);
        b.choose(
            is_in_time,
            |b| {
                self.end_in_time(b, moment.get());
                Ok(())
            },
            |b| {
                b.set_plan(self.process, Some(moment.get()), Some(bound.end), true);
                Ok(())
            },
        )
    }

    /// Lets the process try to move when the controller is asked, or when the delay is over that is
    /// drawn for outputs about which nobody decides.
    fn for_decisions<B: Backend<Real = R>>(&self, b: &mut B) -> Flow<B> {
        let moment = b.real_variable(f64::INFINITY);
        let question = b.real_variable(f64::INFINITY);
        let none = b.integer(0);
        b.set_window_count(none);
        for output in self.program.range(self.spot.outputs) {
            b.attempt(|b, next| {
                if output.edge.controllable {
                    self.ask_in_window(b, output, &question, next)
                } else {
                    self.add_window(b, output, &moment, next)
                }
            })?;
        }
        let windows = b.window_count();
        b.when(windows, |b| self.draw_in_windows(b, &moment))?;
        let stay = self.bound.map(|bound| bound.end);
        let attempt = b.least(moment.get(), question.get());
        let is_question = b.compare_reals(question.get(), Relation::LessEqual, attempt);
        b.set_question(self.process, is_question);
        b.set_plan(self.process, Some(attempt), stay, true);
        Ok(())
    }

    /// Lets the moment come not later than the controller is asked about an output: as soon as it
    /// is enabled, when the controller has waited as long as it wants, or when a delay is over that
    /// is drawn for it.
    fn ask_in_window<B: Backend<Real = R>>(
        &self,
        b: &mut B,
        output: &Instance<'_>,
        moment: &Cell<R>,
        next: B::Exit,
    ) -> Flow<B> {
        let (window, low) = self.window_in_time(b, output, next)?;
        let Held { time, draws } = b.held();
        let ask = |b: &mut B, at: R| {
            come_not_later(b, moment, at);
            Ok(())
        };
        let ask_at_end = |b: &mut B| {
            let asked = match self.bound {
                Some(bound) => b.least(time, bound.end),
                None => time,
            };
            ask(b, asked)
        };
        b.choose(
            draws,
            |b| {
                let is_over = b.compare_real_to(time, Relation::Equal, 0.0);
                if output.may_be_urgent {
                    return ask_at_end(b);
                }
                let push = |b: &mut B| {
                    self.push_window(b, window, low);
                    Ok(())
                };
                b.choose(is_over, push, ask_at_end)
            },
            |b| {
                let is_later = b.compare_real_to(low, Relation::Greater, 0.0);
                b.choose(is_later, |b| ask(b, low), ask_at_end)
            },
        )
    }

    /// Adds the window of an output, or lets the moment come not later than its begin if it is
    /// taken as soon as it can be; leaves if it has none.
    fn add_window<B: Backend<Real = R>>(
        &self,
        b: &mut B,
        output: &Instance<'_>,
        moment: &Cell<R>,
        next: B::Exit,
    ) -> Flow<B> {
        let (window, low) = self.window_in_time(b, output, next)?;
        if output.may_be_urgent {
            come_not_later(b, moment, low);
            return Ok(());
        }
        self.push_window(b, window, low);
        Ok(())
    }

    /// The window of an output, and when it begins; leaves if it has none while the process may
    /// stay.
    fn window_in_time<B: Backend<Real = R>>(
        &self,
        b: &mut B,
        output: &Instance<'_>,
        next: B::Exit,
    ) -> Flow<B, (Span<R>, R)> {
        let window = span(b, self.program, output.guard, &output.values, next)?;
        let low = match window.low {
            None => b.real(0.0),
            Some(low) => {
                self.require_in_time(b, low, next)?;
                low
            }
        };
        Ok((window, low))
    }

    fn push_window<B: Backend<Real = R>>(&self, b: &mut B, window: Span<R>, low: R) {
        let end = self.cut(b, window);
        let end = end.unwrap_or_else(|| b.real(f64::INFINITY));
        let number = b.window_count();
        b.set_window(number, low, end);
        let count = b.plus(number, 1);
        b.set_window_count(count);
    }

    /// Lets the moment come not later than a delay that is drawn in the windows.
    fn draw_in_windows<B: Backend<Real = R>>(&self, b: &mut B, moment: &Cell<R>) -> Flow<B> {
        let draw = |b: &mut B, rate: Option<R>| {
            let drawn = b.delay_in_windows(rate)?;
            let first = b.least(drawn, moment.get());
            b.set_real(moment, first);
            Ok(())
        };
        let by_rate = |b: &mut B| {
            b.attempt(|b, never| {
                let rate = exponential_rate(b, self.process, self.spot, never)?;
                draw(b, Some(rate))
            })
        };
        match self.bound {
            None => by_rate(b),
            Some(bound) if bound.is_finite => draw(b, None),
            Some(bound) => {
                let is_bounded = bound.has_end(b);
                b.choose(is_bounded, |b| draw(b, None), by_rate)
            }
        }
    }
}

/// Lets a moment come at this time, if it does not come before.
fn come_not_later<B: Backend>(b: &mut B, moment: &Cell<B::Real>, at: B::Real) {
    let first = b.least(moment.get(), at);
    b.set_real(moment, first);
}

/// The rate of the exponential delay, which is greater than 0; leaves if it is 0, and ends the run
/// if there is none.
pub(in crate::stochastic) fn exponential_rate<B: Backend>(
    b: &mut B,
    process: usize,
    spot: &Spot,
    never: B::Exit,
) -> Flow<B, B::Real> {
    let stand = b.stand(process);
    let Some(known) = spot.exponential_rate else {
        b.fail(|_| Failure::NoRate(stand))?;
        // What is written behind it as code is not reached.
        return Ok(b.real(0.0));
    };
    let rate = number(b, known, &[])?;
    if !matches!(known, Number::Known(rate) if rate > 0.0 && rate.is_finite()) {
        b.insist_on_range(rate, |b| Failure::Rate(stand, b.shown(rate)))?;
        let is_positive = b.compare_real_to(rate, Relation::Greater, 0.0);
        b.unless(is_positive, never)?;
    }
    Ok(rate)
}

/// A number, as much greater as counts as equal.
pub(in crate::stochastic) fn tolerant<B: Backend>(b: &mut B, value: B::Real) -> B::Real {
    let (part, tolerance) = (b.real(1.0 + TOLERANCE), b.real(TOLERANCE));
    let value = b.multiply(value, part);
    b.add(value, tolerance)
}

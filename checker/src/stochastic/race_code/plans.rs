//! Code for what processes plan, as `stochastic/race/planning.rs` says it.

use super::conditions::Span;
use super::race_writer::RaceWriter;
use super::writer::Writer;
use crate::ir::{
    BlockId, Distribution, Function, FunctionId, IntegerOperator, Register, RegisterType, Relation,
    Urgency,
};
use crate::stochastic::condition::{Condition, Number};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::program::{Instance, Spot};

/// How long a process may stay where it is: the register holds it, if it has an end.
#[derive(Clone, Copy)]
struct Bound {
    end: Register,
    /// Whether it is known to be finite.
    is_finite: bool,
}

/// Where a plan goes on: if the process never tries to move, if something is broken, and else.
#[derive(Clone, Copy)]
struct Exits {
    never: BlockId,
    broken: BlockId,
    done: BlockId,
}

impl RaceWriter<'_, '_> {
    /// The function that lets a process plan in a location.
    pub(super) fn plan_in(&self, process: usize, location: usize) -> Function {
        let name = format!("plan of process {process} in location {location}");
        let mut w = self.writer(&name, (0, None));
        let (broken, done) = (w.block(), w.block());
        let spot = &self.program.spots_of(process)[location];
        self.plan_at(&mut w, (process, spot), (broken, done));
        w.at(done);
        w.return_value(None);
        w.at(broken);
        w.give_up();
        w.finish()
    }

    /// The function that lets a process plan wherever it is.
    pub(super) fn plan(&self, process: usize, by_location: &[Option<FunctionId>]) -> Function {
        let mut w = self.writer(&format!("plan of process {process}"), (0, None));
        let location = w.load(process as u32);
        let (idle, wrong) = (w.block(), w.block());
        let mut places = Vec::new();
        let mut calls = Vec::new();
        for (spot, &function) in self.program.spots_of(process).iter().zip(by_location) {
            places.push(match function {
                None => wrong,
                Some(_) if is_idle(spot) => idle,
                Some(function) => {
                    let block = w.block();
                    calls.push((block, function));
                    block
                }
            });
        }
        w.switch(location, places, wrong);
        for (block, function) in calls {
            w.at(block);
            w.call(function, &[]);
            w.return_value(None);
        }
        w.at(idle);
        self.set_attempt(&mut w, process, None);
        self.set_stay(&mut w, process, None);
        w.return_value(None);
        w.at(wrong);
        w.give_up();
        w.finish()
    }

    /// The function that gives up unless the invariant of a process holds; `None` if it has none.
    pub(super) fn invariant(&self, process: usize) -> Option<Function> {
        let spots = self.program.spots_of(process);
        if spots.iter().all(|spot| spot.invariant == Condition::Always) {
            return None;
        }
        let mut w = self.writer(&format!("invariant of process {process}"), (0, None));
        let location = w.load(process as u32);
        let (kept, broken) = (w.block(), w.block());
        let places: Vec<BlockId> = spots
            .iter()
            .map(|spot| match spot.invariant {
                Condition::Always => kept,
                _ => w.block(),
            })
            .collect();
        w.switch(location, places.clone(), broken);
        for (spot, block) in spots.iter().zip(places) {
            if block != kept {
                w.at(block);
                self.conditions.require(&mut w, spot.invariant, &[], broken);
                w.jump(kept);
            }
        }
        w.at(kept);
        w.return_value(None);
        w.at(broken);
        w.give_up();
        Some(w.finish())
    }

    /// Sets in how long a process tries to move; without a moment it never does.
    fn set_attempt(&self, w: &mut Writer, process: usize, moment: Option<Register>) {
        if let Some(word) = self.layout.attempts[process] {
            let moment = moment.unwrap_or_else(|| w.double(f64::INFINITY));
            w.store_double(word, moment);
        }
    }

    fn set_stay(&self, w: &mut Writer, process: usize, end: Option<Register>) {
        if let Some(word) = self.layout.stays[process] {
            if end.is_some() {
                w.store_integer(self.layout.has_stays, 1);
            }
            let end = end.unwrap_or_else(|| w.double(f64::INFINITY));
            w.store_double(word, end);
        }
    }

    /// Ends a plan: the process tries to move at a moment that it may stay until.
    fn end_in_time(&self, w: &mut Writer, process: usize, moment: Register, done: BlockId) {
        self.set_attempt(w, process, Some(moment));
        self.set_stay(w, process, None);
        w.jump(done);
    }

    /// Lets a process plan in a location, and goes on at `done`.
    pub(super) fn plan_at(
        &self,
        w: &mut Writer,
        (process, spot): (usize, &Spot),
        (broken, done): (BlockId, BlockId),
    ) {
        let bound = self.bound(w, spot, broken);
        // Where the plan of a process goes on that never tries to move.
        let never = w.block();
        let exits = Exits {
            never,
            broken,
            done,
        };
        if spot.urgency != Urgency::Normal {
            self.require_some_output(w, spot, never);
            let now = w.double(0.0);
            self.end_in_time(w, process, now, exits.done);
            w.at(never);
            let now = w.double(0.0);
            self.set_attempt(w, process, None);
            self.set_stay(w, process, Some(now));
            w.jump(done);
            return;
        }
        if spot.is_plain {
            self.require_some_output(w, spot, never);
            let all = Span {
                low: None,
                high: None,
            };
            self.plan_in_window(w, (process, spot), (all, bound), exits);
        } else {
            self.plan_in_windows(w, (process, spot), bound, exits);
        }
        w.at(never);
        self.set_attempt(w, process, None);
        self.set_stay(w, process, bound.map(|bound| bound.end));
        w.jump(done);
    }

    /// How long a process may stay by its invariant.
    fn bound(&self, w: &mut Writer, spot: &Spot, broken: BlockId) -> Option<Bound> {
        let span = self.conditions.span(w, spot.invariant, &[], broken);
        if let Some(low) = span.low {
            let zero = w.double(0.0);
            let holds_now = w.compare_doubles(low, Relation::LessEqual, zero);
            w.unless(holds_now, broken);
        }
        let end = span.high?;
        let Condition::Compared(place) = spot.invariant else {
            return None;
        };
        let bounds = &self.program.comparisons(place).bounds;
        // A clock with another rate may stand still.
        let mut plain = bounds
            .iter()
            .filter(|(clock, _, _)| !self.layout.is_rated(*clock));
        let is_finite = plain.any(|(_, relation, number)| {
            let is_upper = matches!(
                relation,
                Relation::Less | Relation::LessEqual | Relation::Equal
            );
            is_upper && matches!(number, Number::Known(number) if number.is_finite())
        });
        Some(Bound { end, is_finite })
    }

    /// Goes on if an output of a process is enabled, else elsewhere. All guards are computed, for
    /// each may fail.
    fn require_some_output(&self, w: &mut Writer, spot: &Spot, never: BlockId) {
        let outputs = self.program.range(spot.outputs);
        let is_certain = outputs.iter().any(|one| one.guard == Condition::Always);
        if let [only] = outputs {
            self.conditions.require(w, only.guard, &only.values, never);
            return;
        }
        let some = w.integer(0);
        for output in outputs {
            self.when_enabled(w, output, |w| {
                let one = w.integer(1);
                w.copy(some, one);
            });
        }
        if !is_certain {
            w.unless(some, never);
        }
    }

    /// Writes what is done only if the guard of an instance holds.
    pub(super) fn when_enabled(
        &self,
        w: &mut Writer,
        instance: &Instance<'_>,
        write: impl FnOnce(&mut Writer),
    ) {
        let next = w.block();
        self.conditions
            .require(w, instance.guard, &instance.values, next);
        write(w);
        w.jump(next);
        w.at(next);
    }

    /// Goes on if a moment comes while the process may stay, but for rounding, else elsewhere.
    fn require_in_time(w: &mut Writer, moment: Register, bound: Option<Bound>, otherwise: BlockId) {
        if let Some(Bound { end, .. }) = bound {
            let latest = tolerant(w, end);
            let is_in_time = w.compare_doubles(moment, Relation::LessEqual, latest);
            w.unless(is_in_time, otherwise);
        }
    }

    /// Cuts a window where the process may stay no longer.
    fn cut(w: &mut Writer, window: Span, bound: Option<Bound>) -> Option<Register> {
        let mut high = window.high;
        if let Some(Bound { end, .. }) = bound {
            high = Some(match high {
                None => end,
                Some(high) => w.least(high, end),
            });
        }
        match (high, window.low) {
            (Some(high), Some(low)) => Some(w.greatest(high, low)),
            (high, _) => high,
        }
    }

    /// Draws the delay of a process in one window, and ends its plan.
    fn plan_in_window(
        &self,
        w: &mut Writer,
        (process, spot): (usize, &Spot),
        (window, bound): (Span, Option<Bound>),
        exits: Exits,
    ) {
        if let Some(low) = window.low {
            Self::require_in_time(w, low, bound, exits.never);
        }
        let end = Self::cut(w, window, bound);
        let length = end.map(|end| match window.low {
            None => end,
            Some(low) => w.subtract(end, low),
        });
        if let (Some(bound), Some(length)) = (bound, length) {
            let unbounded = w.block();
            if !bound.is_finite {
                let infinity = w.double(f64::INFINITY);
                let is_finite = w.compare_doubles(bound.end, Relation::Less, infinity);
                w.unless(is_finite, unbounded);
            }
            let moment = w.double(0.0);
            if spot.is_plain {
                // A moment of no length is drawn as any other.
                let drawn = w.draw(Distribution::Uniform, length);
                w.copy(moment, drawn);
            } else {
                if let Some(low) = window.low {
                    w.copy(moment, low);
                }
                let zero = w.double(0.0);
                let has_length = w.compare_doubles(length, Relation::Greater, zero);
                w.when(has_length, |w| {
                    let passed = w.draw(Distribution::Uniform, length);
                    let at = match window.low {
                        None => passed,
                        Some(low) => w.add(low, passed),
                    };
                    w.copy(moment, at);
                });
            }
            self.end_in_time(w, process, moment, exits.done);
            w.at(unbounded);
            if bound.is_finite {
                w.give_up();
                return;
            }
        }
        let rate = self.rate(w, spot, exits);
        let Some(rate) = rate else {
            return;
        };
        if let (Some(length), false) = (length, spot.is_plain) {
            let zero = w.double(0.0);
            let has_length = w.compare_doubles(length, Relation::NotEqual, zero);
            let moment = w.block();
            w.unless(has_length, moment);
            let go_on = w.block();
            w.jump(go_on);
            w.at(moment);
            let at = window.low.unwrap_or_else(|| w.double(0.0));
            self.end_in_time(w, process, at, exits.done);
            w.at(go_on);
        }
        let passed = w.draw(Distribution::Exponential, rate);
        if let (Some(length), false) = (length, spot.is_plain) {
            let is_inside = w.compare_doubles(passed, Relation::LessEqual, length);
            w.unless(is_inside, exits.never);
        }
        let moment = match window.low {
            None => passed,
            Some(low) => w.add(low, passed),
        };
        self.end_in_time(w, process, moment, exits.done);
    }

    /// The rate of the exponential delay, which is greater than 0; none if that is known not to be
    /// so, and then the code has ended here.
    fn rate(&self, w: &mut Writer, spot: &Spot, exits: Exits) -> Option<Register> {
        match spot.exponential_rate {
            None => {
                w.jump(exits.broken);
                None
            }
            Some(Number::Known(0.0)) => {
                w.jump(exits.never);
                None
            }
            Some(Number::Known(rate)) if !(rate > 0.0 && rate.is_finite()) => {
                w.jump(exits.broken);
                None
            }
            Some(number) => {
                let rate = self.conditions.number(w, number, &[]);
                if matches!(number, Number::Computed(_)) {
                    let (zero, infinity) = (w.double(0.0), w.double(f64::INFINITY));
                    let is_rate = w.compare_doubles(rate, Relation::GreaterEqual, zero);
                    w.unless(is_rate, exits.broken);
                    let is_finite = w.compare_doubles(rate, Relation::Less, infinity);
                    w.unless(is_finite, exits.broken);
                    let is_positive = w.compare_doubles(rate, Relation::Greater, zero);
                    w.unless(is_positive, exits.never);
                }
                Some(rate)
            }
        }
    }

    /// Draws the delay of a process in the windows of its outputs, and ends its plan.
    fn plan_in_windows(
        &self,
        w: &mut Writer,
        (process, spot): (usize, &Spot),
        bound: Option<Bound>,
        exits: Exits,
    ) {
        let outputs = self.program.range(spot.outputs);
        let (urgent, drawn): (Vec<_>, Vec<_>) =
            outputs.iter().partition(|output| output.may_be_urgent);
        if let ([], [only]) = (&urgent[..], &drawn[..]) {
            let window = self
                .conditions
                .span(w, only.guard, &only.values, exits.never);
            self.plan_in_window(w, (process, spot), (window, bound), exits);
            return;
        }
        let count = self.layout.windows;
        let moment = w.double(f64::INFINITY);
        if !drawn.is_empty() {
            w.store_integer(count, 0);
        }
        for output in outputs {
            let next = w.block();
            let window = self.conditions.span(w, output.guard, &output.values, next);
            let low = window.low.unwrap_or_else(|| w.double(0.0));
            if window.low.is_some() {
                Self::require_in_time(w, low, bound, next);
            }
            if output.may_be_urgent {
                let first = w.least(moment, low);
                w.copy(moment, first);
            } else {
                let end = Self::cut(w, window, bound);
                let end = end.unwrap_or_else(|| w.double(f64::INFINITY));
                let number = w.load(count);
                let place = w.place_of_double(number, self.layout.most_windows);
                w.store_double_at(self.layout.lows, Some(place), low);
                w.store_double_at(self.layout.highs, Some(place), end);
                let one = w.integer(1);
                let number = w.add_integers(number, one);
                w.store(count, number);
            }
            w.jump(next);
            w.at(next);
        }
        if !drawn.is_empty() {
            let windows = w.load(count);
            let urgent_only = w.block();
            w.unless(windows, urgent_only);
            let unbounded = w.block();
            if let Some(bound) = bound {
                if !bound.is_finite {
                    let infinity = w.double(f64::INFINITY);
                    let is_finite = w.compare_doubles(bound.end, Relation::Less, infinity);
                    w.unless(is_finite, unbounded);
                }
                let drawn = self.draw_in_windows(w, true);
                let first = w.least(drawn, moment);
                w.copy(moment, first);
                w.jump(urgent_only);
            } else {
                w.jump(unbounded);
            }
            w.at(unbounded);
            if bound.is_some_and(|bound| bound.is_finite) {
                w.give_up();
            } else if let Some(rate) = self.rate(
                w,
                spot,
                Exits {
                    never: urgent_only,
                    ..exits
                },
            ) {
                w.store_double(self.layout.rate, rate);
                let drawn = self.draw_in_windows(w, false);
                let first = w.least(drawn, moment);
                w.copy(moment, first);
                w.jump(urgent_only);
            }
            w.at(urgent_only);
        }
        let infinity = w.double(f64::INFINITY);
        let comes = w.compare_doubles(moment, Relation::Less, infinity);
        w.unless(comes, exits.never);
        let in_time = w.block();
        if let Some(bound) = bound {
            let is_in_time = w.compare_doubles(moment, Relation::LessEqual, bound.end);
            let late = w.block();
            w.branch(is_in_time, in_time, late);
            w.at(late);
            self.set_attempt(w, process, Some(moment));
            self.set_stay(w, process, Some(bound.end));
            w.jump(exits.done);
        } else {
            w.jump(in_time);
        }
        w.at(in_time);
        self.end_in_time(w, process, moment, exits.done);
    }

    fn draw_in_windows(&self, w: &mut Writer, is_bounded: bool) -> Register {
        let is_bounded = w.integer(is_bounded.into());
        w.call_for_double(self.in_windows, vec![is_bounded])
    }

    /// The function that draws a delay in the windows that lie in their words: uniformly if its
    /// argument is 1, else by the rate that lies beside them.
    pub(super) fn windows(&self) -> Function {
        let layout = self.layout;
        let result = (1, Some(RegisterType::Double));
        let mut writer = self.writer("a delay in windows", result);
        let w = &mut writer;
        let is_bounded = Register(0);
        let count = w.load(layout.windows);
        let place = |w: &mut Writer, number| w.place_of_double(number, layout.most_windows);
        let low_of = |w: &mut Writer, number| {
            let place = place(w, number);
            w.load_double_at(layout.lows, Some(place))
        };
        let high_of = |w: &mut Writer, number| {
            let place = place(w, number);
            w.load_double_at(layout.highs, Some(place))
        };
        let set = |w: &mut Writer, number, low, high| {
            let place = place(w, number);
            w.store_double_at(layout.lows, Some(place), low);
            w.store_double_at(layout.highs, Some(place), high);
        };
        let one = w.integer(1);
        // They are sorted by insertion.
        let number = w.integer(1);
        w.repeat(
            |w| w.compare(number, Relation::Less, count),
            |w| {
                let (low, high) = (low_of(w, number), high_of(w, number));
                let free = w.integer(0);
                w.copy(free, number);
                let out = w.block();
                w.repeat(
                    |w| w.compare_to(free, Relation::Greater, 0),
                    |w| {
                        let before = w.arithmetic(IntegerOperator::Subtract, free, one);
                        let (its_low, its_high) = (low_of(w, before), high_of(w, before));
                        let is_after = w.compare_doubles(its_low, Relation::Greater, low);
                        w.unless(is_after, out);
                        set(w, free, its_low, its_high);
                        w.copy(free, before);
                    },
                );
                w.jump(out);
                w.at(out);
                set(w, free, low, high);
                let next = w.add_integers(number, one);
                w.copy(number, next);
            },
        );
        // Those that touch are joined; `last` is the last one that stays.
        let (last, number) = (w.integer(0), w.integer(1));
        w.repeat(
            |w| w.compare(number, Relation::Less, count),
            |w| {
                let (low, high) = (low_of(w, number), high_of(w, number));
                let (last_low, last_high) = (low_of(w, last), high_of(w, last));
                let touches = w.compare_doubles(low, Relation::LessEqual, last_high);
                let (join, apart, next) = (w.block(), w.block(), w.block());
                w.branch(touches, join, apart);
                w.at(join);
                let end = w.greatest(high, last_high);
                set(w, last, last_low, end);
                w.jump(next);
                w.at(apart);
                let after = w.add_integers(last, one);
                w.copy(last, after);
                set(w, last, low, high);
                w.jump(next);
                w.at(next);
                let after = w.add_integers(number, one);
                w.copy(number, after);
            },
        );
        let count = w.add_integers(last, one);
        let (length, number) = (w.double(0.0), w.integer(0));
        w.repeat(
            |w| w.compare(number, Relation::Less, count),
            |w| {
                let (low, high) = (low_of(w, number), high_of(w, number));
                let part = w.subtract(high, low);
                let sum = w.add(length, part);
                w.copy(length, sum);
                let after = w.add_integers(number, one);
                w.copy(number, after);
            },
        );
        let passed = w.double(0.0);
        let (uniform, exponential, walk, moments) = (w.block(), w.block(), w.block(), w.block());
        let zero = w.double(0.0);
        let has_length = w.compare_doubles(length, Relation::Greater, zero);
        w.branch(is_bounded, uniform, exponential);
        w.at(uniform);
        w.unless(has_length, moments);
        let drawn = w.draw(Distribution::Uniform, length);
        w.copy(passed, drawn);
        w.jump(walk);
        w.at(moments);
        let chosen = w.integer(0);
        let are_many = w.compare(count, Relation::Greater, one);
        w.when(are_many, |w| {
            let drawn = w.draw_below(count);
            w.copy(chosen, drawn);
        });
        let moment = low_of(w, chosen);
        w.return_value(Some(moment));
        w.at(exponential);
        let first = w.block();
        w.unless(has_length, first);
        let rate = w.load_double(layout.rate);
        let drawn = w.draw(Distribution::Exponential, rate);
        w.copy(passed, drawn);
        w.jump(walk);
        w.at(first);
        let zero_number = w.integer(0);
        let moment = low_of(w, zero_number);
        w.return_value(Some(moment));
        w.at(walk);
        let number = w.integer(0);
        w.repeat(
            |w| w.compare(number, Relation::Less, count),
            |w| {
                let (low, high) = (low_of(w, number), high_of(w, number));
                let part = w.subtract(high, low);
                let is_beyond = w.compare_doubles(passed, Relation::Greater, part);
                let (inside, beyond) = (w.block(), w.block());
                w.branch(is_beyond, beyond, inside);
                w.at(inside);
                let moment = w.add(low, passed);
                w.return_value(Some(moment));
                w.at(beyond);
                let rest = w.subtract(passed, part);
                w.copy(passed, rest);
                let after = w.add_integers(number, one);
                w.copy(number, after);
            },
        );
        let infinity = w.double(f64::INFINITY);
        w.return_value(Some(infinity));
        writer.finish()
    }
}

/// Whether nothing ever comes of a plan.
fn is_idle(spot: &Spot) -> bool {
    spot.outputs.0 == spot.outputs.1
        && spot.urgency == Urgency::Normal
        && spot.invariant == Condition::Always
}

/// A number, as much greater as counts as equal.
pub(super) fn tolerant(w: &mut Writer, value: Register) -> Register {
    let (part, tolerance) = (w.double(1.0 + TOLERANCE), w.double(TOLERANCE));
    let value = w.multiply(value, part);
    w.add(value, tolerance)
}

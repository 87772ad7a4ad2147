//! Code for a run, move by move, as `stochastic/race/mod.rs` and `stochastic/run.rs` say it.

use super::moves::Ways;
use super::race_writer::{Ids, RaceWriter};
use super::watching::{GOES_ON, IS_OVER, Watched};
use super::writer::Writer;
use crate::ir::{
    BlockId, Function, FunctionId, IntegerOperator, Register, RegisterType, Relation, Urgency,
};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::rules::{self, Backend};

/// What all parts of a round share.
#[derive(Clone, Copy)]
pub(super) struct Round<'r> {
    ids: &'r Ids,
    watched: &'r Watched,
    /// The cell of the winner, and the delay before it moves.
    cell: Register,
    delay: Register,
    pub(super) begin: BlockId,
    /// Nobody has moved, after all.
    pub(super) missed: BlockId,
    /// Somebody must leave a committed location.
    settling: BlockId,
    /// Nobody must.
    racing: BlockId,
    /// All may stay until the delay is over.
    free: BlockId,
    /// The winner is known, and the delay has passed.
    moving: BlockId,
    /// The run ends at its bound, after the delay.
    over: BlockId,
    /// The controller makes the move that was decided.
    pub(super) chosen: BlockId,
}

/// Who wins, in registers.
#[derive(Clone, Copy)]
struct First {
    /// The number of the winner's location, if those of all processes are counted: its cell in the
    /// table of moves.
    cell: Register,
    /// The least attempt.
    attempt: Register,
    /// The least attempt of the others, if there are any.
    second: Option<Register>,
}

impl First {
    /// Who wins among some of which everyone is first alone. No branches: they would be
    /// mispredicted every other time.
    fn of(w: &mut Writer<'_>, all: &[First]) -> First {
        if let [only] = *all {
            return only;
        }
        let (left, right) = all.split_at(all.len() / 2);
        let (left, right) = (First::of(w, left), First::of(w, right));
        let is_left = w.compare_reals(left.attempt, Relation::Less, right.attempt);
        let cell = w.either(is_left, left.cell, right.cell);
        let attempt = w.least(left.attempt, right.attempt);
        let mut second = w.greatest(left.attempt, right.attempt);
        for other in [left.second, right.second].into_iter().flatten() {
            second = w.least(second, other);
        }
        First {
            cell,
            attempt,
            second: Some(second),
        }
    }
}

impl RaceWriter<'_, '_> {
    /// The function that makes moves until the run has ended, or so many as its words say.
    pub(super) fn rounds(&self, ids: &Ids, watched: &Watched) -> Function {
        let layout = self.layout;
        let mut writer = self.writer("moves of a run", 0, Some(RegisterType::Integer));
        let w = &mut writer;
        let (start, begin) = (w.block(), w.block());
        let missed = match layout.decisions {
            Some(_) => w.block(),
            None => begin,
        };
        let round = Round {
            ids,
            watched,
            cell: w.integer(0),
            delay: w.real(0.0),
            begin,
            missed,
            settling: w.block(),
            racing: w.block(),
            free: w.block(),
            moving: w.block(),
            over: w.block(),
            chosen: w.block(),
        };
        if let Some(decisions) = &layout.decisions {
            self.resume(w, round, decisions, start);
        } else {
            w.jump(start);
        }
        w.at(start);
        self.begin_run(w, ids);
        w.jump(begin);
        w.at(begin);
        if self.committing.is_empty() {
            w.jump(round.racing);
        } else {
            let committed = w.load(layout.committed);
            w.branch(committed, round.settling, round.racing);
            w.at(round.settling);
            self.settle_committed(w, round);
        }
        w.at(round.racing);
        self.plan_anew(w, ids);
        let all = self.attempts(w, ids);
        let infinity = w.real(f64::INFINITY);
        let first = (!all.is_empty()).then(|| First::of(w, &all));
        w.copy(round.delay, first.map_or(infinity, |first| first.attempt));
        let bounded = w.block();
        let has_stays = w.load(layout.has_stays);
        w.branch(has_stays, bounded, round.free);
        // Some process may not stay for ever, and tries to move later than it must.
        w.at(bounded);
        self.settle_stays(w, round);
        w.at(round.free);
        let passing = self.watch_delay(w, round);
        if let Some(first) = first {
            let words = layout.attempts.iter().flatten();
            let attempts: Vec<(u32, Register)> = words
                .zip(&all)
                .map(|(&word, one)| (word, one.attempt))
                .collect();
            self.wait(w, passing, &attempts);
            w.copy(round.cell, first.cell);
            if let Some(second) = first.second {
                let latest = rules::tolerant(w, round.delay);
                let are_many = w.compare_reals(second, Relation::LessEqual, latest);
                w.when(are_many, |w| {
                    Self::choose_among(w, &all, latest, round.cell);
                });
            }
            w.jump(round.moving);
        } else {
            w.give_up();
        }
        w.at(round.moving);
        self.let_winner_move(w, round);
        w.at(round.over);
        self.end_run(w, watched, round.delay);
        writer.finish()
    }

    /// What comes before the first move of a run, or before the next one of so many.
    fn begin_run(&self, w: &mut Writer<'_>, ids: &Ids) {
        if let Some(renewal) = self.renewal_of_rates {
            w.call(renewal, &[]);
        }
        if !self.committing.is_empty() {
            // Nobody has planned, which looks at invariants too.
            let committed = w.load(self.layout.committed);
            w.when(committed, |w| {
                for &invariant in ids.invariants.iter().flatten() {
                    w.call(invariant, &[]);
                }
            });
        }
    }

    /// When each process that can move tries to. Where it is is read before it is known who wins:
    /// the jump that follows then waits for nothing but the attempts.
    fn attempts(&self, w: &mut Writer<'_>, ids: &Ids) -> Vec<First> {
        let words = self.layout.attempts.iter().enumerate();
        let attempts: Vec<(usize, Register)> = words
            .filter_map(|(process, word)| Some((process, w.load_real((*word)?))))
            .collect();
        let all = attempts.into_iter().map(|(process, attempt)| First {
            cell: Self::cell(w, ids, process),
            attempt,
            second: None,
        });
        all.collect()
    }

    /// Watches all through a delay, and goes elsewhere if the bound of the run comes first: the
    /// delay is then what is left of it. Returns how much time passes, which is less than the delay
    /// if that lies beyond the bound by no more than rounding.
    fn watch_delay(&self, w: &mut Writer<'_>, round: Round<'_>) -> Register {
        let (layout, delay) = (self.layout, round.delay);
        let (inside, beyond, in_time) = (w.block(), w.block(), w.block());
        let passing = w.real(0.0);
        let (bound, time) = (w.load_real(layout.bound), w.load_real(layout.time));
        let rest = w.subtract(bound, time);
        let is_inside = w.compare_reals(delay, Relation::LessEqual, rest);
        w.branch(is_inside, inside, beyond);
        w.at(beyond);
        // But for rounding, the run is over before anybody moves.
        let (rest, slack) = self.rest(w);
        let first_end = w.least(delay, rest);
        w.copy(passing, first_end);
        self.watch(w, round.watched, Some(passing));
        let latest_end = w.add(rest, slack);
        let is_late = w.compare_reals(latest_end, Relation::Less, delay);
        let late = w.block();
        w.branch(is_late, late, in_time);
        w.at(late);
        w.copy(delay, rest);
        w.jump(round.over);
        w.at(inside);
        w.copy(passing, delay);
        self.watch(w, round.watched, Some(passing));
        w.jump(in_time);
        w.at(in_time);
        passing
    }

    /// Lets the winner move, and goes to the next round: to its begin, or past it where the move
    /// says whether somebody is in a committed location now.
    fn let_winner_move(&self, w: &mut Writer<'_>, round: Round<'_>) {
        w.count_round();
        let go_on = w.block();
        let ways = Ways {
            moved: w.block(),
            put_off: w.block(),
        };
        self.let_move(w, round, ways);
        if let Some(decisions) = &self.layout.decisions {
            w.at(round.chosen);
            Self::let_chosen_move(w, round.ids, decisions, ways);
        }
        for (block, next) in [(ways.moved, round.racing), (ways.put_off, round.settling)] {
            w.at(block);
            let left = w.load(self.layout.moves_left);
            let minus_one = w.integer(-1);
            let left = w.add_integers(left, minus_one);
            w.store(self.layout.moves_left, left);
            w.branch(left, next, go_on);
        }
        w.at(go_on);
        let result = w.integer(GOES_ON);
        w.return_value(Some(result));
    }

    /// Ends a run at its bound, after so much more time.
    fn end_run(&self, w: &mut Writer<'_>, watched: &Watched, delay: Register) {
        let zero = w.real(0.0);
        let passing = w.greatest(delay, zero);
        self.wait_until_the_end(w, passing);
        if let Watched::Extreme(..) = watched {
            self.watch(w, watched, None);
        }
        let result = w.integer(IS_OVER);
        w.return_value(Some(result));
    }

    /// Sets the cell to one of those whose attempts come until then, all with the same chance.
    fn choose_among(w: &mut Writer<'_>, all: &[First], latest: Register, cell: Register) {
        let flagged = all.iter().map(|one| {
            let is_first = w.compare_reals(one.attempt, Relation::LessEqual, latest);
            (one.cell, Some(is_first))
        });
        let flagged: Vec<_> = flagged.collect();
        let Ok(()) = w.attempt(|w, none| {
            let chosen = rules::draw(w, flagged.iter().copied(), none)?;
            w.copy(cell, chosen);
            Ok(())
        });
    }

    /// The cell of a process that is where it is.
    fn cell(w: &mut Writer<'_>, ids: &Ids, process: usize) -> Register {
        let location = w.load(process as u32);
        let first = w.integer(ids.first_location(process) as i32);
        w.add_integers(location, first)
    }

    /// Lets the winner move from where it is, as its cell says; goes where what the function of the
    /// move returns leads.
    fn let_move(&self, w: &mut Writer<'_>, round: Round<'_>, ways: Ways) {
        let wrong = w.block();
        let cells = round
            .ids
            .moves
            .iter()
            .enumerate()
            .flat_map(|(process, moves)| {
                let functions = moves.iter().enumerate();
                functions.map(move |(location, function)| Some((process, location, (*function)?)))
            });
        let cells: Vec<Option<(usize, usize, FunctionId)>> = cells.collect();
        let blocks = cells.iter().map(|one| one.map_or(wrong, |_| w.block()));
        let blocks: Vec<BlockId> = blocks.collect();
        w.switch(round.cell, blocks.clone(), wrong);
        for (cell, block) in cells.into_iter().zip(blocks) {
            let Some((process, location, function)) = cell else {
                continue;
            };
            w.at(block);
            let result = w.call_for(function, Vec::new());
            let spot = &self.program.spots_of(process)[location];
            let missed = if spot.urgency == Urgency::Committed {
                // Somebody else may have to move.
                wrong
            } else {
                round.missed
            };
            // In the order of what the function returns.
            let mut next = vec![missed, ways.moved, ways.put_off];
            let asks = round.ids.possible_moves.filter(|_| spot.is_controllable);
            let asks = asks.map(|possible_moves| (w.block(), possible_moves));
            next.extend(asks.map(|(block, _)| block));
            w.switch(result, next, wrong);
            if let (Some((block, possible_moves)), Some(decisions)) = (asks, &self.layout.decisions)
            {
                w.at(block);
                Self::ask(w, possible_moves, decisions, process);
            }
        }
        w.at(wrong);
        w.give_up();
    }

    /// Lets all processes plan whose plans may have changed.
    fn plan_anew(&self, w: &mut Writer<'_>, ids: &Ids) {
        let layout = self.layout;
        for word in layout.stale..layout.stale + layout.stale_words {
            let mask = w.load(word);
            w.when(mask, |w| {
                for (process, plans) in ids.plans.iter().enumerate() {
                    let (own, bit) = layout.stale_bit(process);
                    if own == word {
                        let bit = w.integer(bit);
                        let is_stale = w.arithmetic(IntegerOperator::And, mask, bit);
                        w.when(is_stale, |w| w.call(plans.anywhere, &[]));
                    }
                }
                w.store_integer(word, 0);
            });
        }
    }

    /// Chooses who leaves one of the committed locations.
    fn settle_committed(&self, w: &mut Writer<'_>, round: Round<'_>) {
        if let [only] = self.committing[..] {
            // It can move, or the run is given up.
            let own = Self::cell(w, round.ids, only);
            w.copy(round.cell, own);
            self.watch(w, round.watched, None);
            w.jump(round.moving);
        } else {
            self.let_one_move(w, round, &self.committing, true);
        }
    }

    /// Chooses one of those who can move now as the winner, all with the same chance.
    fn let_one_move(
        &self,
        w: &mut Writer<'_>,
        round: Round<'_>,
        processes: &[usize],
        only_committed: bool,
    ) {
        let competitors = w.variable(0);
        for &process in processes {
            let Some(ability) = round.ids.abilities[process] else {
                continue;
            };
            let argument = w.integer(only_committed.into());
            let is_able = w.call_for(ability, vec![argument]);
            w.when(is_able, |w| {
                let Ok(()) = rules::compete(w, &competitors, |w| {
                    let own = Self::cell(w, round.ids, process);
                    w.copy(round.cell, own);
                    Ok(())
                });
            });
        }
        w.insist(competitors.get());
        self.watch(w, round.watched, None);
        w.jump(round.moving);
    }

    /// If some process must leave before anybody tries to move, who can move then does, or the run
    /// is over by then.
    fn settle_stays(&self, w: &mut Writer<'_>, round: Round<'_>) {
        let infinity = w.real(f64::INFINITY);
        let mut least = infinity;
        for &word in self.layout.stays.iter().flatten() {
            let stay = w.load_real(word);
            least = w.least(least, stay);
        }
        let has_end = w.compare_reals(least, Relation::Less, infinity);
        w.when(has_end, |w| {
            let latest = rules::tolerant(w, least);
            let is_beyond = w.compare_reals(round.delay, Relation::Greater, latest);
            w.unless(is_beyond, round.free);
            let is_now = w.compare_real_to(least, Relation::LessEqual, TOLERANCE);
            let (now, later, stuck) = (w.block(), w.block(), w.block());
            w.branch(is_now, now, later);
            w.at(now);
            let is_zero = w.compare_real_to(least, Relation::LessEqual, 0.0);
            w.unless(is_zero, stuck);
            let all: Vec<usize> = (0..round.ids.moves.len()).collect();
            self.let_one_move(w, round, &all, false);
            w.at(later);
            let (rest, slack) = self.rest(w);
            let passing = w.least(least, rest);
            self.watch(w, round.watched, Some(passing));
            let end = w.add(rest, slack);
            let is_over = w.compare_reals(end, Relation::Less, least);
            w.unless(is_over, stuck);
            w.copy(round.delay, rest);
            w.jump(round.over);
            w.at(stuck);
            w.give_up();
        });
        w.store_integer(self.layout.has_stays, 0);
        w.jump(round.free);
    }

    /// How much time the run still has, and how much later a move may come.
    fn rest(&self, w: &mut Writer<'_>) -> (Register, Register) {
        let (bound, time) = (
            w.load_real(self.layout.bound),
            w.load_real(self.layout.time),
        );
        let (zero, one) = (w.real(0.0), w.real(1.0));
        let rest = w.subtract(bound, time);
        let rest = w.greatest(rest, zero);
        let tolerance = w.real(TOLERANCE);
        let slack = w.real(TOLERANCE);
        let has_rest = w.compare_reals(rest, Relation::Greater, zero);
        w.when(has_rest, |w| {
            let size = w.greatest(bound, one);
            let size = w.multiply(tolerance, size);
            w.copy(slack, size);
        });
        (rest, slack)
    }

    /// Lets time pass, if it is more than none.
    fn wait(&self, w: &mut Writer<'_>, delay: Register, attempts: &[(u32, Register)]) {
        let passes = w.compare_real_to(delay, Relation::Greater, 0.0);
        w.when(passes, |w| {
            self.advance(w, delay);
            for &(word, attempt) in attempts {
                let rest = w.subtract(attempt, delay);
                w.store_double(word, rest);
            }
            let subtract = |w: &mut Writer<'_>| {
                for &word in self.layout.stays.iter().flatten() {
                    let stay = w.load_real(word);
                    let rest = w.subtract(stay, delay);
                    w.store_double(word, rest);
                }
            };
            let Some(decisions) = &self.layout.decisions else {
                let has_stays = w.load(self.layout.has_stays);
                return w.when(has_stays, subtract);
            };
            subtract(w);
            let hold = w.load_real(decisions.hold);
            let rest = w.subtract(hold, delay);
            let none = w.real(0.0);
            let rest = w.greatest(rest, none);
            w.store_double(decisions.hold, rest);
        });
    }

    fn wait_until_the_end(&self, w: &mut Writer<'_>, delay: Register) {
        let passes = w.compare_real_to(delay, Relation::Greater, 0.0);
        w.when(passes, |w| self.advance(w, delay));
    }

    fn advance(&self, w: &mut Writer<'_>, delay: Register) {
        for &clock in &self.network().chances.clocks {
            let value = w.load_real(clock);
            let passed = if self.layout.is_rated(clock) {
                let rate = w.load_real(clock + 2);
                w.multiply(rate, delay)
            } else {
                delay
            };
            let value = w.add(value, passed);
            w.store_double(clock, value);
        }
        let time = w.load_real(self.layout.time);
        let time = w.add(time, delay);
        w.store_double(self.layout.time, time);
    }
}

//! Code for a run, move by move, as `stochastic/race/mod.rs` and `stochastic/run.rs` say it.

use super::asked::Watched;
use super::moves::MISSED;
use super::race_writer::{Ids, RaceWriter};
use super::watching::{GOES_ON, IS_OVER};
use super::writer::Writer;
use crate::ir::{
    BlockId, Function, FunctionId, IntegerOperator, Register, RegisterType, Relation, Urgency,
};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::rules::{self, Backend};

/// What all parts of a round need.
#[derive(Clone, Copy)]
struct Round<'r> {
    ids: &'r Ids,
    watched: &'r Watched,
    /// Set to the cell of the winner before it moves, in the block behind it.
    cell: Register,
    moving: BlockId,
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
        let mut writer = self.writer("moves of a run", (0, Some(RegisterType::Integer)));
        let w = &mut writer;
        self.begin_run(w, ids);
        let (round, settling, racing) = (w.block(), w.block(), w.block());
        let (moving, over) = (w.block(), w.block());
        w.jump(round);
        w.at(round);
        // Where the winner moves, from the location that the cell says; the delay before it has
        // passed.
        let (cell, delay) = (w.integer(0), w.real(0.0));
        let this = Round {
            ids,
            watched,
            cell,
            moving,
        };
        if self.committing.is_empty() {
            w.jump(racing);
        } else {
            let committed = w.load(layout.committed);
            w.branch(committed, settling, racing);
            w.at(settling);
            self.settle_committed(w, this);
        }
        w.at(racing);
        self.plan_anew(w, ids);
        let all = self.attempts(w, ids);
        let infinity = w.real(f64::INFINITY);
        let first = (!all.is_empty()).then(|| First::of(w, &all));
        w.copy(delay, first.map_or(infinity, |first| first.attempt));
        let (bounded, free) = (w.block(), w.block());
        let has_stays = w.load(layout.has_stays);
        w.branch(has_stays, bounded, free);
        // Some process may not stay for ever, and tries to move later than it must.
        w.at(bounded);
        self.settle_stays(w, this, delay, free, over);
        w.at(free);
        let passing = self.watch_delay(w, watched, delay, over);
        if let Some(first) = first {
            let words = layout.attempts.iter().flatten();
            let attempts: Vec<(u32, Register)> = words
                .zip(&all)
                .map(|(&word, one)| (word, one.attempt))
                .collect();
            self.wait(w, passing, &attempts);
            w.copy(cell, first.cell);
            if let Some(second) = first.second {
                let latest = rules::tolerant(w, delay);
                let are_many = w.compare_reals(second, Relation::LessEqual, latest);
                let tied = w.block();
                w.branch(are_many, tied, moving);
                w.at(tied);
                Self::choose_among(w, &all, latest, cell);
            }
            w.jump(moving);
        } else {
            w.give_up();
        }
        w.at(moving);
        self.let_winner_move(w, ids, cell, [round, racing, settling]);
        w.at(over);
        self.end_run(w, watched, delay);
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
    fn watch_delay(
        &self,
        w: &mut Writer<'_>,
        watched: &Watched,
        delay: Register,
        over: BlockId,
    ) -> Register {
        let layout = self.layout;
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
        self.watch(w, watched, Some(passing));
        let latest_end = w.add(rest, slack);
        let is_late = w.compare_reals(latest_end, Relation::Less, delay);
        let late = w.block();
        w.branch(is_late, late, in_time);
        w.at(late);
        w.copy(delay, rest);
        w.jump(over);
        w.at(inside);
        w.copy(passing, delay);
        self.watch(w, watched, Some(passing));
        w.jump(in_time);
        w.at(in_time);
        passing
    }

    /// Lets the winner move, and goes to the next round: to its begin, or past it where the move
    /// says whether somebody is in a committed location now.
    fn let_winner_move(
        &self,
        w: &mut Writer<'_>,
        ids: &Ids,
        cell: Register,
        [round, racing, settling]: [BlockId; 3],
    ) {
        w.count_round();
        let (moved, put_off, go_on) = (w.block(), w.block(), w.block());
        self.let_move(w, ids, cell, [round, moved, put_off]);
        for (block, next) in [(moved, racing), (put_off, settling)] {
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
            let chosen = rules::draw(w, &flagged, none)?;
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
    fn let_move(&self, w: &mut Writer<'_>, ids: &Ids, cell: Register, next: [BlockId; 3]) {
        let wrong = w.block();
        let cells = ids.moves.iter().enumerate().flat_map(|(process, moves)| {
            let functions = moves.iter().enumerate();
            functions.map(move |(location, function)| Some((process, location, (*function)?)))
        });
        let cells: Vec<Option<(usize, usize, FunctionId)>> = cells.collect();
        let blocks = cells.iter().map(|one| one.map_or(wrong, |_| w.block()));
        let blocks: Vec<BlockId> = blocks.collect();
        w.switch(cell, blocks.clone(), wrong);
        for (cell, block) in cells.into_iter().zip(blocks) {
            let Some((process, location, function)) = cell else {
                continue;
            };
            w.at(block);
            let result = w.call_for(function, Vec::new());
            let spot = &self.program.spots_of(process)[location];
            let mut next = next.to_vec();
            if spot.urgency == Urgency::Committed {
                // Somebody else may have to move.
                next[MISSED as usize] = wrong;
            }
            w.switch(result, next, wrong);
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
        let Round {
            ids,
            watched,
            cell,
            moving,
        } = round;
        let competitors = w.variable(0);
        for &process in processes {
            let Some(ability) = ids.abilities[process] else {
                continue;
            };
            let argument = w.integer(only_committed.into());
            let is_able = w.call_for(ability, vec![argument]);
            w.when(is_able, |w| {
                let Ok(()) = rules::compete(w, &competitors, |w| {
                    let own = Self::cell(w, ids, process);
                    w.copy(cell, own);
                    Ok(())
                });
            });
        }
        w.insist(competitors.get());
        self.watch(w, watched, None);
        w.jump(moving);
    }

    /// If some process must leave before anybody tries to move, who can move then does, or the run
    /// is over by then.
    fn settle_stays(
        &self,
        w: &mut Writer<'_>,
        round: Round<'_>,
        delay: Register,
        free: BlockId,
        over: BlockId,
    ) {
        let infinity = w.real(f64::INFINITY);
        let mut least = infinity;
        for &word in self.layout.stays.iter().flatten() {
            let stay = w.load_real(word);
            least = w.least(least, stay);
        }
        let has_end = w.compare_reals(least, Relation::Less, infinity);
        w.when(has_end, |w| {
            let latest = rules::tolerant(w, least);
            let is_beyond = w.compare_reals(delay, Relation::Greater, latest);
            w.unless(is_beyond, free);
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
            w.copy(delay, rest);
            w.jump(over);
            w.at(stuck);
            w.give_up();
        });
        w.store_integer(self.layout.has_stays, 0);
        w.jump(free);
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
            let has_stays = w.load(self.layout.has_stays);
            w.when(has_stays, |w| {
                for &word in self.layout.stays.iter().flatten() {
                    let stay = w.load_real(word);
                    let rest = w.subtract(stay, delay);
                    w.store_double(word, rest);
                }
            });
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

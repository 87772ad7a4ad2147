//! Code that watches for what is asked of a run, as `stochastic/run.rs` says it: at every state,
//! and all through the delay behind it.

use super::race_writer::RaceWriter;
use super::writer::Writer;
use crate::ir::{Aim, Asked, BlockId, FunctionId, IntegerOperator, Path, Register, Relation};
use crate::stochastic::condition::Condition;
use crate::stochastic::program::Program;
use crate::stochastic::rules::{self, Backend};

/// What is asked of the states of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::stochastic) enum Watched {
    Eventually(Condition),
    Always(Condition),
    /// The first condition, until the second holds.
    Until(Condition, Condition),
    /// The greatest value of a function, times this sign.
    Extreme(FunctionId, f64),
    /// What a run is worth that ends where this holds.
    End(Condition, Aim),
}

impl Watched {
    /// What is asked, unless it is a formula with operators over time.
    pub(in crate::stochastic) fn of(asked: Asked<'_>) -> Option<Watched> {
        Some(match asked {
            Asked::Extreme(value, true) => Watched::Extreme(value, 1.0),
            Asked::Extreme(value, false) => Watched::Extreme(value, -1.0),
            Asked::Path(Path::Eventually(goal)) => Watched::Eventually(Condition::of(goal)),
            Asked::Path(Path::Always(keep)) => Watched::Always(Condition::of(keep)),
            Asked::Path(Path::Until(keep, goal)) => {
                Watched::Until(Condition::of(keep), Condition::of(goal))
            }
            Asked::End(optimum) => {
                let goal = match &optimum.goal {
                    None => Condition::Never,
                    Some(Path::Eventually(goal)) => Condition::of(goal),
                    Some(_) => return None,
                };
                Watched::End(goal, optimum.aim)
            }
            Asked::Path(Path::Formula(_)) => return None,
        })
    }

    /// Whether the code can watch for it.
    pub(super) fn is_known(&self, program: &Program<'_>) -> bool {
        let is_curved = |one: Condition| matches!(one, Condition::Curved(_));
        match *self {
            Watched::Eventually(one) | Watched::Always(one) | Watched::End(one, _) => {
                !is_curved(one)
            }
            Watched::Until(keep, goal) => !is_curved(keep) && !is_curved(goal),
            Watched::Extreme(value, _) => !program.is_timed(value),
        }
    }
}

/// What the code of a run returns: it goes on if it is called again;
pub(super) const GOES_ON: i32 = 0;
/// what was asked has been reached;
pub(super) const REACHED: i32 = 1;
/// what was asked cannot be reached any more;
pub(super) const MISSED: i32 = 2;
/// or its bound has been reached.
pub(super) const IS_OVER: i32 = 3;

/// What a condition says of a moment and of the time behind it: registers of integers, and of the
/// double that says for how long.
struct Mask {
    now: Register,
    behind: Register,
    horizon: Register,
}

impl RaceWriter<'_, '_> {
    /// Ends the run if what was asked is decided by the state, or within the delay that follows, if
    /// there is one.
    pub(super) fn watch(&self, w: &mut Writer<'_>, watched: &Watched, delay: Option<Register>) {
        match *watched {
            Watched::Eventually(goal) | Watched::End(goal, _) => {
                self.watch_for(w, Condition::Always, goal, delay);
            }
            Watched::Always(keep) => self.watch_for(w, keep, Condition::Never, delay),
            Watched::Until(keep, goal) => self.watch_for(w, keep, goal, delay),
            Watched::Extreme(value, sign) => {
                w.call(value, &[]);
                let value = w.load_real(self.network().chances.result);
                let sign = w.real(sign);
                let value = w.multiply(sign, value);
                let size = rules::size(w, value);
                let is_finite = w.compare_real_to(size, Relation::Less, f64::INFINITY);
                w.insist(is_finite);
                let best = w.load_real(self.layout.best);
                let best = w.greatest(value, best);
                w.store_double(self.layout.best, best);
            }
        }
    }

    /// Ends the run if the goal is reached, or what must be kept until then does not hold.
    fn watch_for(
        &self,
        w: &mut Writer<'_>,
        keep: Condition,
        goal: Condition,
        delay: Option<Register>,
    ) {
        let (reached, missed, next) = (w.block(), w.block(), w.block());
        if keep.is_timed() || goal.is_timed() {
            self.watch_through(w, keep, goal, delay, reached, missed);
            w.jump(next);
        } else {
            // Both stay what they are until somebody moves.
            require(w, goal, false, reached);
            require(w, keep, true, missed);
            w.jump(next);
        }
        for (block, result) in [(reached, REACHED), (missed, MISSED)] {
            w.at(block);
            let result = w.integer(result);
            w.return_value(Some(result));
        }
        w.at(next);
    }

    /// Looks at all moments of a delay at which a condition may change.
    fn watch_through(
        &self,
        w: &mut Writer<'_>,
        keep: Condition,
        goal: Condition,
        delay: Option<Register>,
        reached: BlockId,
        missed: BlockId,
    ) {
        let ahead = w.real(0.0);
        let head = w.block();
        w.jump(head);
        w.at(head);
        // A run that ends has been decided so much later than its words say.
        w.store_double(self.layout.decided_after, ahead);
        let keep = self.mask(w, keep, ahead);
        let goal = self.mask(w, goal, ahead);
        let end_unless_open = |w: &mut Writer<'_>, goal: Register, keep: Register| {
            let open = w.block();
            w.branch(goal, reached, open);
            w.at(open);
            w.unless(keep, missed);
        };
        end_unless_open(w, goal.now, keep.now);
        let after = w.block();
        if let Some(delay) = delay {
            let is_inside = w.compare_reals(ahead, Relation::Less, delay);
            w.unless(is_inside, after);
            end_unless_open(w, goal.behind, keep.behind);
            let horizon = w.least(goal.horizon, keep.horizon);
            let later = w.add(ahead, horizon);
            let is_inside = w.compare_reals(later, Relation::LessEqual, delay);
            w.unless(is_inside, after);
            let is_finite = w.compare_real_to(later, Relation::Less, f64::INFINITY);
            w.unless(is_finite, after);
            let gets_on = w.compare_reals(later, Relation::Greater, ahead);
            w.unless(gets_on, after);
            w.copy(ahead, later);
            w.jump(head);
        } else {
            w.jump(after);
        }
        w.at(after);
        let none = w.real(0.0);
        w.store_double(self.layout.decided_after, none);
    }

    /// What a condition says of the state after this time, if nothing happens until then.
    fn mask(&self, w: &mut Writer<'_>, condition: Condition, ahead: Register) -> Mask {
        let chances = &self.network().chances;
        if let Condition::Timed(function) = condition {
            w.store_double(chances.ahead, ahead);
            let mask = w.call_for(function, Vec::new());
            let (first, second) = (w.integer(1), w.integer(2));
            return Mask {
                now: w.arithmetic(IntegerOperator::And, mask, first),
                behind: w.arithmetic(IntegerOperator::And, mask, second),
                horizon: w.load_real(chances.result),
            };
        }
        let holds = match condition {
            Condition::Words(function) => w.call_for(function, Vec::new()),
            Condition::Always => w.integer(1),
            _ => w.integer(0),
        };
        Mask {
            now: holds,
            behind: holds,
            horizon: w.real(f64::INFINITY),
        }
    }
}

/// Goes on if it is so that a condition on words holds, or that it does not; else elsewhere.
fn require(w: &mut Writer<'_>, condition: Condition, holds: bool, otherwise: BlockId) {
    match condition {
        Condition::Words(function) => {
            let next = w.block();
            let mask = w.call_for(function, Vec::new());
            let (then, otherwise) = if holds {
                (next, otherwise)
            } else {
                (otherwise, next)
            };
            w.branch(mask, then, otherwise);
            w.at(next);
        }
        Condition::Always if holds => {}
        Condition::Never if !holds => {}
        _ => w.jump(otherwise),
    }
}

//! Reads the conditions of a formula off the states of a run.

use super::monitor::Monitor;
use super::signal::{Cut, Moment};
use crate::ir::Formula;
use crate::stochastic::condition::Condition;
use crate::stochastic::constants::MOST_CHANGES;
use crate::stochastic::failure::Failure;
use crate::stochastic::race::Race;

/// Decides a formula along one run.
pub(in crate::stochastic) struct Watch<'a> {
    formula: &'a Formula,
    monitor: Monitor,
    /// The number of states that were seen.
    states: u64,
    /// The moves until the last one.
    moves: u64,
    /// Which conditions hold at a moment, and in the interval behind it.
    now: Vec<bool>,
    behind: Vec<bool>,
}

impl Watch<'_> {
    pub(in crate::stochastic) fn new(formula: &Formula) -> Watch<'_> {
        Watch {
            formula,
            monitor: Monitor::new(&formula.root, formula.atoms.len()),
            states: 0,
            moves: 0,
            now: vec![false; formula.atoms.len()],
            behind: vec![false; formula.atoms.len()],
        }
    }

    /// The next state, and the delay that follows it: whether the formula holds and after which
    /// time, if that is decided.
    pub(in crate::stochastic) fn state(
        &mut self,
        race: &mut Race<'_>,
        delay: f64,
    ) -> Result<Option<(bool, f64)>, Failure> {
        if race.moves > self.moves {
            self.monitor.moves();
            self.moves = race.moves;
        }
        self.states += 1;
        let end = Moment::new(race.time + delay);
        // Another state follows at the same moment.
        let last = Cut {
            moment: end,
            order: self.states,
        };
        let mut ahead = 0.0;
        for _ in 0..MOST_CHANGES {
            let horizon = self.look(race, ahead, delay)?;
            let moment = Moment::new(race.time + ahead);
            if moment >= end {
                self.monitor.conditions(last, &self.now);
                return Ok(self.decided(ahead));
            }
            self.monitor.conditions(Cut::after(moment), &self.now);
            if let Some(decided) = self.decided(ahead) {
                return Ok(Some(decided));
            }
            let next = (ahead + horizon).min(delay);
            if next.is_infinite() {
                self.monitor.conditions(Cut::END, &self.behind);
                return Ok(Some((self.monitor.finish(), ahead)));
            }
            let until = Moment::new(race.time + next);
            self.monitor.conditions(Cut::before(until), &self.behind);
            if let Some(decided) = self.decided(next) {
                return Ok(Some(decided));
            }
            ahead = next;
        }
        Ok(None)
    }

    /// The run is over: whether the formula holds.
    pub(in crate::stochastic) fn finish(&mut self) -> bool {
        self.monitor.finish()
    }

    fn decided(&mut self, ahead: f64) -> Option<(bool, f64)> {
        self.monitor.decided().map(|holds| (holds, ahead))
    }

    /// Looks at all conditions; for how long those behind the moment stay as they are, at least.
    fn look(&mut self, race: &mut Race<'_>, ahead: f64, delay: f64) -> Result<f64, Failure> {
        let mut horizon = f64::INFINITY;
        for (number, condition) in self.formula.atoms.iter().enumerate() {
            let mask = race.mask(Condition::of(condition), ahead, delay)?;
            self.now[number] = mask.now;
            self.behind[number] = mask.behind;
            horizon = horizon.min(mask.horizon);
        }
        Ok(horizon)
    }
}

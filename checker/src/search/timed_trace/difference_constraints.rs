//! Times of the events of a run, from bounds on their distances or on the durations of waits; what
//! alternatives there are, and which of them is tried, [`super::schedule`] says.
//!
//! Invariant: without bounds on durations times are the least that satisfy all bounds so far, or
//! the bounds contradict each other.

use std::collections::VecDeque;

use super::simplex::{Durations, LinearBound, TooHard};

/// Least times and bounds: an integer and a count of infinitesimals.
pub(super) type Time = (i64, i64);

/// `times[later] >= times[earlier] + apart`
#[derive(Clone, Copy, Debug)]
pub(super) struct Distance {
    pub(super) earlier: usize,
    pub(super) later: usize,
    pub(super) apart: Time,
}

/// A bound on times or durations.
#[derive(Clone, Debug)]
pub(super) enum Limit {
    Apart(Distance),
    Linear(LinearBound),
}

/// Ways to satisfy something: all bounds of one of them must hold.
pub(super) type Alternatives = Vec<Vec<Limit>>;

/// Finds times: the least, from distances alone, or any, from bounds on durations.
#[derive(Debug)]
pub(super) enum Solver {
    Times(Times),
    Durations(Durations),
}

impl Solver {
    /// Adds an event after a wait; events count from 1, since the start is one.
    pub(super) fn add_event(&mut self) -> usize {
        match self {
            Solver::Times(times) => times.add(),
            Solver::Durations(durations) => durations.add_wait() + 1,
        }
    }

    pub(super) fn mark(&self) -> Mark {
        match self {
            Solver::Times(times) => times.mark(),
            Solver::Durations(durations) => Mark {
                distances: durations.mark(),
                changes: 0,
            },
        }
    }

    pub(super) fn undo(&mut self, mark: Mark) -> Result<(), TooHard> {
        match self {
            Solver::Times(times) => {
                times.undo(mark);
                Ok(())
            }
            Solver::Durations(durations) => durations.undo(mark.distances),
        }
    }

    /// Adds a bound; returns false if it contradicts the others.
    pub(super) fn require(&mut self, limit: &Limit) -> Result<bool, TooHard> {
        match (self, limit) {
            (Solver::Times(times), Limit::Apart(distance)) => Ok(times.require(*distance)),
            (Solver::Durations(durations), limit) => durations.require(&linear(limit)),
            (Solver::Times(_), Limit::Linear(_)) => Err(TooHard),
        }
    }

    pub(super) fn require_all(&mut self, limits: &[Limit]) -> Result<bool, TooHard> {
        for limit in limits {
            if !self.require(limit)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether the current times satisfy all.
    pub(super) fn are_met(&self, limits: &[Limit]) -> Result<bool, TooHard> {
        for limit in limits {
            let is_met = match (self, limit) {
                (Solver::Times(times), Limit::Apart(distance)) => times.is_met(*distance),
                (Solver::Durations(durations), limit) => durations.is_met(&linear(limit))?,
                (Solver::Times(_), Limit::Linear(_)) => return Err(TooHard),
            };
            if !is_met {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The times of the events in ticks, and the number of ticks in a unit. They satisfy the
    /// requirements, and those alternatives that the current times satisfy.
    pub(super) fn in_ticks(
        &self,
        alternatives: &[Alternatives],
    ) -> Result<(Vec<i64>, i64), TooHard> {
        match self {
            Solver::Times(Times { least, .. }) => {
                let greatest = least.iter().map(|time| time.1).max().unwrap_or(0);
                let ticks_per_unit = greatest + 1;
                let ticks = least.iter().map(|time| time.0 * ticks_per_unit + time.1);
                Ok((ticks.collect(), ticks_per_unit))
            }
            Solver::Durations(durations) => {
                let mut met = Vec::new();
                for way in alternatives.iter().flatten() {
                    if self.are_met(way)? {
                        met.extend(way.iter().map(linear));
                    }
                }
                let (waits, ticks_per_unit) = durations.in_ticks(&met)?;
                let mut times = vec![0];
                for wait in waits {
                    let before = times.last().copied().unwrap_or(0);
                    times.push(wait.checked_add(before).ok_or(TooHard)?);
                }
                Ok((times, ticks_per_unit))
            }
        }
    }
}

/// A bound on times as one on durations: the wait with this number leads from the event with this
/// number to the next.
pub(super) fn linear(limit: &Limit) -> LinearBound {
    match limit {
        Limit::Linear(bound) => bound.clone(),
        Limit::Apart(Distance {
            earlier,
            later,
            apart,
        }) => LinearBound {
            plus: (*earlier..*later).collect(),
            minus: (*later..*earlier).collect(),
            least: *apart,
        },
    }
}

/// Where to go back to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    distances: usize,
    changes: usize,
}

/// Least times under distances, with a way back.
#[derive(Debug)]
pub(super) struct Times {
    least: Vec<Time>,
    /// By event: the distances from it to later ones.
    from: Vec<Vec<(usize, Time)>>,
    /// The events that distances were added to, in order.
    added: Vec<usize>,
    /// The changes of least times, in order: event and old time.
    changes: Vec<(usize, Time)>,
    queue: VecDeque<usize>,
}

impl Times {
    /// One event, at time 0.
    pub(super) fn new() -> Times {
        let mut times = Times {
            least: Vec::new(),
            from: Vec::new(),
            added: Vec::new(),
            changes: Vec::new(),
            queue: VecDeque::new(),
        };
        times.add();
        times
    }

    /// Adds an event.
    fn add(&mut self) -> usize {
        self.least.push((0, 0));
        self.from.push(Vec::new());
        self.least.len() - 1
    }

    pub(super) fn mark(&self) -> Mark {
        Mark {
            distances: self.added.len(),
            changes: self.changes.len(),
        }
    }

    pub(super) fn undo(&mut self, mark: Mark) {
        for event in self.added.drain(mark.distances..).rev() {
            self.from[event].pop();
        }
        for (event, time) in self.changes.drain(mark.changes..).rev() {
            self.least[event] = time;
        }
    }

    pub(super) fn is_met(&self, one: Distance) -> bool {
        self.least[one.later] >= sum(self.least[one.earlier], one.apart)
    }

    /// Adds a distance and moves the events after it; returns false if it contradicts the others,
    /// and then the times mean nothing.
    pub(super) fn require(&mut self, one: Distance) -> bool {
        if one.earlier == one.later {
            return one.apart <= (0, 0);
        }
        self.from[one.earlier].push((one.later, one.apart));
        self.added.push(one.earlier);
        if !self.raise(one.later, sum(self.least[one.earlier], one.apart)) {
            return true;
        }
        self.queue.clear();
        self.queue.push_back(one.later);
        while let Some(event) = self.queue.pop_front() {
            // The start never moves; and what moves because of the event that the new distance
            // begins at moves for ever.
            if event == 0 || event == one.earlier {
                return false;
            }
            for index in 0..self.from[event].len() {
                let (later, distance) = self.from[event][index];
                if self.raise(later, sum(self.least[event], distance)) {
                    self.queue.push_back(later);
                }
            }
        }
        true
    }

    /// Moves an event to a time if it is earlier; returns whether it was.
    fn raise(&mut self, event: usize, time: Time) -> bool {
        let old = self.least[event];
        if old >= time {
            return false;
        }
        self.changes.push((event, old));
        self.least[event] = time;
        true
    }
}

pub(super) fn sum(one: Time, other: Time) -> Time {
    (one.0 + other.0, one.1 + other.1)
}

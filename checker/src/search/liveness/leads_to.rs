//! `p --> q`: does q come after every p?
//!
//! The answer is no exactly if some reachable state satisfies p and starts a run that never meets
//! q. So at each reachable state that satisfies p in some part where q does not hold, the search
//! looks for a run inside `not q` that begins there ([`super::emptiness`]). These searches share
//! what they learn.

use crate::ir::Predicate;
use crate::network::{Extent, Failure, Symbolic};
use crate::zones::Zone;

use super::delay_inside::Entry;
use super::emptiness::{EndlessRun, Liveness};
use crate::search::limits::Counters;
use crate::search::outcome::{Outcome, Trace};
use crate::search::reachability::goal::{Goal, Look, Visited};

/// Looks for a state from which q may never come.
pub struct Unanswered<'p> {
    /// p and not q.
    open: &'p Predicate,
    liveness: Liveness<'p>,
    is_doubtful: bool,
    /// The run that never meets q, from the state that was found.
    pub run: Option<EndlessRun>,
    /// The path from the current state to a failure below it.
    pub failed: Option<Trace>,
}

impl<'p> Unanswered<'p> {
    /// `open` is "p and not q", `keep` is "not q".
    pub fn new(
        symbolic: &Symbolic<'_>,
        open: &'p Predicate,
        keep: &'p Predicate,
    ) -> Unanswered<'p> {
        Unanswered {
            open,
            liveness: Liveness::new(symbolic, keep),
            is_doubtful: false,
            run: None,
            failed: None,
        }
    }

    /// Whether a doubt was counted as a run; see [`Liveness::is_coarse`], and whether the run is
    /// one only if time runs in an open part of a barrier where it begins.
    pub fn is_coarse(&self) -> bool {
        self.is_doubtful || self.liveness.is_coarse()
    }
}

impl Goal for Unanswered<'_> {
    fn look(&mut self, visited: Visited<'_, '_>) -> Result<Look, Failure> {
        let Visited {
            symbolic,
            words,
            zone,
            counters,
            watch,
        } = visited;
        let zones = match symbolic.extent(self.open, words, zone.bounds())? {
            Extent::Nowhere => return Ok(Look::Continue),
            Extent::Everywhere => vec![zone.clone()],
            Extent::Part(part) => part.to_zones().collect(),
        };
        for zone_on_entry in zones {
            // For a valuation in an open part, the zone does not say whether time runs in it.
            let is_open = symbolic.has_barriers() && {
                let barriers = symbolic.barriers(words, zone_on_entry.bounds())?;
                !barriers.open.is_empty()
            };
            for is_running in [false, true].into_iter().take(1 + usize::from(is_open)) {
                let entry = Entry {
                    zone: &zone_on_entry,
                    is_running,
                };
                let outcome = self
                    .liveness
                    .from_entry(symbolic, words, entry, counters, watch);
                match outcome {
                    Ok(Outcome::Exhausted) => {}
                    Ok(Outcome::Found(run)) => {
                        self.run = Some(run);
                        self.is_doubtful = is_running;
                        return Ok(Look::Found);
                    }
                    Ok(Outcome::Stopped(reason)) => return Ok(Look::Stopped(reason)),
                    Err((failure, trace)) => {
                        self.failed = Some(trace);
                        return Err(failure);
                    }
                }
            }
        }
        Ok(Look::Continue)
    }

    fn confirms(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        Ok(symbolic
            .extent(self.open, words, zone.bounds())?
            .is_somewhere())
    }

    fn counters(&self) -> Counters {
        self.liveness.counters()
    }
}

/// Joins the path to a state with a run from it: one trace, and the index of the run's first state
/// in it.
pub fn joined(mut way: Trace, run: Trace) -> (Trace, usize) {
    let mut states = run.states.into_iter();
    let start = way.states.len().saturating_sub(1);
    if let (Some(last), Some(first)) = (way.states.last_mut(), states.next()) {
        *last = first;
    }
    way.states.extend(states);
    way.moves.extend(run.moves);
    (way, start)
}

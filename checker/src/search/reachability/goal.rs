//! What a search looks for.

use crate::ir::Predicate;
use crate::network::{Failure, Symbolic};
use crate::zones::{Federation, Zone};

use crate::search::limits::{Counters, StopReason, Watch};

/// A state that a search has reached, before extrapolation.
pub struct Visited<'v, 'a> {
    /// Zones of the network.
    pub symbolic: &'v mut Symbolic<'a>,
    /// The words of the state.
    pub words: &'v mut [i32],
    /// Its zone.
    pub zone: &'v Zone,
    /// What the search has done until now.
    pub counters: Counters,
    /// Says whether to continue, if looking at the state takes long.
    pub watch: &'v mut dyn Watch,
}

/// The result of looking at a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// The search continues.
    Continue,
    /// This is what was looked for.
    Found,
    /// A limit came first.
    Stopped(StopReason),
}

/// Looks at every state that a search reaches.
pub trait Goal {
    /// Looks at a state; by default the search ends where [`Goal::confirms`] says so.
    fn look(&mut self, visited: Visited<'_, '_>) -> Result<Look, Failure> {
        let Visited {
            symbolic,
            words,
            zone,
            ..
        } = visited;
        let holds = self.confirms(symbolic, words, zone)?;
        Ok(if holds { Look::Found } else { Look::Continue })
    }

    /// Whether a state in which the search ended, computed again without extrapolation, is what was
    /// looked for.
    fn confirms(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure>;

    /// Whether the result depends on zones; otherwise the goal may be given any zone.
    fn depends_on_zones(&self) -> bool {
        true
    }

    /// The cost of looking at states, in addition to the search itself.
    fn counters(&self) -> Counters {
        Counters::default()
    }
}

/// A goal that several threads look for, each with its own copy. Looking at a state is so fast that
/// the limits need not be checked meanwhile.
pub trait SharedGoal: Goal + Send + Sized {
    /// A copy that has seen nothing.
    #[must_use]
    fn fork(&self) -> Self;

    /// Takes over what a copy has seen.
    fn join(&mut self, other: Self);
}

/// A goal that is a set of states.
pub trait Target: Goal {
    /// The valuations of a zone of a state with these words that are in the set.
    fn part(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<Federation, Failure>;
}

/// The search looks for a predicate: some valuation of the zone must satisfy it.
impl Goal for &Predicate {
    fn confirms(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        symbolic.holds_somewhere(self, words, zone.bounds())
    }

    fn depends_on_zones(&self) -> bool {
        !self.is_of_words()
    }
}

impl Target for &Predicate {
    fn part(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<Federation, Failure> {
        symbolic.part(self, words, zone)
    }
}

impl SharedGoal for &Predicate {
    fn fork(&self) -> Self {
        self
    }

    fn join(&mut self, _: Self) {}
}

//! What a query is about, and the zones that are sound for it.

use std::sync::Arc;

use crate::analysis::{Abstraction, ClockBounds, LiveVariables};
use crate::exec::Executor;
use crate::game::Priorities;
use crate::game::strategy::attractor::Under;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::ir::{ClockAtom, FunctionId, Network, Predicate};
use crate::network::symbolic::predicate;
use crate::network::{Restriction, Stepper, Symbolic, Symmetry};

use crate::engine::options::Options;
use crate::tuning::Tuning;

/// What a query is about.
#[derive(Clone, Copy)]
pub(crate) struct Subject<'a> {
    pub(crate) network: &'a Network,
    pub(crate) executor: &'a dyn Executor,
    /// The strategy that the controller follows.
    pub(crate) under: Option<&'a ClosedLoop>,
    /// The same for games, whose strategies are within it.
    pub(crate) within: Option<&'a Arc<Under>>,
    /// Whether priorities count under the strategy.
    pub(crate) priorities: Priorities,
    /// Which heuristics are used.
    pub(crate) tuning: Tuning,
}

impl<'a> Subject<'a> {
    /// The comparisons of the strategy.
    pub(super) fn atoms(&self) -> &'a [ClockAtom] {
        self.under.map_or(&[], Restriction::atoms)
    }
}

/// The variables that a search whose question reads words by `functions` may forget where they are
/// not live. What a strategy allows hangs on all of them.
pub(super) fn live_variables(
    subject: Subject<'_>,
    functions: impl IntoIterator<Item = FunctionId>,
    options: &Options,
    symmetry: Option<&Arc<Symmetry>>,
) -> Option<Arc<LiveVariables>> {
    if !options.reductions.live_variables || subject.under.is_some() {
        return None;
    }
    // An initial value is the same member for all, so that states would no longer be each other's
    // images.
    let keeps_scalars = symmetry.is_some();
    LiveVariables::new(subject.network, functions, keeps_scalars).map(Arc::new)
}

/// Whether the network or a query compares two clocks.
pub(crate) fn has_differences(network: &Network, atoms: &[ClockAtom]) -> bool {
    network.features.diagonals || atoms.iter().any(ClockAtom::is_difference)
}

/// Zones for searches, with an abstraction that is sound for the network and these predicates, and
/// keeps what further comparisons tell.
pub(crate) fn symbolic<'a>(
    subject: Subject<'a>,
    predicates: &[&Predicate],
    further: &[ClockAtom],
    wanted: Abstraction,
) -> Symbolic<'a> {
    let Subject {
        network,
        executor,
        under,
        priorities,
        tuning,
        ..
    } = subject;
    let mut atoms: Vec<ClockAtom> = predicates
        .iter()
        .flat_map(|one| predicate::atoms(one))
        .chain(further.iter().cloned())
        .chain(subject.atoms().iter().cloned())
        .collect();
    let mut needs_maximum = predicates.iter().any(|one| predicate::has_deadlock(one));
    if predicate::depends_on_negations(network) {
        if further.is_empty() {
            needs_maximum = true;
        } else {
            // What is measured is to be kept from one side only.
            atoms.extend(predicate::negated_atoms(network));
        }
    }
    let abstraction = if has_differences(network, &atoms) {
        Abstraction::Differences
    } else if needs_maximum {
        Abstraction::Maximum
    } else {
        wanted
    };
    let bounds = ClockBounds::new(network, &atoms, abstraction, tuning);
    let symbolic = Symbolic::new(Stepper::tuned(network, executor, tuning), bounds)
        .restricted(under.map(|one| one as &dyn Restriction));
    if under.is_some() && priorities == Priorities::Ignored {
        symbolic.without_priorities()
    } else {
        symbolic
    }
}

/// Zones that may be too large for what is asked, where those of [`symbolic`] would be many more:
/// nothing that these zones do not have is there, but what they have may not be. `None` if there
/// are none but those of [`symbolic`].
pub(super) fn coarser<'a>(subject: Subject<'a>, predicates: &[&Predicate]) -> Option<Symbolic<'a>> {
    if !subject.tuning.coarser_first || predicate::depends_on_negations(subject.network) {
        return None;
    }
    let atoms: Vec<ClockAtom> = predicates
        .iter()
        .flat_map(|one| predicate::atoms(one))
        .collect();
    let all: Vec<ClockAtom> = [&atoms, subject.atoms()]
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    if has_differences(subject.network, &all) {
        return None;
    }
    // What simulates a valuation may have more moves: a deadlock could be left out for a state that
    // has none.
    Some(symbolic(subject, &[], &atoms, Abstraction::LowerUpper).comparing_as_sets())
}

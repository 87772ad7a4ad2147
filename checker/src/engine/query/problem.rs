//! What a query is about, and the zones that are sound for it.

use std::sync::Arc;

use crate::analysis::{Abstraction, ClockBounds, LiveVariables};
use crate::exec::Executor;
use crate::game::Priorities;
use crate::game::strategy::Under;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::strategy::freedom::Freedom;
use crate::ir::{ClockAtom, FunctionId, Network, Predicate};
use crate::network::symbolic::predicate;
use crate::network::{Restriction, Stepper, Symbolic, Symmetry};

use crate::engine::options::Options;

/// What a query is about.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub(crate) network: &'a Network,
    pub(crate) executor: &'a dyn Executor,
    /// The strategy that the controller follows.
    pub(crate) under: Option<Followed<'a>>,
    /// The options for the answer.
    pub(crate) options: &'a Options,
    /// Where a game is explored first: where the value of this function is least.
    pub(crate) guide: Option<FunctionId>,
    /// Of a game that the controller wins: how much its strategy leaves to choose. `None` is one
    /// move a state, or what is usual for the objective.
    pub(crate) freedom: Option<Freedom>,
}

/// A strategy that the controller follows.
#[derive(Clone, Copy)]
pub(crate) struct Followed<'a> {
    /// The moves that it allows.
    pub(crate) moves: &'a ClosedLoop,
    /// The strategy itself, with its query.
    pub(crate) strategy: &'a Arc<Under>,
}

impl<'a> Problem<'a> {
    /// The comparisons of the strategy.
    pub(super) fn atoms(&self) -> &'a [ClockAtom] {
        self.under.map_or(&[], |under| under.moves.atoms())
    }
}

/// The variables that a search whose question reads words by `functions` may forget where they are
/// not live. What a strategy allows depends on all of them.
pub(super) fn live_variables(
    problem: Problem<'_>,
    functions: impl IntoIterator<Item = FunctionId>,
    symmetry: Option<&Arc<Symmetry>>,
) -> Option<Arc<LiveVariables>> {
    if !problem.options.reductions.live_variables || problem.under.is_some() {
        return None;
    }
    forgotten(problem.network, functions, symmetry.map(Arc::as_ref)).map(Arc::new)
}

/// The same, if nothing keeps the search from forgetting.
pub(crate) fn forgotten(
    network: &Network,
    functions: impl IntoIterator<Item = FunctionId>,
    symmetry: Option<&Symmetry>,
) -> Option<LiveVariables> {
    // An initial value is the same member for all, so that states would no longer be each other's
    // images.
    let keeps_scalars = symmetry.is_some();
    LiveVariables::new(network, functions, keeps_scalars)
}

/// Whether the network or a query compares two clocks.
pub(crate) fn has_differences(network: &Network, atoms: &[ClockAtom]) -> bool {
    network.features.diagonals || atoms.iter().any(ClockAtom::is_difference)
}

/// The abstraction that is sound for the network and these comparisons in any case.
pub(crate) fn safe_abstraction(network: &Network, atoms: &[ClockAtom]) -> Abstraction {
    if has_differences(network, atoms) {
        Abstraction::Differences
    } else {
        Abstraction::Maximum
    }
}

/// Zones for searches, with an abstraction that is sound for the network and these predicates, and
/// keeps what further comparisons tell.
pub(crate) fn symbolic<'a>(
    problem: Problem<'a>,
    predicates: &[&Predicate],
    further: &[ClockAtom],
    wanted: Abstraction,
) -> Symbolic<'a> {
    let Problem {
        network,
        executor,
        under,
        options,
        guide: _,
        freedom: _,
    } = problem;
    let mut atoms = atoms_of(predicates);
    atoms.extend(further.iter().chain(problem.atoms()).cloned());
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
    let bounds = ClockBounds::new(network, &atoms, abstraction, options.tuning);
    let symbolic = Symbolic::new(Stepper::tuned(network, executor, options.tuning), bounds)
        .restricted(under.map(|under| under.moves as &dyn Restriction));
    if under.is_some() && options.priorities == Priorities::Ignored {
        symbolic.without_priorities()
    } else {
        symbolic
    }
}

/// Whether there are zones coarser than those of [`symbolic`] that show that there is nothing.
pub(super) fn can_be_coarse(problem: Problem<'_>, predicates: &[&Predicate]) -> bool {
    if !problem.options.tuning.coarser_first || predicate::depends_on_negations(problem.network) {
        return false;
    }
    let mut atoms = atoms_of(predicates);
    atoms.extend(problem.atoms().iter().cloned());
    !has_differences(problem.network, &atoms)
}

/// Zones that may be too large for what is asked, where those of [`symbolic`] would be many more:
/// nothing that these zones do not have is there, but what they have may not be. They are sound
/// where [`can_be_coarse`] says so.
pub(super) fn coarse<'a>(problem: Problem<'a>, predicates: &[&Predicate]) -> Symbolic<'a> {
    let atoms = atoms_of(predicates);
    // What simulates a valuation may have more moves: a deadlock could be left out for a state that
    // has none.
    symbolic(problem, &[], &atoms, Abstraction::LowerUpper).comparing_as_sets()
}

/// The comparisons of clocks in these predicates.
fn atoms_of(predicates: &[&Predicate]) -> Vec<ClockAtom> {
    let atoms = predicates.iter().flat_map(|one| predicate::atoms(one));
    atoms.collect()
}

//! What all games share: their zones, the comparisons that these keep, and the check of strategies.

use crate::analysis::{Abstraction, ClockBounds};
use crate::game::Priorities;
use crate::game::strategy::Strategy;
use crate::ir::{ClockAtom, Network, Objective};
use crate::network::symbolic::predicate;
use crate::network::{Restriction, Stepper, Symbolic};
use crate::search::limits::{Counters, Watch};
use crate::verify::Effort;

use super::subject::Subject;
use crate::engine::answer::Verification;
use crate::engine::evidence::strategy_check::{self, Asked, Played};
use crate::engine::options::Options;

/// What is said of a game whose model has priorities.
pub(super) const IGNORED_PRIORITIES: &str =
    "games ignore the priorities of the model, unless they are told to keep them";

/// The zones of games: with the priorities of the network, if they are to count, and within the
/// strategy that the game is played under.
pub(super) fn zones_of<'a>(
    subject: Subject<'a>,
    atoms: &[ClockAtom],
    abstraction: Abstraction,
) -> Symbolic<'a> {
    let tuning = subject.options.tuning;
    let bounds = ClockBounds::new(subject.network, atoms, abstraction, tuning);
    let stepper = Stepper::tuned(subject.network, subject.executor, tuning);
    let symbolic = Symbolic::new(stepper, bounds);
    let symbolic = match subject.options.priorities {
        Priorities::Kept => symbolic,
        Priorities::Ignored => symbolic.without_priorities(),
    };
    let followed = subject.under.map(|under| under.moves as &dyn Restriction);
    symbolic.restricted(followed)
}

/// Whether the game may be played in discrete states with all that invariants allow: if it does not
/// matter what is reached, and if neither clocks that stop, nor priorities, nor clock guards on
/// urgent channels make it depend on more than the state.
pub(super) fn can_be_discrete(network: &Network, is_cooperative: bool, options: &Options) -> bool {
    let has_priorities = network.features.priorities && options.priorities == Priorities::Kept;
    let is_urgent = network.features.clock_guarded_urgent;
    let depends_on_more = network.features.stopwatches || has_priorities || is_urgent;
    options.tuning.discrete_nodes && options.plans.is_none() && !is_cooperative && !depends_on_more
}

/// The clock comparisons of an objective.
pub(super) fn objective_atoms(objective: &Objective) -> Vec<ClockAtom> {
    let (one, other) = match objective {
        Objective::Reach(goal) => (goal, None),
        Objective::Safe(keep) => (keep, None),
        Objective::Until(keep, goal)
        | Objective::WeakUntil(keep, goal)
        | Objective::Buchi(keep, goal) => (keep, Some(goal)),
    };
    let both = std::iter::once(one).chain(other);
    both.flat_map(predicate::atoms).collect()
}

/// Checks a strategy in closed loop, until the watch wants it to end.
pub(super) fn verified(
    subject: Subject<'_>,
    asked: Asked<'_>,
    strategy: &Strategy,
    watch: &mut dyn Watch,
) -> Verification {
    let mut ends = || watch.look(&Counters::default()).is_some();
    let decisions = strategy_check::decisions(subject.network, strategy);
    let played = Played::new(strategy, &decisions);
    let effort = &mut effort_of(subject.options).unless(&mut ends);
    let rules = subject.options.rules();
    strategy_check::verify(subject.network, asked, played, rules, effort)
}

/// The effort that a check may take.
pub(super) fn effort_of<'a>(options: &Options) -> Effort<'a> {
    Effort::up_to(
        options
            .limits
            .states
            .unwrap_or(strategy_check::MOST_REGIONS),
    )
}

//! What all games share: their zones, the comparisons that these keep, and the check of strategies.

use crate::analysis::{Abstraction, ClockBounds};
use crate::cancellation::{self, Cut};
use crate::game::Priorities;
use crate::game::strategy::Strategy;
use crate::ir::{ClockAtom, Control, Network, Objective};
use crate::network::symbolic::predicate;
use crate::network::{Restriction, Stepper, Symbolic};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::verify::strategy::{Coverage, Outcome};
use crate::verify::{Effort, GivenUp};

use super::problem::Problem;
use crate::engine::answer::{Answer, Verification, Wanted};
use crate::engine::evidence::strategy_check::{self, Played};
use crate::engine::options::Options;

/// What is said of a game whose model has priorities.
pub(super) const IGNORED_PRIORITIES: &str =
    "games ignore the priorities of the model, unless they are told to keep them";

/// The zones of games: with the priorities of the network, if they are to count, and within the
/// strategy that the game is played under.
pub(super) fn zones_of<'a>(
    problem: Problem<'a>,
    atoms: &[ClockAtom],
    abstraction: Abstraction,
) -> Symbolic<'a> {
    let tuning = problem.options.tuning;
    let bounds = ClockBounds::new(problem.network, atoms, abstraction, tuning);
    let stepper = Stepper::tuned(problem.network, problem.executor, tuning);
    let symbolic = Symbolic::new(stepper, bounds);
    let symbolic = match problem.options.priorities {
        Priorities::Kept => symbolic,
        Priorities::Ignored => symbolic.without_priorities(),
    };
    let followed = problem.under.map(|under| under.moves as &dyn Restriction);
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
    objective.predicates().flat_map(predicate::atoms).collect()
}

/// Checks a strategy in closed loop, and adds how that ended.
pub(super) fn add_check(
    answer: &mut Answer,
    problem: Problem<'_>,
    control: &Control,
    strategy: &Strategy,
    watch: &mut dyn Watch,
) {
    add_check_by(answer, problem.options, watch, |effort| {
        let decisions = strategy_check::decisions(problem.network, strategy);
        let played = Played::new(strategy, &decisions);
        let rules = problem.options.rules();
        strategy_check::verify(problem.network, control, played, rules, effort)
    });
}

/// Adds how a check ends that the watch may end between regions, and limits inside them.
pub(super) fn add_check_by(
    answer: &mut Answer,
    options: &Options,
    watch: &mut dyn Watch,
    check: impl FnOnce(&mut Effort<'_>) -> Verification,
) {
    let mut ends = || watch.look(&Counters::default()).is_some();
    let effort = &mut effort_of(options).unless(&mut ends);
    let result = cancellation::unless_cut(|| check(effort));
    let result =
        result.unwrap_or_else(|Cut| Ok(Outcome::GivenUp(GivenUp::Ended, Coverage::default())));
    if let Ok(Outcome::GivenUp(why, _)) = &result {
        let reason = match why {
            GivenUp::TooLarge => StopReason::States,
            GivenUp::Ended => watch
                .look(&Counters::default())
                .unwrap_or(StopReason::Interrupted),
        };
        answer.lacks(Wanted::Check, reason);
    }
    answer.evidence.verification = Some(result);
}

/// The effort that a check may take.
fn effort_of<'a>(options: &Options) -> Effort<'a> {
    Effort::up_to(options.limits.states.unwrap_or(strategy_check::MOST_PARTS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::answer::{Stopped, Verdict};
    use crate::ir::Network;

    /// Wants work to end for this reason.
    struct Ends(Option<StopReason>);

    impl Watch for Ends {
        fn look(&mut self, _: &Counters) -> Option<StopReason> {
            self.0
        }
    }

    /// The check ends in this way; the verdict stays, and the answer says what was wanted.
    fn check_ends(
        reason: Option<StopReason>,
        check: impl FnOnce(&mut Effort<'_>) -> Verification,
        stop: StopReason,
        said: &str,
    ) {
        let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
        add_check_by(&mut answer, &Options::default(), &mut Ends(reason), check);
        assert_eq!(answer.verdict, Verdict::Satisfied);
        let what = Wanted::Check;
        let stopped = [Stopped { what, reason: stop }];
        assert_eq!(answer.evidence.stopped, stopped);
        assert_eq!(answer.evidence.is_verified(), None);
        let result = answer.evidence.verification.expect("there was a check");
        let lines = strategy_check::describe(&Network::default(), &result, Some(stop));
        assert!(lines[0].contains(said), "{lines:?}");
    }

    #[test]
    fn a_check_that_is_ended_leaves_the_verdict() {
        let ended = || Ok(Outcome::GivenUp(GivenUp::Ended, Coverage::default()));
        let time = "it was found, and checking it was stopped by the time limit";
        let memory = "it was found, and checking it was stopped by the memory limit";
        check_ends(Some(StopReason::Time), |_| ended(), StopReason::Time, time);
        check_ends(
            Some(StopReason::Memory),
            |_| cancellation::cut(),
            StopReason::Memory,
            memory,
        );
        let large = Outcome::GivenUp(GivenUp::TooLarge, Coverage::default());
        check_ends(None, |_| Ok(large), StopReason::States, "--states");
    }
}

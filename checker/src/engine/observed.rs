//! Games under partial observation: who wins, and how.

use crate::exec::Executor;
use crate::game::Priorities;
use crate::game::observed::{Answer as GameAnswer, Question, Solver};
use crate::ir::{ClockAtom, Network, Objective, Predicate};
use crate::network::{Abstraction, ClockBounds, predicate};
use crate::search::limits::Counters;

use super::Options;
use super::answer::{Answer, Evidence, Verdict, has_differences, new_answer};
use super::games::{objective_atoms, zones_of};
use super::limits::LimitWatch;

/// Answers a game query with observations.
pub(super) fn game(
    network: &Network,
    executor: &dyn Executor,
    (objective, observations): (&Objective, &[Predicate]),
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let observed = observations.iter().flat_map(predicate::atoms);
    let atoms: Vec<ClockAtom> = objective_atoms(objective)
        .into_iter()
        .chain(observed)
        .collect();
    let abstraction = if has_differences(network, &atoms) {
        Abstraction::Differences
    } else {
        Abstraction::Maximum
    };
    let bounds = ClockBounds::new(network, &atoms, abstraction);
    let mut symbolic = zones_of(network, executor, bounds, options);
    let (goal, keep, must_reach) = match objective {
        Objective::Reach(goal) => (Some(goal), None, true),
        Objective::Until(keep, goal) => (Some(goal), Some(keep), true),
        Objective::Safe(keep) => (None, Some(keep), false),
        Objective::WeakUntil(keep, goal) | Objective::Buchi(keep, goal) => {
            (Some(goal), Some(keep), false)
        }
    };
    let question = Question {
        observations,
        goal,
        keep,
        must_reach,
        forced: options.forced,
    };
    let mut solver = Solver::new(&mut symbolic, question);
    let plain = |verdict, counters: Counters| new_answer(verdict, Evidence::default(), counters);
    let result = solver.solve(watch);
    let counters = solver.counters();
    let verdict = match result {
        Ok(GameAnswer::Won) => Verdict::Satisfied,
        Ok(GameAnswer::Lost) => Verdict::NotSatisfied,
        Ok(GameAnswer::Stopped(reason)) => Verdict::Unknown(reason),
        Err(failure) => Verdict::Error(failure),
    };
    let mut answer = plain(verdict, counters);
    if options.strategy || options.verify {
        let message = "a game with observations gives no strategy over states, since the controller does not see them";
        answer.message = Some(message.to_owned());
    }
    answer
}

/// Names what a model has that there is no algorithm for under partial observation.
pub(super) fn unsupported(network: &Network, priorities: Priorities) -> Option<&'static str> {
    let features = &network.features;
    if features.stopwatches {
        Some("stopwatches in a game with observations")
    } else if features.clock_guarded_urgent {
        Some("clock guards on edges of urgent channels in a game with observations")
    } else if features.guarded_receivers {
        Some("clock guards on the receivers of a broadcast in a game with observations")
    } else if features.priorities && priorities == Priorities::Kept {
        Some("priorities, which were asked to be kept, in a game with observations")
    } else if has_strict_lower_invariant(network) {
        Some("invariants with strict lower bounds in a game with observations")
    } else {
        None
    }
}

/// Whether some invariant says `x > c`: then an action that leads into its location has no first moment at which it is possible.
fn has_strict_lower_invariant(network: &Network) -> bool {
    let mut locations = network.processes.iter().flat_map(|one| &one.locations);
    locations.any(|location| {
        let mut atoms = location.invariant.atoms.iter();
        atoms.any(|atom| atom.strict && atom.left.first.0 == 0 && atom.left.count == 1)
    })
}

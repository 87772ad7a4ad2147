//! Games under partial observation: who wins, and how.

use std::sync::Arc;

use crate::game::partial_observation::{Outcome, Question, Solver};
use crate::game::strategy::Selection;
use crate::game::{Player, Priorities};
use crate::ir::{ClockAtom, Network, Objective, Predicate};
use crate::network::symbolic::predicate;
use crate::verify::Effort;
use crate::verify::observed::{self, MachineState};

use super::game_zones::{IGNORED_PRIORITIES, add_check_by, objective_atoms, zones_of};
use super::problem::{Problem, safe_abstraction};
use crate::engine::answer::{Answer, Verdict, Verification};
use crate::engine::evidence::strategy_check;
use crate::engine::format::machine_json;
use crate::engine::limits::LimitWatch;
use crate::engine::options::Rules;

/// Answers a game query with observations.
pub(super) fn game(
    problem: Problem<'_>,
    objective: &Objective,
    observations: &[Predicate],
    watch: &mut LimitWatch,
) -> Answer {
    let Problem {
        network, options, ..
    } = problem;
    let observed = observations.iter().flat_map(predicate::atoms);
    let atoms: Vec<ClockAtom> = objective_atoms(objective)
        .into_iter()
        .chain(observed)
        .collect();
    let abstraction = safe_abstraction(network, &atoms);
    let mut symbolic = zones_of(problem, &atoms, abstraction);
    let question = Question {
        observations,
        goal: objective.goal(),
        keep: objective.keep(),
        must_reach: matches!(objective, Objective::Reach(_) | Objective::Until(..)),
        forced: options.forced,
    };
    let ignores_priorities = symbolic.ignores_priorities();
    let mut solver = Solver::new(&mut symbolic, question);
    let result = solver.solve(watch);
    let counters = solver.counters();
    let verdict = match result {
        Ok(Outcome::Won) => Verdict::Satisfied,
        Ok(Outcome::Lost) => Verdict::NotSatisfied,
        Ok(Outcome::Stopped(reason)) => Verdict::Unknown(reason),
        Err(failure) => Verdict::Error(failure),
    };
    let mut answer = Answer::new(verdict, counters);
    if ignores_priorities {
        answer.message = Some(IGNORED_PRIORITIES.to_owned());
    }
    if options.plans.is_some() {
        let message = "a game with observations gives no plans: its strategy is a machine that goes by what it sees";
        answer.message = Some(message.to_owned());
    }
    if !(options.strategy || options.verify) {
        return answer;
    }
    match verdict {
        Verdict::Satisfied => {
            let machine = solver.machine();
            if options.verify {
                let machine = machine_json::to_check(&machine);
                let rules = options.rules();
                add_check_by(&mut answer, options, watch, |effort| {
                    verify(network, objective, observations, &machine, rules, effort)
                });
            }
            answer.evidence.machine = Some(Arc::new(machine));
        }
        Verdict::NotSatisfied => {
            let message = "where the controller does not see everything, no single strategy of the environment beats all of its machines, so none is given";
            answer.message = Some(message.to_owned());
        }
        _ => {}
    }
    answer
}

/// Checks in closed loop that a machine of the controller wins. The network must hold the code of
/// the query.
pub fn verify(
    network: &Network,
    objective: &Objective,
    observations: &[Predicate],
    machine: &[MachineState],
    rules: Rules,
    effort: &mut Effort<'_>,
) -> Verification {
    let (owner, selection) = (Player::Controller, Selection::First);
    let mut claim = strategy_check::claim(objective, owner, selection, rules);
    let (constant, has_differences) = strategy_check::constants(observations.iter());
    claim.constant = claim.constant.max(constant);
    claim.has_differences |= has_differences;
    observed::verify(network, machine, observations, &claim, effort)
}

/// Names what a model has that there is no algorithm for under partial observation.
pub(crate) fn unsupported(network: &Network, priorities: Priorities) -> Option<&'static str> {
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

/// Whether some invariant says `x > c`: then an action that leads into its location has no first
/// moment at which it is possible.
fn has_strict_lower_invariant(network: &Network) -> bool {
    let mut locations = network.locations();
    locations.any(|location| {
        location
            .invariant
            .atoms
            .iter()
            .any(ClockAtom::is_strict_lower)
    })
}

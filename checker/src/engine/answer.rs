//! Answers as values: the verdict, what backs it, and what it took.

use std::sync::Arc;

use super::evidence::witness::{Proof, Witness};
use super::limits::{LimitWatch, stop_text};
use crate::game::partial_observation::Machine;
use crate::game::strategy::Strategy;
use crate::game::strategy::plan_list::PlanList;
use crate::ir::{Observation, SiteId};
use crate::learning::{Comparison, LearnedStrategy, Mean};
use crate::network::Failure;
use crate::search::limits::{Counters, StopReason};
use crate::search::optimum::extremum::Extremes;
use crate::shield::{Facts, Shield};
use crate::stochastic::{Estimate, Simulated, ValuesOfRuns};
use crate::verify;
use crate::verify::certificate::States;
use crate::verify::strategy::Outcome as StrategyCheck;

/// What a query came out as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Satisfied,
    /// It does not.
    NotSatisfied,
    /// An over-approximation could not decide.
    Maybe,
    /// A limit came first.
    Unknown(StopReason),
    /// The model failed.
    Error(Failure),
}

/// What backs a verdict.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Witnesses, counterexamples, or the way to a failure: one, or one a value.
    pub witnesses: Vec<Witness>,
    /// The states that a search for such a state has reached, if there is none and they were
    /// wanted.
    pub certificate: Option<Certificate>,
    /// The strategy of the player who wins, if it was wanted.
    pub strategy: Option<Arc<Strategy>>,
    /// The strategy that was learned, or loaded as such a one.
    pub learned: Option<Arc<LearnedStrategy>>,
    /// The shield that was made, or loaded.
    pub shield: Option<Arc<Shield>>,
    /// The strategy of the controller in a game with observations, if it wins and it was wanted.
    pub machine: Option<Arc<Machine>>,
    /// How the check of the strategy ended, if it was wanted.
    pub verification: Option<Verification>,
    /// Plans, if they were wanted.
    pub plans: Option<Arc<PlanList>>,
    /// Whether there are more plans than were wanted, or may be: after the first plan the search
    /// may stop.
    pub has_more_plans: bool,
    /// What ended the list of plans, if a limit did.
    pub plans_stop: Option<StopReason>,
    /// What was wanted beside the verdict and is missing because a limit came before.
    pub stopped: Vec<Stopped>,
}

/// Work after the verdict that a limit or the user ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped {
    /// What is missing.
    pub what: Wanted,
    /// What ended the work.
    pub reason: StopReason,
}

/// What is made after the verdict where it is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The strategy of the player who wins.
    Strategy,
    /// The check of the strategy.
    Check,
    /// The certificate of a verdict that nothing is reached.
    Certificate,
}

impl Evidence {
    /// Leaves the last clock, which is none of the model, out of all runs.
    pub(crate) fn forget_last_clock(&mut self) {
        for witness in &mut self.witnesses {
            for (_, zone) in &mut witness.trace.states {
                *zone = zone.without_last_clock();
            }
            if let Some(Proof::Replayed(_, states, _)) = &mut witness.run {
                for state in states {
                    state.clocks.pop();
                }
            }
        }
    }

    /// Whether the strategy and all runs passed their independent checks; `None` if there was none,
    /// or one came to no end.
    pub fn is_verified(&self) -> Option<bool> {
        let strategy = self.verification.iter().map(holds);
        let runs = self.witnesses.iter().filter_map(|one| one.run.as_ref());
        let checks: Vec<Option<bool>> = strategy.chain(runs.map(Proof::holds)).collect();
        if checks.contains(&Some(false)) {
            return Some(false);
        }
        (!checks.is_empty() && !checks.contains(&None)).then_some(true)
    }
}

/// The values of the items of a query with `sup`, `inf` or `bounds`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Values {
    /// Whether the least values were asked for.
    pub least: bool,
    /// Whether the greatest values were asked for.
    pub greatest: bool,
    /// For each item.
    pub items: Vec<Extremes>,
}

/// What is known of a shield.
#[derive(Clone, Debug)]
pub struct Shielded {
    /// What its samples show.
    pub facts: Facts,
    /// How many moves the controller has.
    pub moves: u64,
    /// Of fresh runs under the shield: how many broke what it must keep.
    pub tried: Option<Estimate>,
}

/// How the best strategy was found.
#[derive(Clone, Debug)]
pub struct Optimised {
    /// How many runs learning took.
    pub runs: u64,
    /// How many iterations.
    pub iterations: u64,
    /// How many of them since all was forgotten the last time.
    pub iterations_in_last_reset: u64,
    /// How often all was forgotten.
    pub resets: u64,
    /// The value by the runs that chose this strategy among others; it is too good by a little.
    pub judged: Mean,
    /// What runs are worth in which all is chosen uniformly.
    pub uniform: Option<Estimate>,
    /// How the strategy compares with that.
    pub comparison: Option<Comparison>,
    /// Whether learning came to its end.
    pub is_complete: bool,
    /// What the strategy sees.
    pub observation: Arc<Observation>,
    /// How many leaves its trees have.
    pub leaves: u64,
}

/// The answer to a query.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The values of a query for them.
    pub value: Option<Values>,
    /// What a statistical query found out.
    pub estimate: Option<Estimate>,
    /// How the best strategy was found, if it was asked for.
    pub optimised: Option<Optimised>,
    /// What is known of the shield, if one was asked for.
    pub shielded: Option<Shielded>,
    /// The runs that `simulate` shows.
    pub simulated: Option<Arc<Simulated>>,
    /// How the values of the runs of a statistical query are distributed.
    pub values_of_runs: Option<Arc<ValuesOfRuns>>,
    /// The results of the runs that alone were wanted, as `stochastic::block` writes them.
    pub block: Option<Vec<u8>>,
    /// A remark for the user.
    pub message: Option<String>,
    /// Warnings about the query, rendered.
    pub warnings: Vec<String>,
    /// What backs it.
    pub evidence: Evidence,
    /// What was done.
    pub counters: Counters,
    /// The greatest number of bytes that states and tables took.
    pub peak_bytes: u64,
    /// Seconds of the search alone.
    pub seconds: f64,
    /// Seconds of loading the model and compiling its code.
    pub load_seconds: f64,
    /// The first place, in the order of the model, where the result of integer arithmetic did not
    /// fit and wrapped round.
    pub wrapped: Option<SiteId>,
}

impl Answer {
    /// An answer that has only the verdict and the counters of the search.
    pub(crate) fn new(verdict: Verdict, counters: Counters) -> Answer {
        Answer {
            verdict,
            value: None,
            estimate: None,
            optimised: None,
            shielded: None,
            simulated: None,
            values_of_runs: None,
            block: None,
            message: None,
            warnings: Vec::new(),
            evidence: Evidence::default(),
            counters,
            peak_bytes: 0,
            seconds: 0.0,
            load_seconds: 0.0,
            wrapped: None,
        }
    }

    /// The answer to a query on a model that has no meaning.
    pub(crate) fn failed(failure: Failure) -> Answer {
        Answer::new(Verdict::Error(failure), Counters::default())
    }

    /// The answer to the negated query.
    pub(crate) fn negated(self) -> Answer {
        let verdict = match self.verdict {
            Verdict::Satisfied => Verdict::NotSatisfied,
            Verdict::NotSatisfied => Verdict::Satisfied,
            other => other,
        };
        Answer { verdict, ..self }
    }

    /// Says how long it took since this watch began, and how much memory.
    pub(super) fn measure(&mut self, watch: &LimitWatch) {
        self.seconds = watch.seconds();
        self.peak_bytes = watch.peak_bytes().max(self.counters.bytes);
    }

    /// Notes that a limit came before this was made.
    pub(crate) fn lacks(&mut self, what: Wanted, reason: StopReason) {
        self.evidence.stopped.push(Stopped { what, reason });
    }

    /// Notes that a limit came before the strategy was made.
    pub(crate) fn lacks_strategy(&mut self, reason: StopReason) {
        self.lacks(Wanted::Strategy, reason);
        self.remark(format!("no strategy: {}", stop_text(reason)));
    }

    /// Adds a remark for the user after the existing ones.
    pub(crate) fn remark(&mut self, remark: impl Into<String>) {
        let remark = remark.into();
        self.message = Some(match self.message.take() {
            Some(message) => format!("{message}; {remark}"),
            None => remark,
        });
    }
}

/// How the check of a strategy ended; an error says why it could not be done.
pub type Verification = Result<StrategyCheck, verify::Error>;

/// Whether a strategy passed its check; `None` if that came to no end.
pub(super) fn holds(check: &Verification) -> Option<bool> {
    match check {
        Ok(StrategyCheck::Verified(_)) => Some(true),
        Ok(StrategyCheck::Violated(..)) => Some(false),
        Ok(StrategyCheck::GivenUp(..)) | Err(_) => None,
    }
}

/// States that contain all reachable ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Certificate {
    /// The states, by words.
    pub states: Vec<States>,
}

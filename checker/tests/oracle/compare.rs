//! What the comparisons share: running many cases, asking the engine, counting what was compared.

use std::cell::Cell;
use std::io::Write as _;

use checker::engine::evidence::strategy_check;
use checker::engine::evidence::witness::Proof;
use checker::engine::{Answer, Limits, LoadedModel, Options, Rejection, Rules, Verdict};
use checker::search::limits::StopReason;
use checker::verify::strategy::Outcome;
use checker::verify::{Error, Regions, Semantics};
use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};

use crate::checks::interpreted;
use crate::explicit::{Graph, NoGraph, explore};
use crate::generate::{self, Formula};

/// Regions that brute force explores before it gives a case up.
const MOST_REGIONS: usize = 30_000;

/// States that the engine explores before it gives a case up.
const MOST_STATES: u64 = 5_000;

/// What became of the cases.
#[derive(Default)]
pub(crate) struct Tally {
    compared: Cell<u32>,
    satisfied: Cell<u32>,
    too_large: Cell<u32>,
    stopped: Cell<u32>,
    rejected: Cell<u32>,
    verified: Cell<u32>,
    unverified: Cell<u32>,
}

impl Tally {
    /// Counts a query without a verdict whose answer was right.
    pub(crate) fn count_compared(&self) {
        count(&self.compared);
    }

    /// Counts a comparison of something that holds, or does not.
    pub(crate) fn count(&self, holds: bool) {
        count(&self.compared);
        if holds {
            count(&self.satisfied);
        }
    }

    /// Counts a query that the engine gave up.
    pub(crate) fn count_stopped(&self) {
        count(&self.stopped);
    }
}

fn count(cell: &Cell<u32>) {
    cell.set(cell.get() + 1);
}

fn from_environment(name: &str, otherwise: u64) -> u64 {
    let value = std::env::var(name).ok();
    value.map_or(otherwise, |value| value.parse().expect("a number"))
}

/// Runs a comparison on random cases, and shrinks the first that fails.
pub(crate) fn run<S: Strategy>(
    name: &str,
    cases: u32,
    strategy: &S,
    compare: impl Fn(&S::Value, &Tally) -> Result<(), TestCaseError>,
) {
    let cases = from_environment("NTAGEN_CASES", u64::from(cases)) as u32;
    let mut seed = [7_u8; 32];
    seed[..8].copy_from_slice(&from_environment("NTAGEN_SEED", 0).to_le_bytes());
    let config = Config {
        cases,
        max_shrink_iters: 20_000,
        failure_persistence: None,
        ..Config::default()
    };
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    let tally = Tally::default();
    let result =
        TestRunner::new_with_rng(config, random).run(strategy, |case| compare(&case, &tally));
    let summary = format!(
        "{name}: {cases} networks, {} queries compared ({} satisfied), {} too large, {} stopped, {} rejected; \
         {} strategies verified, {} too large",
        tally.compared.get(),
        tally.satisfied.get(),
        tally.too_large.get(),
        tally.stopped.get(),
        tally.rejected.get(),
        tally.verified.get(),
        tally.unverified.get()
    );
    writeln!(std::io::stderr(), "{summary}").expect("standard error can be written");
    match result {
        Ok(()) => {}
        Err(TestError::Fail(reason, _)) => panic!("{reason}"),
        Err(TestError::Abort(reason)) => panic!("given up: {reason}"),
    }
    assert!(
        tally.compared.get() >= cases / 2,
        "too few networks were compared: {summary}"
    );
}

/// The options for a small case.
pub(crate) fn options() -> Options {
    Options {
        limits: Limits {
            states: Some(MOST_STATES),
            ..Limits::default()
        },
        runs: true,
        ..interpreted()
    }
}

/// The regions of a model; `None`, counted, if there are too many.
pub(crate) fn regions(
    model: &LoadedModel,
    constant: i64,
    has_differences: bool,
    tally: &Tally,
) -> Result<Option<Graph>, Error> {
    let network = model.network();
    let has_priorities = network.features.priorities;
    let semantics = Semantics::new(network, Regions::ticks_per_unit(network));
    let regions = Regions::new(network, constant, has_differences)?;
    match explore(&semantics, &regions, has_priorities, MOST_REGIONS) {
        Ok(graph) => Ok(Some(graph)),
        Err(NoGraph::TooLarge) => {
            count(&tally.too_large);
            Ok(None)
        }
        Err(NoGraph::Failed(error)) => Err(error),
    }
}

/// The regions that tell formulas with constants up to this one apart, or why a query fails;
/// `None`, counted, if they are too many.
pub(crate) fn regions_for(
    model: &LoadedModel,
    (formulas, constant): (&[Formula], i32),
    tally: &Tally,
) -> Option<Result<Graph, Error>> {
    let has_differences = formulas.iter().any(generate::has_differences);
    regions(model, i64::from(constant), has_differences, tally).transpose()
}

/// Whether the engine gave up since differences of clocks grew too great.
pub(crate) fn has_grown(answer: &Result<Answer, Rejection>) -> bool {
    let verdict = answer.as_ref().map(|one| one.verdict);
    verdict.is_ok_and(|verdict| verdict == Verdict::Unknown(StopReason::Clocks))
}

/// Compares an answer of the engine with what brute force says.
pub(crate) fn check(
    answer: &Result<Answer, Rejection>,
    expected: Result<bool, Error>,
    tally: &Tally,
    describe: impl Fn() -> String,
) -> Result<(), TestCaseError> {
    let answer = match answer {
        Ok(answer) => answer,
        Err(rejection) => {
            count(&tally.rejected);
            let known = ["deadlock cannot be decided"];
            let text = rejection.rendered.join("\n");
            return if known.iter().any(|part| text.contains(part)) {
                Ok(())
            } else {
                Err(TestCaseError::fail(format!(
                    "{}\nrejected: {text}",
                    describe()
                )))
            };
        }
    };
    if let Verdict::Unknown(StopReason::States) = answer.verdict {
        count(&tally.stopped);
        return Ok(());
    }
    let is_right = match expected {
        Ok(expected) => {
            count(&tally.compared);
            if expected {
                count(&tally.satisfied);
            }
            answer.verdict
                == if expected {
                    Verdict::Satisfied
                } else {
                    Verdict::NotSatisfied
                }
        }
        Err(Error::InitialInvariant) => {
            answer.verdict == Verdict::Error(checker::network::Failure::InitialInvariant)
        }
        Err(Error::RunTime(_)) => matches!(answer.verdict, Verdict::Error(_)),
        Err(Error::Unsupported(what)) => panic!("{what} is not generated"),
    };
    check_witnesses(answer, &describe)?;
    if is_right {
        return Ok(());
    }
    Err(TestCaseError::fail(format!(
        "{}\nbrute force says {expected:?}, the engine {:?}",
        describe(),
        answer.verdict
    )))
}

/// The runs of all witnesses must have been replayed.
pub(crate) fn check_witnesses(
    answer: &Answer,
    describe: impl Fn() -> String,
) -> Result<(), TestCaseError> {
    for witness in &answer.evidence.witnesses {
        match &witness.run {
            Some(Proof::Replayed(..)) | None => {}
            run => {
                let text = describe();
                return Err(TestCaseError::fail(format!(
                    "{text}\n{:?}\n{run:#?}",
                    witness.ending
                )));
            }
        }
    }
    Ok(())
}

/// The options for a query whose answer comes with a certificate, by one number of threads after
/// the other.
pub(crate) fn certifying(text: &str, query: &str) -> Options {
    Options {
        certificate: true,
        threads: [1, 2, 4][(text.len() + query.len()) % 3],
        ..options()
    }
}

/// The certificate of an answer, if it has one, must be right. Deadlocks where time may be stopped
/// by an urgent channel are not always certified.
pub(crate) fn check_certificate(
    model: &mut LoadedModel,
    answer: &Answer,
    query: &str,
    describe: impl Fn() -> String,
) -> Result<(), TestCaseError> {
    let Some(certificate) = &answer.evidence.certificate else {
        return Ok(());
    };
    let certificate =
        certificate.head(model.network(), query) + &certificate.lines(0..certificate.state_count());
    let checked = model.verify_evidence("certificate", &certificate, Rules::default());
    let checked = checked.expect("the file is one of this model");
    let may_be_open = query.contains("deadlock") && checked.holds.is_none();
    if checked.holds == Some(true) || may_be_open {
        return Ok(());
    }
    Err(TestCaseError::fail(format!(
        "{}\n{:?}: {:?}",
        describe(),
        checked.holds,
        checked.lines
    )))
}

/// A strategy must pass the closed loop.
pub(crate) fn check_strategy(
    model: &LoadedModel,
    answer: &Result<Answer, Rejection>,
    tally: &Tally,
    describe: impl Fn() -> String,
) -> Result<(), TestCaseError> {
    let Ok(Answer { evidence, .. }) = answer else {
        return Ok(());
    };
    match &evidence.verification {
        None => Ok(()),
        Some(Ok(Outcome::Verified(_))) => {
            count(&tally.verified);
            Ok(())
        }
        Some(Ok(Outcome::GivenUp(..))) => {
            count(&tally.unverified);
            Ok(())
        }
        Some(verification) => {
            let lines = strategy_check::describe(model.network(), verification, None).join("\n");
            let strategy = evidence.strategy.as_ref();
            let strategy = strategy.map(|one| strategy_check::decisions(model.network(), one));
            Err(TestCaseError::fail(format!(
                "{}\n{lines}\n{strategy:#?}",
                describe()
            )))
        }
    }
}

//! Why a random run has no result, with the place in the model, and what to do.

use crate::diagnostics::Span;
use crate::engine::answer::{Answer, Verdict};
use crate::engine::codes;
use crate::engine::format::text;
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{ANALYSED, LoadedModel};
use crate::engine::rejection::Rejection;
use crate::ir::{EdgeId, Location, Network, Process, Query, RunTimeErrorKind};
use crate::search::limits::Counters;
use crate::stochastic::{Failure, MOVES_WITHOUT_RISE, Stand, ZENO_MOVES, ZENO_TIME};

/// The most slots of a dynamic template.
pub(super) const GREATEST_POOL: u32 = 4096;

impl LoadedModel {
    /// The answer to a query of which a run failed, or its refusal. All begins again if the pool
    /// has grown.
    pub(super) fn after_failure(
        &mut self,
        failure: &Failure,
        query: &Query,
        watch: &LimitWatch,
    ) -> Result<Answer, Rejection> {
        if let Failure::RunTime(error) = failure {
            match error.kind {
                RunTimeErrorKind::Interrupted => {
                    let verdict = Verdict::Unknown(watch.stop());
                    return Ok(Answer::new(verdict, Counters::default()));
                }
                RunTimeErrorKind::NoRoom if self.pool < GREATEST_POOL => self.pool *= 2,
                _ => {}
            }
        }
        Err(self.run_fails(failure, query))
    }

    /// Why a random run has no result.
    pub(in crate::engine) fn run_fails(&self, failure: &Failure, query: &Query) -> Rejection {
        let network = self.stochastic.as_ref().expect(ANALYSED).network();
        let span = span_of(network, failure, query);
        let kind = match failure {
            Failure::RunTime(error) => Some(error.kind),
            _ => None,
        };
        let (message, help) = match kind {
            Some(RunTimeErrorKind::NoRoom) => (
                format!(
                    "a random run has more than {} instances of '{}' at a time",
                    self.pool,
                    self.sources.text(span)
                ),
                "let instances end with exit(), or bound the run: spawn seems to have no end"
                    .to_owned(),
            ),
            Some(RunTimeErrorKind::NotLoaded) => (
                "a random run calls this function of a library that is not allowed".to_owned(),
                self.how_to_allow(network),
            ),
            None if *failure == Failure::NoDecision => (
                self.why_undecided(query),
                help_for(failure, query).to_owned(),
            ),
            _ => (
                message_of(network, failure),
                help_for(failure, query).to_owned(),
            ),
        };
        self.refusal(codes::RUN_FAILS, span, message, help)
    }

    /// How to allow the libraries that are not loaded.
    fn how_to_allow(&self, network: &Network) -> String {
        let found = if self.libraries.allowed().is_empty() {
            ""
        } else {
            "none of what is allowed holds it; "
        };
        let missing = network.externals.iter().filter(|one| !one.is_loaded);
        let names: Vec<&str> = missing.map(|one| one.name.as_str()).collect();
        format!(
            "{found}allow it with --allow-external and its file or folder: {}; this runs the code \
             of the library, so do it only if you trust it",
            names.join(", ")
        )
    }
}

fn process(network: &Network, stand: Stand) -> &Process {
    &network.processes[stand.process.0 as usize]
}

fn location(network: &Network, stand: Stand) -> &Location {
    &process(network, stand).locations[stand.location.0 as usize]
}

/// Where the defect is: in the model, or in the query.
fn span_of(network: &Network, failure: &Failure, query: &Query) -> Span {
    match *failure {
        Failure::RunTime(error) => network.sites[error.site.0 as usize].span,
        Failure::NoRate(stand)
        | Failure::Rate(stand, _)
        | Failure::ClockRate(stand)
        | Failure::RatesConflict(_, stand)
        | Failure::TimeLock(stand)
        | Failure::InvariantBroken(stand)
        | Failure::Zeno(stand)
        | Failure::NoProgress(stand) => location(network, stand).span,
        Failure::Weight(stand, EdgeId(edge)) | Failure::NoWeight(stand, EdgeId(edge)) => {
            process(network, stand).edges[edge as usize].span
        }
        Failure::ValueOutOfBounds(_)
        | Failure::ImpossibleDemand
        | Failure::BoundNeverReached
        | Failure::BoundNotApproached(_)
        | Failure::NoBest
        | Failure::NeverEnds
        | Failure::NoNumber
        | Failure::NoDecision
        | Failure::NotRepeatable => query.span,
    }
}

/// What is wrong.
fn message_of(network: &Network, failure: &Failure) -> String {
    let name = |stand: Stand| {
        let (process, location) = (process(network, stand), location(network, stand));
        format!("{}.{}", process.name, location.name)
    };
    match *failure {
        Failure::RunTime(error) => {
            let what = text::run_time_error(error.kind);
            format!("a random run ends in an error: {what}")
        }
        Failure::NoRate(stand) => format!(
            "{} can be left at any time: nothing says how long a random run stays",
            name(stand)
        ),
        Failure::Rate(stand, rate) => {
            format!("the exponential rate of {} is {rate}", name(stand))
        }
        Failure::ClockRate(stand) => {
            let name = name(stand);
            format!("{name} gives a clock a rate that is no finite number")
        }
        Failure::RatesConflict(first, second) => {
            let (first, second) = (name(first), name(second));
            format!("{first} and {second} set the rate of one clock")
        }
        Failure::Weight(stand, _) => {
            format!("a weight behind {} is negative or no number", name(stand))
        }
        Failure::NoWeight(stand, _) => format!("all weights behind {} are 0", name(stand)),
        Failure::TimeLock(stand) => {
            let name = name(stand);
            format!("{name} lets no more time pass, and nothing can happen")
        }
        Failure::ValueOutOfBounds(value) => {
            format!("in a random run the value is {value}, which is not between the bounds")
        }
        Failure::InvariantBroken(stand) => {
            let name = name(stand);
            format!("{name} is entered while its invariant does not hold")
        }
        Failure::Zeno(stand) => format!(
            "{ZENO_MOVES} moves take less than {ZENO_TIME} units of time; the last is of {}",
            name(stand)
        ),
        Failure::ImpossibleDemand => {
            "the strategy demands a move that is not possible in a random run".to_owned()
        }
        Failure::BoundNeverReached => {
            "the clock that bounds the run stands still, and nothing happens any more".to_owned()
        }
        Failure::BoundNotApproached(highest) => format!(
            "in {MOVES_WITHOUT_RISE} moves of a random run, the clock that bounds it does not rise \
             above {highest}"
        ),
        Failure::NoBest => {
            "there is no best strategy: runs can go round a cycle in no time, and each round makes \
             the value better"
                .to_owned()
        }
        Failure::NeverEnds => {
            "under every strategy, runs may go round a cycle in no time for ever".to_owned()
        }
        Failure::NoNumber => {
            "the value of the expression is no finite number in some run".to_owned()
        }
        Failure::NoDecision => "who decides for the controller has not decided".to_owned(),
        Failure::NotRepeatable => {
            let functions = network.externals.iter().flat_map(|one| &one.functions);
            let names: Vec<String> = functions.map(|name| format!("'{name}'")).collect();
            format!(
                "a run with the same random numbers went another way: of {}, some function is not \
                 deterministic",
                names.join(", ")
            )
        }
        Failure::NoProgress(stand) => {
            let name = name(stand);
            format!("a condition in {name} changes more often than can be followed")
        }
    }
}

/// What to do.
fn help_for(failure: &Failure, query: &Query) -> &'static str {
    match failure {
        Failure::RunTime(_) => "correct the model, or keep it out of this state",
        Failure::NoRate(_) if query.under.is_some() => {
            "give the location an exponential rate, or an invariant that bounds the time; or ask \
             with --set 'under choice eager' or 'under choice lazy'"
        }
        Failure::NoRate(_) => {
            "give the location an exponential rate, or an invariant that bounds the time"
        }
        Failure::Rate(..) => {
            "make it a number that is 0 or greater; with 0 the location is never left"
        }
        Failure::ClockRate(_) => "correct the rate",
        Failure::RatesConflict(..) => "let one process set the rate of a clock",
        Failure::Weight(..) => "make all weights 0 or greater",
        Failure::NoWeight(..) => "make one of them positive, or guard the edge",
        Failure::TimeLock(_) => "widen its invariant, or give it an edge that is enabled in time",
        Failure::ValueOutOfBounds(_) => "give wider ones: --set 'value bounds LOW,HIGH'",
        Failure::InvariantBroken(_) => "guard the edges that lead there",
        Failure::Zeno(_) => "let time pass in every loop, or bound the run by its moves: [#<=1000]",
        Failure::ImpossibleDemand => {
            "a strategy from a file must be one of this model: make it again"
        }
        Failure::BoundNeverReached => "bound the run by time: [<=100]",
        Failure::BoundNotApproached(_) => {
            "bound the run by time, [<=100], or by its moves, [#<=1000]"
        }
        Failure::NoBest => {
            "let time pass in the cycle, limit how often it is gone round, or bound the run by its \
             moves: [#<=1000]"
        }
        Failure::NeverEnds => {
            "let time pass in every loop, or give it a way out that the controller can take"
        }
        Failure::NoNumber => {
            "keep arguments of functions in their domains, and divisors away from 0"
        }
        Failure::NoDecision => {
            "let the policy return the number of an action, as for ntagen.gymnasium.Environment"
        }
        Failure::NotRepeatable => {
            "let functions of libraries return the same for the same arguments"
        }
        Failure::NoProgress(_) => "keep clocks and rates within a few orders of magnitude",
    }
}

//! What statistical queries have in common, asked alone or together: how they are compiled and
//! made ready to run, what libraries need around their runs, and how they go on when a run fails.

use std::time::Instant;

use crate::diagnostics::{Diagnostic, Span};
use crate::engine::answer::{Answer, Verdict};
use crate::engine::code::PreparedCode;
use crate::engine::codes;
use crate::engine::loaded_model::{LoadedModel, StochasticModel};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::exec::call_hook;
use crate::ir::{Network, Statistical, StatisticalQuery};
use crate::search::limits::{Counters, StopReason};
use crate::stochastic::{Behaviour, Failure, MeanMethod, Precision, Restriction, is_repeatable};
use crate::syntax::ast;

/// The most slots of a dynamic template.
pub(super) const GREATEST_POOL: u32 = 4096;

/// What is said if the first run takes too long.
const NO_RUN: &str = "no run has ended until then: bound runs by less, and see that the clock that bounds them is not set back";

impl LoadedModel {
    /// Asks something of the model in the stochastic reading; with more slots of dynamic templates
    /// again if a run needs more than there are. No run depends on their number.
    pub(super) fn in_stochastic_reading<T>(
        &mut self,
        options: &Options,
        mut ask: impl FnMut(&mut LoadedModel, &mut StochasticModel) -> Result<T, Rejection>,
    ) -> Result<T, Rejection> {
        loop {
            self.stochastic()?;
            let mut stochastic = self.stochastic.take().expect("it was just made");
            stochastic.model.network.overflow = options.overflow;
            let pool = self.pool;
            let result = ask(self, &mut stochastic);
            if self.pool == pool {
                self.stochastic = Some(stochastic);
                return result;
            }
        }
    }

    /// A compiled query, and warnings about it.
    pub(super) fn compiled(
        &self,
        stochastic: &mut StochasticModel,
        query: &ast::Query,
        strategies: &[String],
        options: &Options,
    ) -> Result<(StatisticalQuery, Vec<String>), Rejection> {
        let model = &mut stochastic.model;
        let (compiled, found) = model.compile_statistical(query, &self.sources, strategies);
        let found = Rejection::new(found, &self.sources);
        let Some(compiled) = compiled else {
            return Err(found);
        };
        if let Some((message, help)) = contradiction(&compiled.kind, &options.precision) {
            let error = Diagnostic::new(codes::UNSUPPORTED_QUERY, query.span, message).help(help);
            return Err(Rejection::new(vec![error], &self.sources));
        }
        Ok((compiled, found.rendered))
    }

    /// Makes the code of the model and of all queries that were compiled, of which one is at
    /// `span`; it takes time since `start`.
    pub(super) fn prepare_stochastic(
        &mut self,
        stochastic: &mut StochasticModel,
        (span, start): (Span, Instant),
        options: &Options,
    ) -> Result<(), Rejection> {
        let network = &stochastic.model.network;
        PreparedCode::prepare(&mut stochastic.code, network, options.code, options.tuning)
            .map_err(|message| {
                let error = Diagnostic::new(codes::NO_COMPILED_CODE, span, message)
                    .help("use the interpreter: --engine interpreter");
                Rejection::new(vec![error], &self.sources)
            })?;
        self.load_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }
}

impl StochasticModel {
    /// What makes runs; the code is prepared.
    pub(super) fn behaviour<'a>(
        &'a self,
        restriction: Option<&'a Restriction>,
        options: &Options,
    ) -> Behaviour<'a> {
        let executor = self.code.as_ref().map(PreparedCode::executor);
        Behaviour {
            network: &self.model.network,
            executor: executor.expect("code was prepared"),
            restriction,
            fixed_step: options.precision.discretisation,
        }
    }

    /// How exact answers are to be, and how many threads make runs.
    pub(super) fn precision(&self, options: &Options) -> Precision {
        Precision {
            // Libraries need not stand several calls at a time.
            threads: if has_libraries(&self.model.network) {
                1
            } else {
                options.thread_count()
            },
            ..options.precision
        }
    }
}

/// Makes libraries ready for the runs of queries: their hooks are called, and the first runs must
/// be repeatable. What is returned calls the hooks that end runs when it is dropped.
pub(super) fn begin_libraries<'n>(
    behaviour: Behaviour<'n>,
    queries: &[&Statistical],
    seed: u64,
) -> Result<Hooks<'n>, Failure> {
    let hooks = Hooks::new(behaviour.network);
    if has_libraries(behaviour.network) {
        for query in queries {
            if !is_repeatable(behaviour, query, seed)? {
                return Err(Failure::NotRepeatable);
            }
        }
    }
    Ok(hooks)
}

/// The answer if time is over before the first run is.
pub(super) fn without_runs(reason: StopReason, counters: Counters) -> Answer {
    let mut answer = Answer::new(Verdict::Unknown(reason), counters);
    answer.remark(NO_RUN);
    answer
}

/// Why an interval cannot be made as it is asked for, and what to do.
fn contradiction(
    query: &Statistical,
    precision: &Precision,
) -> Option<(&'static str, &'static str)> {
    let Statistical::Expectation { bound, range, .. } = query else {
        return None;
    };
    if precision.runs.or(bound.runs).is_none() && precision.relative.is_none() {
        return Some((
            "an expected value needs a number of runs",
            "write it behind the bound, E[<=10; 1000](max: x), or give it: --runs 1000",
        ));
    }
    let has_bounds = precision.value_bounds.or(*range).is_some();
    let is_sequential = precision.anytime || precision.relative.is_some();
    match precision.mean_method {
        MeanMethod::DvoretzkyKieferWolfowitz if is_sequential => Some((
            "an interval of Dvoretzky, Kiefer and Wolfowitz is for a fixed number of runs",
            "leave the choice to empirical Bernstein intervals, which hold at any moment",
        )),
        MeanMethod::Student if is_sequential => Some((
            "Student's interval is for a fixed number of runs",
            "leave the choice to empirical Bernstein intervals, which hold at any moment",
        )),
        MeanMethod::Student => None,
        MeanMethod::Auto if !is_sequential => None,
        _ if !has_bounds => Some((
            "such an interval of a mean needs bounds of the value, and none are known",
            "give them: --value-bounds LOW,HIGH",
        )),
        _ => None,
    }
}

fn has_libraries(network: &Network) -> bool {
    network.externals.iter().any(|one| one.is_loaded)
}

/// Calls the hooks of libraries that begin runs, and when it is dropped those that end them: also
/// where runs are cut off.
#[must_use]
pub(super) struct Hooks<'n>(&'n Network);

impl Hooks<'_> {
    fn new(network: &Network) -> Hooks<'_> {
        let begin = network.externals.iter().filter_map(|one| one.begin);
        begin.for_each(call_hook);
        Hooks(network)
    }
}

impl Drop for Hooks<'_> {
    fn drop(&mut self) {
        let end = self.0.externals.iter().filter_map(|one| one.end);
        end.for_each(call_hook);
    }
}

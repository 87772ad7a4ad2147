//! What symbolic queries under a learned strategy follow: its decisions in zones.
//!
//! The closed loop is explored once, from the initial state to its end, and its decisions are kept
//! with the strategy. From then on it is a strategy in zones like any other.

use std::sync::Arc;

use super::game_zones::zones_of;
use super::problem::{self, Problem};
use super::time_clock;
use crate::analysis::Abstraction;
use crate::engine::answer::{Answer, Verdict};
use crate::engine::codes;
use crate::engine::limits::{LimitWatch, ended_text};
use crate::engine::loaded_model::{ANALYSED, LoadedModel};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::strategy::{Strategy, Under};
use crate::ir::Query;
use crate::learning::{Broken, InZones, LearnedStrategy, NotInZones, StochasticReading};
use crate::network::{Failure, Restriction as _, Symbolic};
use crate::search::Outcome;
use crate::search::limits::{Counters, StopReason};
use crate::search::reachability::goal::Goal;
use crate::search::reachability::search;
use crate::semantics::Reading;
use crate::zones::{Zone, wide};

/// A strategy in zones, or the answer to the query that needs it where there is none.
pub(in crate::engine) type Followable = Result<Arc<Under>, Box<Answer>>;

/// Why there is no strategy in zones.
enum Missing {
    /// Zones cannot tell what it sees.
    Unfit(NotInZones),
    /// The model, or a feature, fails.
    Broken(Broken),
    /// A limit came first.
    Stopped(StopReason, Counters),
}

/// Finds nothing, unless a decision failed.
struct UntilBroken<'l, 'a>(&'l InZones<'a>);

impl Goal for UntilBroken<'_, '_> {
    fn confirms(&mut self, _: &mut Symbolic<'_>, _: &mut [i32], _: &Zone) -> Result<bool, Failure> {
        Ok(self.0.failure().is_some())
    }

    fn depends_on_zones(&self) -> bool {
        false
    }

    fn counters(&self) -> Counters {
        Counters {
            bytes: self.0.bytes() as u64,
            ..Counters::default()
        }
    }
}

impl LoadedModel {
    /// The strategy in zones that a learned one with this name is. It is made once, within these
    /// limits.
    pub(in crate::engine) fn learned_in_zones(
        &mut self,
        name: &str,
        learned: &Arc<LearnedStrategy>,
        query: &Query,
        options: &Options,
    ) -> Result<Followable, Rejection> {
        let named = self.strategy(name);
        if let Some(known) = named.and_then(|one| one.in_zones.clone()) {
            return Ok(Ok(known));
        }
        let within = named.and_then(|one| one.within.clone());
        let text = named.map(|one| one.query.clone()).unwrap_or_default();
        if self.network().features.stopwatches {
            return Err(self.refusal(
                codes::UNSUPPORTED_CONSTRUCT,
                query.span,
                "the model uses stopwatches in a query under a strategy, which the engine does not support",
                "ask Pr, E or simulate under it",
            ));
        }
        self.expect_stochastic()?;
        for reading in [Reading::Symbolic, Reading::Stochastic] {
            self.prepare_code(reading, options.code, options.tuning, query.span)?;
        }
        let mut watch = LimitWatch::new(options.limits.clone());
        wide::start();
        let made = watch.bound(|watch| self.explored(learned, within.as_ref(), options, watch));
        let made =
            made.unwrap_or_else(|(reason, counters)| Err(Missing::Stopped(reason, counters)));
        let strategy = match made {
            Ok(strategy) => strategy,
            Err(missing) => return self.without_zones(name, missing, query, &watch),
        };
        let under = Arc::new(Under {
            query: text,
            strategy: Arc::new(strategy),
        });
        if let Some(named) = self.strategies.iter_mut().find(|one| one.name == name) {
            named.in_zones = Some(Arc::clone(&under));
        }
        Ok(Ok(under))
    }

    /// The decisions of a learned strategy in all states that its closed loop reaches.
    fn explored(
        &self,
        learned: &LearnedStrategy,
        within: Option<&Arc<Under>>,
        options: &Options,
        watch: &mut LimitWatch,
    ) -> Result<Strategy, Missing> {
        let time_limit = within.and_then(|within| within.strategy.time_limit);
        let network = time_clock::with_limit(self.network(), time_limit);
        let moves = within.map(|within| ClosedLoop::new(&network, &within.strategy));
        let problem = Problem {
            network: &network,
            executor: self.executor(),
            under: None,
            options,
            guide: None,
            freedom: None,
        };
        let compiled = self.stochastic.as_ref().expect(ANALYSED);
        let reading = StochasticReading {
            network: compiled.network(),
            executor: compiled.executor(),
        };
        let alone = zones_of(problem, &[], Abstraction::Maximum);
        let in_zones = InZones::new(learned, reading, alone, moves.as_ref());
        let in_zones = in_zones.map_err(Missing::Unfit)?;
        let atoms = in_zones.atoms();
        let abstraction = problem::safe_abstraction(&network, atoms);
        let mut symbolic = zones_of(problem, atoms, abstraction).restricted(Some(&in_zones));
        let mut goal = UntilBroken(&in_zones);
        // One thread, so that the decisions are in the same order each time.
        let report = search::search(&mut symbolic, &mut goal, options.order, watch);
        drop(symbolic);
        if let Some(broken) = in_zones.failure() {
            return Err(Missing::Broken(broken));
        }
        match report.outcome {
            Ok(Outcome::Stopped(reason)) => return Err(Missing::Stopped(reason, report.counters)),
            Err((failure, _)) => return Err(Missing::Broken(Broken::Move(failure))),
            Ok(Outcome::Found(_) | Outcome::Exhausted) => {}
        }
        Ok(Strategy {
            time_limit,
            ..in_zones.into_strategy()
        })
    }

    /// What is said where a learned strategy is none in zones.
    fn without_zones(
        &mut self,
        name: &str,
        missing: Missing,
        query: &Query,
        watch: &LimitWatch,
    ) -> Result<Followable, Rejection> {
        let stopped = |reason, counters| {
            let mut answer = Answer::new(Verdict::Unknown(reason), counters);
            let ended = ended_text(reason);
            answer.remark(format!("exploring what {name} decides was {ended}"));
            answer.measure(watch);
            Ok(Err(Box::new(answer)))
        };
        match missing {
            Missing::Unfit(why) => Err(self.unfit(name, &why, query)),
            Missing::Stopped(reason, counters) => stopped(reason, counters),
            Missing::Broken(Broken::Move(Failure::Interrupted)) => {
                stopped(watch.stop(), Counters::default())
            }
            Missing::Broken(Broken::Move(Failure::ClockRange)) => {
                stopped(StopReason::Clocks, Counters::default())
            }
            Missing::Broken(Broken::Move(failure)) => Ok(Err(Box::new(Answer::failed(failure)))),
            Missing::Broken(Broken::Feature(failure)) => {
                Ok(Err(Box::new(self.after_failure(&failure, query, watch)?)))
            }
        }
    }

    /// The refusal of a learned strategy that sees what zones cannot tell.
    fn unfit(&self, name: &str, why: &NotInZones, query: &Query) -> Rejection {
        let (message, help) = match why {
            NotInZones::Readings => (
                format!(
                    "symbolic queries cannot follow {name}: the two readings of the model differ"
                ),
                "ask Pr, E or simulate under it",
            ),
            NotInZones::Feature(text) => (
                format!(
                    "symbolic queries cannot follow {name}: it sees {text}, which no symbolic state has"
                ),
                "ask Pr, E or simulate under it; or learn it with features that are locations, \
                 integers and single clocks",
            ),
            NotInZones::Cut { text, bound } => (
                format!(
                    "symbolic queries cannot follow {name}: it compares {text} with {bound}, and zones \
                     have integers only"
                ),
                "ask Pr, E or simulate under it; or choose a smaller unit of time in the model, so that \
                 cuts at integers are fine enough",
            ),
        };
        self.refusal(codes::UNSUPPORTED_QUERY, query.span, message, help)
    }
}

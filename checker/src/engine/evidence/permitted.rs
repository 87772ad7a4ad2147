//! What a query under a strategy follows.
//!
//! A strategy to reach something makes one move a state when it is played, saved or written in C.
//! A query under it asks about all that the controller may do. It may make every move, and wait
//! wherever the win stays certain then, if the goal is still reached in every run of that closed
//! loop. Where it could be put off for ever, only moves that come nearer to it count. So
//! `A<> goal under S` holds in any case: the closed loop of either set is checked before it is
//! used. All other strategies are followed as they are: those from files, and in models with
//! stopwatches.
//!
//! The set is made when a query under the strategy first needs it, and kept.

use std::sync::Arc;
use std::time::Instant;

use crate::diagnostics::Span;
use crate::game::strategy::freedom::Freedom;
use crate::game::strategy::{Strategy, Under};
use crate::ir::{Control, Objective, Predicate, Query, QueryKind};

use crate::engine::answer::{Answer, Verdict};
use crate::engine::limits::{Limits, stop_text};
use crate::engine::loaded_model::{LoadedModel, Permitted, PreparedQuery};
use crate::engine::options::{Options, TraceWanted};
use crate::engine::rejection::Rejection;

/// The sets of moves that are tried, the greatest first.
const FREEDOMS: [Freedom; 2] = [Freedom::Winning, Freedom::Nearer];

impl LoadedModel {
    /// What a query under a strategy follows. If it is not known yet, it is made within these
    /// limits. `span` is the query.
    pub(crate) fn permitted_by(
        &mut self,
        name: &str,
        span: Span,
        options: &Options,
    ) -> Result<Permitted, Rejection> {
        let named = self.strategy(name);
        if let Some(known) = named.and_then(|one| one.permitted.clone()) {
            return Ok(known);
        }
        let definition = named.and_then(|one| one.definition.clone());
        let start = Instant::now();
        // Closed loops of models with stopwatches are not searched.
        let is_searched = !self.network().features.stopwatches;
        let sought = definition.as_ref().filter(|_| is_searched);
        let sought = sought.and_then(|one| Some((one, goal_of(&one.query.kind)?)));
        let permitted = match sought {
            Some((definition, goal)) => match self.freest(definition, goal, span, options)? {
                Ok(permitted) => permitted,
                Err(reason) => return Err(self.no_strategy(name, span, &reason)),
            },
            None => None,
        };
        let permitted = match permitted {
            Some(permitted) => permitted,
            None => Permitted {
                strategy: self.existing_strategy(name, span, &options.left_since(start))?,
                freedom: None,
            },
        };
        if let Some(named) = self.strategy_mut(name) {
            named.permitted = Some(permitted.clone());
        }
        Ok(permitted)
    }

    /// The greatest set of moves, of the game of this query, under which the goal is reached in
    /// every run; `None` if there is none. An error of the inner result says which limit came
    /// first.
    fn freest(
        &mut self,
        definition: &PreparedQuery,
        goal: &Predicate,
        span: Span,
        options: &Options,
    ) -> Result<Result<Option<Permitted>, String>, Rejection> {
        let start = Instant::now();
        for freedom in FREEDOMS {
            let options = &options.left_since(start);
            let strategy = match self.made_by(definition, Some(freedom), span, options)? {
                Ok(strategy) => strategy,
                Err(reason) => return Ok(Err(reason)),
            };
            let limits = options.limits.left_since(start);
            match self.always_reaches(definition, goal, &strategy, limits) {
                Verdict::Satisfied => {
                    let freedom = Some(freedom);
                    return Ok(Ok(Some(Permitted { strategy, freedom })));
                }
                Verdict::Unknown(reason) => return Ok(Err(stop_text(reason).to_owned())),
                Verdict::NotSatisfied | Verdict::Maybe | Verdict::Error(_) => {}
            }
        }
        Ok(Ok(None))
    }

    /// Whether every run under a strategy for this query reaches the goal.
    fn always_reaches(
        &self,
        definition: &PreparedQuery,
        goal: &Predicate,
        strategy: &Arc<Strategy>,
        limits: Limits,
    ) -> Verdict {
        let under = Under {
            query: definition.query.text.clone(),
            strategy: Arc::clone(strategy),
        };
        let asked = PreparedQuery {
            query: Query {
                strategy: None,
                kind: QueryKind::Eventually(goal.clone()),
                ..definition.query.clone()
            },
            options: Options {
                strategy: false,
                verify: false,
                plans: None,
                runs: false,
                certificate: false,
                trace: TraceWanted::Any,
                limits,
                ..definition.options.clone()
            },
            guide: None,
            level: None,
            under: Some(Arc::new(under)),
            decider: None,
            shield: None,
        };
        self.answer_in_zones(&asked, None).verdict
    }

    /// Says in the answer to a query under a strategy what the strategy leaves to choose.
    pub(crate) fn note_freedom(&self, name: &str, answer: &mut Answer) {
        let permitted = self.strategy(name).and_then(|one| one.permitted.as_ref());
        match permitted.and_then(|permitted| permitted.freedom) {
            None => {}
            Some(Freedom::Winning) => answer.remark(format!(
                "{name} allows all moves and waits after which the win stays certain"
            )),
            Some(Freedom::Nearer) => answer.remark(format!(
                "{name} allows only moves that come nearer to the goal: with all that keep the win \
                 it could be put off for ever"
            )),
        }
    }
}

/// The goal of a game to reach something from the start, in any time.
fn goal_of(query: &QueryKind) -> Option<&Predicate> {
    match query {
        QueryKind::Control(Control {
            objective: Objective::Reach(goal) | Objective::Until(_, goal),
            cooperative: false,
            time_optimal: None,
            observations: None,
        }) => Some(goal),
        _ => None,
    }
}

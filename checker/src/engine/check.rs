//! From the text of a query to its answer: what is done for every kind of query, around the search
//! or the random runs themselves.

use std::sync::Arc;
use std::time::Instant;

use super::answer::{Answer, Verdict};
use super::limits::LimitWatch;
use super::loaded_model::{Decider, LoadedModel, NamedStrategy, PreparedQuery};
use super::options::Options;
use super::query_form::unnamed;
use super::rejection::Rejection;
use crate::diagnostics::Span;
use crate::exec::RunTimeError;
use crate::game::strategy::Under;
use crate::ir::{Overflow, Query, QueryKind, RunTimeErrorKind, SiteId};
use crate::network::Failure;
use crate::semantics::Reading;
use crate::shield::Shield;
use crate::syntax::ast::QueryText;

/// What a query under a strategy follows.
#[derive(Default)]
struct FollowedStrategies {
    /// The strategy that the controller stays within.
    under: Option<Arc<Under>>,
    /// Who decides in random runs.
    decider: Option<Decider>,
    /// The shield that it stays within.
    shield: Option<Arc<Shield>>,
}

/// A query whose code is ready, with its warnings; or the answer if a limit came before.
type Ready = Result<(PreparedQuery, Vec<String>), Box<Answer>>;

impl LoadedModel {
    /// Answers a query.
    pub fn check(&mut self, text: &QueryText, options: &Options) -> Result<Answer, Rejection> {
        self.with_room(|model| model.check_once(text.span, options))
    }

    /// Does something; again with more slots of dynamic templates if a random run needs more than
    /// there are. No run depends on their number.
    pub(super) fn with_room<T>(
        &mut self,
        mut ask: impl FnMut(&mut LoadedModel) -> Result<T, Rejection>,
    ) -> Result<T, Rejection> {
        loop {
            let pool = self.pool;
            let result = ask(self);
            if self.pool == pool {
                return result;
            }
            self.stochastic = None;
            self.renew_learned()?;
        }
    }

    fn check_once(&mut self, span: Span, options: &Options) -> Result<Answer, Rejection> {
        let (prepared, warnings) = match self.make_ready(span, options)? {
            Ok(ready) => ready,
            Err(answer) => return Ok(*answer),
        };
        let mut answer = self.answer(&prepared)?;
        answer.warnings = warnings;
        answer.load_seconds = self.load_seconds;
        Ok(answer)
    }

    /// Compiles a query, and makes its code ready.
    pub(super) fn make_ready(&mut self, span: Span, options: &Options) -> Result<Ready, Rejection> {
        let start = Instant::now();
        let (reading, names) = (self.reading_of(span), self.strategy_names());
        let (query, warnings) = self.compile_in(reading, span, &names)?;
        let guide = match reading {
            Reading::Symbolic => self.compile_guide(options.guide.as_deref())?,
            Reading::Stochastic => None,
        };
        let level = self.level(&query, options)?;
        self.load_seconds += start.elapsed().as_secs_f64();
        let start = Instant::now();
        let FollowedStrategies {
            under,
            decider,
            shield,
        } = match self.followed(&query, options)? {
            Ok(followed) => followed,
            Err(answer) => {
                return Ok(Err(Box::new(Answer {
                    warnings,
                    load_seconds: self.load_seconds,
                    ..*answer
                })));
            }
        };
        let mut options = options.left_since(start);
        if matches!(decider, Some(Decider::Policy(_))) {
            // It may remember what it was asked: it is asked in the order of runs.
            options.threads = 1;
        }
        let prepared = PreparedQuery {
            query,
            options,
            guide,
            level,
            under,
            decider,
            shield,
        };
        self.refuse_unsupported(&prepared)?;
        match self.prepare_in_time(reading, span, &prepared.options)? {
            Some(cut) => Ok(Err(Box::new(cut))),
            None => Ok(Ok((prepared, warnings))),
        }
    }

    /// What a query under a strategy follows.
    fn followed(
        &mut self,
        query: &Query,
        options: &Options,
    ) -> Result<Result<FollowedStrategies, Box<Answer>>, Rejection> {
        let Some(name) = &query.under else {
            return Ok(Ok(FollowedStrategies::default()));
        };
        let is_symbolic = !matches!(
            query.kind,
            QueryKind::Statistical(_) | QueryKind::Optimum(_)
        );
        if let Some(policy) = self.policy(name, query, is_symbolic)? {
            return Ok(Ok(FollowedStrategies {
                decider: Some(Decider::Policy(policy)),
                ..FollowedStrategies::default()
            }));
        }
        if let Some(named) = self.strategy(name)
            && (named.learned.is_some() || named.shield.is_some())
        {
            if let (true, Some(learned), None) = (is_symbolic, &named.learned, &named.shield) {
                let learned = Arc::clone(learned);
                let in_zones = self.learned_in_zones(name, &learned, query, options)?;
                return Ok(in_zones.map(|under| FollowedStrategies {
                    under: Some(under),
                    ..FollowedStrategies::default()
                }));
            }
            return Ok(Ok(FollowedStrategies {
                under: named.within.clone(),
                decider: named.learned.clone().map(Decider::Learned),
                shield: named.shield.clone(),
            }));
        }
        let strategy = self.permitted_by(name, query.span, options)?.strategy;
        let query = self.strategy(name).map(|one| one.query.clone());
        let query = query.unwrap_or_default();
        Ok(Ok(FollowedStrategies {
            under: Some(Arc::new(Under { query, strategy })),
            ..FollowedStrategies::default()
        }))
    }

    /// Makes the code of the model with that of queries, of which one is at `span`; gives an answer
    /// if a limit comes before.
    pub(super) fn prepare_in_time(
        &mut self,
        reading: Reading,
        span: Span,
        options: &Options,
    ) -> Result<Option<Answer>, Rejection> {
        let start = Instant::now();
        let mut watch = LimitWatch::new(options.limits.clone());
        match watch.bound(|_| self.prepare_code(reading, options.code, options.tuning, span)) {
            Ok(prepared) => prepared?,
            Err((reason, counters)) => {
                return Ok(Some(Answer::new(Verdict::Unknown(reason), counters)));
            }
        }
        self.load_seconds += start.elapsed().as_secs_f64();
        Ok(None)
    }

    /// Answers a query whose code is ready.
    fn answer(&mut self, prepared: &PreparedQuery) -> Result<Answer, Rejection> {
        let query = &prepared.query;
        let mut answer = match &query.kind {
            QueryKind::Statistical(asked) => self.answer_by_runs(prepared, asked)?,
            QueryKind::Optimum(asked) => self.answer_optimum(prepared, asked)?,
            QueryKind::Shield(asked) => self.answer_shield(prepared, asked)?,
            QueryKind::SaveStrategy { .. } | QueryKind::LoadStrategy { .. } => {
                self.answer_by_file(prepared)?
            }
            _ => self.answer_symbolically(prepared),
        };
        if let Some(name) = &query.under {
            self.note_freedom(name, &mut answer);
        }
        Ok(answer)
    }

    /// Answers a query about symbolic states; keeps the strategy that it defines.
    fn answer_symbolically(&mut self, prepared: &PreparedQuery) -> Answer {
        let PreparedQuery { query, options, .. } = prepared;
        self.executor().wraps().clear();
        let mut answer = if let Some(failure) = self.constant_failure() {
            Answer::failed(failure)
        } else {
            let answer = self.answer_in_zones(prepared, None);
            if let Some(name) = &query.strategy {
                self.keep_answer(name, prepared, &answer);
            }
            answer
        };
        answer.wrapped = self.first_wrap();
        self.complete_failure(query, options, &mut answer);
        answer
    }

    /// Answers a query that saves or loads a strategy: no code of the model is run.
    fn answer_by_file(&mut self, prepared: &PreparedQuery) -> Result<Answer, Rejection> {
        let PreparedQuery { query, options, .. } = prepared;
        let mut answer = match (&query.kind, self.constant_failure()) {
            (_, Some(failure)) => Answer::failed(failure),
            (QueryKind::SaveStrategy { file, strategy }, None) => {
                self.save_strategy(file, strategy, query.span, options)?
            }
            (QueryKind::LoadStrategy { file, features }, None) => {
                self.load_strategy(query, file, features.as_ref(), options)?
            }
            _ => unreachable!("it saves or loads a strategy"),
        };
        answer.wrapped = self.network().wrapped_constant;
        Ok(answer)
    }

    /// Keeps the strategy with this name that a query defines.
    fn keep_answer(&mut self, name: &str, prepared: &PreparedQuery, answer: &Answer) {
        let text = unnamed(&prepared.query.text).to_owned();
        // Where the query is not satisfied, the strategy is the environment's.
        let is_won = answer.verdict == Verdict::Satisfied;
        let known = is_won.then(|| answer.evidence.strategy.clone()).flatten();
        self.keep_strategy(NamedStrategy {
            definition: is_won.then(|| Arc::new(prepared.clone())),
            ..NamedStrategy::new(name.to_owned(), text, known)
        });
    }

    /// Why the model has no meaning if what does not fit is an error: a constant wrapped round.
    fn constant_failure(&self) -> Option<Failure> {
        let network = self.network();
        let site = network.wrapped_constant?;
        let kind = RunTimeErrorKind::Overflow;
        let is_error = network.overflow == Overflow::Error;
        is_error.then_some(Failure::RunTime(RunTimeError { kind, site }))
    }

    /// Where the answer to a query first wrapped round, in the order of the model, or a constant
    /// did.
    fn first_wrap(&self) -> Option<SiteId> {
        let in_constants = self.network().wrapped_constant;
        let noted = self.executor().wraps().first();
        noted.into_iter().chain(in_constants).min()
    }
}

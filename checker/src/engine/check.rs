//! From the text of a query to its answer, with everything around the search itself: compilation,
//! names of strategies, remarks on results that wrapped round.

use std::sync::Arc;
use std::time::Instant;

use super::answer::{Answer, Verdict};
use super::codes;
use super::evidence::named_strategies::StrategyFile;
use super::limits::LimitWatch;
use super::loaded_model::{LoadedModel, NamedStrategy, Recipe};
use super::options::Options;
use super::query_form::unnamed;
use super::rejection::Rejection;
use crate::diagnostics::Diagnostic;
use crate::exec::RunTimeError;
use crate::game::strategy::Under;
use crate::ir::{FunctionId, Measure, Overflow, Query, QueryKind, RunTimeErrorKind, SiteId};
use crate::network::Failure;
use crate::syntax::ast::QueryText;

impl LoadedModel {
    /// Answers a query.
    pub fn check(&mut self, text: &QueryText, options: &Options) -> Result<Answer, Rejection> {
        let before = std::mem::replace(&mut self.model.network.overflow, options.overflow);
        let answer = self.check_it(text, options);
        self.model.network.overflow = before;
        answer
    }

    fn check_it(&mut self, text: &QueryText, options: &Options) -> Result<Answer, Rejection> {
        if let Some(query) = self.statistical_query(text.span) {
            return self.check_statistical(&query, options);
        }
        let start = Instant::now();
        let (mut query, warnings) = self.compile(text.span)?;
        query.guide = self.compile_guide(options)?;
        self.load_seconds += start.elapsed().as_secs_f64();
        let rest;
        let mut options = options;
        if let Some(name) = &query.under {
            let start = Instant::now();
            // What is supported depends on it.
            self.permitted_by(name, query.span, options)?;
            rest = options.left_since(start);
            options = &rest;
        }
        let start = Instant::now();
        self.refuse_unsupported(&query, options.priorities)?;
        let mut watch = LimitWatch::new(options.limits.clone());
        let prepared = watch.bound(|_| self.prepare_code(options.code, options.tuning, query.span));
        match prepared {
            Ok(prepared) => prepared?,
            Err((reason, counters)) => {
                // What is half made is made anew when it is needed.
                self.forget_code();
                return Ok(Answer::new(Verdict::Unknown(reason), counters));
            }
        }
        self.executor().wraps().clear();
        self.load_seconds += start.elapsed().as_secs_f64();
        let mut answer = match (&query.kind, self.constant_failure()) {
            (_, Some(failure)) => Answer::failed(failure),
            (QueryKind::SaveStrategy { file, strategy }, None) => {
                let (name, span) = (strategy, query.span);
                self.save_strategy(StrategyFile { file, name, span }, options)?
            }
            (QueryKind::LoadStrategy { file }, None) => {
                let (name, span) = (query.strategy.as_deref().unwrap_or_default(), query.span);
                self.load_strategy(StrategyFile { file, name, span }, options)?
            }
            _ => self.answer(&query, options)?,
        };
        answer.wrapped = self.first_wrap();
        self.complete_failure(&query, options, &mut answer);
        answer.warnings = warnings;
        answer.load_seconds = self.load_seconds;
        Ok(answer)
    }

    /// The function that computes the guide, if there is one.
    fn compile_guide(&mut self, options: &Options) -> Result<Option<FunctionId>, Rejection> {
        let Some(guide) = &options.guide else {
            return Ok(None);
        };
        // Whatever `sup` can measure on the words is a guide.
        let text = self.add_query(&format!("sup: {guide}"));
        let (query, _) = self.compile(text.span)?;
        let function = match query.kind {
            QueryKind::Extremum { items, .. } => match items.as_slice() {
                [(Measure::Integer(function), _)] => Some(*function),
                _ => None,
            },
            _ => None,
        };
        function.map(Some).ok_or_else(|| {
            let message = format!("`{guide}` is no guide");
            let help = "write one integer expression without clocks";
            let error = Diagnostic::new(codes::UNSUPPORTED_QUERY, query.span, message).help(help);
            Rejection::new(vec![error], &self.sources)
        })
    }

    /// Answers a query that is no file operation; keeps the strategy that it defines.
    fn answer(&mut self, query: &Query, options: &Options) -> Result<Answer, Rejection> {
        let within = match &query.under {
            None => None,
            Some(name) => {
                let strategy = self.permitted_by(name, query.span, options)?.strategy;
                let query = self.strategy(name).map(|one| one.query.clone());
                Some(Arc::new(Under {
                    query: query.unwrap_or_default(),
                    strategy,
                }))
            }
        };
        let mut answer = self.answer_within(query, options, within.as_ref());
        if let Some(name) = query.strategy.clone() {
            self.keep_answer(name, query, &answer, (options, within));
        }
        if let Some(name) = &query.under {
            self.note_freedom(name, &mut answer);
        }
        Ok(answer)
    }

    /// Keeps the strategy that a query defines.
    fn keep_answer(
        &mut self,
        name: String,
        query: &Query,
        answer: &Answer,
        (options, within): (&Options, Option<Arc<Under>>),
    ) {
        let text = unnamed(&query.text).to_owned();
        // Where the query is not satisfied, the strategy is the environment's.
        let is_won = answer.verdict == Verdict::Satisfied;
        let known = is_won.then(|| answer.evidence.strategy.clone()).flatten();
        let recipe = is_won.then(|| {
            Arc::new(Recipe {
                query: query.clone(),
                options: options.clone(),
                within,
            })
        });
        self.keep_strategy(NamedStrategy {
            recipe,
            ..NamedStrategy::new(name, text, known)
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

//! The query language: path formulas, extrema, games, strategies; statistical and learning queries
//! by name only.

use super::ast::{
    Control, Expr, ExprKind, Extremum, Features, Name, Objective, ObservedPredicate, Query,
    QueryKind,
};
use super::codes;
use super::expressions::{join_all, level};
use super::keywords::Dialect;
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::{Diagnostic, Source, SourceMap, Span};

/// Parses the query formula that stands at `span`; there is no tree if anything was wrong.
pub fn parse_query(span: Span, sources: &SourceMap) -> (Option<Query>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let mut parser = Parser::new(span, sources, Dialect::Query, &mut diagnostics);
    let mut query = parser.query();
    let unsupported = std::mem::take(&mut parser.unsupported);
    if let Some(first) = unsupported.into_iter().next() {
        query.kind = QueryKind::Unsupported(Name {
            text: first.text,
            span: first.span,
        });
    }
    if matches!(query.kind, QueryKind::Unsupported(_)) {
        // Operators of temporal logics that are not read at all are no tokens here.
        diagnostics.retain(|diagnostic| diagnostic.code != codes::UNKNOWN_SYMBOL);
    }
    let first = diagnostics.iter().position(Diagnostic::is_error);
    if let Some(first) = first {
        // A query is one line: what follows the first mistake is most often caused by it.
        diagnostics.truncate(first + 1);
    }
    (first.is_none().then_some(query), diagnostics)
}

/// Parses the expression of a query that stands at `span`; there is no tree if anything was wrong.
pub(crate) fn parse_expression(span: Span, sources: &SourceMap) -> (Option<Expr>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let mut parser = Parser::new(span, sources, Dialect::Query, &mut diagnostics);
    let expr = parser.expression();
    if !parser.at_end() {
        parser.expected("the end of the expression");
    }
    let is_right = !diagnostics.iter().any(Diagnostic::is_error);
    (is_right.then_some(expr), diagnostics)
}

/// Parses the features that stand at `span`, `{d} -> {c}`; there is no tree if anything was wrong.
pub(crate) fn parse_features(
    span: Span,
    sources: &SourceMap,
) -> (Option<Features>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let mut parser = Parser::new(span, sources, Dialect::Query, &mut diagnostics);
    let features = parser.features();
    if features.is_none() || !parser.at_end() {
        parser.expected("features such as `{a, P.location} -> {x}`, and nothing else");
    }
    let is_right = !diagnostics.iter().any(Diagnostic::is_error);
    (features.filter(|_| is_right), diagnostics)
}

/// Adds a query given as bare text as a source of its own and returns its span.
pub fn add_query_text(text: &str, sources: &mut SourceMap) -> Span {
    sources.add(Source {
        place: "query".to_owned(),
        text: text.into(),
        ..Source::default()
    })
}

/// Path quantifiers as other tools and people write them, each with that of UPPAAL.
const FOREIGN_QUANTIFIERS: [(&str, &str); 11] = [
    ("EF", "E<>"),
    ("AG", "A[]"),
    ("AF", "A<>"),
    ("EG", "E[]"),
    ("G", "A[]"),
    ("F", "A<>"),
    ("always", "A[]"),
    ("never", "A[] not"),
    ("eventually", "A<>"),
    ("possibly", "E<>"),
    ("reachable", "E<>"),
];

impl Parser<'_> {
    fn query(&mut self) -> Query {
        let span = self.here();
        if self.at_end() {
            self.error(codes::EMPTY_QUERY, span, "this query is empty");
        }
        let strategy = self.strategy_name();
        let formula = self.here();
        let kind = self.query_kind();
        let formula = self.since(formula);
        if strategy.is_some() && !yields_strategy(&kind) {
            self.report(
                Diagnostic::new(codes::NOT_A_STRATEGY, formula, "this query gives no strategy").help(
                    "`strategy S =` needs `control: …`, `loadStrategy(…)`, `minE`, `maxE`, `minPr` or `maxPr`",
                ),
            );
        }
        let under = self.strategy_behind("under");
        let under = under.or_else(|| kind.hypothesis_under().cloned());
        let imitate = self.strategy_behind("imitate");
        if matches!(kind, QueryKind::Unsupported(_)) {
            while !self.at_end() {
                self.bump();
            }
        }
        self.expect_end("of the query");
        Query {
            strategy,
            kind,
            formula,
            under,
            imitate,
            span: self.since(span),
        }
    }

    /// `strategy S =`
    fn strategy_name(&mut self) -> Option<Name> {
        if !self.eat_word("strategy") {
            return None;
        }
        let name = self.name("the name of the strategy");
        if !self.eat(TokenKind::ColonAssign) {
            self.expect(TokenKind::Assign, "after the name of the strategy");
        }
        Some(name)
    }

    /// `under S` or `imitate S`
    pub(super) fn strategy_behind(&mut self, word: &str) -> Option<Name> {
        self.eat_word(word)
            .then(|| self.name("the name of a strategy"))
    }

    fn query_kind(&mut self) -> QueryKind {
        match self.kind() {
            TokenKind::ExistsFinally if self.word_at(1) == "control" => {
                self.bump();
                self.control(true, None)
            }
            TokenKind::LeftBrace => self.observed_control(),
            TokenKind::AlwaysFinally
            | TokenKind::AlwaysGlobally
            | TokenKind::ExistsFinally
            | TokenKind::ExistsGlobally => self.path_formula(),
            TokenKind::Diamond => self.foreign_quantifier("E<>"),
            TokenKind::Box => self.foreign_quantifier("A[]"),
            _ => self.word_query(),
        }
    }

    fn path_formula(&mut self) -> QueryKind {
        let quantifier = self.bump().kind;
        let operand = self.expression();
        match quantifier {
            TokenKind::AlwaysFinally => QueryKind::Eventually(operand),
            TokenKind::AlwaysGlobally => QueryKind::Invariantly(operand),
            TokenKind::ExistsGlobally => QueryKind::PotentiallyAlways(operand),
            _ => QueryKind::Reachable(operand),
        }
    }

    fn word_query(&mut self) -> QueryKind {
        let next = self.peek(1).kind;
        let is_prefix = matches!(next, TokenKind::Colon | TokenKind::LeftBrace);
        match self.word() {
            "control" => self.control(false, None),
            "control_t" => self.time_optimal_control(),
            "sup" if is_prefix => self.extremum(Extremum::Sup),
            "inf" if is_prefix => self.extremum(Extremum::Inf),
            "bounds" if is_prefix => self.extremum(Extremum::Bounds),
            "saveStrategy" => self.save_strategy(),
            "loadStrategy" => self.load_strategy(),
            "acontrol" if is_prefix => self.shield(),
            "minE" | "maxE" | "minPr" | "maxPr" => self.optimum(),
            "Pr" | "simulate" => self.statistical(),
            "Pmax" => self.unsupported_query("statistical model checking"),
            "refinement" | "consistency" | "specification" | "implementation" | "determinism"
            | "prune" | "reachability"
                if next == TokenKind::Colon =>
            {
                self.unsupported_query("Ecdar's")
            }
            "get" | "bisim" if next == TokenKind::Minus && self.at_dashed_word() => {
                self.unsupported_query("Ecdar's")
            }
            "sat" => self.unsupported_query("live sequence chart scenario"),
            "E" if next == TokenKind::LeftBracket && self.at_expected_value() => self.statistical(),
            "P" if next == TokenKind::LeftBracket && self.at_run_bound() => {
                self.report(
                    Diagnostic::new(
                        codes::UNEXPECTED_TOKEN,
                        self.here(),
                        "expected a query, found `P`",
                    )
                    .help("write `Pr[<=10](<> p)` for a probability"),
                );
                self.statistical()
            }
            "A" if next == TokenKind::LeftBracket => self.until_or_leads_to(),
            _ => self.leads_to(),
        }
    }

    /// `get-component:` or `bisim-minim:`
    fn at_dashed_word(&self) -> bool {
        matches!(self.word_at(2), "component" | "minim") && self.peek(3).kind == TokenKind::Colon
    }

    /// The rest up to `under` is not read.
    pub(super) fn unsupported_query(&mut self, kind: &str) -> QueryKind {
        let start = self.here();
        self.skip_query();
        QueryKind::Unsupported(Name {
            text: kind.to_owned(),
            span: self.since(start),
        })
    }

    /// Passes over all but what stands behind `under`.
    pub(super) fn skip_query(&mut self) {
        while !self.at_end() && !self.at_word("under") {
            self.bump();
        }
    }

    /// `P[<=10` and not an array named `P`.
    fn at_run_bound(&self) -> bool {
        matches!(self.peek(2).kind, TokenKind::LessEqual | TokenKind::Hash)
    }

    /// `E[<=10](max: x)`, and not an array named `E`: a bound stands in the brackets, and `(name:`
    /// follows them.
    fn at_expected_value(&self) -> bool {
        if self.at_run_bound() {
            return true;
        }
        let mut depth = 0_u32;
        for distance in 1.. {
            match self.peek(distance).kind {
                TokenKind::LeftBracket => depth += 1,
                TokenKind::RightBracket => depth -= 1,
                TokenKind::End => return false,
                _ => {}
            }
            if depth == 0 {
                return self.peek(distance + 1).kind == TokenKind::LeftParenthesis
                    && self.peek(distance + 2).kind == TokenKind::Word
                    && self.peek(distance + 3).kind == TokenKind::Colon;
            }
        }
        false
    }

    fn until_or_leads_to(&mut self) -> QueryKind {
        let start = self.here();
        let checkpoint = self.checkpoint();
        if self.until().is_some() && self.is_clean_since(&checkpoint) {
            return QueryKind::Unsupported(Name {
                text: "`A[p U q]` outside `control:`".to_owned(),
                span: self.since(start),
            });
        }
        self.rewind(&checkpoint);
        self.leads_to()
    }

    /// Reports a path quantifier of another notation, which is the next token, and says which query
    /// is probably meant.
    fn foreign_quantifier(&mut self, meant: &str) -> QueryKind {
        let token = self.bump();
        let operand = self.here();
        let is_missing = self.at_end() || self.at_word("under");
        self.skip_query();
        let operand = self.since(operand);
        let words = self.text[operand.start as usize..operand.end as usize].split_whitespace();
        let operand = words.collect::<Vec<_>>().join(" ");
        let operand = if is_missing { "p" } else { &operand };
        let message = format!("`{}` is no path quantifier of UPPAAL", self.text_of(token));
        self.report(
            Diagnostic::new(codes::MISSING_PATH_QUANTIFIER, self.span_of(token), message)
                .help(format!("did you mean `{meant} {operand}`?")),
        );
        QueryKind::Reachable(self.error_expr())
    }

    fn leads_to(&mut self) -> QueryKind {
        let (start, quantifier) = (self.checkpoint(), self.word());
        let is_call = self.peek(1).kind == TokenKind::LeftParenthesis;
        let left = self.expression();
        if self.eat(TokenKind::LeadsTo) {
            return QueryKind::LeadsTo(left, self.expression());
        }
        // An operator behind it shows that the word is a name: `G == 1`.
        let is_before_operand = is_call || matches!(left.kind, ExprKind::Name(_));
        let foreign = FOREIGN_QUANTIFIERS.iter().find(|one| one.0 == quantifier);
        if let Some((_, meant)) = foreign.filter(|_| is_before_operand) {
            self.rewind(&start);
            return self.foreign_quantifier(meant);
        }
        if self.at_blank_path_quantifier(&left) {
            let span = self.here();
            self.report(
                Diagnostic::new(
                    codes::UNEXPECTED_TOKEN,
                    span,
                    "a path quantifier is one word",
                )
                .help("write `A[]`, `A<>`, `E[]`, `E<>` without blanks"),
            );
        } else if self.at_end() || self.at_word("under") {
            let message = "this query has no path quantifier";
            self.report(
                Diagnostic::new(codes::MISSING_PATH_QUANTIFIER, left.span, message).help(
                    "write `E<> p` for \"p can be reached\" or `A[] p` for \"p always holds\"",
                ),
            );
        } else {
            self.expected("an operator, `-->` or the end of the query");
        }
        QueryKind::Reachable(left)
    }

    /// `E <> p` and `A [] p`
    fn at_blank_path_quantifier(&self, left: &Expr) -> bool {
        matches!(&left.kind, ExprKind::Name(name) if name == "A" || name == "E")
            && matches!(self.kind(), TokenKind::Diamond | TokenKind::Box)
    }

    /// `sup{predicate}: items`
    fn extremum(&mut self, extremum: Extremum) -> QueryKind {
        self.bump();
        let predicate = self.eat(TokenKind::LeftBrace).then(|| {
            let predicate = self.expression();
            self.closing(TokenKind::RightBrace, "after the predicate");
            predicate
        });
        self.expect(TokenKind::Colon, "before what is measured");
        QueryKind::Extremum {
            extremum,
            predicate,
            items: self.expression_list(),
        }
    }

    /// `{a, b} control: …`
    fn observed_control(&mut self) -> QueryKind {
        self.bump();
        let observations = if self.at(TokenKind::RightBrace) {
            Vec::new()
        } else {
            self.observations()
        };
        self.closing(TokenKind::RightBrace, "after the observations");
        if self.at(TokenKind::Unknown) {
            self.expected("`control:` after the observations");
        } else if !self.at_word("control") {
            let message = format!(
                "expected `control:` after the observations, found {}",
                self.found()
            );
            let diagnostic = Diagnostic::new(codes::UNEXPECTED_TOKEN, self.here(), message)
                .help("write {…} control: with A<> p, A[] p, A[ p U q ] or A[ p W q ]; other queries have no observations");
            self.report(diagnostic);
        }
        self.control(false, Some(observations))
    }

    fn observations(&mut self) -> Vec<ObservedPredicate> {
        let mut list = Vec::new();
        self.comma_separated(|parser| {
            let start = parser.here();
            let predicate = parser.expression();
            let span = parser.since(start);
            list.push(ObservedPredicate { predicate, span });
        });
        list
    }

    /// `control: objective`
    fn control(
        &mut self,
        cooperative: bool,
        observations: Option<Vec<ObservedPredicate>>,
    ) -> QueryKind {
        self.eat_word("control");
        self.expect(TokenKind::Colon, "after `control`");
        QueryKind::Control(Control {
            objective: self.objective(),
            cooperative,
            time_optimal: None,
            observations,
        })
    }

    /// `control_t*(u, g): objective`
    fn time_optimal_control(&mut self) -> QueryKind {
        self.bump();
        self.expect(TokenKind::Star, "after `control_t`");
        let mut bounds = (None, None);
        if self.eat(TokenKind::LeftParenthesis) {
            bounds.0 = Some(self.expression());
            if self.eat(TokenKind::Comma) {
                bounds.1 = Some(self.expression());
            }
            self.closing(TokenKind::RightParenthesis, "after the bounds");
        }
        self.expect(TokenKind::Colon, "before the objective");
        QueryKind::Control(Control {
            objective: self.objective(),
            cooperative: false,
            time_optimal: Some(bounds),
            observations: None,
        })
    }

    fn objective(&mut self) -> Objective {
        match self.kind() {
            TokenKind::AlwaysFinally => {
                self.bump();
                Objective::Reach(self.expression())
            }
            TokenKind::AlwaysGlobally => {
                self.bump();
                match self.buchi() {
                    Some(buchi) => buchi,
                    None => Objective::Safe(self.expression()),
                }
            }
            TokenKind::Word if self.at_word("A") && self.peek(1).kind == TokenKind::LeftBracket => {
                match self.until() {
                    Some(until) => until,
                    None => Objective::Reach(self.error_expr()),
                }
            }
            _ => self.invalid_objective(),
        }
    }

    fn invalid_objective(&mut self) -> Objective {
        let span = self.here();
        self.report(
            Diagnostic::new(codes::INVALID_OBJECTIVE, span, "this is not an objective of a game").help(
                "write `A<> p`, `A[] p`, `A[ p U q ]`, `A[ p W q ]` or `A[] (p && A<> q)` after `control:`",
            ),
        );
        self.skip_query();
        Objective::Reach(self.error_expr())
    }

    /// `A[ p U q ]` and `A[ p W q ]`; `None` was reported.
    fn until(&mut self) -> Option<Objective> {
        self.bump();
        self.bump();
        let hold = self.expression();
        let weak = self.at_word("W");
        if !weak && !self.at_word("U") {
            self.expected("`U` or `W` inside `A[ … ]`");
            return None;
        }
        self.bump();
        let goal = self.expression();
        self.closing(TokenKind::RightBracket, "after the goal");
        Some(if weak {
            Objective::WeakUntil(hold, goal)
        } else {
            Objective::Until(hold, goal)
        })
    }

    /// `(p && A<> q)` behind `A[]`; without a trace if it is something else.
    fn buchi(&mut self) -> Option<Objective> {
        if !self.at(TokenKind::LeftParenthesis) {
            return None;
        }
        let checkpoint = self.checkpoint();
        self.bump();
        let mut conjuncts = vec![self.expression_at(level::AND + 1)];
        while self.at(TokenKind::AndAnd) || self.at_word("and") {
            self.bump();
            if self.eat(TokenKind::AlwaysFinally) {
                let goal = self.expression();
                self.closing(TokenKind::RightParenthesis, "after the goal");
                let hold = join_all(super::ast::BinaryOp::And, conjuncts)?;
                return Some(Objective::Buchi(hold, goal));
            }
            conjuncts.push(self.expression_at(level::AND + 1));
        }
        self.rewind(&checkpoint);
        None
    }

    fn file_name(&mut self) -> String {
        let token = self.token();
        if self.expect(TokenKind::String, "with the name of a file") {
            let text = self.text_of(token);
            return text[1..text.len() - 1].to_owned();
        }
        self.skip_to(&[TokenKind::Comma, TokenKind::RightParenthesis]);
        String::new()
    }

    /// `saveStrategy("file", S)`
    fn save_strategy(&mut self) -> QueryKind {
        self.bump();
        self.expect(TokenKind::LeftParenthesis, "after `saveStrategy`");
        let file = self.file_name();
        let mut strategy = Name {
            span: self.here(),
            ..Name::default()
        };
        if self.expect(TokenKind::Comma, "after the name of the file") {
            strategy = self.name("the name of a strategy");
        }
        self.closing(TokenKind::RightParenthesis, "after the strategy");
        QueryKind::SaveStrategy { file, strategy }
    }

    /// `loadStrategy {discrete} -> {continuous} ("file")`
    fn load_strategy(&mut self) -> QueryKind {
        self.bump();
        let features = self.features();
        self.expect(TokenKind::LeftParenthesis, "before the name of the file");
        let file = self.file_name();
        self.closing(TokenKind::RightParenthesis, "after the name of the file");
        QueryKind::LoadStrategy { file, features }
    }
}

fn yields_strategy(kind: &QueryKind) -> bool {
    match kind {
        QueryKind::Control(_)
        | QueryKind::LoadStrategy { .. }
        | QueryKind::Optimum(_)
        | QueryKind::Shield(_) => true,
        QueryKind::Unsupported(name) => !matches!(name.text.as_str(), "statistical model checking"),
        _ => false,
    }
}

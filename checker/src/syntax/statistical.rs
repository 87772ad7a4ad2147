//! Statistical queries: `Pr[bound](path)`, alone or compared with a number,
//! `E[bound; runs](max: e)`, and `simulate [bound; runs] {a, b}`.
//!
//! Source: UPPAAL's language reference, "Statistical Queries".

use super::ast::{
    BinaryOp, Estimated, Expr, ExprKind, Path, QueryKind, RunBound, RunLimit, Statistical,
};
use super::lexer::TokenKind;
use super::parser::Parser;

impl Parser<'_> {
    /// A statistical query; what is not read (yet) is known by its name only.
    pub(super) fn statistical(&mut self) -> QueryKind {
        let checkpoint = self.checkpoint();
        let query = self.statistical_query();
        let is_whole = self.at_end() || self.at_word("under");
        match query {
            Some(query) if is_whole && self.is_clean_since(&checkpoint) => {
                QueryKind::Statistical(query)
            }
            _ => {
                self.rewind(&checkpoint);
                self.unsupported_query("statistical model checking")
            }
        }
    }

    fn statistical_query(&mut self) -> Option<Statistical> {
        if self.eat_word("simulate") {
            return self.simulation();
        }
        let is_expectation = self.at_word("E");
        if !(is_expectation || self.at_word("Pr")) {
            return None;
        }
        self.bump();
        let bound = self.run_bound()?;
        if !self.eat(TokenKind::LeftParenthesis) {
            return None;
        }
        if is_expectation {
            let maximum = self.at_word("max");
            if !(maximum || self.at_word("min")) {
                return None;
            }
            self.bump();
            let is_prefix = self.eat(TokenKind::Colon);
            let value = self.expression();
            let is_closed = self.eat(TokenKind::RightParenthesis);
            return (is_prefix && is_closed).then_some(Statistical::Expectation {
                bound,
                maximum,
                value,
            });
        }
        let path = self.path()?;
        if !self.eat(TokenKind::RightParenthesis) {
            return None;
        }
        let estimated = Estimated { bound, path };
        let at_least = self.at(TokenKind::GreaterEqual);
        if !(at_least || self.at(TokenKind::LessEqual)) {
            return Some(Statistical::Probability(estimated));
        }
        self.bump();
        if self.at_word("Pr") {
            return None;
        }
        Some(Statistical::Hypothesis {
            estimated,
            at_least,
            threshold: self.expression(),
        })
    }

    /// `simulate [<=10; 5] {a, b} : 2 : p`, and the old form, `simulate 5 [<=10] {a, b} : 2 : p`.
    fn simulation(&mut self) -> Option<Statistical> {
        let old_runs = match self.kind() {
            TokenKind::LeftBracket => None,
            TokenKind::LeftParenthesis => Some(self.expression()),
            _ => Some(self.lone_operand()?),
        };
        let mut bound = self.run_bound()?;
        if let Some(runs) = old_runs {
            if bound.runs.is_some() {
                return None;
            }
            bound.runs = Some(runs);
        }
        if !self.eat(TokenKind::LeftBrace) {
            return None;
        }
        let items = self.expression_list();
        if !self.eat(TokenKind::RightBrace) {
            return None;
        }
        let mut filter = None;
        if self.eat(TokenKind::Colon) {
            let first = self.expression();
            filter = Some(if self.eat(TokenKind::Colon) {
                (Some(first), self.expression())
            } else {
                (None, first)
            });
        }
        Some(Statistical::Simulation {
            bound,
            items,
            filter,
        })
    }

    /// A number or a name, without the bracket behind it.
    fn lone_operand(&mut self) -> Option<Expr> {
        let token = self.bump();
        let span = self.span_of(token);
        let text = self.text_of(token);
        let kind = match token.kind {
            TokenKind::Word => ExprKind::Name(text.to_owned()),
            _ => ExprKind::Int(text.parse().ok()?),
        };
        Some(Expr { kind, span })
    }

    /// `[<=10]`, `[x<=10]` or `[#<=10]`, each with a number of runs behind `;` or not.
    fn run_bound(&mut self) -> Option<RunBound> {
        let start = self.here();
        if !self.eat(TokenKind::LeftBracket) {
            return None;
        }
        let counts_moves = self.eat(TokenKind::Hash);
        let (limit, value) = if self.eat(TokenKind::LessEqual) {
            let limit = if counts_moves {
                RunLimit::Moves
            } else {
                RunLimit::Time
            };
            (limit, self.expression())
        } else {
            let bound = self.expression();
            clock_bound(bound).filter(|_| !counts_moves)?
        };
        let runs = self.eat(TokenKind::Semicolon).then(|| self.expression());
        let span = self.since(start);
        self.eat(TokenKind::RightBracket).then_some(RunBound {
            limit,
            value,
            runs,
            span,
        })
    }

    fn path(&mut self) -> Option<Path> {
        if self.eat(TokenKind::Diamond) {
            return Some(Path::Eventually(self.expression()));
        }
        if self.eat(TokenKind::Box) {
            return Some(Path::Always(self.expression()));
        }
        let keep = self.expression();
        self.eat_word("U")
            .then(|| Path::Until(keep, self.expression()))
    }
}

/// `x<=10` as a limit and its value.
fn clock_bound(bound: Expr) -> Option<(RunLimit, Expr)> {
    match bound.kind {
        ExprKind::Binary(BinaryOp::LessEqual, clock, value) => {
            Some((RunLimit::Clock(*clock), *value))
        }
        _ => None,
    }
}

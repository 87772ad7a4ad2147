//! Statistical queries: `Pr[bound](path)`, alone or compared with a number or another probability,
//! `E[bound; runs](max: e)`, and `simulate [bound; runs] {a, b}`.
//!
//! Source: UPPAAL's language reference, "Statistical Queries". Forms of older versions are read,
//! too: `simulate 5 [<=10] {a}`, and `?` behind a probability.

use super::ast::{
    BinaryOp, Estimated, Expr, ExprKind, QueryKind, RunBound, RunLimit, Shown, Statistical,
};
use super::codes;
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::Diagnostic;

impl Parser<'_> {
    /// A statistical query.
    pub(super) fn statistical(&mut self) -> QueryKind {
        let query = if self.eat_word("simulate") {
            self.simulation()
        } else if self.at_word("E") {
            self.bump();
            self.expectation()
        } else {
            self.bump();
            self.probability()
        };
        QueryKind::Statistical(query)
    }

    /// `[bound](path)`, with what it is compared with.
    fn probability(&mut self) -> Statistical {
        let mut estimated = self.estimated();
        if self.at_word("under") && is_comparison(self.peek(2).kind) {
            estimated.under = self.strategy_behind("under");
        }
        let at_least = self.at(TokenKind::GreaterEqual);
        if !(at_least || self.at(TokenKind::LessEqual)) {
            self.expect_no_other_comparison();
            return Statistical::Probability(estimated);
        }
        self.bump();
        if self.eat_word("Pr") {
            return Statistical::Comparison {
                left: Box::new(estimated),
                right: Box::new(self.estimated()),
                at_least,
            };
        }
        Statistical::Hypothesis {
            estimated,
            at_least,
            threshold: self.expression(),
        }
    }

    /// `>`, `==`, `=` are no tests; `?` was how older versions asked for an estimate.
    fn expect_no_other_comparison(&mut self) {
        let old_mark = self.eat(TokenKind::Question);
        if is_comparison(self.kind()) && !old_mark {
            let (span, found) = (self.here(), self.found());
            let message = format!("a probability is not compared by {found}");
            self.report(
                Diagnostic::new(codes::UNEXPECTED_TOKEN, span, message).help(
                    "write `>=` or `<=` with a number or another Pr, or nothing to estimate it",
                ),
            );
            self.skip_rest();
        }
    }

    /// Leaves the rest unread because of a mistake.
    fn skip_rest(&mut self) {
        self.skip_query();
        self.suppress_reports();
    }

    fn estimated(&mut self) -> Estimated {
        let bound = self.at(TokenKind::LeftBracket).then(|| self.run_bound());
        let is_open = self.eat(TokenKind::LeftParenthesis);
        if !is_open {
            self.expected_with_hint(
                "`(` before what is asked of a run",
                "write `Pr[<=10](<> p)`",
            );
        }
        let path = self.path();
        if is_open {
            self.closing(TokenKind::RightParenthesis, "after what is asked of a run");
        } else {
            self.skip_rest();
        }
        Estimated {
            bound,
            path,
            under: None,
        }
    }

    /// `[bound; runs](max: e)`
    fn expectation(&mut self) -> Statistical {
        let bound = self.run_bound();
        self.expect(TokenKind::LeftParenthesis, "before what is measured");
        let maximum = self.at_word("max");
        if maximum || self.at_word("min") {
            self.bump();
        } else {
            self.expected_with_hint(
                "`max:` or `min:`",
                "write `E[<=10; 100](max: e)` or `E[<=10; 100](min: e)`",
            );
            self.skip_rest();
        }
        self.expect(TokenKind::Colon, "before what is measured");
        let value = self.expression();
        self.closing(TokenKind::RightParenthesis, "after what is measured");
        Statistical::Expectation {
            bound,
            maximum,
            value,
        }
    }

    /// `[<=10; 5] {a, b} : 2 : p`, and the old form, `5 [<=10] {a, b} : 2 : p`.
    fn simulation(&mut self) -> Statistical {
        let old_runs = match self.kind() {
            TokenKind::LeftBracket => None,
            TokenKind::LeftParenthesis => Some(self.parenthesised()),
            _ => self.lone_operand(),
        };
        let mut bound = self.run_bound();
        if let Some(runs) = old_runs {
            if bound.runs.is_some() {
                self.report_earlier(
                    Diagnostic::new(
                        codes::UNEXPECTED_TOKEN,
                        runs.span,
                        "the number of runs is given twice",
                    )
                    .help("write it behind the bound only: simulate [<=10; 5] {…}"),
                );
            }
            bound.runs = Some(runs);
        }
        if !self.expect(TokenKind::LeftBrace, "before what is shown") {
            self.skip_rest();
        }
        let mut items = vec![self.shown()];
        while self.eat(TokenKind::Comma) && !self.at(TokenKind::RightBrace) {
            items.push(self.shown());
        }
        self.closing(TokenKind::RightBrace, "after what is shown");
        let mut filter = None;
        if self.eat(TokenKind::Colon) {
            let first = self.expression();
            filter = Some(if self.eat(TokenKind::Colon) {
                (Some(first), self.expression())
            } else {
                (None, first)
            });
        }
        Statistical::Simulation {
            bound,
            items,
            filter,
        }
    }

    /// `a`, or `foreach (name : type) a`
    fn shown(&mut self) -> Shown {
        let is_each = self.eat_word("foreach");
        let each = is_each.then(|| self.bound_variable("after foreach"));
        Shown {
            each,
            value: self.expression(),
        }
    }

    /// A number or a name, without the bracket behind it.
    fn lone_operand(&mut self) -> Option<Expr> {
        let (token, span) = (self.token(), self.here());
        let text = self.text_of(token);
        let kind = match token.kind {
            TokenKind::Word => ExprKind::Name(text.to_owned()),
            TokenKind::Int => text.parse().map_or(ExprKind::Error, ExprKind::Int),
            _ => {
                self.expected("the bound of the runs, or their number");
                return None;
            }
        };
        if matches!(kind, ExprKind::Error) {
            let message = "this number does not fit into an integer";
            self.error(codes::NUMBER_TOO_LARGE, span, message);
        }
        self.bump();
        Some(Expr { kind, span })
    }

    /// `[<=10]`, `[x<=10]` or `[#<=10]`, each with a number of runs behind `;` or not.
    pub(super) fn run_bound(&mut self) -> RunBound {
        self.expect(TokenKind::LeftBracket, "before the bound of the runs");
        let (limit, value) = if self.eat(TokenKind::Hash) {
            self.expect(TokenKind::LessEqual, "before the number of moves");
            (RunLimit::Moves, self.expression())
        } else if self.eat(TokenKind::LessEqual) {
            (RunLimit::Time, self.expression())
        } else {
            self.clock_bound()
        };
        let runs = self.eat(TokenKind::Semicolon).then(|| self.expression());
        self.closing(TokenKind::RightBracket, "after the bound of the runs");
        RunBound { limit, value, runs }
    }

    /// `x<=10` as a limit and its value.
    fn clock_bound(&mut self) -> (RunLimit, Expr) {
        let bound = self.expression();
        match bound.kind {
            ExprKind::Binary(BinaryOp::LessEqual, clock, value) => {
                (RunLimit::Clock(*clock), *value)
            }
            ExprKind::Error => (RunLimit::Time, bound),
            _ => {
                let message = "this does not bound the runs";
                self.report_earlier(
                    Diagnostic::new(codes::UNEXPECTED_TOKEN, bound.span, message)
                        .help("write [<=10], [x<=10] for a clock x, or [#<=10] for ten moves"),
                );
                let kind = ExprKind::Error;
                (RunLimit::Time, Expr { kind, ..bound })
            }
        }
    }
}

/// Whether a probability might be compared by this.
fn is_comparison(token: TokenKind) -> bool {
    matches!(
        token,
        TokenKind::Less
            | TokenKind::LessEqual
            | TokenKind::Greater
            | TokenKind::GreaterEqual
            | TokenKind::EqualEqual
            | TokenKind::Assign
            | TokenKind::NotEqual
    )
}

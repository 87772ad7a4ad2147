//! Queries for the best strategy, `minE(e)[bound] {d} -> {c} : <> p` and its kin, and for shields,
//! `acontrol: A[] p {…}`.
//!
//! Source: UPPAAL's language reference, "Learning queries" and "Approximate control"; the grammar
//! of utap, which has no `[]` behind the colon, and no query without a goal. Older versions had the
//! latter, which is read with a hint.

use super::ast::{Features, Measured, Optimum, QueryKind, Shield, ShieldAxis};
use super::codes;
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::Diagnostic;

impl Parser<'_> {
    /// `minE(e)[bound] {d} -> {c} : <> p`, `maxE`, `minPr` or `maxPr`.
    pub(super) fn optimum(&mut self) -> QueryKind {
        let (word, span) = (self.word().to_owned(), self.here());
        self.bump();
        let is_expected = word.ends_with('E');
        let price = self.at(TokenKind::LeftParenthesis).then(|| self.price());
        if price.is_some() && !is_expected {
            let message =
                format!("`{word}` has no expression: it is for the probability of `<> p`");
            let diagnostic = Diagnostic::new(codes::OPTIMUM_EXPRESSION, span, message);
            self.report_earlier(diagnostic.help(format!("write `{word}[<=10]: <> p`")));
        }
        let bound = self.run_bound();
        let features = self.features();
        let goal = self.goal(is_expected);
        let end = self.since(span);
        if is_expected && price.is_none() {
            let message = "this has no expression, so each unit of time costs 1";
            let help = format!("write `{word}(time)[<=10]: <> p` for a clock `time`");
            self.report_earlier(
                Diagnostic::new(codes::OPTIMUM_WITHOUT_PRICE, end, message).help(help),
            );
        }
        if goal.is_none() && !is_expected {
            let message = format!("`{word}` needs a goal: it is for the probability of `<> p`");
            let diagnostic = Diagnostic::new(codes::OPTIMUM_GOAL, end, message);
            self.report_earlier(diagnostic.help(format!("write `{word}[<=10]: <> p`")));
        }
        QueryKind::Optimum(Optimum {
            is_greatest: word.starts_with("max"),
            measured: if is_expected {
                Measured::Expected(price)
            } else {
                Measured::Probability
            },
            bound,
            features,
            goal,
        })
    }

    /// `(e)`
    fn price(&mut self) -> super::ast::Expr {
        self.bump();
        let price = self.expression();
        self.closing(TokenKind::RightParenthesis, "after what is optimised");
        price
    }

    /// `: <> p`, if it is there.
    fn goal(&mut self, may_lack: bool) -> Option<super::ast::Expr> {
        let span = self.here();
        if !self.eat(TokenKind::Colon) {
            let is_over = self.at_end() || self.at_word("under") || self.at_word("imitate");
            if is_over && !may_lack {
                return None;
            }
            if is_over {
                let message = "this has no goal, so a run ends at its bound only";
                let diagnostic = Diagnostic::new(codes::OPTIMUM_WITHOUT_GOAL, span, message);
                self.report(diagnostic.help("write `: <> p` behind the bound"));
            } else {
                self.expected_with_hint("`:` before the goal", "write `minE(e)[<=10]: <> p`");
                self.skip_query();
                self.suppress_reports();
            }
            return None;
        }
        let quantifier = self.here();
        if !self.eat(TokenKind::Diamond) {
            let found = self.found();
            let message =
                format!("a run ends where the goal behind `<>` holds, but this is {found}");
            let diagnostic = Diagnostic::new(codes::OPTIMUM_GOAL, quantifier, message);
            self.report(diagnostic.help("write `: <> p`; what must never happen is priced, or excluded by `under` a safe strategy"));
            self.bump();
        }
        Some(self.expression())
    }

    /// `{discrete} -> {continuous}`, if it is there.
    pub(super) fn features(&mut self) -> Option<Features> {
        if !self.at(TokenKind::LeftBrace) {
            return None;
        }
        let discrete = self.feature_list();
        if !self.eat(TokenKind::Arrow) {
            self.expected_with_hint(
                "`->` between the features",
                "write `{a, b} -> {x}`: exact values, and values in intervals; either may be `{}`",
            );
        }
        let continuous = self.feature_list();
        Some(Features {
            discrete,
            continuous,
        })
    }

    fn feature_list(&mut self) -> Vec<super::ast::Expr> {
        self.expect(TokenKind::LeftBrace, "before the features");
        let list = if self.at(TokenKind::RightBrace) {
            Vec::new()
        } else {
            self.expression_list()
        };
        self.closing(TokenKind::RightBrace, "after the features");
        list
    }

    /// `acontrol: A[] p { P.location, i[0,5], x[-13,13]:1300 }`
    pub(super) fn shield(&mut self) -> QueryKind {
        self.bump();
        self.expect(TokenKind::Colon, "after `acontrol`");
        if !self.eat(TokenKind::AlwaysGlobally) {
            self.expected_with_hint("`A[]`", "write `acontrol: A[] p { x[0,10]:100 }`");
        }
        let invariant = self.expression();
        self.expect(TokenKind::LeftBrace, "before what the shield sees");
        let mut axes = vec![self.shield_axis()];
        while self.eat(TokenKind::Comma) {
            axes.push(self.shield_axis());
        }
        self.closing(TokenKind::RightBrace, "after what the shield sees");
        QueryKind::Shield(Shield { invariant, axes })
    }

    fn shield_axis(&mut self) -> ShieldAxis {
        let span = self.here();
        let place = self.plain_place();
        let bounds = self.eat(TokenKind::LeftBracket).then(|| {
            let low = self.expression();
            self.expect(TokenKind::Comma, "between the bounds");
            let high = self.expression();
            self.closing(TokenKind::RightBracket, "after the bounds");
            Box::new([low, high])
        });
        let cells = self.eat(TokenKind::Colon).then(|| self.expression());
        ShieldAxis {
            place,
            bounds,
            cells,
            span: self.since(span),
        }
    }
}

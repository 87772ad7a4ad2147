//! Formulas over time, in `Pr[bound](f)` and `Pr(f)`: `X`, `U`, `R`, `<>` and `[]`, with `[a,b]`
//! behind them or without.
//!
//! An operator over time binds more loosely than all others, and its last operand extends as far to
//! the right as it can: `p && q U[0,1] r || s` is `(p && q) U[0,1] (r || s)`. So does the body of a
//! quantifier. What holds no such operator is read as an expression, so conditions on states are
//! the same as in all queries.
//!
//! Source: UPPAAL's grammar of MITL. Where we differ: operators over time need no parentheses
//! around them, and bounds are any constant expressions.

use super::ast::{Formula, Interval, Path};
use super::codes;
use super::expressions::level;
use super::lexer::TokenKind;
use super::parser::{MAX_HEIGHT, Parser};

impl Parser<'_> {
    /// What is asked of a run.
    pub(super) fn path(&mut self) -> Path {
        match self.formula() {
            Formula::Eventually(None, goal) => match *goal {
                Formula::State(goal) => Path::Eventually(goal),
                other => Path::Formula(Formula::Eventually(None, Box::new(other))),
            },
            Formula::Always(None, keep) => match *keep {
                Formula::State(keep) => Path::Always(keep),
                other => Path::Formula(Formula::Always(None, Box::new(other))),
            },
            Formula::Until(None, keep, goal) => match (*keep, *goal) {
                (Formula::State(keep), Formula::State(goal)) => Path::Until(keep, goal),
                (keep, goal) => Path::Formula(Formula::Until(None, Box::new(keep), Box::new(goal))),
            },
            other => Path::Formula(other),
        }
    }

    fn formula(&mut self) -> Formula {
        match self.nested(Parser::until_or_release) {
            Some(formula) => formula,
            None => Formula::State(self.error_expr()),
        }
    }

    /// A formula of one level more than the last one that was read, and than another of the given
    /// height.
    fn level_above(&mut self, other_height: u32, formula: Formula) -> Formula {
        self.height = self.height.max(other_height) + 1;
        if self.height > MAX_HEIGHT {
            let message = format!("this formula has more than {MAX_HEIGHT} levels of operators");
            self.error(codes::NESTING_TOO_DEEP, self.here(), message);
            return Formula::State(self.error_expr());
        }
        formula
    }

    fn until_or_release(&mut self) -> Formula {
        let left = self.disjunction();
        let is_until = self.at_word("U");
        if !is_until && !self.at_word("R") {
            return left;
        }
        let height = self.height;
        self.bump();
        let interval = self.interval();
        let right = Box::new(self.formula());
        let formula = if is_until {
            Formula::Until(interval, Box::new(left), right)
        } else {
            Formula::Release(interval, Box::new(left), right)
        };
        self.level_above(height, formula)
    }

    fn disjunction(&mut self) -> Formula {
        if let Some(state) = self.state_operand(level::ASSIGNMENT) {
            return state;
        }
        let mut left = self.conjunction();
        loop {
            let is_or = self.at(TokenKind::OrOr) || self.at_word("or");
            if !is_or && !self.at_word("imply") {
                return left;
            }
            let height = self.height + u32::from(!is_or);
            self.bump();
            if !is_or {
                left = Formula::Not(Box::new(left));
            }
            let right = self.conjunction();
            left = self.level_above(height, Formula::Or(Box::new(left), Box::new(right)));
        }
    }

    fn conjunction(&mut self) -> Formula {
        if let Some(state) = self.state_operand(level::AND) {
            return state;
        }
        let mut left = self.operand();
        while self.at(TokenKind::AndAnd) || self.at_word("and") {
            let height = self.height;
            self.bump();
            let right = self.operand();
            left = self.level_above(height, Formula::And(Box::new(left), Box::new(right)));
        }
        left
    }

    fn operand(&mut self) -> Formula {
        if let Some(state) = self.state_operand(level::AND + 1) {
            return state;
        }
        match self.kind() {
            kind @ (TokenKind::Diamond | TokenKind::Box) => {
                self.bump();
                let (interval, inner) = (self.interval(), Box::new(self.formula()));
                let formula = if kind == TokenKind::Diamond {
                    Formula::Eventually(interval, inner)
                } else {
                    Formula::Always(interval, inner)
                };
                self.level_above(0, formula)
            }
            TokenKind::Word if self.at_next() => {
                self.bump();
                let inner = self.formula();
                self.level_above(0, Formula::Next(Box::new(inner)))
            }
            TokenKind::Exclamation => self.negation(),
            TokenKind::Word if self.at_word("not") => self.negation(),
            TokenKind::Word if self.at_word("forall") || self.at_word("exists") => {
                self.quantified_formula()
            }
            TokenKind::LeftParenthesis => {
                self.bump();
                let inner = self.formula();
                self.closing(TokenKind::RightParenthesis, "to close the parenthesis");
                inner
            }
            _ => Formula::State(self.expression_at(level::AND + 1)),
        }
    }

    /// `forall (name : type) f`, and the same with `exists`.
    fn quantified_formula(&mut self) -> Formula {
        let is_for_all = self.at_word("forall");
        self.bump();
        let (name, ty) = self.bound_variable("after the quantifier");
        let height = self.height;
        let inner = Box::new(self.formula());
        self.level_above(height, Formula::Quantified(is_for_all, name, ty, inner))
    }

    fn negation(&mut self) -> Formula {
        self.bump();
        match self.nested(Parser::operand) {
            Some(inner) => self.level_above(0, Formula::Not(Box::new(inner))),
            None => Formula::State(self.error_expr()),
        }
    }

    /// Whether `X` begins here: it is a name if an operator follows it.
    fn at_next(&self) -> bool {
        let begins = matches!(
            self.peek(1).kind,
            TokenKind::LeftParenthesis
                | TokenKind::Word
                | TokenKind::Int
                | TokenKind::Double
                | TokenKind::Exclamation
                | TokenKind::Diamond
                | TokenKind::Box
        );
        let joins = ["and", "or", "xor", "imply", "U", "R"];
        self.at_word("X") && begins && !joins.contains(&self.word_at(1))
    }

    /// An expression whose operators bind at least as tightly as `least`, if what follows it can
    /// follow an operand of a formula.
    fn state_operand(&mut self, least: u8) -> Option<Formula> {
        let begins_with_operator =
            matches!(self.kind(), TokenKind::Diamond | TokenKind::Box) || self.at_next();
        if begins_with_operator {
            return None;
        }
        let checkpoint = self.checkpoint();
        let state = self.expression_at(least);
        let is_over = match self.kind() {
            TokenKind::RightParenthesis | TokenKind::End => true,
            TokenKind::AndAnd | TokenKind::OrOr => least > level::ASSIGNMENT,
            _ if ["and", "or", "imply"].iter().any(|word| self.at_word(word)) => {
                least > level::ASSIGNMENT
            }
            _ => self.at_word("U") || self.at_word("R"),
        };
        if is_over && self.is_clean_since(&checkpoint) {
            return Some(Formula::State(state));
        }
        self.rewind(&checkpoint);
        None
    }

    /// `[a,b]` behind an operator over time.
    fn interval(&mut self) -> Option<Interval> {
        let start = self.here();
        if !self.eat(TokenKind::LeftBracket) {
            return None;
        }
        let from = self.expression();
        let to = if self.expect(TokenKind::Comma, "between the bounds of the operator") {
            self.expression()
        } else {
            self.error_expr()
        };
        self.closing(TokenKind::RightBracket, "after the bounds of the operator");
        let span = self.since(start);
        Some(Interval { from, to, span })
    }
}

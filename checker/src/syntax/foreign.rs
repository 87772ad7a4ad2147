//! Symbols and words of other notations, and what to write instead: hints for texts that people
//! write who know another language better.

use super::keywords::Dialect;
use super::lexer::TokenKind;
use super::parser::Parser;

/// Words that are no operators, with those that are.
const FOREIGN_OPERATORS: [(&str, &str); 12] = [
    ("AND", "`and` or `&&`"),
    ("OR", "`or` or `||`"),
    ("NOT", "`not` or `!`"),
    ("implies", "`imply`"),
    ("IMPLY", "`imply`"),
    ("then", "`p imply q` for \"if p then q\""),
    ("if", "`p imply q` for \"if p then q\""),
    ("iff", "`==`"),
    ("is", "`==`"),
    ("equals", "`==`"),
    ("mod", "`%`"),
    ("div", "`/`"),
];

impl Parser<'_> {
    /// What to write instead of the current token, which the grammar does not expect here.
    pub(super) fn foreign_hint(&self) -> Option<String> {
        let is_query = self.dialect == Dialect::Query;
        if matches!(self.previous_word(), "if" | "while") {
            let hint = if is_query {
                "write `p imply q` for \"if p then q\""
            } else {
                "write the condition in parentheses"
            };
            return Some(hint.to_owned());
        }
        let hint = match self.kind() {
            TokenKind::Word => return self.foreign_word(is_query),
            TokenKind::Arrow if is_query => {
                "write `p imply q` if q holds whenever p does, `p --> q` if q comes after p"
            }
            TokenKind::LeadsTo if is_query => "write `p --> q` alone, without a path quantifier",
            TokenKind::Diamond if is_query && self.follows_value() => "write `!=` for \"is not\"",
            TokenKind::Diamond | TokenKind::Box if is_query => {
                "a query has one path quantifier, at its start: A[], A<>, E[] or E<>"
            }
            TokenKind::Diamond if self.follows_value() => "write `!=` for \"is not\"",
            TokenKind::Assign if self.previous_kind() == Some(TokenKind::EqualEqual) => {
                "write `==` to compare"
            }
            TokenKind::Greater if self.previous_kind() == Some(TokenKind::LessEqual) => {
                "write `==` for \"if and only if\""
            }
            TokenKind::Semicolon if is_query => "leave it out: a query ends with its line",
            TokenKind::RightParenthesis if is_query => "remove it: no `(` belongs to it",
            TokenKind::Apostrophe => "write names without quotation marks",
            TokenKind::Colon if is_query => "write `P.l` for the location l of the process P",
            TokenKind::Hash => "write `const int N = 3;` for a constant: there is no preprocessor",
            _ => return None,
        };
        Some(hint.to_owned())
    }

    fn foreign_word(&self, is_query: bool) -> Option<String> {
        let (word, before) = (self.word(), self.previous_word());
        if is_query {
            if matches!((before, word), ("no", "deadlock") | ("deadlock", "free")) {
                return Some("write `A[] not deadlock`".to_owned());
            }
            if matches!(before, "sup" | "inf" | "bounds") {
                return Some(format!("write `{before}: {word}`"));
            }
        }
        if matches!(before, "forall" | "exists" | "sum") {
            return Some(format!("write `{before} ({word} : int[0,3])`"));
        }
        if word == "update" {
            return Some("write `assign`".to_owned());
        }
        if self.follows_value() || word == "if" {
            let operator = FOREIGN_OPERATORS.iter().find(|one| one.0 == word);
            if let Some((_, meant)) = operator {
                return Some(format!("write {meant}"));
            }
        }
        None
    }

    /// Whether the token before this one can be the end of a value.
    fn follows_value(&self) -> bool {
        use TokenKind as T;
        matches!(
            self.previous_kind(),
            Some(T::Word | T::Int | T::Double | T::RightParenthesis | T::RightBracket)
        )
    }
}

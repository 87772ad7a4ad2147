//! Textual models: XTA and the old TA syntax.

use super::ast::Document;
use super::codes;
use super::keywords::{self, Dialect};
use super::lexer::{Token, TokenKind, lex};
use super::parser::Parser;
use super::processes::{Part, query_texts};
use crate::diagnostics::{Diagnostic, SourceMap, Span, Text};

/// How many tokens of a parameter list are looked at to tell the syntax.
const LONGEST_PARAMETER_LIST: usize = 100;

/// Reads a textual model.
pub(super) fn read(
    path: &str,
    text: Text,
    sources: &mut SourceMap,
    diagnostics: &mut Vec<Diagnostic>,
) -> Document {
    let span = super::add_file(path, text, sources);
    let tokens = lex(&sources.get(span.source).text, span, &mut Vec::new());
    let text = &sources.get(span.source).text;
    let dialect = if is_old_syntax(text, &tokens) {
        Dialect::Old
    } else {
        Dialect::New
    };
    let reported = diagnostics.len();
    let mut document = Document::default();
    let mut parser = Parser::new(span, sources, dialect, diagnostics);
    let queries = parser.model(Part::Whole, &mut document);
    let has_mistakes = diagnostics[reported..].iter().any(Diagnostic::is_error);
    if has_mistakes && !looks_like_a_model(text, &tokens) {
        diagnostics.truncate(reported);
        let start = Span { end: 0, ..span };
        diagnostics.push(
            Diagnostic::new(codes::NOT_A_MODEL, start, "this text is not a UPPAAL model")
                .help("a model is an XML file that UPPAAL wrote, or a text in the XTA format"),
        );
    }
    document.queries = query_texts(&queries, sources);
    document
}

fn word(text: &str, token: Token) -> &str {
    if token.kind == TokenKind::Word {
        &text[token.start as usize..token.end as usize]
    } else {
        ""
    }
}

/// Prose has none of these words, and does not begin with a type.
fn looks_like_a_model(text: &str, tokens: &[Token]) -> bool {
    let begins = tokens.first().is_some_and(|&first| {
        let word = word(text, first);
        keywords::is_reserved(word, Dialect::New)
    });
    begins
        || tokens.iter().any(|&token| {
            matches!(
                word(text, token),
                "system" | "process" | "state" | "chan" | "clock"
            )
        })
}

/// Whether a text holds what only the old syntax has: constants without a type or a `=`, processes
/// without a list of parameters, and `;` between parameters. A word that only the new syntax has
/// decides otherwise: then it is a slip.
pub(super) fn is_old_syntax(text: &str, tokens: &[Token]) -> bool {
    let is_new = tokens.iter().any(|&token| {
        matches!(
            word(text, token),
            "typedef" | "struct" | "return" | "void" | "select" | "meta"
        )
    });
    if is_new {
        return false;
    }
    tokens.windows(3).enumerate().any(|(index, window)| {
        let [first, second, third] = [window[0], window[1], window[2]];
        let is_name = {
            let name = word(text, second);
            !name.is_empty() && !keywords::is_reserved(name, Dialect::New)
        };
        match word(text, first) {
            "const" => {
                is_name
                    && matches!(
                        third.kind,
                        TokenKind::Int | TokenKind::LeftBrace | TokenKind::Table | TokenKind::Minus
                    )
            }
            "process" if third.kind == TokenKind::LeftBrace => is_name,
            "process" => {
                is_name
                    && third.kind == TokenKind::LeftParenthesis
                    && tokens[index + 3..]
                        .iter()
                        .take(LONGEST_PARAMETER_LIST)
                        .find(|t| {
                            matches!(
                                t.kind,
                                TokenKind::Semicolon
                                    | TokenKind::RightParenthesis
                                    | TokenKind::LeftBrace
                            )
                        })
                        .is_some_and(|t| t.kind == TokenKind::Semicolon)
            }
            _ => false,
        }
    })
}

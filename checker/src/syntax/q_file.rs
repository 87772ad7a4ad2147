//! `.q` files: one query a line, with comments that may say what is expected.
//!
//! A line continues after a `\` at its end, and inside a block comment. A comment belongs to the
//! query on its line, or else to the next one. `EXPECT:` on a line of its own belongs to the next
//! query if the file's first one stands before the first query, and otherwise to the previous one.
//! This is how verifyta reads it.

use super::ast::{Expectation, QueryText};
use super::codes;
use crate::diagnostics::{Diagnostic, SourceMap, Span};

/// A piece of a `.q` file or of a formula.
enum Piece<'a> {
    /// Part of a query.
    Text,
    /// A comment, without its marks.
    Comment(&'a str),
    Blank,
    /// The end of a line that does not go on.
    LineEnd,
}

/// The texts of the queries in a file.
pub(super) fn split(
    file: Span,
    sources: &SourceMap,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<QueryText> {
    let mut splitter = Splitter {
        text: sources.text(file),
        file,
        queries: Vec::new(),
        line: None,
        comments: Vec::new(),
        expectation: None,
        expects_next: None,
        diagnostics,
    };
    splitter.run();
    splitter.queries
}

struct Splitter<'a> {
    text: &'a str,
    file: Span,
    queries: Vec<QueryText>,
    /// First byte, and one past the last one, of the query on the current line.
    line: Option<(usize, usize)>,
    /// Comments that await their query.
    comments: Vec<&'a str>,
    expectation: Option<Expectation>,
    /// Whether an `EXPECT:` on a line of its own speaks of the next query; the first one decides.
    expects_next: Option<bool>,
    diagnostics: &'a mut Vec<Diagnostic>,
}

impl<'a> Splitter<'a> {
    fn run(&mut self) {
        let mut position = 0;
        while let Some((piece, length)) = next_piece(self.text, position) {
            let end = position + length;
            match piece {
                Piece::Text => {
                    let start = self.line.map_or(position, |(start, _)| start);
                    self.line = Some((start, end));
                }
                Piece::Comment(comment) => self.comment(comment, position),
                Piece::LineEnd => self.end_line(),
                Piece::Blank => {}
            }
            position = end;
        }
        self.end_line();
    }

    fn comment(&mut self, comment: &'a str, position: usize) {
        if let Some(index) = comment.find("EXPECT:") {
            let tokens = comment[index + "EXPECT:".len()..]
                .split_whitespace()
                .next()
                .unwrap_or("");
            let expected = self.expectation_of(tokens, position);
            let next = *self.expects_next.get_or_insert(self.queries.is_empty());
            match self.queries.last_mut() {
                Some(previous) if self.line.is_none() && !next => {
                    previous.expect = expected.or(previous.expect.take());
                }
                _ => self.expectation = expected.or(self.expectation.take()),
            }
        } else if !comment.trim().is_empty() && comment.trim() != "NO_QUERY" {
            self.comments.push(comment.trim());
        }
    }

    fn expectation_of(&mut self, tokens: &str, position: usize) -> Option<Expectation> {
        let mut found = None;
        for token in tokens.split(',').filter(|token| !token.is_empty()) {
            let Ok(expected) = expectation(token) else {
                let span = self.file.part(position..position + 2);
                let message = format!("`{token}` is not an expectation");
                self.diagnostics.push(
                    Diagnostic::new(codes::UNKNOWN_EXPECTATION, span, message)
                        .help("known are T, F, MT, MF, E, numbers, and numbers with a unit"),
                );
                continue;
            };
            found = expected.or(found);
        }
        found
    }

    fn end_line(&mut self) {
        let Some((start, end)) = self.line.take() else {
            return;
        };
        self.queries.push(QueryText {
            span: self.file.part(start..end),
            text: collapsed(&self.text[start..end]),
            comment: self.comments.join("\n"),
            expect: self.expectation.take(),
            ..QueryText::default()
        });
        self.comments.clear();
    }
}

/// What an `EXPECT:` token says; `None` for a bound on time or memory, which no verdict depends on.
fn expectation(token: &str) -> Result<Option<Expectation>, ()> {
    Ok(Some(match token {
        "T" | "SAT" | "TRUE" => Expectation::True,
        "F" | "UNSAT" | "FALSE" => Expectation::False,
        "MT" => Expectation::MaybeTrue,
        "MF" => Expectation::MaybeFalse,
        "E" | "ERR" => Expectation::Error,
        _ => {
            let number = token.trim_end_matches(|c: char| c.is_ascii_uppercase());
            let value: f64 = number.parse().map_err(|_| ())?;
            return match &token[number.len()..] {
                "" => Ok(Some(Expectation::Number(value))),
                "B" | "KB" | "MB" | "GB" | "TB" | "MS" | "S" | "M" | "H" | "D" => Ok(None),
                _ => Err(()),
            };
        }
    }))
}

/// The expectation in the comments of a formula that stands elsewhere.
pub(super) fn expectation_in(text: &str) -> Option<Expectation> {
    let tokens = text
        .split_once("EXPECT:")?
        .1
        .split([' ', '\t', '\n', '*'])
        .next()?;
    tokens
        .split(',')
        .find_map(|token| expectation(token).ok().flatten())
}

/// A formula's text on one line: comments and continuation marks left out, blanks collapsed.
pub(super) fn collapsed(text: &str) -> String {
    let mut result = String::new();
    let (mut position, mut gap) = (0, false);
    while let Some((piece, length)) = next_piece(text, position) {
        if matches!(piece, Piece::Text) {
            if gap && !result.is_empty() {
                result.push(' ');
            }
            result.push_str(&text[position..position + length]);
        }
        gap = !matches!(piece, Piece::Text);
        position += length;
    }
    result
}

/// The file with blanks in the place of comments and continuation marks inside its queries; all
/// else keeps its place. `None` if there are no such comments and marks.
pub(super) fn plain(text: &str, queries: &[QueryText]) -> Option<String> {
    let mut plain = text.as_bytes().to_vec();
    for query in queries {
        let (mut position, end) = (query.span.start as usize, query.span.end as usize);
        while position < end {
            let (piece, length) = next_piece(text, position)?;
            let is_mark = matches!(piece, Piece::Blank) && text[position..].starts_with('\\');
            if is_mark || matches!(piece, Piece::Comment(_)) {
                let left_out = plain[position..position + length].iter_mut();
                left_out
                    .filter(|byte| **byte != b'\n')
                    .for_each(|byte| *byte = b' ');
            }
            position += length;
        }
    }
    String::from_utf8(plain).ok().filter(|plain| plain != text)
}

/// Where a formula starts and ends without the blanks and comments around it; `None` if there is
/// nothing else.
pub(super) fn trimmed(text: &str) -> Option<(usize, usize)> {
    let mut bounds = None;
    let mut position = 0;
    while let Some((piece, length)) = next_piece(text, position) {
        if matches!(piece, Piece::Text) {
            let start = bounds.map_or(position, |(start, _)| start);
            bounds = Some((start, position + length));
        }
        position += length;
    }
    bounds
}

/// The piece at a position and its length.
fn next_piece(text: &str, position: usize) -> Option<(Piece<'_>, usize)> {
    let rest = &text[position..];
    let first = rest.chars().next()?;
    if let Some(comment) = rest.strip_prefix("//") {
        let length = comment.find('\n').unwrap_or(comment.len());
        return Some((Piece::Comment(&comment[..length]), length + 2));
    }
    if let Some(comment) = rest.strip_prefix("/*") {
        return Some(match comment.find("*/") {
            Some(length) => (Piece::Comment(&comment[..length]), length + 4),
            // The parser of the query reports it.
            None => (Piece::Text, rest.len()),
        });
    }
    if first == '\n' {
        return Some((Piece::LineEnd, 1));
    }
    if first.is_ascii_whitespace() {
        return Some((Piece::Blank, 1));
    }
    if let Some(behind) = rest.strip_prefix('\\') {
        let blanks = behind.len() - behind.trim_start_matches([' ', '\t', '\r']).len();
        if behind[blanks..].starts_with('\n') {
            return Some((Piece::Blank, blanks + 2));
        }
    }
    if let Some(string) = rest.strip_prefix('"')
        && let Some(end) = string.find(['"', '\n'])
        && string[end..].starts_with('"')
    {
        return Some((Piece::Text, end + 2));
    }
    let length = rest[first.len_utf8()..]
        .find(|c: char| c.is_ascii_whitespace() || matches!(c, '/' | '\\' | '"'))
        .map_or(rest.len(), |length| length + first.len_utf8());
    Some((Piece::Text, length))
}

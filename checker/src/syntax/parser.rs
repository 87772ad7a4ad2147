//! The cursor over the tokens of one text: looking ahead, expecting, reporting and recovering.
//!
//! The grammar stands in the modules below this one, one function per production, named like it.
//!
//! Invariants:
//! * A parse function always returns a node; what it could not read was reported and is an error
//!   node or left out.
//! * One token is blamed at most once, so one mistake gives one diagnostic.
//! * Every loop consumes a token per turn, and recursion stops at [`MAX_NESTING`] levels, so any
//!   text ends in bounded time and stack.

use super::ast::{Expr, ExprKind, Name, Unsupported};
use super::codes;
use super::keywords::{self, Dialect};
use super::lexer::{Token, TokenKind, lex};
use crate::cancellation;
use crate::diagnostics::{Code, Diagnostic, SourceId, SourceMap, Span};

/// How deep brackets, blocks, types and prefix operators may be nested.
pub(super) const MAX_NESTING: u32 = 256;

/// How many levels an expression's tree may have, chains of operators included.
pub(super) const MAX_HEIGHT: u32 = 500;

/// What it takes to parse a token: see [`cancellation::work`].
const UNITS_FOR_TOKEN: usize = 128;

/// The state of reading one text.
pub(super) struct Parser<'a> {
    pub(super) text: &'a str,
    pub(super) dialect: Dialect,
    pub(super) diagnostics: &'a mut Vec<Diagnostic>,
    /// Constructs that were recognised and that nothing behind the parser supports.
    pub(super) unsupported: Vec<Unsupported>,
    /// The height of the tree of the last expression that was read.
    pub(super) height: u32,
    source: SourceId,
    tokens: Vec<Token>,
    position: usize,
    nesting: u32,
    blamed: Option<usize>,
    /// Whether the rest of the text was left unread.
    gave_up: bool,
}

/// A place to come back to when a reading turns out to be the wrong one.
pub(super) struct Checkpoint {
    position: usize,
    diagnostics: usize,
    unsupported: usize,
    blamed: Option<usize>,
    gave_up: bool,
}

impl<'a> Parser<'a> {
    /// A parser for the bytes that `span` covers.
    pub(super) fn new(
        span: Span,
        sources: &'a SourceMap,
        dialect: Dialect,
        diagnostics: &'a mut Vec<Diagnostic>,
    ) -> Parser<'a> {
        let text = &sources.get(span.source).text;
        let tokens = lex(text, span, diagnostics);
        Parser {
            text,
            dialect,
            diagnostics,
            unsupported: Vec::new(),
            height: 0,
            source: span.source,
            tokens,
            position: 0,
            nesting: 0,
            blamed: None,
            gave_up: false,
        }
    }

    pub(super) fn token(&self) -> Token {
        self.tokens[self.position]
    }

    pub(super) fn kind(&self) -> TokenKind {
        self.token().kind
    }

    /// The token `distance` places ahead; the end stands for all behind it.
    pub(super) fn peek(&self, distance: usize) -> Token {
        let last = self.tokens.len() - 1;
        self.tokens[(self.position + distance).min(last)]
    }

    pub(super) fn text_of(&self, token: Token) -> &'a str {
        &self.text[token.start as usize..token.end as usize]
    }

    /// The text of the current token if it is a word, else nothing.
    pub(super) fn word(&self) -> &'a str {
        self.word_at(0)
    }

    pub(super) fn word_at(&self, distance: usize) -> &'a str {
        let token = self.peek(distance);
        if token.kind == TokenKind::Word {
            self.text_of(token)
        } else {
            ""
        }
    }

    pub(super) fn is_name_at(&self, distance: usize) -> bool {
        let word = self.word_at(distance);
        !word.is_empty() && !keywords::is_reserved(word, self.dialect)
    }

    pub(super) fn at(&self, kind: TokenKind) -> bool {
        self.kind() == kind
    }

    pub(super) fn at_end(&self) -> bool {
        self.at(TokenKind::End)
    }

    /// The kind of the token before the current one.
    pub(super) fn previous_kind(&self) -> Option<TokenKind> {
        let previous = self.position.checked_sub(1)?;
        Some(self.tokens[previous].kind)
    }

    /// The text of the token before the current one if it is a word, else nothing.
    pub(super) fn previous_word(&self) -> &'a str {
        match self.position.checked_sub(1) {
            Some(previous) if self.tokens[previous].kind == TokenKind::Word => {
                self.text_of(self.tokens[previous])
            }
            _ => "",
        }
    }

    /// Steps over the current token and returns it; the end is never left.
    pub(super) fn bump(&mut self) -> Token {
        cancellation::work(UNITS_FOR_TOKEN);
        let token = self.token();
        if token.kind != TokenKind::End {
            self.position += 1;
        }
        token
    }

    pub(super) fn eat(&mut self, kind: TokenKind) -> bool {
        let found = self.at(kind);
        if found {
            self.bump();
        }
        found
    }

    pub(super) fn at_word(&self, word: &str) -> bool {
        self.word() == word
    }

    pub(super) fn eat_word(&mut self, word: &str) -> bool {
        let found = self.at_word(word);
        if found {
            self.bump();
        }
        found
    }

    pub(super) fn span_of(&self, token: Token) -> Span {
        Span {
            source: self.source,
            start: token.start,
            end: token.end,
        }
    }

    pub(super) fn here(&self) -> Span {
        self.span_of(self.token())
    }

    /// The span from `start` to the last token that was consumed.
    pub(super) fn since(&self, start: Span) -> Span {
        match self.position.checked_sub(1) {
            Some(last) if self.tokens[last].end >= start.start => {
                start.to(self.span_of(self.tokens[last]))
            }
            _ => start.at_start(),
        }
    }

    pub(super) fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            position: self.position,
            diagnostics: self.diagnostics.len(),
            unsupported: self.unsupported.len(),
            blamed: self.blamed,
            gave_up: self.gave_up,
        }
    }

    /// Forgets everything since `checkpoint`, diagnostics included.
    pub(super) fn rewind(&mut self, checkpoint: &Checkpoint) {
        self.position = checkpoint.position;
        self.diagnostics.truncate(checkpoint.diagnostics);
        self.unsupported.truncate(checkpoint.unsupported);
        self.blamed = checkpoint.blamed;
        self.gave_up = checkpoint.gave_up;
    }

    /// Whether nothing was reported since `checkpoint`.
    pub(super) fn is_clean_since(&self, checkpoint: &Checkpoint) -> bool {
        self.diagnostics.len() == checkpoint.diagnostics
    }

    /// The token's position, to see whether a loop makes progress.
    pub(super) fn progress(&self) -> usize {
        self.position
    }

    /// Reports about the current token, unless it was blamed before.
    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        if diagnostic.is_error() {
            if self.blamed == Some(self.position) {
                return;
            }
            self.blamed = Some(self.position);
        }
        self.report_earlier(diagnostic);
    }

    /// Reports about something that was read before.
    pub(super) fn report_earlier(&mut self, diagnostic: Diagnostic) {
        if self.gave_up {
            return;
        }
        if self.diagnostics.len() <= codes::MOST_MISTAKES {
            self.diagnostics.push(diagnostic);
        } else {
            self.give_up();
        }
    }

    pub(super) fn error(&mut self, code: Code, span: Span, message: impl Into<String>) {
        self.report(Diagnostic::new(code, span, message));
    }

    /// Leaves the rest of the text unread.
    fn give_up(&mut self) {
        self.position = self.tokens.len() - 1;
        self.blamed = Some(self.position);
        self.gave_up = true;
    }

    /// Reports nothing about the current token: the text was skipped up to here because of an
    /// earlier mistake.
    pub(super) fn suppress_reports(&mut self) {
        self.blamed = Some(self.position);
    }

    /// How the current token is shown in a message.
    pub(super) fn found(&self) -> String {
        let token = self.token();
        match token.kind {
            TokenKind::End => "the end of the text".to_owned(),
            TokenKind::Word | TokenKind::Int | TokenKind::Double => {
                let text = self.text_of(token);
                let shown: String = text.chars().take(40).collect();
                let cut = if shown.len() < text.len() { "…" } else { "" };
                format!("`{shown}{cut}`")
            }
            kind => kind.shown().to_owned(),
        }
    }

    /// Reports that `what` was expected here.
    pub(super) fn expected(&mut self, what: &str) {
        self.expected_at(self.here(), what, None);
    }

    /// Reports that `what` was expected here, and says what to write.
    pub(super) fn expected_with_hint(&mut self, what: &str, hint: &str) {
        self.expected_at(self.here(), what, Some(hint));
    }

    /// Reports that a closing symbol was left out: behind the previous token if the next one is on
    /// another line.
    pub(super) fn missing(&mut self, what: &str) {
        let here = self.here();
        let behind = self.behind_previous();
        let between = &self.text[behind.start as usize..here.start as usize];
        let is_behind = between.contains('\n') || self.at_end();
        self.expected_at(if is_behind { behind } else { here }, what, None);
    }

    /// The empty span behind the previous token.
    pub(super) fn behind_previous(&self) -> Span {
        let here = self.here();
        let end = match self.position.checked_sub(1) {
            Some(index) => self.tokens[index].end,
            None => here.start,
        };
        Span {
            start: end,
            end,
            ..here
        }
    }

    fn expected_at(&mut self, span: Span, what: &str, hint: Option<&str>) {
        if self.at(TokenKind::Unknown) {
            // The lexer reported the symbol itself.
            self.suppress_reports();
            return;
        }
        let message = format!("expected {what}, found {}", self.found());
        let mut diagnostic = Diagnostic::new(codes::UNEXPECTED_TOKEN, span, message);
        if matches!(self.kind(), TokenKind::EqualLess | TokenKind::EqualGreater) {
            diagnostic = self.old_comparison();
        } else if let Some(hint) = hint.map(str::to_owned).or_else(|| self.foreign_hint()) {
            diagnostic = diagnostic.help(hint);
        }
        self.report(diagnostic);
    }

    fn old_comparison(&self) -> Diagnostic {
        let (old, new) = if self.at(TokenKind::EqualLess) {
            ("=<", "<=")
        } else {
            ("=>", ">=")
        };
        let message = format!("`{old}` is not an operator");
        let help = if self.at(TokenKind::EqualGreater) {
            "write `imply` between a condition and what follows from it, or `>=` to compare numbers"
                .to_owned()
        } else {
            format!("write `{new}`; only the old syntax knows `{old}`")
        };
        Diagnostic::new(codes::OLD_COMPARISON, self.here(), message).help(help)
    }

    /// Consumes a token of this kind or reports; `context` says where it was expected ("after the
    /// declaration").
    pub(super) fn expect(&mut self, kind: TokenKind, context: &str) -> bool {
        let found = self.eat(kind);
        if !found {
            self.missing(&format!("{} {context}", kind.shown()));
        }
        found
    }

    /// Consumes a name or reports; `what` says what it names.
    pub(super) fn name(&mut self, what: &str) -> Name {
        let span = self.here();
        let word = self.word();
        if word.is_empty() {
            self.expected(what);
            return Name {
                span: span.at_start(),
                ..Name::default()
            };
        }
        if keywords::is_reserved(word, self.dialect) {
            let message = format!("expected {what}, found the reserved word `{word}`");
            self.report(
                Diagnostic::new(codes::KEYWORD_AS_NAME, span, message)
                    .help("choose another name, for example with a trailing `_`"),
            );
            if self.is_structural_word() {
                return Name {
                    span,
                    ..Name::default()
                };
            }
        }
        self.bump();
        Name {
            text: word.to_owned(),
            span,
        }
    }

    /// Whether the current word begins a construct of its own, so that it is more likely that a
    /// name was left out.
    fn is_structural_word(&self) -> bool {
        let next = self.peek(1).kind;
        match self.word() {
            "process" | "system" | "state" | "trans" | "init" | "typedef" => {
                next == TokenKind::Word
            }
            "if" | "for" | "while" => next == TokenKind::LeftParenthesis,
            _ => false,
        }
    }

    /// The name of something that is declared here; warns where UPPAAL 5 would refuse it.
    pub(super) fn declared_name(&mut self, what: &str) -> Name {
        let name = self.name(what);
        if keywords::is_built_in_function(&name.text) {
            let message = format!("`{}` is the name of a built-in function", name.text);
            self.report(
                Diagnostic::new(codes::BUILT_IN_AS_NAME, name.span, message)
                    .help("rename it: the declaration hides the function, and UPPAAL 5 refuses it"),
            );
        }
        name
    }

    /// Runs `read` one level deeper; at the limit it reports, skips the rest of the text and
    /// returns `None`.
    pub(super) fn nested<T>(&mut self, read: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.nesting >= MAX_NESTING {
            let message = format!("nested deeper than {MAX_NESTING} levels");
            self.error(codes::NESTING_TOO_DEEP, self.here(), message);
            self.give_up();
            return None;
        }
        self.nesting += 1;
        let result = read(self);
        self.nesting -= 1;
        Some(result)
    }

    /// An error node at the current token.
    pub(super) fn error_expr(&mut self) -> Expr {
        self.height = 1;
        Expr {
            kind: ExprKind::Error,
            span: self.here().at_start(),
        }
    }

    /// Reads parts with commas between them.
    pub(super) fn comma_separated(&mut self, mut read: impl FnMut(&mut Self)) {
        loop {
            read(self);
            if !self.eat(TokenKind::Comma) {
                return;
            }
        }
    }

    /// Reports what stands behind a text that should have ended.
    pub(super) fn expect_end(&mut self, context: &str) {
        if !self.at_end() {
            self.expected(&format!("the end {context}"));
        }
    }

    /// Skips to the next of `stops` at this level of brackets, or to a closing bracket of an outer
    /// level.
    pub(super) fn skip_to(&mut self, stops: &[TokenKind]) {
        let mut depth = 0_u32;
        while !self.at_end() {
            let kind = self.kind();
            if depth == 0 && stops.contains(&kind) {
                return;
            }
            match kind {
                TokenKind::LeftBrace | TokenKind::LeftBracket | TokenKind::LeftParenthesis => {
                    depth += 1;
                }
                TokenKind::RightBrace | TokenKind::RightBracket | TokenKind::RightParenthesis => {
                    if depth == 0 {
                        return;
                    }
                    depth -= 1;
                }
                _ => {}
            }
            self.bump();
        }
    }

    /// After a mistake in a declaration or statement: on to the next `;`, the end of the block, or
    /// a word that begins a declaration.
    pub(super) fn recover(&mut self) {
        let mut depth = 0_u32;
        while !self.at_end() {
            match self.kind() {
                TokenKind::Semicolon if depth == 0 => {
                    self.bump();
                    return;
                }
                TokenKind::LeftBrace => depth += 1,
                TokenKind::Table if depth == 0 => {
                    self.bump();
                    self.eat(TokenKind::Semicolon);
                    return;
                }
                TokenKind::RightBrace if depth == 0 => return,
                TokenKind::RightBrace => {
                    depth -= 1;
                    if depth == 0 {
                        self.bump();
                        self.eat(TokenKind::Semicolon);
                        return;
                    }
                }
                TokenKind::Word if depth == 0 && self.begins_declaration() => return,
                _ => {}
            }
            self.bump();
        }
    }

    fn begins_declaration(&self) -> bool {
        matches!(
            self.word(),
            "typedef"
                | "process"
                | "system"
                | "const"
                | "meta"
                | "broadcast"
                | "void"
                | "clock"
                | "chan"
                | "hybrid"
                | "state"
                | "trans"
                | "init"
                | "commit"
                | "branchpoint"
        ) || (matches!(self.word(), "int" | "bool" | "double") && self.is_name_at(1))
    }
}

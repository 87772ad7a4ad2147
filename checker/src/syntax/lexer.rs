//! From text to tokens.
//!
//! Invariants:
//! * The tokens lie in the text in order and do not overlap; the last one is [`TokenKind::End`],
//!   empty, at the end.
//! * Words are not told apart here: a keyword of a model may be a name in a query, so the parser
//!   decides.
//! * The longest token wins, as in UPPAAL: `E<>` and `A[]` are one token only without a blank
//!   inside.
//!
//! Cost: linear in the text.

use crate::cancellation;

use super::codes;
use super::tables::Finder;
use crate::diagnostics::{Diagnostic, SourceId, Span, to_u32};

/// What bounds the memory for a text that is nothing but tokens: a tree takes up to 100 bytes for
/// each.
const MOST_TOKENS: usize = 20_000_000;

/// A token and its bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Token {
    pub(super) kind: TokenKind,
    pub(super) start: u32,
    pub(super) end: u32,
}

macro_rules! tokens {
    ($($variant:ident $text:literal)*) => {
        /// The kinds of tokens.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum TokenKind {
            /// An identifier or a keyword.
            Word,
            /// Decimal digits.
            Int,
            /// Digits with a fraction or an exponent.
            Double,
            /// `"…"`
            String,
            /// A list of many numbers, or lists of them: see [`super::tables`].
            Table,
            /// Bytes that form no token; reported already.
            Unknown,
            /// The end of the text.
            End,
            $(#[doc = concat!("`", $text, "`")] $variant,)*
        }

        /// The symbols, longest first among those that begin alike.
        const SYMBOLS: &[(&str, TokenKind)] = &[$(($text, TokenKind::$variant)),*];

        impl TokenKind {
            /// How the token is shown in a message.
            pub(super) fn shown(self) -> &'static str {
                match self {
                    TokenKind::Word => "a name",
                    TokenKind::Int | TokenKind::Double => "a number",
                    TokenKind::String => "a string",
                    TokenKind::Table => "a list of numbers",
                    TokenKind::Unknown => "an unknown symbol",
                    TokenKind::End => "the end",
                    $(TokenKind::$variant => concat!("`", $text, "`"),)*
                }
            }
        }
    };
}

tokens! {
    UncontrollableArrow "-u->"
    AlwaysGlobally "A[]" AlwaysFinally "A<>" ExistsGlobally "E[]" ExistsFinally "E<>"
    LeadsTo "-->"
    ShiftLeftAssign "<<=" ShiftRightAssign ">>="
    Arrow "->" ColonAssign ":="
    PlusAssign "+=" MinusAssign "-=" StarAssign "*=" SlashAssign "/=" PercentAssign "%="
    OrAssign "|=" AndAssign "&=" XorAssign "^="
    Minimum "<?" Maximum ">?" Power "**" ShiftLeft "<<" ShiftRight ">>"
    OrOr "||" AndAnd "&&" LessEqual "<=" GreaterEqual ">="
    EqualLess "=<" EqualGreater "=>" EqualEqual "==" NotEqual "!="
    Increment "++" Decrement "--" Box "[]" Diamond "<>"
    Dot "." Comma "," Semicolon ";" Colon ":" LeftBrace "{" RightBrace "}" LeftBracket "[" RightBracket "]"
    LeftParenthesis "(" RightParenthesis ")" Question "?" Apostrophe "'" Exclamation "!"
    Assign "=" Plus "+" Minus "-" Star "*" Slash "/" Percent "%" Or "|" And "&" Xor "^"
    Less "<" Greater ">" Hash "#"
}

/// The tokens of the bytes that `span` covers.
pub(super) fn lex(text: &str, span: Span, diagnostics: &mut Vec<Diagnostic>) -> Vec<Token> {
    let end = (span.end as usize).min(text.len());
    let text = text.get(..end).unwrap_or(text);
    let mut lexer = Lexer {
        text,
        source: span.source,
        position: span.start as usize,
        tokens: Vec::with_capacity(text.len().saturating_sub(span.start as usize) / 4 + 1),
        diagnostics,
        tables: Finder::default(),
    };
    lexer.run();
    lexer.tokens
}

struct Lexer<'a> {
    text: &'a str,
    source: SourceId,
    position: usize,
    tokens: Vec<Token>,
    diagnostics: &'a mut Vec<Diagnostic>,
    tables: Finder,
}

/// What it takes to read a token: see [`cancellation::work`].
const UNITS_FOR_TOKEN: usize = 64;

impl Lexer<'_> {
    fn run(&mut self) {
        while let Some(&byte) = self.text.as_bytes().get(self.position) {
            let start = self.position;
            cancellation::work(UNITS_FOR_TOKEN);
            if self.tokens.len() >= MOST_TOKENS {
                let span = self.span_from(start);
                let message = format!("this text has more than {MOST_TOKENS} tokens");
                self.report(Diagnostic::new(codes::FILE_TOO_LARGE, span, message));
                break;
            }
            match byte {
                b' ' | b'\t' | b'\r' | b'\n' | 0x0b | 0x0c => self.position += 1,
                b'/' if self.follows("//") => self.line_comment(),
                b'/' if self.follows("/*") => self.block_comment(),
                b'\\' if self.continuation() => {}
                b'A' | b'E' if self.path_quantifier() => {}
                b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                    self.position = end_of_word(self.text.as_bytes(), self.position);
                    self.push(TokenKind::Word, start);
                }
                b'0'..=b'9' => self.number(),
                b'"' => self.string(),
                b'{' if self.table() => {}
                _ if self.symbol() => {}
                _ => self.unknown(),
            }
        }
        self.push(TokenKind::End, self.position);
    }

    fn follows(&self, symbol: &str) -> bool {
        self.text.as_bytes()[self.position..].starts_with(symbol.as_bytes())
    }

    fn push(&mut self, kind: TokenKind, start: usize) {
        let (start, end) = (to_u32(start), to_u32(self.position));
        self.tokens.push(Token { kind, start, end });
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        if self.diagnostics.len() < codes::MOST_MISTAKES {
            self.diagnostics.push(diagnostic);
        }
    }

    fn span_from(&self, start: usize) -> Span {
        Span {
            source: self.source,
            start: to_u32(start),
            end: to_u32(self.position),
        }
    }

    fn line_comment(&mut self) {
        let rest = &self.text.as_bytes()[self.position..];
        self.position += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
    }

    fn block_comment(&mut self) {
        let start = self.position;
        if let Some(length) = self.text[start + 2..].find("*/") {
            self.position = start + 2 + length + 2;
            return;
        }
        self.position = start + 2;
        let span = self.span_from(start);
        self.position = self.text.len();
        let message = "this comment is never closed";
        self.report(
            Diagnostic::new(codes::UNCLOSED_COMMENT, span, message).help("end it with `*/`"),
        );
    }

    fn table(&mut self) -> bool {
        let start = self.position;
        let Some(end) = self.tables.table_at(self.text.as_bytes(), start) else {
            return false;
        };
        cancellation::work(end - start);
        self.position = end;
        self.push(TokenKind::Table, start);
        true
    }

    /// `\` and a line end: the line continues.
    fn continuation(&mut self) -> bool {
        let rest = &self.text.as_bytes()[self.position + 1..];
        let blanks = rest
            .iter()
            .take_while(|&&b| matches!(b, b' ' | b'\t' | b'\r'))
            .count();
        let ends = matches!(rest.get(blanks), Some(b'\n') | None);
        if ends {
            self.position += 1 + blanks;
        }
        ends
    }

    fn path_quantifier(&mut self) -> bool {
        let start = self.position;
        let kind = match self.text.as_bytes().get(start..start + 3) {
            Some(b"A[]") => TokenKind::AlwaysGlobally,
            Some(b"A<>") => TokenKind::AlwaysFinally,
            Some(b"E[]") => TokenKind::ExistsGlobally,
            Some(b"E<>") => TokenKind::ExistsFinally,
            _ => return false,
        };
        self.position += 3;
        self.push(kind, start);
        true
    }

    fn number(&mut self) {
        let start = self.position;
        let bytes = self.text.as_bytes();
        let mut end = end_of_digits(bytes, start);
        let mut kind = TokenKind::Int;
        if bytes.get(end) == Some(&b'.') && bytes.get(end + 1).is_some_and(u8::is_ascii_digit) {
            end = end_of_digits(bytes, end + 1);
            kind = TokenKind::Double;
        }
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            if bytes.get(end + 1 + sign).is_some_and(u8::is_ascii_digit) {
                end = end_of_digits(bytes, end + 1 + sign);
                kind = TokenKind::Double;
            }
        }
        self.position = end;
        self.push(kind, start);
    }

    fn string(&mut self) {
        let start = self.position;
        let rest = &self.text[start + 1..];
        if let Some(length) = rest.find(['"', '\n'])
            && rest[length..].starts_with('"')
        {
            self.position = start + 1 + length + 1;
            self.push(TokenKind::String, start);
            return;
        }
        self.position = start + 1;
        let span = self.span_from(start);
        self.push(TokenKind::Unknown, start);
        let message = "this string is never closed";
        self.report(
            Diagnostic::new(codes::UNCLOSED_STRING, span, message).help("end it with `\"`"),
        );
    }

    fn symbol(&mut self) -> bool {
        let start = self.position;
        let first = self.text.as_bytes()[start];
        if let Some(kind) = symbol_alone(first) {
            self.position += 1;
            self.push(kind, start);
            return true;
        }
        // Most symbols begin with another byte, which is sooner seen than that the rest differs.
        let found = SYMBOLS
            .iter()
            .find(|(symbol, _)| symbol.as_bytes()[0] == first && self.follows(symbol))
            .copied();
        if let Some((symbol, kind)) = found {
            self.position += symbol.len();
            self.push(kind, start);
        }
        found.is_some()
    }

    /// One diagnostic for a run of characters that begin no token.
    fn unknown(&mut self) {
        let start = self.position;
        let known = |c: char| c.is_ascii_graphic() && !matches!(c, '\\' | '`' | '@' | '$' | '~');
        let run = &self.text[start..];
        self.position += run
            .find(|c: char| known(c) || c.is_ascii_whitespace())
            .unwrap_or(run.len())
            .max(run.chars().next().map_or(0, char::len_utf8));
        let shown: String = self.text[start..self.position].chars().take(12).collect();
        let span = self.span_from(start);
        self.push(TokenKind::Unknown, start);
        let message = format!("unknown symbol `{}`", shown.escape_debug());
        let diagnostic = Diagnostic::new(codes::UNKNOWN_SYMBOL, span, message);
        self.report(match shown.chars().find(|symbol| !symbol.is_ascii()) {
            None => diagnostic,
            Some(symbol) => diagnostic.help(match ascii_for(symbol) {
                Some(meant) => format!("write {meant}"),
                None if symbol.is_alphabetic() => {
                    "names have the letters a to z only; some letters look like these: type it again"
                        .to_owned()
                }
                None => "only comments and strings may hold characters outside ASCII".to_owned(),
            }),
        });
    }
}

/// What stands for a symbol outside ASCII.
fn ascii_for(symbol: char) -> Option<&'static str> {
    Some(match symbol {
        '≤' | '⩽' => "`<=`",
        '≥' | '⩾' => "`>=`",
        '≠' => "`!=`",
        '¬' => "`!` or `not`",
        '∧' => "`&&` or `and`",
        '∨' => "`||` or `or`",
        '→' | '⇒' | '⟹' => "`imply`",
        '↔' | '⇔' => "`==`",
        '∀' => "`forall (i : int[0,3])`",
        '∃' => "`exists (i : int[0,3])`",
        '□' | '◻' => "`A[]`",
        '◇' | '◊' => "`A<>` or `E<>`",
        '·' | '×' => "`*`",
        '−' | '–' => "`-`",
        '‘' | '’' | '“' | '”' => "the name without quotation marks",
        _ => return None,
    })
}

/// The symbol of a byte that begins no longer one: most symbols of a model.
fn symbol_alone(byte: u8) -> Option<TokenKind> {
    Some(match byte {
        b'.' => TokenKind::Dot,
        b',' => TokenKind::Comma,
        b';' => TokenKind::Semicolon,
        b'{' => TokenKind::LeftBrace,
        b'}' => TokenKind::RightBrace,
        b'(' => TokenKind::LeftParenthesis,
        b')' => TokenKind::RightParenthesis,
        b']' => TokenKind::RightBracket,
        _ => return None,
    })
}

/// One past the last byte of the identifier that starts at `start`.
pub(super) fn end_of_word(bytes: &[u8], start: usize) -> usize {
    let length = bytes[start..]
        .iter()
        .take_while(|&&b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'$' | b'#'))
        .count();
    start + length
}

fn end_of_digits(bytes: &[u8], start: usize) -> usize {
    let length = bytes[start..]
        .iter()
        .take_while(|b| b.is_ascii_digit())
        .count();
    start + length
}

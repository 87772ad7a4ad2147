//! Diagnostics: what is wrong with an input, where, why, and what to do about it.
//!
//! Invariants:
//! * Every piece of text that is parsed is a [`Source`] of its own: a whole `.xta` or `.q` file, or
//!   one `<declaration>` or `<label>` of an XML file. A [`Span`] counts bytes of the *decoded* text
//!   of its source.
//! * A source knows how its bytes map back to the file (entities such as `&lt;` make the two
//!   differ), so a diagnostic can always be given as file, line and column, and in words ("template
//!   Gate, edge Free → Occ, guard").
//! * Diagnostics are values. They are collected, sorted by position and reported together; nothing
//!   here prints.
//! * Rendered text has no control character but line feeds and tabs, and nothing that turns the
//!   direction of writing, whatever stands in a file: a terminal would obey it.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

mod text;

pub use text::Text;

/// Index of a [`Source`] in a [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SourceId(pub u32);

/// A range of bytes in the decoded text of one source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Span {
    /// The source that the range lies in.
    pub source: SourceId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// A part of it, by bytes behind its start.
    #[must_use]
    pub fn part(self, range: Range<usize>) -> Span {
        let at = |offset| self.start.saturating_add(to_u32(offset));
        Span {
            source: self.source,
            start: at(range.start),
            end: at(range.end),
        }
    }

    /// The place where it starts.
    #[must_use]
    pub fn at_start(self) -> Span {
        self.part(0..0)
    }
    /// The smallest span that holds both; `self` where they lie in different sources.
    #[must_use]
    pub fn to(self, other: Span) -> Span {
        if self.source != other.source {
            return self;
        }
        Span {
            source: self.source,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }
}

/// Byte offsets fit: the readers refuse files beyond `u32`.
pub(crate) fn to_u32(offset: usize) -> u32 {
    u32::try_from(offset).unwrap_or(u32::MAX)
}

/// One parsed piece of text, and the file that it came from.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// The file as the user named it; empty for text given directly (a query on the command line).
    pub path: Arc<str>,
    /// The place in words, for example `template Gate, edge Free → Occ, guard`; empty for a whole
    /// file.
    pub place: String,
    /// The decoded text that spans count in.
    pub text: Text,
    /// The byte of the file that the text begins at.
    pub file_start: u32,
    /// Pairs (byte of `text`, byte of the file), ascending, where the two do not advance together;
    /// between two entries, and before the first, they do.
    pub offsets: Vec<(u32, u32)>,
    /// The file's byte offsets at which lines start. Empty: the text is the file.
    pub line_starts: Arc<[u32]>,
    /// Which of the `line_starts` belong to the lines from that which the text begins in to the one
    /// that it ends in.
    pub lines: Range<u32>,
}

/// Line and column of a place in a file, both counted from 1; columns count characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: u32,
    /// Column, from 1.
    pub column: u32,
}

impl Source {
    /// The byte of the file that a byte of the text comes from.
    fn file_offset(&self, text_offset: u32) -> u32 {
        let index = self
            .offsets
            .partition_point(|&(text, _)| text <= text_offset);
        match index.checked_sub(1).map(|i| self.offsets[i]) {
            Some((text, file)) => file + (text_offset - text),
            None => self.file_start + text_offset,
        }
    }

    /// The first byte of the text that comes from this byte of the file or one behind it.
    fn first_from(&self, file_offset: u32) -> usize {
        let (mut low, mut high) = (0, self.text.len());
        while low < high {
            let middle = low.midpoint(high);
            if u32::try_from(middle).is_ok_and(|middle| self.file_offset(middle) < file_offset) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// All sources of one load.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    sources: Vec<Source>,
}

impl SourceMap {
    /// Adds a source and returns the span of its whole text.
    ///
    /// # Panics
    /// At the 2^32nd source, which no memory holds.
    pub fn add(&mut self, source: Source) -> Span {
        let end = to_u32(source.text.len());
        let id = u32::try_from(self.sources.len()).expect("fewer than 2^32 sources");
        self.sources.push(source);
        Span {
            source: SourceId(id),
            start: 0,
            end,
        }
    }

    /// The source with this index.
    pub fn get(&self, id: SourceId) -> &Source {
        &self.sources[id.0 as usize]
    }

    /// Where a span starts, in the file.
    pub fn position(&self, span: Span) -> Position {
        let source = self.get(span.source);
        if source.line_starts.is_empty() {
            return position_in_text(&source.text, span.start);
        }
        let offset = source.file_offset(span.start);
        let lines = &source.line_starts[source.lines.start as usize..source.lines.end as usize];
        let line = lines.partition_point(|&start| start <= offset).max(1);
        let line_start = lines[line - 1];
        // Only bytes of the file that belong to the text can be told to be the rest of a character.
        let first = source.text.floor_char_boundary(span.start as usize);
        let line_begin = source.first_from(line_start).min(first);
        let of_line = &source.text.as_bytes()[line_begin..first];
        let rest_bytes = of_line.iter().filter(|&byte| byte & 0xc0 == 0x80).count();
        let column = (offset - line_start.min(offset) + 1)
            .saturating_sub(u32::try_from(rest_bytes).unwrap_or(u32::MAX));
        Position {
            line: u32::try_from(line)
                .unwrap_or(u32::MAX)
                .saturating_add(source.lines.start),
            column,
        }
    }

    /// The bytes of the file that a span stands for.
    pub fn file_range(&self, span: Span) -> Range<usize> {
        let source = self.get(span.source);
        source.file_offset(span.start) as usize..source.file_offset(span.end) as usize
    }

    /// The text that a span covers.
    pub fn text(&self, span: Span) -> &str {
        self.get(span.source)
            .text
            .get(span.start as usize..span.end as usize)
            .unwrap_or("")
    }
}

fn position_in_text(text: &str, offset: u32) -> Position {
    let before = &text[..floor_char_boundary(text, offset as usize)];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    Position {
        line: u32::try_from(before.matches('\n').count() + 1).unwrap_or(u32::MAX),
        column: u32::try_from(before[line_start..].chars().count() + 1).unwrap_or(u32::MAX),
    }
}

fn floor_char_boundary(text: &str, mut index: usize) -> usize {
    index = index.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The input is rejected.
    Error,
    /// The input is accepted; the user should know.
    Warning,
}

/// What is wrong, where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable code and name of the kind of mistake, for example `E0123 unknown-name`.
    pub code: Code,
    /// Where.
    pub span: Span,
    /// One line: lower case, without a full stop.
    pub message: String,
    /// More facts, one a line.
    pub notes: Vec<String>,
    /// What the user can do about it.
    pub help: Option<String>,
}

/// Code and name of a kind of mistake: named by the defect, readable after the word "allow".
///
/// The constants live with the layer that reports them (`syntax::codes`, `semantics::codes`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code {
    /// `E` or `W` and four digits; the letter decides the severity.
    pub code: &'static str,
    /// The defect in words joined by hyphens.
    pub name: &'static str,
}

/// Defines the codes of a layer: a constant each, all of them as `ALL`, and their pages as `PAGES`.
/// The page of a code is `pages/CODE.md`; without one the crate does not compile.
macro_rules! codes {
    ($($(#[$doc:meta])* $constant:ident = $code:literal $name:literal;)*) => {
        $($(#[$doc])* pub const $constant: $crate::diagnostics::Code =
            $crate::diagnostics::Code { code: $code, name: $name };)*
        /// Every code of this layer, in the order of their numbers.
        pub const ALL: &[$crate::diagnostics::Code] = &[$($constant),*];
        /// What `ntagen explain` shows of each, in the same order.
        pub const PAGES: &[&str] = &[$(
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/pages/", $code, ".md"))
        ),*];
    };
}
pub(crate) use codes;

impl Code {
    /// The severity that the code's letter stands for.
    pub fn severity(self) -> Severity {
        if self.code.starts_with('W') {
            Severity::Warning
        } else {
            Severity::Error
        }
    }
}

impl Diagnostic {
    /// A diagnostic without notes and help.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            code,
            span,
            message: message.into(),
            notes: Vec::new(),
            help: None,
        }
    }

    /// The same with one more note.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Diagnostic {
        self.notes.push(note.into());
        self
    }

    /// The same with a help line.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help = Some(help.into());
        self
    }

    /// Whether the input must be rejected.
    pub fn is_error(&self) -> bool {
        self.code.severity() == Severity::Error
    }

    /// The diagnostic as text: a header line with file, line and column, the source line with a
    /// caret, notes and help.
    pub fn render(&self, sources: &SourceMap) -> String {
        let rendered = Rendered {
            diagnostic: self,
            sources,
        };
        visible(&rendered.to_string())
    }
}

/// The text with a visible character for each that a terminal would obey, so that columns stay
/// where they are.
pub fn visible(text: &str) -> String {
    text.chars().map(visible_char).collect()
}

fn visible_char(one: char) -> char {
    match one {
        '\n' | '\t' => one,
        // The pictures of control characters stand in their order.
        '\0'..='\x1f' => char::from_u32(0x2400 + u32::from(one)).unwrap_or('\u{fffd}'),
        '\x7f' => '\u{2421}',
        '\u{80}'..='\u{9f}'
        | '\u{61c}'
        | '\u{200e}'
        | '\u{200f}'
        | '\u{2028}'..='\u{202e}'
        | '\u{2066}'..='\u{2069}' => '\u{fffd}',
        _ => one,
    }
}

/// How many characters of a line are shown before the place that is meant, and from it on.
const LONGEST_CONTEXT: usize = 200;

struct Rendered<'a> {
    diagnostic: &'a Diagnostic,
    sources: &'a SourceMap,
}

impl fmt::Display for Rendered<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Rendered {
            diagnostic,
            sources,
        } = self;
        let source = sources.get(diagnostic.span.source);
        let position = sources.position(diagnostic.span);
        let severity = match diagnostic.code.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        // A text that is in no file is named by its place, or not at all.
        let (path, place) = match (&*source.path, source.place.as_str()) {
            ("", "") => ("<text>", ""),
            ("", place) => (place, ""),
            named => named,
        };
        writeln!(
            f,
            "{path}:{}:{}: {severity}[{}]: {}",
            position.line, position.column, diagnostic.code.code, diagnostic.message
        )?;
        if !place.is_empty() {
            writeln!(f, "  in {place}")?;
        }
        let start = floor_char_boundary(&source.text, diagnostic.span.start as usize);
        let line_start = source.text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = source.text[start..]
            .find('\n')
            .map_or(source.text.len(), |i| start + i);
        let line = source.text[line_start..line_end].trim_end_matches('\r');
        if !line.trim().is_empty() {
            let end = floor_char_boundary(&source.text, diagnostic.span.end as usize)
                .clamp(start, line_end);
            let shown = Shown::of(line, start - line_start..end - line_start);
            writeln!(f, "  | {}", shown.text)?;
            writeln!(f, "  | {}{}", shown.indent, "^".repeat(shown.width))?;
        }
        for note in &diagnostic.notes {
            writeln!(f, "  note: {note}")?;
        }
        if let Some(help) = &diagnostic.help {
            writeln!(f, "  hint: {help}")?;
        }
        Ok(())
    }
}

/// The part of a source line that is shown: all of it, or what stands around the mistake.
struct Shown {
    text: String,
    indent: String,
    /// How many characters are marked.
    width: usize,
}

impl Shown {
    /// The part around these bytes of a line.
    fn of(line: &str, marked: Range<usize>) -> Shown {
        let marked = marked.start.min(line.len())..marked.end.min(line.len());
        let before = &line[..marked.start];
        let first = match before.char_indices().rev().nth(LONGEST_CONTEXT) {
            Some((index, _)) => line.ceil_char_boundary(index + 1),
            None => 0,
        };
        let behind = line[marked.start..].char_indices().nth(LONGEST_CONTEXT);
        let last = behind.map_or(line.len(), |(index, _)| marked.start + index);
        let mark = |is_cut| if is_cut { "…" } else { "" };
        let (left, right) = (mark(first > 0), mark(last < line.len()));
        let blank = |c| if c == '\t' { '\t' } else { ' ' };
        let end = marked.end.clamp(marked.start, last);
        Shown {
            text: format!("{left}{}{right}", &line[first..last]),
            indent: left
                .chars()
                .chain(before[first..].chars())
                .map(blank)
                .collect(),
            width: line[marked.start..end].chars().count().max(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_long_line_only_the_surroundings_are_shown() {
        let line = "é".repeat(10_000) + "wrong" + &"ü".repeat(10_000);
        let start = line.find("wrong").expect("it is there");
        let shown = Shown::of(&line, start..start + 5);
        let expected = "…".to_owned()
            + &"é".repeat(LONGEST_CONTEXT)
            + "wrong"
            + &"ü".repeat(LONGEST_CONTEXT - 5)
            + "…";
        assert_eq!(shown.text, expected);
        assert_eq!(shown.indent.chars().count(), 1 + LONGEST_CONTEXT);
        assert_eq!(shown.width, 5);

        let shown = Shown::of("\tint x;", 5..6);
        assert_eq!((shown.text.as_str(), shown.width), ("\tint x;", 1));
        assert_eq!(shown.indent, "\t    ");
    }

    #[test]
    fn rendered_text_commands_no_terminal() {
        let mut sources = SourceMap::default();
        let text = "\u{9b}31m\u{202e}E<> \x1b]0;x\x07P.Z \x7f\r\n";
        let whole = sources.add(Source {
            path: "a\x1b[2J.q".into(),
            place: "query \u{2066}".to_owned(),
            text: text.into(),
            ..Source::default()
        });
        let code = Code {
            code: "E0000",
            name: "test",
        };
        let span = whole.part(16..19);
        let diagnostic = Diagnostic::new(code, span, "unknown \x1b[31m'P'").note("\u{85}");
        let rendered = diagnostic.help("\x08").render(&sources);
        let is_safe = |one: char| one == '\n' || (!one.is_control() && visible_char(one) == one);
        assert!(rendered.chars().all(is_safe), "{rendered:?}");
        // Each character takes one column, so that the caret stands where it did.
        let lines: Vec<&str> = rendered.lines().collect();
        let column = |line: &str| line.chars().position(|one| one == '^');
        assert_eq!(
            lines[2].chars().count(),
            "  | ".len() + text.trim_end().chars().count()
        );
        assert!(column(lines[3]).is_some(), "{rendered}");
    }
}

//! Tables: lists of integers, lists of such lists, and so on, as large arrays are initialised.
//!
//! A table is one token and one node of the tree, whatever its size: its text is all that is kept
//! of it, and is read once more when its type is known. So it takes no memory beside the text, and
//! each number still has its place. Lists with anything else in them (names, operators, labels,
//! fractions, numbers beyond 32 bits), and short ones, are read by the grammar.
//!
//! Cost: linear in the text. A list that turns out to be no table is not looked at twice.

use crate::diagnostics::{SourceMap, Span};

/// Lists of fewer numbers are left to the grammar.
const LEAST_NUMBERS: usize = 32;
/// The first so many numbers must stand in this number of bytes.
const MOST_BYTES_OF_FEW: usize = 1 << 16;
/// How deep lists may be nested, as in the grammar.
const MOST_NESTED: usize = 256;

/// Finds tables in a text, from its begin to its end.
#[derive(Debug, Default)]
pub(super) struct Finder {
    /// Where the lists begin that were open when a reading failed.
    open: Vec<usize>,
    /// Where it failed.
    failed_at: usize,
}

impl Finder {
    /// One past the end of the table that begins at the `{` at this place, if it is one.
    pub(super) fn table_at(&mut self, bytes: &[u8], start: usize) -> Option<usize> {
        if start < self.failed_at && self.open.contains(&start) {
            return None;
        }
        self.open.clear();
        match self.read(bytes, start) {
            Ok(end) => end,
            Err(place) => {
                self.failed_at = place;
                None
            }
        }
    }

    /// The end of a table, nothing for a list of few numbers, or where it is seen to be no table.
    fn read(&mut self, bytes: &[u8], start: usize) -> Result<Option<usize>, usize> {
        let mut numbers = 0;
        let mut at = start;
        loop {
            // A number, or the begin of a list.
            if bytes.get(at) == Some(&b'{') {
                if self.open.len() == MOST_NESTED {
                    return Err(at);
                }
                self.open.push(at);
                at = behind_blanks(bytes, at + 1);
                continue;
            }
            at = number_at(bytes, at).ok_or(at)?.1;
            numbers += 1;
            at = behind_blanks(bytes, at);
            // What follows it: ends of lists, then a comma or the end.
            while bytes.get(at) == Some(&b'}') {
                self.open.pop();
                at += 1;
                if self.open.is_empty() {
                    return Ok((numbers >= LEAST_NUMBERS).then_some(at));
                }
                at = behind_blanks(bytes, at);
            }
            if bytes.get(at) != Some(&b',') {
                return Err(at);
            }
            at = behind_blanks(bytes, at + 1);
            if numbers < LEAST_NUMBERS && at - start > MOST_BYTES_OF_FEW {
                return Err(at);
            }
        }
    }
}

/// The number at this place, and one past its end; `None` if there is none, if it does not fit into
/// 32 bits, or if it goes on as something else.
fn number_at(bytes: &[u8], start: usize) -> Option<(i32, usize)> {
    let is_negative = bytes.get(start) == Some(&b'-');
    let first = start + usize::from(matches!(bytes.get(start), Some(b'-' | b'+')));
    let mut value: i64 = 0;
    let mut at = first;
    while let Some(digit) = bytes.get(at).filter(|byte| byte.is_ascii_digit()) {
        value = value
            .saturating_mul(10)
            .saturating_add(i64::from(digit - b'0'));
        at += 1;
    }
    let goes_on = |&byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.');
    if at == first || bytes.get(at).is_some_and(goes_on) {
        return None;
    }
    let value = if is_negative { -value } else { value };
    Some((i32::try_from(value).ok()?, at))
}

/// The first byte from this place on that is neither blank nor in a comment.
fn behind_blanks(bytes: &[u8], mut at: usize) -> usize {
    loop {
        match bytes.get(at) {
            Some(b' ' | b'\t' | b'\r' | b'\n' | 0x0b | 0x0c) => at += 1,
            Some(b'/') => match end_of_comment(&bytes[at..]) {
                Some(length) => at += length,
                None => return at,
            },
            _ => return at,
        }
    }
}

/// How long the comment is that these bytes begin with.
fn end_of_comment(bytes: &[u8]) -> Option<usize> {
    match bytes.get(1) {
        Some(b'/') => Some(
            bytes
                .iter()
                .position(|&byte| byte == b'\n')
                .unwrap_or(bytes.len()),
        ),
        Some(b'*') => {
            let end = bytes[2..].windows(2).position(|pair| pair == b"*/")?;
            Some(2 + end + 2)
        }
        _ => None,
    }
}

/// A piece of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// A number.
    Number(i32),
    /// The begin of a list of this many parts; its parts follow, and then [`Piece::End`].
    List(u32),
    /// The end of a list.
    End,
}

/// Reads the pieces of a table, in their order.
pub struct TableReader<'s> {
    bytes: &'s [u8],
    at: usize,
    /// How many parts the lists have that are still to come, the last one first.
    lengths: Vec<u32>,
    /// The whole table.
    span: Span,
    /// Where the last piece lies.
    last: (usize, usize),
}

impl<'s> TableReader<'s> {
    /// A reader of the table that a span covers.
    pub fn new(span: Span, sources: &'s SourceMap) -> TableReader<'s> {
        let mut reader = TableReader {
            bytes: sources.text(span).as_bytes(),
            at: 0,
            lengths: Vec::new(),
            span,
            last: (0, 0),
        };
        reader.lengths = reader.counted();
        reader.at = 0;
        reader
    }

    /// The lengths of all lists, the last one first.
    fn counted(&mut self) -> Vec<u32> {
        let mut lengths: Vec<u32> = Vec::new();
        let mut open: Vec<usize> = Vec::new();
        while let Some(piece) = self.piece() {
            if piece == Piece::End {
                open.pop();
                continue;
            }
            if let Some(&list) = open.last() {
                lengths[list] += 1;
            }
            if piece == Piece::List(0) {
                open.push(lengths.len());
                lengths.push(0);
            }
        }
        lengths.reverse();
        lengths
    }

    /// The next piece; lists count no parts.
    fn piece(&mut self) -> Option<Piece> {
        self.at = behind_blanks(self.bytes, self.at);
        if self.bytes.get(self.at) == Some(&b',') {
            self.at = behind_blanks(self.bytes, self.at + 1);
        }
        let start = self.at;
        let (piece, end) = match self.bytes.get(start)? {
            b'{' => (Piece::List(0), start + 1),
            b'}' => (Piece::End, start + 1),
            _ => {
                let (value, end) = number_at(self.bytes, start)?;
                (Piece::Number(value), end)
            }
        };
        self.at = end;
        self.last = (start, end);
        Some(piece)
    }

    /// The next piece; the end of a list behind the last one.
    pub fn read(&mut self) -> Piece {
        match self.piece() {
            Some(Piece::List(_)) => Piece::List(self.lengths.pop().unwrap_or(0)),
            Some(piece) => piece,
            None => Piece::End,
        }
    }

    /// Where the last piece stands; of a list, its `{`.
    pub fn place(&self) -> Span {
        self.span.part(self.last.0..self.last.1)
    }

    /// Steps over the parts and the end of a list that was just begun.
    pub fn skip_list(&mut self) {
        let mut nested = 1;
        while nested > 0 && self.at < self.bytes.len() {
            match self.read() {
                Piece::List(_) => nested += 1,
                Piece::End => nested -= 1,
                Piece::Number(_) => {}
            }
        }
    }

    /// Where the list ends that begins at this place and was just begun. It stays to be read.
    pub fn whole_list(&mut self, start: Span) -> Span {
        let (at, last) = (self.at, self.last);
        let mut nested = 1;
        while nested > 0 {
            match self.piece() {
                Some(Piece::List(_)) => nested += 1,
                Some(Piece::End) => nested -= 1,
                Some(Piece::Number(_)) => {}
                None => break,
            }
        }
        let whole = start.to(self.place());
        (self.at, self.last) = (at, last);
        whole
    }
}

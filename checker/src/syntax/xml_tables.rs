//! XML without its large tables.
//!
//! The reader of XML copies a text that has entities in it, byte by byte, and a table of millions
//! of numbers often stands beside a function with `&lt;` in it. So it reads a text from which large
//! tables are cut out, and says where nodes stand in that one.

use std::borrow::Cow;
use std::ops::Range;

use super::tables::Finder;

/// Smaller tables stay.
const LEAST_BYTES: usize = 1 << 12;

/// What was cut out of a text.
#[derive(Debug, Default)]
pub(super) struct Cuts {
    /// By cut, ascending: where it is in the text that is left, and how many bytes were cut out up
    /// to there.
    cuts: Vec<(usize, usize)>,
}

impl Cuts {
    /// A text without the inside of its large tables, and what was cut out. A text that declares
    /// entities stays whole: they may hold anything.
    pub(super) fn of(text: &str) -> (Cow<'_, str>, Cuts) {
        let mut cuts = Cuts::default();
        let mut left = String::new();
        let mut taken = 0;
        if text.contains("<!ENTITY") {
            return (Cow::Borrowed(text), cuts);
        }
        for table in tables(text) {
            left.push_str(&text[taken..=table.start]);
            taken = table.end - 1;
            cuts.cuts.push((left.len(), taken - left.len()));
        }
        if taken == 0 {
            return (Cow::Borrowed(text), cuts);
        }
        left.push_str(&text[taken..]);
        (Cow::Owned(left), cuts)
    }

    /// The bytes of the whole text that a range of what is left stands for.
    pub(super) fn whole(&self, range: Range<usize>) -> Range<usize> {
        let whole = |at: usize| {
            let before = self.cuts.partition_point(|&(cut, _)| cut <= at);
            at + before
                .checked_sub(1)
                .map_or(0, |before| self.cuts[before].1)
        };
        whole(range.start)..whole(range.end)
    }
}

/// Where the large tables of a text stand that have no markup in them.
fn tables(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut finder = Finder::default();
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let start = at + text[at..].find('{')?;
            at = start + 1;
            let Some(end) = finder.table_at(text.as_bytes(), start) else {
                continue;
            };
            at = end;
            if end - start >= LEAST_BYTES && !text[start..end].contains(['<', '&']) {
                return Some(start..end);
            }
        }
    })
}

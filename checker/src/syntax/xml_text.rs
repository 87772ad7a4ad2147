//! The text of XML elements with the places in the file that it comes from: entities, character
//! references, CDATA and line ends make the text that is parsed differ from the bytes of the file.

use super::xml_tables::Cuts;
use crate::diagnostics::to_u32;
use crate::diagnostics::{Source, SourceMap, Span, Text};
use roxmltree::Node;
use std::ops::Range;
use std::sync::Arc;

/// Smaller texts are copied.
const LEAST_SHARED_BYTES: usize = 1 << 12;

/// The file that elements are read from.
pub(super) struct XmlFile<'a> {
    pub(super) path: Arc<str>,
    pub(super) text: &'a Text,
    /// What was cut out of the text that nodes refer to.
    cuts: Cuts,
    line_starts: Arc<[u32]>,
}

impl<'a> XmlFile<'a> {
    pub(super) fn new(path: &str, text: &'a Text, cuts: Cuts) -> XmlFile<'a> {
        let ends = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n');
        let line_starts = std::iter::once(0)
            .chain(ends.map(|(index, _)| to_u32(index + 1)))
            .collect();
        XmlFile {
            path: path.into(),
            text,
            cuts,
            line_starts,
        }
    }

    /// The bytes of the file that a node stands in.
    pub(super) fn range(&self, node: Node) -> Range<usize> {
        self.cuts.whole(node.range())
    }

    /// Adds the text inside an element as a source; `place` says in words where it stands.
    pub(super) fn add_text(&self, node: Node, place: String, sources: &mut SourceMap) -> Span {
        let (start, end) = self.inner_range(node);
        let raw = self.text.get(start..end).unwrap_or("");
        let (text, offsets) = if raw.contains(['&', '<', '\r']) {
            let (text, offsets) =
                decode(raw, start).unwrap_or_else(|| (all_text(node), Vec::new()));
            (text.into(), offsets)
        } else {
            (self.piece(start..end), Vec::new())
        };
        self.add(text, offsets, start..end, place, sources)
    }

    /// Adds bytes of the file as they are.
    pub(super) fn add_raw(
        &self,
        range: Range<usize>,
        place: String,
        sources: &mut SourceMap,
    ) -> Span {
        let text = self.piece(range.clone());
        self.add(text, Vec::new(), range, place, sources)
    }

    /// Bytes of the file as they are. A large piece shares them with the file, which stays in
    /// memory for it.
    fn piece(&self, range: Range<usize>) -> Text {
        if range.len() > LEAST_SHARED_BYTES && range.len() > self.text.len() / 2 {
            return self.text.piece(range);
        }
        self.text.get(range).unwrap_or("").into()
    }

    fn add(
        &self,
        text: Text,
        offsets: Vec<(u32, u32)>,
        range: Range<usize>,
        place: String,
        sources: &mut SourceMap,
    ) -> Span {
        let lines = &self.line_starts;
        let first = lines.partition_point(|&line| line as usize <= range.start) - 1;
        let last = lines.partition_point(|&line| line as usize <= range.end);
        sources.add(Source {
            path: Arc::clone(&self.path),
            place,
            text,
            file_start: to_u32(range.start),
            offsets,
            line_starts: Arc::clone(lines),
            lines: to_u32(first)..to_u32(last),
        })
    }

    /// The bytes between an element's tags; empty for `<a/>`.
    fn inner_range(&self, node: Node) -> (usize, usize) {
        let range = self.range(node);
        let raw = self.text.get(range.clone()).unwrap_or("");
        let start = end_of_tag(raw);
        match raw.rfind("</") {
            Some(end) if end >= start => (range.start + start, range.start + end),
            _ => (range.start + start, range.start + start),
        }
    }
}

/// One past the `>` of the tag that a text begins with.
pub(super) fn end_of_tag(raw: &str) -> usize {
    let mut quote = None;
    for (index, byte) in raw.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return index + 1,
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), close) if open == close => quote = None,
            _ => {}
        }
    }
    raw.len()
}

/// The text as roxmltree understands it, for elements that use entities of the file's own.
fn all_text(node: Node) -> String {
    let texts = node.children().filter(Node::is_text);
    texts.filter_map(|child| child.text()).collect()
}

/// The decoded text and its further offsets; `None` if it uses an entity that is not predefined.
fn decode(raw: &str, file_start: usize) -> Option<(String, Vec<(u32, u32)>)> {
    let mut text = String::with_capacity(raw.len());
    let mut offsets = Vec::new();
    let mut position = 0;
    while position < raw.len() {
        let rest = &raw[position..];
        let plain = rest.find(['&', '<', '\r']).unwrap_or(rest.len());
        text.push_str(&rest[..plain]);
        position += plain;
        let rest = &raw[position..];
        if rest.is_empty() {
            break;
        }
        position += special(rest, position, file_start, &mut text, &mut offsets)?;
        offsets.push((to_u32(text.len()), to_u32(file_start + position)));
    }
    Some((text, offsets))
}

/// Decodes what a `&`, `<` or carriage return begins; returns its length in the file.
fn special(
    rest: &str,
    position: usize,
    file_start: usize,
    text: &mut String,
    offsets: &mut Vec<(u32, u32)>,
) -> Option<usize> {
    if rest.starts_with('\r') {
        text.push('\n');
        return Some(if rest.starts_with("\r\n") { 2 } else { 1 });
    }
    if let Some(cdata) = rest.strip_prefix("<![CDATA[") {
        let length = cdata.find("]]>")?;
        let start = position + "<![CDATA[".len();
        offsets.push((to_u32(text.len()), to_u32(file_start + start)));
        let mut lines = start;
        for line in cdata[..length].split_inclusive("\r\n") {
            lines += line.len();
            match line.strip_suffix("\r\n") {
                Some(line) => {
                    text.push_str(line);
                    text.push('\n');
                    offsets.push((to_u32(text.len()), to_u32(file_start + lines)));
                }
                None => text.push_str(line),
            }
        }
        return Some("<![CDATA[]]>".len() + length);
    }
    for (open, close) in [("<!--", "-->"), ("<?", "?>")] {
        if rest.starts_with(open) {
            return Some(rest.find(close)? + close.len());
        }
    }
    if rest.starts_with('<') {
        return Some(end_of_tag(rest));
    }
    let end = rest.find(';')?;
    text.push(entity(&rest[1..end])?);
    Some(end + 1)
}

fn entity(name: &str) -> Option<char> {
    Some(match name {
        "lt" => '<',
        "gt" => '>',
        "amp" => '&',
        "quot" => '"',
        "apos" => '\'',
        _ => {
            let digits = name.strip_prefix('#')?;
            let code = match digits.strip_prefix('x') {
                Some(hexadecimal) => u32::from_str_radix(hexadecimal, 16).ok()?,
                None => digits.parse().ok()?,
            };
            char::from_u32(code)?
        }
    })
}

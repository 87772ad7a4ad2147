//! From bytes to text: byte order marks, declared encodings, and the refusal of bytes that are not
//! text.
//!
//! Known are UTF-8, UTF-16 in both byte orders, US-ASCII and Latin-1; a byte order mark wins over
//! what the XML declaration says. Positions count characters, so they are right in every encoding.

use super::codes;
use crate::diagnostics::{Code, Diagnostic, SourceMap, Span};

/// Far beyond any model; a file of this size takes about 7 GB. Spans count in 32 bits.
const MOST_BYTES: usize = 1 << 28;

/// The text of a model; an empty file is refused.
pub(super) fn decode_model(
    path: &str,
    bytes: Vec<u8>,
    sources: &mut SourceMap,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<String> {
    let text = decode(path, bytes, sources, diagnostics)?;
    if text.trim().is_empty() {
        let message = "the file is empty";
        diagnostics.push(about_file(path, codes::EMPTY_FILE, message, sources));
        return None;
    }
    Some(text)
}

/// The text of a file without its byte order mark.
pub(super) fn decode(
    path: &str,
    bytes: Vec<u8>,
    sources: &mut SourceMap,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<String> {
    let mut report = |code, message: &str| {
        diagnostics.push(about_file(path, code, message, sources));
    };
    if bytes.len() > MOST_BYTES {
        report(codes::FILE_TOO_LARGE, "the file is larger than 256 MiB");
        return None;
    }
    match &bytes[..] {
        [0xef, 0xbb, 0xbf, ..] => {
            let mut bytes = bytes;
            bytes.drain(..3);
            return Some(utf8_or_latin1(bytes, &mut report));
        }
        [0xff, 0xfe, rest @ ..] => return utf16(rest, u16::from_le_bytes, &mut report),
        [0xfe, 0xff, rest @ ..] => return utf16(rest, u16::from_be_bytes, &mut report),
        [b'<', 0, ..] => return utf16(&bytes, u16::from_le_bytes, &mut report),
        [0, b'<', ..] => return utf16(&bytes, u16::from_be_bytes, &mut report),
        _ => {}
    }
    if bytes.contains(&0) {
        report(codes::NOT_A_MODEL, "this is a binary file, not a text");
        return None;
    }
    match declared_encoding(&bytes).as_deref() {
        Some("iso-8859-1" | "latin1" | "latin-1" | "iso8859-1" | "windows-1252" | "cp1252") => {
            Some(latin1(&bytes))
        }
        None | Some("utf-8" | "utf8" | "us-ascii" | "ascii" | "utf-16" | "utf16") => {
            Some(utf8_or_latin1(bytes, &mut report))
        }
        Some(other) if !bytes.is_ascii() => {
            let message = format!("the encoding `{other}` is not supported");
            report(codes::WRONG_ENCODING, &message);
            None
        }
        Some(_) => Some(utf8_or_latin1(bytes, &mut report)),
    }
}

fn about_file(path: &str, code: Code, message: &str, sources: &mut SourceMap) -> Diagnostic {
    let span: Span = super::add_file(path, String::new(), sources);
    let diagnostic = Diagnostic::new(code, span, message);
    match code {
        codes::EMPTY_FILE | codes::NOT_A_MODEL => {
            diagnostic.help("a model is an XML file that UPPAAL wrote, or a text in the XTA format")
        }
        codes::WRONG_ENCODING | codes::NOT_UTF8 => diagnostic.help("save the file as UTF-8"),
        _ => diagnostic,
    }
}

fn utf8_or_latin1(bytes: Vec<u8>, report: &mut impl FnMut(Code, &str)) -> String {
    String::from_utf8(bytes).unwrap_or_else(|error| {
        report(
            codes::NOT_UTF8,
            "the file is not UTF-8; it is read as Latin-1",
        );
        latin1(error.as_bytes())
    })
}

fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

fn utf16(
    bytes: &[u8],
    unit: fn([u8; 2]) -> u16,
    report: &mut impl FnMut(Code, &str),
) -> Option<String> {
    let units: Vec<u16> = bytes
        .as_chunks::<2>()
        .0
        .iter()
        .map(|&pair| unit(pair))
        .collect();
    let text = String::from_utf16(&units);
    if text.is_err() || bytes.len() % 2 == 1 {
        let message = "the file begins like UTF-16, but is not UTF-16";
        report(codes::WRONG_ENCODING, message);
        return None;
    }
    text.ok()
}

/// What `<?xml … encoding="…"?>` says, in lower case.
fn declared_encoding(bytes: &[u8]) -> Option<String> {
    let head: String = bytes
        .iter()
        .take(200)
        .map(|&byte| char::from(byte))
        .collect();
    let declaration = head.trim_start().strip_prefix("<?xml")?;
    let declaration = &declaration[..declaration.find("?>")?];
    let value = declaration[declaration.find("encoding")?..]
        .split_once('=')?
        .1
        .trim_start();
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    let end = value[1..].find(quote)?;
    Some(value[1..=end].to_ascii_lowercase())
}

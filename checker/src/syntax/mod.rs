//! From text to syntax trees: lexer, parser, and the readers of the file formats.
//!
//! Parsing never fails and never panics: it returns a tree and a list of diagnostics. It knows no types.

pub mod ast;

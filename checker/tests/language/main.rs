//! The language: reading, names and types, and the pages that explain diagnostics.

mod beginners;
#[path = "../common/checks.rs"]
#[allow(dead_code, reason = "this program asks in some of the ways only")]
mod checks;
#[path = "../common/corpus.rs"]
#[allow(dead_code, reason = "this program reads some of the files only")]
mod corpus;
mod explanations;
mod names;
mod semantics;
mod syntax;
mod tables;

//! The language: reading, names and types, and the pages that explain diagnostics.

mod explanations;
mod semantics;
mod syntax;

//! Running code: every operator against a table made by hand, and all engines against each other on
//! random programs and on models.

#[path = "../common/corpus.rs"]
#[allow(dead_code, reason = "this program reads some of the files only")]
mod corpus;
mod distributions;
mod models;
mod operators;
mod random;
mod sharing;
mod support;
mod validation;

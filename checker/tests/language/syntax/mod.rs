//! The readers: corpus files, trees of expressions and queries, XML positions, and properties over
//! generated texts.

mod corpus;
mod expressions;
mod limits;
mod models;
mod properties;
mod queries;
mod support;

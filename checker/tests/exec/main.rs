//! Running code: every operator against a table made by hand, and all engines against each other on
//! random programs and on models.

mod models;
mod operators;
mod random;
mod support;
mod validation;

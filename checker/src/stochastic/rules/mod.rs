//! The rules of the race, each written once.
//!
//! A rule is a function over a [`Backend`], which has the operations that rules consist of. The
//! race carries them out on its state (`race/direct.rs`); `race_code` writes code that does so
//! later. So a rule tells what is known beforehand, as Rust's `if` and `match`, from what is only
//! known in a run, as [`Backend::when`] and [`Backend::cases`]: of the latter, code has all ways.
//!
//! What only the race can do it does in functions that it gives to the rules, such as
//! [`Backend::other_attempt`]: networks that need them are not written as code.

mod backend;
mod choices;
mod conditions;
mod plans;
mod windows;

pub(super) use backend::{Backend, Flow, Held};
pub(super) use choices::{Candidate, branch, compete, draw, one_of};
pub(super) use conditions::{number, require, size, span};
pub(super) use plans::{exponential_rate, is_any_enabled, plan, require_invariant, stay, tolerant};
pub(super) use windows::delay_in_windows;

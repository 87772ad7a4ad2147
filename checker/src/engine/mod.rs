//! The face of the engine: load a model, ask it queries, get answers.
//!
//! Everything here is a value: diagnostics, answers, traces, strategies, plans. Nothing prints, and
//! the only clock that is read is the one for the time limit and the measured seconds.

pub mod answer;
mod check;
mod code;
pub mod codes;
mod constants;
pub mod evidence;
pub mod format;
pub mod limits;
pub mod loaded_model;
pub mod options;
pub mod query;
pub mod query_form;
mod rejection;
pub mod session;
pub mod stored_state;
pub mod survey;
mod unsupported;

pub use crate::search::reachability::report::MOST_THREADS;
pub use answer::{Answer, Evidence, Stopped, Verdict, Verification, Wanted};
pub use limits::Limits;
pub use loaded_model::{LoadedModel, NamedStrategy};
pub use options::{CodeEngine, Options, RareEvent, Reductions, Rules, StrategyWanted, TraceWanted};
pub use query::joint::JointQuery;
pub use query_form::QueryForm;
pub use rejection::Rejection;

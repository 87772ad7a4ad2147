//! What backs an answer: runs, certificates, strategies, and their checks.

pub mod certificate;
pub mod checked;
pub(super) mod error_trace;
pub mod evidence_file;
mod learned_files;
pub mod named_strategies;
mod permitted;
pub mod policies;
mod shield_files;
pub(super) mod shown_states;
pub mod strategy_check;
pub(super) mod strategy_place;
pub mod timed_run;
pub(super) mod trace_file;
pub mod witness;

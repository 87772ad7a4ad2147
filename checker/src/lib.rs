//! An engine for UPPAAL timed automata and timed games: loads a model, checks queries, synthesises
//! strategies.
//!
//! The modules stand in reading order; each may use the ones above it and none below
//! (`checker/ARCHITECTURE.md` says what each must not know, and a test enforces it).

pub mod cancellation;
pub mod diagnostics;

mod builtins;
pub mod syntax;

pub mod names;
pub mod tuning;

pub mod ir;

pub mod exec;
pub mod semantics;

pub mod zones;

pub mod analysis;

pub mod network;

pub mod search;

pub mod game;

pub mod stochastic;

pub mod learning;

pub mod shield;

pub mod verify;

pub mod engine;

#[cfg(feature = "python")]
mod python;

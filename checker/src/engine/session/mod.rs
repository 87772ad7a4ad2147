//! Step by step: walks through a model, and plays against a strategy.

pub mod play;
pub mod walk;

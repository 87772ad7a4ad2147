//! Step by step: walks through a model, plays against a strategy, and the plans of a list.

pub mod plan_texts;
pub mod play;
pub mod walk;

//! Step by step: walks through a model, plays against a strategy, random runs in which somebody
//! outside decides, and the plans of a list.

pub mod environment;
pub mod plan_texts;
pub mod play;
pub mod walk;

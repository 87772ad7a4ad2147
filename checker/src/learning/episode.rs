//! What is kept of runs: the decisions of the controller, with what it saw and what they cost.

/// A decision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// What the controller did: a move, or [`super::WAIT`].
    pub(super) action: u32,
    /// The number of possible actions.
    pub(super) choices: u32,
    /// The cost between this decision and the next, or the end of the run.
    pub(super) cost: f64,
    /// The time until then.
    pub(super) time: f64,
    /// Whether what is seen changed meanwhile with the rates that are kept with it.
    pub(super) moves: bool,
}

/// The decisions of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Episode {
    /// In their order.
    pub(super) steps: Vec<Step>,
    /// What was seen exactly: the same number of words for each step.
    pub(super) keys: Vec<i32>,
    /// What was seen in intervals: for each step its numbers, and their rates if they moved.
    pub(super) points: Vec<f64>,
    /// The possible actions, step by step.
    pub(super) choices: Vec<u32>,
    /// The cost of the whole run.
    pub(super) cost: f64,
}

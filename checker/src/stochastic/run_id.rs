//! Which run it is.

/// A run of a seed, by its number: it has the same random numbers wherever it is made.
#[derive(Clone, Copy, Debug)]
pub struct RunId {
    /// The seed of all runs of a query.
    pub seed: u64,
    /// The number of the run.
    pub run: u64,
}

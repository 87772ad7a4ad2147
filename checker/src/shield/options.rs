//! How a shield is sampled.

/// What counts where a run leaves the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Outside {
    /// The shield cannot be made.
    #[default]
    Error,
    /// All is safe there.
    Safe,
    /// Nothing is safe there.
    Unsafe,
    /// It is safe if all samples outside have what must be kept.
    Sampled,
}

/// How a shield is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// How many samples of a cell there are along an axis.
    pub samples: u32,
    /// How many runs begin with each move in each sample.
    pub repeats: u32,
    /// What counts where a run leaves the grid.
    pub outside: Outside,
}

impl Default for Sampling {
    fn default() -> Sampling {
        Sampling {
            samples: 3,
            repeats: 1,
            outside: Outside::default(),
        }
    }
}

/// How runs are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Manner {
    /// The seed of all runs.
    pub seed: u64,
    /// How many threads make them.
    pub threads: usize,
}

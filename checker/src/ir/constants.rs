//! The constant memory, which everything that runs code shares.

use std::ops::Deref;
use std::sync::Arc;

/// The words of the constant memory. A copy shares them, so that a table lies in memory once,
/// however many engines read it.
#[derive(Clone, Debug, Default)]
pub struct Constants(Arc<Vec<i32>>);

impl Constants {
    /// Appends words, which are copied only if there are others before them.
    pub fn append(&mut self, mut words: Vec<i32>) {
        let own = Arc::make_mut(&mut self.0);
        if own.is_empty() {
            *own = words;
        } else {
            own.append(&mut words);
        }
    }
}

impl Deref for Constants {
    type Target = [i32];

    fn deref(&self) -> &[i32] {
        &self.0
    }
}

impl From<&Constants> for Constants {
    fn from(other: &Constants) -> Constants {
        other.clone()
    }
}

impl From<&[i32]> for Constants {
    fn from(words: &[i32]) -> Constants {
        Constants(Arc::new(words.to_vec()))
    }
}

impl<const N: usize> From<&[i32; N]> for Constants {
    fn from(words: &[i32; N]) -> Constants {
        Constants(Arc::new(words.to_vec()))
    }
}

//! How a call that runs long is ended from outside.
//!
//! Whoever runs a model says what to look at, for example a clock. Engines look now and then between rounds of loops, so that it costs
//! nothing where calls are short. Once it was time, the alarm stays raised until it is set anew, and every call that looks ends with
//! [`crate::ir::RunTimeErrorKind::Interrupted`].

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Returns whether it is time to end.
pub type Look = Arc<dyn Fn() -> bool + Send + Sync>;

/// So many rounds of loops run between two looks.
pub(super) const ROUNDS_BETWEEN_LOOKS: u64 = 1 << 16;

/// Ends calls.
#[derive(Default)]
pub struct Alarm {
    is_raised: AtomicBool,
    look: Mutex<Option<Look>>,
}

impl Alarm {
    /// Takes the alarm back, and says what to look at from now on; `None` lets every call run to its end.
    pub fn set(&self, look: Option<Look>) {
        *self.look.lock().unwrap_or_else(PoisonError::into_inner) = look;
        self.is_raised.store(false, Ordering::Relaxed);
    }

    /// Looks whether it is time to end.
    pub fn is_due(&self) -> bool {
        if self.is_raised.load(Ordering::Relaxed) {
            return true;
        }
        let look = self
            .look
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        let is_due = look.is_some_and(|look| look());
        if is_due {
            self.is_raised.store(true, Ordering::Relaxed);
        }
        is_due
    }
}

impl fmt::Debug for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Alarm")
            .field("is_raised", &self.is_raised)
            .finish_non_exhaustive()
    }
}

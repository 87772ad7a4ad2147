//! Limits of one query: states, memory, time, and the user's interruption.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::search::limits::{Counters, StopReason, Watch};

/// Is shown the counters now and then; true ends the search.
pub type Observer = Arc<dyn Fn(&Counters) -> bool + Send + Sync>;

/// When to give up; `None` is never.
#[derive(Clone, Default)]
pub struct Limits {
    /// Stored states.
    pub states: Option<u64>,
    /// Bytes of stored states with their tables.
    pub memory_bytes: Option<u64>,
    /// Time.
    pub timeout: Option<Duration>,
    /// Sees the progress, and can interrupt.
    pub observer: Option<Observer>,
}

impl std::fmt::Debug for Limits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Limits {
            states,
            memory_bytes,
            timeout,
            observer,
        } = self;
        f.debug_struct("Limits")
            .field("states", states)
            .field("memory_bytes", memory_bytes)
            .field("timeout", timeout)
            .field("observer", &observer.is_some())
            .finish()
    }
}

/// How often the observer is shown the counters.
const SHOW_EVERY: Duration = Duration::from_millis(50);

/// Watches a search for the limits.
#[derive(Debug)]
pub(super) struct LimitWatch {
    limits: Limits,
    start: Instant,
    shown: Instant,
    /// The greatest number of bytes seen.
    pub(super) peak_bytes: u64,
}

impl LimitWatch {
    pub(super) fn new(limits: Limits) -> LimitWatch {
        let now = Instant::now();
        LimitWatch {
            limits,
            start: now,
            shown: now,
            peak_bytes: 0,
        }
    }
}

impl Watch for LimitWatch {
    fn look(&mut self, counters: &Counters) -> Option<StopReason> {
        self.peak_bytes = self.peak_bytes.max(counters.bytes);
        if self
            .limits
            .states
            .is_some_and(|limit| counters.stored >= limit)
        {
            return Some(StopReason::States);
        }
        if self
            .limits
            .memory_bytes
            .is_some_and(|limit| counters.bytes >= limit)
        {
            return Some(StopReason::Memory);
        }
        let now = Instant::now();
        if self
            .limits
            .timeout
            .is_some_and(|limit| now - self.start >= limit)
        {
            return Some(StopReason::Time);
        }
        if now - self.shown >= SHOW_EVERY {
            self.shown = now;
            if self
                .limits
                .observer
                .as_ref()
                .is_some_and(|observer| observer(counters))
            {
                return Some(StopReason::Interrupted);
            }
        }
        None
    }
}

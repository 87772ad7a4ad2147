//! Limits of one query: states, memory, time, and the user's interruption.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use crate::exec::{Alarm, Look};
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
    patience: Arc<Patience>,
    /// The greatest number of bytes seen.
    pub(super) peak_bytes: u64,
}

/// What is looked at between states, and also in the middle of a call that runs long.
struct Patience {
    start: Instant,
    timeout: Option<Duration>,
    observer: Option<Observer>,
    /// The thread that asked: the observer is called by it alone.
    owner: ThreadId,
    seen: Mutex<Seen>,
}

/// What was seen last.
#[derive(Clone, Copy, Debug)]
struct Seen {
    counters: Counters,
    /// When it was shown to the observer.
    shown: Instant,
    /// Why an end was called for.
    stop: Option<StopReason>,
}

impl Patience {
    fn look(&self, counters: Option<&Counters>) -> Option<StopReason> {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(&counters) = counters {
            seen.counters = counters;
        }
        let now = Instant::now();
        if self.timeout.is_some_and(|limit| now - self.start >= limit) {
            seen.stop = Some(StopReason::Time);
        } else if now - seen.shown >= SHOW_EVERY && thread::current().id() == self.owner {
            seen.shown = now;
            let counters = seen.counters;
            // Others that look meanwhile need not wait for what is shown.
            drop(seen);
            let ends = self.observer.as_ref().is_some_and(|show| show(&counters));
            seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
            if ends {
                seen.stop = Some(StopReason::Interrupted);
            }
        }
        seen.stop
    }
}

impl std::fmt::Debug for Patience {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Patience")
            .field("start", &self.start)
            .field("timeout", &self.timeout)
            .field("seen", &self.seen)
            .finish_non_exhaustive()
    }
}

/// Takes the alarm back when it is dropped.
pub(super) struct Armed<'a>(&'a Alarm);

impl Drop for Armed<'_> {
    fn drop(&mut self) {
        self.0.set(None);
    }
}

impl LimitWatch {
    pub(super) fn new(limits: Limits) -> LimitWatch {
        let now = Instant::now();
        let seen = Seen {
            counters: Counters::default(),
            shown: now,
            stop: None,
        };
        LimitWatch {
            patience: Arc::new(Patience {
                start: now,
                timeout: limits.timeout,
                observer: limits.observer.clone(),
                owner: thread::current().id(),
                seen: Mutex::new(seen),
            }),
            limits,
            peak_bytes: 0,
        }
    }

    /// Lets the limit of time and the user end calls of the model's code too, as long as the value lives.
    pub(super) fn arm<'a>(&self, alarm: &'a Alarm) -> Armed<'a> {
        let patience = Arc::clone(&self.patience);
        let look: Look = Arc::new(move || patience.look(None).is_some());
        alarm.set(Some(look));
        Armed(alarm)
    }

    /// Why an end was called for, by the limit of time or by the user.
    pub(super) fn stop(&self) -> StopReason {
        self.last_stop().unwrap_or(StopReason::Interrupted)
    }

    /// Whether the user called for an end.
    pub(super) fn is_interrupted(&self) -> bool {
        self.last_stop() == Some(StopReason::Interrupted)
    }

    fn last_stop(&self) -> Option<StopReason> {
        let seen = self.patience.seen.lock();
        seen.unwrap_or_else(PoisonError::into_inner).stop
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
        self.patience.look(Some(counters))
    }
}

//! Limits of one query: states, memory, time, and the user's interruption.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use crate::cancellation::{self, Cut, Look, OUT_OF_NUMBERS};
use crate::network::Failure;
use crate::search::limits::{Counters, StopReason, Watch};
use crate::search::store::disk::Disk;

/// Is shown the counters now and then; a reason ends the search. It may watch limits of its own,
/// such as the memory of the whole process.
pub type Observer = Arc<dyn Fn(&Counters) -> Option<StopReason> + Send + Sync>;

/// When to give up; `None` is never.
#[derive(Clone, Default)]
pub struct Limits {
    /// Stored states.
    pub states: Option<u64>,
    /// Bytes of stored states with their tables.
    pub memory_bytes: Option<u64>,
    /// Where states go that have no room in that memory, in searches that can do so.
    pub disk: Option<Arc<Disk>>,
    /// Time.
    pub timeout: Option<Duration>,
    /// Sees the progress, and can interrupt.
    pub observer: Option<Observer>,
}

impl Limits {
    /// The same with the time that is left if work began at this moment.
    pub(crate) fn left_since(&self, start: Instant) -> Limits {
        let left = |timeout: Duration| timeout.saturating_sub(start.elapsed());
        Limits {
            timeout: self.timeout.map(left),
            ..self.clone()
        }
    }
}

impl std::fmt::Debug for Limits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Limits {
            states,
            memory_bytes,
            disk,
            timeout,
            observer,
        } = self;
        f.debug_struct("Limits")
            .field("states", states)
            .field("memory_bytes", memory_bytes)
            .field("disk", disk)
            .field("timeout", timeout)
            .field("observer", &observer.is_some())
            .finish()
    }
}

/// How often the observer is shown the counters: a process that takes a gigabyte a second takes
/// three megabytes meanwhile.
const SHOW_EVERY: Duration = Duration::from_millis(3);

/// Watches a search for the limits.
#[derive(Debug)]
pub(super) struct LimitWatch {
    limits: Limits,
    shared: Arc<SharedLimits>,
}

/// What is looked at between states, and also in the middle of an operation that takes long.
struct SharedLimits {
    start: Instant,
    timeout: Option<Duration>,
    memory_bytes: Option<u64>,
    /// What the search takes that no counter tells: the zones that one operation has at hand.
    at_hand_bytes: u64,
    observer: Option<Observer>,
    /// The thread that asked: the observer is called by it alone.
    owner: ThreadId,
    seen: Mutex<Seen>,
}

/// What was seen last.
#[derive(Clone, Copy, Debug)]
struct Seen {
    counters: Counters,
    /// The greatest number of bytes.
    peak_bytes: u64,
    /// When it was shown to the observer.
    shown: Instant,
    /// Why an end was called for.
    stop: Option<StopReason>,
    /// Whether that was because there are more states than numbers for them.
    is_out_of_numbers: bool,
}

impl Seen {
    /// The bytes that were counted last and these beside them, which may be the most so far.
    fn memory_with(&mut self, bytes: u64) -> u64 {
        let memory = self.counters.bytes.saturating_add(bytes);
        self.peak_bytes = self.peak_bytes.max(memory);
        memory
    }
}

impl SharedLimits {
    /// Looks, when so many bytes are about to be allocated beside those that were counted last.
    fn look_beside(&self, bytes: u64) -> Option<StopReason> {
        let mut seen = self.seen();
        if bytes == OUT_OF_NUMBERS {
            seen.is_out_of_numbers = true;
            seen.stop = Some(StopReason::States);
            return seen.stop;
        }
        let memory = seen.memory_with(bytes).saturating_add(self.at_hand_bytes);
        let now = Instant::now();
        if self.timeout.is_some_and(|limit| now - self.start >= limit) {
            seen.stop = Some(StopReason::Time);
        } else if bytes > 0 && self.memory_bytes.is_some_and(|limit| memory >= limit) {
            seen.stop = Some(StopReason::Memory);
        } else if now - seen.shown >= SHOW_EVERY && thread::current().id() == self.owner {
            seen.shown = now;
            let counters = seen.counters;
            // Others that look meanwhile need not wait for what is shown.
            drop(seen);
            let reason = self.observer.as_ref().and_then(|show| show(&counters));
            seen = self.seen();
            seen.stop = seen.stop.or(reason);
        }
        seen.stop
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for SharedLimits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SharedLimits")
            .field("start", &self.start)
            .field("timeout", &self.timeout)
            .field("seen", &self.seen)
            .finish_non_exhaustive()
    }
}

impl LimitWatch {
    pub(super) fn new(limits: Limits) -> LimitWatch {
        LimitWatch::with_at_hand(limits, 0)
    }

    /// One that counts so many bytes beside those that the search tells.
    pub(super) fn with_at_hand(limits: Limits, at_hand_bytes: u64) -> LimitWatch {
        let now = Instant::now();
        let seen = Seen {
            counters: Counters::default(),
            peak_bytes: 0,
            shown: now,
            stop: None,
            is_out_of_numbers: false,
        };
        LimitWatch {
            shared: Arc::new(SharedLimits {
                start: now,
                timeout: limits.timeout,
                memory_bytes: limits.memory_bytes,
                at_hand_bytes,
                observer: limits.observer.clone(),
                owner: thread::current().id(),
                seen: Mutex::new(seen),
            }),
            limits,
        }
    }

    /// Does work that the limits and the user end in the middle of operations, too.
    ///
    /// # Errors
    /// It was ended there; gives what was counted last.
    pub(super) fn bound<R>(
        &mut self,
        run: impl FnOnce(&mut LimitWatch) -> R,
    ) -> Result<R, (StopReason, Counters)> {
        let shared = Arc::clone(&self.shared);
        let look: Look = Arc::new(move |bytes| shared.look_beside(bytes).is_some());
        let result = cancellation::within(look, || run(self));
        result.map_err(|Cut| (self.stop(), self.shared.seen().counters))
    }

    /// Whether a limit is reached after so many runs.
    pub(super) fn ends_runs(&mut self, runs: u64) -> bool {
        let counters = Counters {
            explored: runs,
            ..Counters::default()
        };
        self.look(&counters).is_some()
    }

    /// The seconds since it began.
    pub(super) fn seconds(&self) -> f64 {
        self.shared.start.elapsed().as_secs_f64()
    }

    /// The greatest number of bytes seen.
    pub(super) fn peak_bytes(&self) -> u64 {
        self.shared.seen().peak_bytes
    }

    /// Why an end was called for, by the limit of time or by the user.
    pub(super) fn stop(&self) -> StopReason {
        self.last_stop().unwrap_or(StopReason::Interrupted)
    }

    /// Whether a limit or the user called for an end.
    pub(super) fn has_stopped(&self) -> bool {
        self.last_stop().is_some()
    }

    /// Whether the user called for an end.
    pub(super) fn is_interrupted(&self) -> bool {
        self.last_stop() == Some(StopReason::Interrupted)
    }

    /// Whether there are more states than numbers for them.
    pub(super) fn is_out_of_numbers(&self) -> bool {
        self.shared.seen().is_out_of_numbers
    }

    fn last_stop(&self) -> Option<StopReason> {
        self.shared.seen().stop
    }
}

/// What becomes of a search in zones whose bounds are too great.
pub(crate) const CLOCKS_GREW: &str = "clocks, or differences of them, grow beyond what zones can hold: no abstraction keeps them small";

/// What is said where there are more states than numbers for them.
pub(crate) const OUT_OF_STATES: &str = "there are more than 4,294,967,295 states or moves between them, as many as a search has numbers for";

/// What is said where states cannot be written to disk.
pub(crate) const DISK_FAILED: &str =
    "states that have no room in memory cannot be written to disk; it may be full";

/// What ended work after the verdict.
pub(crate) fn ended_text(reason: StopReason) -> &'static str {
    match reason {
        StopReason::States => "stopped by the state limit",
        StopReason::Memory => "stopped by the memory limit",
        StopReason::Disk => DISK_FAILED,
        StopReason::Time => "stopped by the time limit",
        StopReason::Interrupted => "interrupted",
        StopReason::Clocks => CLOCKS_GREW,
    }
}

/// Why a search was stopped.
pub(crate) fn stop_text(reason: StopReason) -> &'static str {
    match reason {
        StopReason::States => "the search for it was stopped by the state limit",
        StopReason::Memory => "the search for it was stopped by the memory limit",
        StopReason::Disk => DISK_FAILED,
        StopReason::Time => "the search for it was stopped by the time limit",
        StopReason::Interrupted => "the search for it was interrupted",
        StopReason::Clocks => CLOCKS_GREW,
    }
}

/// Does work that may be cut off in the middle of an operation without what was found before: then
/// it fails as interrupted.
///
/// # Errors
/// The work fails, or was cut off.
pub(super) fn cut_as_interrupted<R>(
    run: impl FnOnce() -> Result<R, Failure>,
) -> Result<R, Failure> {
    cancellation::unless_cut(run).unwrap_or(Err(Failure::Interrupted))
}

impl Watch for LimitWatch {
    fn look(&mut self, counters: &Counters) -> Option<StopReason> {
        let mut seen = self.shared.seen();
        seen.counters = *counters;
        let memory = seen
            .memory_with(0)
            .saturating_add(self.shared.at_hand_bytes);
        drop(seen);
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
            .is_some_and(|limit| memory >= limit)
        {
            return Some(StopReason::Memory);
        }
        self.shared.look_beside(0)
    }

    fn disk(&self) -> Option<&Disk> {
        self.limits.disk.as_deref()
    }
}

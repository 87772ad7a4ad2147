//! Whether sums of bounds need 64 bits, and whether some were beyond what bounds can hold.
//!
//! Constants above [`NARROW`] are rare, and sums in 32 bits are faster: they get 64 bits once such
//! a constant has been seen in this process ([`is_on`]).
//!
//! A sum may lie beyond what a bound can hold. If it is above the greatest constant, there is no
//! bound; if it is below the negative of that, the bound is the strict one with it. Both only
//! forget what no comparison of a single clock with a constant can tell apart: it is what `Extra_M`
//! forgets if all clocks are compared with the greatest constant (see [`super::extrapolate`]).
//! Where clocks are compared with each other, this does not hold. So it is noted by thread that
//! something was forgotten ([`has_forgotten`]), for those who have to know. A matrix that lacks
//! such a bound is not closed in the strict sense: see [`super::minimal`].

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// The greatest constant with which sums of bounds need no more than 32 bits.
pub const NARROW: i32 = (1 << 27) - 1;

/// Whether there was a constant above [`NARROW`]. Whoever sees a bound with such a constant saw it
/// made, or got it from a thread that did.
static IS_ON: AtomicBool = AtomicBool::new(false);

thread_local! {
    static HAS_FORGOTTEN: Cell<bool> = const { Cell::new(false) };
}

/// Whether sums must be formed in 64 bits.
#[inline]
pub(super) fn is_on() -> bool {
    #[cfg(test)]
    if let Some(is_on) = forced::IS_ON.get() {
        return is_on;
    }
    IS_ON.load(Ordering::Relaxed)
}

/// Is told the constants of comparisons and the values that clocks are set to.
#[inline]
pub fn admit(value: i32) {
    #[cfg(test)]
    if forced::IS_ON.get().is_some() {
        return;
    }
    if value.unsigned_abs() > NARROW.unsigned_abs() && !is_on() {
        IS_ON.store(true, Ordering::Relaxed);
    }
}

/// Whether this thread has lost a bound that lies beyond the range, since [`start`].
pub fn has_forgotten() -> bool {
    HAS_FORGOTTEN.get()
}

/// Starts to note what this thread loses.
pub fn start() {
    HAS_FORGOTTEN.set(false);
}

/// Notes that another thread that shared the work lost a bound.
pub fn note() {
    HAS_FORGOTTEN.set(true);
}

/// Does work whose lost bounds do not matter.
pub(super) fn unnoticed<R>(run: impl FnOnce() -> R) -> R {
    let before = HAS_FORGOTTEN.get();
    let result = run();
    HAS_FORGOTTEN.set(before);
    result
}

/// What a test wants of its thread, whatever constants other tests have.
#[cfg(test)]
pub(super) mod forced {
    use std::cell::Cell;

    thread_local! {
        pub(super) static IS_ON: Cell<Option<bool>> = const { Cell::new(None) };
    }

    pub(in crate::zones) fn set(is_on: bool) {
        IS_ON.set(Some(is_on));
    }
}

//! How work that takes too long, or too much memory, is ended from inside the operation at hand.
//!
//! The caller that starts work says what to look at ([`within`]): a clock, an account of memory, a
//! user who interrupts. Operations that can take long say what they have done ([`work`]) and what
//! they are about to allocate ([`ask_for`]), and now and then that is looked at. When it is time to
//! end, the thread unwinds to the caller that started the work, which gets [`Cut`]: nothing that is
//! half done is ever seen, and what it took is given back on the way. Where code that cannot unwind
//! runs, it asks ([`is_due`]) and ends by an error of its own.
//!
//! What is looked at belongs to a thread; who starts another one hands it on ([`current`],
//! [`looking_at`]). Where nothing is to be looked at, work runs to its end.
//!
//! Unwinding is how the incremental computations of rust-analyzer are cancelled, too (`Cancelled`
//! of the library salsa): the alternative, an error in the type of every operation on sets, would
//! be as long as the operations themselves.

use std::cell::{Cell, RefCell};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Arc;
use std::thread;

/// Returns whether to end; is told how many bytes are about to be allocated beside what the account
/// says, or [`OUT_OF_NUMBERS`].
pub type Look = Arc<dyn Fn(u64) -> bool + Send + Sync>;

/// Work was cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut;

/// What a [`Look`] is told when work ends because there are too many things to number.
pub const OUT_OF_NUMBERS: u64 = u64::MAX;

/// Units of work between two looks: bounds that are read or written, of which a core does about a
/// thousand million a second.
const BETWEEN_LOOKS: i64 = 1 << 21;

/// Bytes of something that grows between two looks.
const BYTES_BETWEEN_LOOKS: usize = 1 << 20;

thread_local! {
    /// Units of work that are left until the next look.
    static LEFT: Cell<i64> = const { Cell::new(i64::MAX) };
    static LOOK: RefCell<Option<Look>> = const { RefCell::new(None) };
    /// Units of work that were done.
    static DONE: Cell<u64> = const { Cell::new(0) };
    /// Bytes of the operations that run: see [`hold`].
    static HELD: Cell<u64> = const { Cell::new(0) };
    /// How many things of a kind have numbers: see [`number`].
    static NUMBERS: Cell<usize> = const { Cell::new(u32::MAX as usize) };
}

/// Counts units of work, and looks when they have become many.
///
/// A unit is about what it takes to read and compare one bound of a zone.
#[inline]
pub fn work(units: usize) {
    DONE.with(|done| done.set(done.get().wrapping_add(units as u64)));
    LEFT.with(|left| {
        let rest = left.get().saturating_sub_unsigned(units as u64);
        left.set(rest);
        if rest < 0 {
            look_and_unwind(0);
        }
    });
}

/// How many units of work this thread has done; two such numbers show what was done in between.
pub fn done() -> u64 {
    DONE.with(Cell::get)
}

/// Looks before this number of bytes is allocated beside what the account says and what is held.
#[cold]
pub fn ask_for(bytes: usize) {
    look_and_unwind(bytes as u64 + HELD.get());
}

/// Bytes that an operation holds until the value is dropped.
#[must_use]
#[derive(Debug)]
pub struct Held(u64);

/// Tells that an operation of this thread holds these bytes while others are allocated: no account
/// counts the values that an operation computes on the way to its result.
pub fn hold(bytes: usize) -> Held {
    HELD.set(HELD.get() + bytes as u64);
    Held(bytes as u64)
}

/// Room that something takes which grows bit by bit.
#[derive(Debug, Default)]
pub struct Room {
    bytes: usize,
    asked: usize,
}

impl Room {
    /// Takes these bytes more. They are asked for when they have become many.
    pub fn take(&mut self, bytes: usize) {
        self.bytes += bytes;
        if self.bytes >= self.asked + BYTES_BETWEEN_LOOKS {
            self.asked = self.bytes;
            ask_for(self.bytes);
        }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        HELD.set(HELD.get() - self.0);
    }
}

/// The number of a new thing of which there are `count`, such as a state that is stored. Numbers
/// have 32 bits, which keeps tables small, and the last one stands for none: where there are more
/// things, work ends as it does at a limit.
#[inline]
pub fn number(count: usize) -> u32 {
    if count >= NUMBERS.get() {
        run_out_of_numbers();
    }
    count as u32
}

/// The same where fewer bits are left for the number.
#[inline]
pub fn number_below(most: usize, count: usize) -> u32 {
    if count >= most {
        run_out_of_numbers();
    }
    number(count)
}

#[cold]
fn run_out_of_numbers() -> ! {
    look(OUT_OF_NUMBERS);
    cut()
}

/// Does work as if numbers were fewer; for tests.
pub fn with_numbers<R>(most: u32, run: impl FnOnce() -> R) -> R {
    let _before = NumbersBefore(NUMBERS.replace(most as usize));
    run()
}

/// Puts back how many numbers there were, also where the work is cut off.
struct NumbersBefore(usize);

impl Drop for NumbersBefore {
    fn drop(&mut self) {
        NUMBERS.set(self.0);
    }
}

/// Looks whether to end, for code that cannot unwind.
pub fn is_due() -> bool {
    look(0)
}

/// Does work, looking at this; whoever looked at something else before does so again afterwards.
///
/// # Errors
/// The work was cut off.
pub fn within<R>(look: Look, run: impl FnOnce() -> R) -> Result<R, Cut> {
    unless_cut(|| looking_at(Some(look), run))
}

/// Does work that looks at what is looked at anyway, but does not take what was done before along
/// when it is cut off.
///
/// # Errors
/// The work was cut off.
pub fn unless_cut<R>(run: impl FnOnce() -> R) -> Result<R, Cut> {
    match panic::catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => Ok(result),
        Err(cause) if cause.is::<Cut>() => Err(Cut),
        Err(panic) => panic::resume_unwind(panic),
    }
}

/// Unwinds to whoever started the work: for who has caught [`Cut`] and does not end there.
pub fn cut() -> ! {
    panic::resume_unwind(Box::new(Cut))
}

/// What this thread looks at, for another one that shares its work.
pub fn current() -> Option<Look> {
    LOOK.with(|look| look.borrow().clone())
}

/// Does work, looking at this, and lets it unwind to whoever is called a thread, or a caller above.
pub fn looking_at<R>(look: Option<Look>, run: impl FnOnce() -> R) -> R {
    let _before = Before(replace(look));
    run()
}

/// Puts back what was looked at before, also where the work is cut off.
struct Before(Option<Look>);

impl Drop for Before {
    fn drop(&mut self) {
        replace(self.0.take());
    }
}

fn replace(look: Option<Look>) -> Option<Look> {
    LEFT.with(|left| left.set(units_for(look.is_some())));
    LOOK.with(|place| place.replace(look))
}

fn units_for(is_looked_at: bool) -> i64 {
    if is_looked_at {
        BETWEEN_LOOKS
    } else {
        i64::MAX
    }
}

fn look(bytes: u64) -> bool {
    // What is looked at may do work itself, so that it is not held meanwhile.
    let look = current();
    LEFT.with(|left| left.set(units_for(look.is_some())));
    look.is_some_and(|look| look(bytes))
}

#[cold]
fn look_and_unwind(bytes: u64) {
    if look(bytes) && !thread::panicking() {
        cut();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    fn counting(seen: &Arc<AtomicU64>, last: u64) -> Look {
        let seen = Arc::clone(seen);
        Arc::new(move |_| seen.fetch_add(1, Ordering::Relaxed) + 1 >= last)
    }

    #[test]
    fn work_is_looked_at_as_often_as_it_is_long() {
        let seen = Arc::new(AtomicU64::new(0));
        let units = BETWEEN_LOOKS as usize / 4;
        let result = within(counting(&seen, u64::MAX), || {
            (0..40).for_each(|_| work(units));
        });
        assert_eq!(result, Ok(()));
        let looks = seen.load(Ordering::Relaxed);
        assert!((8..=10).contains(&looks), "{looks} looks");
    }

    #[test]
    fn endless_work_is_cut_and_what_it_holds_is_dropped() {
        let seen = Arc::new(AtomicU64::new(0));
        let held = Arc::new(());
        let result = within(counting(&seen, 3), || {
            let _held = Arc::clone(&held);
            loop {
                work(1000);
            }
        });
        assert_eq!(result, Err::<(), Cut>(Cut));
        assert_eq!(Arc::strong_count(&held), 1);
        // Nobody looks any more.
        work(usize::MAX);
        assert_eq!(seen.load(Ordering::Relaxed), 3);
    }

    #[test]
    fn an_allocation_is_asked_for_before_it_is_made() {
        let look: Look = Arc::new(|bytes| bytes > 1000);
        let result = within(look, || {
            ask_for(1000);
            ask_for(1001);
        });
        assert_eq!(result, Err(Cut));
    }

    #[test]
    fn what_grows_bit_by_bit_is_asked_for() {
        let look: Look = Arc::new(|bytes| bytes > 5 << 20);
        let taken = Cell::new(0);
        let result = within(look, || {
            let mut room = Room::default();
            loop {
                room.take(1000);
                taken.set(taken.get() + 1000);
            }
        });
        assert_eq!(result, Err::<(), Cut>(Cut));
        assert!((5 << 20..7 << 20).contains(&taken.get()), "{taken:?} bytes");
    }

    #[test]
    fn what_is_held_counts_until_it_is_dropped() {
        let look: Look = Arc::new(|bytes| bytes > 1000);
        let result = within(look, || {
            let held = hold(600);
            ask_for(400);
            drop(held);
            ask_for(1000);
            let _held = hold(1);
            ask_for(1000);
        });
        assert_eq!(result, Err(Cut));
        // Unwinding drops it, too.
        assert_eq!(HELD.get(), 0);
    }

    #[test]
    fn what_was_done_before_is_not_cut_with_what_follows() {
        let seen = Arc::new(AtomicU64::new(0));
        let result = within(counting(&seen, 1), || (7, unless_cut(|| ask_for(1))));
        assert_eq!(result, Ok((7, Err(Cut))));
    }

    #[test]
    fn more_things_than_numbers_end_the_work() {
        let told = Arc::new(AtomicU64::new(0));
        let seen = Arc::clone(&told);
        let look: Look = Arc::new(move |bytes| {
            seen.store(bytes, Ordering::Relaxed);
            false
        });
        let numbered = |most| with_numbers(most, || (0..10).map(number).collect::<Vec<_>>());
        assert_eq!(
            within(Arc::clone(&look), || numbered(10)),
            Ok((0..10).collect())
        );
        assert_eq!(within(look, || numbered(9)), Err(Cut));
        assert_eq!(told.load(Ordering::Relaxed), OUT_OF_NUMBERS);
        assert_eq!(
            unless_cut(|| number(u32::MAX as usize - 1)),
            Ok(u32::MAX - 1)
        );
        assert_eq!(unless_cut(|| number(u32::MAX as usize)), Err(Cut));
        assert_eq!(unless_cut(|| number_below(8, 8)), Err(Cut));
    }

    #[test]
    fn a_panic_of_another_kind_passes() {
        let look: Look = Arc::new(|_| true);
        let caught = panic::catch_unwind(AssertUnwindSafe(|| {
            within(look, || panic::resume_unwind(Box::new(7)))
        }));
        let cause = caught.map(|_: Result<(), Cut>| ()).unwrap_err();
        assert_eq!(cause.downcast_ref(), Some(&7));
        assert!(current().is_none());
    }

    #[test]
    fn a_thread_is_cut_by_what_is_handed_to_it() {
        let seen = Arc::new(AtomicU64::new(0));
        let result = within(counting(&seen, 2), || {
            let handed = current();
            thread::scope(|scope| {
                let endless = || {
                    looking_at(handed, || {
                        loop {
                            work(1000);
                        }
                    });
                };
                match scope.spawn(endless).join() {
                    Ok(()) => {}
                    Err(cause) => panic::resume_unwind(cause),
                }
            });
        });
        assert_eq!(result, Err(Cut));
    }
}

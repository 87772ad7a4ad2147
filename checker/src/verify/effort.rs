//! The effort that a check may take before it gives up.

use crate::cancellation;

/// Regions between two questions whether somebody wants the check to end.
const BETWEEN_QUESTIONS: u64 = 256;

/// A bound on the regions of a check, and what may end it before, beside what ends all work of the
/// thread.
pub struct Effort<'a> {
    most: u64,
    ends: Option<&'a mut dyn FnMut() -> bool>,
    next_question: u64,
}

/// Why a check gave up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenUp {
    /// There are more regions than allowed.
    TooLarge,
    /// Somebody wanted it to end.
    Ended,
}

impl<'a> Effort<'a> {
    /// So many regions at most.
    pub fn up_to(most: u64) -> Effort<'a> {
        Effort {
            most,
            ends: None,
            next_question: 0,
        }
    }

    /// As long as this is not true when it is asked, too.
    #[must_use]
    pub fn unless(self, ends: &'a mut dyn FnMut() -> bool) -> Effort<'a> {
        Effort {
            ends: Some(ends),
            ..self
        }
    }

    /// Counts regions from 0 again.
    pub(super) fn restart_count(&mut self) {
        self.next_question = 0;
    }

    /// Whether one more region would be too much, after this number of them.
    pub(super) fn is_over(&mut self, regions: u64) -> Option<GivenUp> {
        if regions >= self.most {
            return Some(GivenUp::TooLarge);
        }
        if regions < self.next_question {
            return None;
        }
        self.next_question = regions + BETWEEN_QUESTIONS;
        let is_ended = self.ends.as_mut().is_some_and(|ends| ends()) || cancellation::is_due();
        is_ended.then_some(GivenUp::Ended)
    }
}

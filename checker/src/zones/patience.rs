//! Patience with operations on large federations, which can take very long.
//!
//! They ask now and then whether to go on. Once the answer was no, all that is asked with the same
//! patience ends soon, and what it returns is of no use.

/// A question whether to go on, with how many zones are at hand.
type Question<'q> = dyn FnMut(usize) -> bool + 'q;

/// Below so many zones an operation takes no time that matters.
const FEW: usize = 32;

/// So many zones are gone through between two questions where each takes little time.
const MANY: usize = 1 << 13;

/// How long operations may take.
pub struct Patience<'q> {
    goes_on: Option<&'q mut Question<'q>>,
    is_over: bool,
    /// Zones that are kept, beside those at hand.
    kept: usize,
    /// Zones that were gone through since the last question.
    gone_through: usize,
}

impl<'q> Patience<'q> {
    /// Without end.
    pub fn endless() -> Patience<'q> {
        Patience {
            goes_on: None,
            is_over: false,
            kept: 0,
            gone_through: 0,
        }
    }

    /// As long as the answer is yes. It gets how many zones are at hand.
    pub fn as_long_as(goes_on: &'q mut Question<'q>) -> Patience<'q> {
        Patience {
            goes_on: Some(goes_on),
            is_over: false,
            kept: 0,
            gone_through: 0,
        }
    }

    /// Whether it has come to an end, so that what was computed meanwhile is of no use.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Counts zones, or what takes as many bytes, that are kept from now on.
    pub fn keep(&mut self, zones: usize) {
        self.kept += zones;
    }

    /// Asks between operations; returns whether it is over.
    pub fn ends(&mut self) -> bool {
        if !self.is_over
            && let Some(goes_on) = &mut self.goes_on
        {
            self.is_over = !goes_on(self.kept);
        }
        self.is_over
    }

    /// Asks, if the zones at hand are not few; returns whether it is over.
    pub(super) fn ends_with(&mut self, zones: usize) -> bool {
        if !self.is_over
            && zones >= FEW
            && let Some(goes_on) = &mut self.goes_on
        {
            self.is_over = !goes_on(zones + self.kept);
        }
        self.is_over
    }

    /// Notes that so many zones at hand are gone through, and asks if these have become many;
    /// returns whether it is over.
    pub(super) fn ends_through(&mut self, zones: usize) -> bool {
        self.gone_through += zones;
        if self.gone_through < MANY {
            return self.is_over;
        }
        self.gone_through = 0;
        self.ends_with(zones)
    }
}

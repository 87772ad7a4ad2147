//! Where the result of integer arithmetic did not fit into 32 bits, and wrapped round.
//!
//! Only the first such place in the order of sites is kept, which depends neither on the
//! engine nor on the order in which several threads run.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::ir::SiteId;

/// Keeps where results wrapped.
#[derive(Debug)]
pub struct Wraps(AtomicU32);

impl Default for Wraps {
    fn default() -> Wraps {
        Wraps(AtomicU32::new(Wraps::NOWHERE))
    }
}

impl Wraps {
    /// The number of no site.
    pub const NOWHERE: u32 = u32::MAX;

    /// Forgets all places.
    pub fn clear(&self) {
        self.0.store(Wraps::NOWHERE, Ordering::Relaxed);
    }

    /// Notes that a result wrapped here.
    pub fn note(&self, SiteId(site): SiteId) {
        // Most results that wrap do so at a place that is known: this spares other threads the
        // writing.
        if site < self.0.load(Ordering::Relaxed) {
            self.0.fetch_min(site, Ordering::Relaxed);
        }
    }

    /// The first place that was noted.
    pub fn first(&self) -> Option<SiteId> {
        let first = self.0.load(Ordering::Relaxed);
        (first != Wraps::NOWHERE).then_some(SiteId(first))
    }
}

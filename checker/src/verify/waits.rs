//! Where waits in zones lead to.

use super::zone::{Comparison, Zone};

/// The last moments of a wait in a zone: no moment that follows belongs to it.
pub(super) fn last_moments(zone: &Zone) -> Vec<Zone> {
    zone.without_conjunction(&zone.just_after())
}

/// From where in zones, by zone, waiting in them leads to the seeds.
pub(super) fn reaching(zones: &[Zone], seeds: Vec<Zone>, ends_when_all: bool) -> Vec<Vec<Zone>> {
    let mut reached: Vec<Vec<Zone>> = vec![Vec::new(); zones.len()];
    let mut is_whole = vec![false; zones.len()];
    let mut open = seeds;
    while let Some(seed) = open.pop() {
        if ends_when_all && is_whole.iter().all(|&whole| whole) {
            break;
        }
        let following: Vec<Comparison> = seed.just_after();
        for (index, zone) in zones.iter().enumerate() {
            if is_whole[index] {
                continue;
            }
            let ends = zone.comparisons();
            let last = seed.within(ends.iter().map(|one| one.with_end()));
            let mut new = Vec::new();
            if !last.is_empty() {
                new.push(last.earlier().within(ends.iter().copied()));
            }
            new.push(zone.within(following.iter().copied()));
            for part in new {
                if part.is_empty() || part.is_covered(&reached[index]) {
                    continue;
                }
                is_whole[index] |= zone.is_inside(&part.comparisons());
                reached[index].push(part.clone());
                open.push(part);
            }
        }
    }
    reached
}

//! What a machine of the controller says at its stages ([`super::machine`]), on sets of clock
//! values.
//!
//! At each stage the machine is a strategy like any other: it acts where its action is possible and
//! waits elsewhere. Where something else is seen, the stage changes at once, without a move and
//! without time. So play under observation is play on pairs of a stage and a state of the model.

use super::machine::{Machine, proposes};
use super::moves::Error;
use super::place::{Conjunction, Kind, Place, conjunction, parts_in};
use super::rules::Rules;
use super::symbolic::{Symbolic, within_all, without_all, without_conjunctions};
use super::zone::Zone;

/// The indices of the moves of a place that the machine proposes there.
pub(super) fn proposed(rules: &Rules<'_>, place: &Place<'_>) -> Vec<usize> {
    let network = rules.semantics.network();
    let Some(machine) = &rules.machine else {
        return Vec::new();
    };
    let action = machine.action(place.stage);
    let is_proposed = |index: &usize| {
        let one = &place.moves[*index];
        one.controllable && proposes(network, action, &one.parts, one.channel)
    };
    (0..place.moves.len()).filter(is_proposed).collect()
}

/// What the machine does in the states of a place, and where; nothing where it has no state for
/// what is seen.
pub(super) fn pieces(
    rules: &Rules<'_>,
    machine: &Machine<'_>,
    symbolic: &Symbolic<'_>,
    place: &Place<'_>,
) -> Result<Vec<(Vec<Conjunction>, Kind)>, Error> {
    let hull = place.hull(symbolic.clocks);
    let proposed = proposed(rules, place);
    let mut pieces = Vec::new();
    let mut add = |zones: &[Zone], kind: Kind| {
        if !zones.is_empty() {
            let zones = zones.iter().map(|zone| conjunction(zone, &hull));
            pieces.push((zones.collect(), kind));
        }
    };
    for (seen, zones) in looks(machine, symbolic, &place.words, &hull)? {
        match machine.after(place.stage, &seen) {
            Some(stage) if stage == place.stage => {
                let (mut acting, mut waiting) = (Vec::new(), zones.clone());
                for &index in &proposed {
                    let enabled = &place.moves[index].enabled;
                    acting.extend(zones.iter().flat_map(|zone| parts_in(zone, enabled)));
                    waiting = without_conjunctions(waiting, enabled);
                }
                add(&acting, Kind::Proposes);
                add(&waiting, Kind::Waits);
            }
            Some(next) => add(&zones, Kind::Turns(next)),
            None => {}
        }
    }
    Ok(pieces)
}

/// What is seen, and where.
type Look = (Vec<bool>, Vec<Zone>);

/// The parts of a zone by what is seen in them.
fn looks(
    machine: &Machine<'_>,
    symbolic: &Symbolic<'_>,
    words: &[i32],
    zone: &Zone,
) -> Result<Vec<Look>, Error> {
    let deadlock = |_: &Zone| Err(Error::Unsupported("the predicate deadlock"));
    let mut parts = vec![(Vec::new(), vec![zone.clone()])];
    for observation in machine.observations() {
        let mut holds = symbolic.part(observation, words, zone, &deadlock)?;
        holds.retain(|part| !part.is_empty());
        let mut finer = Vec::new();
        for (seen, zones) in parts {
            let those = holds.iter();
            let those = those
                .flat_map(|one| within_all(&zones, &one.comparisons()))
                .collect();
            let others = without_all(zones, &holds);
            for (value, zones) in [(true, those), (false, others)] {
                let zones: Vec<Zone> = zones;
                if !zones.is_empty() {
                    let seen = seen.iter().copied().chain([value]);
                    finer.push((seen.collect(), zones));
                }
            }
        }
        parts = finer;
    }
    Ok(parts)
}

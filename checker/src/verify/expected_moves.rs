//! The moves that are to be expected in a piece of a strategy, and where it asks for one that is
//! not possible.

use crate::ir::Network;

use super::moves::{Part, is_same_entry};
use super::place::{Conjunction, Kind, Move, Place, parts_in, without_conjunctions};
use super::rules::{Decision, Owner, Rules};
use super::stages;
use super::symbolic::within_all;
use super::zone::{Comparison, Zone};

/// The moves that are to be expected in a part of the piece with this index and kind, each with
/// where, and where the strategy asks for a move that is not possible.
pub(super) fn courses(
    rules: &Rules<'_>,
    known: &Place<'_>,
    (index, kind): (usize, Kind),
    part: &Zone,
) -> (Vec<(usize, Zone)>, Vec<Zone>) {
    let network = rules.semantics.network();
    let owner = rules.claim.owner;
    let is_own = |one: &Move| one.controllable == (owner == Owner::Controller);
    let mut courses = Vec::new();
    let mut bad = Vec::new();
    let mut rest = vec![part.clone()];
    match kind {
        Kind::Over | Kind::Turns(_) => return (courses, bad),
        Kind::Anything => {
            for (index, one) in known.moves.iter().enumerate() {
                let parts = parts_in(part, &one.enabled).into_iter();
                courses.extend(parts.map(|part| (index, part)));
            }
            return (courses, bad);
        }
        Kind::Acts(decision) => {
            let action = known
                .decisions
                .and_then(|all| all.decisions[decision].action.as_ref());
            let action: &[Part] = action.map_or(&[], Vec::as_slice);
            let mut impossible = vec![part.clone()];
            for (index, one) in known.moves.iter().enumerate() {
                let is_meant = match owner {
                    Owner::Controller => is_same_entry(network, action, &one.parts),
                    Owner::Environment => *action == *one.parts,
                };
                if is_own(one) && is_meant {
                    impossible = without_conjunctions(impossible, &one.enabled);
                    let parts = parts_in(part, &one.enabled).into_iter();
                    courses.extend(parts.map(|part| (index, part)));
                }
            }
            bad.extend(impossible);
            if owner == Owner::Environment {
                // Where the environment acts, it is first.
                rest.clear();
            } else if rules.claim.is_permissive {
                // The moves of the environment are met by each piece; once is enough.
                let before = known.pieces[..index].iter();
                for one in before.filter(|one| one.kind != Kind::Over) {
                    rest = without_conjunctions(rest, &one.zones);
                }
            }
        }
        Kind::Waits if rules.claim.is_permissive && owner == Owner::Environment => {
            let acting = known.pieces.iter();
            let acting = acting.filter(|one| matches!(one.kind, Kind::Acts(_)));
            for one in acting {
                rest = without_conjunctions(rest, &one.zones);
            }
        }
        Kind::Proposes => {
            for index in stages::proposed(rules, known) {
                let parts = parts_in(part, &known.moves[index].enabled).into_iter();
                courses.extend(parts.map(|part| (index, part)));
            }
        }
        Kind::Waits => {}
    }
    let legs = known.decisions.map_or(&[][..], |decisions| &decisions.legs);
    for (index, one) in known
        .moves
        .iter()
        .enumerate()
        .filter(|(_, one)| !is_own(one))
    {
        for part in &rest {
            for part in parts_in(part, &one.enabled) {
                if owner == Owner::Controller || legs.is_empty() {
                    courses.push((index, part));
                    continue;
                }
                let (taken, missing) = picked(network, (known, legs), one, part);
                courses.extend(taken.into_iter().map(|part| (index, part)));
                bad.extend(missing);
            }
        }
    }
    (courses, bad)
}

/// Where a move of the controller may be met, whose legs the environment picks, and where it picks
/// one that is not possible.
fn picked(
    network: &Network,
    (known, legs): (&Place<'_>, &[Decision]),
    one: &Move,
    part: Zone,
) -> (Vec<Zone>, Vec<Zone>) {
    let mut left = vec![part];
    let (mut taken, mut missing) = (Vec::new(), Vec::new());
    for leg in legs {
        let Some(action) = leg
            .action
            .as_ref()
            .filter(|leg| is_same_entry(network, leg, &one.parts))
        else {
            continue;
        };
        for zone in &leg.zones {
            let zone: Conjunction = zone.iter().map(Comparison::from).collect();
            let here = within_all(&left, &zone);
            left = without_conjunctions(left, std::slice::from_ref(&zone));
            if **action == *one.parts {
                taken.extend(here);
                continue;
            }
            let same = known.moves.iter();
            let same = same.filter(|one| one.controllable && *one.parts == **action);
            missing.extend(same.fold(here, |here, one| without_conjunctions(here, &one.enabled)));
        }
    }
    taken.extend(left);
    (taken, missing)
}

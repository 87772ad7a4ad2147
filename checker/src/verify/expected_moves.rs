//! The moves that are to be expected in a piece of a strategy, and where it asks for one that is
//! not possible.

use crate::ir::Network;

use super::moves::{Part, is_same_entry};
use super::place::{Conjunction, Kind, Move, Piece, Place, parts_in};
use super::rules::{Decision, Owner, Rules};
use super::stages;
use super::symbolic::{within_all, without_conjunctions};
use super::zone::{Comparison, Zone};

/// The moves that are to be expected in a part of the piece with this index and kind, each with
/// where, and where the strategy asks for a move that is not possible.
pub(super) fn expected_moves(
    rules: &Rules<'_>,
    known: &Place<'_>,
    index: usize,
    kind: Kind,
    part: &Zone,
) -> (Vec<(usize, Zone)>, Vec<Zone>) {
    let network = rules.semantics.network();
    let owner = rules.claim.owner;
    let is_own = |one: &Move| rules.claim.owns(one.controllable);
    let all = 0..known.moves.len();
    let own: Vec<usize> = match kind {
        Kind::Over | Kind::Turns(_) => return (Vec::new(), Vec::new()),
        Kind::Anything => return (possible(known, all, part), Vec::new()),
        Kind::Acts(decision) => {
            let decisions = known.decisions.map(|all| &all.decisions[decision]);
            let action = decisions.and_then(|one| one.action.as_ref());
            let action: &[Part] = action.map_or(&[], Vec::as_slice);
            let own = |&index: &usize| {
                let one = &known.moves[index];
                is_own(one) && rules.is_meant(action, &one.parts)
            };
            all.clone().filter(own).collect()
        }
        Kind::Proposes => stages::proposed(rules, known),
        Kind::Waits => Vec::new(),
    };
    let mut bad = Vec::new();
    if matches!(kind, Kind::Acts(_)) {
        bad = own.iter().fold(vec![part.clone()], |left, &index| {
            without_conjunctions(left, &known.moves[index].enabled)
        });
    }
    let mut expected = possible(known, own, part);
    let rest = left_to_opponent(rules, known, index, kind, part);
    let legs = known.decisions.map_or(&[][..], |decisions| &decisions.legs);
    for index in all.filter(|&index| !is_own(&known.moves[index])) {
        let one = &known.moves[index];
        for part in rest.iter().flat_map(|part| parts_in(part, &one.enabled)) {
            if owner == Owner::Controller || legs.is_empty() {
                expected.push((index, part));
                continue;
            }
            let (taken, missing) = picked(network, known, legs, one, part);
            expected.extend(taken.into_iter().map(|part| (index, part)));
            bad.extend(missing);
        }
    }
    (expected, bad)
}

/// Some moves, each with the parts of a part where it is possible.
fn possible(
    known: &Place<'_>,
    moves: impl IntoIterator<Item = usize>,
    part: &Zone,
) -> Vec<(usize, Zone)> {
    let parts = |index: usize| parts_in(part, &known.moves[index].enabled).into_iter();
    let moves = moves.into_iter();
    moves
        .flat_map(|index| parts(index).map(move |part| (index, part)))
        .collect()
}

/// Where in a part the moves of the opponent are to be expected.
fn left_to_opponent(
    rules: &Rules<'_>,
    known: &Place<'_>,
    index: usize,
    kind: Kind,
    part: &Zone,
) -> Vec<Zone> {
    let rest = vec![part.clone()];
    let is_permissive = rules.claim.is_permissive;
    let without = |rest, one: &Piece| without_conjunctions(rest, &one.zones);
    match (kind, rules.claim.owner) {
        // Where the environment acts, it is first.
        (Kind::Acts(_), Owner::Environment) => Vec::new(),
        // Each piece meets the moves of the environment; once is enough.
        (Kind::Acts(_), Owner::Controller) if is_permissive => {
            let before = known.pieces[..index].iter();
            let before = before.filter(|one| one.kind != Kind::Over);
            before.fold(rest, without)
        }
        (Kind::Waits, Owner::Environment) if is_permissive => {
            let acting = known.pieces.iter();
            let acting = acting.filter(|one| matches!(one.kind, Kind::Acts(_)));
            acting.fold(rest, without)
        }
        _ => rest,
    }
}

/// Where a move of the controller may be met, whose legs the environment picks, and where it picks
/// one that is not possible.
fn picked(
    network: &Network,
    known: &Place<'_>,
    legs: &[Decision],
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

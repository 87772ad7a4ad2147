//! From which states the owner of a strategy wins, by fixpoints over sets of clock values.
//!
//! For the words of each state that play may come to, the pieces of the strategy ([`super::place`])
//! are kept together with the *rest* of each: what is not known to be won. A piece is judged by its
//! successors: a state of it is won if every move that is to be expected leads to what is won, and,
//! where the strategy waits, time leads there too. The rest shrinks from everything where play has
//! to end, which is a least fixpoint, and grows from nothing where it may go on for ever, which is
//! a greatest one. If a goal is to recur, one is inside the other: what comes after a goal is
//! judged by the *outer* rest, which is that of the round before.
//!
//! This is the definition of [`super::strategy`] computed backwards. Sets of states that a region
//! does not tell apart stay so, whatever the constants are: all is computed by exact operations on
//! finite unions of zones, nothing is rounded, and comparisons of two clocks need no special care.
//! As nothing is said of how states are reached, states that play does not come to are judged too;
//! only the verdict on where play begins counts.
//!
//! Time is continuous here. While the owner waits in a zone N, time passes from v to v + d if all
//! of `v + [0, d)` lie in N. Where a wait leaves N without a last moment, what counts are the
//! states that short enough waits lead to ([`Moment`]). A set S is reached from N by waiting from
//! `N ∩ past(S ∩ N')`, where N' is N with the ends of its upper bounds.
//!
//! Cost: for a right strategy whose ranks are right, each piece is judged once: for each of its
//! zones and each move, one inclusion of a zone in the zones of the words after the move. For
//! others, as often as the rest of its successors changes.
//!
//! Source: for least and greatest fixpoints on zones, O. Maler, A. Pnueli, J. Sifakis, "On the
//! synthesis of discrete controllers for timed systems", STACS 1995; here all choices of the owner
//! are made.

use std::collections::HashMap;

use crate::cancellation::Room;
use crate::exec::EmittedAssignment;

use super::effort::{Effort, GivenUp};
use super::expected_moves::expected_moves;
use super::machine::Machine;
use super::moves::Error;
use super::outcome::Coverage;
use super::place::{Conjunction, Kind, Move, Piece, Place, Rest, Target, conjunction, parts_in};
use super::rules::{Aim, Owner, Rules};
use super::stages;
use super::symbolic::{Symbolic, without_all, without_conjunctions, without_covered};
use super::view::{Moment, Round, View};
use super::waits::{last_moments, reaching};
use super::zone::{Comparison, Zone};

/// The states that are won, by words.
pub(super) struct Winning<'r, 'a> {
    symbolic: Symbolic<'a>,
    rules: &'r Rules<'a>,
    /// Whether all states count that the model may come to.
    is_everything: bool,
    places: Vec<Place<'a>>,
    /// By stage: the places by their words.
    index: Vec<HashMap<Box<[i32]>, u32>>,
    /// By place: from which places a move may lead to it.
    sources: Vec<Vec<u32>>,
    coverage: Coverage,
    /// Zones that were judged.
    judged: u64,
    room: Room,
}

impl<'r, 'a> Winning<'r, 'a> {
    /// The places that play from these words may come to, with nothing judged; that the whole model
    /// may come to, if `is_everything`.
    pub(super) fn new(
        rules: &'r Rules<'a>,
        words: &[i32],
        is_everything: bool,
        effort: &mut Effort<'_>,
    ) -> Result<Result<Winning<'r, 'a>, (GivenUp, Coverage)>, Error> {
        let mut winning = Winning {
            symbolic: Symbolic::new(rules.semantics.network()),
            rules,
            is_everything,
            places: Vec::new(),
            index: vec![HashMap::new(); rules.machine.as_ref().map_or(1, Machine::stages)],
            sources: Vec::new(),
            coverage: Coverage::default(),
            judged: 0,
            room: Room::default(),
        };
        winning.place_of(0, words.into());
        let mut next = 0;
        while next < winning.places.len() {
            if let Some(why) = effort.is_over(winning.coverage.parts) {
                return Ok(Err((why, winning.coverage)));
            }
            winning.look_at(next)?;
            next += 1;
        }
        if let Some(why) = effort.is_over(winning.coverage.parts) {
            return Ok(Err((why, winning.coverage)));
        }
        Ok(Ok(winning))
    }

    pub(super) fn coverage(&self) -> Coverage {
        self.coverage
    }

    fn place_of(&mut self, stage: u32, words: Box<[i32]>) -> u32 {
        let index = &mut self.index[stage as usize];
        if let Some(&place) = index.get(&words) {
            return place;
        }
        let place = self.places.len() as u32;
        index.insert(words.clone(), place);
        let mut unknown = Place::unknown(words);
        unknown.stage = stage;
        self.places.push(unknown);
        self.sources.push(Vec::new());
        place
    }

    fn view<'v>(&self, known: &'v Place<'a>, moment: Moment, round: Round) -> View<'v, 'a> {
        View::new(known, self.rules.claim.is_permissive, moment, round)
    }

    /// Whether what is not judged yet is taken to be won.
    fn starts_won(&self, round: Round) -> bool {
        let claim = self.rules.claim;
        match (claim.aim, claim.owner, round) {
            (Aim::Recur, Owner::Controller, Round::Outer) => true,
            (Aim::Recur, Owner::Environment, Round::Outer) => false,
            _ => !claim.must_end(),
        }
    }

    fn start(&self, round: Round) -> Rest {
        if self.starts_won(round) {
            Rest::Nothing
        } else {
            Rest::Everything
        }
    }

    /// What is said at a place.
    fn described(&self, stage: u32, words: Box<[i32]>) -> Result<Place<'a>, Error> {
        let (rest, outer) = (self.start(Round::Inner), self.start(Round::Outer));
        let goes_on = self.is_everything;
        let mut known = Place::new(&self.symbolic, self.rules, words, goes_on, &rest, &outer)?;
        known.stage = stage;
        if let Some(machine) = &self.rules.machine {
            let pieces = stages::pieces(self.rules, machine, &self.symbolic, &known)?;
            let pieces = pieces.into_iter();
            let pieces = pieces.map(|(zones, kind)| Piece::new(kind, zones, &rest, &outer));
            known.pieces.extend(pieces);
        }
        Ok(known)
    }

    /// Finds what is said at a place, and the places that moves lead to from there.
    fn look_at(&mut self, place: usize) -> Result<(), Error> {
        let stage = self.places[place].stage;
        let words = self.places[place].words.clone();
        let known = self.described(stage, words.clone());
        let mut known = match known {
            Ok(known) => known,
            Err(Error::Unsupported(what)) => return Err(Error::Unsupported(what)),
            // Whether play comes to it is another question.
            Err(_) => {
                let mut failing = Place::unknown(words.clone());
                let (lost, whole) = (&Rest::Everything, vec![Box::default()]);
                failing
                    .pieces
                    .push(Piece::new(Kind::Over, whole, lost, lost));
                failing
            }
        };
        for index in self.count_moves(&known) {
            if let Target::Words(words) = &mut known.moves[index].target {
                let target = self.place_of(stage, std::mem::take(words));
                known.moves[index].target = Target::Place(target);
                self.add_source(target, place);
            }
        }
        for piece in &known.pieces {
            if let Kind::Turns(next) = piece.kind {
                let target = self.place_of(next, words.clone());
                self.add_source(target, place);
            }
        }
        self.room.take(known.bytes());
        self.places[place] = known;
        Ok(())
    }

    /// Counts the pieces of a place and the moves that are to be expected in them; returns these
    /// moves.
    fn count_moves(&mut self, known: &Place<'_>) -> Vec<usize> {
        let hull = known.hull(self.symbolic.clocks);
        let mut all = Vec::new();
        for (number, piece) in known.pieces.iter().enumerate() {
            let kind = if self.is_everything {
                Kind::Anything
            } else {
                piece.kind
            };
            let is_won = piece.kind == Kind::Over && matches!(piece.rest, Rest::Nothing);
            for zone in parts_in(&hull, &piece.zones) {
                self.coverage.parts += 1;
                self.coverage.goals += u64::from(is_won);
                let (expected, _) = expected_moves(self.rules, known, number, kind, &zone);
                for (index, _) in expected {
                    let is_own = self.rules.claim.owns(known.moves[index].controllable);
                    if is_own && matches!(kind, Kind::Acts(_) | Kind::Proposes) {
                        self.coverage.own_moves += 1;
                    } else {
                        self.coverage.opponent_moves += 1;
                    }
                    all.push(index);
                }
            }
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Notes that a place is judged by another one.
    fn add_source(&mut self, target: u32, place: usize) {
        let sources = &mut self.sources[target as usize];
        if sources.last() != Some(&(place as u32)) {
            sources.push(place as u32);
        }
    }

    /// Judges until nothing changes; whether the owner wins from a state.
    pub(super) fn solve(
        &mut self,
        start: (&[i32], &[i64]),
        effort: &mut Effort<'_>,
    ) -> Result<Result<bool, GivenUp>, Error> {
        loop {
            if let Err(why) = self.settle(self.starts_won(Round::Inner), effort)? {
                return Ok(Err(why));
            }
            let wins = self.wins(start.0, start.1);
            if self.rules.claim.aim != Aim::Recur {
                return Ok(Ok(wins));
            }
            // From one state it is enough to know that it is won, or not.
            let is_decided =
                !self.is_everything && wins != (self.rules.claim.owner == Owner::Controller);
            // The outer round comes from the inside of what is won, or from the outside.
            let mut changed = false;
            let (inner, outer) = (self.start(Round::Inner), self.starts_won(Round::Outer));
            for place in &mut self.places {
                let hull = place.hull(self.symbolic.clocks);
                for piece in place.pieces.iter_mut().filter(|one| one.kind != Kind::Over) {
                    changed |= if outer {
                        grows(&hull, &piece.zones, &piece.outer, &piece.rest)
                    } else {
                        grows(&hull, &piece.zones, &piece.rest, &piece.outer)
                    };
                }
            }
            if is_decided || !changed {
                return Ok(Ok(wins));
            }
            for piece in self.places.iter_mut().flat_map(|place| &mut place.pieces) {
                if piece.kind != Kind::Over {
                    piece.outer = std::mem::replace(&mut piece.rest, inner.clone());
                }
            }
        }
    }

    /// Judges all pieces until nothing changes any more, those of small ranks first.
    fn settle(
        &mut self,
        is_growing: bool,
        effort: &mut Effort<'_>,
    ) -> Result<Result<(), GivenUp>, Error> {
        let mut order: Vec<(u32, u32, u32)> = Vec::new();
        for (place, known) in self.places.iter().enumerate() {
            for (piece, one) in known.pieces.iter().enumerate() {
                if one.kind != Kind::Over {
                    order.push((one.rank, place as u32, piece as u32));
                }
            }
        }
        order.sort_unstable();
        let mut is_due = vec![true; self.places.len()];
        loop {
            let mut is_changed = vec![false; self.places.len()];
            for &(_, place, piece) in &order {
                let (at, index) = (place as usize, piece as usize);
                let is_settled =
                    !is_growing && matches!(self.places[at].pieces[index].rest, Rest::Nothing);
                if is_settled || !(is_due[at] || is_changed[at]) {
                    continue;
                }
                if let Some(why) = effort.is_over(self.judged) {
                    return Ok(Err(why));
                }
                let rest = Rest::of(self.judge(at, index));
                let hull = self.places[at].hull(self.symbolic.clocks);
                let known = &mut self.places[at].pieces[index];
                let changes = if is_growing {
                    grows(&hull, &known.zones, &known.rest, &rest)
                } else {
                    grows(&hull, &known.zones, &rest, &known.rest)
                };
                if changes {
                    known.rest = rest;
                    is_changed[at] = true;
                    for &source in &self.sources[at] {
                        is_changed[source as usize] = true;
                    }
                }
            }
            if !is_changed.contains(&true) {
                return Ok(Ok(()));
            }
            is_due = is_changed;
        }
    }

    /// Whether a state, with clock values in ticks, is known to be won; at the first stage.
    pub(super) fn wins(&self, words: &[i32], clocks: &[i64]) -> bool {
        let Some(&place) = self.index[0].get(words) else {
            return false;
        };
        let unit = self.rules.semantics.ticks_per_unit();
        let holds = |one: &[Comparison]| one.iter().all(|one| one.holds(clocks, unit));
        let mut is_met = false;
        for piece in &self.places[place as usize].pieces {
            if !piece.zones.iter().any(|zone| holds(zone)) {
                continue;
            }
            let is_won = match &piece.rest {
                Rest::Nothing => true,
                Rest::Everything => false,
                Rest::Parts(parts) => !parts.iter().any(|part| holds(&part.comparisons())),
            };
            if !is_won || piece.kind == Kind::Over || !self.rules.claim.is_permissive {
                return is_won;
            }
            is_met = true;
        }
        is_met
    }

    /// What of a piece is not won, as far as is known.
    fn judge(&mut self, place: usize, index: usize) -> Vec<Zone> {
        let known = &self.places[place];
        let piece = &known.pieces[index];
        let hull = known.hull(self.symbolic.clocks);
        let zones = parts_in(&hull, &piece.zones);
        self.judged += zones.len() as u64;
        if let Kind::Turns(next) = piece.kind {
            let target = self.index[next as usize][&known.words];
            let view = self.view(&self.places[target as usize], Moment::Now, Round::Inner);
            let refused = zones.into_iter().flat_map(|zone| view.refused(zone));
            return without_covered(self.outside_earlier(known, index, refused.collect()));
        }
        let mut groups: [(Vec<Zone>, Vec<Zone>); 2] = Default::default();
        for zone in zones {
            let goals = if piece.kind == Kind::Anything || known.goal.is_empty() {
                Vec::new()
            } else {
                parts_in(&zone, &known.goal)
            };
            let others = without_all(vec![zone], &goals);
            let parts = others.into_iter().map(|part| (part, 0));
            for (part, group) in parts.chain(goals.into_iter().map(|part| (part, 1))) {
                let round = [Round::Inner, Round::Outer][group];
                let (expected, mut bad) =
                    expected_moves(self.rules, known, index, piece.kind, &part);
                for (one, region) in expected {
                    bad.extend(self.leading_out(&known.moves[one], &region, round));
                }
                groups[group].1.extend(bad);
                groups[group].0.push(part);
            }
        }
        let mut rest = Vec::new();
        for ((parts, bad), round) in groups.into_iter().zip([Round::Inner, Round::Outer]) {
            if matches!(piece.kind, Kind::Waits | Kind::Anything) && !parts.is_empty() {
                rest.extend(self.waiting(place, index, parts, bad, round));
            } else {
                rest.extend(bad);
            }
        }
        // What belongs to a piece before it is judged there.
        without_covered(self.outside_earlier(known, index, without_covered(rest)))
    }

    /// What of zones belongs to no piece that comes first.
    fn outside_earlier(&self, known: &Place<'_>, index: usize, mut zones: Vec<Zone>) -> Vec<Zone> {
        for one in &known.pieces[..index] {
            if zones.is_empty() {
                break;
            }
            if one.kind == Kind::Over || !self.rules.claim.is_permissive {
                zones = without_conjunctions(zones, &one.zones);
            }
        }
        zones
    }

    /// From where in a zone a move leads to what is not won.
    fn leading_out(&self, one: &Move, region: &Zone, round: Round) -> Vec<Zone> {
        let Target::Place(target) = one.target else {
            return Vec::new();
        };
        let target = &self.places[target as usize];
        let entered = region.after(&one.assignments);
        let refused = self.view(target, Moment::Now, round).refused(entered);
        let before = |part: &Zone| before(part, &one.assignments, region);
        without_covered(refused.iter().map(before).collect())
    }

    /// What of the parts of a piece in which the owner waits is not won, beside what is bad by
    /// itself.
    fn waiting(
        &self,
        place: usize,
        index: usize,
        parts: Vec<Zone>,
        bad: Vec<Zone>,
        round: Round,
    ) -> Vec<Zone> {
        let known = &self.places[place];
        let kind = known.pieces[index].kind;
        // What other pieces lose.
        let view = self.view(known, Moment::Now, round);
        let blocked: Vec<Zone> = parts
            .iter()
            .flat_map(|part| view.refused_by_others(index, part.clone()))
            .collect();
        let (mut resting, mut stuck, mut passing) = (Vec::new(), Vec::new(), Vec::new());
        for part in parts {
            if known.is_urgent {
                self.rest(known, kind, part, &mut resting, &mut stuck);
                continue;
            }
            for stopped in parts_in(&part, &known.stops) {
                self.rest(known, kind, stopped, &mut resting, &mut stuck);
            }
            passing.extend(without_conjunctions(vec![part], &known.stops));
        }
        let mut lost = bad;
        lost.extend(stuck);
        if self.has_to_arrive(round) && kind != Kind::Anything {
            let mut hindered = lost.clone();
            hindered.extend(blocked);
            let passing = without_all(passing, &hindered);
            let mut seeds = without_all(resting, &hindered);
            for zone in &passing {
                seeds.extend(self.arrivals(known, zone, round));
            }
            let reached = reaching(&passing, without_covered(seeds), true);
            for (zone, reached) in passing.into_iter().zip(&reached) {
                lost.extend(without_all(vec![zone], reached));
            }
            return lost;
        }
        let exits = |passing: &[Zone]| -> Vec<Zone> {
            let exits = passing.iter();
            exits
                .flat_map(|zone| self.bad_exits(known, zone, round))
                .collect()
        };
        if exits(&passing).is_empty() && lost.is_empty() && blocked.is_empty() {
            return lost;
        }
        // Where a piece before it decides, the wait ends.
        let passing = self.outside_earlier(known, index, passing);
        let mut lost = self.outside_earlier(known, index, lost);
        let mut seeds = exits(&passing);
        seeds.extend(lost.iter().cloned());
        seeds.extend(blocked);
        let seeds = without_covered(seeds);
        lost.extend(reaching(&passing, seeds, false).into_iter().flatten());
        lost
    }

    /// Tells where time is stopped from each other where the owner may wait nevertheless, and where
    /// not.
    fn rest(
        &self,
        known: &Place<'_>,
        kind: Kind,
        stopped: Zone,
        resting: &mut Vec<Zone>,
        stuck: &mut Vec<Zone>,
    ) {
        if kind == Kind::Anything {
            resting.push(stopped);
            return;
        }
        let controller = known.controller_may_rest(self.rules, &stopped);
        let environment = without_all(vec![stopped], &controller);
        let (may, may_not) = match self.rules.claim.owner {
            Owner::Controller => (controller, environment),
            Owner::Environment => (environment, controller),
        };
        resting.extend(may);
        stuck.extend(may_not);
    }

    /// Whether waiting must lead to what is won; else it may go on for ever.
    fn has_to_arrive(&self, round: Round) -> bool {
        let claim = self.rules.claim;
        // At a goal that is to recur it is the other way round.
        claim.must_end() != (claim.aim == Aim::Recur && round == Round::Outer)
    }

    /// Where time leads from a zone to what is won.
    fn arrivals(&self, known: &Place<'_>, zone: &Zone, round: Round) -> Vec<Zone> {
        let around = known.hull(self.symbolic.clocks);
        let around = around.within(zone.comparisons().into_iter().map(Comparison::with_end));
        let mut found = self.view(known, Moment::Now, round).granted(around);
        for last in last_moments(zone) {
            found.extend(self.view(known, Moment::JustAfter, round).granted(last));
        }
        found
    }

    /// Where time leads from a zone to what is not won.
    fn bad_exits(&self, known: &Place<'_>, zone: &Zone, round: Round) -> Vec<Zone> {
        let ended = zone.just_before().within(known.invariant.iter().copied());
        let mut found = Vec::new();
        for left in ended.without(zone) {
            found.extend(self.view(known, Moment::Now, round).refused(left));
        }
        for last in last_moments(zone) {
            found.extend(self.view(known, Moment::JustAfter, round).refused(last));
        }
        found
    }

    /// Whether all states that the model may come to from a state are won. After it, what is won is
    /// forgotten.
    pub(super) fn wins_everywhere(
        &mut self,
        start: (&[i32], &[i64]),
        effort: &mut Effort<'_>,
    ) -> Result<Result<bool, GivenUp>, Error> {
        let won: Vec<Vec<Conjunction>> = self
            .places
            .iter()
            .map(|place| {
                let hull = place.hull(self.symbolic.clocks);
                let won = self
                    .view(place, Moment::Now, Round::Inner)
                    .granted(hull.clone());
                won.iter().map(|zone| conjunction(zone, &hull)).collect()
            })
            .collect();
        for (place, zones) in self.places.iter_mut().zip(won) {
            let won = &Rest::Nothing;
            place.pieces = vec![Piece::new(Kind::Anything, zones, won, won)];
        }
        let settled = self.settle(true, effort)?;
        Ok(settled.map(|()| self.wins(start.0, start.1)))
    }
}

/// The part of a region that assignments lead into a zone.
fn before(zone: &Zone, assignments: &[EmittedAssignment], region: &Zone) -> Zone {
    let comparisons = zone.comparisons().into_iter();
    region.within(comparisons.map(|one| one.before(assignments)))
}

/// Whether the second rest of a piece has something that the first has not.
fn grows(hull: &Zone, zones: &[Conjunction], first: &Rest, second: &Rest) -> bool {
    match (first, second) {
        (_, Rest::Nothing) | (Rest::Everything, _) => false,
        (Rest::Nothing, Rest::Everything | Rest::Parts(_)) => true,
        (Rest::Parts(first), Rest::Everything) => {
            let all = parts_in(hull, zones);
            !all.iter().all(|part| part.is_covered(first))
        }
        (Rest::Parts(first), Rest::Parts(second)) => {
            !second.iter().all(|part| part.is_covered(first))
        }
    }
}

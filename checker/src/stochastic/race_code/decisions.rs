//! Code for runs in which somebody decides for the controller, as `stochastic/race/choosing.rs`
//! says it.
//!
//! When the controller is asked, the code notes the moves that are possible and returns. It is
//! called again with what was decided: [`ASKED_AGAIN`] if the controller waits, or behind that the
//! place of its move among all of them.

use std::cell::Cell;

use super::layout::Decisions;
use super::moves::Ways;
use super::race_writer::{Ids, RaceWriter};
use super::rounds::Round;
use super::writer::Writer;
use crate::ir::{
    BlockId, Function, FunctionId, IntegerOperator, Register, RegisterType, Relation, Sync, Urgency,
};
use crate::stochastic::condition::Condition;
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::program::{Channel, Instance, Program};
use crate::stochastic::readers::Reader;
use crate::stochastic::rules::{self, Backend};

/// How the code goes on: as at the begin of a run, or of so many moves;
pub(super) const AS_AT_BEGIN: i32 = 0;
/// or the controller waits, and may be asked again.
pub(super) const ASKED_AGAIN: i32 = 1;

/// From here on what the code returns says that the controller is asked: 1 more if the environment
/// can move now, and [`PASSES`] more if time can pass without a move of the controller.
pub(super) const ASKS: i32 = 4;
pub(super) const PASSES: i32 = 2;

/// Where the controller can move: by process, and by location unless it is everywhere.
pub(super) fn deciders(program: &Program<'_>) -> Vec<Reader> {
    let mut deciders = Vec::new();
    for process in 0..program.network.processes.len() {
        let spots = program.spots_of(process);
        let places = (0..spots.len()).filter(|&place| spots[place].is_controllable);
        let places: Vec<u32> = places.map(|place| place as u32).collect();
        let process = process as u32;
        if places.len() == spots.len() {
            let location = None;
            deciders.push(Reader { process, location });
            continue;
        }
        deciders.extend(places.into_iter().map(|location| Reader {
            process,
            location: Some(location),
        }));
    }
    deciders
}

/// Whether the code knows all decisions of a network.
pub(super) fn knows_decisions(program: &Program<'_>) -> bool {
    let network = program.network;
    let commits = |process: u32| {
        let mut spots = program.spots_of(process as usize).iter();
        spots.any(|spot| spot.urgency == Urgency::Committed)
    };
    // Where somebody is committed, a sender who is not can move if somebody who is receives.
    let joins_committed = |instance: &Instance<'_>| {
        let channels = instance.edge.sync.map_or(0..0, Sync::channels);
        let mut receivers = channels.flat_map(|channel| program.receivers(channel));
        receivers.any(|&receiver| receiver != instance.process && commits(receiver))
    };
    // A guard that holds only behind a moment has no first one.
    let has_first = |instance: &Instance<'_>| match instance.guard {
        Condition::Compared(place) => {
            let mut bounds = program.comparisons(place).bounds.iter();
            bounds.all(|(_, relation, _)| !matches!(relation, Relation::Greater | Relation::Less))
        }
        _ => true,
    };
    let knows_urgency = |instance: &Instance<'_>| {
        !instance.may_be_urgent || !matches!(instance.channel, Channel::Computed(..))
    };
    let all_spots = || (0..network.processes.len()).flat_map(|one| program.spots_of(one));
    let asks_committed =
        all_spots().any(|spot| spot.is_controllable && spot.urgency == Urgency::Committed);
    all_spots().all(|spot| {
        let outputs = program.range(spot.outputs);
        let mut own = outputs.iter().filter(|one| one.edge.controllable);
        let joins = spot.urgency != Urgency::Committed && outputs.iter().any(joins_committed);
        own.all(|one| has_first(one) && knows_urgency(one))
            && legs_are_neighbours(outputs)
            && !(asks_committed && joins)
    })
}

/// Whether the legs of an entry come one after the other.
fn legs_are_neighbours(outputs: &[Instance<'_>]) -> bool {
    let entries = outputs.chunk_by(|one, next| one.entry == next.entry);
    let mut entries: Vec<u32> = entries.map(|legs| legs[0].entry).collect();
    let count = entries.len();
    entries.sort_unstable();
    entries.dedup();
    entries.len() == count
}

impl<'a> RaceWriter<'_, 'a> {
    /// Lets the controller be asked anew, now that something has happened.
    pub(super) fn renew_decisions(&self, w: &mut Writer<'_>, decisions: &Decisions) {
        w.store_integer(decisions.draws, 0);
        let none = w.real(0.0);
        w.store_double(decisions.hold, none);
        self.mark_readers(w, &self.deciders, None);
    }

    /// Goes on as the words say: from the start, or with what was decided.
    pub(super) fn resume(
        &self,
        w: &mut Writer<'_>,
        round: Round<'_>,
        decisions: &Decisions,
        start: BlockId,
    ) {
        let resume = w.load(decisions.resume);
        w.switch(resume, vec![start, round.missed], round.chosen);
        w.at(round.missed);
        self.mark_readers(w, &self.deciders, None);
        w.jump(round.begin);
    }

    /// Lets the controller make the move that the words say.
    pub(super) fn let_chosen_move(
        w: &mut Writer<'_>,
        ids: &Ids,
        decisions: &Decisions,
        ways: Ways,
    ) {
        let wrong = w.block();
        let place = w.load(decisions.resume);
        let place = w.plus(place, -(ASKED_AGAIN + 1));
        let blocks: Vec<BlockId> = ids.chosen_moves.iter().map(|_| w.block()).collect();
        w.switch(place, blocks.clone(), wrong);
        for (&function, block) in ids.chosen_moves.iter().zip(blocks) {
            w.at(block);
            let result = w.call_for(function, Vec::new());
            // In the order of what the function returns.
            w.switch(result, vec![wrong, ways.moved, ways.put_off], wrong);
        }
        w.at(wrong);
        w.give_up();
    }

    /// Returns to ask the controller, now that the delay of a process is over.
    pub(super) fn ask(
        w: &mut Writer<'_>,
        possible_moves: FunctionId,
        decisions: &Decisions,
        process: usize,
    ) {
        w.store_integer(decisions.winner, process as i32);
        let may = w.call_for(possible_moves, Vec::new());
        let asks = w.plus(may, ASKS);
        w.return_value(Some(asks));
    }

    /// The function that carries out a move of the controller.
    pub(super) fn chosen_move(&self, entry: u32, ids: &Ids) -> Function {
        let name = format!("move {entry} of the controller");
        let mut writer = self.writer(&name, 0, Some(RegisterType::Integer));
        let w = &mut writer;
        let first = self.program.instance(entry);
        let spot = self.program.spot(first.process as usize, first.edge.source);
        let outputs = self.program.range(spot.outputs).iter();
        let legs: Vec<_> = outputs.filter(|one| one.entry == entry).collect();
        let wrong = w.block();
        let chosen = self.choose(w, legs.iter().copied(), wrong);
        let Ok(()) = w.cases(chosen, legs.len(), |w, number| {
            self.carry_out(w, legs[number], ids);
            Ok(())
        });
        w.at(wrong);
        w.give_up();
        writer.finish()
    }

    /// The function that notes which moves of the controller are possible, and returns whether
    /// the environment can move and whether time can pass.
    pub(super) fn possible_moves(&self, decisions: &Decisions) -> Function {
        let name = "possible moves of the controller";
        let mut writer = self.writer(name, 0, Some(RegisterType::Integer));
        let w = &mut writer;
        w.store_integer(decisions.move_count, 0);
        w.store_integer(decisions.urgent, 0);
        let committed = w.load(self.layout.committed);
        let is_committed = w.compare_to(committed, Relation::Greater, 0);
        let (others, stops) = (w.variable(0), w.variable(0));
        w.set(&stops, is_committed);
        for process in 0..self.network().processes.len() {
            let is_ready = self.is_ready(w, decisions, process, is_committed, &stops);
            let spots = self.program.spots_of(process);
            if spots.iter().all(|spot| spot.outputs.is_empty()) {
                continue;
            }
            let location = w.load(process as u32);
            let Ok(()) = w.cases(location, spots.len(), |w, location| {
                let spot = &spots[location];
                let outputs = self.program.range(spot.outputs);
                w.attempt(|w, out| {
                    if spot.urgency == Urgency::Normal && !spot.is_controllable {
                        w.unless(is_ready, out);
                    }
                    if spot.urgency != Urgency::Committed {
                        let is_free = w.compare_to(is_committed, Relation::Equal, 0);
                        w.unless(is_free, out);
                    }
                    let is_ready = match spot.urgency {
                        Urgency::Normal => is_ready,
                        _ => w.integer(1),
                    };
                    for legs in outputs.chunk_by(|one, next| one.entry == next.entry) {
                        let is_enabled = rules::is_any_enabled(w, self.program, legs)?;
                        if legs[0].edge.controllable {
                            self.note_move(w, decisions, &legs[0], is_enabled);
                        } else {
                            let counts = w.arithmetic(IntegerOperator::And, is_enabled, is_ready);
                            let any = w.arithmetic(IntegerOperator::Or, others.get(), counts);
                            w.set(&others, any);
                        }
                    }
                    Ok(())
                })
            });
        }
        let urgent = w.load(decisions.urgent);
        let stops = w.arithmetic(IntegerOperator::Or, stops.get(), urgent);
        let passes = w.compare_to(stops, Relation::Equal, 0);
        let passes = w.sum(passes, passes);
        let may = w.sum(others.get(), passes);
        w.return_value(Some(may));
        writer.finish()
    }

    /// Whether the delay of a process is over. Notes whether it may stay no longer.
    fn is_ready(
        &self,
        w: &mut Writer<'_>,
        decisions: &Decisions,
        process: usize,
        is_committed: Register,
        stops: &Cell<Register>,
    ) -> Register {
        let winner = w.load(decisions.winner);
        let is_winner = w.compare_to(winner, Relation::Equal, process as i32);
        let mut is_ready = w.arithmetic(IntegerOperator::Or, is_winner, is_committed);
        if let Some(word) = self.layout.attempts[process] {
            let attempt = w.load_real(word);
            let is_over = w.compare_real_to(attempt, Relation::LessEqual, TOLERANCE);
            is_ready = w.arithmetic(IntegerOperator::Or, is_ready, is_over);
        }
        if let Some(word) = self.layout.stays[process] {
            let stay = w.load_real(word);
            let is_over = w.compare_real_to(stay, Relation::LessEqual, TOLERANCE);
            is_ready = w.arithmetic(IntegerOperator::Or, is_ready, is_over);
            let stop = w.arithmetic(IntegerOperator::Or, stops.get(), is_over);
            w.set(stops, stop);
        }
        is_ready
    }

    /// Notes a move of the controller, if it is possible.
    fn note_move(
        &self,
        w: &mut Writer<'_>,
        decisions: &Decisions,
        first: &Instance<'a>,
        is_enabled: Register,
    ) {
        let place = decisions.entries.binary_search(&first.entry);
        let place = place.expect("the move is one of the controller's") as i32;
        let channels = &self.network().channels;
        let is_urgent = match first.channel {
            Channel::Known(channel) => channels[channel as usize].urgent,
            Channel::None | Channel::Computed(..) => false,
        };
        w.when(is_enabled, |w| {
            let count = w.load(decisions.move_count);
            let place = w.integer(place);
            w.store_at(
                decisions.moves,
                count,
                decisions.entries.len() as u32,
                place,
            );
            let count = w.plus(count, 1);
            w.store(decisions.move_count, count);
            if is_urgent {
                w.store_integer(decisions.urgent, 1);
            }
        });
    }
}

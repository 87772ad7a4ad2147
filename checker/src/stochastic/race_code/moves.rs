//! Code for what a move does, as `stochastic/race/transition.rs` says it.

use std::collections::BTreeSet;
use std::ops::Range;

use super::race_writer::{Ids, RaceWriter};
use super::writer::Writer;
use crate::ir::{
    BlockId, Function, FunctionId, IntegerOperator, LocationId, ProcessId, Register, RegisterType,
    Relation, Update, Urgency,
};
use crate::stochastic::condition::Condition;
use crate::stochastic::program::{Channel, Instance};
use crate::stochastic::readers::Reader;
use crate::stochastic::rules::{self, Backend, Candidate};

/// More channels are not told apart.
const MOST_CHANNELS: usize = 32;

/// What the function of a move returns if no output of the process is enabled after all.
pub(super) const MISSED: i32 = 0;
/// What it returns if the process has moved, and nobody is in a committed location;
pub(super) const MOVED: i32 = 1;
/// or somebody is, so that those who have moved do not plan yet.
pub(super) const PUT_OFF: i32 = 2;

/// A process that may receive what is sent.
struct Receiver<'p, 'a> {
    process: u32,
    /// By location: its inputs that may be on the channel.
    inputs: Vec<(i32, Vec<&'p Instance<'a>>)>,
    /// Which of all its inputs it takes, counted from 1; 0 if none.
    chosen: Register,
    /// Which branch of it.
    branch: Register,
}

impl<'p, 'a> Receiver<'p, 'a> {
    fn all_inputs(&self) -> impl Iterator<Item = &'p Instance<'a>> {
        self.inputs
            .iter()
            .flat_map(|(_, inputs)| inputs.iter().copied())
    }
}

impl<'a> RaceWriter<'_, 'a> {
    /// The function that lets a process move from a location.
    pub(super) fn movement(&self, process: usize, location: usize, ids: &Ids) -> Function {
        let result = (0, Some(RegisterType::Integer));
        let name = format!("move of process {process} from location {location}");
        let mut writer = self.writer(&name, result);
        let w = &mut writer;
        let spot = &self.program.spots_of(process)[location];
        let outputs = self.program.range(spot.outputs);
        let missed = w.block();
        if let [only] = outputs
            && only.edge.leg.is_none()
        {
            if !spot.is_plain {
                let Ok(()) = rules::require(w, self.program, only.guard, &only.values, missed);
            }
            self.carry_out(w, only, ids);
        } else {
            let chosen = self.choose(w, outputs, missed);
            let takes: Vec<(i32, BlockId)> = (0..)
                .zip(outputs)
                .map(|(number, _)| (number, w.block()))
                .collect();
            w.select(chosen, &takes);
            for (output, &(_, block)) in outputs.iter().zip(&takes) {
                w.at(block);
                self.carry_out(w, output, ids);
            }
        }
        w.at(missed);
        let (word, bit) = self.layout.stale_bit(process);
        mark(w, word, bit);
        let result = w.integer(MISSED);
        w.return_value(Some(result));
        writer.finish()
    }

    /// Chooses one of the instances that are enabled, and returns its number; goes elsewhere if
    /// there are none.
    fn choose(
        &self,
        w: &mut Writer<'_>,
        instances: &[Instance<'a>],
        otherwise: BlockId,
    ) -> Register {
        let candidates = (0..).zip(instances).map(|(number, instance)| {
            let flag = (instance.guard != Condition::Always).then(|| {
                let flag = w.integer(0);
                self.when_enabled(w, instance, |w| {
                    let one = w.integer(1);
                    w.copy(flag, one);
                });
                flag
            });
            Candidate {
                instance,
                number,
                flag,
            }
        });
        let candidates: Vec<_> = candidates.collect();
        let Ok(chosen) = rules::one_of(w, self.program, &candidates, otherwise);
        chosen
    }

    /// Writes what is done only if the guard of an instance holds.
    fn when_enabled(
        &self,
        w: &mut Writer<'_>,
        instance: &Instance<'a>,
        write: impl FnOnce(&mut Writer<'_>),
    ) {
        let next = w.block();
        let Ok(()) = rules::require(w, self.program, instance.guard, &instance.values, next);
        write(w);
        w.jump(next);
        w.at(next);
    }

    /// Lets a process take an output with all who receive, and returns.
    fn carry_out(&self, w: &mut Writer<'_>, sender: &Instance<'a>, ids: &Ids) {
        let channels = match sender.channel {
            Channel::None => None,
            Channel::Known(channel) => Some((w.integer(channel as i32), channel..channel + 1)),
            Channel::Computed(first, index) => {
                let count = sender.edge.sync.map_or(1, |sync| sync.count);
                Some((
                    computed_channel(w, sender, (first, index)),
                    first..first + count,
                ))
            }
        };
        match channels {
            Some((channel, channels)) if self.is_worth_telling_apart(&channels) => {
                let places: Vec<(i32, BlockId)> = channels
                    .map(|channel| (channel as i32, w.block()))
                    .collect();
                w.select(channel, &places);
                for &(channel, block) in &places {
                    w.at(block);
                    let known = w.integer(channel);
                    let channel = channel as u32;
                    self.carry_out_on(w, sender, Some((known, channel..channel + 1)), ids);
                }
            }
            channels => self.carry_out_on(w, sender, channels, ids),
        }
    }

    /// Whether few processes receive on each of some channels, and many on all of them.
    fn is_worth_telling_apart(&self, channels: &Range<u32>) -> bool {
        let of_channel = |channel| self.program.receivers(channel).len();
        let most = channels.clone().map(of_channel).max().unwrap_or(0);
        let all: usize = channels.clone().map(of_channel).sum();
        (2..=MOST_CHANNELS).contains(&channels.len()) && 2 * most < all
    }

    /// Lets a process take an output on one of these channels; the register says which.
    fn carry_out_on(
        &self,
        w: &mut Writer<'_>,
        sender: &Instance<'a>,
        channels: Option<(Register, Range<u32>)>,
        ids: &Ids,
    ) {
        let mut receivers = Vec::new();
        if let Some((channel, channels)) = channels {
            for process in self.program.partners(sender) {
                if let Some(receiver) = self.receiver(w, process, (channel, &channels)) {
                    receivers.push(receiver);
                }
            }
        }
        let Ok(branch) = rules::branch(w, self.program, sender);
        for receiver in &receivers {
            self.branch_of_receiver(w, receiver);
        }
        self.apply(w, sender, branch);
        for receiver in &receivers {
            let done = w.block();
            Self::for_chosen(w, receiver, done, |w, input| {
                self.apply(w, input, receiver.branch);
            });
        }
        if let Some(renewal) = self.renewal_of_rates {
            w.call(renewal, &[]);
        }
        if self.may_commit(sender, &receivers) {
            let committed = w.load(self.layout.committed);
            let (put_off, now) = (w.block(), w.block());
            w.branch(committed, put_off, now);
            w.at(put_off);
            self.put_plans_off(w, (sender, branch), &receivers, ids);
            w.at(now);
        }
        self.plan_movers(w, (sender, branch), &receivers, ids);
        let result = w.integer(MOVED);
        w.return_value(Some(result));
    }

    /// Whether a process may be in a location that is committed when the movers have moved.
    fn may_commit(&self, sender: &Instance<'a>, receivers: &[Receiver<'_, 'a>]) -> bool {
        let inputs = receivers.iter().flat_map(Receiver::all_inputs);
        let mut entered = inputs.chain([sender]).flat_map(|mover| {
            let branches = mover.edge.branches.iter();
            branches.map(|branch| (mover.process, branch.target))
        });
        // If the sender is not in such a location, nobody is: it could not move.
        let mut others = self.committing.iter();
        entered.any(|(process, target)| self.is_committed(process, target))
            || self.leaves_committed(sender)
                && others.any(|&process| process != sender.process as usize)
    }

    fn is_committed(&self, process: u32, location: LocationId) -> bool {
        self.program.spot(process as usize, location).urgency == Urgency::Committed
    }

    fn leaves_committed(&self, sender: &Instance<'a>) -> bool {
        self.is_committed(sender.process, sender.edge.source)
    }

    /// Who may be marked when the movers have moved: by them, or before if plans were put off.
    fn marked_by(&self, sender: &Instance<'a>, receivers: &[Receiver<'_, 'a>]) -> BTreeSet<u32> {
        if self.renewal_of_rates.is_some() || self.leaves_committed(sender) {
            return (0..self.network().processes.len() as u32).collect();
        }
        self.concerned_by(sender, receivers)
    }

    /// Whose plans may depend on what the movers have changed.
    fn concerned_by(&self, sender: &Instance<'a>, receivers: &[Receiver<'_, 'a>]) -> BTreeSet<u32> {
        let inputs = receivers.iter().flat_map(Receiver::all_inputs);
        let concerned = inputs.chain([sender]).flat_map(|mover| {
            let branches = 0..mover.edge.branches.len();
            let concerned = branches.flat_map(|number| self.program.concerned(mover, number));
            let followers = self.program.followers(ProcessId(mover.process)).iter();
            concerned
                .map(|reader| reader.process)
                .chain(followers.copied())
        });
        concerned.collect()
    }

    /// Ends a move after which those that have moved do not plan yet: only those invariants are
    /// looked at that may not hold any more.
    fn put_plans_off(
        &self,
        w: &mut Writer<'_>,
        (sender, branch): (&Instance<'a>, Register),
        receivers: &[Receiver<'_, 'a>],
        ids: &Ids,
    ) {
        let broken = w.block();
        Self::for_branch(w, sender, branch, |w, number| {
            let target = sender.edge.branches[number].target;
            let spot = self.program.spot(sender.process as usize, target);
            let Ok(()) = rules::require(w, self.program, spot.invariant, &[], broken);
        });
        self.mark_processes(w, [sender.process]);
        let invariant_of = |process: u32| ids.invariants[process as usize];
        for receiver in receivers {
            w.when(receiver.chosen, |w| {
                if let Some(invariant) = invariant_of(receiver.process) {
                    w.call(invariant, &[]);
                }
                self.mark_processes(w, [receiver.process]);
            });
        }
        for process in self.concerned_by(sender, receivers) {
            if let Some(invariant) = invariant_of(process) {
                w.call(invariant, &[]);
            }
        }
        let result = w.integer(PUT_OFF);
        w.return_value(Some(result));
        w.at(broken);
        w.give_up();
    }

    /// Lets those plan that have moved, the sender first; the others do so later.
    fn plan_movers(
        &self,
        w: &mut Writer<'_>,
        (sender, branch): (&Instance<'a>, Register),
        receivers: &[Receiver<'_, 'a>],
        ids: &Ids,
    ) {
        let marked = self.marked_by(sender, receivers);
        if marked.contains(&sender.process) {
            self.unmark(w, sender.process);
        }
        for receiver in receivers {
            if marked.contains(&receiver.process) {
                w.when(receiver.chosen, |w| self.unmark(w, receiver.process));
            }
        }
        Self::for_branch(w, sender, branch, |w, number| {
            let process = sender.process as usize;
            let target = sender.edge.branches[number].target;
            let spot = self.program.spot(process, target);
            if spot.urgency == Urgency::Committed {
                w.give_up();
                return;
            }
            let Ok(()) = rules::plan(w, self.program, process, spot);
        });
        for receiver in receivers {
            let done = w.block();
            let plans = &ids.plans[receiver.process as usize];
            Self::for_chosen(w, receiver, done, |w, input| {
                let plan = match &input.edge.branches[..] {
                    [only] => plans.by_location[only.target.0 as usize],
                    _ => Some(plans.anywhere),
                };
                match plan {
                    None => w.give_up(),
                    Some(plan) => w.call(plan, &[]),
                }
            });
        }
    }

    /// Lets a process choose what it receives on one of some channels.
    fn receiver<'p>(
        &'p self,
        w: &mut Writer<'_>,
        process: u32,
        (channel, channels): (Register, &Range<u32>),
    ) -> Option<Receiver<'p, 'a>> {
        let may_receive = |input: &&Instance<'a>| match input.channel {
            Channel::None => false,
            Channel::Known(one) => channels.contains(&one),
            Channel::Computed(first, _) => {
                let count = input.edge.sync.map_or(0, |sync| sync.count);
                first < channels.end && channels.start < first + count
            }
        };
        let spots = self.program.spots_of(process as usize);
        let inputs: Vec<(i32, Vec<&Instance<'a>>)> = (0..)
            .zip(spots)
            .map(|(location, spot)| {
                let inputs = self.program.range(spot.inputs).iter();
                (location, inputs.filter(may_receive).collect())
            })
            .collect();
        if inputs.iter().all(|(_, inputs)| inputs.is_empty()) {
            return None;
        }
        let (chosen, branch) = (w.integer(0), w.integer(0));
        let next = w.block();
        let location = w.load(process);
        let start = w.block();
        w.jump(start);
        let mut places = Vec::new();
        let mut first = 1;
        for (location, inputs) in &inputs {
            if inputs.is_empty() {
                places.push((*location, next));
                continue;
            }
            let block = w.block();
            places.push((*location, block));
            w.at(block);
            self.choose_input(w, inputs, (channel, channels), (chosen, first), next);
            first += inputs.len() as i32;
        }
        w.at(start);
        w.select(location, &places);
        w.at(next);
        Some(Receiver {
            process,
            inputs,
            chosen,
            branch,
        })
    }

    /// Chooses one of the inputs of a location that are enabled, if there are any.
    fn choose_input(
        &self,
        w: &mut Writer<'_>,
        inputs: &[&Instance<'a>],
        (channel, channels): (Register, &Range<u32>),
        (chosen, first): (Register, i32),
        next: BlockId,
    ) {
        let mut candidates = Vec::new();
        for (number, &input) in (first..).zip(inputs) {
            let (flag, otherwise) = (w.integer(0), w.block());
            match input.channel {
                Channel::None => {}
                Channel::Known(_) if channels.len() == 1 => {}
                Channel::Known(own) => {
                    let is_it = w.compare_to(channel, Relation::Equal, own as i32);
                    w.unless(is_it, otherwise);
                }
                Channel::Computed(own, index) => {
                    let own = computed_channel(w, input, (own, index));
                    let is_it = w.compare(channel, Relation::Equal, own);
                    w.unless(is_it, otherwise);
                }
            }
            let Ok(()) = rules::require(w, self.program, input.guard, &input.values, otherwise);
            let one = w.integer(1);
            w.copy(flag, one);
            w.jump(otherwise);
            w.at(otherwise);
            candidates.push(Candidate {
                instance: input,
                number,
                flag: Some(flag),
            });
        }
        let Ok(taken) = rules::one_of(w, self.program, &candidates, next);
        w.copy(chosen, taken);
        w.jump(next);
    }

    /// Writes what is done for each input that a receiver may have chosen, and goes on at `done`.
    fn for_chosen(
        w: &mut Writer<'_>,
        receiver: &Receiver<'_, 'a>,
        done: BlockId,
        write: impl Fn(&mut Writer<'_>, &Instance<'a>),
    ) {
        let start = w.block();
        w.jump(start);
        let mut places = vec![(0, done)];
        let inputs = receiver.inputs.iter().flat_map(|(_, inputs)| inputs);
        for (number, input) in (1..).zip(inputs) {
            let block = w.block();
            places.push((number, block));
            w.at(block);
            write(w, input);
            w.jump(done);
        }
        w.at(start);
        w.select(receiver.chosen, &places);
        w.at(done);
    }

    fn branch_of_receiver(&self, w: &mut Writer<'_>, receiver: &Receiver<'_, 'a>) {
        let mut inputs = receiver.inputs.iter().flat_map(|(_, inputs)| inputs);
        if inputs.any(|input| input.edge.branches.len() > 1) {
            let done = w.block();
            Self::for_chosen(w, receiver, done, |w, input| {
                let Ok(branch) = rules::branch(w, self.program, input);
                w.copy(receiver.branch, branch);
            });
        }
    }

    /// Runs the updates of a mover, and lets it enter the target of its branch.
    fn apply(&self, w: &mut Writer<'_>, mover: &Instance<'a>, branch: Register) {
        update(w, &mover.edge.update, &mover.values);
        Self::for_branch(w, mover, branch, |w, number| self.enter(w, mover, number));
    }

    /// Writes what is done for each branch that a mover may have taken.
    fn for_branch(
        w: &mut Writer<'_>,
        mover: &Instance<'a>,
        branch: Register,
        write: impl Fn(&mut Writer<'_>, usize),
    ) {
        let branches = mover.edge.branches.len();
        if branches == 1 {
            write(w, 0);
            return;
        }
        let (start, done) = (w.block(), w.block());
        w.jump(start);
        let mut places = Vec::new();
        for number in 0..branches {
            let block = w.block();
            places.push((number as i32, block));
            w.at(block);
            write(w, number);
            w.jump(done);
        }
        w.at(start);
        w.select(branch, &places);
        w.at(done);
    }

    fn enter(&self, w: &mut Writer<'_>, mover: &Instance<'a>, number: usize) {
        let branch = &mover.edge.branches[number];
        update(w, &branch.update, &mover.values);
        // Who has moved plans anyway, but who sets rates is looked at before.
        let sets_rates = self.program.rated.contains(&mover.process);
        let mut stale: Vec<u32> = sets_rates.then_some(mover.process).into_iter().collect();
        let readers = self.program.concerned(mover, number);
        self.mark_readers(w, readers, Some(mover.process));
        let (source, target) = (mover.edge.source, branch.target);
        if source != target {
            let place = w.integer(target.0 as i32);
            w.store(mover.process, place);
            let commits = |location| i32::from(self.is_committed(mover.process, location));
            let change = commits(target) - commits(source);
            if change != 0 {
                let (committed, change) = (w.load(self.layout.committed), w.integer(change));
                let committed = w.add_integers(committed, change);
                w.store(self.layout.committed, committed);
            }
            stale.extend(self.program.followers(ProcessId(mover.process)));
        }
        self.mark_processes(w, stale);
    }

    /// Lets processes plan anew.
    fn mark_processes(&self, w: &mut Writer<'_>, processes: impl IntoIterator<Item = u32>) {
        let mut masks = vec![0; self.layout.stale_words as usize];
        for process in processes {
            let (word, bit) = self.layout.stale_bit(process as usize);
            masks[(word - self.layout.stale) as usize] |= bit;
        }
        for (word, mask) in (self.layout.stale..).zip(masks) {
            if mask != 0 {
                mark(w, word, mask);
            }
        }
    }

    /// Lets a process not plan anew.
    fn unmark(&self, w: &mut Writer<'_>, process: u32) {
        let (word, bit) = self.layout.stale_bit(process as usize);
        let (before, others) = (w.load(word), w.integer(!bit));
        let after = w.arithmetic(IntegerOperator::And, before, others);
        w.store(word, after);
    }

    /// Lets those plan anew who are where their plans depend on what has changed; `but` does so
    /// anyway.
    pub(super) fn mark_readers(&self, w: &mut Writer<'_>, readers: &[Reader], but: Option<u32>) {
        let everywhere = readers.iter().filter(|reader| reader.location.is_none());
        self.mark_processes(w, everywhere.map(|reader| reader.process));
        for reader in readers {
            let Some(location) = reader.location.filter(|_| Some(reader.process) != but) else {
                continue;
            };
            let (word, bit) = self.layout.stale_bit(reader.process as usize);
            let is_at = w.load(reader.process);
            let is_there = w.compare_to(is_at, Relation::Equal, location as i32);
            let bit = w.integer(bit);
            let none = w.integer(0);
            let bit = w.either(is_there, bit, none);
            let marked = w.load(word);
            let marked = w.arithmetic(IntegerOperator::Or, marked, bit);
            w.store(word, marked);
        }
    }

    /// The function that says whether an output of a process is enabled now, where time stands
    /// still; if its argument is not 0, only an output that leaves a committed location counts.
    pub(super) fn ability(&self, process: usize) -> Function {
        let result = (1, Some(RegisterType::Integer));
        let mut w = self.writer(&format!("whether process {process} can move"), result);
        let only_committed = Register(0);
        let location = w.load(process as u32);
        let (start, unable) = (w.block(), w.block());
        w.jump(start);
        let mut places = Vec::new();
        for (location, spot) in (0..).zip(self.program.spots_of(process)) {
            if spot.outputs.0 == spot.outputs.1 {
                places.push((location, unable));
                continue;
            }
            let block = w.block();
            places.push((location, block));
            w.at(block);
            if spot.urgency != Urgency::Committed {
                let any = w.compare_to(only_committed, Relation::Equal, 0);
                w.unless(any, unable);
            }
            let some = w.integer(0);
            for output in self.program.range(spot.outputs) {
                self.when_enabled(&mut w, output, |w| {
                    let one = w.integer(1);
                    w.copy(some, one);
                });
            }
            w.return_value(Some(some));
        }
        w.at(start);
        w.select(location, &places);
        w.at(unable);
        let zero = w.integer(0);
        w.return_value(Some(zero));
        w.finish()
    }
}

/// The number of the channel of an instance that computes it.
fn computed_channel(
    w: &mut Writer<'_>,
    instance: &Instance<'_>,
    (first, index): (u32, FunctionId),
) -> Register {
    let values = instance.values.iter();
    let arguments = values.map(|&one| w.integer(one)).collect();
    let offset = w.call_for(index, arguments);
    let first = w.integer(first as i32);
    w.add_integers(first, offset)
}

fn update(w: &mut Writer<'_>, update: &Update, values: &[i32]) {
    if let Some(function) = update.function {
        w.call(function, values);
    }
}

/// Sets bits of a word.
pub(super) fn mark(w: &mut Writer<'_>, word: u32, bits: i32) {
    let (before, bits) = (w.load(word), w.integer(bits));
    let after = w.arithmetic(IntegerOperator::Or, before, bits);
    w.store(word, after);
}

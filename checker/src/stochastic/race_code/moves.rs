//! Code for what a move does, as `stochastic/race/transition.rs` says it.

use std::collections::BTreeSet;
use std::ops::Range;
use std::slice;

use super::race_writer::{Ids, RaceWriter};
use super::writer::Writer;
use crate::ir::{
    BlockId, Function, FunctionId, IntegerOperator, LocationId, ProcessId, Register, RegisterType,
    Relation, Sync, Update, Urgency,
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

/// What it returns if the controller is asked first.
pub(super) const ASKED_FIRST: i32 = 3;

/// Where a round goes on behind a move: see [`MOVED`] and [`PUT_OFF`].
#[derive(Clone, Copy)]
pub(super) struct Ways {
    pub(super) moved: BlockId,
    pub(super) put_off: BlockId,
}

/// Something that is sent on one of some channels; the register says which.
struct Sent {
    channel: Register,
    channels: Range<u32>,
}

/// A process that may receive what is sent.
struct Receiver<'p, 'a> {
    process: u32,
    /// By location: its inputs that may be on the channel.
    inputs: Vec<Vec<&'p Instance<'a>>>,
    /// Which of all its inputs it takes, counted from 1; 0 if none.
    chosen: Register,
    /// Which branch of it.
    branch: Register,
}

impl<'p, 'a> Receiver<'p, 'a> {
    fn all_inputs(&self) -> impl Iterator<Item = &'p Instance<'a>> {
        self.inputs.iter().flatten().copied()
    }
}

/// Those that move together.
struct Movers<'p, 'a> {
    sender: &'p Instance<'a>,
    /// Which branch the sender takes.
    branch: Register,
    receivers: Vec<Receiver<'p, 'a>>,
}

impl<'p, 'a> Movers<'p, 'a> {
    fn all_instances(&self) -> impl Iterator<Item = &'p Instance<'a>> {
        let inputs = self.receivers.iter().flat_map(Receiver::all_inputs);
        inputs.chain([self.sender])
    }
}

impl<'a> RaceWriter<'_, 'a> {
    /// The function that lets a process move from a location.
    pub(super) fn movement(&self, process: usize, location: usize, ids: &Ids) -> Function {
        let name = format!("move of process {process} from location {location}");
        let mut writer = self.writer(&name, 0, Some(RegisterType::Integer));
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
            self.let_take(w, only, ids);
        } else {
            let chosen = match &self.layout.decisions {
                Some(decisions)
                    if spot.urgency == Urgency::Normal && self.program.is_mixed(spot) =>
                {
                    self.choose_asked(w, decisions, outputs, missed)
                }
                _ => self.choose(w, outputs.iter(), missed),
            };
            let Ok(()) = w.cases(chosen, outputs.len(), |w, number| {
                self.let_take(w, &outputs[number], ids);
                Ok(())
            });
        }
        w.at(missed);
        let (word, bit) = self.layout.stale_bit(process);
        mark(w, word, bit);
        let result = w.integer(MISSED);
        w.return_value(Some(result));
        writer.finish()
    }

    /// Lets a process take an output, unless the controller is asked first.
    fn let_take(&self, w: &mut Writer<'_>, sender: &Instance<'a>, ids: &Ids) {
        if sender.edge.controllable && self.layout.decisions.is_some() {
            let asked = w.integer(ASKED_FIRST);
            return w.return_value(Some(asked));
        }
        self.carry_out(w, sender, ids);
    }

    /// Chooses one of the instances that are enabled, and returns its number; goes elsewhere if
    /// there are none.
    pub(super) fn choose<'i>(
        &self,
        w: &mut Writer<'_>,
        instances: impl Iterator<Item = &'i Instance<'a>>,
        otherwise: BlockId,
    ) -> Register
    where
        'a: 'i,
    {
        let candidates = (0..).zip(instances).map(|(number, instance)| {
            let flag = (instance.guard != Condition::Always).then(|| {
                let Ok(flag) = rules::is_any_enabled(w, self.program, slice::from_ref(instance));
                flag
            });
            Candidate {
                instance,
                number: w.integer(number),
                flag,
            }
        });
        let candidates: Vec<_> = candidates.collect();
        let candidates = candidates.iter().copied();
        let Ok(chosen) = rules::one_of(w, self.program, candidates, otherwise);
        chosen
    }

    /// Lets a process take an output with all who receive, and returns.
    pub(super) fn carry_out(&self, w: &mut Writer<'_>, sender: &Instance<'a>, ids: &Ids) {
        let channels = sender.edge.sync.map_or(0..0, Sync::channels);
        let channel = match sender.channel {
            Channel::None => return self.carry_out_on(w, sender, None, ids),
            Channel::Known(channel) => {
                let channels = channel..channel + 1;
                let channel = w.integer(channel as i32);
                return self.carry_out_on(w, sender, Some(Sent { channel, channels }), ids);
            }
            Channel::Computed(first, index) => computed_channel(w, sender, first, index),
        };
        if !self.is_worth_telling_apart(&channels) {
            return self.carry_out_on(w, sender, Some(Sent { channel, channels }), ids);
        }
        let places = channels.map(|channel| (channel as i32, w.block()));
        let places: Vec<(i32, BlockId)> = places.collect();
        w.select(channel, &places);
        for &(number, block) in &places {
            w.at(block);
            let channel = w.integer(number);
            let channels = number as u32..number as u32 + 1;
            self.carry_out_on(w, sender, Some(Sent { channel, channels }), ids);
        }
    }

    /// Whether few processes receive on each of some channels, and many on all of them.
    fn is_worth_telling_apart(&self, channels: &Range<u32>) -> bool {
        let of_channel = |channel| self.program.receivers(channel).len();
        let most = channels.clone().map(of_channel).max().unwrap_or(0);
        let all: usize = channels.clone().map(of_channel).sum();
        (2..=MOST_CHANNELS).contains(&channels.len()) && 2 * most < all
    }

    /// Lets a process take an output, which is sent if it synchronises.
    fn carry_out_on(
        &self,
        w: &mut Writer<'_>,
        sender: &Instance<'a>,
        sent: Option<Sent>,
        ids: &Ids,
    ) {
        let mut receivers = Vec::new();
        if let Some(sent) = sent {
            let partners = self.program.partners(sender).into_iter();
            receivers.extend(partners.filter_map(|process| self.receiver(w, process, &sent)));
        }
        let Ok(branch) = rules::branch(w, self.program, sender);
        for receiver in &receivers {
            self.branch_of_receiver(w, receiver);
        }
        self.apply(w, sender, branch);
        for receiver in &receivers {
            Self::for_chosen(w, receiver, |w, input| {
                self.apply(w, input, receiver.branch);
            });
        }
        if let Some(renewal) = self.renewal_of_rates {
            w.call(renewal, &[]);
        }
        let movers = Movers {
            sender,
            branch,
            receivers,
        };
        if let Some(decisions) = &self.layout.decisions {
            self.renew_decisions(w, decisions);
        }
        if self.may_commit(&movers) {
            let committed = w.load(self.layout.committed);
            w.when(committed, |w| self.put_plans_off(w, &movers, ids));
        }
        self.plan_movers(w, &movers, ids);
        let result = w.integer(MOVED);
        w.return_value(Some(result));
    }

    /// Whether a process may be in a location that is committed when the movers have moved.
    fn may_commit(&self, movers: &Movers<'_, 'a>) -> bool {
        let mut entered = movers.all_instances().flat_map(|mover| {
            let branches = mover.edge.branches.iter();
            branches.map(|branch| (mover.process, branch.target))
        });
        // If the sender is not in such a location, nobody is: it could not move.
        let sender = movers.sender;
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
    fn marked_by(&self, movers: &Movers<'_, 'a>) -> BTreeSet<u32> {
        if self.renewal_of_rates.is_some() || self.leaves_committed(movers.sender) {
            return (0..self.network().processes.len() as u32).collect();
        }
        let deciders = self.deciders.iter().map(|decider| decider.process);
        let mut marked = self.concerned_by(movers);
        marked.extend(deciders);
        marked
    }

    /// Whose plans may depend on what the movers have changed.
    fn concerned_by(&self, movers: &Movers<'_, 'a>) -> BTreeSet<u32> {
        let concerned = movers.all_instances().flat_map(|mover| {
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
    fn put_plans_off(&self, w: &mut Writer<'_>, movers: &Movers<'_, 'a>, ids: &Ids) {
        let sender = movers.sender;
        Self::for_branch(w, sender, movers.branch, |w, number| {
            let target = sender.edge.branches[number].target;
            let spot = self.program.spot(sender.process as usize, target);
            let process = sender.process as usize;
            let Ok(()) = rules::require_invariant(w, self.program, process, spot);
        });
        self.mark_processes(w, [sender.process]);
        let invariant_of = |process: u32| ids.invariants[process as usize];
        for receiver in &movers.receivers {
            w.when(receiver.chosen, |w| {
                if let Some(invariant) = invariant_of(receiver.process) {
                    w.call(invariant, &[]);
                }
                self.mark_processes(w, [receiver.process]);
            });
        }
        for process in self.concerned_by(movers) {
            if let Some(invariant) = invariant_of(process) {
                w.call(invariant, &[]);
            }
        }
        let result = w.integer(PUT_OFF);
        w.return_value(Some(result));
    }

    /// Lets those plan that have moved, the sender first; the others do so later.
    fn plan_movers(&self, w: &mut Writer<'_>, movers: &Movers<'_, 'a>, ids: &Ids) {
        let (marked, sender) = (self.marked_by(movers), movers.sender);
        if marked.contains(&sender.process) {
            self.unmark(w, sender.process);
        }
        for receiver in &movers.receivers {
            if marked.contains(&receiver.process) {
                w.when(receiver.chosen, |w| self.unmark(w, receiver.process));
            }
        }
        Self::for_branch(w, sender, movers.branch, |w, number| {
            let process = sender.process as usize;
            let target = sender.edge.branches[number].target;
            let spot = self.program.spot(process, target);
            if spot.urgency == Urgency::Committed {
                w.give_up();
                return;
            }
            let Ok(()) = rules::plan(w, self.program, process, spot);
        });
        for receiver in &movers.receivers {
            let plans = &ids.plans[receiver.process as usize];
            Self::for_chosen(w, receiver, |w, input| {
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

    /// Lets a process choose what it receives of what is sent; none if it never receives it.
    fn receiver<'p>(
        &'p self,
        w: &mut Writer<'_>,
        process: u32,
        sent: &Sent,
    ) -> Option<Receiver<'p, 'a>> {
        let channels = &sent.channels;
        let may_receive = |input: &&Instance<'a>| match input.channel {
            Channel::None => false,
            Channel::Known(one) => channels.contains(&one),
            Channel::Computed(..) => input.edge.sync.is_some_and(|sync| {
                let own = sync.channels();
                own.start < channels.end && channels.start < own.end
            }),
        };
        let spots = self.program.spots_of(process as usize).iter();
        let inputs = spots.map(|spot| self.program.range(spot.inputs).iter());
        let inputs: Vec<Vec<_>> = inputs
            .map(|inputs| inputs.filter(may_receive).collect())
            .collect();
        if inputs.iter().all(Vec::is_empty) {
            return None;
        }
        let (chosen, branch) = (w.integer(0), w.integer(0));
        let location = w.load(process);
        let mut first = 1;
        let Ok(()) = w.cases(location, inputs.len(), |w, location| {
            let inputs = &inputs[location];
            if !inputs.is_empty() {
                self.choose_input(w, inputs, first, sent, chosen);
                first += inputs.len() as i32;
            }
            Ok(())
        });
        Some(Receiver {
            process,
            inputs,
            chosen,
            branch,
        })
    }

    /// Chooses one of the inputs of a location that are enabled, if there are any; the inputs are
    /// counted from `first`.
    fn choose_input(
        &self,
        w: &mut Writer<'_>,
        inputs: &[&Instance<'a>],
        first: i32,
        sent: &Sent,
        chosen: Register,
    ) {
        let Ok(()) = w.attempt(|w, none| {
            let mut candidates = Vec::new();
            for (number, &instance) in (first..).zip(inputs) {
                let flag = w.integer(0);
                w.attempt(|w, otherwise| {
                    if let Channel::Computed(first, index) = instance.channel {
                        let own = computed_channel(w, instance, first, index);
                        let is_it = w.compare(sent.channel, Relation::Equal, own);
                        w.unless(is_it, otherwise);
                    } else if let Channel::Known(own) = instance.channel
                        && sent.channels.len() > 1
                    {
                        let is_it = w.compare_to(sent.channel, Relation::Equal, own as i32);
                        w.unless(is_it, otherwise);
                    }
                    let (guard, values) = (instance.guard, &instance.values);
                    rules::require(w, self.program, guard, values, otherwise)?;
                    let one = w.integer(1);
                    w.copy(flag, one);
                    Ok(())
                })?;
                candidates.push(Candidate {
                    instance,
                    number: w.integer(number),
                    flag: Some(flag),
                });
            }
            let candidates = candidates.iter().copied();
            let taken = rules::one_of(w, self.program, candidates, none)?;
            w.copy(chosen, taken);
            Ok(())
        });
    }

    /// Writes what is done for each input that a receiver may have chosen.
    fn for_chosen(
        w: &mut Writer<'_>,
        receiver: &Receiver<'_, 'a>,
        write: impl Fn(&mut Writer<'_>, &Instance<'a>),
    ) {
        let inputs: Vec<_> = receiver.all_inputs().collect();
        let Ok(()) = w.cases(receiver.chosen, 1 + inputs.len(), |w, number| {
            if let Some(place) = number.checked_sub(1) {
                write(w, inputs[place]);
            }
            Ok(())
        });
    }

    fn branch_of_receiver(&self, w: &mut Writer<'_>, receiver: &Receiver<'_, 'a>) {
        if receiver
            .all_inputs()
            .any(|input| input.edge.branches.len() > 1)
        {
            Self::for_chosen(w, receiver, |w, input| {
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
        let Ok(()) = w.cases(branch, mover.edge.branches.len(), |w, number| {
            write(w, number);
            Ok(())
        });
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
        let mut w = self.writer(
            &format!("whether process {process} can move"),
            1,
            Some(RegisterType::Integer),
        );
        let only_committed = Register(0);
        let location = w.load(process as u32);
        let spots = self.program.spots_of(process);
        let Ok(()) = w.cases(location, spots.len(), |w, location| {
            let spot = &spots[location];
            let outputs = self.program.range(spot.outputs);
            if outputs.is_empty() {
                return Ok(());
            }
            w.attempt(|w, unable| {
                if spot.urgency != Urgency::Committed {
                    let any = w.compare_to(only_committed, Relation::Equal, 0);
                    w.unless(any, unable);
                }
                let is_able = rules::is_any_enabled(w, self.program, outputs)?;
                w.return_value(Some(is_able));
                Ok(())
            })
        });
        let zero = w.integer(0);
        w.return_value(Some(zero));
        w.finish()
    }
}

/// The number of the channel of an instance that computes it.
fn computed_channel(
    w: &mut Writer<'_>,
    instance: &Instance<'_>,
    first: u32,
    index: FunctionId,
) -> Register {
    let Ok(offset) = Backend::call(w, index, &instance.values);
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

//! Enabled instances and synchronisations from cached sets; see [`super::select_cache`].

use crate::ir::ChannelId;

use super::broadcast_filter::Sending;
use super::candidate::{Candidate, Choice};
use super::edge_tables::EdgeEntry;
use super::partners::Pair;
use super::select_cache::{Instance, Known, Set, SetId};
use super::selects::select_values;
use super::stepper::Stepper;
use super::transition::{Label, Moves, Part};
use crate::network::failure::Failure;

/// The partners of a sending edge with several instances are searched among all processes that
/// receive on one of its channels, if there are at most this many processes for each instance.
/// Otherwise they are searched by channel.
const MOST_PARTNERS: usize = 4;

impl<'a> Stepper<'a> {
    /// The enabled instances of an edge in the current state; `None` if they are not remembered.
    pub(super) fn set_of(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        words: &mut [i32],
    ) -> Option<SetId> {
        // A recorder must see everything that is evaluated.
        if self.record.is_some() || !self.tuning.select_cache {
            return None;
        }
        match self.instances.find(process, entry.index, self.round, words) {
            Known::Set(set) => Some(set),
            Known::Never => None,
            Known::New => {
                let set = self.evaluate_set(entry, words)?;
                self.instances
                    .remember(process, entry.index, self.round, set)
            }
        }
    }

    /// Evaluates all instances of an edge; `None` if that fails for one.
    fn evaluate_set(&mut self, entry: EdgeEntry<'a>, words: &mut [i32]) -> Option<Set> {
        let first = self.constraints.len();
        let mut set = Set::default();
        let mut is_whole = true;
        for select in 0..entry.instances {
            is_whole &= self.add_instance(entry, select, &mut set, words).is_some();
            self.constraints.truncate(first);
        }
        if entry.edge.sync.is_some_and(|sync| !sync.send) {
            set.instances.sort_by_key(|one| one.channel);
        }
        is_whole.then_some(set)
    }

    /// Adds an instance to a set if it is enabled; `None` if evaluating it fails.
    fn add_instance(
        &mut self,
        entry: EdgeEntry<'a>,
        select: u32,
        set: &mut Set,
        words: &mut [i32],
    ) -> Option<()> {
        let first = self.constraints.len();
        select_values(entry.edge, select, &mut self.arguments);
        let is_enabled = self.guard(&entry.edge.guard, words).ok()?;
        let mut channel = 0;
        if !is_enabled {
            return Some(());
        }
        if let Some(sync) = entry.edge.sync {
            channel = sync.channel.0;
            if let Some(function) = sync.index {
                channel += self.call(self.executor, function, words).ok()? as u32;
            }
        }
        set.push(channel, select, &self.constraints[first..]);
        Some(())
    }

    /// Adds the instances of a set to the candidates; if a channel is given, only those that listen
    /// to it.
    pub(super) fn add_candidates(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        set: SetId,
        channel: Option<u32>,
    ) {
        let instances = self.instances.set(set);
        let places = match channel {
            Some(channel) => instances.listeners(channel),
            None => 0..instances.instances.len(),
        };
        for place in places {
            let instance = self.instances.set(set).instances[place];
            self.add_candidate(process, entry, set, instance);
        }
    }

    fn add_candidate(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        set: SetId,
        instance: Instance,
    ) {
        let first = self.constraints.len() as u32;
        let constraints = self.instances.set(set).constraints(instance);
        self.constraints.extend_from_slice(constraints);
        self.candidates.push(Candidate {
            process,
            edge: entry.index,
            select: instance.select,
            is_controllable: entry.edge.controllable,
            constraints: (first, self.constraints.len() as u32),
        });
    }

    /// The moves in which an edge with this set of enabled instances sends.
    pub(super) fn remembered_synchronisations(
        &mut self,
        sender: Sending<'_>,
        entry: EdgeEntry<'a>,
        set: SetId,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let process = sender.process;
        let count = self.instances.set(set).instances.len();
        if count > 1 && self.pair(sender, entry, set, words) {
            self.emit_pairs(process, entry, set, out);
            return Ok(());
        }
        for place in 0..count {
            let instance = self.instances.set(set).instances[place];
            self.begin(process, entry, set, instance);
            let channel = instance.channel;
            self.synchronisations_on(sender, channel, words, out)?;
        }
        Ok(())
    }

    /// Makes an instance of a sender candidate 0.
    fn begin(&mut self, process: u32, entry: EdgeEntry<'a>, set: SetId, instance: Instance) {
        self.candidates.clear();
        self.constraints.clear();
        self.add_candidate(process, entry, set, instance);
    }

    /// Finds the pairs in which an edge sends on a binary channel. Returns false if another search
    /// must find them.
    fn pair(
        &mut self,
        sender: Sending<'_>,
        entry: EdgeEntry<'a>,
        set: SetId,
        words: &mut [i32],
    ) -> bool {
        let Some(sync) = entry.edge.sync.filter(|_| self.tuning.pairing) else {
            return false;
        };
        let count = self.instances.set(set).instances.len();
        let channels = sync.channels();
        if self.network.channels[channels.start as usize].broadcast {
            return false;
        }
        let Some(partners) = self.partners.get(&(sync.channel, sync.count)).cloned() else {
            return false;
        };
        if partners.len() > MOST_PARTNERS * count {
            return false;
        }
        self.pairs.clear();
        for &receiver in &*partners {
            if receiver == sender.process
                || (sender.needs_committed && !self.is_process_committed(receiver, words))
            {
                continue;
            }
            let location = words[receiver as usize] as usize;
            for index in 0..self.tables[receiver as usize][location].receives.len() {
                let receive = self.tables[receiver as usize][location].receives[index];
                let overlaps = receive.edge.sync.is_some_and(|sync| {
                    sync.channel.0 < channels.end && channels.start < sync.channel.0 + sync.count
                });
                if !overlaps {
                    continue;
                }
                let Some(other_set) = self.set_of(receiver, receive, words) else {
                    return false;
                };
                let pairs = &mut self.pairs;
                self.instances
                    .add_matches(set, other_set, &mut |own, other| {
                        pairs.push(Pair {
                            own,
                            receiver,
                            receive,
                            set: other_set,
                            other,
                        });
                    });
            }
        }
        // The order is the same as if receivers were searched for each instance of the sender in
        // turn.
        self.pairs.sort_by_key(|pair| pair.own);
        true
    }

    fn emit_pairs(&mut self, sender: u32, entry: EdgeEntry<'a>, set: SetId, out: &mut Moves) {
        let pairs = std::mem::take(&mut self.pairs);
        for pair in &pairs {
            let own_set = self.instances.set(set);
            let own = own_set.instances[pair.own as usize];
            let other_set = self.instances.set(pair.set);
            let other = other_set.instances[pair.other as usize];
            if entry.edge.branches.len() > 1 || pair.receive.edge.branches.len() > 1 {
                self.begin(sender, entry, set, own);
                self.channel = Some(ChannelId(own.channel));
                self.add_candidate(pair.receiver, pair.receive, pair.set, other);
                self.chosen.clear();
                self.chosen.extend([Choice::Takes(0), Choice::Takes(1)]);
                self.emit(false, out);
                continue;
            }
            let part = |process, edge, select| Part {
                process,
                edge,
                branch: 0,
                select,
            };
            let label = Label {
                channel: Some(ChannelId(own.channel)),
                controllable: entry.edge.controllable && pair.receive.edge.controllable,
                rank: self.rank,
                is_possible: false,
            };
            out.push(
                &[
                    part(sender, entry.index, own.select),
                    part(pair.receiver, pair.receive.index, other.select),
                ],
                [own_set.constraints(own), other_set.constraints(other)],
                [],
                label,
            );
            self.rank += 1;
        }
        self.pairs = pairs;
    }
}

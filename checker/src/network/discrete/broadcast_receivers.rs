//! The receivers of a broadcast, found once for all its senders in a state.
//!
//! Where every process may send to all others, the number of pairs in each state is the square of
//! the number of processes. The candidates of the receivers do not depend on the sender; its own
//! candidates are left out of its combinations.
//!
//! Invariant: guards are evaluated only for processes that may receive from somebody, in the order
//! of the receivers. The only sender of a channel is not asked what it receives, since its guard
//! could fail.

use super::broadcast_filter::Sending;
use super::candidate::{Candidate, Choice, Group};
use super::stepper::Stepper;
use super::transition::Moves;
use crate::network::failure::Failure;

impl Stepper<'_> {
    /// What [`Stepper::broadcast`] does first, if the receivers were not found in this state yet.
    pub(super) fn note_audience(&mut self, sender: u32, channel: u32, groups: &[Group]) {
        self.audience.round = self.round;
        self.audience.channel = channel;
        self.audience.candidates.clone_from(&self.candidates);
        self.audience.constraints.clone_from(&self.constraints);
        self.audience.groups.clear();
        self.audience.groups.extend_from_slice(groups);
        let may_hear = self.receivers.on(channel).contains(&sender);
        self.audience.left_out = may_hear.then_some(sender);
    }

    /// Whether the receivers of the channel were found in this state.
    pub(super) fn has_audience(&self, channel: u32) -> bool {
        self.audience.round == self.round && self.audience.channel == channel
    }

    /// Works like [`Stepper::broadcast`], if [`Stepper::has_audience`].
    pub(super) fn broadcast_again(
        &mut self,
        sender: Sending<'_>,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let process = sender.process;
        self.ask_left_out(process, words)?;
        let audience = &self.audience;
        let others = audience.groups.iter();
        let mut others = others.filter(|group| audience.process_of(group) != process);
        let is_committed = |group| self.is_process_committed(audience.process_of(group), words);
        if sender.needs_committed && !others.clone().any(is_committed) {
            return Ok(());
        }
        let (mut combinations, mut after) = (1_u64, 1_u64);
        for group in others.by_ref() {
            combinations = combinations.saturating_mul(group.picks());
            after = after.saturating_mul(group.ways);
        }
        let (rank_after, scope) = self.ranks_and_scope(combinations, after, sender.scope)?;
        self.chosen.clear();
        self.filter.begin(scope);
        if self.choose(Choice::Takes(0), scope)? {
            let mut groups = self.combine_receivers(process);
            let sender = Sending { scope, ..sender };
            let result = self.combine_from(sender, &mut groups, words, out);
            self.groups = groups;
            result?;
        }
        self.rank = rank_after;
        Ok(())
    }

    /// Adds what the sender that was left out receives, unless it sends again.
    fn ask_left_out(&mut self, sender: u32, words: &mut [i32]) -> Result<(), Failure> {
        let Some(receiver) = self.audience.left_out.filter(|&one| one != sender) else {
            return Ok(());
        };
        let channel = self.audience.channel;
        let (own, end) = (self.candidates.len(), self.constraints.len());
        self.enabled_receives(receiver, channel, words)?;
        self.audience.left_out = None;
        if self.candidates.len() > own {
            let group = self.group(own);
            let audience = &mut self.audience;
            let place = audience.groups.iter();
            let place = place
                .take_while(|group| audience.candidates[group.first].process < receiver)
                .count();
            let first = audience.candidates.len();
            let shift = audience.constraints.len() as u32;
            let moved = |one: &Candidate| Candidate {
                constraints: (
                    one.constraints.0 - end as u32 + shift,
                    one.constraints.1 - end as u32 + shift,
                ),
                ..*one
            };
            audience
                .candidates
                .extend(self.candidates[own..].iter().map(moved));
            audience
                .constraints
                .extend_from_slice(&self.constraints[end..]);
            audience.groups.insert(place, group.starting_at(first));
        }
        self.candidates.truncate(own);
        self.constraints.truncate(end);
        Ok(())
    }

    /// Combines the receivers with the sender, the candidate 0; returns the groups of all others.
    fn combine_receivers(&mut self, sender: u32) -> Vec<Group> {
        let own = self.candidates[0];
        let (first, last) = own.constraints;
        let audience = &self.audience;
        self.candidates.clone_from(&audience.candidates);
        let begin = audience.constraints.len() as u32;
        let mut constraints = std::mem::take(&mut self.heard);
        constraints.clone_from(&audience.constraints);
        constraints.extend_from_slice(&self.constraints[first as usize..last as usize]);
        self.heard = std::mem::replace(&mut self.constraints, constraints);
        self.candidates[0] = Candidate {
            constraints: (begin, begin + last - first),
            ..own
        };
        let mut groups = std::mem::take(&mut self.groups);
        groups.clear();
        let others = audience.groups.iter();
        groups.extend(others.filter(|group| audience.process_of(group) != sender));
        let mut after = 1_u64;
        for group in groups.iter_mut().rev() {
            after = group.put_before(after);
        }
        groups
    }
}

//! How moves are made of the edges that take part: the combinations of the receivers of a
//! broadcast, and the branches of edges.
//!
//! Invariant: moves come in a fixed order, and each has a *rank*: its place among all combinations,
//! including those that a [`Scope`] leaves out. So the rank of a move of a state is the same in
//! every scope.
//!
//! Cost: without a scope, the number of steps is the number of combinations. Within a zone, each
//! choice that is tried leads to a possible combination, or is the last one that is tried.

use crate::cancellation;
use crate::ir::{FixedConstraint, Network};

use super::broadcast_filter::{Demand, Scope, Sending};
use super::candidate::{Candidate, Choice, Group};
use super::stepper::Stepper;
use super::transition::{Label, Moves, Part};
use crate::network::failure::Failure;

/// After this many moves, the search asks whether more are allowed.
const MANY_MOVES: usize = 1 << 12;

/// The work of combining a move, without the work on its zones.
const UNITS_FOR_MOVE: usize = 256;

/// The greatest rank. No scope could reach the end of more combinations.
const MOST_RANKS: u64 = 1 << 62;

/// This number of combinations is made without asking whether the zone allows them; this is checked
/// later.
const FEW_COMBINATIONS: u64 = 2;

impl Stepper<'_> {
    /// Joins the candidate 0 with one enabled receiving edge of every process that has one.
    pub(super) fn broadcast(
        &mut self,
        sender: Sending<'_>,
        channel: u32,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        // A recorder must see everything that is evaluated.
        let is_shared = self.record.is_none() && self.tuning.broadcast_receivers;
        if is_shared && self.has_audience(channel) {
            return self.broadcast_again(sender, words, out);
        }
        let mut groups = std::mem::take(&mut self.groups);
        groups.clear();
        let mut has_committed = !sender.needs_committed;
        for index in 0..self.receivers.on(channel).len() {
            let receiver = self.receivers.on(channel)[index];
            if receiver == sender.process {
                continue;
            }
            let first = self.candidates.len();
            self.enabled_receives(receiver, channel, words)?;
            if self.candidates.len() > first {
                has_committed |= self.is_process_committed(receiver, words);
                groups.push(self.group(first));
            }
        }
        if is_shared {
            self.note_audience(sender.process, channel, &groups);
        }
        if has_committed {
            self.combine(sender, &mut groups, words, out)?;
        }
        self.groups = groups;
        Ok(())
    }

    /// The candidates from `first` on, all of one receiving process.
    pub(super) fn group(&self, first: usize) -> Group {
        let last = self.candidates.len();
        // If all edges of a receiver have clock guards, none may be enabled: abstaining comes after
        // its candidates.
        let guarded = |candidate: &Candidate| candidate.constraints.0 < candidate.constraints.1;
        let may_abstain = self.candidates[first..last].iter().all(guarded);
        let ways = (first..last).map(|candidate| self.ways(Choice::Takes(candidate as u32)));
        Group {
            ways: ways.sum::<u64>() + u64::from(may_abstain),
            first,
            last,
            end: last + usize::from(may_abstain),
            pick: first,
            before: 0,
            after: 0,
        }
    }

    /// Emits the sender with every combination of the receivers' alternatives that is in the scope.
    /// The choice of the last receiver changes fastest.
    fn combine(
        &mut self,
        sender: Sending<'_>,
        groups: &mut [Group],
        words: &[i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let (mut combinations, mut after) = (1_u64, 1_u64);
        for group in groups.iter_mut().rev() {
            combinations = combinations.saturating_mul(group.picks());
            after = group.put_before(after);
        }
        let (rank_after, scope) = self.ranks_and_scope(combinations, after, sender.scope)?;
        self.chosen.clear();
        self.filter.begin(scope);
        if self.choose(Choice::Takes(0), scope)? {
            self.combine_from(Sending { scope, ..sender }, groups, words, out)?;
        }
        self.rank = rank_after;
        Ok(())
    }

    /// The rank after all moves of a broadcast, and their scope, given the number of combinations
    /// of its receivers and the number of moves that they stand for.
    pub(super) fn ranks_and_scope<'z>(
        &self,
        combinations: u64,
        after: u64,
        scope: Scope<'z>,
    ) -> Result<(u64, Scope<'z>), Failure> {
        let ways = self.ways(Choice::Takes(0));
        let rank_after = self.rank.saturating_add(ways.saturating_mul(after));
        if rank_after > MOST_RANKS {
            return Err(Failure::Moves(MOST_RANKS as usize));
        }
        let is_cut = self.tuning.broadcast_filter || !matches!(scope, Scope::Within(_));
        if combinations <= FEW_COMBINATIONS || !is_cut {
            return Ok((rank_after, Scope::Everything));
        }
        Ok((rank_after, scope))
    }

    /// Tries the choices of the groups, after the sender was chosen.
    pub(super) fn combine_from(
        &mut self,
        sender: Sending<'_>,
        groups: &mut [Group],
        words: &[i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let Sending {
            needs_committed,
            scope,
            ..
        } = sender;
        let is_possible = matches!(scope, Scope::Within(_));
        let mut ways = self.ways(Choice::Takes(0));
        // The groups before this one have made their choices.
        let mut depth = 0;
        loop {
            if let Some(group) = groups.get_mut(depth)
                && group.pick < group.end
            {
                let choice = group.choice();
                group.before = ways;
                let own = ways * self.ways(choice);
                if self.choose(choice, scope)? {
                    ways = own;
                    depth += 1;
                } else {
                    self.rank += own * group.after;
                    group.pick += 1;
                }
                continue;
            }
            if let Some(group) = groups.get_mut(depth) {
                group.pick = group.first;
            } else if !needs_committed || self.has_committed_choice(words) {
                self.emit(is_possible, out);
                out.check_count()?;
                cancellation::work(UNITS_FOR_MOVE);
                if out.len().is_multiple_of(MANY_MOVES) {
                    // The lists will grow to more than this. They may double while the old ones
                    // still exist.
                    cancellation::ask_for(3 * out.heap_bytes() + self.moves_beside);
                }
            } else {
                self.rank += ways;
            }
            if depth == 0 {
                return Ok(());
            }
            depth -= 1;
            ways = groups[depth].before;
            groups[depth].pick += 1;
            self.chosen.pop();
            self.filter.take_back();
        }
    }

    /// Adds a choice to the combination. Returns false, and adds nothing, if the scope has no
    /// combination with it.
    pub(super) fn choose(&mut self, choice: Choice, scope: Scope<'_>) -> Result<bool, Failure> {
        let (candidates, constraints) = (&self.candidates, &self.constraints);
        let constraints_of = |candidate: &Candidate| {
            let (first, last) = candidate.constraints;
            &constraints[first as usize..last as usize]
        };
        let is_chosen = match choice {
            Choice::Takes(index) => {
                let candidate = &candidates[index as usize];
                let demand = Demand::Takes(candidate.part(), constraints_of(candidate));
                self.filter.choose(scope, [demand])?
            }
            Choice::Abstains(first, last) => {
                let candidates = candidates[first as usize..last as usize].iter();
                let demands = candidates.map(|candidate| {
                    Demand::Abstains(candidate.process, constraints_of(candidate))
                });
                self.filter.choose(scope, demands)?
            }
        };
        if is_chosen {
            self.chosen.push(choice);
        }
        Ok(is_chosen)
    }

    /// The number of moves that a choice stands for: the branches of its edge.
    fn ways(&self, choice: Choice) -> u64 {
        match choice {
            Choice::Takes(index) => {
                let edge = self.edge(self.candidates[index as usize].part());
                edge.branches.len() as u64
            }
            Choice::Abstains(..) => 1,
        }
    }

    fn has_committed_choice(&self, words: &[i32]) -> bool {
        self.chosen.iter().any(|choice| match *choice {
            Choice::Takes(index) => {
                self.is_process_committed(self.candidates[index as usize].process, words)
            }
            Choice::Abstains(..) => false,
        })
    }

    /// Emits the chosen combination, once for each combination of branches. `is_possible`: some
    /// valuation of the scope's zone allows it.
    pub(super) fn emit(&mut self, is_possible: bool, out: &mut Moves) {
        let network = self.network;
        self.parts.clear();
        let mut controllable = true;
        for choice in &self.chosen {
            if let Choice::Takes(index) = *choice {
                let candidate = &self.candidates[index as usize];
                controllable &= candidate.is_controllable;
                self.parts.push(candidate.part());
            }
        }
        loop {
            let taken = self.chosen.iter().filter_map(|choice| match *choice {
                Choice::Takes(index) => Some(self.constraints_of(index)),
                Choice::Abstains(..) => None,
            });
            let excluded = self.chosen.iter().flat_map(|choice| match *choice {
                Choice::Takes(_) => 0..0,
                Choice::Abstains(first, last) => first..last,
            });
            let label = Label {
                channel: self.channel,
                controllable,
                rank: self.rank,
                is_possible,
            };
            out.push(
                &self.parts,
                taken,
                excluded.map(|index| self.constraints_of(index)),
                label,
            );
            self.rank += 1;
            if !next_branches(network, &mut self.parts) {
                return;
            }
        }
    }

    fn constraints_of(&self, candidate: u32) -> &[FixedConstraint] {
        let (first, last) = self.candidates[candidate as usize].constraints;
        &self.constraints[first as usize..last as usize]
    }
}

/// Moves to the next combination of branches, the last part fastest; returns false after the last
/// one.
fn next_branches(network: &Network, parts: &mut [Part]) -> bool {
    for part in parts.iter_mut().rev() {
        let edge = network.edge(*part);
        if part.branch as usize + 1 < edge.branches.len() {
            part.branch += 1;
            return true;
        }
        part.branch = 0;
    }
    false
}

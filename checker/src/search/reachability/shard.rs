//! A shard of the stored states, and the mail between shards.
//!
//! The hash of its words decides to which shard a state belongs, so states with the same words are
//! in one shard. Inclusion is decided there, and shards share nothing. States for other shards are
//! collected in [`Mail`], as packed words and zones one after the other.
//!
//! Cost: a state for another shard is copied twice.

use crate::zones::Bound;

use super::expand::Sink;
use super::tree::{Origin, Tree};
use crate::search::outcome::Step;
use crate::search::store::disk::Cold;
use crate::search::store::packed_zones::Kept;
use crate::search::store::passed_list::{PassedList, Stored};
use crate::search::store::queue::Queue;

/// A state that is sent.
#[derive(Clone, Copy, Debug)]
struct Head {
    /// The node from which it was reached, in the shard that sends it.
    origin: u32,
    /// The number of moves from there, with [`IS_CHOICE`].
    steps: u32,
}

/// Marks a committed state, which belongs to the level of the state from which it was reached.
const IS_CHOICE: u32 = 1 << 31;

/// States from one shard to another.
#[derive(Debug, Default)]
pub(super) struct Mail {
    heads: Vec<Head>,
    records: Vec<u8>,
    zones: Vec<Bound>,
    /// The limits of each, or nothing.
    limits: Vec<Bound>,
    steps: Vec<Step>,
    has_choices: bool,
}

impl Mail {
    /// How many states it has.
    pub(super) fn len(&self) -> usize {
        self.heads.len()
    }

    /// Whether there are states that belong to the current level.
    pub(super) fn has_choices(&self) -> bool {
        self.has_choices
    }

    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        self.heads.capacity() * size_of::<Head>()
            + self.records.capacity()
            + (self.zones.capacity() + self.limits.capacity()) * size_of::<Bound>()
            + self.steps.capacity() * size_of::<Step>()
    }

    fn clear(&mut self) {
        self.heads.clear();
        self.records.clear();
        self.zones.clear();
        self.limits.clear();
        self.steps.clear();
        self.has_choices = false;
    }
}

/// The stored states of one shard. As a sink it takes all states, and collects those of other
/// shards.
#[derive(Debug)]
pub(super) struct Shard {
    pub(super) tree: Tree,
    /// The state that is being explored, one of this shard.
    pub(super) current: Origin,
    index: usize,
    /// Whether states may wait to be stored: nobody must know at once whether they are new.
    may_wait: bool,
    /// The states that wait in the current level.
    now: Queue,
    /// Those of the next level.
    next: Queue,
    /// For each shard: the states that will be sent to it.
    pub(super) outgoing: Vec<Mail>,
    /// The bytes of the states that were collected since [`Shard::begin_round`].
    pub(super) sent_bytes: usize,
}

impl Shard {
    /// The shard with this index, of `count` shards, with an empty tree.
    pub(super) fn new(tree: Tree, may_wait: bool, index: usize, count: usize) -> Shard {
        Shard {
            now: Queue::new(tree.passed.has_zones()),
            next: Queue::new(tree.passed.has_zones()),
            tree,
            current: Origin::NOWHERE,
            index,
            may_wait,
            outgoing: (0..count).map(|_| Mail::default()).collect(),
            sent_bytes: 0,
        }
    }

    /// Begins a round; the collected states were delivered.
    pub(super) fn begin_round(&mut self) {
        self.sent_bytes = 0;
    }

    /// Takes the next state of the current level, which will be explored.
    pub(super) fn take(&mut self) -> Option<Stored> {
        while let Some(stored) = self.now.pop_front() {
            if !self.tree.passed.is_covered(stored) {
                self.current = Origin {
                    shard: self.index as u32,
                    node: stored.node,
                };
                return Some(stored);
            }
        }
        None
    }

    /// The number of states that wait in the current level, and in the next.
    pub(super) fn waiting(&self) -> (usize, usize) {
        (self.now.len(), self.next.len())
    }

    /// Begins the next level; nothing waits in the current level.
    pub(super) fn advance(&mut self) {
        std::mem::swap(&mut self.now, &mut self.next);
    }

    /// Stores the states of a mail from another shard, and empties it.
    pub(super) fn deliver(&mut self, mail: &mut Mail, sender: usize) {
        self.tree.passed.leave();
        let count = mail.heads.len().max(1);
        let record_bytes = mail.records.len() / count;
        let zone_bounds = mail.zones.len() / count;
        let limit_bounds = mail.limits.len() / count;
        let mut steps = mail.steps.as_slice();
        for (index, head) in mail.heads.iter().enumerate() {
            let record = &mail.records[index * record_bytes..][..record_bytes];
            let zone = Kept {
                matrix: &mail.zones[index * zone_bounds..][..zone_bounds],
                limits: &mail.limits[index * limit_bounds..][..limit_bounds],
                known: None,
            };
            let (way, rest) = steps.split_at((head.steps & !IS_CHOICE) as usize);
            steps = rest;
            let origin = Origin {
                shard: sender as u32,
                node: head.origin,
            };
            let is_choice = head.steps & IS_CHOICE != 0;
            let Shard { tree, next, .. } = self;
            if self.may_wait && !is_choice && tree.wait_record(record, origin, way, next) {
                continue;
            }
            tree.add_waiting(next);
            let stored = tree.add_record(record, zone, origin, way);
            let queue = if is_choice { &mut self.now } else { next };
            queue.extend(stored);
        }
        self.tree.add_waiting(&mut self.next);
        mail.clear();
    }

    /// What may be put on disk.
    pub(super) fn cold(&mut self) -> impl Iterator<Item = &mut dyn Cold> {
        let waiting = [self.now.cold(), self.next.cold()];
        self.tree.cold().chain(waiting)
    }

    /// The bytes that the shard takes.
    pub(super) fn bytes(&self) -> usize {
        let waiting = self.now.bytes() + self.next.bytes();
        self.tree.bytes() + waiting + self.outgoing.iter().map(Mail::bytes).sum::<usize>()
    }

    /// Stores the states that wait to be stored.
    pub(super) fn end_round(&mut self) {
        self.tree.add_waiting(&mut self.next);
    }

    /// The shard to which a state belongs.
    fn owner(&self, words: &[i32]) -> usize {
        // The upper bits decide.
        let hash = u64::from(self.tree.passed.identity_hash(words));
        ((hash * self.outgoing.len() as u64) >> 32) as usize
    }

    /// Collects a state for another shard.
    fn send(&mut self, owner: usize, words: &[i32], zone: Kept<'_>, way: &[Step], is_choice: bool) {
        let mail = &mut self.outgoing[owner];
        mail.heads.push(Head {
            origin: self.current.node,
            steps: way.len() as u32 | if is_choice { IS_CHOICE } else { 0 },
        });
        let record = self.tree.passed.record(words);
        mail.records.extend_from_slice(record);
        mail.zones.extend_from_slice(zone.matrix);
        mail.limits.extend_from_slice(zone.limits);
        mail.steps.extend_from_slice(way);
        mail.has_choices |= is_choice;
        let zone_bytes = size_of_val(zone.matrix) + size_of_val(zone.limits);
        self.sent_bytes += size_of::<Head>() + record.len() + zone_bytes + size_of_val(way);
    }
}

impl Sink for Shard {
    fn add_waiting(&mut self, words: &[i32], zone: Kept<'_>, way: &[Step]) -> bool {
        let owner = self.owner(words);
        if owner != self.index {
            self.send(owner, words, zone, way, false);
            return false;
        }
        let Shard { tree, next, .. } = self;
        if self.may_wait && tree.wait(words, self.current, way, next) {
            return false;
        }
        let stored = tree.add(words, zone, self.current, way);
        next.extend(stored);
        stored.is_some()
    }

    fn add_choice(&mut self, words: &[i32], zone: Kept<'_>, way: &[Step]) -> bool {
        let owner = self.owner(words);
        if owner != self.index {
            self.send(owner, words, zone, way, true);
            return false;
        }
        self.tree.add_waiting(&mut self.next);
        self.tree.add(words, zone, self.current, way).is_some()
    }

    fn passed(&mut self) -> &mut PassedList {
        &mut self.tree.passed
    }
}

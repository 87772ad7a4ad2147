//! Moves by location vector, remembered.
//!
//! The locations and the answers of guards decide which moves a state has. So each location vector
//! keeps a tree of *questions*, the functions that [`crate::network::Stepper`] evaluates for it in
//! their order, with a branch for each answer met so far. At a leaf stands a [`MoveListId`]: the
//! moves, put together once. For a state whose answers were met before, only guards are evaluated.
//!
//! Invariants:
//! * A tree asks what putting the moves together asks, in the same order, so that the first
//!   run-time error is the same; only what was asked before, with the same arguments, is not asked
//!   again.
//! * The moves of a list do not depend on variables otherwise. A location vector where some guard
//!   emits clock constraints is *unsuited* and has no tree.
//! * Ids stay what they are; nothing is forgotten. Memory is bounded by [`MOST_BYTES`]: what comes
//!   later is not remembered.

use std::hash::BuildHasher;

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;

use crate::ir::FunctionId;
use crate::zones::federation::block_bytes;

use super::transition::{MoveListId, Moves};
use crate::network::trial::{Pause, Trial};

/// The approximate number of bytes that the cache may take.
const MOST_BYTES: usize = 24 << 20;
/// A location vector with more move lists is unsuited: its guards seldom answer the same.
const MOST_LISTS: u32 = 64;
/// A location vector that asks more is unsuited.
const MOST_QUESTIONS: usize = 256;

/// A question has few answers, mostly no and yes.
const USUAL_ANSWERS: usize = 2;

/// A trial in a search fails unless one state in this many finds its moves: a search may meet most
/// location vectors a few times only.
const LEAST_FOUND: u32 = 4;
/// How many states do not ask after a trial that failed.
const FIRST_PAUSE: u32 = 16 * Trial::LENGTH;
const LONGEST_PAUSE: u32 = 256 * Trial::LENGTH;

/// The index of a remembered location vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VectorId(u32);

/// A function that is evaluated, with its arguments.
#[derive(Clone, Debug)]
struct Question {
    function: FunctionId,
    arguments: Box<[i32]>,
    /// Where to go on, by answer.
    answers: Vec<(i32, Point)>,
}

/// A point of a tree.
#[derive(Clone, Copy, Debug)]
pub(super) enum Point {
    /// Ask this question.
    Ask(u32),
    /// These are the moves.
    Moves(MoveListId),
}

/// What is known of a location vector.
#[derive(Clone, Copy, Debug)]
enum Knowledge {
    /// It was met once.
    Met,
    /// It has a tree with this many move lists.
    Tree(Point, u32),
    Unsuited,
}

/// The functions that were evaluated while moves were put together. Arguments that a function does
/// not read are 0.
#[derive(Debug, Default)]
pub(super) struct Record {
    asked: Vec<(FunctionId, Box<[i32]>, i32)>,
    is_unsuited: bool,
}

impl Record {
    /// The answer, if the question was asked before.
    pub(super) fn answer(&self, function: FunctionId, arguments: &[i32]) -> Option<i32> {
        let known = self
            .asked
            .iter()
            .find(|(other, values, _)| *other == function && **values == *arguments);
        known.map(|known| known.2)
    }

    /// Takes down an answer.
    pub(super) fn note(&mut self, function: FunctionId, arguments: Box<[i32]>, answer: i32) {
        self.is_unsuited |= self.asked.len() == MOST_QUESTIONS;
        if !self.is_unsuited {
            self.asked.push((function, arguments, answer));
        }
    }

    /// Says that the moves depend on more than answers.
    pub(super) fn spoil(&mut self) {
        self.is_unsuited = true;
    }
}

/// All that is remembered.
#[derive(Debug)]
pub(super) struct TransitionCache {
    /// How many processes there are.
    processes: usize,
    /// The location vectors, one after the other.
    locations: Vec<i32>,
    table: HashTable<u32>,
    known: Vec<Knowledge>,
    questions: Vec<Question>,
    /// The moves of each list.
    moves: Vec<Moves>,
    bytes: usize,
    trial: Trial,
    pause: Pause,
}

impl TransitionCache {
    /// An empty cache, for a network of this many processes.
    pub(super) fn new(processes: usize) -> TransitionCache {
        TransitionCache {
            processes,
            locations: Vec::new(),
            table: HashTable::new(),
            known: Vec::new(),
            questions: Vec::new(),
            moves: Vec::new(),
            bytes: 0,
            trial: Trial::default(),
            pause: Pause::default(),
        }
    }

    /// Whether a state of a search should ask; to be called for each of them.
    pub(super) fn is_worth_asking(&mut self) -> bool {
        if self.pause.lasts() {
            return false;
        }
        let fails = self.trial.fails(LEAST_FOUND);
        if fails {
            self.pause.begin(FIRST_PAUSE, LONGEST_PAUSE);
        }
        !fails
    }

    /// Says that a state of a search found its moves.
    pub(super) fn note_found(&mut self) {
        self.trial.gain();
    }

    /// The bytes that are taken, about.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The id of the state's location vector; `None` if it is new, as most that are met once are
    /// never met again.
    pub(super) fn vector(&mut self, words: &[i32]) -> Option<VectorId> {
        let key = &words[..self.processes];
        let (locations, processes) = (&self.locations, self.processes);
        let of = |id: u32| &locations[id as usize * processes..][..processes];
        if let Some(&id) = self
            .table
            .find(FxBuildHasher.hash_one(key), |&id| of(id) == key)
        {
            return Some(VectorId(id));
        }
        if self.bytes > MOST_BYTES {
            return None;
        }
        let id = self.known.len() as u32;
        self.table
            .insert_unique(FxBuildHasher.hash_one(key), id, |&id| {
                FxBuildHasher.hash_one(of(id))
            });
        self.known.push(Knowledge::Met);
        self.locations.extend_from_slice(key);
        self.bytes += size_of_val(key) + size_of::<Knowledge>() + 5;
        None
    }

    /// Where the tree of a location vector begins, if it has one.
    pub(super) fn root(&self, vector: VectorId) -> Option<Point> {
        match self.known[vector.0 as usize] {
            Knowledge::Tree(root, _) => Some(root),
            Knowledge::Met | Knowledge::Unsuited => None,
        }
    }

    /// The function and the arguments that a question asks for.
    pub(super) fn asked(&self, question: u32) -> (FunctionId, &[i32]) {
        let question = &self.questions[question as usize];
        (question.function, &question.arguments)
    }

    /// Where to go on with an answer, if that is known.
    pub(super) fn after(&self, question: u32, answer: i32) -> Option<Point> {
        let known = self.questions[question as usize].answers.iter();
        let mut known = known.filter(|known| known.0 == answer);
        known.next().map(|known| known.1)
    }

    /// Whether the moves of a location vector may be remembered.
    pub(super) fn is_suited(&self, vector: VectorId) -> bool {
        !matches!(self.known[vector.0 as usize], Knowledge::Unsuited)
    }

    /// The moves of a list.
    pub(super) fn moves(&self, list: MoveListId) -> &Moves {
        &self.moves[list.0 as usize]
    }

    /// Remembers moves with the questions that led to them, and tells them so; `None` if the
    /// location vector is unsuited.
    pub(super) fn remember(
        &mut self,
        vector: VectorId,
        record: Record,
        moves: &mut Moves,
    ) -> Option<MoveListId> {
        let (root, count) = match self.known[vector.0 as usize] {
            Knowledge::Met => (None, 0),
            Knowledge::Tree(root, count) => (Some(root), count),
            Knowledge::Unsuited => return None,
        };
        if record.is_unsuited || count == MOST_LISTS || self.bytes > MOST_BYTES {
            self.known[vector.0 as usize] = Knowledge::Unsuited;
            return None;
        }
        let list = MoveListId(self.moves.len() as u32);
        self.bytes += moves.heap_bytes() + size_of::<Moves>();
        moves.list = Some(list);
        self.moves.push(moves.clone());
        let root = self.graft(root, record, Point::Moves(list));
        self.known[vector.0 as usize] = Knowledge::Tree(root, count + 1);
        Some(list)
    }

    /// Adds to a tree the branch on which the questions have the recorded answers; returns the
    /// root.
    fn graft(&mut self, root: Option<Point>, record: Record, leaf: Point) -> Point {
        let mut way = root;
        let mut parent: Option<(u32, i32)> = None;
        let mut first = root;
        for (function, arguments, answer) in record.asked {
            let question = if let Some(Point::Ask(question)) = way {
                question
            } else {
                self.bytes += size_of::<Question>()
                    + block_bytes(size_of_val(&*arguments))
                    + block_bytes(USUAL_ANSWERS * size_of::<(i32, Point)>());
                self.questions.push(Question {
                    function,
                    arguments,
                    answers: Vec::with_capacity(USUAL_ANSWERS),
                });
                let question = self.questions.len() as u32 - 1;
                self.attach(parent, &mut first, Point::Ask(question));
                question
            };
            way = self.after(question, answer);
            parent = Some((question, answer));
        }
        self.attach(parent, &mut first, leaf);
        first.unwrap_or(leaf)
    }

    fn attach(&mut self, parent: Option<(u32, i32)>, first: &mut Option<Point>, point: Point) {
        match parent {
            Some((question, answer)) => self.questions[question as usize]
                .answers
                .push((answer, point)),
            None => *first = Some(point),
        }
    }
}

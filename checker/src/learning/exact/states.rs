//! States, each stored once, by the words of theirs that count.
//!
//! Invariants:
//! * Two states have the same number exactly if all that counts is equal: words, and where they
//!   matter the time, the moves made, and whether the controller is being asked.
//! * A word counts if it makes a difference to what may happen or to how the value grows
//!   ([`Influence`]), and may still be read ([`LiveVariables`]). All others have their initial
//!   values in the state that stands for all that are the same.

use std::hash::{BuildHasher as _, Hash as _, Hasher as _};

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;

use crate::analysis::{Influence, LiveVariables};
use crate::exec::arithmetic::{double_of_words, double_words};
use crate::ir::{Network, Observation, Optimum, RunLimit, STREAM_WORDS, Seen, Shape};
use crate::learning::whole_state::functions;
use crate::stochastic::Stage;

/// What of a state counts.
pub(super) struct Counting<'n> {
    network: &'n Network,
    words: Vec<u32>,
    live: Option<LiveVariables>,
    /// What keeps its value also where nothing reads it.
    kept: Vec<u32>,
    has_time: bool,
    has_moves: bool,
    scratch: Vec<i32>,
}

impl<'n> Counting<'n> {
    /// What counts for a query, and for a strategy that sees this. `is_refined` says that it is
    /// within another strategy, which may look at everything.
    pub(super) fn new(
        network: &'n Network,
        asked: &Optimum,
        seen: &Observation,
        kept: &[u32],
        is_refined: bool,
    ) -> Counting<'n> {
        let mut functions = functions(asked);
        let features = || seen.discrete.iter().chain(&seen.continuous);
        functions.extend(features().filter_map(|one| match one.seen {
            Seen::Computed(function) => Some(function),
            _ => None,
        }));
        let influence = Influence::new(network, functions.iter().copied(), asked.aim.number());
        let mut kept = kept.to_vec();
        if let RunLimit::Clock(clock) = asked.bound.limit {
            kept.extend([clock, clock + 1]);
        }
        let chances = &network.chances;
        let mut hidden = vec![false; network.layout.words as usize];
        let doubles = [chances.result, chances.ahead, chances.signature];
        let rates = chances.clocks.iter().map(|clock| clock + 2);
        for word in doubles.into_iter().chain(rates) {
            hidden[word as usize..word as usize + 2].fill(true);
        }
        hidden[chances.stream as usize..][..STREAM_WORDS].fill(true);
        let seconds = second_words(network);
        let counts = |&word: &u32| {
            let differs =
                influence.differs(word) || seconds[word as usize] && influence.differs(word - 1);
            let is_location = (word as usize) < network.processes.len();
            let counts = differs || is_location || is_refined || kept.contains(&word);
            counts && !hidden[word as usize]
        };
        let words = (0..network.layout.words).filter(counts).collect();
        let live = if is_refined {
            None
        } else {
            LiveVariables::new(
                network,
                functions.into_iter().chain(asked.aim.number()),
                false,
            )
        };
        Counting {
            network,
            words,
            live,
            kept,
            has_time: asked.bound.limit == RunLimit::Time,
            has_moves: asked.bound.limit == RunLimit::Moves,
            scratch: Vec::new(),
        }
    }

    /// Of these words, whether each may still be read in a state.
    pub(super) fn are_live(&mut self, words: &[i32], asked: &[u32], live: &mut Vec<bool>) {
        live.clear();
        let Some(analysis) = &self.live else {
            live.resize(asked.len(), true);
            return;
        };
        self.scratch.clear();
        self.scratch.extend_from_slice(words);
        for &word in asked {
            let initial = self.network.initial[word as usize];
            self.scratch[word as usize] = initial.wrapping_add(1);
        }
        analysis.forget(&mut self.scratch);
        live.extend(asked.iter().map(|&word| {
            let initial = self.network.initial[word as usize];
            self.scratch[word as usize] != initial
        }));
    }

    /// Writes what counts of a state.
    fn write(&mut self, words: &[i32], stage: Stage, key: &mut Vec<i32>) {
        self.scratch.clear();
        self.scratch.extend_from_slice(words);
        if let Some(live) = &self.live {
            live.forget(&mut self.scratch);
            for &word in &self.kept {
                self.scratch[word as usize] = words[word as usize];
            }
        }
        key.clear();
        key.extend(self.words.iter().map(|&word| self.scratch[word as usize]));
        if self.has_time {
            key.extend(double_words(stage.time));
        }
        if self.has_moves {
            key.extend([stage.moves as i32, (stage.moves >> 32) as i32]);
        }
        key.push(i32::from(stage.is_asked));
    }

    /// Makes the state that a key stands for.
    pub(super) fn read(&self, key: &[i32], words: &mut Vec<i32>) -> Stage {
        words.clear();
        words.extend_from_slice(&self.network.initial);
        let (of_words, mut rest) = key.split_at(self.words.len());
        for (&word, &value) in self.words.iter().zip(of_words) {
            words[word as usize] = value;
        }
        let mut stage = Stage::default();
        if self.has_time {
            stage.time = double_of_words(rest[0], rest[1]);
            rest = &rest[2..];
        }
        if self.has_moves {
            stage.moves = u64::from(rest[0] as u32) | u64::from(rest[1] as u32) << 32;
            rest = &rest[2..];
        }
        stage.is_asked = rest[0] != 0;
        stage
    }

    fn width(&self) -> usize {
        self.words.len() + 2 * (usize::from(self.has_time) + usize::from(self.has_moves)) + 1
    }
}

/// By word: whether it is the second one of a clock or a double.
fn second_words(network: &Network) -> Vec<bool> {
    let mut seconds = vec![false; network.layout.words as usize];
    for variable in &network.layout.variables {
        find_seconds(network, variable.offset, &variable.shape, &mut seconds);
    }
    for &clock in &network.chances.clocks {
        seconds[clock as usize + 1] = true;
    }
    seconds
}

fn find_seconds(network: &Network, offset: u32, shape: &Shape, seconds: &mut [bool]) {
    if network.chances.clocks.binary_search(&offset).is_ok() {
        return;
    }
    match shape {
        Shape::Integer { .. } | Shape::Bool | Shape::Scalar { .. } => {}
        Shape::Double => seconds[offset as usize + 1] = true,
        Shape::Array { part, length, .. } => {
            for place in 0..*length {
                find_seconds(network, offset + place * part.words(), part, seconds);
            }
        }
        Shape::Struct(fields) => {
            let mut offset = offset;
            for (_, field) in fields {
                find_seconds(network, offset, field, seconds);
                offset += field.words();
            }
        }
    }
}

/// The states that were found.
pub(super) struct States<'n> {
    pub(super) counting: Counting<'n>,
    table: HashTable<u32>,
    keys: Vec<i32>,
    count: u32,
    key: Vec<i32>,
}

impl<'n> States<'n> {
    pub(super) fn new(counting: Counting<'n>) -> States<'n> {
        States {
            counting,
            table: HashTable::new(),
            keys: Vec::new(),
            count: 0,
            key: Vec::new(),
        }
    }

    pub(super) fn len(&self) -> u32 {
        self.count
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> u64 {
        (self.keys.capacity() * 4 + self.table.capacity() * 5) as u64
    }

    /// The number of a state, new or not.
    pub(super) fn intern(&mut self, words: &[i32], stage: Stage) -> u32 {
        let mut key = std::mem::take(&mut self.key);
        self.counting.write(words, stage, &mut key);
        let width = self.counting.width();
        let of = |keys: &[i32], one: u32| hash(&keys[one as usize * width..][..width]);
        let hash = hash(&key);
        let is_it = |&one: &u32| self.keys[one as usize * width..][..width] == key[..];
        let known = self.table.find(hash, is_it).copied();
        let number = known.unwrap_or_else(|| {
            let number = self.count;
            self.keys.extend_from_slice(&key);
            let keys = &self.keys;
            self.table.insert_unique(hash, number, |&one| of(keys, one));
            self.count += 1;
            number
        });
        self.key = key;
        number
    }

    /// Makes the state with a number.
    pub(super) fn load(&self, number: u32, words: &mut Vec<i32>) -> Stage {
        let width = self.counting.width();
        self.counting
            .read(&self.keys[number as usize * width..][..width], words)
    }
}

fn hash(key: &[i32]) -> u64 {
    let mut hasher = FxBuildHasher.build_hasher();
    i32::hash_slice(key, &mut hasher);
    hasher.finish()
}

//! Live variables: those whose values may still be read.
//!
//! A variable is live in a location of a process if the process may read it on some way from there
//! before it has surely written it. Where it is live in no process, its value makes no difference:
//! what is possible in one of two states that differ only in such values is possible in the other,
//! and leads to states that differ only in such values again. So a search may set them all to what
//! they are in the initial state ([`LiveVariables::forget`]), and finds the states together that
//! differ in nothing else.
//!
//! An edge also writes a variable if every process that can take part in its synchronisation writes
//! it: the sender before the receivers read, the one receiver after the sender. What a query reads
//! is live everywhere, and so is what is read around every transition.

use std::ops::Range;

use crate::ir::{Edge, FunctionId, Network, Process, Shape};

use super::function_reads::read_words;
use super::read_before_write::{Exposure, Exposures, WordSet};

/// Larger variables are ignored, because they are hardly ever written as a whole.
const MOST_WORDS_OF_VARIABLE: u32 = 64;
/// The greatest number of words that are tracked.
const MOST_WORDS: usize = 4096;
/// Nothing is found out where it takes more bits than this: one for each word and function or
/// location.
const MOST_BITS: usize = 1 << 28;

/// Which variables are live where, of those that are not so everywhere.
#[derive(Clone, Debug)]
pub struct LiveVariables {
    /// The words that are dead somewhere, ascending, each with what it is set to there.
    words: Vec<(u32, i32)>,
    /// The processes that may read one of them.
    readers: Vec<WordReader>,
}

/// A process that reads some of the words.
#[derive(Clone, Debug)]
struct WordReader {
    process: u32,
    /// For each location: the words that are live there, as bits of as many integers as all of them
    /// need.
    live: Vec<u64>,
}

impl LiveVariables {
    /// Those of a network if `functions` are what a query reads words by, and scalars keep their
    /// values if `keeps_scalars`. `None` if no variable is ever dead.
    pub fn new(
        network: &Network,
        functions: impl IntoIterator<Item = FunctionId>,
        keeps_scalars: bool,
    ) -> Option<LiveVariables> {
        let looked_at = tracked_words(network, functions, keeps_scalars)?;
        let mut numbers = vec![None; network.layout.words as usize];
        for (number, &word) in looked_at.iter().enumerate() {
            numbers[word as usize] = Some(number as u32);
        }
        let mut analysis = LiveSearch {
            exposures: Exposures::new(network, &numbers, looked_at.len()),
            count: looked_at.len(),
            senders: vec![WordSet::full(looked_at.len()); network.channels.len()],
            receivers: vec![WordSet::full(looked_at.len()); network.channels.len()],
            network,
        };
        analysis.find_partner_writes();
        let live: Vec<Vec<WordSet>> = network
            .processes
            .iter()
            .map(|process| analysis.live_in(process))
            .collect();
        let is_dead_somewhere = |number: &usize| {
            let mut processes = live.iter();
            processes.all(|locations| locations.iter().any(|live| !live.contains(*number)))
        };
        let kept: Vec<usize> = (0..looked_at.len()).filter(is_dead_somewhere).collect();
        let with_value = |&number: &usize| {
            let word = looked_at[number];
            (word, network.initial[word as usize])
        };
        let readers = live.iter().enumerate().filter_map(|(process, locations)| {
            let bits: Vec<u64> = locations
                .iter()
                .flat_map(|live| bits_of(live, &kept))
                .collect();
            let reads_any = bits.iter().any(|&bits| bits != 0);
            reads_any.then_some(WordReader {
                process: process as u32,
                live: bits,
            })
        });
        (!kept.is_empty()).then(|| LiveVariables {
            words: kept.iter().map(with_value).collect(),
            readers: readers.collect(),
        })
    }

    /// Those of these words that are dead somewhere, and in how many locations of all processes any
    /// of them is live. They are set to their initial values while no process is in one of these
    /// locations.
    pub fn dead_somewhere(&self, words: Range<u32>) -> (usize, usize) {
        let place = |word| self.words.partition_point(|one| one.0 < word);
        let (first, end) = (place(words.start), place(words.end));
        if first == end {
            return (0, 0);
        }
        let width = self.words.len().div_ceil(64);
        let masks = (first / 64..=(end - 1) / 64).map(|chunk| {
            let bits = first.max(64 * chunk)..end.min(64 * chunk + 64);
            (chunk, bits.fold(0, |mask, bit| mask | 1_u64 << (bit % 64)))
        });
        let masks: Vec<(usize, u64)> = masks.collect();
        let locations = self.readers.iter().flat_map(|one| one.live.chunks(width));
        let live =
            locations.filter(|live| masks.iter().any(|&(chunk, mask)| live[chunk] & mask != 0));
        (end - first, live.count())
    }

    /// Whether a word is dead in a state.
    pub fn is_dead(&self, words: &[i32], word: u32) -> bool {
        let Ok(place) = self.words.binary_search_by_key(&word, |one| one.0) else {
            return false;
        };
        let width = self.words.len().div_ceil(64);
        let is_live = |reader: &WordReader| {
            let location = words[reader.process as usize] as usize;
            reader.live[location * width + place / 64] & 1 << (place % 64) != 0
        };
        !self.readers.iter().any(is_live)
    }

    /// Sets what is dead in a state to its initial value.
    pub fn forget(&self, words: &mut [i32]) {
        let chunks = self.words.chunks(64);
        let width = chunks.len();
        for (index, chunk) in chunks.enumerate() {
            let mut live = 0;
            for reader in &self.readers {
                let location = words[reader.process as usize] as usize;
                live |= reader.live[location * width + index];
            }
            for (bit, &(word, value)) in chunk.iter().enumerate() {
                if live & 1 << bit == 0 {
                    words[word as usize] = value;
                }
            }
        }
    }
}

/// Whether each of the words with these numbers is live, as bits.
fn bits_of(live: &WordSet, numbers: &[usize]) -> Vec<u64> {
    let chunks = numbers.chunks(64).map(|chunk| {
        let bits = chunk.iter().enumerate();
        bits.fold(0, |all, (bit, &number)| {
            all | u64::from(live.contains(number)) << bit
        })
    });
    chunks.collect()
}

/// The words that are worth looking at, ascending: they are written, and nothing reads them in
/// every state.
fn tracked_words(
    network: &Network,
    functions: impl IntoIterator<Item = FunctionId>,
    keeps_scalars: bool,
) -> Option<Vec<u32>> {
    let around = [&network.before_update, &network.after_update].into_iter();
    let around = around.flatten().filter_map(|update| update.function);
    let always = read_words(
        network,
        functions.into_iter().chain(around),
        network.layout.words as usize,
    )?;
    let written = network.written_words();
    // In random runs `meta` variables are as any others.
    let is_stochastic = !network.chances.clocks.is_empty() || network.chances.stream > 0;
    let variables = network.layout.variables.iter().filter(|variable| {
        let keeps = keeps_scalars && has_scalars(&variable.shape);
        (is_stochastic || !variable.meta)
            && !keeps
            && variable.shape.words() <= MOST_WORDS_OF_VARIABLE
    });
    let words = variables.flat_map(|variable| {
        let first = variable.offset;
        first..first + variable.shape.words()
    });
    let mut words: Vec<u32> = words
        .filter(|word| written[*word as usize] && always.binary_search(word).is_err())
        .collect();
    words.sort_unstable();
    words.truncate(MOST_WORDS);
    let locations = network.processes.iter().map(|one| one.locations.len());
    let sets = network.functions.len() + network.channels.len() + locations.sum::<usize>();
    let is_feasible = sets.saturating_mul(words.len()) <= MOST_BITS;
    (is_feasible && !words.is_empty()).then_some(words)
}

fn has_scalars(shape: &Shape) -> bool {
    match shape {
        Shape::Integer { .. } | Shape::Bool | Shape::Double => false,
        Shape::Scalar { .. } => true,
        Shape::Array { part, .. } => has_scalars(part),
        Shape::Struct(fields) => fields.iter().any(|(_, shape)| has_scalars(shape)),
    }
}

struct LiveSearch<'n> {
    network: &'n Network,
    exposures: Exposures<'n>,
    count: usize,
    /// For each channel: what all senders certainly write; without any, everything.
    senders: Vec<WordSet>,
    /// For each channel: what all receivers certainly write.
    receivers: Vec<WordSet>,
}

impl LiveSearch<'_> {
    /// Finds what those surely write that synchronise on a channel.
    fn find_partner_writes(&mut self) {
        let network = self.network;
        for edge in network.edges() {
            let Some(sync) = edge.sync.filter(|_| !edge.guard.never_holds) else {
                continue;
            };
            let mut writes = WordSet::full(self.count);
            for branch in 0..edge.branches.len() {
                writes.intersect(&self.updates(edge, branch).writes);
            }
            let side = if sync.send {
                &mut self.senders
            } else {
                &mut self.receivers
            };
            for channel in sync.channels() {
                side[channel as usize].intersect(&writes);
            }
        }
    }

    /// What the updates of an edge do that ends in this branch.
    fn updates(&mut self, edge: &Edge, branch: usize) -> Exposure {
        let entry = self.exposures.of(edge.update.function);
        let leg = self.exposures.of(edge.branches[branch].update.function);
        entry.then(&leg)
    }

    /// What partners surely write before the updates of an edge run, and after them.
    fn partners(&self, edge: &Edge) -> (WordSet, WordSet) {
        let mut before = WordSet::empty(self.count);
        let mut after = before.clone();
        let Some(sync) = edge.sync else {
            return (before, after);
        };
        let channels = &self.network.channels;
        let is_broadcast = sync
            .channels()
            .any(|channel| channels[channel as usize].broadcast);
        let (side, written) = if sync.send {
            (&self.receivers, &mut after)
        } else {
            (&self.senders, &mut before)
        };
        // A broadcast needs no receiver.
        if !(sync.send && is_broadcast) {
            *written = WordSet::full(self.count);
            for channel in sync.channels() {
                written.intersect(&side[channel as usize]);
            }
        }
        (before, after)
    }

    /// For each location of a process: what it may read from there on before it is certainly
    /// written.
    fn live_in(&mut self, process: &Process) -> Vec<WordSet> {
        let mut live: Vec<WordSet> = process
            .locations
            .iter()
            .map(|location| {
                let rates = location.rates.iter().map(|&(_, function)| Some(function));
                let chances = &location.chances;
                let chances = [chances.exponential_rate, chances.rates];
                self.reads(rates.chain(chances).chain([location.invariant.function]))
            })
            .collect();
        // For each edge and branch: the source, the target, and what is certainly written by it.
        let mut ways = Vec::new();
        for edge in process.edges.iter().filter(|edge| !edge.guard.never_holds) {
            let source = edge.source.0 as usize;
            let index = edge.sync.and_then(|sync| sync.index);
            live[source].unite(&self.reads([edge.guard.function, index]));
            let (before, after) = self.partners(edge);
            for (branch, leg) in edge.branches.iter().enumerate() {
                live[source].unite(&self.reads([leg.weight]));
                let Exposure {
                    mut reads,
                    mut writes,
                } = self.updates(edge, branch);
                reads.subtract(&before);
                live[source].unite(&reads);
                writes.unite(&before);
                writes.unite(&after);
                ways.push((source, leg.target.0 as usize, writes));
            }
        }
        let mut grows = true;
        while grows {
            grows = false;
            for (source, target, writes) in ways.iter().rev() {
                let mut further = live[*target].clone();
                further.subtract(writes);
                grows |= live[*source].unite(&further);
            }
        }
        live
    }

    fn reads(&mut self, functions: impl IntoIterator<Item = Option<FunctionId>>) -> WordSet {
        let mut reads = WordSet::empty(self.count);
        for function in functions {
            reads.unite(&self.exposures.of(function).reads);
        }
        reads
    }
}

//! What changes places when two members of a scalar set are exchanged.
//!
//! A set is left out in three cases: the model distinguishes its members
//! ([`crate::ir::ScalarSet::told_apart_by`]); words that nothing writes distinguish them; or the
//! receivers of a broadcast run updates whose order matters. These run in the order of processes,
//! which exchanging members would change.
//!
//! Invariant: every exchange is its own inverse, and it exchanges only words of the same range.

use std::sync::Arc;

use crate::diagnostics::Span;
use crate::ir::{Coordinate, Network, Shape};

use super::ordered_receivers::has_ordered_receivers;
use super::symmetry::{Exchange, Members, Swap, Symmetry};

/// The greatest number of members of a set that is reduced: all pairs of them are tried.
const MOST_MEMBERS: u32 = 64;

impl Symmetry {
    /// The exchanges of members that do not change the behaviour of a network; `None` if there are
    /// none.
    pub fn of_network(network: &Network) -> Option<Arc<Symmetry>> {
        let places = Places::new(network);
        let mut symmetry = Symmetry::none(network);
        for number in 0..network.scalar_sets.len() as u32 {
            if let Ok((members, swaps)) = symmetry.exchanges_of(&places, number) {
                symmetry.sets.push(members);
                symmetry.swaps.extend(swaps);
            }
        }
        (!symmetry.sets.is_empty()).then(|| Arc::new(symmetry))
    }

    /// For each scalar set: why it is not reduced, if it is not.
    pub fn obstacles(network: &Network) -> Vec<Option<Obstacle>> {
        let places = Places::new(network);
        let none = Symmetry::none(network);
        let sets = 0..network.scalar_sets.len() as u32;
        sets.map(|number| none.exchanges_of(&places, number).err())
            .collect()
    }

    /// The exchanges of the members of a set; they come after the existing ones.
    fn exchanges_of(
        &self,
        places: &Places<'_>,
        number: u32,
    ) -> Result<(Members, Vec<Swap>), Obstacle> {
        let set = &places.network.scalar_sets[number as usize];
        if let Some(span) = set.told_apart_by {
            return Err(Obstacle::ToldApart(span));
        }
        if set.size < 2 {
            return Err(Obstacle::OneMember);
        }
        if set.size > MOST_MEMBERS {
            return Err(Obstacle::ManyMembers(MOST_MEMBERS));
        }
        if has_ordered_receivers(places.network, number) {
            return Err(Obstacle::OrderedReceivers);
        }
        let members = Members {
            set: number,
            count: set.size,
            first: self.sets.iter().map(|set| set.count as usize).sum(),
            first_swap: self.swaps.len(),
        };
        let pairs = (0..set.size).flat_map(|first| {
            (first + 1..set.size).map(move |second| MemberPair {
                set: number,
                first,
                second,
            })
        });
        let swaps: Option<Vec<Swap>> = pairs
            .map(|pair| places.swap(self.sets.len(), pair))
            .collect();
        let swaps = swaps.ok_or(Obstacle::FirstValues)?;
        let moves = |swap: &Swap| !(swap.words.is_empty() && swap.clock_pairs.is_empty());
        if !swaps.iter().any(moves) {
            return Err(Obstacle::Unused);
        }
        Ok((members, swaps))
    }
}

/// Why members of a scalar set are not exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// This distinguishes them.
    ToldApart(Span),
    /// There is only one.
    OneMember,
    /// There are more than this number.
    ManyMembers(u32),
    /// Receivers of a broadcast run updates whose order matters.
    OrderedReceivers,
    /// Processes or values that never change differ.
    FirstValues,
    /// Nothing in a state depends on them.
    Unused,
}

/// Two members of a scalar set that are exchanged, the smaller one first.
#[derive(Clone, Copy, Debug)]
struct MemberPair {
    set: u32,
    first: u32,
    second: u32,
}

impl MemberPair {
    /// The place to which something with these coordinates moves.
    fn moved(self, place: u32, coordinates: &[Coordinate]) -> u32 {
        let MemberPair { set, first, second } = self;
        let own = coordinates.iter().filter(|one| one.set == set);
        own.fold(place, |place, one| match one.member {
            member if member == first => place + (second - first) * one.stride,
            member if member == second => place - (second - first) * one.stride,
            _ => place,
        })
    }
}

/// A word as an exchange sees it.
#[derive(Clone, Debug)]
struct Word {
    /// Its process, if it is local to one, and its number among the words of the process.
    local: Option<(usize, usize)>,
    coordinates: Vec<Coordinate>,
    /// The set whose members are its values.
    values: Option<u32>,
}

/// The words and clocks of a network by their process.
struct Places<'n> {
    network: &'n Network,
    words: Vec<Word>,
    /// For each process: its words and its clocks, in order.
    of_process: Vec<(Vec<u32>, Vec<u32>)>,
    /// For each clock: its number among those of its process.
    numbers: Vec<usize>,
    written: Vec<bool>,
}

impl<'n> Places<'n> {
    fn new(network: &'n Network) -> Places<'n> {
        let mut of_process = vec![(Vec::new(), Vec::new()); network.processes.len()];
        let mut words: Vec<Word> = (0..network.processes.len())
            .map(|process| {
                of_process[process].0.push(process as u32);
                Word {
                    local: Some((process, 0)),
                    coordinates: Vec::new(),
                    values: None,
                }
            })
            .collect();
        for variable in &network.layout.variables {
            let before = words.len();
            add_words(&variable.shape, &mut Vec::new(), &mut words);
            let Some(owner) = variable.owner else {
                continue;
            };
            let own = &mut of_process[owner.0 as usize].0;
            for (index, word) in words.iter_mut().enumerate().skip(before) {
                word.local = Some((owner.0 as usize, own.len()));
                own.push(index as u32);
            }
        }
        let mut numbers = vec![0; network.clocks.len()];
        for (index, clock) in network.clocks.iter().enumerate() {
            if let Some(owner) = clock.owner {
                let own = &mut of_process[owner.0 as usize].1;
                numbers[index] = own.len();
                own.push(index as u32);
            }
        }
        Places {
            network,
            words,
            of_process,
            numbers,
            written: network.written_words(),
        }
    }

    /// The exchange of two members; their set has this number among those that are reduced. `None`
    /// if the network does not allow it.
    fn swap(&self, number: usize, pair: MemberPair) -> Option<Swap> {
        let mut swap = Swap {
            set: number,
            members: (pair.first as i32, pair.second as i32),
            words: Vec::new(),
            identity_words: 0,
            clocks: Vec::new(),
            clock_pairs: Vec::new(),
        };
        let identity_words = self.network.layout.identity_words;
        for (index, word) in (0..).zip(&self.words) {
            let source = self.image_of_word(index, pair)?;
            let is_member = word.values == Some(pair.set);
            let exchange = Exchange {
                word: index,
                source,
                is_member,
            };
            if source != index || is_member {
                self.is_movable(exchange, pair).then_some(())?;
                swap.words.push(exchange);
                swap.identity_words += usize::from(index < identity_words);
            }
        }
        for clock in 0..self.network.clocks.len() as u32 {
            let image = self.image_of_clock(clock, pair)?;
            swap.clocks.push(image);
            if clock < image {
                swap.clock_pairs.push((clock, image));
            }
        }
        Some(swap)
    }

    /// Whether a word may get another value: something writes it, or the new value is the same.
    fn is_movable(&self, exchange: Exchange, pair: MemberPair) -> bool {
        let (word, source) = (exchange.word as usize, exchange.source as usize);
        let initial = &self.network.initial;
        let value = match initial[source] {
            value if exchange.is_member && value == pair.first as i32 => pair.second as i32,
            value if exchange.is_member && value == pair.second as i32 => pair.first as i32,
            value => value,
        };
        self.written[word] == self.written[source] && (self.written[word] || initial[word] == value)
    }

    fn image_of_process(&self, process: usize, pair: MemberPair) -> Option<usize> {
        let one = &self.network.processes[process];
        let image = pair.moved(process as u32, &one.coordinates) as usize;
        let other = &self.network.processes[image];
        let is_alike = one.locations.len() == other.locations.len()
            && one.edges.len() == other.edges.len()
            && one.priority == other.priority
            && self.of_process[process].0.len() == self.of_process[image].0.len()
            && self.of_process[process].1.len() == self.of_process[image].1.len();
        is_alike.then_some(image)
    }

    fn image_of_word(&self, index: u32, pair: MemberPair) -> Option<u32> {
        let word = &self.words[index as usize];
        let index = pair.moved(index, &word.coordinates);
        let Some((process, _)) = word.local else {
            return Some(index);
        };
        let image = self.image_of_process(process, pair)?;
        let (_, number) = self.words[index as usize].local?;
        Some(self.of_process[image].0[number])
    }

    fn image_of_clock(&self, index: u32, pair: MemberPair) -> Option<u32> {
        let clock = &self.network.clocks[index as usize];
        let index = pair.moved(index, &clock.coordinates);
        let Some(owner) = clock.owner else {
            return Some(index);
        };
        let image = self.image_of_process(owner.0 as usize, pair)?;
        Some(self.of_process[image].1[self.numbers[index as usize]])
    }
}

/// Adds the words of a value, with their coordinates within it.
fn add_words(shape: &Shape, coordinates: &mut Vec<Coordinate>, words: &mut Vec<Word>) {
    let mut add = |values| {
        words.push(Word {
            local: None,
            coordinates: coordinates.clone(),
            values,
        });
    };
    match shape {
        Shape::Integer { .. } | Shape::Bool => add(None),
        Shape::Scalar { set, .. } => add(Some(*set)),
        Shape::Double => {
            add(None);
            add(None);
        }
        Shape::Array {
            part, length, set, ..
        } => {
            for member in 0..*length {
                coordinates.extend(set.map(|set| Coordinate {
                    set,
                    member,
                    stride: part.words(),
                }));
                add_words(part, coordinates, words);
                if set.is_some() {
                    coordinates.pop();
                }
            }
        }
        Shape::Struct(fields) => {
            for (_, shape) in fields {
                add_words(shape, coordinates, words);
            }
        }
    }
}

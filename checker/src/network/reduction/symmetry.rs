//! Symmetry reduction: among states that differ only by an exchange of members of a scalar set, a
//! search needs to see only one.
//!
//! Exchange two members of a scalar set everywhere: in values, in arrays that the set indexes,
//! among processes that stand for one member each, and in their clocks. This turns runs into runs,
//! and does not change whether a predicate holds: neither models nor queries can name a member. So
//! a search may replace every state by another state of its orbit. If s is the start and
//! p a permutation, everything that is reachable from p(s) is p applied to what is reachable from
//! s. So the initial state need not treat all members in the same way. Members *can* be
//! distinguished in some models; this is found when the model is loaded ([`crate::ir::ScalarSet`])
//! or here (`network/reduction/scalar_swaps.rs`), and such sets are not reduced.
//!
//! [`Symmetry::normalise`] exchanges members as long as that makes the state smaller in a total
//! order: the words one after the other, then the bounds of each clock against 0, then those of
//! differences. The result is the least among all states that differ from it by one exchange. An
//! orbit may have several such states. Every exchange is an element of the group, so this can only
//! cost more states; it is always sound.
//!
//! Source: M. Hendriks, G. Behrmann, K. G. Larsen, P. Niebert, F. Vaandrager, "Adding Symmetry
//! Reduction to UPPAAL", FORMATS 2003 (state swaps and their soundness). There, the order of resets
//! decides between clocks; here, the order of bounds.
//!
//! Cost: a few comparisons for each pair of members that words distinguish, and up to four rows of
//! the zone for every other pair.

use crate::ir::Network;
use crate::zones::Bound;

use crate::network::{MoveRef, Moves, Part};

/// The exchanges of members that do not change the behaviour of a network.
#[derive(Debug)]
pub struct Symmetry {
    /// The members of each set.
    pub(super) sets: Vec<Members>,
    /// The exchanges of two members: for each set, those of the first member come first.
    pub(super) swaps: Vec<Swap>,
    pub(super) dimension: usize,
}

/// The members of a set that may be exchanged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Members {
    /// The number of the set in the network.
    pub(super) set: u32,
    /// How many there are.
    pub(super) count: u32,
    /// Where a [`Permutation`] has the images of its members.
    pub(super) first: usize,
    /// Where its exchanges begin.
    pub(super) first_swap: usize,
}

/// The exchange of two members of a set.
#[derive(Clone, Debug)]
pub(super) struct Swap {
    /// The index of the set among those of the symmetry.
    pub(super) set: usize,
    /// The two members, the lesser first.
    pub(super) members: (i32, i32),
    /// The words that change, in ascending order.
    pub(super) words: Vec<Exchange>,
    /// How many of them belong to the identity of a state.
    pub(super) identity_words: usize,
    /// For each clock: the clock with which it changes places.
    pub(super) clocks: Vec<u32>,
    /// The pairs of clocks that change places, the smaller one first, in ascending order.
    pub(super) clock_pairs: Vec<(u32, u32)>,
}

/// Where a word comes from in an exchange of two members.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exchange {
    pub(super) word: u32,
    pub(super) source: u32,
    /// Whether its values are members of the set.
    pub(super) is_member: bool,
}

/// The image of each member of each set.
#[derive(Clone, Debug)]
pub struct Permutation(Box<[u32]>);

impl Members {
    fn range(self) -> std::ops::Range<usize> {
        self.first..self.first + self.count as usize
    }
}

impl Swap {
    fn image(&self, member: i32) -> i32 {
        let (first, second) = self.members;
        if member == first {
            second
        } else if member == second {
            first
        } else {
            member
        }
    }

    fn value(&self, exchange: Exchange, words: &[i32]) -> i32 {
        let value = words[exchange.source as usize];
        if exchange.is_member {
            self.image(value)
        } else {
            value
        }
    }

    /// Whether the exchange makes a state smaller.
    fn improves(&self, words: &[i32], zone: &[Bound], dimension: usize) -> bool {
        for &exchange in &self.words[..self.identity_words] {
            // The greater of two words that change places differs only if the smaller does.
            if exchange.source >= exchange.word {
                let (new, old) = (self.value(exchange, words), words[exchange.word as usize]);
                if new != old {
                    return new < old;
                }
            }
        }
        for &(clock, other) in &self.clock_pairs {
            let (clock, other) = (clock as usize, other as usize);
            let upper = (zone[other * dimension], zone[clock * dimension]);
            let lower = (zone[other], zone[clock]);
            if upper.0 != upper.1 {
                return upper.0 < upper.1;
            }
            if lower.0 != lower.1 {
                return lower.0 < lower.1;
            }
        }
        self.improves_differences(zone, dimension)
    }

    fn improves_differences(&self, zone: &[Bound], dimension: usize) -> bool {
        if self.clock_pairs.is_empty() {
            return false;
        }
        for row in 1..dimension {
            let source = self.clocks[row] as usize;
            let old = &zone[row * dimension..][..dimension];
            let new = &zone[source * dimension..][..dimension];
            if source == row {
                for &(clock, other) in &self.clock_pairs {
                    let (new, old) = (old[other as usize], old[clock as usize]);
                    if new != old {
                        return new < old;
                    }
                }
            } else {
                for (column, &old) in old.iter().enumerate() {
                    let new = new[self.clocks[column] as usize];
                    if new != old {
                        return new < old;
                    }
                }
            }
        }
        false
    }

    fn apply_to_words(&self, words: &mut [i32]) {
        for &exchange in &self.words {
            let (word, source) = (exchange.word as usize, exchange.source as usize);
            if source >= word {
                words.swap(word, source);
                if exchange.is_member {
                    words[word] = self.image(words[word]);
                    if source != word {
                        words[source] = self.image(words[source]);
                    }
                }
            }
        }
    }

    fn apply_to_zone(&self, zone: &mut [Bound], dimension: usize) {
        for &(clock, other) in &self.clock_pairs {
            let (clock, other) = (clock as usize, other as usize);
            for column in 0..dimension {
                zone.swap(clock * dimension + column, other * dimension + column);
            }
            for row in 0..dimension {
                zone.swap(row * dimension + clock, row * dimension + other);
            }
        }
    }

    fn apply_to_images(&self, images: &mut [u32]) {
        for image in images {
            *image = self.image(*image as i32) as u32;
        }
    }
}

impl Symmetry {
    /// The symmetry that exchanges nothing.
    pub(super) fn none(network: &Network) -> Symmetry {
        Symmetry {
            sets: Vec::new(),
            swaps: Vec::new(),
            dimension: network.clocks.len().max(1),
        }
    }

    /// The permutation that changes no member.
    pub fn identity(&self) -> Permutation {
        Permutation(self.sets.iter().flat_map(|set| 0..set.count).collect())
    }

    /// Replaces a state by one that differs only by exchanges of members; for most such states the
    /// result is the same. Adds the numbers of these exchanges to `exchanges`.
    pub fn normalise(&self, words: &mut [i32], zone: &mut [Bound], exchanges: &mut Vec<u32>) {
        let mut tried = 0;
        // All exchanges are tried in turn until none has made the state smaller since its last
        // trial.
        for (number, swap) in (0..).zip(&self.swaps).cycle() {
            if tried == self.swaps.len() {
                break;
            }
            tried += 1;
            if swap.improves(words, zone, self.dimension) {
                swap.apply_to_words(words);
                swap.apply_to_zone(zone, self.dimension);
                exchanges.push(number);
                tried = 1;
            }
        }
    }

    /// Applies the exchange with this number to the images of a permutation.
    pub fn exchange(&self, number: usize, permutation: &mut Permutation) {
        let swap = &self.swaps[number];
        let set = self.sets[swap.set];
        swap.apply_to_images(&mut permutation.0[set.range()]);
    }

    /// How many exchanges there are.
    pub fn exchanges(&self) -> usize {
        self.swaps.len()
    }

    /// Permutes the members of all sets in a state.
    pub fn permute(&self, permutation: &Permutation, words: &mut [i32], zone: &mut [Bound]) {
        for set in &self.sets {
            let mut images: Vec<u32> = (0..set.count).collect();
            for member in 0..set.count as usize {
                let (image, wanted) = (images[member], permutation.0[set.first + member]);
                if image != wanted {
                    let swap = &self.swaps[set.swap(image.min(wanted), image.max(wanted))];
                    swap.apply_to_words(words);
                    swap.apply_to_zone(zone, self.dimension);
                    swap.apply_to_images(&mut images);
                }
            }
        }
    }

    /// The move among `moves`, those of a state, that becomes `image` under the permutation.
    pub fn find_original(
        &self,
        permutation: &Permutation,
        network: &Network,
        moves: &Moves,
        image: MoveRef<'_>,
    ) -> Option<usize> {
        let mut wanted = image.parts.to_vec();
        wanted[1..].sort_unstable_by_key(|part| part.process);
        (0..moves.len()).find(|&index| {
            let parts = moves.get(index).parts;
            let mut images: Vec<Part> = parts
                .iter()
                .map(|&part| self.image_of_part(permutation, network, part))
                .collect();
            images[1..].sort_unstable_by_key(|part| part.process);
            images == wanted
        })
    }

    fn image_of_part(&self, permutation: &Permutation, network: &Network, part: Part) -> Part {
        let process = &network.processes[part.process as usize];
        let mut moved = part.process;
        for coordinate in &process.coordinates {
            let image = self.image(permutation, Some(coordinate.set), coordinate.member);
            moved = moved + image * coordinate.stride - coordinate.member * coordinate.stride;
        }
        let mut select = 0;
        let mut rest = part.select;
        let mut stride = 1;
        for binding in process.edges[part.edge as usize].select.iter().rev() {
            let count = binding.high.abs_diff(binding.low) + 1;
            select += stride * self.image(permutation, binding.set, rest % count);
            rest /= count;
            stride *= count;
        }
        Part {
            process: moved,
            select,
            ..part
        }
    }

    fn image(&self, permutation: &Permutation, set: Option<u32>, member: u32) -> u32 {
        let mut sets = self.sets.iter();
        match sets.find(|members| Some(members.set) == set) {
            Some(members) => permutation.0[members.first + member as usize],
            None => member,
        }
    }
}

impl Members {
    /// The exchange of two members, the smaller one first.
    fn swap(self, first: u32, second: u32) -> usize {
        let before = first * (2 * self.count - first - 1) / 2;
        self.first_swap + (before + second - first - 1) as usize
    }
}

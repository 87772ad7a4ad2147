//! What a stored state of a search consists of: what each variable takes, and what is left out.
//!
//! The store says what it stores ([`StateStore::record_size`]), and the analysis of live variables
//! what a search forgets. What a query reads is never forgotten; here no query reads anything.

use crate::ir::Network;
use crate::network::Symmetry;
use crate::search::StateStore;

use super::query::problem;

/// What a stored state consists of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredState {
    /// The location of each process, then the variables, in order of their words, then what
    /// belongs to none of both. Together they have all words of a state.
    pub parts: Vec<StoredPart>,
    /// How many bits fill up the record of a state.
    pub padding_bits: usize,
}

/// The location of a process or a variable, in a stored state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredPart {
    /// What it is.
    pub of: PartOf,
    /// How many words it has.
    pub words: usize,
    /// How many bits all of them take.
    pub stored_bits: usize,
    /// How many of them are not stored, because nothing writes them.
    pub constant_words: usize,
    /// How many of them have their initial value wherever they are not live.
    pub reset_words: usize,
    /// In how many locations of all processes any of these is live.
    pub live_locations: usize,
}

/// What a part of a state is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartOf {
    /// The location of the process with this number.
    Location(usize),
    /// The variable with this number.
    Variable(usize),
    /// The variables that only random runs know, `meta` or not: they have no names in a network.
    LeftOut {
        /// Whether they are `meta`.
        meta: bool,
    },
}

impl StoredState {
    /// That of a network in the symbolic reading.
    pub fn new(network: &Network) -> StoredState {
        let size = StateStore::record_size(network);
        let symmetry = Symmetry::of_network(network);
        let forgotten = problem::forgotten(network, [], symmetry.as_deref());
        let whole = |of, first: u32, words: u32| {
            let forgotten = forgotten.as_ref();
            let (reset_words, live_locations) =
                forgotten.map_or((0, 0), |live| live.dead_somewhere(first..first + words));
            let bits = &size.word_bits[first as usize..(first + words) as usize];
            StoredPart {
                reset_words,
                live_locations,
                ..StoredPart::new(of, bits)
            }
        };
        let layout = &network.layout;
        let locations = 0..network.processes.len();
        let locations = locations.map(|index| whole(PartOf::Location(index), index as u32, 1));
        let variables = layout.variables.iter().enumerate();
        let variables = variables.map(|(index, variable)| {
            let words = variable.shape.words();
            whole(PartOf::Variable(index), variable.offset, words)
        });
        let left_out = left_out_words(network);
        let left_out = [false, true].into_iter().filter_map(|meta| {
            let words = left_out
                .iter()
                .filter(|&&word| (word >= layout.identity_words) == meta);
            let bits: Vec<usize> = words.map(|&word| size.word_bits[word as usize]).collect();
            (!bits.is_empty()).then(|| StoredPart::new(PartOf::LeftOut { meta }, &bits))
        });
        StoredState {
            parts: locations.chain(variables).chain(left_out).collect(),
            padding_bits: size.padding_bits,
        }
    }

    /// How many bits all parts take.
    pub fn stored_bits(&self) -> usize {
        self.parts.iter().map(|part| part.stored_bits).sum()
    }

    /// How many words are not stored, because nothing writes them.
    pub fn constant_words(&self) -> usize {
        self.parts.iter().map(|part| part.constant_words).sum()
    }

    /// How many words a search resets somewhere.
    pub fn reset_words(&self) -> usize {
        self.parts.iter().map(|part| part.reset_words).sum()
    }
}

impl StoredPart {
    /// One whose words take so many bits, if none of them is ever reset.
    fn new(of: PartOf, word_bits: &[usize]) -> StoredPart {
        StoredPart {
            of,
            words: word_bits.len(),
            stored_bits: word_bits.iter().sum(),
            constant_words: word_bits.iter().filter(|&&bits| bits == 0).count(),
            reset_words: 0,
            live_locations: 0,
        }
    }
}

/// The words of variables that only random runs know, ascending: no variable has them.
fn left_out_words(network: &Network) -> Vec<u32> {
    let mut is_known = vec![false; network.layout.words as usize];
    is_known[..network.processes.len()].fill(true);
    for variable in &network.layout.variables {
        let first = variable.offset as usize;
        is_known[first..first + variable.shape.words() as usize].fill(true);
    }
    let words = (0..).zip(is_known);
    words
        .filter_map(|(word, is_known)| (!is_known).then_some(word))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::LoadedModel;

    fn stored(text: &str) -> StoredState {
        let model = LoadedModel::load("model.xta", text).unwrap();
        StoredState::new(model.network())
    }

    fn part(stored: &StoredState, place: usize) -> (usize, usize, usize, usize, usize) {
        let part = &stored.parts[place];
        let (constant, reset) = (part.constant_words, part.reset_words);
        (
            part.words,
            part.stored_bits,
            constant,
            reset,
            part.live_locations,
        )
    }

    #[test]
    fn parts_say_what_is_stored_of_them_and_what_is_reset() {
        let stored = stored(
            "int[0,9] never; int[0,1] some[4]; int[0,300] passed; int32_t unread; meta bool seen;
             process P() {
               state A, B, C; init A;
               trans A -> A { guard seen; },
                     A -> B { assign passed = 7, unread = 1, seen = true; },
                     B -> C { guard passed > 3; assign some[2] = 1; },
                     C -> A { guard some[0] + some[1] + some[2] + some[3] + never < 9; };
             }
             system P;",
        );
        // By part: words, bits, constant words, reset words, and where these are live.
        assert_eq!(part(&stored, 0), (1, 8, 0, 0, 0));
        assert_eq!(part(&stored, 1), (1, 0, 1, 0, 0));
        assert_eq!(part(&stored, 2), (4, 8, 3, 1, 1));
        assert_eq!(part(&stored, 3), (1, 16, 0, 1, 1));
        assert_eq!(part(&stored, 4), (1, 32, 0, 1, 0));
        assert_eq!(part(&stored, 5), (1, 8, 0, 0, 0));
        assert_eq!((stored.stored_bits(), stored.padding_bits), (72, 0));
        assert_eq!((stored.constant_words(), stored.reset_words()), (4, 3));
    }

    #[test]
    fn parts_are_the_whole_state() {
        let model = LoadedModel::load(
            "model.xta",
            "clock x; double last; meta double drawn; int[0,9] n;
             process P() {
               state A; init A;
               trans A -> A { assign last = x, drawn = random(2), n = n < 9 ? n + 1 : 0; };
             }
             system P;",
        );
        let model = model.unwrap();
        let network = model.network();
        let stored = StoredState::new(network);
        let words = stored.parts.iter().map(|part| part.words);
        assert_eq!(words.sum::<usize>(), network.layout.words as usize);
        let bits = StateStore::record_size(network).word_bits;
        assert_eq!(stored.stored_bits(), bits.iter().sum::<usize>());
        let left_out = [false, true].map(|meta| PartOf::LeftOut { meta });
        assert_eq!(
            stored.parts[2..]
                .iter()
                .map(|part| part.of)
                .collect::<Vec<_>>(),
            left_out
        );
    }

    #[test]
    fn scalars_keep_their_values_where_members_are_exchanged() {
        let reset_of_last = |update: &str| {
            let text = format!(
                "typedef scalar[3] id; id last; bool seen[id]; {update}
                 process P(const id me) {{
                   state A, B; init A;
                   trans A -> B {{ assign act(me), seen[me] = true, last = me; }},
                         B -> A {{ guard last == me; }};
                 }}
                 system P;"
            );
            stored(&text).parts[3].reset_words
        };
        assert_eq!(reset_of_last("void act(id i) { last = i; }"), 0);
        // The order in which the loop runs through members tells them apart.
        let told_apart = "void act(id i) { for (j : id) if (seen[j]) last = j; }";
        assert_eq!(reset_of_last(told_apart), 1);
    }
}

//! Discrete states, each stored once.
//!
//! Invariants:
//! * Two states get the same [`DiscreteId`] exactly if their identity words are equal; no hash
//!   stands in for a state.
//! * Words that no update ever writes are not stored: they have their initial value in every state.
//!   `meta` words are stored with the first state of an identity, and are not compared.
//! * Ids count from 0 in the order of first insertion.
//!
//! A word takes one, two or four bytes, as the range of its variable or the number of locations
//! needs. An assignment checks that a value lies in its range; packing checks it again. The bytes
//! of the identity are kept as a row of numbers, that is, as a tree of groups ([`super::rows`]):
//! what states have in common is stored once.

use crate::ir::{Network, Shape};

use super::disk::Cold;
use super::hashing::hash_bytes;
use super::records::Records;
use super::rows::Rows;

/// Why a state is always packed.
const FITS: &str = "every word lies in the range of its variable";

/// Words that are compared at once.
const BLOCK: usize = 16;

/// The index of a stored discrete state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DiscreteId(pub u32);

/// What a word is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Width {
    Byte,
    SignedByte,
    Short,
    SignedShort,
    Whole,
}

impl Width {
    /// The least width for values from `low` to `high`.
    fn of(low: i32, high: i32) -> Width {
        let fits = |least: i32, greatest: i32| least <= low && high <= greatest;
        if fits(0, 0xff) {
            Width::Byte
        } else if fits(-0x80, 0x7f) {
            Width::SignedByte
        } else if fits(0, 0xffff) {
            Width::Short
        } else if fits(-0x8000, 0x7fff) {
            Width::SignedShort
        } else {
            Width::Whole
        }
    }

    /// The bytes of a value, the lowest first, if it fits.
    #[inline]
    fn packed(self, value: i32) -> Option<[u8; 4]> {
        let fits = match self {
            Width::Byte => value == i32::from(value as u8),
            Width::SignedByte => value == i32::from(value as i8),
            Width::Short => value == i32::from(value as u16),
            Width::SignedShort => value == i32::from(value as i16),
            Width::Whole => true,
        };
        fits.then_some(value.to_le_bytes())
    }

    fn bytes(self) -> usize {
        match self {
            Width::Byte | Width::SignedByte => 1,
            Width::Short | Width::SignedShort => 2,
            Width::Whole => 4,
        }
    }
}

/// Successive words that are stored in the same way.
#[derive(Clone, Copy, Debug)]
struct Run {
    first: usize,
    count: usize,
    width: Width,
}

impl Run {
    fn bytes(&self) -> usize {
        self.count * self.width.bytes()
    }

    /// Writes the words of the run into as many bytes as it takes; returns whether all of them fit.
    fn pack(&self, words: &[i32], bytes: &mut [u8]) -> bool {
        let words = &words[self.first..self.first + self.count];
        match self.width {
            Width::Byte => narrow(words, bytes, |word| [word as u8], |[byte]| byte.into()),
            Width::SignedByte => narrow(words, bytes, |word| (word as i8).to_le_bytes(), from_byte),
            Width::Short => narrow(words, bytes, |word| (word as u16).to_le_bytes(), from_short),
            Width::SignedShort => narrow(
                words,
                bytes,
                |word| (word as i16).to_le_bytes(),
                from_signed_short,
            ),
            Width::Whole => narrow(words, bytes, i32::to_le_bytes, i32::from_le_bytes),
        }
    }

    /// Writes the words of the run from its bytes.
    fn unpack(&self, bytes: &[u8], words: &mut [i32]) {
        let words = &mut words[self.first..self.first + self.count];
        match self.width {
            Width::Byte => widen(bytes, words, |[byte]| byte.into()),
            Width::SignedByte => widen(bytes, words, from_byte),
            Width::Short => widen(bytes, words, from_short),
            Width::SignedShort => widen(bytes, words, from_signed_short),
            Width::Whole => widen(bytes, words, i32::from_le_bytes),
        }
    }
}

fn from_byte(bytes: [u8; 1]) -> i32 {
    i8::from_le_bytes(bytes).into()
}

fn from_short(bytes: [u8; 2]) -> i32 {
    u16::from_le_bytes(bytes).into()
}

fn from_signed_short(bytes: [u8; 2]) -> i32 {
    i16::from_le_bytes(bytes).into()
}

fn narrow<const N: usize>(
    words: &[i32],
    bytes: &mut [u8],
    to: impl Fn(i32) -> [u8; N],
    from: impl Fn([u8; N]) -> i32,
) -> bool {
    let mut lost = 0;
    for (word, target) in words.iter().zip(bytes.as_chunks_mut::<N>().0) {
        *target = to(*word);
        lost |= from(*target) ^ word;
    }
    lost == 0
}

fn widen<const N: usize>(bytes: &[u8], words: &mut [i32], from: impl Fn([u8; N]) -> i32) {
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<N>().0) {
        *word = from(*bytes);
    }
}

/// How the words of a state become a record.
#[derive(Debug)]
struct Format {
    /// The words that decide identity.
    identity: Vec<Run>,
    /// The `meta` words that are stored.
    meta: Vec<Run>,
    /// The bytes that decide identity: whole numbers of a row, at least one.
    identity_bytes: usize,
    /// By word that may decide identity: what it is stored as, and from which byte on.
    places: Vec<(Width, u32)>,
}

impl Format {
    /// How the states of a network become records.
    fn new(network: &Network) -> Format {
        let written = network.written_words();
        let widths = widths(network);
        let identity_words = network.layout.identity_words as usize;
        let identity = (0..identity_words).filter(|&word| written[word]);
        let identity = runs_of(identity, &widths);
        let meta = (identity_words..written.len()).filter(|&word| written[word]);
        let meta = runs_of(meta, &widths);
        let numbers = bytes_of(&identity).div_ceil(size_of::<u32>()).max(1);
        let mut places = vec![(Width::Whole, 0); identity_words];
        let mut first = 0;
        for run in &identity {
            for place in &mut places[run.first..run.first + run.count] {
                *place = (run.width, first);
                first += run.width.bytes() as u32;
            }
        }
        Format {
            identity,
            meta,
            identity_bytes: numbers * size_of::<u32>(),
            places,
        }
    }

    /// The bytes of a record.
    fn bytes(&self) -> usize {
        self.identity_bytes + bytes_of(&self.meta)
    }

    /// What a record consists of.
    fn size(&self, words: usize) -> RecordSize {
        let mut word_bits = vec![0; words];
        for run in self.identity.iter().chain(&self.meta) {
            word_bits[run.first..run.first + run.count].fill(8 * run.width.bytes());
        }
        let padding = self.identity_bytes - bytes_of(&self.identity);
        RecordSize {
            word_bits,
            padding_bits: 8 * padding,
        }
    }

    /// Writes a record, whose padding is 0; returns whether all words fit.
    fn write(&self, words: &[i32], record: &mut [u8]) -> bool {
        let (identity, meta) = record.split_at_mut(self.identity_bytes);
        pack(&self.identity, words, identity) & pack(&self.meta, words, meta)
    }
}

/// What the record of a state consists of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordSize {
    /// By word: how many bits it takes; none if it is not stored.
    pub word_bits: Vec<usize>,
    /// How many bits fill up the last number of a row.
    pub padding_bits: usize,
}

/// Stored discrete states.
#[derive(Debug)]
pub struct StateStore {
    format: Format,
    /// What the words are that are not stored.
    initial: Vec<i32>,
    rows: Rows,
    /// By state: the bytes of its `meta` words; nothing if there are none.
    meta: Records<u8>,
    /// The record of the state that was packed last, or loaded.
    scratch: Vec<u8>,
    /// The words of the state with which rows are compared; none if they are not known.
    basis: Vec<i32>,
}

impl StateStore {
    /// An empty store for the states of a network.
    pub fn new(network: &Network) -> StateStore {
        let format = Format::new(network);
        StateStore {
            basis: Vec::new(),
            initial: network.initial.clone(),
            rows: Rows::new(format.identity_bytes / size_of::<u32>()),
            meta: Records::new(bytes_of(&format.meta).max(1)),
            scratch: vec![0; format.bytes()],
            format,
        }
    }

    /// What a stored state of this network consists of, before anything that it has in common with
    /// others is taken out.
    pub fn record_size(network: &Network) -> RecordSize {
        Format::new(network).size(network.layout.words as usize)
    }

    /// The bytes that the store takes.
    pub fn bytes(&self) -> usize {
        self.rows.bytes() + self.meta.bytes()
    }

    /// The most bytes that the next state may take.
    pub(in crate::search) fn growth(&self) -> usize {
        self.rows.growth()
    }

    /// What may be put on disk.
    pub(in crate::search) fn cold(&mut self) -> impl Iterator<Item = &mut dyn Cold> {
        let meta: &mut dyn Cold = &mut self.meta;
        self.rows.cold().into_iter().chain([meta])
    }

    /// The bytes of the state that decide identity, valid until the next call.
    ///
    /// # Panics
    /// If a word lies outside the range of its variable.
    pub fn pack(&mut self, words: &[i32]) -> &[u8] {
        let fits = self.format.write(words, &mut self.scratch);
        assert!(fits, "{FITS}");
        &self.scratch[..self.format.identity_bytes]
    }

    /// The id of a state, and whether it is new.
    ///
    /// # Panics
    /// If a word lies outside the range of its variable.
    pub fn intern(&mut self, words: &[i32]) -> (DiscreteId, bool) {
        if self.basis.is_empty() || self.rows.is_flat() {
            self.pack(words);
            let found = self.intern_packed();
            self.stored(words);
            return found;
        }
        self.change(words);
        let (id, is_new) = self.rows.intern_set();
        self.stored(words);
        if is_new && !self.format.meta.is_empty() {
            let meta = &mut self.scratch[self.format.identity_bytes..];
            assert!(pack(&self.format.meta, words, meta), "{FITS}");
            self.meta.push(meta);
        }
        (DiscreteId(id), is_new)
    }

    /// Whether states may wait to be stored.
    pub(super) fn may_wait(&self) -> bool {
        self.format.meta.is_empty() && self.rows.may_wait()
    }

    /// Lets a state wait until [`StateStore::intern_waiting`].
    ///
    /// # Panics
    /// If a word lies outside the range of its variable.
    pub(super) fn wait(&mut self, words: &[i32]) {
        if self.basis.is_empty() || self.rows.is_flat() {
            self.pack(words);
            self.wait_packed();
        } else {
            self.change(words);
            self.rows.wait_set();
        }
        self.stored(words);
    }

    /// Lets a state that another store of the same network has packed wait.
    pub(super) fn wait_record(&mut self, record: &[u8]) {
        self.scratch.copy_from_slice(record);
        self.wait_packed();
        if !self.rows.is_visited() {
            self.basis.clear();
        }
    }

    fn wait_packed(&mut self) {
        let identity = &self.scratch[..self.format.identity_bytes];
        self.rows.wait(row_of(identity));
    }

    /// Stores the states that wait, in their order, with what [`StateStore::intern`] returns of
    /// each.
    pub(super) fn intern_waiting(&mut self, mut each: impl FnMut(DiscreteId, bool)) {
        self.rows
            .intern_waiting(|id, is_new| each(DiscreteId(id), is_new));
    }

    /// Notes that rows are compared with this state, which was just stored, unless one was visited.
    fn stored(&mut self, words: &[i32]) {
        if !self.rows.is_visited() && !self.rows.is_flat() {
            self.basis.clear();
            self.basis.extend_from_slice(words);
        }
    }

    /// Changes the basis of rows where these words differ from it.
    fn change(&mut self, words: &[i32]) {
        let places = &self.format.places;
        let blocks = words[..places.len()].chunks(BLOCK);
        let basis = self.basis[..places.len()].chunks(BLOCK);
        for (number, (block, basis)) in blocks.zip(basis).enumerate() {
            if block == basis {
                continue;
            }
            for (within, (word, known)) in block.iter().zip(basis).enumerate() {
                if word == known {
                    continue;
                }
                let (width, first) = places[number * BLOCK + within];
                let bytes = width.packed(*word).expect(FITS);
                for (byte, place) in bytes[..width.bytes()].iter().zip(first..) {
                    let (place, shift) = (place as usize / 4, place % 4 * 8);
                    let others = self.rows.number(place) & !(0xff << shift);
                    self.rows.set(place, others | u32::from(*byte) << shift);
                }
            }
        }
    }

    /// A hash of the words that decide identity, the same in all stores of a network.
    pub(super) fn identity_hash(&self, words: &[i32]) -> u32 {
        hash_bytes(bytemuck::cast_slice(&words[..self.format.places.len()]))
    }

    /// The record of a state, for [`StateStore::intern_record`] of another store of this network.
    ///
    /// # Panics
    /// If a word lies outside the range of its variable.
    pub(super) fn record(&mut self, words: &[i32]) -> &[u8] {
        self.pack(words);
        &self.scratch
    }

    /// Prepares for records of another store: they are compared with each other, and not with the
    /// state that was visited.
    pub(super) fn leave(&mut self) {
        self.rows.leave();
        self.basis.clear();
    }

    /// The id of a state that another store of the same network has packed, and whether it is new.
    pub(super) fn intern_record(&mut self, record: &[u8]) -> (DiscreteId, bool) {
        self.scratch.copy_from_slice(record);
        self.intern_packed()
    }

    /// The id of the state that was packed last, and whether it is new.
    fn intern_packed(&mut self) -> (DiscreteId, bool) {
        let (identity, meta) = self.scratch.split_at(self.format.identity_bytes);
        let (id, is_new) = self.rows.intern(row_of(identity));
        if !self.rows.is_visited() {
            self.basis.clear();
        }
        if is_new && !meta.is_empty() {
            self.meta.push(meta);
        }
        (DiscreteId(id), is_new)
    }

    /// The id of a stored state.
    pub fn find(&self, words: &[i32]) -> Option<DiscreteId> {
        let mut record = vec![0; self.scratch.len()];
        if !self.format.write(words, &mut record) {
            return None;
        }
        let found = self
            .rows
            .find(row_of(&record[..self.format.identity_bytes]));
        found.map(DiscreteId)
    }

    /// The words of a state.
    pub fn words(&self, id: DiscreteId) -> Vec<i32> {
        let mut words = self.initial.clone();
        self.load(id, &mut words);
        words
    }

    /// Writes the stored words of a state over those of another state of the same network.
    pub fn load(&self, id: DiscreteId, words: &mut [i32]) {
        let mut bytes = vec![0; self.format.identity_bytes];
        set_row(&mut bytes, &self.rows.get(id.0));
        self.read(id, &bytes, words);
    }

    /// The same, but the next states that are stored are likely to differ from this one in few
    /// words: they are compared with it.
    pub fn visit(&mut self, id: DiscreteId, words: &mut [i32]) {
        let identity = &mut self.scratch[..self.format.identity_bytes];
        set_row(identity, self.rows.visit(id.0));
        self.read(id, &self.scratch[..self.format.identity_bytes], words);
        self.basis.clear();
        self.basis.extend_from_slice(words);
    }

    /// Writes the words of a state, whose identity has these bytes.
    fn read(&self, id: DiscreteId, identity: &[u8], words: &mut [i32]) {
        unpack(&self.format.identity, identity, words);
        if !self.format.meta.is_empty() {
            unpack(&self.format.meta, self.meta.get(id.0), words);
        }
    }
}

/// The numbers of a row, from its bytes.
fn row_of(bytes: &[u8]) -> impl Iterator<Item = u32> {
    let numbers = bytes.as_chunks::<{ size_of::<u32>() }>().0.iter();
    numbers.map(|bytes| u32::from_le_bytes(*bytes))
}

/// Writes the numbers of a row as bytes.
fn set_row(bytes: &mut [u8], row: &[u32]) {
    let numbers = bytes.as_chunks_mut::<{ size_of::<u32>() }>().0;
    for (bytes, number) in numbers.iter_mut().zip(row) {
        *bytes = number.to_le_bytes();
    }
}

fn bytes_of(runs: &[Run]) -> usize {
    runs.iter().map(Run::bytes).sum()
}

/// Writes the words of all runs from their bytes.
fn unpack(runs: &[Run], mut bytes: &[u8], words: &mut [i32]) {
    for run in runs {
        let (own, rest) = bytes.split_at(run.bytes());
        run.unpack(own, words);
        bytes = rest;
    }
}

/// Packs the words of all runs; returns whether all of them fit.
fn pack(runs: &[Run], words: &[i32], bytes: &mut [u8]) -> bool {
    let mut rest = bytes;
    let mut fits = true;
    for run in runs {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(run.bytes());
        fits &= run.pack(words, own);
        rest = others;
    }
    fits
}

/// By word: what it is stored as.
fn widths(network: &Network) -> Vec<Width> {
    let mut widths = vec![Width::Whole; network.layout.words as usize];
    for (width, process) in widths.iter_mut().zip(&network.processes) {
        *width = Width::of(0, process.locations.len() as i32 - 1);
    }
    for variable in &network.layout.variables {
        let mut of_variable = Vec::new();
        add_widths(&variable.shape, &mut of_variable);
        let first = variable.offset as usize;
        widths[first..first + of_variable.len()].copy_from_slice(&of_variable);
    }
    widths
}

fn add_widths(shape: &Shape, widths: &mut Vec<Width>) {
    match shape {
        Shape::Integer { low, high } => widths.push(Width::of(*low, *high)),
        Shape::Bool => widths.push(Width::Byte),
        Shape::Double => widths.extend([Width::Whole; 2]),
        Shape::Scalar { size, .. } => widths.push(Width::of(0, *size as i32)),
        Shape::Array { part, length, .. } => {
            let first = widths.len();
            add_widths(part, widths);
            let of_part = widths.split_off(first);
            widths.extend((0..*length).flat_map(|_| &of_part));
        }
        Shape::Struct(fields) => fields
            .iter()
            .for_each(|(_, shape)| add_widths(shape, widths)),
    }
}

/// The maximal runs of successive words of the same width.
fn runs_of(words: impl Iterator<Item = usize>, widths: &[Width]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for word in words {
        let width = widths[word];
        match runs.last_mut() {
            Some(run) if run.first + run.count == word && run.width == width => run.count += 1,
            _ => runs.push(Run {
                first: word,
                count: 1,
                width,
            }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use rustc_hash::FxHashMap;

    use super::*;
    use crate::ir::Layout;
    use crate::ir::Update;
    use crate::ir::Variable;

    /// A network without processes, with one variable of this shape that an update writes.
    fn network(shape: Shape) -> Network {
        let words = shape.words();
        let update = Update {
            writes: vec![(0, words)],
            ..Update::default()
        };
        Network {
            layout: Layout {
                words,
                identity_words: words,
                variables: vec![Variable {
                    name: "v".to_owned(),
                    owner: None,
                    offset: 0,
                    shape,
                    meta: false,
                }],
            },
            initial: vec![0; words as usize],
            before_update: Some(update),
            ..Network::default()
        }
    }

    #[test]
    fn words_come_back_at_both_ends_of_every_range() {
        let ranges = [
            (0, 1, 1),
            (0, 255, 1),
            (-1, 1, 1),
            (-128, 127, 1),
            (0, 256, 2),
            (-1, 200, 2),
            (-32_768, 32_767, 2),
            (0, 65_535, 2),
            (0, 65_536, 4),
            (i32::MIN, i32::MAX, 4),
        ];
        for (low, high, bytes) in ranges {
            let part = Box::new(Shape::Integer { low, high });
            let mut store = StateStore::new(&network(Shape::Array {
                part,
                length: 3,
                first: 0,
                set: None,
            }));
            let whole: usize = 3 * bytes;
            assert_eq!(store.scratch.len(), whole.next_multiple_of(4));
            for state in [[low, high, 0], [high, high, low]] {
                let (id, is_new) = store.intern(&state);
                assert!(is_new && store.intern(&state) == (id, false));
                let mut loaded = [7; 3];
                store.load(id, &mut loaded);
                assert_eq!(loaded, state);
            }
        }
    }

    #[test]
    fn what_words_take_and_the_padding_are_the_whole_record() {
        let field = |low, high| (String::new(), Shape::Integer { low, high });
        let fields = vec![
            field(0, 200),
            field(-300, 300),
            field(i32::MIN, 0),
            field(0, 9),
        ];
        let mut network = network(Shape::Struct(fields));
        // Nothing writes the last one.
        network.before_update.as_mut().unwrap().writes = vec![(0, 3)];
        let size = StateStore::record_size(&network);
        assert_eq!(size.word_bits, [8, 16, 32, 0]);
        assert_eq!(size.padding_bits, 8);
        let stored = size.word_bits.iter().sum::<usize>() + size.padding_bits;
        assert_eq!(stored, 8 * StateStore::new(&network).scratch.len());
    }

    #[test]
    fn states_that_differ_in_few_words_come_back() {
        check_few_changes(true);
        check_few_changes(false);
    }

    fn check_few_changes(visits: bool) {
        let field = |low, high| (String::new(), Shape::Integer { low, high });
        let record = Shape::Struct(vec![field(0, 200), field(-300, 300), field(-9, 9)]);
        let whole = Shape::Array {
            part: Box::new(record),
            length: 40,
            first: 0,
            set: None,
        };
        let mut store = StateStore::new(&network(whole));
        let mut known: FxHashMap<Vec<i32>, DiscreteId> = FxHashMap::default();
        let (mut words, mut state) = (vec![0; 120], 1_u64);
        let mut next = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005) + 1;
            (state >> 33) as usize % below
        };
        for _ in 0..4000 {
            let visited = DiscreteId(next(known.len().max(1)) as u32);
            let (first, is_new) = store.intern(&words);
            assert_eq!(*known.entry(words.clone()).or_insert(first), first);
            assert!(!is_new || first.0 as usize + 1 == known.len());
            if visits {
                store.visit(visited, &mut words);
            } else {
                store.load(visited, &mut words);
            }
            assert_eq!(known[&words], visited);
            if next(9) == 0 {
                let record = store.record(&words).to_vec();
                if next(2) == 0 {
                    store.leave();
                }
                assert_eq!(store.intern_record(&record), (visited, false));
            }
            for _ in 0..next(4) {
                let (record, field) = (next(40), next(3));
                words[3 * record + field] = [3, -256, -1][field] * next(3) as i32;
            }
        }
        for id in (0..known.len() as u32).map(DiscreteId) {
            let words = store.words(id);
            assert_eq!(known[&words], id);
            assert_eq!(store.find(&words), Some(id));
        }
    }

    #[test]
    #[should_panic(expected = "every word lies in the range of its variable")]
    fn word_outside_its_range_is_no_other_state() {
        let shape = Shape::Integer { low: 0, high: 9 };
        StateStore::new(&network(shape)).intern(&[256]);
    }
}

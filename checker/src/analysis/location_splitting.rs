//! What a process can do in a location, distinguished by the values of a few variables that only it
//! writes.
//!
//! A comparison of clocks often depends on a flag that a process keeps: `running && x <= 5`. While
//! the flag is not set the comparison does not matter, and it is set where the clock is. So
//! locations are taken apart by the values of such variables: a *node* is a location with values of
//! the tracked variables. Guards and updates are run by the interpreter for all values of what they
//! read, as long as these are few; where they are not, everything counts as possible.
//!
//! Invariants
//! * Only words that no other process writes and that are not `meta` are tracked. A process that
//!   takes no part in a transition stays in its node, and states with different nodes are
//!   different.
//! * Every transition of the network in which the process takes an edge leads from a node to
//!   another one along a [`SplitStep`], and the comparisons in the guards that it evaluates are
//!   among the [`Node::atoms`].

use rustc_hash::FxHashMap;

use crate::exec::{Context, EmittedConstraint, Interpreter};
use crate::ir::{ClockAtom, Edge, FunctionId, Guard, Network, Shape, Update, Variable};

use super::function_reads::read_words;
use crate::tuning::Tuning;

/// A variable with more values is not tracked.
const MOST_VALUES: i64 = 8;
/// The most nodes of a process.
const MOST_NODES: usize = 512;
/// A function is run for at most this number of combinations of values.
const MOST_COMBINATIONS: i64 = 256;
/// So many runs are made for all of a network.
const MOST_RUNS: usize = 50_000;
/// Rounds of loops that one run may take.
const MOST_ROUNDS: u64 = 1_000;
/// Longer ranges of words that are written are not taken apart.
const LONG_RANGE: u32 = 64;
/// Functions that read more words are not looked into.
const MOST_READ: usize = 16;

/// Whose updates may write a word.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Writer {
    Nobody,
    /// The process with this index.
    One(usize),
    Several,
}

impl Writer {
    fn and(self, other: Writer) -> Writer {
        match (self, other) {
            (Writer::Nobody, one) | (one, Writer::Nobody) => one,
            (one, same) if one == same => one,
            _ => Writer::Several,
        }
    }
}

/// The writers of all words.
#[derive(Debug, Default)]
struct Writers {
    /// Values of words in short ranges.
    of_words: FxHashMap<u32, Writer>,
    /// Values of variables that are written as long ranges, by their first words.
    of_variables: FxHashMap<u32, Writer>,
}

impl Writers {
    fn new(network: &Network) -> Writers {
        let mut writers = Writers::default();
        for (index, process) in network.processes.iter().enumerate() {
            for edge in &process.edges {
                writers.add(network, &edge.update, Writer::One(index));
                for branch in &edge.branches {
                    writers.add(network, &branch.update, Writer::One(index));
                }
            }
        }
        for update in network.before_update.iter().chain(&network.after_update) {
            writers.add(network, update, Writer::Several);
        }
        writers
    }

    fn add(&mut self, network: &Network, update: &Update, writer: Writer) {
        for &(first, count) in &update.writes {
            let words = first..first + count;
            if count <= LONG_RANGE {
                for word in words {
                    let known = self.of_words.entry(word).or_insert(writer);
                    *known = known.and(writer);
                }
                continue;
            }
            let behind = variable_behind(network, first);
            for variable in &network.layout.variables[behind.saturating_sub(1)..] {
                if variable.offset >= words.end {
                    break;
                }
                let known = self.of_variables.entry(variable.offset).or_insert(writer);
                *known = known.and(writer);
            }
        }
    }

    /// The processes that write a word of a variable.
    fn of(&self, word: u32, variable: &Variable) -> Writer {
        let of_word = self.of_words.get(&word).copied();
        let of_variable = self.of_variables.get(&variable.offset).copied();
        of_word
            .unwrap_or(Writer::Nobody)
            .and(of_variable.unwrap_or(Writer::Nobody))
    }
}

/// The index of the first variable whose words lie behind this one.
fn variable_behind(network: &Network, word: u32) -> usize {
    let variables = &network.layout.variables;
    variables.partition_point(|variable| variable.offset <= word)
}

/// A word with the values that it can have.
#[derive(Clone, Copy, Debug)]
struct Ranged {
    word: u32,
    low: i32,
    high: i32,
}

impl Ranged {
    fn count(&self) -> i64 {
        i64::from(self.high) - i64::from(self.low) + 1
    }
}

/// A tracked word and what its value counts in the number of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracked {
    pub(super) word: u32,
    pub(super) low: i32,
    pub(super) stride: usize,
}

/// An edge with a branch that leads from node to node.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplitStep {
    pub(super) source: usize,
    pub(super) target: usize,
    pub(super) edge: usize,
    pub(super) branch: usize,
}

/// The nodes of a process. The number of a node is that of its location plus, forevery tracked
/// word, its value above the least one times the stride.
#[derive(Debug, Default)]
pub(super) struct Valuations {
    pub(super) tracked: Vec<Tracked>,
    pub(super) nodes: usize,
    /// Node, and a comparison in a guard that can be evaluated there.
    pub(super) atoms: Vec<(usize, ClockAtom)>,
    pub(super) steps: Vec<SplitStep>,
}

/// Takes the processes of a network apart.
pub(super) struct Splitting<'a> {
    network: &'a Network,
    /// Made with the first function that is run.
    interpreter: Option<Interpreter>,
    runs: usize,
    state: Vec<i32>,
    /// Found out with the first word that is asked for.
    writers: Option<Writers>,
    tuning: Tuning,
}

/// What can happen with a guard in a valuation.
#[derive(Clone)]
struct GuardAnswer {
    can_hold: bool,
    atoms: Vec<ClockAtom>,
}

impl<'a> Splitting<'a> {
    pub(super) fn new(network: &'a Network, tuning: Tuning) -> Splitting<'a> {
        Splitting {
            network,
            interpreter: None,
            runs: 0,
            state: network.initial.clone(),
            writers: None,
            tuning,
        }
    }

    /// The nodes of the process with this index.
    pub(super) fn of(&mut self, index: usize) -> Valuations {
        let network = self.network;
        let process = &network.processes[index];
        let tracked = self.tracked(index);
        let mut stride = process.locations.len();
        let mut valuations = Valuations::default();
        for word in &tracked {
            valuations.tracked.push(Tracked {
                word: word.word,
                low: word.low,
                stride,
            });
            stride *= word.count() as usize;
        }
        valuations.nodes = stride;
        let combinations = combinations(&tracked);
        for (index, edge) in process.edges.iter().enumerate() {
            for values in &combinations {
                let tracked = &tracked;
                self.add(index, edge, Valuation { tracked, values }, &mut valuations);
            }
        }
        valuations
    }

    /// The words of a process that guards with comparisons of clocks depend on.
    fn tracked(&mut self, process: usize) -> Vec<Ranged> {
        let network = self.network;
        let edges = &network.processes[process].edges;
        let mut nodes = network.processes[process].locations.len();
        let mut tracked: Vec<Ranged> = Vec::new();
        let guards = edges.iter().map(|edge| &edge.guard);
        let is_used = self.tuning.location_splitting;
        for guard in guards.filter(|guard| is_used && !guard.atoms.is_empty()) {
            let words = guard
                .function
                .and_then(|function| read_words(network, [function], MOST_READ));
            for word in words.unwrap_or_default() {
                let Some((ranged, Writer::One(writer))) = self.range_of(word) else {
                    continue;
                };
                let more = nodes.saturating_mul(ranged.count() as usize);
                let is_new = tracked.iter().all(|one| one.word != word);
                if writer == process
                    && is_new
                    && ranged.count() <= MOST_VALUES
                    && more <= MOST_NODES
                {
                    nodes = more;
                    tracked.push(ranged);
                }
            }
        }
        tracked
    }

    /// The values of a word of a variable that is not `meta`, if they are integers, and the
    /// processes that write it.
    fn range_of(&mut self, word: u32) -> Option<(Ranged, Writer)> {
        let network = self.network;
        let behind = variable_behind(network, word);
        let variable = &network.layout.variables[behind.checked_sub(1)?];
        let is_inside = word - variable.offset < variable.shape.words();
        if variable.meta || !is_inside {
            return None;
        }
        let writers = self.writers.get_or_insert_with(|| Writers::new(network));
        let writer = writers.of(word, variable);
        let (low, high) = range_in(&variable.shape, word - variable.offset)?;
        let (low, high) = if writer == Writer::Nobody {
            let value = network.initial[word as usize];
            (value, value)
        } else {
            (low, high)
        };
        Some((Ranged { word, low, high }, writer))
    }

    /// Adds what an edge can do where the tracked words have these values.
    fn add(&mut self, index: usize, edge: &Edge, here: Valuation<'_>, valuations: &mut Valuations) {
        let node = |location: u32, values: &[i32]| {
            let offsets = valuations.tracked.iter().zip(values);
            let offsets = offsets.map(|(one, &value)| (value - one.low) as usize * one.stride);
            location as usize + offsets.sum::<usize>()
        };
        let source = node(edge.source.0, here.values);
        let answer = self.guard(edge, here);
        let mut steps = Vec::new();
        if answer.can_hold {
            for (branch, end) in edge.branches.iter().enumerate() {
                let functions = [edge.update.function, end.update.function];
                let writes = edge.update.writes.iter().chain(&end.update.writes);
                let is_written = writes
                    .flat_map(|&(first, count)| first..first + count)
                    .any(|word| here.tracked.iter().any(|one| one.word == word));
                let targets = if is_written {
                    self.update(edge, functions, here)
                } else {
                    vec![here.values.to_vec()]
                };
                steps.extend(targets.iter().map(|values| SplitStep {
                    source,
                    target: node(end.target.0, values),
                    edge: index,
                    branch,
                }));
            }
        }
        let atoms = answer.atoms.into_iter().map(|atom| (source, atom));
        valuations.atoms.extend(atoms);
        valuations.steps.extend(steps);
    }

    /// Whether the guard of an edge can hold where the tracked words have these values, and what it
    /// compares.
    fn guard(&mut self, edge: &Edge, here: Valuation<'_>) -> GuardAnswer {
        let guard = &edge.guard;
        let everything = GuardAnswer {
            can_hold: !guard.never_holds,
            atoms: guard.atoms.clone(),
        };
        let Some(function) = guard.function.filter(|_| !here.tracked.is_empty()) else {
            return everything;
        };
        let Some((free, of_tracked)) = self.free_words(&[function], here.tracked) else {
            return everything;
        };
        if !of_tracked {
            return everything;
        }
        let mut answer = GuardAnswer {
            can_hold: false,
            atoms: Vec::new(),
        };
        let finished = self.run_all(edge, &[function], &free, here, |run| {
            // A guard that fails with an error ends the evaluation, but what it compared before
            // counts.
            if run.result != Ok(0) {
                answer.can_hold |= run.result.is_ok();
                add_atoms(guard, run.constraints, &mut answer.atoms);
            }
        });
        if finished { answer } else { everything }
    }

    /// The values of the tracked words after an update.
    fn update(
        &mut self,
        edge: &Edge,
        functions: [Option<FunctionId>; 2],
        here: Valuation<'_>,
    ) -> Vec<Vec<i32>> {
        let functions: Vec<FunctionId> = functions.into_iter().flatten().collect();
        let mut targets: Vec<Vec<i32>> = Vec::new();
        let finished = match self.free_words(&functions, here.tracked) {
            None => false,
            Some((free, _)) => self.run_all(edge, &functions, &free, here, |run| {
                if run.result.is_err() {
                    return;
                }
                let values = here.tracked.iter().map(|one| run.state[one.word as usize]);
                let values: Vec<i32> = values.collect();
                if !targets.contains(&values) {
                    targets.push(values);
                }
            }),
        };
        if finished {
            targets
        } else {
            combinations(here.tracked)
        }
    }

    /// The words that functions read but for the tracked ones, with their values, and whether they
    /// read tracked ones; `None` if that is not known.
    fn free_words(
        &mut self,
        functions: &[FunctionId],
        tracked: &[Ranged],
    ) -> Option<(Vec<Ranged>, bool)> {
        let words = read_words(self.network, functions.iter().copied(), MOST_READ)?;
        let is_tracked = |word: &u32| tracked.iter().any(|one| one.word == *word);
        let free = words.iter().filter(|word| !is_tracked(word));
        let ranges = free.map(|&word| self.range_of(word).map(|(ranged, _)| ranged));
        let free: Option<Vec<Ranged>> = ranges.collect();
        Some((free?, words.iter().any(is_tracked)))
    }

    /// Runs functions one after the other for all values of the free words and of the edge's
    /// `select`; false if these are too many, or a run too long.
    fn run_all(
        &mut self,
        edge: &Edge,
        functions: &[FunctionId],
        free: &[Ranged],
        here: Valuation<'_>,
        mut look: impl FnMut(FunctionRun<'_>),
    ) -> bool {
        let selects = edge.select.iter().map(|select| Ranged {
            word: 0,
            low: select.low,
            high: select.high,
        });
        let all: Vec<Ranged> = selects.chain(free.iter().copied()).collect();
        let counts = all.iter().map(Ranged::count);
        let count = counts.fold(1, i64::saturating_mul);
        if count > MOST_COMBINATIONS || self.runs + count as usize > MOST_RUNS {
            return false;
        }
        let network = self.network;
        let interpreter = self.interpreter.get_or_insert_with(|| {
            Interpreter::new(&network.functions, &network.constants).with_overflow(network.overflow)
        });
        let (mut constraints, mut assignments) = (Vec::new(), Vec::new());
        for combination in combinations(&all) {
            let (arguments, words) = combination.split_at(edge.select.len());
            self.runs += 1;
            self.state.clone_from(&network.initial);
            let set = free
                .iter()
                .zip(words)
                .chain(here.tracked.iter().zip(here.values));
            for (one, &value) in set {
                self.state[one.word as usize] = value;
            }
            constraints.clear();
            let mut result = Ok(1);
            for &function in functions {
                let mut context = Context {
                    state: &mut self.state,
                    constraints: &mut constraints,
                    assignments: &mut assignments,
                };
                let rounds = MOST_ROUNDS;
                let (called, used) =
                    interpreter.call_within(rounds, function, arguments, &mut context);
                if used >= MOST_ROUNDS {
                    return false;
                }
                result = called.map_err(|_| ());
                if result.is_err() {
                    break;
                }
            }
            assignments.clear();
            look(FunctionRun {
                result,
                state: &self.state,
                constraints: &constraints,
            });
        }
        true
    }
}

/// The values of the tracked words.
#[derive(Clone, Copy)]
struct Valuation<'a> {
    tracked: &'a [Ranged],
    values: &'a [i32],
}

/// The results of a run.
struct FunctionRun<'a> {
    result: Result<i32, ()>,
    state: &'a [i32],
    constraints: &'a [EmittedConstraint],
}

/// Adds the comparisons that a guard makes where it emits these constraints.
fn add_atoms(guard: &Guard, emitted: &[EmittedConstraint], atoms: &mut Vec<ClockAtom>) {
    for &constraint in guard.fixed.iter().chain(emitted) {
        let atom = ClockAtom::from(constraint);
        if !atoms.contains(&atom) {
            atoms.push(atom);
        }
    }
}

/// All combinations of values.
fn combinations(words: &[Ranged]) -> Vec<Vec<i32>> {
    let mut all = vec![Vec::new()];
    for word in words {
        let longer = |one: &Vec<i32>| {
            let one = one.clone();
            (word.low..=word.high).map(move |value| [&one[..], &[value]].concat())
        };
        all = all.iter().flat_map(longer).collect();
    }
    all
}

/// The values of a word of a variable of this shape, if they are integers.
fn range_in(shape: &Shape, word: u32) -> Option<(i32, i32)> {
    match shape {
        Shape::Integer { low, high } => Some((*low, *high)),
        Shape::Bool => Some((0, 1)),
        Shape::Scalar { size, .. } => Some((0, *size as i32 - 1)),
        Shape::Double => None,
        Shape::Array { part, .. } => range_in(part, word % part.words()),
        Shape::Struct(fields) => {
            let mut word = word;
            for (_, shape) in fields {
                match word.checked_sub(shape.words()) {
                    Some(rest) => word = rest,
                    None => return range_in(shape, word),
                }
            }
            None
        }
    }
}

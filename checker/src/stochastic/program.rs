//! What does not change from run to run: the moves of every location with their conditions, and
//! who has to plan anew when words change.
//!
//! Invariant: what a process plans depends only on the words that its [`Spot`] reads, on the
//! location of the process itself, and on the locations of those that could receive from it on
//! binary channels. [`Program::concerned`] lists for each branch of an edge all spots whose plans
//! depend on a word that it writes, and [`Program::followers`] for each process all processes whose
//! plans depend on where it is.

use std::ops::Range;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::condition::{Comparisons, Condition, Number};
use super::machine::Machine;
use super::readers::{Reader, Readers};
use crate::analysis::function_reads::read_words;
use crate::exec::Executor;
use crate::ir::{
    Edge, EdgeId, FunctionId, Guard, LocationId, Network, ProcessId, RealBound, Sync, Update,
    Urgency,
};
use crate::network::discrete::receivers::Receivers;
use crate::network::discrete::selects::{select_count, select_values};

/// What a move synchronises on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// Nothing.
    None,
    /// This channel.
    Known(u32),
    /// The first channel of an array, and the function that says how many behind it.
    Computed(u32, FunctionId),
}

/// An edge with the values of its `select` bindings.
#[derive(Debug)]
pub(super) struct Instance<'a> {
    pub(super) process: u32,
    pub(super) id: EdgeId,
    pub(super) edge: &'a Edge,
    pub(super) values: Box<[i32]>,
    pub(super) guard: Condition,
    pub(super) channel: Channel,
    /// Whether it sends on a binary channel, or may.
    pub(super) is_binary: bool,
    /// Whether its channel is urgent, or may be.
    pub(super) may_be_urgent: bool,
    /// The number of its first branch among those of all edges.
    branches: u32,
    /// The number of the first instance of the same process with the same entry: of the legs that
    /// are edges, the first; else its own.
    pub(super) entry: u32,
}

/// Instances that follow each other, by their numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct InstanceRange {
    first: u32,
    end: u32,
}

impl InstanceRange {
    pub(super) fn numbers(self) -> Range<u32> {
        self.first..self.end
    }

    pub(super) fn is_empty(self) -> bool {
        self.numbers().is_empty()
    }
}

/// A process in a location.
#[derive(Debug)]
pub(super) struct Spot {
    pub(super) urgency: Urgency,
    pub(super) invariant: Condition,
    pub(super) outputs: InstanceRange,
    /// Those that receive.
    pub(super) inputs: InstanceRange,
    /// The rate of the exponential delay.
    pub(super) exponential_rate: Option<Number>,
    /// Sets the rates of clocks.
    pub(super) rates: Option<FunctionId>,
    /// Whether the controller owns the edge of an output.
    pub(super) is_controllable: bool,
    /// Whether its outputs that are enabled stay so as time passes, and none is on an urgent
    /// channel or needs a receiver.
    pub(super) is_plain: bool,
    /// Whether each output is enabled in one interval, whoever receives.
    pub(super) has_spans: bool,
}

impl Spot {
    /// Whether a plan here depends on the value of a clock.
    pub(super) fn waits_for_a_clock(&self) -> bool {
        !self.is_plain || self.invariant.is_timed()
    }
}

/// A network, prepared for runs.
#[derive(Debug)]
pub(super) struct Program<'a> {
    pub(super) network: &'a Network,
    first_spots: Vec<u32>,
    spots: Vec<Spot>,
    instances: Vec<Instance<'a>>,
    comparisons: Vec<Comparisons>,
    /// By branch of an edge: its weight, if it has branches with weights.
    weights: Vec<Number>,
    /// By branch of an edge: who plans anew after it, beside those that move.
    concerned: Vec<Arc<[Reader]>>,
    /// By branch of an edge: the processes whose locations its updates may set, as those of dynamic
    /// templates do.
    placed: Vec<Box<[u32]>>,
    receivers: Receivers,
    /// By the first word of a clock: whose plans depend on its rate.
    pub(super) rate_readers: FxHashMap<u32, Arc<[Reader]>>,
    /// By process: whose plans depend on where it is, the process itself left out.
    followers: Vec<Box<[u32]>>,
    /// The processes of which some location sets the rate of a clock.
    pub(super) rated: Vec<u32>,
    /// Whether the rate of some clock may change as time passes.
    pub(super) has_flows: bool,
}

impl<'a> Program<'a> {
    /// Prepares a network.
    pub(super) fn new(network: &'a Network, executor: &'a dyn Executor) -> Program<'a> {
        let mut machine = Machine::new(network, executor);
        let mut program = Program {
            network,
            first_spots: Vec::with_capacity(network.processes.len()),
            spots: Vec::new(),
            instances: Vec::new(),
            comparisons: Vec::new(),
            weights: Vec::new(),
            concerned: Vec::new(),
            placed: Vec::new(),
            receivers: Receivers::new(network),
            rate_readers: FxHashMap::default(),
            followers: Vec::new(),
            rated: Vec::new(),
            has_flows: false,
        };
        for process in 0..network.processes.len() {
            program.add_process(process, &mut machine);
        }
        program.find_dependences(&mut machine);
        program
    }

    fn add_process(&mut self, process: usize, machine: &mut Machine<'a>) {
        let network = self.network;
        self.first_spots.push(self.spots.len() as u32);
        for location in &network.processes[process].locations {
            let outputs = self.add_instances(process, &location.edges, true, machine);
            let inputs = self.add_instances(process, &location.edges, false, machine);
            let chances = &location.chances;
            if chances.rates.is_some() && self.rated.last() != Some(&(process as u32)) {
                self.rated.push(process as u32);
            }
            self.has_flows |= chances.flows.contains(&true);
            let known = self.range(outputs);
            let is_controllable = known.iter().any(|one| one.edge.controllable);
            let is_plain = known
                .iter()
                .all(|one| !one.guard.is_timed() && !one.is_binary && !one.may_be_urgent);
            let has_spans = known.iter().all(|one| {
                let is_span = !matches!(one.guard, Condition::Timed(_) | Condition::Curved(_));
                is_span && !one.is_binary
            });
            let invariant = self.condition(&location.invariant, &[], machine);
            let exponential_rate = chances
                .exponential_rate
                .map(|rate| number(rate, &[], machine));
            self.spots.push(Spot {
                urgency: location.urgency,
                invariant,
                outputs,
                inputs,
                exponential_rate,
                rates: chances.rates,
                is_controllable,
                is_plain,
                has_spans,
            });
        }
    }

    /// Adds the outputs among some edges, or those that receive.
    fn add_instances(
        &mut self,
        process: usize,
        edges: &[EdgeId],
        outputs: bool,
        machine: &mut Machine<'a>,
    ) -> InstanceRange {
        let first = self.instances.len() as u32;
        let network = self.network;
        let mut entries: FxHashMap<(EdgeId, Box<[i32]>), u32> = FxHashMap::default();
        for &id in edges {
            let edge = &network.processes[process].edges[id.0 as usize];
            let is_output = edge.sync.is_none_or(|sync| sync.send);
            if is_output != outputs || edge.guard.never_holds {
                continue;
            }
            let range = edge.sync.map_or(0..0, Sync::channels);
            let channels = &network.channels[range.start as usize..range.end as usize];
            let is_binary = outputs && channels.iter().any(|channel| !channel.broadcast);
            let may_be_urgent = outputs && channels.iter().any(|channel| channel.urgent);
            let mut values = Vec::new();
            for combination in 0..select_count(edge) {
                select_values(edge, combination, &mut values);
                let guard = self.condition(&edge.guard, &values, machine);
                if guard != Condition::Never {
                    let number = self.instances.len() as u32;
                    let entry = edge.leg.as_ref().map_or(number, |leg| {
                        let values = values[..leg.bindings].into();
                        *entries.entry((leg.first, values)).or_insert(number)
                    });
                    self.instances.push(Instance {
                        process: process as u32,
                        id,
                        edge,
                        values: values.as_slice().into(),
                        guard,
                        channel: channel_of(edge.sync, &values, machine),
                        is_binary,
                        may_be_urgent,
                        branches: 0,
                        entry,
                    });
                }
            }
        }
        let end = self.instances.len() as u32;
        InstanceRange { first, end }
    }

    /// A guard or an invariant; what does not depend on the state is computed once.
    fn condition(&mut self, guard: &Guard, values: &[i32], machine: &mut Machine<'a>) -> Condition {
        let Some(parts) = &guard.parts else {
            return folded(Condition::of(guard), values, machine);
        };
        if guard.never_holds {
            return Condition::Never;
        }
        let on_words = parts.on_words.map_or(Condition::Always, Condition::Words);
        let on_words = folded(on_words, values, machine);
        if on_words == Condition::Never {
            return Condition::Never;
        }
        let bounds = parts.comparisons.iter().map(|one| {
            let bound = match one.bound {
                RealBound::Constant(value) => Number::Known(value),
                RealBound::Computed(function) => number(function, values, machine),
            };
            (one.clock, one.relation, bound)
        });
        self.comparisons.push(Comparisons {
            on_words,
            bounds: bounds.collect(),
            whole: guard.function.expect("comparisons have a function"),
        });
        Condition::Compared(self.comparisons.len() as u32 - 1)
    }

    /// The function that a condition depends on.
    fn function(&self, condition: Condition) -> Option<FunctionId> {
        match condition {
            Condition::Always | Condition::Never => None,
            Condition::Words(function)
            | Condition::Timed(function)
            | Condition::Curved(function) => Some(function),
            Condition::Compared(place) => Some(self.comparisons(place).whole),
        }
    }

    /// The functions on which the plans of a process in a location depend.
    fn functions_of_plans(&self, spot: &Spot) -> Vec<FunctionId> {
        let mut functions = Vec::new();
        let of_instance = |instance: &Instance<'_>, functions: &mut Vec<FunctionId>| {
            functions.extend(self.function(instance.guard));
            if let Channel::Computed(_, index) = instance.channel {
                functions.push(index);
            }
        };
        functions.extend(self.function(spot.invariant));
        if let Some(Number::Computed(rate)) = spot.exponential_rate {
            functions.push(rate);
        }
        functions.extend(spot.rates);
        for output in self.range(spot.outputs) {
            of_instance(output, &mut functions);
            if !output.is_binary {
                continue;
            }
            for partner in self.partners(output) {
                for spot in self.spots_of(partner as usize) {
                    for input in self.range(spot.inputs) {
                        of_instance(input, &mut functions);
                    }
                }
            }
        }
        functions.sort_unstable();
        functions.dedup();
        functions
    }

    /// Who could receive from a sender.
    pub(super) fn partners(&self, sender: &Instance<'_>) -> Vec<u32> {
        let channels = sender.edge.sync.map_or(0..0, Sync::channels);
        let mut partners = self.receivers.on_any(channels);
        partners.retain(|&one| one != sender.process);
        partners
    }

    fn find_dependences(&mut self, machine: &mut Machine<'a>) {
        let network = self.network;
        let words = network.layout.words as usize;
        let mut readers: Vec<Vec<Reader>> = vec![Vec::new(); words];
        let mut followers: Vec<Vec<u32>> = vec![Vec::new(); network.processes.len()];
        for process in 0..network.processes.len() {
            let spots = self.spots_of(process);
            let mut read: Vec<(u32, u32)> = Vec::new();
            let mut planning = 0;
            for (location, spot) in (0..).zip(spots) {
                let functions = self.functions_of_plans(spot);
                planning += u32::from(!functions.is_empty());
                match read_words(network, functions, words) {
                    Some(of_spot) => read.extend(of_spot.iter().map(|&word| (word, location))),
                    None => read.extend((0..words as u32).map(|word| (word, location))),
                }
            }
            read.sort_unstable();
            for of_word in read.chunk_by(|one, other| one.0 == other.0) {
                let list = &mut readers[of_word[0].0 as usize];
                let process = process as u32;
                if of_word.len() as u32 == planning {
                    list.push(Reader::everywhere(process));
                } else {
                    list.extend(of_word.iter().map(|&(_, location)| Reader {
                        process,
                        location: Some(location),
                    }));
                }
            }
            let reader = process as u32;
            for spot in spots {
                for output in self.range(spot.outputs).iter().filter(|one| one.is_binary) {
                    for partner in self.partners(output) {
                        followers[partner as usize].push(reader);
                    }
                }
            }
        }
        for (process, followers) in followers.iter_mut().enumerate() {
            followers.extend(readers[process].iter().map(|reader| reader.process));
            followers.sort_unstable();
            followers.dedup();
            followers.retain(|&one| one != process as u32);
        }
        self.followers = followers.into_iter().map(Vec::into_boxed_slice).collect();
        let mut readers = Readers::new(readers);
        for &clock in &network.chances.clocks {
            let list = readers.of([(clock, CLOCK_WORDS)], None);
            if !list.is_empty() {
                self.rate_readers.insert(clock, list);
            }
        }
        let around = [&network.before_update, &network.after_update];
        let around: Vec<(u32, u32)> = around
            .into_iter()
            .flatten()
            .flat_map(|update| update.writes.iter().copied())
            .collect();
        let mut known: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        let (concerned, weights) = (&mut self.concerned, &mut self.weights);
        let placed = &mut self.placed;
        let processes = network.processes.len() as u32;
        for instance in &mut self.instances {
            let edge = instance.edge;
            let of_edge = known.entry((instance.process, instance.id.0));
            instance.branches = *of_edge.or_insert_with(|| {
                let first = concerned.len() as u32;
                let has_bindings = !edge.select.is_empty();
                weights.extend(edge.branches.iter().map(|branch| match branch.weight {
                    None => Number::Known(1.0),
                    Some(weight) if has_bindings => Number::Computed(weight),
                    Some(weight) => number(weight, &[], machine),
                }));
                for branch in &edge.branches {
                    let updates: [&Update; 2] = [&edge.update, &branch.update];
                    let writes = updates.into_iter().flat_map(|update| &update.writes);
                    let writes: Vec<(u32, u32)> = writes.chain(&around).copied().collect();
                    let words = writes
                        .iter()
                        .flat_map(|&(start, count)| start..start + count);
                    placed.push(words.filter(|&word| word < processes).collect());
                    concerned.push(readers.of(writes, Some(instance.process)));
                }
                first
            });
        }
    }

    /// A process in each of its locations.
    pub(super) fn spots_of(&self, process: usize) -> &[Spot] {
        let first = self.first_spots[process] as usize;
        &self.spots[first..first + self.network.processes[process].locations.len()]
    }

    /// A process in a location.
    pub(super) fn spot(&self, process: usize, LocationId(location): LocationId) -> &Spot {
        &self.spots[(self.first_spots[process] + location) as usize]
    }

    /// Whether the result of a function may change as time passes.
    pub(super) fn is_timed(&self, function: FunctionId) -> bool {
        !clocks_of(self.network, function).is_empty()
    }

    /// The instances with these numbers.
    pub(super) fn range(&self, range: InstanceRange) -> &[Instance<'a>] {
        &self.instances[range.first as usize..range.end as usize]
    }

    /// The instance with this number.
    pub(super) fn instance(&self, number: u32) -> &Instance<'a> {
        &self.instances[number as usize]
    }

    /// The outputs of the controller that are first of their entries, with their numbers.
    pub(super) fn outputs_of_controller(&self) -> impl Iterator<Item = (u32, &Instance<'a>)> {
        let all = (0..).zip(&self.instances);
        all.filter(|(number, one)| {
            let is_output = one.edge.sync.is_none_or(|sync| sync.send);
            one.edge.controllable && is_output && one.entry == *number
        })
    }

    /// Whether both sides have outputs in a location.
    pub(super) fn is_mixed(&self, spot: &Spot) -> bool {
        let outputs = self.range(spot.outputs).iter();
        spot.is_controllable && outputs.into_iter().any(|one| !one.edge.controllable)
    }

    /// The parts of a condition.
    pub(super) fn comparisons(&self, place: u32) -> &Comparisons {
        &self.comparisons[place as usize]
    }

    /// The weight of a branch of an instance.
    pub(super) fn weight(&self, instance: &Instance<'_>, branch: usize) -> Number {
        self.weights[instance.branches as usize + branch]
    }

    /// Who plans anew after a branch of an instance, beside those that move.
    pub(super) fn concerned(&self, instance: &Instance<'_>, branch: usize) -> &[Reader] {
        &self.concerned[instance.branches as usize + branch]
    }

    /// The processes whose locations the updates of a branch may set.
    pub(super) fn placed(&self, instance: &Instance<'_>, branch: usize) -> &[u32] {
        &self.placed[instance.branches as usize + branch]
    }

    /// Whether updates may set locations of processes that do not move.
    pub(super) fn places_others(&self) -> bool {
        self.placed.iter().any(|placed| !placed.is_empty())
    }

    /// The processes that may receive on a channel, ascending.
    pub(super) fn receivers(&self, channel: u32) -> &[u32] {
        self.receivers.on(channel)
    }

    /// The processes whose plans depend on where a process is, beside itself.
    pub(super) fn followers(&self, ProcessId(process): ProcessId) -> &[u32] {
        &self.followers[process as usize]
    }
}

/// The first words of the clocks whose values a function may read.
pub(super) fn clocks_of(network: &Network, function: FunctionId) -> Vec<u32> {
    let clocks = &network.chances.clocks;
    match read_words(network, [function], network.layout.words as usize) {
        None => clocks.clone(),
        Some(mut words) => {
            words.retain(|word| clocks.binary_search(word).is_ok());
            words
        }
    }
}

/// The words of a clock: its value and its rate.
const CLOCK_WORDS: u32 = 4;

/// Whether the result of a function depends on its arguments only.
fn is_constant(function: FunctionId, machine: &Machine<'_>) -> bool {
    read_words(machine.network, [function], 0).is_some_and(|words| words.is_empty())
}

/// A condition, computed now if it does not depend on the state.
fn folded(condition: Condition, values: &[i32], machine: &mut Machine<'_>) -> Condition {
    let Condition::Words(function) = condition else {
        return condition;
    };
    if !is_constant(function, machine) {
        return condition;
    }
    // What fails is called again when it is asked, and fails there.
    match machine.call(function, values) {
        Ok(0) => Condition::Never,
        Ok(_) => Condition::Always,
        Err(_) => condition,
    }
}

/// A number, computed now if it does not depend on the state.
fn number(function: FunctionId, values: &[i32], machine: &mut Machine<'_>) -> Number {
    if !is_constant(function, machine) {
        return Number::Computed(function);
    }
    match machine.real(function, values) {
        Ok(value) => Number::Known(value),
        Err(_) => Number::Computed(function),
    }
}

fn channel_of(sync: Option<Sync>, values: &[i32], machine: &mut Machine<'_>) -> Channel {
    let Some(sync) = sync else {
        return Channel::None;
    };
    let first = sync.channel.0;
    match sync.index {
        None => Channel::Known(first),
        Some(index) if is_constant(index, machine) => match machine.call(index, values) {
            Ok(offset) => Channel::Known(first + offset as u32),
            Err(_) => Channel::Computed(first, index),
        },
        Some(index) => Channel::Computed(first, index),
    }
}

//! What can happen in a state of a network, and how likely each outcome of a move is.
//!
//! A move is a process with one of its outputs; receivers and branches are chosen by their
//! chances. Time is none of this module's: [`super::chain`] and [`super::grid`] bring it.

use super::{Assignment, Atom, Compare, Condition, Edge, Net, Number, Path, Urgency};

/// The most processes, variables and clocks of a network.
pub(crate) const MOST: usize = 4;

/// A state; clocks count steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub(crate) struct State {
    pub(crate) locations: [u8; MOST],
    pub(crate) variables: [u8; MOST],
    pub(crate) clocks: [u16; MOST],
}

/// Why a network is none whose probabilities are computed: a run may fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unfit {
    TimeLock,
    InvariantBroken,
    WeightsZero,
    Zeno,
}

/// What a process can do: an edge, what it selects, and the leg if legs have labels.
pub(crate) type Output = (usize, i32, Option<usize>);

/// A network with the number of steps that a unit of time has, and the step from which on clocks
/// are alike.
pub(crate) struct Game<'n> {
    pub(crate) net: &'n Net,
    pub(crate) steps_in_unit: i32,
    pub(crate) last_step: u16,
}

impl Game<'_> {
    pub(crate) fn number(number: Number, state: &State, selected: i32) -> i32 {
        match number {
            Number::Constant(constant) => constant,
            Number::Plus(constant, variable) => constant + i32::from(state.variables[variable]),
            Number::Selected => selected,
        }
    }

    fn compare(left: i32, compare: Compare, right: i32) -> bool {
        match compare {
            Compare::AtLeast => left >= right,
            Compare::AtMost => left <= right,
            Compare::Equal => left == right,
        }
    }

    pub(super) fn is_true(&self, atom: Atom, state: &State, selected: i32) -> bool {
        match atom {
            Atom::Variable(variable, compare, number) => {
                let value = i32::from(state.variables[variable]);
                Self::compare(value, compare, Self::number(number, state, selected))
            }
            Atom::Clock(clock, compare, constant) => {
                let steps = i32::from(state.clocks[clock]);
                Self::compare(steps, compare, constant * self.steps_in_unit)
            }
        }
    }

    pub(crate) fn holds(&self, condition: &Condition, state: &State) -> bool {
        match condition {
            Condition::At(process, location) => usize::from(state.locations[*process]) == *location,
            Condition::Is(atom) => self.is_true(*atom, state, 0),
            Condition::All(all) => all.iter().all(|one| self.holds(one, state)),
            Condition::Any(any) => any.iter().any(|one| self.holds(one, state)),
        }
    }

    /// Whether a state decides what a path asks.
    pub(crate) fn decided(&self, path: &Path, state: &State) -> Option<bool> {
        match path {
            Path::Eventually(goal) => self.holds(goal, state).then_some(true),
            Path::Always(keep) => (!self.holds(keep, state)).then_some(false),
            Path::Until(keep, goal) => {
                if self.holds(goal, state) {
                    Some(true)
                } else {
                    (!self.holds(keep, state)).then_some(false)
                }
            }
        }
    }

    fn urgency(&self, process: usize, state: &State) -> Urgency {
        let location = usize::from(state.locations[process]);
        self.net.processes[process].locations[location].urgency
    }

    fn edges(&self, process: usize, state: &State) -> impl Iterator<Item = (usize, &Edge)> {
        let location = usize::from(state.locations[process]);
        let edges = self.net.processes[process].edges.iter().enumerate();
        edges.filter(move |(_, edge)| edge.source == location)
    }

    /// All that a process can do in its location, whatever guards say.
    fn instances(&self, process: usize, state: &State) -> Vec<Output> {
        let mut instances = Vec::new();
        for (number, edge) in self.edges(process, state) {
            for selected in 0..=edge.select.unwrap_or(0) {
                if edge.has_labelled_legs() {
                    let legs = 0..edge.branches.len();
                    instances.extend(legs.map(|leg| (number, selected, Some(leg))));
                } else {
                    instances.push((number, selected, None));
                }
            }
        }
        instances
    }

    /// The outputs of the location of a process, whatever their guards say.
    pub(crate) fn all_outputs(&self, process: usize, state: &State) -> Vec<Output> {
        let mut outputs = self.instances(process, state);
        outputs.retain(|&one| self.sync(process, one).is_none_or(|(_, sends)| sends));
        outputs
    }

    fn edge(&self, process: usize, (edge, ..): Output) -> &Edge {
        &self.net.processes[process].edges[edge]
    }

    /// The conditions of the edge and of the leg.
    pub(crate) fn guard(&self, process: usize, output: Output) -> impl Iterator<Item = &Atom> {
        let edge = self.edge(process, output);
        let leg = output.2.map(|leg| &edge.branches[leg].guard);
        edge.guard.iter().chain(leg.into_iter().flatten())
    }

    /// The synchronisation of the edge, or of the leg.
    fn sync(&self, process: usize, output: Output) -> Option<(usize, bool)> {
        let edge = self.edge(process, output);
        edge.sync
            .or(output.2.and_then(|leg| edge.branches[leg].sync))
    }

    pub(crate) fn is_urgent(&self, process: usize, output: Output) -> bool {
        let sync = self.sync(process, output);
        sync.is_some_and(|(channel, _)| self.net.channels[channel])
    }

    fn is_enabled(&self, process: usize, output: Output, state: &State) -> bool {
        let mut guard = self.guard(process, output);
        guard.all(|&atom| self.is_true(atom, state, output.1))
    }

    fn receivers(&self, process: usize, channel: usize, state: &State) -> Vec<Output> {
        let mut receivers = self.instances(process, state);
        receivers.retain(|&one| {
            self.sync(process, one) == Some((channel, false))
                && self.is_enabled(process, one, state)
        });
        receivers
    }

    /// How likely each of some instances of a process is: all edges with what they select are
    /// alike, and of the legs that one has among them each is as likely as its weight says.
    fn drawn(
        &self,
        process: usize,
        instances: &[Output],
        seen: &State,
    ) -> Result<Vec<(f64, Output)>, Unfit> {
        let mut entries: Vec<(usize, i32)> = instances.iter().map(|one| (one.0, one.1)).collect();
        entries.dedup();
        let share = 1.0 / entries.len() as f64;
        let mut drawn = Vec::new();
        for entry in entries {
            let legs = instances.iter().filter(|one| (one.0, one.1) == entry);
            let weight = |leg: usize| self.weight(process, (entry.0, entry.1, Some(leg)), seen);
            let weighted: Vec<(f64, Output)> =
                legs.map(|&one| (one.2.map_or(1.0, weight), one)).collect();
            let total: f64 = weighted.iter().map(|one| one.0).sum();
            if total == 0.0 {
                return Err(Unfit::WeightsZero);
            }
            drawn.extend(
                weighted
                    .into_iter()
                    .map(|(weight, one)| (share * weight / total, one)),
            );
        }
        Ok(drawn)
    }

    fn weight(&self, process: usize, output: Output, seen: &State) -> f64 {
        let branch = &self.edge(process, output).branches[output.2.unwrap_or(0)];
        let weight = branch.weight.map(|weight| Self::number(weight, seen, 0));
        weight.map_or(1.0, f64::from)
    }

    /// The outputs that are enabled.
    pub(crate) fn outputs(&self, process: usize, state: &State) -> Vec<Output> {
        let mut outputs = self.all_outputs(process, state);
        outputs.retain(|&one| self.is_enabled(process, one, state));
        outputs
    }

    /// The processes that move before any time passes; they are equally likely. Those in committed
    /// locations come first, then those whose delay is 0: in urgent locations, with an output on an
    /// urgent channel, or forced otherwise. If time stands still and there are none, all that can.
    pub(crate) fn at_once(
        &self,
        state: &State,
        is_forced: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<usize>, Unfit> {
        let processes = 0..self.net.processes.len();
        let able: Vec<usize> = processes
            .clone()
            .filter(|&one| !self.outputs(one, state).is_empty())
            .collect();
        let is = |urgency| move |one: &usize| self.urgency(*one, state) == urgency;
        let mut moving = able.clone();
        if processes.clone().any(|one| is(Urgency::Committed)(&one)) {
            moving.retain(is(Urgency::Committed));
        } else {
            moving.retain(|&one| {
                let outputs = self.outputs(one, state);
                let is_urgent = outputs.iter().any(|&output| self.is_urgent(one, output));
                is_urgent || is(Urgency::Urgent)(&one) || is_forced(one)
            });
            if moving.is_empty() && processes.clone().any(|one| is(Urgency::Urgent)(&one)) {
                moving = able;
            }
        }
        let is_frozen = processes.into_iter().any(|one| !is(Urgency::Normal)(&one));
        if is_frozen && moving.is_empty() {
            return Err(Unfit::TimeLock);
        }
        Ok(moving)
    }

    /// What a move of a process comes to, all its enabled outputs with the same chance. Guards see
    /// one state, and updates change the other, which differs in the clocks only.
    pub(crate) fn outcomes(
        &self,
        process: usize,
        seen: &State,
        changed: &State,
    ) -> Result<Vec<(f64, State)>, Unfit> {
        let outputs = self.outputs(process, seen);
        let mut outcomes = Vec::new();
        for (share, output) in self.drawn(process, &outputs, seen)? {
            let mut movers = vec![(process, vec![(1.0, output)])];
            if let Some((channel, _)) = self.sync(process, output) {
                for other in (0..self.net.processes.len()).filter(|&one| one != process) {
                    let ready = self.receivers(other, channel, seen);
                    if !ready.is_empty() {
                        movers.push((other, self.drawn(other, &ready, seen)?));
                    }
                }
            }
            self.add_outcomes(&movers, seen, (share, *changed, *changed), &mut outcomes)?;
        }
        outcomes.retain(|(chance, _)| *chance > 0.0);
        Ok(outcomes)
    }

    /// Lets the first mover choose, then the others. `reached` holds the variables and clocks,
    /// `targets` the locations.
    fn add_outcomes(
        &self,
        movers: &[(usize, Vec<(f64, Output)>)],
        seen: &State,
        (chance, reached, targets): (f64, State, State),
        outcomes: &mut Vec<(f64, State)>,
    ) -> Result<(), Unfit> {
        let Some(((process, choices), others)) = movers.split_first() else {
            let locations = targets.locations;
            outcomes.push((
                chance,
                State {
                    locations,
                    ..reached
                },
            ));
            return Ok(());
        };
        for &(likely, choice) in choices {
            let edge = self.edge(*process, choice);
            let weights: Vec<f64> = match choice.2 {
                Some(leg) => (0..edge.branches.len())
                    .map(|one| f64::from(u8::from(one == leg)))
                    .collect(),
                None => (0..edge.branches.len())
                    .map(|one| self.weight(*process, (choice.0, choice.1, Some(one)), seen))
                    .collect(),
            };
            let total: f64 = weights.iter().sum();
            if edge.branches.len() > 1 && total == 0.0 {
                return Err(Unfit::WeightsZero);
            }
            for (branch, weight) in edge.branches.iter().zip(weights) {
                let part = if edge.branches.len() > 1 {
                    weight / total
                } else {
                    1.0
                };
                if part == 0.0 {
                    continue;
                }
                let mut state = reached;
                for &update in edge.updates.iter().chain(&branch.updates) {
                    self.assign(update, choice.1, &mut state);
                }
                let mut targets = targets;
                targets.locations[*process] = branch.target as u8;
                let chance = chance * part * likely;
                self.add_outcomes(others, seen, (chance, state, targets), outcomes)?;
            }
        }
        Ok(())
    }

    fn assign(&self, update: Assignment, selected: i32, state: &mut State) {
        let (variable, value) = match update {
            Assignment::Set(variable, number) => (variable, Self::number(number, state, selected)),
            Assignment::Add(variable, number) => (
                variable,
                i32::from(state.variables[variable]) + Self::number(number, state, selected),
            ),
            Assignment::Clock(clock, value) => {
                state.clocks[clock] = (value * self.steps_in_unit) as u16;
                return;
            }
        };
        state.variables[variable] = (value % (self.net.greatest[variable] + 1)) as u8;
    }
}

//! What a strategy sees that no features were given for: the whole state.
//!
//! Locations, truth values, scalars, and integers with a range of at most [`MOST_VALUES`] are seen
//! exactly. All other integers, doubles and clocks are seen in intervals. What never changes is
//! left out, and what makes no difference to what may still happen and to what that costs
//! ([`Influence`]).

use crate::analysis::Influence;
use crate::exec::arithmetic::double_of_words;
use crate::ir::{
    Aim, Feature, FunctionId, Network, Observation, Optimum, Path, ProcessId, RunLimit, Seen, Shape,
};

/// An integer that can have more values is seen in intervals.
const MOST_VALUES: i64 = 33;

/// The observation of the whole state of a network in the stochastic reading, for a query. Where
/// the goal has to be reached in time, a clock that shows how much has passed is part of it.
pub fn whole_state(network: &Network, asked: &Optimum) -> Observation {
    let mut observation = whole_state_without_time(network, asked);
    let clock = clock_of_time(asked, network).filter(|_| asked.aim == Aim::Probability);
    let clock = clock.filter(|clock| !observation.continuous.contains(clock));
    observation.continuous.extend(clock);
    observation
}

/// The same, but a clock that nothing but the bound of the run depends on is left out.
pub(super) fn whole_state_without_time(network: &Network, asked: &Optimum) -> Observation {
    let mut finder = Finder {
        network,
        influence: Influence::new(network, functions(asked), asked.aim.number()),
        bound: asked.bound.limit,
        written: network.written_words(),
        observation: Observation::default(),
    };
    for (number, process) in (0..).zip(&network.processes) {
        if process.locations.len() > 1 {
            let text = format!("{}.location", process.name);
            finder.see(true, text, Seen::Location(ProcessId(number)));
        }
    }
    for variable in &network.layout.variables {
        finder.add(&variable.name, variable.offset, &variable.shape);
    }
    finder.observation
}

/// A clock that always shows how long the run has lasted, where time bounds it.
pub(super) fn clock_of_time(asked: &Optimum, network: &Network) -> Option<Feature> {
    if asked.bound.limit != RunLimit::Time {
        return None;
    }
    let written = network.written_words();
    let mut variables = network.layout.variables.iter();
    let found = variables.find(|variable| {
        let clock = variable.offset;
        let locations = &mut network.locations();
        network.chances.clocks.binary_search(&clock).is_ok()
            && !written[clock as usize]
            && double_of_words(
                network.initial[clock as usize],
                network.initial[clock as usize + 1],
            ) == 0.0
            && !locations.any(|one| one.chances.rated_clocks.contains(&clock))
    })?;
    Some(Feature {
        text: found.name.clone(),
        seen: Seen::Clock(found.offset),
    })
}

/// The functions by which a query decides when a run ends.
pub(super) fn functions(asked: &Optimum) -> Vec<FunctionId> {
    match &asked.goal {
        Some(Path::Eventually(goal)) => goal.function.into_iter().collect(),
        _ => Vec::new(),
    }
}

struct Finder<'n> {
    network: &'n Network,
    influence: Influence,
    bound: RunLimit,
    written: Vec<bool>,
    observation: Observation,
}

impl Finder<'_> {
    fn see(&mut self, is_exact: bool, text: String, seen: Seen) {
        let features = if is_exact {
            &mut self.observation.discrete
        } else {
            &mut self.observation.continuous
        };
        features.push(Feature { text, seen });
    }

    /// Whether what lies at a word may make a difference.
    fn counts(&self, offset: u32) -> bool {
        self.bound == RunLimit::Clock(offset) || self.influence.differs(offset)
    }

    fn add(&mut self, name: &str, offset: u32, shape: &Shape) {
        let text = name.to_owned();
        if self.network.chances.clocks.binary_search(&offset).is_ok() {
            if self.counts(offset) {
                self.see(false, text, Seen::Clock(offset));
            }
            return;
        }
        let is_seen = self.counts(offset) && self.written[offset as usize];
        match shape {
            Shape::Array {
                part,
                length,
                first,
                ..
            } => {
                for place in 0..*length {
                    let name = format!("{name}[{}]", i64::from(*first) + i64::from(place));
                    self.add(&name, offset + place * part.words(), part);
                }
            }
            Shape::Struct(fields) => {
                let mut offset = offset;
                for (field, shape) in fields {
                    self.add(&format!("{name}.{field}"), offset, shape);
                    offset += shape.words();
                }
            }
            _ if !is_seen => {}
            Shape::Double => self.see(false, text, Seen::Double(offset)),
            Shape::Bool | Shape::Scalar { .. } => self.see(true, text, Seen::Integer(offset)),
            Shape::Integer { low, high } => {
                let values = i64::from(*high) - i64::from(*low);
                self.see(values < MOST_VALUES, text, Seen::Integer(offset));
            }
        }
    }
}

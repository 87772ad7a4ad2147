//! What a strategy sees that no features were given for: the whole state.
//!
//! Locations, truth values, scalars, and integers with a range of at most [`MOST_VALUES`] are seen
//! exactly. All other integers, doubles and clocks are seen in intervals. What never changes is
//! left out, and what makes no difference to what may still happen and to what that costs
//! ([`Influence`]).

use crate::analysis::Influence;
use crate::ir::{
    Aim, Feature, FunctionId, Network, Observation, Optimum, Path, ProcessId, RunLimit, Seen, Shape,
};

/// An integer that can have more values is seen in intervals.
const MOST_VALUES: i64 = 33;

/// The observation of the whole state of a network in the stochastic reading, for a query. Where
/// the goal has to be reached in time, clocks that show how much has passed are part of it.
pub fn whole_state(network: &Network, asked: &Optimum) -> Observation {
    found(network, asked, asked.aim == Aim::Probability)
}

/// The same, but clocks that nothing but the bound of the run depends on are left out.
pub(super) fn whole_state_without_time(network: &Network, asked: &Optimum) -> Observation {
    found(network, asked, false)
}

fn found(network: &Network, asked: &Optimum, is_timed: bool) -> Observation {
    let number = match asked.aim {
        Aim::Expected(number) => Some(number),
        Aim::Time | Aim::Probability => None,
    };
    let mut finder = Finder {
        network,
        influence: Influence::new(network, functions(asked), number),
        bound: asked.bound.limit,
        is_timed,
        written: written(network),
        observation: Observation::default(),
    };
    for (number, process) in (0..).zip(&network.processes) {
        if process.locations.len() > 1 {
            finder.observation.discrete.push(Feature {
                text: format!("{}.location", process.name),
                seen: Seen::Location(ProcessId(number)),
            });
        }
    }
    for variable in &network.layout.variables {
        finder.add(&variable.name, variable.offset, &variable.shape);
    }
    finder.observation
}

/// The functions by which a query decides when a run ends.
pub(super) fn functions(asked: &Optimum) -> Vec<FunctionId> {
    match &asked.goal {
        Some(Path::Eventually(goal)) => goal.function.into_iter().collect(),
        _ => Vec::new(),
    }
}

/// By word: whether some edge may change it.
fn written(network: &Network) -> Vec<bool> {
    let mut written = vec![false; network.layout.words as usize];
    let around = [&network.before_update, &network.after_update];
    let branches = network.edges().flat_map(|edge| {
        let branches = edge.branches.iter().map(|branch| &branch.update);
        branches.chain([&edge.update])
    });
    for update in branches.chain(around.into_iter().flatten()) {
        for &(first, count) in &update.writes {
            written[first as usize..(first + count) as usize].fill(true);
        }
    }
    written
}

struct Finder<'n> {
    network: &'n Network,
    influence: Influence,
    bound: RunLimit,
    /// Whether the goal has to be reached in time.
    is_timed: bool,
    written: Vec<bool>,
    observation: Observation,
}

impl Finder<'_> {
    fn add(&mut self, name: &str, offset: u32, shape: &Shape) {
        let text = name.to_owned();
        let is_one = matches!(
            shape,
            Shape::Integer { .. } | Shape::Bool | Shape::Double | Shape::Scalar { .. }
        );
        let is_clock = self.network.chances.clocks.binary_search(&offset).is_ok();
        let is_bound = match self.bound {
            RunLimit::Clock(clock) => clock == offset,
            // How much time is left decides whether the goal is still reached.
            RunLimit::Time => is_clock && self.is_timed && !self.written[offset as usize],
            RunLimit::Moves => false,
        };
        if (is_one || is_clock) && !is_bound && !self.influence.differs(offset) {
            return;
        }
        if is_clock {
            let seen = Seen::Clock(offset);
            self.observation.continuous.push(Feature { text, seen });
            return;
        }
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
            _ if !self.written[offset as usize] => {}
            Shape::Double => {
                let seen = Seen::Double(offset);
                self.observation.continuous.push(Feature { text, seen });
            }
            Shape::Bool | Shape::Scalar { .. } => {
                let seen = Seen::Integer(offset);
                self.observation.discrete.push(Feature { text, seen });
            }
            Shape::Integer { low, high } => {
                let feature = Feature {
                    text,
                    seen: Seen::Integer(offset),
                };
                if i64::from(*high) - i64::from(*low) < MOST_VALUES {
                    self.observation.discrete.push(feature);
                } else {
                    self.observation.continuous.push(feature);
                }
            }
        }
    }
}

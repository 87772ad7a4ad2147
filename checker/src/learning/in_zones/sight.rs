//! What a learned strategy sees of a state of the symbolic reading.
//!
//! Its features are compiled in the stochastic reading. So the words that both readings have are
//! copied into a state of that one, and the features are read there. Features that depend on
//! anything else have no value in zones, clocks but for those that are compared alone.

use crate::analysis::function_reads::read_words;
use crate::exec::Executor;
use crate::ir::{Feature, Network, Seen};
use crate::learning::observation::{self, Sight};
use crate::learning::strategy::LearnedStrategy;
use crate::learning::tree::Node;
use crate::stochastic::{Correspondence, Failure, StateView};
use crate::zones::Bound;

/// Features that read more words are not seen in zones.
const MOST_READ_WORDS: usize = 1 << 16;

/// Why a learned strategy has no meaning in zones.
#[derive(Clone, Debug, PartialEq)]
pub enum NotInZones {
    /// The two readings of the model do not correspond.
    Readings,
    /// It sees this, which symbolic states do not have.
    Feature(String),
    /// It compares a clock with a number that zones do not have.
    Cut {
        /// The clock.
        text: String,
        /// The number.
        bound: f64,
    },
}

/// The stochastic reading of a model, in which strategies are learned.
#[derive(Clone, Copy)]
pub struct StochasticReading<'a> {
    /// Its network.
    pub network: &'a Network,
    /// Runs its code.
    pub executor: &'a dyn Executor,
}

/// Sees states of the symbolic reading.
pub(super) struct SymbolicSight<'a> {
    strategy: &'a LearnedStrategy,
    reading: StochasticReading<'a>,
    correspondence: Correspondence,
    /// A state of the stochastic reading.
    words: Vec<i32>,
    /// What each continuous feature is in zones.
    pub(super) continuous: Vec<Measured>,
    sight: Sight,
}

/// What a continuous feature is in zones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measured {
    /// No tree asks for it.
    Unused,
    /// It is this clock.
    Clock(usize),
    /// It has one value in a discrete state.
    Number,
}

impl<'a> SymbolicSight<'a> {
    /// The network is that of the symbolic reading.
    pub(super) fn new(
        strategy: &'a LearnedStrategy,
        symbolic: &Network,
        reading: StochasticReading<'a>,
    ) -> Result<SymbolicSight<'a>, NotInZones> {
        let network = reading.network;
        let correspondence = Correspondence::new(symbolic, network).ok_or(NotInZones::Readings)?;
        let is_shared = |feature: &Feature| match feature.seen {
            Seen::Location(_) => true,
            Seen::Integer(word) => correspondence.has(word),
            Seen::Double(_) | Seen::Clock(_) => false,
            Seen::Computed(function) => read_words(network, [function], MOST_READ_WORDS)
                .is_some_and(|words| words.iter().all(|&word| correspondence.has(word))),
        };
        let observation = &strategy.observation;
        if let Some(one) = observation.discrete.iter().find(|one| !is_shared(one)) {
            return Err(NotInZones::Feature(one.text.clone()));
        }
        let is_used = used(strategy);
        let continuous = observation.continuous.iter().zip(is_used);
        let continuous = continuous.map(|(feature, is_used)| match feature.seen {
            _ if !is_used => Ok(Measured::Unused),
            _ if is_shared(feature) => Ok(Measured::Number),
            Seen::Clock(word) => match correspondence.clock(word) {
                Some(clock) => Ok(Measured::Clock(clock.0 as usize)),
                None => Err(NotInZones::Feature(feature.text.clone())),
            },
            _ => Err(NotInZones::Feature(feature.text.clone())),
        });
        let continuous = continuous.collect::<Result<Vec<Measured>, NotInZones>>()?;
        let sight = SymbolicSight {
            words: network.initial.clone(),
            sight: Sight::default(),
            strategy,
            reading,
            correspondence,
            continuous,
        };
        match sight.first_broken_cut() {
            Some((text, bound)) => Err(NotInZones::Cut { text, bound }),
            None => Ok(sight),
        }
    }

    /// The bounds that clocks are compared with, each with the clock.
    pub(super) fn clock_cuts(&self) -> impl Iterator<Item = (usize, f64)> {
        cuts(self.strategy).filter_map(|(feature, bound)| match self.continuous[feature] {
            Measured::Clock(clock) => Some((clock, bound)),
            _ => None,
        })
    }

    /// A comparison of a clock that zones do not have: the clock, and the number.
    fn first_broken_cut(&self) -> Option<(String, f64)> {
        let fits = |bound: f64| {
            let is_integer = (bound - f64::from(bound as i32)).abs() == 0.0;
            is_integer && Bound::is_allowed(bound as i32)
        };
        let mut cuts = cuts(self.strategy);
        let broken = cuts.find(|&(feature, bound)| {
            matches!(self.continuous[feature], Measured::Clock(_)) && !fits(bound)
        });
        let text = |feature: usize| self.strategy.observation.continuous[feature].text.clone();
        broken.map(|(feature, bound)| (text(feature), bound))
    }

    /// Sees a state: its exact values as words, and its values in intervals, of which those of
    /// clocks say nothing.
    pub(super) fn look(&mut self, symbolic: &[i32]) -> Result<(&[i32], Vec<f64>), Failure> {
        self.correspondence.copy(symbolic, &mut self.words);
        let mut state = StateView {
            words: &mut self.words,
            executor: self.reading.executor,
            network: self.reading.network,
        };
        let observation = &self.strategy.observation;
        self.sight.look_exactly(observation, &mut state)?;
        let features = observation.continuous.iter().zip(&self.continuous);
        let point = features.map(|(feature, measured)| match measured {
            Measured::Number => observation::number(feature, &mut state),
            Measured::Unused | Measured::Clock(_) => Ok(0.0),
        });
        let point = point.collect::<Result<Vec<f64>, Failure>>()?;
        Ok((&self.sight.key, point))
    }
}

/// All cuts of a strategy: the feature, and the number it is compared with.
fn cuts(strategy: &LearnedStrategy) -> impl Iterator<Item = (usize, f64)> {
    let trees = strategy.regressors.iter().flat_map(|one| &one.appraisals);
    let nodes = trees.flat_map(|one| &one.tree);
    nodes.filter_map(|node| match *node {
        Node::Cut { feature, bound, .. } => Some((feature as usize, bound)),
        Node::Leaf(_) => None,
    })
}

/// Which of the continuous features some tree asks for.
fn used(strategy: &LearnedStrategy) -> Vec<bool> {
    let mut used = vec![false; strategy.observation.continuous.len()];
    for (feature, _) in cuts(strategy) {
        used[feature] = true;
    }
    used
}

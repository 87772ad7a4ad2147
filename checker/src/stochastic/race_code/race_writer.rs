//! What all that write the code of a race share.

use super::layout::Layout;
use super::writer::Writer;
use crate::ir::{FunctionId, Network, RegisterType};
use crate::stochastic::program::Program;
use crate::stochastic::readers::Reader;

/// The functions that let a process plan.
pub(super) struct Plans {
    /// Wherever it is.
    pub(super) anywhere: FunctionId,
    /// By location; none in committed ones.
    pub(super) by_location: Vec<Option<FunctionId>>,
}

/// The functions of a race, by process.
pub(super) struct Ids {
    pub(super) plans: Vec<Plans>,
    /// By location: what lets it move from there, if it can.
    pub(super) moves: Vec<Vec<Option<FunctionId>>>,
    pub(super) abilities: Vec<Option<FunctionId>>,
    /// What notes the possible moves of the controller, if somebody decides for it.
    pub(super) possible_moves: Option<FunctionId>,
    /// What carries out its moves.
    pub(super) chosen_moves: Vec<FunctionId>,
    /// What gives up unless its invariant holds, if it has any.
    pub(super) invariants: Vec<Option<FunctionId>>,
}

impl Ids {
    /// The number of the first location of a process, if those of all processes are counted.
    pub(super) fn first_location(&self, process: usize) -> usize {
        self.moves[..process].iter().map(Vec::len).sum()
    }
}

/// Writes the functions of a race.
pub(super) struct RaceWriter<'p, 'a> {
    pub(super) program: &'p Program<'a>,
    pub(super) layout: &'p Layout,
    /// Sets the rates of clocks, if some location does.
    pub(super) renewal_of_rates: Option<FunctionId>,
    /// The processes that can be in committed locations.
    pub(super) committing: Vec<usize>,
    /// Where the controller can move, if somebody decides for it.
    pub(super) deciders: Vec<Reader>,
}

impl<'a> RaceWriter<'_, 'a> {
    pub(super) fn network(&self) -> &'a Network {
        self.program.network
    }

    pub(super) fn writer(
        &self,
        name: &str,
        parameters: u32,
        result: Option<RegisterType>,
    ) -> Writer<'_> {
        Writer::new(name, parameters, result, self.layout)
    }
}

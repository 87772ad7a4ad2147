//! Stamps by layers: how far valuations are from the target.
//!
//! The solver computes nodes in a convenient order, and the stamps of gains follow that order. A
//! strategy that is read from these stamps is correct, but its paths may be longer than necessary,
//! and they depend on the order. In layers, all nodes gain at once what the earlier layers give
//! them. So a stamp is the least number of turns (a wait and then a move of either player) after
//! which play has reached the target, whatever the order of the search was.
//!
//! The cost is that of computing what the explored nodes win.

use crate::cancellation::{self, Cut};
use crate::network::Failure;
use crate::search::limits::Watch;

use crate::game::solver::Solver;

/// Computations between two checks of the limits.
const BETWEEN_LOOKS: u32 = 64;

impl Solver<'_, '_, '_> {
    /// Gives the gains of a game that the seeker wins stamps by layers, up to the first layer in
    /// which the initial valuation is won; returns whether it has. They stay as they are if a limit
    /// comes first, and if the target must recur.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub fn put_into_layers(&mut self, watch: &mut dyn Watch) -> Result<bool, Failure> {
        if self.sought.targets.is_some() || !self.is_won() {
            return Ok(false);
        }
        let before = std::mem::take(&mut self.won);
        let before_bytes = before.all_bytes();
        self.aside_bytes += before_bytes;
        self.forget_wins();
        let is_layered = match cancellation::unless_cut(|| self.gain_in_layers(watch)) {
            Ok(Err(Failure::Interrupted)) | Err(Cut) => false,
            Ok(result) => result?,
        };
        self.aside_bytes -= before_bytes;
        if !is_layered {
            self.won = before;
        }
        Ok(is_layered)
    }

    /// Whether the initial valuation is won before a limit comes.
    fn gain_in_layers(&mut self, watch: &mut dyn Watch) -> Result<bool, Failure> {
        let mut until_look = BETWEEN_LOOKS;
        for layer in 0.. {
            if self.is_won() {
                break;
            }
            let nodes = self.agenda.take_updates();
            if nodes.is_empty() {
                return Ok(false);
            }
            let mut gained = Vec::new();
            for node in nodes {
                if !self.may_gain(node) {
                    continue;
                }
                match self.quick(node) {
                    Some(true) => gained.push((node, None)),
                    Some(false) => {}
                    None => {
                        let situation = self.situation_for_win(node)?;
                        let won = self.winnable(node, &situation);
                        gained.push((node, Some(self.gained(node, won))));
                    }
                }
                until_look -= 1;
                if until_look == 0 {
                    until_look = BETWEEN_LOOKS;
                    if self.tell(watch).is_some() {
                        return Ok(false);
                    }
                }
            }
            for (node, one) in gained {
                // All gains of a layer have one stamp.
                self.won.stamp = layer;
                match one {
                    None => self.gain_everything(node),
                    Some(one) => self.gain(node, one),
                }
            }
        }
        Ok(true)
    }
}

//! The plans of a list as JSON, one after the other.
//!
//! Each is fired from where it leaves the plan before it, so that its last state is known.

use serde_json::Value as Json;

use crate::game::strategy::plan_list::PlanWalk;
use crate::network::{Failure, Stepper};

use crate::engine::format::json;
use crate::engine::loaded_model::LoadedModel;

/// Writes the plans of a list.
#[derive(Clone, Debug)]
pub struct PlanTexts {
    /// The plans that were not given yet.
    pub walk: PlanWalk,
    /// The chains of the last plan, each with the words after it.
    fired: Vec<(u32, Vec<i32>)>,
}

impl PlanTexts {
    /// The plans that a walk has not given yet.
    pub fn new(walk: PlanWalk) -> PlanTexts {
        PlanTexts {
            walk,
            fired: Vec::new(),
        }
    }

    /// The next plans, at most `most`; none after the last.
    ///
    /// # Errors
    /// The model fails, which it did not when the plans were found.
    pub fn next(&mut self, model: &LoadedModel, most: usize) -> Result<Vec<Json>, Failure> {
        let network = model.network();
        let mut stepper = Stepper::new(network, model.executor());
        let mut texts = Vec::new();
        while texts.len() < most {
            let Some(chains) = self.walk.next_plan() else {
                break;
            };
            let chains = chains.to_vec();
            let list = self.walk.list();
            let shared = self.fired.iter().zip(&chains);
            let shared = shared
                .take_while(|(fired, chain)| fired.0 == **chain)
                .count();
            self.fired.truncate(shared);
            for &chain in &chains[shared..] {
                let last = self.fired.last().map(|(_, words)| words);
                let mut words = last.unwrap_or(&network.initial).clone();
                for &step in &list.chains()[chain as usize] {
                    stepper.fire(&list.steps()[step as usize].parts, &mut words)?;
                }
                self.fired.push((chain, words));
            }
            let end = self.fired.last().map(|(_, words)| words);
            let steps = chains
                .iter()
                .flat_map(|&chain| &list.chains()[chain as usize]);
            let steps = steps.map(|&step| &list.steps()[step as usize]);
            texts.push(json::plan(network, steps, end.unwrap_or(&network.initial)));
        }
        Ok(texts)
    }
}

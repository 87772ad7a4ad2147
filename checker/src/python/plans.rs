//! Plans are gone through, page by page.

use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::convert::{StepEntry, step_entry, until_signal};
use super::model::{Model, failed};
use crate::engine::session::plan_texts::PlanTexts;

/// The plans of an answer that were not given yet.
#[pyclass(module = "ntagen._checker")]
pub(super) struct Plans {
    pub(super) model: Py<Model>,
    pub(super) texts: PlanTexts,
}

#[pymethods]
impl Plans {
    /// The distinct steps that leave a state without committed locations, and the chains of them
    /// that plans consist of, as indices of steps.
    fn chains(&self) -> (Vec<StepEntry>, Vec<Vec<usize>>) {
        let list = self.texts.walk.list();
        let mut numbers = Vec::new();
        let mut steps = Vec::new();
        self.model.get().with(|model| {
            for step in list.steps() {
                numbers.push((!step.was_committed).then_some(steps.len()));
                if !step.was_committed {
                    steps.push(step_entry(model.network(), &step.parts));
                }
            }
        });
        let chains = list.chains().iter().map(|chain| {
            let steps = chain.iter().filter_map(|&step| numbers[step as usize]);
            steps.collect()
        });
        (steps, chains.collect())
    }

    /// The next plans, at most `most`: of each the number of its chains, and then the chains of
    /// all. Both are integers of four bytes. Empty after the last plan.
    fn page<'py>(
        &mut self,
        py: Python<'py>,
        most: usize,
    ) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let walk = &mut self.texts.walk;
        let (lengths, chains) = until_signal(py, || {
            let (mut lengths, mut chains) = (Vec::new(), Vec::new());
            for _ in 0..most {
                let Some(plan) = walk.next_plan() else { break };
                lengths.extend((plan.len() as u32).to_ne_bytes());
                chains.extend(plan.iter().flat_map(|chain| chain.to_ne_bytes()));
            }
            (lengths, chains)
        })?;
        Ok((PyBytes::new(py, &lengths), PyBytes::new(py, &chains)))
    }

    /// The next plans as JSON, at most `most`; empty after the last.
    fn page_json(&mut self, py: Python<'_>, most: usize) -> PyResult<Vec<String>> {
        let texts = &mut self.texts;
        let model = self.model.get();
        let page = until_signal(py, || {
            model.with(|model| {
                let plans = texts.next(model, most);
                plans.map_err(|failure| failed(model, failure))
            })
        })?;
        Ok(page?.iter().map(ToString::to_string).collect())
    }
}

//! Code that sets the rates of clocks, as `stochastic/race/transition.rs` says it, where each clock
//! has its rate from one process only.

use std::collections::BTreeSet;

use super::race_writer::RaceWriter;
use super::writer::Writer;
use crate::ir::{Function, IntegerOperator, Relation};
use crate::stochastic::program::Program;
use crate::stochastic::rules::{self, Backend};

/// The clocks whose rates some location of a process sets.
fn clocks_of(program: &Program<'_>, process: u32) -> BTreeSet<u32> {
    let locations = &program.network.processes[process as usize].locations;
    let clocks = locations.iter().flat_map(|one| &one.chances.rated_clocks);
    clocks.copied().collect()
}

/// The clocks with rates that are set, by the process that sets them; `None` if some clock has its
/// rate from several.
pub(super) fn rated_clocks(program: &Program<'_>) -> Option<Vec<(u32, u32)>> {
    let mut found = Vec::new();
    for &process in &program.rated {
        let clocks = clocks_of(program, process);
        found.extend(clocks.into_iter().map(|clock| (process, clock)));
    }
    let different: BTreeSet<u32> = found.iter().map(|&(_, clock)| clock).collect();
    (different.len() == found.len()).then_some(found)
}

impl RaceWriter<'_, '_> {
    /// The function that lets those set rates who plan anew, and finds whose plans that concerns.
    pub(super) fn renewal_of_rates(&self) -> Function {
        let mut writer = self.writer("rates of clocks", 0, None);
        let w = &mut writer;
        for &process in &self.program.rated {
            let (word, bit) = self.layout.stale_bit(process as usize);
            let (marked, bit) = (w.load(word), w.integer(bit));
            let is_stale = w.arithmetic(IntegerOperator::And, marked, bit);
            w.when(is_stale, |w| self.set_rates(w, process));
        }
        w.return_value(None);
        writer.finish()
    }

    fn set_rates(&self, w: &mut Writer<'_>, process: u32) {
        let clocks = clocks_of(self.program, process);
        for &clock in &clocks {
            let before = w.load_real(clock + 2);
            w.store_double(self.layout.rate_before(clock), before);
            let one = w.real(1.0);
            w.store_double(clock + 2, one);
        }
        let location = w.load(process);
        let locations = &self.network().processes[process as usize].locations;
        let Ok(()) = w.cases(location, locations.len(), |w, location| {
            let chances = &locations[location].chances;
            if let Some(rates) = chances.rates {
                w.call(rates, &[]);
                for &clock in &chances.rated_clocks {
                    let rate = w.load_real(clock + 2);
                    let size = rules::size(w, rate);
                    let is_finite = w.compare_real_to(size, Relation::Less, f64::INFINITY);
                    w.insist(is_finite);
                }
            }
            Ok(())
        });
        for clock in clocks {
            let Some(readers) = self.program.rate_readers.get(&clock) else {
                continue;
            };
            let is_same = w.same_words(self.layout.rate_before(clock), clock + 2, 2);
            let is_other = w.compare_to(is_same, Relation::Equal, 0);
            w.when(is_other, |w| self.mark_readers(w, readers, None));
        }
    }
}

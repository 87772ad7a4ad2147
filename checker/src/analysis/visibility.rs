//! What a predicate watches: which steps of the network may make it come true, and which may make
//! it false again.

use crate::ir::{ClockChoice, FunctionId, LocationId, Network, Predicate, ProcessId};

use super::cells::{CellNumbers, Cells};

/// What decides a predicate.
///
/// Where `deadlock` is needed for it, nothing is watched: in a deadlock no move is possible, so
/// that whatever remains possible keeps the predicate from coming true.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watched {
    /// What its code reads and the clocks that it compares.
    cells: Cells,
    /// The locations whose being entered, or (false) left, may make it come true.
    locations: Vec<(ProcessId, LocationId, bool)>,
    /// Whether both count as both, since code that is evaluated might fail.
    is_two_way: bool,
}

impl Watched {
    /// What a predicate watches; `None` if `deadlock` stands where it must *not* hold.
    pub(crate) fn new(network: &Network, predicate: &Predicate) -> Option<Watched> {
        let mut watched = Watched::default();
        watched.add(CellNumbers::new(network), predicate, true)?;
        watched.cells.settle();
        Some(watched)
    }

    fn add(&mut self, numbers: CellNumbers<'_>, predicate: &Predicate, wanted: bool) -> Option<()> {
        if needs_deadlock(predicate, wanted) {
            return Some(());
        }
        match predicate {
            Predicate::Constant(_) => {}
            Predicate::Data(function) => self.add_code(numbers, *function),
            &Predicate::Location(process, location) => {
                self.locations.push((process, location, wanted));
            }
            Predicate::Clock(clock) => {
                self.add_code(numbers, clock.bound);
                for side in [clock.left, clock.right] {
                    numbers.add_clocks(side.clocks(), &mut self.cells);
                    if let ClockChoice::Indexed(_, function) = side {
                        self.add_code(numbers, function);
                    }
                }
            }
            Predicate::Deadlock => return None,
            Predicate::Not(inner) => self.add(numbers, inner, !wanted)?,
            Predicate::And(parts) | Predicate::Or(parts) => {
                for part in parts {
                    self.add(numbers, part, wanted)?;
                }
            }
        }
        Some(())
    }

    fn add_code(&mut self, numbers: CellNumbers<'_>, function: FunctionId) {
        self.is_two_way = true;
        numbers.add_reads([function], &mut self.cells);
    }

    /// Whether one of these cells is watched.
    pub(super) fn reads(&self, cells: &Cells) -> bool {
        self.cells.meet(cells)
    }

    /// Whether a process's going from one location to another may make the predicate come true.
    pub(super) fn may_be_fulfilled(
        &self,
        process: ProcessId,
        source: LocationId,
        target: LocationId,
    ) -> bool {
        source != target
            && self.locations.iter().any(|&(owner, location, enters)| {
                let (here, there) = if enters {
                    (target, source)
                } else {
                    (source, target)
                };
                owner == process && (location == here || self.is_two_way && location == there)
            })
    }
}

/// Whether a predicate's coming out as `wanted` needs a deadlock.
fn needs_deadlock(predicate: &Predicate, wanted: bool) -> bool {
    let one_of = |parts: &[Predicate]| parts.iter().any(|part| needs_deadlock(part, wanted));
    let each_of = |parts: &[Predicate]| {
        !parts.is_empty() && parts.iter().all(|part| needs_deadlock(part, wanted))
    };
    match predicate {
        Predicate::Deadlock => wanted,
        Predicate::Not(inner) => needs_deadlock(inner, !wanted),
        Predicate::And(parts) if wanted => one_of(parts),
        Predicate::And(parts) => each_of(parts),
        Predicate::Or(parts) if wanted => each_of(parts),
        Predicate::Or(parts) => one_of(parts),
        Predicate::Data(_)
        | Predicate::Constant(_)
        | Predicate::Location(..)
        | Predicate::Clock(_) => false,
    }
}

//! Regions: a finite set of valuations that stands for all.
//!
//! Two valuations are equivalent if the same moves are possible now and after every delay (with
//! suitable other delays). With constraints on integer constants, what matters of a valuation is
//! the integer parts of the clocks and the order of their fractional parts, and whether they are 0.
//! So each region has a representative on a grid of `1 / (2 (n + 1))` for n clocks: the k-th
//! smallest of the different fractional parts other than 0 becomes `2 k` ticks, and the odd ticks
//! are where they go while those clocks that were integers are on their way. A plain grid without
//! this renaming would be wrong for strict constraints, however fine: a run may need fractional
//! parts that grow forever below another one.
//!
//! Two things make the set finite:
//! * [`Bounding::Values`], without comparisons of clock differences: a clock above the greatest
//!   constant K stays just above it.
//! * [`Bounding::Gaps`], with them: where the sorted values have a gap of more than `K + R` (R: the
//!   greatest value that a clock is set to), the gap is shortened by whole units. Differences that
//!   are changed are above K before and after, and stay so when a clock is set.
//! * [`Bounding::Nothing`]: the set may be infinite; needed where copies with an increment meet
//!   comparisons of differences.
//!
//! Source: R. Alur, D. Dill, "A theory of timed automata", TCS 126, 1994, section 4; P. Bouyer, C.
//! Dufourd, E. Fleury, A. Petit, "Updatable timed automata", TCS 321, 2004 (differences and
//! copies).

use crate::ir::{AssignedValue, ClockAssignment, ClockAtom, Edge, Network, Update};

use super::moves::{Error, State};

/// What keeps the set of representatives finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounding {
    /// Values above the greatest constant, in units, are one.
    Values(i64),
    /// Gaps between sorted values above this number of units are shortened.
    Gaps(i64),
    /// Nothing.
    Nothing,
}

/// The regions of a number of clocks.
#[derive(Clone, Copy, Debug)]
pub struct Regions {
    ticks_per_unit: i64,
    bounding: Bounding,
    /// Whether different values are never equivalent, unless the bounding makes them so.
    keeps_values: bool,
}

impl Regions {
    /// The ticks that a unit of time needs for the clocks of a network.
    pub fn ticks_per_unit(network: &Network) -> i64 {
        2 * network.clocks.len().max(1) as i64
    }

    /// The regions that distinguish what the network distinguishes, and comparisons of a clock with
    /// constants up to `constant`, or of two clocks if `has_differences`.
    pub fn new(network: &Network, constant: i64, has_differences: bool) -> Result<Regions, Error> {
        if network.features.stopwatches {
            return Err(Error::Unsupported("stopwatches"));
        }
        Ok(Regions::with_bounding(network, constant, has_differences))
    }

    /// Sets that stand for all with stopwatches too; there may be infinitely many of them. Clocks
    /// have the same values, or both are above the greatest constant if no two are compared. So
    /// they do after the same delays, and if they stand still.
    pub fn of_values(network: &Network, constant: i64, has_differences: bool) -> Regions {
        let regions = Regions::with_bounding(network, constant, has_differences);
        Regions {
            bounding: match regions.bounding {
                Bounding::Gaps(_) => Bounding::Nothing,
                other => other,
            },
            keeps_values: true,
            ..regions
        }
    }

    fn with_bounding(network: &Network, constant: i64, has_differences: bool) -> Regions {
        let constant = constants(network).max(constant);
        let (set, increment, decrement) = assigned(network);
        let bounding = if network.features.diagonals || has_differences {
            if increment || decrement {
                Bounding::Nothing
            } else {
                Bounding::Gaps(constant + set)
            }
        } else if decrement {
            Bounding::Nothing
        } else {
            Bounding::Values(constant)
        };
        Regions {
            ticks_per_unit: Regions::ticks_per_unit(network),
            bounding,
            keeps_values: false,
        }
    }

    /// The same regions for another number of ticks in a unit, which must be more than twice the
    /// number of clocks.
    #[must_use]
    pub fn with_ticks_per_unit(self, ticks_per_unit: i64) -> Regions {
        Regions {
            ticks_per_unit,
            ..self
        }
    }

    /// What keeps the set finite.
    pub fn bounding(&self) -> Bounding {
        self.bounding
    }

    /// Replaces the clock values by the representative of their region.
    pub fn represent(&self, clocks: &mut [i64]) {
        let unit = self.ticks_per_unit;
        if let Bounding::Values(constant) = self.bounding {
            for clock in &mut clocks[1..] {
                if *clock > constant * unit {
                    *clock = (constant + 1) * unit;
                }
            }
        }
        if self.keeps_values {
            return;
        }
        let mut fractions: Vec<i64> = clocks.iter().map(|clock| clock % unit).collect();
        fractions.push(0);
        fractions.sort_unstable();
        fractions.dedup();
        for clock in &mut *clocks {
            let rank = fractions
                .binary_search(&(*clock % unit))
                .expect("every fractional part is in the list");
            *clock = *clock / unit * unit + 2 * rank as i64;
        }
        if let Bounding::Gaps(longest) = self.bounding {
            shorten_gaps(clocks, longest * unit, unit);
        }
    }

    /// Lets time pass to the next region; false if the region is its own successor.
    pub fn pass(&self, clocks: &mut [i64]) -> bool {
        let unit = self.ticks_per_unit;
        let is_running = |clock: i64| self.is_running(clock);
        let fractions = clocks[1..].iter().filter(|&&clock| is_running(clock));
        let fractions: Vec<i64> = fractions.map(|clock| clock % unit).collect();
        let Some(&greatest) = fractions.iter().max() else {
            return false;
        };
        // From integers into the open; or on until the clock with the greatest fractional part is
        // an integer.
        let ticks = if fractions.contains(&0) {
            1
        } else {
            unit - greatest
        };
        for clock in &mut clocks[1..] {
            if is_running(*clock) {
                *clock += ticks;
            }
        }
        self.represent(clocks);
        true
    }

    /// Whether the next region, unlike this one, lasts: some clock leaves an integer, and time
    /// passes within the next region.
    pub fn opens(&self, clocks: &[i64]) -> bool {
        let is_integer = |clock: &i64| *clock % self.ticks_per_unit == 0;
        let mut running = clocks[1..].iter().filter(|&&clock| self.is_running(clock));
        running.any(is_integer)
    }

    fn is_running(&self, clock: i64) -> bool {
        match self.bounding {
            Bounding::Values(constant) => clock <= constant * self.ticks_per_unit,
            Bounding::Gaps(_) | Bounding::Nothing => true,
        }
    }

    /// As [`Regions::represent`], for a whole state.
    pub fn represent_state(&self, state: &mut State) {
        self.represent(&mut state.clocks);
    }
}

/// Shortens gaps between the sorted values that are longer than `longest` by whole units to at most
/// one unit more.
fn shorten_gaps(clocks: &mut [i64], longest: i64, unit: i64) {
    let mut order: Vec<usize> = (0..clocks.len()).collect();
    order.sort_by_key(|&clock| clocks[clock]);
    let mut cut = 0;
    let mut previous = 0;
    for clock in order {
        let value = clocks[clock];
        let gap = value - previous;
        if gap > longest {
            cut += (gap - longest - 1) / unit * unit;
        }
        previous = value;
        clocks[clock] -= cut;
    }
}

/// The clock comparisons of guards and invariants.
pub(super) fn atoms(network: &Network) -> impl Iterator<Item = &ClockAtom> {
    let processes = network.processes.iter();
    processes.flat_map(|process| {
        let guards = process.edges.iter().map(|edge| &edge.guard);
        let invariants = process.locations.iter().map(|location| &location.invariant);
        guards.chain(invariants).flat_map(|guard| &guard.atoms)
    })
}

/// The greatest constant, in absolute value, that guards and invariants compare clocks with.
fn constants(network: &Network) -> i64 {
    atoms(network).map(greatest_constant).max().unwrap_or(0)
}

/// The greatest constant of a comparison, in absolute value.
pub fn greatest_constant(atom: &ClockAtom) -> i64 {
    i64::from(atom.low).abs().max(i64::from(atom.high).abs())
}

/// The assignments to clocks of all updates.
pub(super) fn assignments(network: &Network) -> impl Iterator<Item = &ClockAssignment> {
    let edges = network.processes.iter().flat_map(|process| &process.edges);
    let hooks = network.before_update.iter().chain(&network.after_update);
    let updates = edges.flat_map(updates_of).chain(hooks);
    updates.flat_map(|update| &update.assignments)
}

/// The greatest value that a clock is set to, at the start included, and whether some copy adds or
/// takes away something.
fn assigned(network: &Network) -> (i64, bool, bool) {
    let initial = network.initial_clocks.iter().max();
    let mut result = (initial.map_or(0, |&value| i64::from(value)), false, false);
    for assignment in assignments(network) {
        match assignment.value {
            AssignedValue::Integer(_, high) => result.0 = result.0.max(i64::from(high)),
            AssignedValue::Clock(_, low, high) => {
                result.1 |= high > 0;
                result.2 |= low < 0;
            }
        }
    }
    result
}

fn updates_of(edge: &Edge) -> impl Iterator<Item = &Update> {
    std::iter::once(&edge.update).chain(edge.branches.iter().map(|branch| &branch.update))
}

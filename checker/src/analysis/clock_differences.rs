//! The comparisons of two clocks, location by location: along them zones are cut before
//! extrapolation.
//!
//! A comparison `x - y ≺ c` of a guard or invariant matters in a location if some path from there
//! may evaluate it before x or y is certainly set to a constant; after that it compares one clock
//! with a constant, which the ceilings cover ([`super::clock_bounds`]). A comparison of a query
//! matters everywhere. With assignments from clock to clock a comparison of the target is one of
//! the source, and all matter everywhere.
//!
//! A bound that the words decide stands forevery value that it may take. Where that makes more
//! comparisons than `MOST_DIFFERENCES`, there is no such abstraction, and exploring may not end.
//!
//! Source: J. Bengtsson, W. Yi, "On Clock Difference Constraints and Termination in Reachability
//! Analysis of Timed Automata", ICFEM 2003.

use std::collections::BTreeSet;

use crate::ir::{AssignedValue, ClockAtom, ClockRange, Edge, Network, Process};
use crate::zones::Bound;
use crate::zones::dbm::Constraint;

/// Comparisons of a network, at most.
const MOST_DIFFERENCES: usize = 256;

/// The comparisons of two clocks that matter in each location.
#[derive(Clone, Debug, Default)]
pub(super) struct Differences {
    /// By process and location.
    locations: Vec<Vec<BTreeSet<Constraint>>>,
    /// Those that matter everywhere.
    everywhere: BTreeSet<Constraint>,
    /// The greatest constant that a clock may be set to.
    pub(super) greatest_reset: i32,
}

impl Differences {
    /// Those of a network and of the comparisons of a query; `None` if there are too many.
    pub(super) fn new(network: &Network, atoms: &[ClockAtom]) -> Option<Differences> {
        let mut found = Differences {
            greatest_reset: greatest_reset(network),
            ..Differences::default()
        };
        for atom in atoms {
            collect(atom, &mut found.everywhere)?;
        }
        for process in &network.processes {
            found.locations.push(fixpoint(process)?);
        }
        if network.features.clock_copies {
            found.spread_over_copies(network)?;
        }
        let all = found.locations.iter().flatten().chain([&found.everywhere]);
        let count = all.flatten().collect::<BTreeSet<_>>().len();
        (count <= MOST_DIFFERENCES).then_some(found)
    }

    /// Those that matter in a state with these words.
    pub(super) fn of(&self, words: &[i32]) -> Vec<Constraint> {
        let mut all = self.everywhere.clone();
        for (locations, &location) in self.locations.iter().zip(words) {
            all.extend(&locations[location as usize]);
        }
        all.into_iter().collect()
    }

    /// With `x := y + k` each comparison of x becomes one of y, everywhere; `None` if that does not
    /// end soon.
    fn spread_over_copies(&mut self, network: &Network) -> Option<()> {
        let all = std::mem::take(&mut self.locations);
        self.everywhere.extend(all.into_iter().flatten().flatten());
        let assignments = network.updates().flat_map(|update| &update.assignments);
        let assignments: Vec<_> = assignments.collect();
        loop {
            let mut more = self.everywhere.clone();
            for assignment in &assignments {
                if let AssignedValue::Clock(source, low, high) = assignment.value {
                    if i64::from(high) - i64::from(low) > MOST_DIFFERENCES as i64 {
                        return None;
                    }
                    for source in clocks(source) {
                        for increment in low..=high {
                            for one in &self.everywhere {
                                substitute(one, assignment.target, source, increment, &mut more);
                            }
                        }
                    }
                }
            }
            if more.len() > MOST_DIFFERENCES {
                return None;
            }
            if more.len() == self.everywhere.len() {
                return Some(());
            }
            self.everywhere = more;
        }
    }
}

fn clocks(range: ClockRange) -> impl Iterator<Item = usize> {
    (range.first.0..range.first.0 + range.count).map(|clock| clock as usize)
}

/// Adds what a comparison says of the source if a clock of the range was set to it plus the
/// increment.
fn substitute(
    one: &Constraint,
    target: ClockRange,
    source: usize,
    increment: i32,
    into: &mut BTreeSet<Constraint>,
) {
    let &Constraint { left, right, bound } = one;
    let is_target = |clock: usize| clocks(target).any(|one| one == clock);
    if is_target(left) && source != right {
        into.insert(canonical(
            source,
            right,
            bound.shifted(increment.saturating_neg()),
        ));
    }
    if is_target(right) && source != left {
        into.insert(canonical(left, source, bound.shifted(increment)));
    }
}

/// The greatest constant that a clock may be set to, increments of copies included.
pub fn greatest_reset(network: &Network) -> i32 {
    let assignments = network.updates().flat_map(|update| &update.assignments);
    let constants = assignments.map(|assignment| match assignment.value {
        AssignedValue::Integer(_, high) => high,
        AssignedValue::Clock(_, _, increment) => increment.saturating_abs(),
    });
    let initial = network.initial_clocks.iter().copied();
    constants.chain(initial).max().unwrap_or(0).max(0)
}

/// A value that no constant exceeds with which clocks are compared or to which they are set.
pub fn greatest_constant(network: &Network) -> i32 {
    let guards = network.processes.iter().flat_map(|process| {
        let edges = process.edges.iter().map(|edge| &edge.guard);
        edges.chain(process.locations.iter().map(|location| &location.invariant))
    });
    let atoms = guards.flat_map(|guard| &guard.atoms);
    let greatest = atoms.map(greatest_in_atom).max().unwrap_or(0);
    greatest.saturating_add(greatest_reset(network))
}

/// The greatest absolute value of the constants of a comparison.
pub fn greatest_in_atom(atom: &ClockAtom) -> i32 {
    atom.low.saturating_abs().max(atom.high.saturating_abs())
}

/// Adds the comparisons that an atom stands for, if it is one of two clocks; `None` if there are
/// too many.
fn collect(atom: &ClockAtom, into: &mut BTreeSet<Constraint>) -> Option<()> {
    if !atom.is_difference() {
        return Some(());
    }
    let values = i64::from(atom.high) - i64::from(atom.low) + 1;
    let pairs = i64::from(atom.left.count) * i64::from(atom.right.count);
    if values.checked_mul(pairs)? > MOST_DIFFERENCES as i64 {
        return None;
    }
    for left in clocks(atom.left) {
        for right in clocks(atom.right) {
            for value in atom.low..=atom.high {
                let bound = if atom.strict {
                    Bound::strict(value)
                } else {
                    Bound::weak(value)
                };
                // A comparison with more than zones can hold is a failure where it is evaluated.
                if let Some(bound) = bound.filter(|_| left != right && left != 0 && right != 0) {
                    into.insert(canonical(left, right, bound));
                }
            }
        }
    }
    Some(())
}

/// A comparison and its complement cut alike: of both, the one whose left clock comes first.
fn canonical(left: usize, right: usize, bound: Bound) -> Constraint {
    let (left, right, bound) = if left < right {
        (left, right, bound)
    } else {
        (right, left, bound.negated())
    };
    Constraint { left, right, bound }
}

/// Those of each location of a process: of its invariant and the guards of its edges, and those of
/// every target that survive the edge.
fn fixpoint(process: &Process) -> Option<Vec<BTreeSet<Constraint>>> {
    let mut table = vec![BTreeSet::new(); process.locations.len()];
    for (location, found) in process.locations.iter().zip(&mut table) {
        for atom in &location.invariant.atoms {
            collect(atom, found)?;
        }
        for edge in &location.edges {
            for atom in &process.edges[edge.0 as usize].guard.atoms {
                collect(atom, found)?;
            }
        }
    }
    loop {
        let mut changed = false;
        for edge in &process.edges {
            for branch in 0..edge.branches.len() {
                changed |= propagate(edge, branch, &mut table);
            }
        }
        if !changed {
            return Some(table);
        }
    }
}

fn propagate(edge: &Edge, branch: usize, table: &mut [BTreeSet<Constraint>]) -> bool {
    let (source, target) = (
        edge.source.0 as usize,
        edge.branches[branch].target.0 as usize,
    );
    let resets = edge
        .update
        .fixed
        .iter()
        .chain(&edge.branches[branch].update.fixed);
    let resets: Vec<usize> = resets.map(|&(clock, _)| clock.0 as usize).collect();
    let survives = |one: &&Constraint| !resets.contains(&one.left) && !resets.contains(&one.right);
    let kept: Vec<Constraint> = table[target].iter().filter(survives).copied().collect();
    let before = table[source].len();
    table[source].extend(kept);
    table[source].len() != before
}

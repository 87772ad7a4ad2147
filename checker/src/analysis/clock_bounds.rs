//! Clock bounds for extrapolation: the constants that matter to each clock, location by location.
//!
//! For a process in location l and a clock x, `lower` is the greatest c of a comparison `x > c` or
//! `x >= c`, and `upper` of a comparison `x < c` or `x <= c`, that some path from l may evaluate
//! before x is assigned; an edge whose guard is known never to hold is on no path. Bounds of a
//! state are the greatest over its processes. A clock without bounds is *inactive*: its value no
//! longer matters.
//!
//! Source: G. Behrmann, P. Bouyer, E. Fleury, K. G. Larsen, "Static guard analysis in timed
//! automata verification", TACAS 2003 (the fixpoint over locations), and G. Behrmann, P. Bouyer, K.
//! G. Larsen, R. Pelánek, "Lower and upper bounds in zone-based abstractions of timed automata",
//! STTT 8, 2006 (lower and upper bounds apart). Where we differ: locations are taken apart by the
//! values of variables on which comparisons hang ([`super::location_splitting`]), and what all
//! partners of a synchronisation reset counts as reset ([`super::joint_resets`]); with assignments
//! from clock to clock the bounds do not depend on locations.
//!
//! Invariant: an assignment counts as a reset only if it is certain (among
//! [`crate::ir::Update::fixed`]).

use crate::ir::{AssignedValue, ClockAssignment, ClockAtom, Edge, Network, Process};
use crate::tuning::Tuning;
use crate::zones::extrapolate::{Ceiling, Ceilings};
use crate::zones::{Bound, Federation, extrapolate};

use rustc_hash::FxHashMap;

use super::clock_differences::Differences;
use super::joint_resets::{self, Partners};
use super::location_splitting::{SplitStep, Splitting, Tracked, Valuations};

/// No comparison: the clock is inactive in this direction.
const NONE: i32 = i32::MIN;

/// Which abstraction is applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abstraction {
    /// None: the zone graph may be infinite.
    Exact,
    /// Extra-M+, and a little further ([`crate::zones::extrapolate::lu_plus`]): keeps what
    /// comparisons with the greatest constant can tell.
    Maximum,
    /// Extra-LU+, and a little further: keeps what reachability of locations needs.
    LowerUpper,
    /// Extra-M on the parts of a zone on either side of every comparison of two clocks: see
    /// [`ClockBounds::split`].
    Differences,
}

/// The bounds of all nodes: see [`super::location_splitting`].
#[derive(Clone, Debug)]
pub struct ClockBounds {
    /// For each process and node: the clocks that have bounds there.
    ceilings: Vec<Vec<Vec<Ceiling>>>,
    /// The processes that are not the same everywhere.
    classes: Vec<Classes>,
    /// For each process: the words whose values, with the location, make the number of a node.
    tracked: Vec<Vec<Tracked>>,
    /// Bounds that hold everywhere: those of queries.
    everywhere: Ceilings,
    abstraction: Abstraction,
    differences: Differences,
    has_differences: bool,
    greatest: i32,
    has_opposed_clocks: bool,
}

/// The node of a process in a state.
fn node(words: &[i32], location: i32, tracked: &[Tracked]) -> usize {
    let offset = |one: &Tracked| (words[one.word as usize] - one.low) as usize * one.stride;
    location as usize + tracked.iter().map(offset).sum::<usize>()
}

/// The nodes of a process by their ceilings.
#[derive(Clone, Debug)]
struct Classes {
    process: usize,
    tracked: Vec<Tracked>,
    /// For each node: the number of its class.
    of_nodes: Vec<u32>,
}

impl Classes {
    /// `None` if all nodes have the same ceilings.
    fn new(process: usize, nodes: &[Vec<Ceiling>], tracked: &[Tracked]) -> Option<Classes> {
        let mut numbers: FxHashMap<&[Ceiling], u32> = FxHashMap::default();
        let of_nodes = nodes.iter().map(|ceilings| {
            let next = numbers.len() as u32;
            *numbers.entry(ceilings).or_insert(next)
        });
        let of_nodes = of_nodes.collect();
        let tracked = tracked.to_vec();
        (numbers.len() > 1).then_some(Classes {
            process,
            tracked,
            of_nodes,
        })
    }
}

/// Lower and upper bounds of all clocks in all nodes of a process.
type Table = Vec<Vec<(i32, i32)>>;

/// What is asked of all bounds together.
#[derive(Default)]
struct Summary {
    /// The greatest bound; 0 without any.
    greatest: i32,
    /// Whether a node of a process has one clock bounded from below and another one from above.
    has_opposed_clocks: bool,
}

impl Summary {
    /// The ceilings of the nodes of a process, which count from now on.
    fn of(&mut self, table: Table, is_maximum: bool) -> Vec<Vec<Ceiling>> {
        let nodes = table.into_iter().map(|bounds| {
            let bounds = self.bounds(bounds, is_maximum);
            self.has_opposed_clocks = self.has_opposed_clocks || are_opposed(&bounds);
            to_ceilings(&bounds).each()
        });
        nodes.collect()
    }

    /// The bounds of one node, or of all, as the abstraction needs them.
    fn bounds(&mut self, mut bounds: Vec<(i32, i32)>, is_maximum: bool) -> Vec<(i32, i32)> {
        for bound in &mut bounds {
            let most = bound.0.max(bound.1);
            if is_maximum {
                *bound = (most, most);
            }
            self.greatest = self.greatest.max(most);
        }
        bounds
    }
}

impl ClockBounds {
    /// The bounds of a network, found with these heuristics; `atoms` are comparisons of queries,
    /// which matter in every location.
    pub fn new(
        network: &Network,
        atoms: &[ClockAtom],
        abstraction: Abstraction,
        tuning: Tuning,
    ) -> ClockBounds {
        let clock_count = network.clocks.len();
        let (abstraction, differences) = match abstraction {
            Abstraction::Differences => match Differences::new(network, atoms) {
                Some(differences) => (abstraction, differences),
                None => (Abstraction::Exact, Differences::default()),
            },
            _ => (abstraction, Differences::default()),
        };
        let reset = differences.greatest_reset;
        let partners = Partners::new(network).filter(|_| tuning.joint_resets);
        let mut analysis = Splitting::new(network, tuning);
        let (mut tables, mut tracked) = (Vec::new(), Vec::new());
        let mut summary = Summary::default();
        let is_maximum = abstraction == Abstraction::Maximum;
        let mut ceilings = Vec::new();
        for (index, process) in network.processes.iter().enumerate() {
            let valuations = analysis.of(index);
            let partners = partners.as_ref();
            let table = fixpoint(process, &valuations, partners, clock_count, reset);
            tracked.push(valuations.tracked);
            if network.features.clock_copies {
                tables.push(table);
            } else {
                // One process at a time: tables have a place forevery clock, and processes bounds
                // on few.
                ceilings.push(summary.of(table, is_maximum));
            }
        }
        let mut everywhere = vec![(NONE, NONE); clock_count.max(1)];
        for atom in atoms {
            add_atom(&mut everywhere, atom, reset);
        }
        if network.features.clock_copies {
            spread_over_copies(network, &mut tables, &mut everywhere);
            ceilings.extend(
                tables
                    .into_iter()
                    .map(|table| summary.of(table, is_maximum)),
            );
        }
        let everywhere = to_ceilings(&summary.bounds(everywhere, is_maximum));
        // Ceilings hold no greater constants, and where two clocks are compared, none may be less.
        let is_beyond =
            abstraction == Abstraction::Differences && summary.greatest > Bound::MAX_VALUE;
        let abstraction = if is_beyond {
            Abstraction::Exact
        } else {
            abstraction
        };
        let classes = ceilings.iter().zip(&tracked).enumerate();
        let classes =
            classes.filter_map(|(process, (nodes, tracked))| Classes::new(process, nodes, tracked));
        ClockBounds {
            classes: classes.collect(),
            ceilings,
            tracked,
            everywhere,
            abstraction,
            differences,
            greatest: summary.greatest,
            has_differences: network.features.diagonals
                || atoms.iter().any(ClockAtom::is_difference),
            // Demands have room for no greater constants.
            has_opposed_clocks: summary.has_opposed_clocks
                && summary.greatest <= Bound::NARROW_VALUE,
        }
    }

    /// Whether clocks are compared with each other.
    pub fn has_differences(&self) -> bool {
        self.has_differences
    }

    /// The greatest constant that a clock is compared with; 0 without any.
    pub fn greatest(&self) -> i32 {
        self.greatest
    }

    /// Whether zones must be cut by [`ClockBounds::split`].
    pub fn splits(&self) -> bool {
        self.abstraction == Abstraction::Differences
    }

    /// Cuts a zone along the comparisons of two clocks that matter in the state, and adds the
    /// extrapolated parts to `target`.
    pub fn split(
        &self,
        words: &[i32],
        zone: &[Bound],
        scratch: &mut Ceilings,
        target: &mut Federation,
    ) {
        self.ceilings_into(words, scratch);
        let differences = self.differences.of(words);
        let dimension = target.dimension();
        extrapolate::split_by_differences(zone, dimension, scratch, &differences, target);
    }

    /// Overwrites ceilings by those of a state.
    pub fn ceilings_into(&self, words: &[i32], scratch: &mut Ceilings) {
        scratch.clone_from(&self.everywhere);
        for ((nodes, &location), tracked) in self.ceilings.iter().zip(words).zip(&self.tracked) {
            for ceiling in &nodes[node(words, location, tracked)] {
                scratch.raise_one(ceiling);
            }
        }
    }

    /// Adds numbers which decide what
    /// [`Symbolic::extrapolate`](crate::network::Symbolic::extrapolate) makes of the zones of a
    /// state.
    pub(crate) fn classes_into(&self, words: &[i32], numbers: &mut Vec<u32>) {
        if self.simulates() {
            for one in &self.classes {
                let node = node(words, words[one.process], &one.tracked);
                numbers.push(one.of_nodes[node]);
            }
        }
    }

    /// Whether these numbers depend on locations alone.
    pub(crate) fn follow_locations(&self) -> bool {
        self.classes.iter().all(|one| one.tracked.is_empty())
    }

    /// Applies the abstraction to the zone of a state with these words; `scratch` is overwritten.
    pub fn extrapolate(
        &self,
        words: &[i32],
        zone: &mut [Bound],
        dimension: usize,
        scratch: &mut Ceilings,
    ) {
        if self.simulates() {
            self.ceilings_into(words, scratch);
            extrapolate::lu_plus(zone, dimension, scratch);
        }
    }

    /// Whether what simulates a valuation (see [`crate::zones::simulation`]) can do all that
    /// matters of what it can do.
    pub fn simulates(&self) -> bool {
        matches!(
            self.abstraction,
            Abstraction::Maximum | Abstraction::LowerUpper
        )
    }

    /// Whether it pays to compare zones by simulation and not by inclusion: a process must compare
    /// one clock from below and another one from above. Measured: it saves up to nine tenths of the
    /// states of such models. It saves no states of models in which processes have one clock each,
    /// and costs about a twentieth of the time.
    pub fn compares_by_simulation(&self) -> bool {
        self.simulates() && self.has_opposed_clocks
    }

    /// Compares zones by inclusion from now on, also where simulation would pay.
    pub(crate) fn compare_as_sets(&mut self) {
        self.has_opposed_clocks = false;
    }

    /// Bounds to start from: those that hold everywhere.
    pub fn everywhere(&self) -> &Ceilings {
        &self.everywhere
    }
}

/// Whether one clock is compared from below and another one from above.
fn are_opposed(bounds: &[(i32, i32)]) -> bool {
    let lower = (1..bounds.len()).filter(|&clock| bounds[clock].0 != NONE);
    let is_upper = |clock: usize| bounds[clock].1 != NONE;
    let mut pairs = lower.flat_map(|low| (1..bounds.len()).map(move |high| (low, high)));
    pairs.any(|(low, high)| low != high && is_upper(high))
}

fn to_ceilings(bounds: &[(i32, i32)]) -> Ceilings {
    let known = |bound: i32| (bound != NONE).then_some(bound);
    let lower: Vec<_> = bounds.iter().map(|bound| known(bound.0)).collect();
    let upper: Vec<_> = bounds.iter().map(|bound| known(bound.1)).collect();
    Ceilings::lower_upper(&lower, &upper)
}

/// The least bounds of the nodes of a process that satisfy: those of a node cover its invariant and
/// the guards of its edges, and those of every target for the clocks that are not certainly reset
/// on the way.
fn fixpoint(
    process: &Process,
    valuations: &Valuations,
    partners: Option<&Partners>,
    clock_count: usize,
    reset: i32,
) -> Table {
    let mut table: Table = vec![vec![(NONE, NONE); clock_count.max(1)]; valuations.nodes];
    for (node, bounds) in table.iter_mut().enumerate() {
        let location = &process.locations[node % process.locations.len()];
        for atom in &location.invariant.atoms {
            add_atom(bounds, atom, reset);
        }
    }
    for (node, atom) in &valuations.atoms {
        add_atom(&mut table[*node], atom, reset);
    }
    loop {
        let mut changed = false;
        for step in &valuations.steps {
            changed |= propagate(&process.edges[step.edge], *step, partners, &mut table);
        }
        if !changed {
            return table;
        }
    }
}

/// Carries the bounds of a step's target to its source; returns whether they grew.
fn propagate(edge: &Edge, step: SplitStep, partners: Option<&Partners>, table: &mut Table) -> bool {
    let branch = &edge.branches[step.branch];
    let is_reset = |clock: usize| {
        joint_resets::resets(edge, branch, clock)
            || partners.is_some_and(|partners| partners.reset(edge, clock))
    };
    let mut changed = false;
    for clock in 1..table[step.source].len() {
        let (low, high) = table[step.target][clock];
        let own = table[step.source][clock];
        let joined = (own.0.max(low), own.1.max(high));
        if joined != own && !is_reset(clock) {
            table[step.source][clock] = joined;
            changed = true;
        }
    }
    changed
}

/// `left - right ≺ b` is an upper bound b on left, and a lower bound -b on right. A difference of
/// two clocks bounds both, and once one of them is set to at most `reset`, it compares the other
/// with a constant that lies so much further out.
fn add_atom(bounds: &mut [(i32, i32)], atom: &ClockAtom, reset: i32) {
    let is_difference = atom.is_difference();
    let reset = if is_difference { reset } else { 0 };
    for clock in range(atom.left.first.0, atom.left.count) {
        let bound = atom.high.saturating_add(reset);
        bounds[clock].1 = bounds[clock].1.max(bound);
        if is_difference {
            bounds[clock].0 = bounds[clock].0.max(bound);
        }
    }
    for clock in range(atom.right.first.0, atom.right.count) {
        let bound = atom.low.checked_neg().unwrap_or(i32::MAX);
        let bound = bound.saturating_add(reset);
        bounds[clock].0 = bounds[clock].0.max(bound);
        if is_difference {
            bounds[clock].1 = bounds[clock].1.max(bound);
        }
    }
}

fn range(first: u32, count: u32) -> impl Iterator<Item = usize> {
    (first..first + count)
        .map(|clock| clock as usize)
        .filter(|&clock| clock != 0)
}

/// With `x := y + k` the bounds of x become bounds of y, less k, everywhere.
fn spread_over_copies(network: &Network, tables: &mut [Table], everywhere: &mut [(i32, i32)]) {
    for table in tables {
        for bounds in table.iter_mut() {
            for (clock, bound) in bounds.iter_mut().enumerate() {
                everywhere[clock] = (
                    everywhere[clock].0.max(bound.0),
                    everywhere[clock].1.max(bound.1),
                );
                *bound = (NONE, NONE);
            }
        }
    }
    let updates = network.updates();
    let copies: Vec<_> = updates.flat_map(|update| &update.assignments).collect();
    // As many rounds as there are clocks reach the end of every chain of copies. Bounds that still
    // grow then do so forever (a cycle of copies that adds a negative number): they become the
    // greatest bound that zones can hold.
    let mut step: fn(&mut [(i32, i32)], &ClockAssignment) -> bool = spread;
    let mut round = 0;
    loop {
        let mut changed = false;
        for copy in &copies {
            changed |= step(everywhere, copy);
        }
        if !changed {
            return;
        }
        round += 1;
        if round == network.clocks.len() {
            step = spread_to_limit;
        }
    }
}

/// Raises the bounds of the source of a copy by those of its target; returns whether they grew.
fn spread(bounds: &mut [(i32, i32)], copy: &ClockAssignment) -> bool {
    let AssignedValue::Clock(source, increment, _) = copy.value else {
        return false;
    };
    let shifted = |bound: i32| {
        if bound == NONE {
            NONE
        } else {
            bound.saturating_sub(increment)
        }
    };
    let mut changed = false;
    for target in range(copy.target.first.0, copy.target.count) {
        for clock in range(source.first.0, source.count) {
            let old = bounds[clock];
            bounds[clock] = (
                old.0.max(shifted(bounds[target].0)),
                old.1.max(shifted(bounds[target].1)),
            );
            changed |= bounds[clock] != old;
        }
    }
    changed
}

/// As [`spread`], but whatever grows becomes the greatest bound.
fn spread_to_limit(bounds: &mut [(i32, i32)], copy: &ClockAssignment) -> bool {
    let before = bounds.to_vec();
    spread(bounds, copy);
    let is_narrow = |(lower, upper): &(i32, i32)| *lower.max(upper) <= Bound::NARROW_VALUE;
    let most = if before.iter().all(is_narrow) {
        Bound::NARROW_VALUE
    } else {
        Bound::MAX_VALUE
    };
    let limit = |old: i32, new: i32| {
        if new > old { most.max(old) } else { old }
    };
    for (bound, old) in bounds.iter_mut().zip(&before) {
        *bound = (limit(old.0, bound.0), limit(old.1, bound.1));
    }
    before != bounds
}

//! The network: processes with locations and edges, clocks, channels, variables.

use std::ops::Range;

use super::chances::{Chances, LocationChances};
use super::code::{Function, Overflow};
use super::constants::Constants;
use super::external::ExternalLibrary;
use super::ids::{ChannelId, ClockId, EdgeId, FunctionId, LocationId, ProcessId, SiteId};
use super::labels::{Guard, Update};
use super::moves::Part;
use crate::diagnostics::Span;

/// A network of timed automata, instantiated and flattened.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// The processes in the order of the system line.
    pub processes: Vec<Process>,
    /// The clocks; the first is the reference clock.
    pub clocks: Vec<Clock>,
    /// The channels.
    pub channels: Vec<Channel>,
    /// All code: functions of the model, guards, updates, invariants and the parts of queries.
    pub functions: Vec<Function>,
    /// Where run-time errors come from.
    pub sites: Vec<Site>,
    /// The constant memory.
    pub constants: Constants,
    /// What happens where results of integer arithmetic do not fit.
    pub overflow: Overflow,
    /// The first place, in the order of sites, where the value of a constant wrapped round.
    pub wrapped_constant: Option<SiteId>,
    /// The words of the initial state.
    pub initial: Vec<i32>,
    /// The initial values of the clocks, by clock index.
    pub initial_clocks: Vec<i32>,
    /// Names and types of the words.
    pub layout: Layout,
    /// `before_update`, run before the updates of every transition.
    pub before_update: Option<Update>,
    /// `after_update`, run after them.
    pub after_update: Option<Update>,
    /// What the model uses, for choosing algorithms and for `ntagen info`.
    pub features: Features,
    /// The scalar sets, by the number that shapes and coordinates give.
    pub scalar_sets: Vec<ScalarSet>,
    /// What there is in the stochastic reading only.
    pub chances: Chances,
    /// The libraries that the model imports.
    pub externals: Vec<ExternalLibrary>,
}

impl Network {
    /// The edges of all processes.
    pub fn edges(&self) -> impl Iterator<Item = &Edge> {
        self.processes.iter().flat_map(|process| &process.edges)
    }

    /// The locations of all processes.
    pub fn locations(&self) -> impl Iterator<Item = &Location> {
        self.processes.iter().flat_map(|process| &process.locations)
    }

    /// The edge of a part of a move.
    pub fn edge(&self, part: Part) -> &Edge {
        &self.processes[part.process as usize].edges[part.edge as usize]
    }

    /// The functions that taking an edge may run: guards and updates, in file order.
    pub fn functions_of_edges(&self) -> impl Iterator<Item = FunctionId> {
        self.edges().flat_map(|edge| {
            let branches = edge.branches.iter().map(|branch| branch.update.function);
            [edge.guard.function, edge.update.function]
                .into_iter()
                .chain(branches)
                .flatten()
        })
    }
}

impl Process {
    /// The edges that have the same entry as an edge, in order: all legs of its branch point if
    /// each makes an edge, and else the edge alone.
    pub fn edges_of_entry(&self, EdgeId(edge): EdgeId) -> impl Iterator<Item = &Edge> {
        let first = |edge: &Edge| edge.leg.as_ref().map(|leg| leg.first);
        let entry = first(&self.edges[edge as usize]);
        let start = entry.map_or(edge, |EdgeId(first)| first) as usize;
        let rest = self.edges[start..].iter().enumerate();
        let same = rest.take_while(move |(place, edge)| {
            if entry.is_some() {
                first(edge) == entry
            } else {
                *place == 0
            }
        });
        same.map(|(_, edge)| edge)
    }
}

/// A scalar set: numbers that are only compared for equality and used as indices, so that they can
/// be exchanged.
#[derive(Clone, Debug)]
pub struct ScalarSet {
    /// How many members it has.
    pub size: u32,
    /// What tells its members apart nevertheless, so that exchanging them would change what the
    /// network does; `None` if nothing does, or only the order of the updates of broadcast
    /// receivers.
    pub told_apart_by: Option<Span>,
}

/// A coordinate of something that exists once for each member of a scalar set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinate {
    /// The scalar set.
    pub set: u32,
    /// The member.
    pub member: u32,
    /// How far apart those of neighbouring members are.
    pub stride: u32,
}

/// One process of the network.
#[derive(Clone, Debug)]
pub struct Process {
    /// Its name, for example `Gate` or `Train(3)`.
    pub name: String,
    /// The template it comes from.
    pub template: String,
    /// Its locations.
    pub locations: Vec<Location>,
    /// Its edges, in file order. Branch points are folded in: see [`Edge::branches`].
    pub edges: Vec<Edge>,
    /// Where it starts.
    pub initial: LocationId,
    /// Its level in the system line; greater is more urgent; 0 without priorities.
    pub priority: u32,
    /// The first process of the same name in the system line: all of them make a set.
    pub group: ProcessId,
    /// Its place in the set, for each parameter that is a scalar; the stride counts processes.
    pub coordinates: Vec<Coordinate>,
}

/// Whether time may pass in a location.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Urgency {
    /// Time may pass.
    Normal,
    /// Time may not pass.
    Urgent,
    /// Time may not pass, and the next transition must leave a committed location.
    Committed,
}

/// A location.
#[derive(Clone, Debug)]
pub struct Location {
    /// Its name; for a nameless location, `_` and its id.
    pub name: String,
    /// Whether time may pass.
    pub urgency: Urgency,
    /// Its invariant.
    pub invariant: Guard,
    /// Clocks whose rate the invariant sets (`x' == e`; quantifiers unrolled), with the function
    /// that gives the rate (0 or 1).
    pub rates: Vec<(ClockId, FunctionId)>,
    /// What it says of chances.
    pub chances: LocationChances,
    /// The edges that leave it.
    pub edges: Vec<EdgeId>,
    /// Where it is declared.
    pub span: Span,
}

/// An edge; with a branch point, the entry together with its legs, or with one of them.
#[derive(Clone, Debug)]
pub struct Edge {
    /// The location it leaves.
    pub source: LocationId,
    /// The ranges of the `select` bindings; each combination is an instance of the edge. The values
    /// are the arguments of all functions of the edge, in this order.
    pub select: Vec<Select>,
    /// Its guard.
    pub guard: Guard,
    /// Its synchronisation; `None` is an internal edge.
    pub sync: Option<Sync>,
    /// Its update, run before that of the chosen branch.
    pub update: Update,
    /// The branches; only one without a branch point. Each is a separate move of the owner of the
    /// edge.
    pub branches: Vec<Branch>,
    /// Which leg of a branch point it is, where some leg has a guard or synchronises: then each leg
    /// makes an edge, together with the entry.
    pub leg: Option<Box<Leg>>,
    /// Whether the controller owns it.
    pub controllable: bool,
    /// What was written: for traces.
    pub labels: EdgeLabels,
    /// Where it stands.
    pub span: Span,
}

/// A `select` binding.
#[derive(Clone, Debug)]
pub struct Select {
    /// The bound name.
    pub name: String,
    /// The least value.
    pub low: i32,
    /// The greatest value.
    pub high: i32,
    /// The scalar set, if it ranges over one.
    pub set: Option<u32>,
}

/// The part of a leg in an edge that an entry and a leg make.
///
/// Edges of the same entry are one for whoever chooses: the controller in a game, and a process
/// among its outputs in a random run, choose an entry. The leg is chance, among those possible.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The first edge of the process that has the same entry.
    pub first: EdgeId,
    /// How many of the `select` bindings the entry has; those of the leg come behind them.
    pub bindings: usize,
    /// How many combinations of values the bindings of the leg have.
    pub combinations: u32,
    /// Whether the entry synchronises: then its partners are chosen with it, and otherwise with the
    /// leg.
    pub follows_sync: bool,
    /// The labels of the entry alone.
    pub entry: EdgeLabels,
}

/// One way an edge can end.
#[derive(Clone, Debug)]
pub struct Branch {
    /// The location it enters.
    pub target: LocationId,
    /// The update of the leg.
    pub update: Update,
    /// In the stochastic reading: leaves the weight as a double; `None` is 1.
    pub weight: Option<FunctionId>,
}

/// The labels of an edge as text, blanks collapsed; empty where there is none.
#[derive(Clone, Debug, Default)]
#[expect(missing_docs, reason = "the names say it")]
pub struct EdgeLabels {
    pub select: String,
    pub guard: String,
    pub sync: String,
    pub update: String,
}

/// `channel!` or `channel?`
#[derive(Clone, Copy, Debug)]
pub struct Sync {
    /// `!` is true.
    pub send: bool,
    /// The channel, or the first of an array.
    pub channel: ChannelId,
    /// How many channels it may be: 1, or the size of the array.
    pub count: u32,
    /// Gives the offset from `channel` (checked against the array's bounds); `None` is 0.
    pub index: Option<FunctionId>,
}

impl Sync {
    /// The channels that it may be.
    #[must_use]
    pub fn channels(self) -> Range<u32> {
        self.channel.0..self.channel.0 + self.count
    }
}

/// A channel.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Its name, for example `go[2]`.
    pub name: String,
    /// Every enabled receiver takes part, and none is needed.
    pub broadcast: bool,
    /// No time passes while a synchronisation on it is enabled.
    pub urgent: bool,
    /// Its level in `chan priority`; greater is more urgent. Internal edges have
    /// [`Features::default_priority`].
    pub priority: u32,
}

/// A clock.
#[derive(Clone, Debug)]
pub struct Clock {
    /// Its name, for example `x` or `Train(1).x`.
    pub name: String,
    /// The process it is local to.
    pub owner: Option<ProcessId>,
    /// Whether it is a hybrid clock, which symbolic and game queries leave out.
    pub hybrid: bool,
    /// Its place in arrays that are indexed by scalars; the stride counts clocks.
    pub coordinates: Vec<Coordinate>,
}

/// Names and types of the words of a state.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// All words of a state.
    pub words: u32,
    /// The words that decide whether two states are equal: all but `meta`.
    pub identity_words: u32,
    /// The variables, in order of their words; locations are not variables.
    pub variables: Vec<Variable>,
}

/// A variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Its name, for example `len` or `Gate.list`.
    pub name: String,
    /// The process it is local to.
    pub owner: Option<ProcessId>,
    /// Its first word.
    pub offset: u32,
    /// Its type.
    pub shape: Shape,
    /// Whether it is `meta`.
    pub meta: bool,
}

/// What printing and packing of values need to know about a type.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// An integer in a range.
    Integer {
        /// The least value.
        low: i32,
        /// The greatest value.
        high: i32,
    },
    /// A truth value.
    Bool,
    /// A floating-point number.
    Double,
    /// A scalar of a set of this size; `set` tells sets apart.
    Scalar {
        /// Size of the set.
        size: u32,
        /// Which set.
        set: u32,
    },
    /// `length` parts of the same shape, indexed from `first`.
    Array {
        /// The shape of a part.
        part: Box<Shape>,
        /// How many.
        length: u32,
        /// The least index (0 but for `T x[int[a,b]]`).
        first: i32,
        /// The scalar set that it is indexed by.
        set: Option<u32>,
    },
    /// Named parts.
    Struct(Vec<(String, Shape)>),
}

impl Shape {
    /// How many words a value takes.
    pub fn words(&self) -> u32 {
        match self {
            Shape::Integer { .. } | Shape::Bool | Shape::Scalar { .. } => 1,
            Shape::Double => 2,
            Shape::Array { part, length, .. } => part.words() * length,
            Shape::Struct(fields) => fields.iter().map(|(_, shape)| shape.words()).sum(),
        }
    }
}

/// What a model uses.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent fact")]
pub struct Features {
    /// Channel or process priorities.
    pub priorities: bool,
    /// The priority of internal edges and unlisted channels.
    pub default_priority: u32,
    /// Comparisons of clock differences.
    pub diagonals: bool,
    /// Rates in invariants.
    pub stopwatches: bool,
    /// Strict upper bounds in invariants.
    pub strict_invariants: bool,
    /// Broadcast receivers with clock guards.
    pub guarded_receivers: bool,
    /// Edges on urgent channels with clock guards.
    pub clock_guarded_urgent: bool,
    /// Clock assignments from other clocks.
    pub clock_copies: bool,
    /// Variables of type `double`.
    pub doubles: bool,
    /// Hybrid clocks.
    pub hybrid_clocks: bool,
    /// Edges that the environment owns.
    pub uncontrollable: bool,
    /// Legs of branch points that are edges: see [`Edge::leg`].
    pub legs: bool,
}

/// Where a run-time error can come from.
#[derive(Clone, Debug)]
pub struct Site {
    /// The expression.
    pub span: Span,
}

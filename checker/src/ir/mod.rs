//! The typed program and the flat network: what the engine runs.
//!
//! This is the hand-over point between the front end and everything below it. After it nobody looks
//! at source text: names and spans are kept only to name things to the user.
//!
//! Memory
//! * The discrete state is one array of 32-bit *words*: first the location index of each process,
//!   then the variables in order of declaration, then the `meta` variables. Two states are equal if
//!   their first [`Layout::identity_words`] words are; `meta` words are carried along and not
//!   compared.
//! * Integers, truth values and scalars take one word; a `double` takes two (its bits, low word
//!   first); arrays and structs are the concatenation of their parts in declaration order.
//! * Constants that must be addressed (constant arrays and structs) lie in [`Network::constants`];
//!   scalar constants are folded into the code. Local arrays and structs of functions lie in a
//!   frame of [`Function::frame_words`] words, zeroed on entry.
//!
//! Clocks are no part of the words. Clock 0 is the reference clock (always 0); the model's clocks
//! count from 1, arrays of clocks flattened. Channels are flattened likewise and count from 0.

mod accesses;
mod code;
mod operands;
mod print;

pub use code::*;
pub(crate) use operands::{Access, Operand};

use crate::diagnostics::Span;

/// Index of a process in [`Network::processes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ProcessId(pub u32);

/// Index of a location in its process's [`Process::locations`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LocationId(pub u32);

/// Index of an edge in its process's [`Process::edges`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EdgeId(pub u32);

/// Index of a clock; 0 is the reference clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClockId(pub u32);

/// Index of a channel in [`Network::channels`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ChannelId(pub u32);

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
    pub constants: Vec<i32>,
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
}

impl Network {
    /// The functions that taking an edge may run: guards and updates, in file order.
    pub fn functions_of_edges(&self) -> impl Iterator<Item = FunctionId> {
        let edges = self.processes.iter().flat_map(|process| &process.edges);
        edges.flat_map(|edge| {
            let branches = edge.branches.iter().map(|branch| branch.update.function);
            [edge.guard.function, edge.update.function]
                .into_iter()
                .chain(branches)
                .flatten()
        })
    }
}

/// A scalar set: numbers that are only compared for equality and used as indices, so that they can
/// be exchanged.
#[derive(Clone, Debug)]
pub struct ScalarSet {
    /// How many members it has.
    pub size: u32,
    /// What tells its members apart nevertheless, so that exchanging them would change what the
    /// network does; `None` if nothing does but, possibly, the order in which broadcast receivers
    /// run their updates.
    pub told_apart_by: Option<Span>,
}

/// A coordinate of something of which there is one for each member of a scalar set.
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
    /// The edges that leave it.
    pub edges: Vec<EdgeId>,
    /// Where it is drawn, for pictures.
    pub position: Option<(i32, i32)>,
    /// Where it is declared.
    pub span: Span,
}

/// An edge; with a branch point, the entry together with its legs.
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
    /// The branches: one without a branch point. Each is a separate move of whoever owns the edge.
    pub branches: Vec<Branch>,
    /// Whether the controller owns it.
    pub controllable: bool,
    /// What was written: for traces.
    pub labels: EdgeLabels,
    /// The bends of the arrow, for pictures.
    pub nails: Vec<(i32, i32)>,
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

/// One way an edge can end.
#[derive(Clone, Debug)]
pub struct Branch {
    /// The location it enters.
    pub target: LocationId,
    /// The update of the leg.
    pub update: Update,
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
    /// Hybrid clocks are abstracted away in symbolic and game queries.
    pub hybrid: bool,
    /// Its place in arrays that are indexed by scalars; the stride counts clocks.
    pub coordinates: Vec<Coordinate>,
}

/// A condition on words and clocks: a guard or an invariant. It holds if `function` returns 1, and
/// then on the clock values that satisfy `fixed` and all constraints that the function emitted.
#[derive(Clone, Debug, Default)]
pub struct Guard {
    /// Decides the part on the words and emits clock constraints ([`Instruction::Constrain`]);
    /// `None` is true. Its parameters are the edge's select values; it returns an integer.
    pub function: Option<FunctionId>,
    /// Clock constraints with constant bounds that hold whatever the words say.
    pub fixed: Vec<FixedConstraint>,
    /// Whether `function` may emit constraints.
    pub emits: bool,
    /// All clock comparisons in it that can matter, fixed ones included: for static analysis.
    pub atoms: Vec<ClockAtom>,
    /// Whether it is known to fail in every state, if it does not end in a run-time error.
    pub never_holds: bool,
}

impl Guard {
    /// Whether it is the condition true.
    pub fn is_trivial(&self) -> bool {
        self.function.is_none() && self.fixed.is_empty()
    }
}

/// `left - right < bound`, or `<=` if not strict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the formula says it")]
pub struct FixedConstraint {
    pub left: ClockId,
    pub right: ClockId,
    pub bound: i32,
    pub strict: bool,
}

/// A comparison `left - right ≺ bound` as static analysis sees it: which clocks it may concern, and
/// how large the bound may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClockAtom {
    /// The clocks that may stand at the left (one, or all of an array indexed at run time), the
    /// reference clock included.
    pub left: ClockRange,
    /// The same at the right.
    pub right: ClockRange,
    /// The least value that the bound may take.
    pub low: i32,
    /// The greatest value that the bound may take.
    pub high: i32,
    /// Whether the comparison is strict.
    pub strict: bool,
}

impl ClockAtom {
    /// Whether the comparison concerns two clocks.
    pub fn is_difference(&self) -> bool {
        let is_clock = |range: ClockRange| range.first.0 != 0 || range.count > 1;
        is_clock(self.left) && is_clock(self.right)
    }
}

/// Consecutive clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockRange {
    /// The first.
    pub first: ClockId,
    /// How many, at least 1.
    pub count: u32,
}

/// What happens to words and clocks. First `function` runs; then the clocks of `fixed` are set.
#[derive(Clone, Debug, Default)]
pub struct Update {
    /// Changes words and emits clock assignments ([`Instruction::SetClock`],
    /// [`Instruction::CopyClock`]); `None` changes nothing.
    pub function: Option<FunctionId>,
    /// Clocks that are set to constants. Used only where the order against `function` does not
    /// matter.
    pub fixed: Vec<(ClockId, i32)>,
    /// Whether `function` may emit clock assignments.
    pub emits: bool,
    /// All assignments to clocks in it, fixed ones included: for static analysis.
    pub assignments: Vec<ClockAssignment>,
    /// The words that `function` may write, as ascending disjoint ranges (first, count); for static
    /// analysis.
    pub writes: Vec<(u32, u32)>,
}

impl Update {
    /// Whether it changes nothing.
    pub fn is_trivial(&self) -> bool {
        self.function.is_none() && self.fixed.is_empty()
    }
}

/// An assignment to a clock as static analysis sees it.
#[derive(Clone, Debug)]
pub struct ClockAssignment {
    /// The clocks that may be assigned.
    pub target: ClockRange,
    /// What is assigned.
    pub value: AssignedValue,
}

/// What a clock is set to.
#[derive(Clone, Debug)]
pub enum AssignedValue {
    /// An integer between the two values.
    Integer(i32, i32),
    /// The value of one of these clocks plus an integer between the two values.
    Clock(ClockRange, i32, i32),
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

/// A type, as far as printing and packing of values need it.
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
}

/// Where a run-time error can come from.
#[derive(Clone, Debug)]
pub struct Site {
    /// The expression.
    pub span: Span,
}

/// A query, compiled.
#[derive(Clone, Debug)]
pub struct Query {
    /// The text, blanks collapsed.
    pub text: String,
    /// `strategy name = …`
    pub strategy: Option<String>,
    /// `under name`
    pub under: Option<String>,
    /// What is asked.
    pub kind: QueryKind,
    /// The whole query.
    pub span: Span,
}

/// The kinds of queries.
#[derive(Clone, Debug)]
pub enum QueryKind {
    /// `E<> p`
    Reachable(Predicate),
    /// `A[] p`
    Invariantly(Predicate),
    /// `E[] p`
    PotentiallyAlways(Predicate),
    /// `A<> p`
    Eventually(Predicate),
    /// `p --> q`
    LeadsTo(Predicate, Predicate),
    /// `sup`, `inf`, `bounds`
    Extremum {
        /// Whether the least value is wanted.
        least: bool,
        /// Whether the greatest value is wanted.
        greatest: bool,
        /// The states that count.
        predicate: Predicate,
        /// What is measured, with its text.
        items: Vec<(Measure, String)>,
    },
    /// `control: …`
    Control {
        /// The objective.
        objective: Objective,
        /// `E<> control: …`
        cooperative: bool,
        /// `control_t*(u, g)`.
        time_optimal: Option<(Option<FunctionId>, Option<FunctionId>)>,
        /// `{…} control: …`
        observations: Option<Vec<Predicate>>,
    },
    /// `saveStrategy`
    SaveStrategy {
        /// The file.
        file: String,
        /// The strategy.
        strategy: String,
    },
    /// `loadStrategy`
    LoadStrategy {
        /// The file.
        file: String,
    },
}

/// What `sup` and `inf` measure.
#[derive(Clone, Debug)]
pub enum Measure {
    /// An integer expression on the words.
    Integer(FunctionId),
    /// A clock.
    Clock(ClockChoice),
}

/// What a controller is to enforce.
#[derive(Clone, Debug)]
pub enum Objective {
    /// `A<> p`
    Reach(Predicate),
    /// `A[] p`
    Safe(Predicate),
    /// `A[p U q]`
    Until(Predicate, Predicate),
    /// `A[p W q]`
    WeakUntil(Predicate, Predicate),
    /// `A[] (p && A<> q)`
    Buchi(Predicate, Predicate),
}

/// A state predicate of a query. Quantifiers whose body mentions clocks, and process sets, are
/// unrolled.
#[derive(Clone, Debug)]
pub enum Predicate {
    /// A condition on the words alone: a function without parameters that returns 0 or 1.
    Data(FunctionId),
    /// Always this.
    Constant(bool),
    /// The process is in the location.
    Location(ProcessId, LocationId),
    /// A clock comparison.
    Clock(ClockPredicate),
    /// `deadlock`
    Deadlock,
    /// Not.
    Not(Box<Predicate>),
    /// All of them; true if empty.
    And(Vec<Predicate>),
    /// One of them; false if empty.
    Or(Vec<Predicate>),
}

impl Predicate {
    /// The opposite.
    #[must_use]
    pub fn negated(&self) -> Predicate {
        Predicate::Not(Box::new(self.clone()))
    }

    /// Whether the words of a state alone decide it.
    pub fn is_of_words(&self) -> bool {
        match self {
            Predicate::Data(_) | Predicate::Constant(_) | Predicate::Location(..) => true,
            Predicate::Clock(_) | Predicate::Deadlock => false,
            Predicate::Not(one) => one.is_of_words(),
            Predicate::And(all) | Predicate::Or(all) => all.iter().all(Predicate::is_of_words),
        }
    }
}

/// `left - right ≺ bound` in a query, for a relation ≺ out of `<` and `<=` (the others are written
/// with `Not` and `And`).
#[derive(Clone, Debug)]
pub struct ClockPredicate {
    /// The left clock.
    pub left: ClockChoice,
    /// The right clock; the reference clock for `x < c`.
    pub right: ClockChoice,
    /// Whether the comparison is strict.
    pub strict: bool,
    /// The bound: a function without parameters that returns an integer.
    pub bound: FunctionId,
    /// The least and greatest value that the bound may take; for static analysis.
    pub range: (i32, i32),
}

/// A clock in a query: known, or chosen by the words.
#[derive(Clone, Copy, Debug)]
pub enum ClockChoice {
    /// This clock.
    Fixed(ClockId),
    /// One of consecutive clocks: the function returns the offset from the first.
    Indexed(ClockRange, FunctionId),
}

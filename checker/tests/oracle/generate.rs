//! Random networks and formulas, as trees of small numbers that shrink well, and their text.
//!
//! Numbers are taken modulo what there is (clocks, locations, …) when the text is written, so every
//! tree is a model.

pub(crate) mod explorer;

use std::fmt::Write as _;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::strategy::Union;

/// Values that variables and selects take.
pub(crate) const VALUES: i32 = 3;

/// A network.
#[derive(Clone, Debug)]
pub(crate) struct Network {
    pub clocks: usize,
    pub variables: usize,
    pub processes: Vec<Process>,
    /// An index into [`PRIORITIES`].
    priority: usize,
    /// Whether edges on urgent channels keep their clock guards.
    guards_urgency: bool,
    /// Whether controllable edges have no strict lower bounds, and receivers of a broadcast no
    /// clock guards at all.
    is_observable: bool,
    /// What every clock value is multiplied by in the text. Who wins does not depend on it.
    scale: i32,
}

#[derive(Clone, Debug)]
pub(crate) struct Process {
    pub locations: Vec<Location>,
    pub edges: Vec<Edge>,
}

#[derive(Clone, Debug)]
pub(crate) struct Location {
    urgency: Urgency,
    invariants: Vec<Invariant>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Urgency {
    Normal,
    Urgent,
    Committed,
}

#[derive(Clone, Debug)]
enum Invariant {
    Upper {
        clock: usize,
        bound: i32,
        strict: bool,
    },
    /// `x <= v + c`
    UpperByVariable {
        clock: usize,
        variable: usize,
        bound: i32,
    },
    /// `v == c imply x <= b`
    Conditional {
        variable: usize,
        value: i32,
        clock: usize,
        bound: i32,
    },
    Variable {
        variable: usize,
        bound: i32,
    },
}

#[derive(Clone, Debug)]
pub(crate) struct Edge {
    pub(crate) source: usize,
    /// Where it leads if it has no legs.
    pub(crate) target: usize,
    /// The legs of its branch point, if it leads to one.
    pub(crate) legs: Vec<Leg>,
    /// If a leg synchronises, the edge does not.
    labels: Labels,
    pub(crate) controllable: bool,
}

/// A leg of a branch point.
#[derive(Clone, Debug)]
pub(crate) struct Leg {
    pub(crate) target: usize,
    labels: Labels,
}

#[derive(Clone, Debug)]
struct Labels {
    select: bool,
    sync: Sync,
    guards: Vec<Atom>,
    updates: Vec<Update>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Sync {
    None,
    /// One of [`CHANNELS`].
    Channel {
        channel: usize,
        send: bool,
    },
    /// `d[v]`, or `d[s]` on an edge with a select.
    Indexed {
        variable: usize,
        send: bool,
    },
}

/// The channels with their declarations. Edges on urgent ones have no clock guards unless the
/// network has them.
const CHANNELS: [(&str, &str); 5] = [
    ("a", "chan"),
    ("b", "chan"),
    ("c", "broadcast chan"),
    ("u", "urgent chan"),
    ("w", "urgent broadcast chan"),
];

/// Declarations of channel priorities, each with whether processes have priorities too. The first
/// is for networks without any.
const PRIORITIES: [(&str, bool); 6] = [
    ("", false),
    ("", true),
    ("chan priority default < c;", false),
    ("chan priority a, c < default < b;", false),
    ("chan priority u < default < d[1] < a;", true),
    ("chan priority default < w < b;", true),
];

/// A comparison.
#[derive(Clone, Debug)]
pub(crate) enum Atom {
    Clock {
        clock: usize,
        relation: Relation,
        bound: i32,
    },
    /// `x ≺ v + c`
    ClockByVariable {
        clock: usize,
        relation: Relation,
        variable: usize,
        bound: i32,
    },
    Difference {
        left: usize,
        right: usize,
        relation: Relation,
        bound: i32,
    },
    Variable {
        variable: usize,
        relation: Relation,
        bound: i32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Relation {
    GreaterEqual,
    LessEqual,
    Greater,
    Less,
    Equal,
}

impl Relation {
    fn text(self) -> &'static str {
        match self {
            Relation::GreaterEqual => ">=",
            Relation::LessEqual => "<=",
            Relation::Greater => ">",
            Relation::Less => "<",
            Relation::Equal => "==",
        }
    }

    pub(crate) fn holds(self, left: i64, right: i64) -> bool {
        match self {
            Relation::GreaterEqual => left >= right,
            Relation::LessEqual => left <= right,
            Relation::Greater => left > right,
            Relation::Less => left < right,
            Relation::Equal => left == right,
        }
    }
}

#[derive(Clone, Debug)]
enum Update {
    Reset {
        clock: usize,
        value: i32,
    },
    ResetToVariable {
        clock: usize,
        variable: usize,
    },
    Copy {
        target: usize,
        source: usize,
    },
    Set {
        variable: usize,
        value: i32,
    },
    Increment {
        variable: usize,
    },
    /// `v = s` on an edge with a select.
    Select {
        variable: usize,
    },
}

/// A state formula.
#[derive(Clone, Debug)]
pub(crate) enum Formula {
    Location { process: usize, location: usize },
    Atom(Atom),
    Deadlock,
    Not(Box<Formula>),
    And(Vec<Formula>),
    Or(Vec<Formula>),
}

/// How rich the networks are.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an independent part of the language"
)]
pub(crate) struct Shape {
    pub clocks: usize,
    pub(crate) constant: i32,
    pub strict_invariants: bool,
    pub uncontrollable: bool,
    pub deadlock: bool,
    pub priorities: bool,
    pub guarded_urgency: bool,
    /// Whether most networks have legs with labels.
    pub legs: bool,
}

fn any_index() -> impl Strategy<Value = usize> {
    0..12_usize
}

fn relation() -> impl Strategy<Value = Relation> {
    prop_oneof![
        3 => Just(Relation::GreaterEqual),
        3 => Just(Relation::LessEqual),
        2 => Just(Relation::Greater),
        2 => Just(Relation::Less),
        1 => Just(Relation::Equal),
    ]
}

fn atom(shape: Shape) -> impl Strategy<Value = Atom> {
    let bound = 0..=shape.constant;
    prop_oneof![
        12 => (any_index(), relation(), bound.clone())
            .prop_map(|(clock, relation, bound)| Atom::Clock { clock, relation, bound }),
        1 => (any_index(), relation(), any_index(), 0..=shape.constant - (VALUES - 1)).prop_map(
            |(clock, relation, variable, bound)| Atom::ClockByVariable { clock, relation, variable, bound }
        ),
        1 => (any_index(), any_index(), relation(), bound).prop_map(
            |(left, right, relation, bound)| Atom::Difference { left, right, relation, bound }
        ),
        6 => variable_atom(),
    ]
}

fn variable_atom() -> impl Strategy<Value = Atom> {
    (any_index(), relation(), 0..VALUES).prop_map(|(variable, relation, bound)| Atom::Variable {
        variable,
        relation,
        bound,
    })
}

fn update(shape: Shape) -> impl Strategy<Value = Update> {
    prop_oneof![
        8 => any_index().prop_map(|clock| Update::Reset { clock, value: 0 }),
        2 => (any_index(), 0..=shape.constant).prop_map(|(clock, value)| Update::Reset { clock, value }),
        1 => (any_index(), any_index())
            .prop_map(|(clock, variable)| Update::ResetToVariable { clock, variable }),
        1 => (any_index(), any_index()).prop_map(|(target, source)| Update::Copy { target, source }),
        4 => (any_index(), 0..VALUES).prop_map(|(variable, value)| Update::Set { variable, value }),
        4 => any_index().prop_map(|variable| Update::Increment { variable }),
        2 => any_index().prop_map(|variable| Update::Select { variable }),
    ]
}

fn invariant(shape: Shape) -> impl Strategy<Value = Invariant> {
    let bound = 0..=shape.constant;
    let strict = if shape.strict_invariants { 0.2 } else { 0.0 };
    prop_oneof![
        12 => (any_index(), bound.clone(), prop::bool::weighted(strict)).prop_map(
            |(clock, bound, strict)| Invariant::Upper { clock, bound, strict }
        ),
        1 => (any_index(), any_index(), 0..=shape.constant - (VALUES - 1)).prop_map(
            |(clock, variable, bound)| Invariant::UpperByVariable { clock, variable, bound }
        ),
        1 => (any_index(), 0..VALUES, any_index(), bound).prop_map(
            |(variable, value, clock, bound)| Invariant::Conditional { variable, value, clock, bound }
        ),
        1 => (any_index(), 0..VALUES)
            .prop_map(|(variable, bound)| Invariant::Variable { variable, bound }),
    ]
}

fn location(shape: Shape) -> impl Strategy<Value = Location> {
    let urgency = prop_oneof![
        12 => Just(Urgency::Normal),
        1 => Just(Urgency::Urgent),
        2 => Just(Urgency::Committed),
    ];
    let invariants = prop_oneof![
        3 => Just(0_usize),
        3 => Just(1_usize),
        1 => Just(2_usize),
    ]
    .prop_flat_map(move |count| vec(invariant(shape), count));
    (urgency, invariants).prop_map(|(urgency, invariants)| Location {
        urgency,
        invariants,
    })
}

fn sync() -> impl Strategy<Value = Sync> {
    prop_oneof![
        8 => Just(Sync::None),
        8 => (0..CHANNELS.len(), any::<bool>())
            .prop_map(|(channel, send)| Sync::Channel { channel, send }),
        1 => (any_index(), any::<bool>()).prop_map(|(variable, send)| Sync::Indexed { variable, send }),
    ]
}

fn labels(shape: Shape) -> impl Strategy<Value = Labels> {
    (
        prop::bool::weighted(0.1),
        sync(),
        vec(atom(shape), 0..=2),
        vec(update(shape), 0..=2),
    )
        .prop_map(|(select, sync, guards, updates)| Labels {
            select,
            sync,
            guards,
            updates,
        })
}

/// Legs that only lead on and update; those of every second branch point may have all labels.
fn legs(shape: Shape) -> impl Strategy<Value = Vec<Leg>> {
    let plain = (any_index(), vec(update(shape), 0..=1)).prop_map(|(target, updates)| Leg {
        target,
        labels: Labels {
            select: false,
            sync: Sync::None,
            guards: Vec::new(),
            updates,
        },
    });
    let any = (any_index(), labels(shape)).prop_map(|(target, labels)| Leg { target, labels });
    let (without, with) = if shape.legs { (4, 5) } else { (12, 2) };
    prop_oneof![
        without => Just(Vec::new()),
        1 => vec(plain, 1..=3),
        with => vec(any, 1..=3),
    ]
}

fn edge(shape: Shape) -> impl Strategy<Value = Edge> {
    let owner = if shape.uncontrollable { 0.5 } else { 1.0 };
    (
        (any_index(), any_index()),
        legs(shape),
        labels(shape),
        prop::bool::weighted(owner),
    )
        .prop_map(|((source, target), legs, labels, controllable)| Edge {
            source,
            target,
            legs,
            labels,
            controllable,
        })
}

fn process(shape: Shape) -> impl Strategy<Value = Process> {
    (vec(location(shape), 1..=4), vec(edge(shape), 0..=5))
        .prop_map(|(locations, edges)| Process { locations, edges })
}

/// Networks.
pub(crate) fn network(shape: Shape) -> impl Strategy<Value = Network> {
    let priority = if shape.priorities {
        prop_oneof![2 => Just(0), 1 => 1..PRIORITIES.len()].boxed()
    } else {
        Just(0).boxed()
    };
    let parts = (1..=shape.clocks, 1..=2_usize, vec(process(shape), 1..=3));
    let guarded = prop::bool::weighted(if shape.guarded_urgency { 0.4 } else { 0.0 });
    let network = |((clocks, variables, processes), priority, guards_urgency)| Network {
        clocks,
        variables,
        processes,
        priority,
        guards_urgency,
        is_observable: false,
        scale: 1,
    };
    (parts, priority, guarded).prop_map(network)
}

/// State formulas.
pub(crate) fn formula(shape: Shape) -> impl Strategy<Value = Formula> {
    let location = (any_index(), any_index())
        .prop_map(|(process, location)| Formula::Location { process, location })
        .boxed();
    let atom = atom(shape).prop_map(Formula::Atom).boxed();
    let mut leaves = vec![(6, location.clone()), (3, atom.clone())];
    if shape.deadlock {
        leaves.push((3, Just(Formula::Deadlock).boxed()));
    }
    let leaf = Union::new_weighted(leaves).boxed();
    let inner = leaf.clone();
    prop_oneof![
        4 => location,
        3 => leaf,
        2 => vec(inner.clone(), 2..=3).prop_map(Formula::And),
        1 => vec(inner.clone(), 2..=2).prop_map(Formula::Or),
        1 => inner.prop_map(|formula| Formula::Not(Box::new(formula))),
    ]
}

/// Networks that may be played under partial observation.
pub(crate) fn observable_network(shape: Shape) -> impl Strategy<Value = Network> {
    network(shape).prop_map(|network| Network {
        is_observable: true,
        ..network
    })
}

/// What may be observed: clocks only by `x >= c` and `x < c`.
pub(crate) fn observation(shape: Shape) -> impl Strategy<Value = Formula> {
    let location = (any_index(), any_index())
        .prop_map(|(process, location)| Formula::Location { process, location })
        .boxed();
    let clock = (any_index(), any::<bool>(), 0..=shape.constant)
        .prop_map(|(clock, is_lower, bound)| Atom::Clock {
            clock,
            relation: if is_lower {
                Relation::GreaterEqual
            } else {
                Relation::Less
            },
            bound,
        })
        .prop_map(Formula::Atom)
        .boxed();
    let variable = variable_atom().prop_map(Formula::Atom).boxed();
    let leaf = Union::new_weighted(vec![(3, location), (3, clock), (1, variable)]).boxed();
    let inner = leaf.clone();
    prop_oneof![
        8 => leaf,
        1 => vec(inner.clone(), 2..=3).prop_map(Formula::And),
        1 => vec(inner.clone(), 2..=2).prop_map(Formula::Or),
        1 => inner.prop_map(|formula| Formula::Not(Box::new(formula))),
    ]
}

impl Network {
    /// The same with comparisons of one clock in the place of those of differences.
    pub(crate) fn without_differences(mut self) -> Network {
        for edge in self.processes.iter_mut().flat_map(|one| &mut one.edges) {
            let legs = edge.legs.iter_mut().map(|leg| &mut leg.labels);
            for labels in legs.chain([&mut edge.labels]) {
                labels.guards.iter_mut().for_each(Atom::compare_one_clock);
            }
        }
        self
    }

    /// The same with all clock values multiplied.
    pub(crate) fn scaled(&self, scale: i32) -> Network {
        let mut network = self.clone();
        network.scale = scale;
        network
    }

    /// What a clock is compared with or set to: a constant, and a variable.
    fn time(&self, variable: Option<usize>, constant: i32) -> String {
        let constant = constant * self.scale;
        match (variable.map(|variable| self.variable(variable)), self.scale) {
            (None, _) => constant.to_string(),
            (Some(variable), 1) => format!("{variable} + {constant}"),
            (Some(variable), scale) => format!("{variable} * {scale} + {constant}"),
        }
    }

    /// The model as XTA.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for clock in 0..self.clocks {
            writeln!(text, "clock x{clock};").expect("strings take everything");
        }
        for variable in 0..self.variables {
            writeln!(text, "int[0,{}] v{variable};", VALUES - 1).expect("strings take everything");
        }
        for (name, declaration) in CHANNELS {
            writeln!(text, "{declaration} {name};").expect("strings take everything");
        }
        writeln!(text, "chan d[{VALUES}];").expect("strings take everything");
        let (channels, has_levels) = PRIORITIES[self.priority];
        text.push_str(channels);
        for (index, process) in self.processes.iter().enumerate() {
            self.process(index, process, &mut text);
        }
        let names: Vec<String> = (0..self.processes.len()).map(|p| format!("P{p}")).collect();
        let names = names.join(if has_levels { " < " } else { ", " });
        writeln!(text, "system {names};").expect("strings take everything");
        text
    }

    fn process(&self, index: usize, process: &Process, text: &mut String) {
        let count = process.locations.len();
        let states = process
            .locations
            .iter()
            .enumerate()
            .map(|(index, location)| {
                let parts: Vec<String> = location
                    .invariants
                    .iter()
                    .map(|invariant| self.invariant(invariant))
                    .collect();
                if parts.is_empty() {
                    format!("L{index}")
                } else {
                    format!("L{index} {{ {} }}", parts.join(" && "))
                }
            });
        let states: Vec<String> = states.collect();
        let mut lines = vec![format!("state {};", states.join(", "))];
        let branches = process.edges.iter().enumerate();
        let points: Vec<String> = branches
            .filter(|(_, edge)| !edge.legs.is_empty())
            .map(|(index, _)| format!("B{index}"))
            .collect();
        if !points.is_empty() {
            lines.push(format!("branchpoint {};", points.join(", ")));
        }
        for (word, urgency) in [("commit", Urgency::Committed), ("urgent", Urgency::Urgent)] {
            let locations = process.locations.iter().enumerate();
            let names: Vec<String> = locations
                .filter(|(_, location)| location.urgency == urgency)
                .map(|(index, _)| format!("L{index}"))
                .collect();
            if !names.is_empty() {
                lines.push(format!("{word} {};", names.join(", ")));
            }
        }
        lines.push("init L0;".to_owned());
        let mut edges = Vec::new();
        for (index, edge) in process.edges.iter().enumerate() {
            let arrow = if edge.controllable { "->" } else { "-u->" };
            let source = format!("L{}", edge.source % count);
            let target = format!("L{}", edge.target % count);
            let labels = self.labels(edge, None);
            if edge.legs.is_empty() {
                edges.push(format!("{source} {arrow} {target} {{ {labels} }}"));
                continue;
            }
            edges.push(format!("{source} {arrow} B{index} {{ {labels} }}"));
            for leg in &edge.legs {
                let (target, labels) = (leg.target % count, self.labels(edge, Some(leg)));
                edges.push(format!("B{index} -> L{target} {{ {labels} }}"));
            }
        }
        if !edges.is_empty() {
            lines.push(format!("trans {};", edges.join(",\n    ")));
        }
        writeln!(text, "process P{index}() {{\n  {}\n}}", lines.join("\n  "))
            .expect("strings take everything");
    }

    /// The labels of an edge, or of one of its legs.
    fn labels(&self, edge: &Edge, leg: Option<&Leg>) -> String {
        let (own, sync) = match leg {
            Some(leg) => (&leg.labels, leg.labels.sync),
            None => (&edge.labels, edge.own_sync()),
        };
        let mut labels = Vec::new();
        if own.select {
            labels.push(format!("select s : int[0,{}];", VALUES - 1));
        }
        let guards = self.guards(edge, leg);
        let guards: Vec<String> = guards.iter().map(|atom| self.atom(atom)).collect();
        if !guards.is_empty() {
            labels.push(format!("guard {};", guards.join(" && ")));
        }
        let (name, send) = match sync {
            Sync::None => (String::new(), false),
            Sync::Channel { channel, send } => (CHANNELS[channel].0.to_owned(), send),
            Sync::Indexed { send, .. } if own.select => ("d[s]".to_owned(), send),
            Sync::Indexed { variable, send } => (format!("d[{}]", self.variable(variable)), send),
        };
        if !name.is_empty() {
            labels.push(format!("sync {name}{};", if send { "!" } else { "?" }));
        }
        let updates: Vec<String> = own
            .updates
            .iter()
            .map(|update| self.update(update, own.select))
            .collect();
        if !updates.is_empty() {
            labels.push(format!("assign {};", updates.join(", ")));
        }
        labels.join(" ")
    }

    /// The guards of an edge, or of one of its legs, without those that it must not have.
    fn guards(&self, edge: &Edge, leg: Option<&Leg>) -> Vec<Atom> {
        let own = leg.map_or(&edge.labels, |leg| &leg.labels);
        let mut syncs = vec![edge.own_sync()];
        match leg {
            Some(leg) => syncs.push(leg.labels.sync),
            None => syncs.extend(edge.legs.iter().map(|leg| leg.labels.sync)),
        }
        let is_free = syncs.iter().all(|sync| {
            (!sync.is_urgent() || self.guards_urgency)
                && !(self.is_observable && sync.receives_broadcast())
        });
        let kept = own
            .guards
            .iter()
            .filter(|atom| is_free || matches!(atom, Atom::Variable { .. }));
        kept.map(|atom| {
            if self.is_observable && edge.controllable {
                atom.with_first_moment()
            } else {
                atom.clone()
            }
        })
        .collect()
    }

    pub(crate) fn clock(&self, clock: usize) -> String {
        format!("x{}", clock % self.clocks)
    }

    fn variable(&self, variable: usize) -> String {
        format!("v{}", variable % self.variables)
    }

    fn invariant(&self, invariant: &Invariant) -> String {
        match *invariant {
            Invariant::Upper {
                clock,
                bound,
                strict,
            } => {
                let relation = if strict { "<" } else { "<=" };
                let bound = self.time(None, bound);
                format!("{} {relation} {bound}", self.clock(clock))
            }
            Invariant::UpperByVariable {
                clock,
                variable,
                bound,
            } => {
                let bound = self.time(Some(variable), bound);
                format!("{} <= {bound}", self.clock(clock))
            }
            Invariant::Conditional {
                variable,
                value,
                clock,
                bound,
            } => format!(
                "({} == {value} imply {} <= {bound})",
                self.variable(variable),
                self.clock(clock),
                bound = self.time(None, bound)
            ),
            Invariant::Variable { variable, bound } => {
                format!("{} <= {bound}", self.variable(variable))
            }
        }
    }

    fn atom(&self, atom: &Atom) -> String {
        match *atom {
            Atom::Clock {
                clock,
                relation,
                bound,
            } => {
                let bound = self.time(None, bound);
                format!("{} {} {bound}", self.clock(clock), relation.text())
            }
            Atom::ClockByVariable {
                clock,
                relation,
                variable,
                bound,
            } => {
                let bound = self.time(Some(variable), bound);
                format!("{} {} {bound}", self.clock(clock), relation.text())
            }
            Atom::Difference {
                left,
                right,
                relation,
                bound,
            } => format!(
                "{} - {} {} {bound}",
                self.clock(left),
                self.clock(right),
                relation.text(),
                bound = self.time(None, bound)
            ),
            Atom::Variable {
                variable,
                relation,
                bound,
            } => {
                format!("{} {} {bound}", self.variable(variable), relation.text())
            }
        }
    }

    fn update(&self, update: &Update, has_select: bool) -> String {
        match *update {
            Update::Reset { clock, value } => {
                format!("{} = {}", self.clock(clock), self.time(None, value))
            }
            Update::ResetToVariable { clock, variable } => {
                let value = self.time(Some(variable), 0);
                format!("{} = {value}", self.clock(clock))
            }
            Update::Copy { target, source } => {
                format!("{} = {}", self.clock(target), self.clock(source))
            }
            Update::Set { variable, value } => format!("{} = {value}", self.variable(variable)),
            Update::Increment { variable } => {
                let name = self.variable(variable);
                format!("{name} = ({name} + 1) % {VALUES}")
            }
            Update::Select { variable } => {
                let value = if has_select { "s" } else { "0" };
                format!("{} = {value}", self.variable(variable))
            }
        }
    }

    /// A formula as text.
    pub(crate) fn formula(&self, formula: &Formula) -> String {
        match formula {
            Formula::Location { process, location } => {
                let (process, location) = self.location(*process, *location);
                format!("P{process}.L{location}")
            }
            Formula::Atom(atom) => self.atom(atom),
            Formula::Deadlock => "deadlock".to_owned(),
            Formula::Not(inner) => format!("not ({})", self.formula(inner)),
            Formula::And(parts) => self.formulas(parts, " and "),
            Formula::Or(parts) => self.formulas(parts, " or "),
        }
    }

    fn formulas(&self, parts: &[Formula], between: &str) -> String {
        let parts: Vec<String> = parts.iter().map(|part| self.formula(part)).collect();
        format!("({})", parts.join(between))
    }

    /// The process and location that two numbers mean.
    fn location(&self, process: usize, location: usize) -> (usize, usize) {
        let process = process % self.processes.len();
        (process, location % self.processes[process].locations.len())
    }

    /// Whether a formula without `deadlock` holds; clock values in ticks, the reference clock
    /// first.
    pub(crate) fn holds(
        &self,
        formula: &Formula,
        words: &[i32],
        clocks: &[i64],
        ticks: i64,
        deadlock: &dyn Fn() -> bool,
    ) -> bool {
        let holds = |part: &Formula| self.holds(part, words, clocks, ticks, deadlock);
        match formula {
            Formula::Location { process, location } => {
                let (process, location) = self.location(*process, *location);
                words[process] == location as i32
            }
            Formula::Atom(atom) => self.atom_holds(atom, words, clocks, ticks),
            Formula::Deadlock => deadlock(),
            Formula::Not(inner) => !holds(inner),
            Formula::And(parts) => parts.iter().all(holds),
            Formula::Or(parts) => parts.iter().any(holds),
        }
    }

    fn atom_holds(&self, atom: &Atom, words: &[i32], clocks: &[i64], ticks: i64) -> bool {
        let clock = |index: usize| clocks[1 + index % self.clocks];
        let value =
            |variable: usize| i64::from(words[self.processes.len() + variable % self.variables]);
        match *atom {
            Atom::Clock {
                clock: index,
                relation,
                bound,
            } => relation.holds(clock(index), i64::from(bound) * ticks),
            Atom::ClockByVariable {
                clock: index,
                relation,
                variable,
                bound,
            } => relation.holds(clock(index), (value(variable) + i64::from(bound)) * ticks),
            Atom::Difference {
                left,
                right,
                relation,
                bound,
            } => relation.holds(clock(left) - clock(right), i64::from(bound) * ticks),
            Atom::Variable {
                variable,
                relation,
                bound,
            } => relation.holds(value(variable), i64::from(bound)),
        }
    }
}

impl Edge {
    /// Its synchronisation if no leg has one.
    fn own_sync(&self) -> Sync {
        let mut legs = self.legs.iter();
        if legs.any(|leg| leg.labels.sync != Sync::None) {
            Sync::None
        } else {
            self.labels.sync
        }
    }
}

impl Sync {
    fn is_urgent(self) -> bool {
        matches!(self, Sync::Channel { channel, .. } if CHANNELS[channel].1.starts_with("urgent"))
    }

    fn receives_broadcast(self) -> bool {
        match self {
            Sync::Channel { channel, send } => !send && CHANNELS[channel].1.contains("broadcast"),
            _ => false,
        }
    }
}

impl Formula {
    /// The same with comparisons of one clock in the place of those of differences.
    pub(crate) fn without_differences(mut self) -> Formula {
        self.compare_one_clock();
        self
    }

    fn compare_one_clock(&mut self) {
        match self {
            Formula::Atom(atom) => atom.compare_one_clock(),
            Formula::Not(inner) => inner.compare_one_clock(),
            Formula::And(parts) | Formula::Or(parts) => {
                parts.iter_mut().for_each(Formula::compare_one_clock);
            }
            Formula::Location { .. } | Formula::Deadlock => {}
        }
    }
}

impl Atom {
    fn compare_one_clock(&mut self) {
        if let Atom::Difference {
            left,
            relation,
            bound,
            ..
        } = *self
        {
            *self = Atom::Clock {
                clock: left,
                relation,
                bound,
            };
        }
    }

    /// The same with a weak lower bound of a clock in the place of a strict one.
    fn with_first_moment(&self) -> Atom {
        let mut atom = self.clone();
        if let Atom::Clock { relation, .. } | Atom::ClockByVariable { relation, .. } = &mut atom
            && *relation == Relation::Greater
        {
            *relation = Relation::GreaterEqual;
        }
        atom
    }
}

/// Whether a formula compares differences of clocks.
pub(crate) fn has_differences(formula: &Formula) -> bool {
    match formula {
        Formula::Atom(Atom::Difference { .. }) => true,
        Formula::Not(inner) => has_differences(inner),
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(has_differences),
        _ => false,
    }
}

/// Whether the formula mentions `deadlock`.
pub(crate) fn has_deadlock(formula: &Formula) -> bool {
    match formula {
        Formula::Deadlock => true,
        Formula::Not(inner) => has_deadlock(inner),
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(has_deadlock),
        Formula::Location { .. } | Formula::Atom(_) => false,
    }
}

//! Small networks with chance as data: what they are, and their text in the language.
//!
//! Nothing here uses the engine: the text is what the engine reads, and the data is what
//! [`moves`], [`chain`] and [`grid`] compute probabilities from.

use std::fmt::Write as _;

pub(crate) mod chain;
pub(crate) mod generate;
pub(crate) mod grid;
pub(crate) mod moves;

/// A network. Variables and clocks start at 0, processes in their first location.
#[derive(Clone, Debug, Default)]
pub(crate) struct Net {
    /// The greatest value of each variable; the least is 0.
    pub(crate) greatest: Vec<i32>,
    pub(crate) clocks: usize,
    /// Whether windows of exponential delays may close. None may be a single moment, since such a
    /// delay never falls on it; so no move happens at a known moment then.
    pub(crate) closes: bool,
    /// Of each broadcast channel, whether it is urgent.
    pub(crate) channels: Vec<bool>,
    pub(crate) processes: Vec<Process>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Process {
    pub(crate) locations: Vec<Location>,
    pub(crate) edges: Vec<Edge>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Urgency {
    Normal,
    Urgent,
    Committed,
}

/// A location; one without a bound that can be left has a rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Location {
    pub(crate) urgency: Urgency,
    /// The clock that the invariant bounds, and by what.
    pub(crate) bound: Option<(usize, i32)>,
    /// A number, and what divides it.
    pub(crate) rate: Option<(Number, i32)>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Number {
    Constant(i32),
    /// A constant and a variable, added.
    Plus(i32, usize),
    /// What the edge selects.
    Selected,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compare {
    AtLeast,
    AtMost,
    Equal,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Atom {
    Variable(usize, Compare, Number),
    Clock(usize, Compare, i32),
}

#[derive(Clone, Debug)]
pub(crate) struct Edge {
    pub(crate) source: usize,
    /// The greatest value that is selected; the least is 0.
    pub(crate) select: Option<i32>,
    pub(crate) guard: Vec<Atom>,
    /// The channel, and whether the edge sends.
    pub(crate) sync: Option<(usize, bool)>,
    pub(crate) updates: Vec<Assignment>,
    pub(crate) branches: Vec<Branch>,
}

#[derive(Clone, Debug)]
pub(crate) struct Branch {
    /// 1 if it is not written.
    pub(crate) weight: Option<Number>,
    pub(crate) guard: Vec<Atom>,
    /// Only if the edge has none.
    pub(crate) sync: Option<(usize, bool)>,
    pub(crate) target: usize,
    pub(crate) updates: Vec<Assignment>,
}

/// Numbers that are assigned to a variable count modulo its greatest value and one.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Assignment {
    Set(usize, Number),
    Add(usize, Number),
    Clock(usize, i32),
}

#[derive(Clone, Debug)]
pub(crate) enum Condition {
    At(usize, usize),
    Is(Atom),
    All(Vec<Condition>),
    Any(Vec<Condition>),
}

#[derive(Clone, Debug)]
pub(crate) enum Path {
    Eventually(Condition),
    Always(Condition),
    Until(Condition, Condition),
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Bound {
    /// Twice the time.
    HalfUnits(u32),
    Moves(u32),
}

#[derive(Clone, Debug)]
pub(crate) struct Query {
    pub(crate) bound: Bound,
    pub(crate) path: Path,
}

impl Net {
    /// The network in the language.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for (variable, greatest) in self.greatest.iter().enumerate() {
            let _ = writeln!(text, "int[0, {greatest}] v{variable} = 0;");
        }
        for clock in 0..self.clocks {
            let _ = writeln!(text, "clock x{clock};");
        }
        for (channel, is_urgent) in self.channels.iter().enumerate() {
            let urgent = if *is_urgent { "urgent " } else { "" };
            let _ = writeln!(text, "{urgent}broadcast chan c{channel};");
        }
        let mut names = Vec::new();
        for (number, process) in self.processes.iter().enumerate() {
            self.add_process(number, process, &mut text);
            names.push(format!("P{number}"));
        }
        let _ = writeln!(text, "system {};", names.join(", "));
        text
    }

    fn add_process(&self, number: usize, process: &Process, text: &mut String) {
        let states: Vec<String> = process
            .locations
            .iter()
            .enumerate()
            .map(|(location, known)| {
                let bound = known
                    .bound
                    .map_or(String::new(), |(clock, most)| format!("x{clock} <= {most}"));
                let rate = known.rate.map_or(String::new(), |(number, divisor)| {
                    format!(" ; {}:{divisor}", number.text())
                });
                if bound.is_empty() && rate.is_empty() {
                    format!("L{location}")
                } else {
                    format!("L{location} {{ {bound}{rate} }}")
                }
            })
            .collect();
        let _ = writeln!(text, "process P{number}() {{");
        let _ = writeln!(text, "    state {};", states.join(", "));
        let branching = |edge: &Edge| edge.branches.len() > 1 || edge.has_labelled_legs();
        let points: Vec<String> = (0..process.edges.len())
            .filter(|&edge| branching(&process.edges[edge]))
            .map(|edge| format!("b{edge}"))
            .collect();
        if !points.is_empty() {
            let _ = writeln!(text, "    branchpoint {};", points.join(", "));
        }
        for (urgency, word) in [(Urgency::Committed, "commit"), (Urgency::Urgent, "urgent")] {
            let such: Vec<String> = (0..process.locations.len())
                .filter(|&location| process.locations[location].urgency == urgency)
                .map(|location| format!("L{location}"))
                .collect();
            if !such.is_empty() {
                let _ = writeln!(text, "    {word} {};", such.join(", "));
            }
        }
        let _ = writeln!(text, "    init L0;");
        let mut edges = Vec::new();
        for (number, edge) in process.edges.iter().enumerate() {
            let mut labels = String::new();
            if let Some(most) = edge.select {
                let _ = write!(labels, "select s : int[0, {most}]; ");
            }
            labels.push_str(&conditions(&edge.guard, edge.sync));
            if branching(edge) {
                let assign = self.assign(&edge.updates);
                edges.push(format!(
                    "L{} -> b{number} {{ {labels}{assign}}}",
                    edge.source
                ));
                for branch in &edge.branches {
                    let weight = branch.weight.map_or(String::new(), |weight| {
                        format!("probability {}; ", weight.text())
                    });
                    edges.push(format!(
                        "b{number} -> L{} {{ {}{}{weight}}}",
                        branch.target,
                        conditions(&branch.guard, branch.sync),
                        self.assign(&branch.updates),
                    ));
                }
            } else {
                let only = &edge.branches[0];
                let updates: Vec<_> = edge.updates.iter().chain(&only.updates).copied().collect();
                let assign = self.assign(&updates);
                edges.push(format!(
                    "L{} -> L{} {{ {labels}{assign}}}",
                    edge.source, only.target
                ));
            }
        }
        if !edges.is_empty() {
            let _ = writeln!(text, "    trans {};", edges.join(",\n        "));
        }
        text.push_str("}\n");
    }

    fn assign(&self, updates: &[Assignment]) -> String {
        if updates.is_empty() {
            return String::new();
        }
        let texts: Vec<String> = updates
            .iter()
            .map(|update| match *update {
                Assignment::Set(variable, number) => format!(
                    "v{variable} = ({}) % {}",
                    number.text(),
                    self.greatest[variable] + 1
                ),
                Assignment::Add(variable, number) => format!(
                    "v{variable} = (v{variable} + {}) % {}",
                    number.text(),
                    self.greatest[variable] + 1
                ),
                Assignment::Clock(clock, value) => format!("x{clock} = {value}"),
            })
            .collect();
        format!("assign {}; ", texts.join(", "))
    }

    /// The greatest constant that a clock is compared with or set to.
    fn greatest_constant(&self, query: &Query) -> i32 {
        let mut greatest = 0;
        let mut atoms: Vec<Atom> = query.path.atoms();
        for process in &self.processes {
            for location in &process.locations {
                greatest = greatest.max(location.bound.map_or(0, |(_, most)| most));
            }
            for edge in &process.edges {
                atoms.extend(&edge.guard);
                atoms.extend(edge.branches.iter().flat_map(|branch| &branch.guard));
                let updates = edge.branches.iter().flat_map(|branch| &branch.updates);
                for update in edge.updates.iter().chain(updates) {
                    if let Assignment::Clock(_, value) = update {
                        greatest = greatest.max(*value);
                    }
                }
            }
        }
        for atom in atoms {
            if let Atom::Clock(_, _, constant) = atom {
                greatest = greatest.max(constant);
            }
        }
        greatest
    }
}

/// Guard and synchronisation as labels.
fn conditions(guard: &[Atom], sync: Option<(usize, bool)>) -> String {
    let mut labels = String::new();
    if !guard.is_empty() {
        let guard: Vec<String> = guard.iter().map(Atom::text).collect();
        let _ = write!(labels, "guard {}; ", guard.join(" && "));
    }
    if let Some((channel, sends)) = sync {
        let mark = if sends { '!' } else { '?' };
        let _ = write!(labels, "sync c{channel}{mark}; ");
    }
    labels
}

impl Edge {
    /// Whether some leg has a guard or synchronises.
    pub(crate) fn has_labelled_legs(&self) -> bool {
        let mut legs = self.branches.iter();
        legs.any(|leg| !leg.guard.is_empty() || leg.sync.is_some())
    }
}

impl Number {
    fn text(self) -> String {
        match self {
            Number::Constant(constant) => constant.to_string(),
            Number::Plus(constant, variable) => format!("({constant} + v{variable})"),
            Number::Selected => "s".to_owned(),
        }
    }
}

impl Atom {
    fn text(&self) -> String {
        let sign = |compare: Compare| match compare {
            Compare::AtLeast => ">=",
            Compare::AtMost => "<=",
            Compare::Equal => "==",
        };
        match *self {
            Atom::Variable(variable, compare, number) => {
                format!("v{variable} {} {}", sign(compare), number.text())
            }
            Atom::Clock(clock, compare, constant) => {
                format!("x{clock} {} {constant}", sign(compare))
            }
        }
    }
}

impl Condition {
    /// The condition in the language.
    pub(crate) fn text(&self) -> String {
        let joined = |all: &[Condition], word: &str| {
            let texts: Vec<String> = all.iter().map(Condition::text).collect();
            format!("({})", texts.join(word))
        };
        match self {
            Condition::At(process, location) => format!("P{process}.L{location}"),
            Condition::Is(atom) => atom.text(),
            Condition::All(all) => joined(all, " && "),
            Condition::Any(any) => joined(any, " || "),
        }
    }

    fn add_atoms(&self, atoms: &mut Vec<Atom>) {
        match self {
            Condition::At(..) => {}
            Condition::Is(atom) => atoms.push(*atom),
            Condition::All(parts) | Condition::Any(parts) => {
                for part in parts {
                    part.add_atoms(atoms);
                }
            }
        }
    }
}

impl Path {
    fn atoms(&self) -> Vec<Atom> {
        let mut atoms = Vec::new();
        match self {
            Path::Eventually(goal) => goal.add_atoms(&mut atoms),
            Path::Always(keep) => keep.add_atoms(&mut atoms),
            Path::Until(keep, goal) => {
                keep.add_atoms(&mut atoms);
                goal.add_atoms(&mut atoms);
            }
        }
        atoms
    }
}

impl Query {
    /// The query in the language.
    pub(crate) fn text(&self) -> String {
        let bound = match self.bound {
            Bound::HalfUnits(halves) => format!("<={}", f64::from(halves) / 2.0),
            Bound::Moves(moves) => format!("#<={moves}"),
        };
        let path = match &self.path {
            Path::Eventually(goal) => format!("<> {}", goal.text()),
            Path::Always(keep) => format!("[] {}", keep.text()),
            Path::Until(keep, goal) => format!("{} U {}", keep.text(), goal.text()),
        };
        format!("Pr[{bound}]({path})")
    }
}

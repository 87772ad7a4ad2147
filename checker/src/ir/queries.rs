//! Compiled queries.

use super::ids::{ClockId, FunctionId, LocationId, ProcessId};
use super::labels::{ClockAtom, ClockRange};
use super::learning::Optimum;
use super::shields::Shield;
use super::statistical::Statistical;
use crate::diagnostics::Span;

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
    Control(Control),
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
        /// What the strategy sees, as texts, if the query says it.
        features: Option<FeatureTexts>,
    },
    /// `minE`, `maxE`, `minPr`, `maxPr`: for the best strategy.
    Optimum(Box<Optimum>),
    /// `acontrol: A[] p {…}`: for what the controller may do so that p holds for ever.
    Shield(Box<Shield>),
    /// `Pr`, `E`, `simulate`: what random runs answer.
    Statistical(Box<Statistical>),
}

/// What a strategy that is loaded sees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeatureTexts {
    /// What has exact values.
    pub discrete: Vec<String>,
    /// What has values in intervals.
    pub continuous: Vec<String>,
}

/// A game for a controller.
#[derive(Clone, Debug)]
pub struct Control {
    /// What it is to enforce.
    pub objective: Objective,
    /// `E<> control: …`: only from some state that both players get to together.
    pub cooperative: bool,
    /// `control_t*(u, g)`: in the least time.
    pub time_optimal: Option<TimeBounds>,
    /// `{…} control: …`: what it sees, if that is not everything.
    pub observations: Option<Vec<Predicate>>,
}

/// The bounds of `control_t*(u, g)`.
#[derive(Clone, Copy, Debug)]
pub struct TimeBounds {
    /// The time u within which the goal is to be reached.
    pub limit: Option<FunctionId>,
    /// How much g of it must be left wherever the goal does not hold yet.
    pub rest: Option<FunctionId>,
}

impl QueryKind {
    /// The game of a query in which the controller sees everything.
    pub fn full_game(&self) -> Option<&Control> {
        match self {
            QueryKind::Control(control) if control.observations.is_none() => Some(control),
            _ => None,
        }
    }
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

impl Objective {
    /// What is to be reached, if something is.
    pub fn goal(&self) -> Option<&Predicate> {
        match self {
            Objective::Safe(_) => None,
            Objective::Reach(goal)
            | Objective::Until(_, goal)
            | Objective::WeakUntil(_, goal)
            | Objective::Buchi(_, goal) => Some(goal),
        }
    }

    /// What is to be kept, if something is.
    pub fn keep(&self) -> Option<&Predicate> {
        match self {
            Objective::Reach(_) => None,
            Objective::Safe(keep)
            | Objective::Until(keep, _)
            | Objective::WeakUntil(keep, _)
            | Objective::Buchi(keep, _) => Some(keep),
        }
    }

    /// What is to be kept and to be reached.
    pub fn predicates(&self) -> impl Iterator<Item = &Predicate> {
        self.keep().into_iter().chain(self.goal())
    }
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

    /// The parts that are not put together of others.
    pub fn leaves(&self) -> Vec<&Predicate> {
        match self {
            Predicate::Not(inner) => inner.leaves(),
            Predicate::And(parts) | Predicate::Or(parts) => {
                parts.iter().flat_map(Predicate::leaves).collect()
            }
            leaf => vec![leaf],
        }
    }

    /// The clock comparisons in it.
    pub fn comparisons(&self) -> impl Iterator<Item = &ClockPredicate> {
        self.leaves().into_iter().filter_map(|leaf| match leaf {
            Predicate::Clock(comparison) => Some(comparison),
            _ => None,
        })
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

impl ClockPredicate {
    /// The comparison for static analysis.
    pub fn atom(&self) -> ClockAtom {
        let (left, right) = (self.left.range(), self.right.range());
        ClockAtom {
            strict: self.strict,
            ..ClockAtom::weak(left, right, self.range.0, self.range.1)
        }
    }
}

/// A clock in a query: known, or chosen by the words.
#[derive(Clone, Copy, Debug)]
pub enum ClockChoice {
    /// This clock.
    Fixed(ClockId),
    /// One of consecutive clocks: the function returns the offset from the first.
    Indexed(ClockRange, FunctionId),
}

impl ClockChoice {
    /// The clocks that it may be.
    pub fn range(self) -> ClockRange {
        match self {
            ClockChoice::Fixed(clock) => ClockRange::one(clock),
            ClockChoice::Indexed(range, _) => range,
        }
    }
}

//! The typed tree: what checking makes of the syntax tree, and lowering turns into code.
//!
//! Invariants:
//! * Names are resolved, types are known, conversions are explicit, constant integer and double
//!   operations are folded.
//! * An expression that a mistake was reported about is [`Kind::Error`]; it spreads silently and is
//!   never lowered.
//! * A place (something that may be assigned, referred to or indexed) is a [`Kind::Variable`] under
//!   [`Kind::Index`] and [`Kind::Field`]; which memory it means follows from the type at its top.

use super::types::{Interval, Size, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::Distribution;
use crate::ir::{
    ClockAtom, ClockRange, DoubleOperator, FunctionId, IntegerOperator, MathFunction, Relation,
};

/// Index of a local of the function, guard or update that is being checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct LocalId(pub(super) u32);

/// Where a variable lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Root {
    /// In the state, among the clocks and the channels.
    State,
    /// In the constant memory.
    Constants,
    /// In a register or the frame of the function, or behind a reference parameter of it.
    Local(LocalId),
}

/// A variable as expressions refer to it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    /// Where it lives.
    pub(super) root: Root,
    /// Its first word, clock and channel.
    pub(super) base: Size,
    /// Whether it may be assigned.
    pub(super) mutable: bool,
    /// Where a variable was declared that could be left out (see `left_out`); nowhere for all
    /// others.
    pub(super) declared: Span,
}

impl Place {
    /// A place that no declaration in the text names.
    pub(super) fn unnamed(root: Root, base: Size, mutable: bool) -> Place {
        Place {
            root,
            base,
            mutable,
            declared: Span::default(),
        }
    }

    /// A local that a quantifier, a loop or a `select` binds.
    pub(super) fn bound(local: LocalId) -> Place {
        Place::unnamed(Root::Local(local), Size::default(), false)
    }
}

/// An element of an array: its index counts from `first`, and its place from the start of the array
/// in strides.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) array: Box<Expr>,
    pub(super) index: Box<Expr>,
    pub(super) first: i32,
    pub(super) length: u32,
    pub(super) stride: Size,
}

impl Element {
    /// How many elements stand before it; `None` if the index is not known, or outside.
    pub(super) fn position(&self) -> Option<u32> {
        let index = self.index.constant()?;
        let position = index.abs_diff(self.first);
        (index >= self.first && position < self.length).then_some(position)
    }
}

/// Offsets of words below this are variables; from it on, `meta` variables, until the layout is
/// final.
pub(super) const META_WORDS: u32 = 1 << 29;
/// Offsets of words from this on are locations of processes, until the layout is final.
pub(super) const LOCATION_WORDS: u32 = 1 << 30;

/// An expression.
#[derive(Clone, Debug)]
pub(super) struct Expr {
    /// What it is.
    pub(super) kind: Kind,
    /// Its type.
    pub(super) ty: Type,
    /// Where it was written.
    pub(super) span: Span,
    /// The values that it can have, if it is integral.
    pub(super) interval: (i32, i32),
}

/// The kinds of expressions.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    /// A mistake was reported, or the value of a parameter that no instance gives.
    Error,
    /// An integer, truth value or scalar.
    Int(i32),
    /// A double.
    Double(f64),
    /// A text, which imported functions take.
    Text(std::sync::Arc<str>),
    /// A variable.
    Variable(Place),
    /// A part of an array, or a member of a process set's variable.
    Index(Element),
    /// A field of a struct, by its offset from the start in words, clocks and channels.
    Field { record: Box<Expr>, offset: Size },
    /// An integer as a double.
    ToDouble(Box<Expr>),
    /// A value that only statistical queries know, and what it comes from; it stands only where
    /// nothing depends on it, and is never lowered.
    Unknown(Box<Expr>),
    /// The value of a real clock as a double.
    ClockReading(Box<Expr>),
    /// A random number; its arguments are doubles.
    Random(Distribution, Vec<Expr>),
    /// A double truncated to an integer.
    ToInteger(Box<Expr>),
    /// Arithmetic on integers.
    Integer(IntegerOperator, Box<Expr>, Box<Expr>),
    /// Arithmetic on doubles.
    Real(DoubleOperator, Box<Expr>, Box<Expr>),
    /// A comparison of integers or scalars.
    Compare(Relation, Box<Expr>, Box<Expr>),
    /// A comparison of doubles.
    CompareReal(Relation, Box<Expr>, Box<Expr>),
    /// Whether two arrays or structs are equal (or unequal, if false).
    CompareWords(bool, Box<Expr>, Box<Expr>),
    /// Logical negation; also of conditions on clocks.
    Not(Box<Expr>),
    /// Conjunction, from left to right; also of conditions on clocks.
    And(Box<Expr>, Box<Expr>),
    /// Disjunction, from left to right; also of conditions on clocks.
    Or(Box<Expr>, Box<Expr>),
    /// `condition ? then : otherwise`
    Ternary(Box<Expr>, Box<Expr>, Box<Expr>),
    /// A function of the mathematical library.
    Math(MathFunction, Vec<Expr>),
    /// Assignment of a value of the target's type, ranges apart.
    Assign(Box<Expr>, Box<Expr>),
    /// `target op= value` on integers.
    Compound(IntegerOperator, Box<Expr>, Box<Expr>),
    /// `++` and `--`.
    Step {
        target: Box<Expr>,
        delta: i32,
        postfix: bool,
    },
    /// A clock is set to an integer, or to another clock plus an integer.
    AssignClock {
        target: Box<Expr>,
        source: Option<Box<Expr>>,
        value: Option<Box<Expr>>,
    },
    /// A call; arguments by reference are places.
    Call {
        function: FunctionId,
        signature: std::sync::Arc<Signature>,
        arguments: Vec<Expr>,
    },
    /// `forall`, `exists`, `sum` over a range.
    Quantifier {
        quantifier: crate::syntax::ast::Quantifier,
        local: LocalId,
        range: (i32, i32),
        body: Box<Expr>,
    },
    /// A sum of clocks and an integer; only inside comparisons and assignments.
    ClockSum(ClockSum),
    /// `left - right ≺ bound`, or `≺ -bound` if negated; a missing clock is the reference clock.
    ClockCompare {
        relation: ClockRelation,
        left: Option<Box<Expr>>,
        right: Option<Box<Expr>>,
        bound: Box<Expr>,
        negated: bool,
    },
    /// `clock' == rate`
    Rate { clock: Box<Expr>, rate: Box<Expr> },
    /// `deadlock`
    Deadlock,
}

/// A clock, the difference of two, or either plus an integer.
#[derive(Clone, Debug, Default)]
pub(super) struct ClockSum {
    /// The clock that is added.
    pub(super) plus: Option<Box<Expr>>,
    /// The clock that is subtracted.
    pub(super) minus: Option<Box<Expr>>,
    /// The integer that is added.
    pub(super) offset: Option<Box<Expr>>,
}

/// Relations between clocks, after `>` and `>=` were turned round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClockRelation {
    Less,
    LessEqual,
    Equal,
    NotEqual,
}

/// What callers must know of a function.
#[derive(Clone, Debug)]
pub(super) struct Signature {
    /// Its name.
    pub(super) name: String,
    /// Its parameters.
    pub(super) parameters: Vec<Parameter>,
    /// What it returns.
    pub(super) result: Type,
    /// What it does to the state.
    pub(super) effects: Effects,
    /// Whether it stands in a library: what else a call may do is not known.
    pub(super) is_external: bool,
    /// Set if its result depends on values that only statistical queries know. Then it is not
    /// lowered.
    pub(super) unknown: Option<Unknown>,
}

/// Why the result of a function depends on values that only statistical queries know.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    /// The report if anything depends on the function.
    pub(super) diagnostic: Diagnostic,
    /// Whether it may change something outside itself.
    may_write: bool,
}

/// A parameter of a function.
#[derive(Clone, Debug)]
pub(super) struct Parameter {
    /// Its name.
    pub(super) name: String,
    /// Its type.
    pub(super) ty: Type,
    /// Whether it is passed by reference.
    pub(super) reference: bool,
    /// Whether it may not be assigned.
    pub(super) constant: bool,
    /// Whether it is a channel that is passed by its number, to an instance of a template.
    pub(super) passes_channel: bool,
    /// Where it was declared, if it could be left out.
    pub(super) declared: Span,
}

/// What code reads and writes; conservative.
#[derive(Clone, Debug, Default)]
pub(super) struct Effects {
    /// Ranges of words that may be written: first word and count.
    pub(super) writes: Vec<(u32, u32)>,
    /// Clocks that may be assigned, and what.
    pub(super) assignments: Vec<ClockEffect>,
    /// Clock comparisons.
    pub(super) atoms: Vec<ClockAtom>,
    /// Whether a variable of the state is read.
    pub(super) reads_state: bool,
    /// Whether it may emit constraints or assignments of clocks.
    pub(super) emits: bool,
    /// Whether a clock is mentioned.
    pub(super) mentions_clocks: bool,
}

/// An assignment to a clock that may be a parameter of the function.
#[derive(Clone, Debug)]
pub(super) struct ClockEffect {
    /// What may be assigned.
    pub(super) target: ClockSet,
    /// The clocks whose value may be given to it.
    pub(super) source: Option<ClockSet>,
    /// The integers that may be given, or added.
    pub(super) range: (i32, i32),
}

/// Clocks that an expression may mean.
#[derive(Clone, Copy, Debug)]
pub(super) enum ClockSet {
    /// Some of these.
    Range(ClockRange),
    /// Some of those behind a parameter.
    Parameter(LocalId),
}

/// A statement.
#[derive(Clone, Debug)]
pub(super) enum Statement {
    /// Several.
    Block(Vec<Statement>),
    /// An expression for its effect.
    Expr(Expr),
    /// A local comes into being, with the value of its type and then these assignments.
    Declare(LocalId, Vec<Expr>),
    /// `while`, `do … while` (tested after the body) and `for` (with a step).
    Loop {
        condition: Option<Expr>,
        step: Option<Expr>,
        body: Box<Statement>,
        tested_first: bool,
        /// What is blamed if it runs without end.
        span: Span,
    },
    /// `for (name : type)`
    Iterate {
        local: LocalId,
        range: (i32, i32),
        body: Box<Statement>,
    },
    /// `if`, with all its `else if`
    If(Vec<(Expr, Statement)>, Option<Box<Statement>>),
    /// `return`
    Return(Option<Expr>),
    /// `assert`
    Assert(Expr, Span),
}

/// A local of a function, guard or update.
#[derive(Clone, Debug)]
pub(super) struct Local {
    /// Its type.
    pub(super) ty: Type,
    /// Whether it must lie in memory because something refers to it.
    pub(super) addressed: bool,
    /// Whether it is a parameter by reference: another name for something that other names may mean
    /// as well.
    pub(super) reference: bool,
}

impl Expr {
    /// An expression about which a mistake was reported.
    pub(super) fn error(span: Span) -> Expr {
        Expr {
            kind: Kind::Error,
            ty: Type::Error,
            span,
            interval: (i32::MIN, i32::MAX),
        }
    }

    /// An expression that may have any value of its type.
    pub(super) fn new(kind: Kind, ty: Type, span: Span) -> Expr {
        let (low, high) = ty.bounds();
        // What runs through an empty range has no value, and its interval is not to turn around.
        let interval = (low.min(high), high.max(low));
        Expr {
            kind,
            ty,
            span,
            interval,
        }
    }

    /// An integer constant.
    pub(super) fn int(value: i32, ty: Type, span: Span) -> Expr {
        Expr {
            kind: Kind::Int(value),
            ty,
            span,
            interval: (value, value),
        }
    }

    /// A truth value.
    pub(super) fn bool(value: bool, span: Span) -> Expr {
        Expr::int(i32::from(value), Type::Bool, span)
    }

    /// The same with a narrower interval.
    pub(super) fn within(mut self, interval: Interval) -> Expr {
        self.interval = interval;
        self
    }

    /// Whether a mistake was reported about it.
    pub(super) fn is_error(&self) -> bool {
        self.ty.is_error() || matches!(self.kind, Kind::Error)
    }

    /// The value of an integer constant.
    pub(super) fn constant(&self) -> Option<i32> {
        match self.kind {
            Kind::Int(value) => Some(value),
            _ => None,
        }
    }

    /// Whether it names a place.
    pub(super) fn is_place(&self) -> bool {
        match &self.kind {
            Kind::Index(Element { array: inner, .. }) | Kind::Field { record: inner, .. } => {
                inner.is_place()
            }
            Kind::Variable(_)
            | Kind::Assign(..)
            | Kind::Compound(..)
            | Kind::Step { postfix: false, .. }
            | Kind::Error => true,
            Kind::Ternary(_, then, otherwise) => {
                then.ty.is_equivalent(&otherwise.ty) && then.is_place() && otherwise.is_place()
            }
            _ => false,
        }
    }

    /// Whether it names a place that may be assigned.
    pub(super) fn is_mutable_place(&self) -> bool {
        match &self.kind {
            Kind::Variable(place) => place.mutable,
            Kind::Index(Element { array: inner, .. }) | Kind::Field { record: inner, .. } => {
                inner.is_mutable_place()
            }
            Kind::Ternary(_, then, otherwise) => {
                self.is_place() && then.is_mutable_place() && otherwise.is_mutable_place()
            }
            _ => self.is_place(),
        }
    }

    /// The variable that a place is part of; `None` for anything but a path of indices and fields.
    pub(super) fn variable(&self) -> Option<&Place> {
        match &self.kind {
            Kind::Variable(place) => Some(place),
            Kind::Index(Element { array: inner, .. }) | Kind::Field { record: inner, .. } => {
                inner.variable()
            }
            _ => None,
        }
    }

    /// Whether this expression or one below it satisfies the condition.
    pub(super) fn any(&self, condition: &impl Fn(&Expr) -> bool) -> bool {
        if condition(self) {
            return true;
        }
        let mut found = false;
        self.children(&mut |child| found = found || child.any(condition));
        found
    }

    /// Calls `visit` on the expressions directly below, in the order of evaluation.
    pub(super) fn children<'e>(&'e self, visit: &mut dyn FnMut(&'e Expr)) {
        match &self.kind {
            Kind::Error
            | Kind::Int(_)
            | Kind::Double(_)
            | Kind::Text(_)
            | Kind::Variable(_)
            | Kind::Deadlock => {}
            Kind::Field { record: inner, .. }
            | Kind::ToDouble(inner)
            | Kind::Unknown(inner)
            | Kind::ClockReading(inner)
            | Kind::ToInteger(inner)
            | Kind::Not(inner)
            | Kind::Step { target: inner, .. }
            | Kind::Quantifier { body: inner, .. } => visit(inner),
            Kind::Index(Element {
                array: left,
                index: right,
                ..
            })
            | Kind::Integer(_, left, right)
            | Kind::Real(_, left, right)
            | Kind::Compare(_, left, right)
            | Kind::CompareReal(_, left, right)
            | Kind::CompareWords(_, left, right)
            | Kind::And(left, right)
            | Kind::Or(left, right)
            | Kind::Assign(left, right)
            | Kind::Compound(_, left, right)
            | Kind::Rate {
                clock: left,
                rate: right,
            } => {
                visit(left);
                visit(right);
            }
            Kind::Ternary(condition, then, otherwise) => {
                visit(condition);
                visit(then);
                visit(otherwise);
            }
            Kind::Math(_, arguments)
            | Kind::Random(_, arguments)
            | Kind::Call { arguments, .. } => {
                arguments.iter().for_each(visit);
            }
            Kind::AssignClock {
                target,
                source,
                value,
            } => {
                visit(target);
                source.iter().chain(value).for_each(|e| visit(e));
            }
            Kind::ClockSum(sum) => {
                let parts = [&sum.plus, &sum.minus, &sum.offset];
                parts.into_iter().flatten().for_each(|e| visit(e));
            }
            Kind::ClockCompare {
                left, right, bound, ..
            } => {
                left.iter().chain(right).for_each(|e| visit(e));
                visit(bound);
            }
        }
    }

    /// Whether it changes a variable or a clock, or draws a random number.
    pub(super) fn has_effect(&self) -> bool {
        self.changes() || self.any(&|e| matches!(e.kind, Kind::Random(..)))
    }

    /// Whether it changes a variable or a clock.
    pub(super) fn changes(&self) -> bool {
        self.any(&|e| match &e.kind {
            Kind::Assign(target, _) => !target.is_left_out(),
            Kind::Compound(..) | Kind::Step { .. } | Kind::AssignClock { .. } => true,
            Kind::Call { signature, .. } => signature.may_write(),
            _ => false,
        })
    }

    /// Whether it depends on values that only statistical queries know.
    pub(super) fn is_unknown(&self) -> bool {
        self.any(&|e| match &e.kind {
            Kind::Unknown(_) => true,
            Kind::Call { signature, .. } => signature.unknown.is_some(),
            _ => false,
        })
    }

    /// Whether it stands for a variable whose values are left out; a place in itself, it is not
    /// among [`Expr::is_place`].
    fn is_left_out(&self) -> bool {
        matches!(&self.kind, Kind::Unknown(_))
    }

    /// Whether it changes something else than a local, itself and not in an expression below it.
    fn changes_state(&self) -> bool {
        match &self.kind {
            Kind::Assign(target, _) if target.is_left_out() => false,
            Kind::Assign(target, _) | Kind::Compound(_, target, _) | Kind::Step { target, .. } => {
                let place = target.variable();
                !place.is_some_and(|place| matches!(place.root, Root::Local(_)))
            }
            Kind::AssignClock { .. } => true,
            Kind::Call { signature, .. } => signature.may_write(),
            _ => false,
        }
    }

    /// Whether it depends on clocks or on `deadlock`.
    pub(super) fn mentions_clocks(&self) -> bool {
        self.any(&|e| {
            matches!(
                e.kind,
                Kind::ClockCompare { .. } | Kind::ClockSum(_) | Kind::Rate { .. } | Kind::Deadlock
            )
        })
    }

    /// Whether its value can change as time passes, in the stochastic reading.
    pub(super) fn is_timed(&self) -> bool {
        self.any(&|e| match &e.kind {
            Kind::ClockReading(_) => true,
            Kind::Call {
                signature,
                arguments,
                ..
            } => {
                signature.effects.mentions_clocks
                    || arguments
                        .iter()
                        .any(|a| a.ty.any(&|ty| *ty == Type::RealClock))
            }
            _ => false,
        })
    }
}

impl Parameter {
    /// Whether words behind it may change. What becomes of clocks is known from the body.
    fn may_be_written(&self) -> bool {
        self.reference && !self.constant && self.ty.size().words > 0
    }
}

impl Signature {
    /// Whether a call may change something outside the function.
    pub(super) fn may_write(&self) -> bool {
        self.unknown
            .as_ref()
            .is_some_and(|unknown| unknown.may_write)
            || (self.is_external && self.result == Type::Void)
            || !self.effects.writes.is_empty()
            || !self.effects.assignments.is_empty()
            || self.parameters.iter().any(Parameter::may_be_written)
    }
}

impl Unknown {
    /// That of a function of a library, whose result only statistical queries know.
    pub(super) fn of_external(diagnostic: Diagnostic, may_write: bool) -> Unknown {
        Unknown {
            diagnostic,
            may_write,
        }
    }

    /// That of a function with this body.
    pub(super) fn of(body: &Statement, diagnostic: Diagnostic) -> Unknown {
        Unknown {
            diagnostic,
            may_write: body.any(&Expr::changes_state),
        }
    }
}

impl Statement {
    /// Whether an expression in it satisfies the condition.
    fn any(&self, condition: &impl Fn(&Expr) -> bool) -> bool {
        let holds = |expr: &Option<Expr>| expr.as_ref().is_some_and(|expr| expr.any(condition));
        match self {
            Statement::Block(statements) => statements.iter().any(|one| one.any(condition)),
            Statement::Expr(expr) | Statement::Assert(expr, _) => expr.any(condition),
            Statement::Declare(_, assignments) => assignments.iter().any(|one| one.any(condition)),
            Statement::Loop {
                condition: head,
                step,
                body,
                ..
            } => holds(head) || holds(step) || body.any(condition),
            Statement::Iterate { body, .. } => body.any(condition),
            Statement::If(branches, otherwise) => {
                let mut branches = branches.iter();
                branches.any(|(head, then)| head.any(condition) || then.any(condition))
                    || otherwise.as_ref().is_some_and(|one| one.any(condition))
            }
            Statement::Return(value) => holds(value),
        }
    }
}

/// Splits a conjunction into its parts, from left to right.
pub(super) fn conjuncts(expr: Expr, parts: &mut Vec<Expr>) {
    match expr.kind {
        Kind::And(left, right) => {
            conjuncts(*left, parts);
            conjuncts(*right, parts);
        }
        Kind::Int(value) if value != 0 => {}
        _ => parts.push(expr),
    }
}

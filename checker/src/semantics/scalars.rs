//! What tells the members of a scalar set apart.
//!
//! The language lets scalars only be compared for equality, assigned and used as indices, so that
//! exchanging two members everywhere turns what a network can do into what it can do. Four things
//! break this, and are noted of a set where they stand: code that runs through the members and
//! depends on their order, constants that differ from member to member, values that nothing chose
//! (the first member, for a scalar of a function without a value), and places where members are
//! numbered.
//!
//! Invariant: what is noted here is conservative. A loop counts as independent of the order only if
//! it is of the simple kinds of [`is_order_irrelevant`].
//!
//! Source: M. Hendriks, G. Behrmann, K. G. Larsen, P. Niebert, F. Vaandrager, "Adding Symmetry
//! Reduction to UPPAAL", FORMATS 2003 (which trusts loops; here they are looked at).

use super::checker::Checker;
use super::typed::{Element, Expr, Kind, Local, LocalId, Place, Root, Statement};
use super::types::{Memory, Size, Type};
use crate::diagnostics::Span;
use crate::ir::IntegerOperator;

impl Checker<'_> {
    /// Notes that members of the set of a scalar type are told apart; nothing for other types.
    pub(super) fn distinguish_members(&mut self, ty: &Type, span: Span) {
        if let Some(set) = ty.scalar_set() {
            self.distinguish_set(set, span);
        }
    }

    fn distinguish_set(&mut self, set: u32, span: Span) {
        let set = &mut self.world.network.scalar_sets[set as usize];
        set.told_apart_by.get_or_insert(span);
    }

    /// Notes it of the sets whose members are values of this type.
    pub(super) fn distinguish_scalars(&mut self, ty: &Type, span: Span) {
        match ty {
            Type::Array(array) => self.distinguish_scalars(&array.part, span),
            Type::Struct(record) => {
                for (_, ty) in &record.fields {
                    self.distinguish_scalars(ty, span);
                }
            }
            _ => self.distinguish_members(ty, span),
        }
    }

    /// Notes it of the sets that arrays of this type are indexed by.
    pub(super) fn distinguish_indices(&mut self, ty: &Type, span: Span) {
        match ty {
            Type::Array(array) => {
                if let Some(set) = array.index.set {
                    self.distinguish_set(set, span);
                }
                self.distinguish_indices(&array.part, span);
            }
            Type::Struct(record) => {
                for (_, ty) in &record.fields {
                    self.distinguish_indices(ty, span);
                }
            }
            _ => {}
        }
    }

    /// Notes it of the sets that index arrays whose parts differ, in a constant of these words.
    pub(super) fn distinguish_parts(&mut self, ty: &Type, words: &[i32], span: Span) {
        match ty {
            Type::Array(array) => {
                let size = array.part.size().words as usize;
                let Some(first) = words.get(..size) else {
                    return;
                };
                let are_equal = words.chunks(size.max(1)).all(|part| part == first);
                if let Some(set) = array.index.set
                    && !are_equal
                {
                    self.distinguish_set(set, span);
                }
                for part in words.chunks(size.max(1)) {
                    self.distinguish_parts(&array.part, part, span);
                }
            }
            Type::Struct(record) => {
                let mut rest = words;
                for (_, ty) in &record.fields {
                    let (part, later) = rest.split_at((ty.size().words as usize).min(rest.len()));
                    self.distinguish_parts(ty, part, span);
                    rest = later;
                }
            }
            _ => {}
        }
    }
}

/// What the body of a loop does to one variable.
#[derive(Clone, Debug, PartialEq)]
enum Write {
    /// It writes only the part that the loop variable indexes, this many words and clocks apart.
    Own((u32, u32)),
    /// It adds values of this sign, or takes bits together in this way.
    Gathers(IntegerOperator),
    /// It assigns this value.
    Sets(i32),
}

/// A variable that a loop body touches.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Touched {
    root: Root,
    base: Size,
    size: Size,
}

impl Touched {
    /// Whether the two may share a word or a clock.
    fn may_overlap(self, other: Touched, locals: &[Local]) -> bool {
        let is_reference =
            |root| matches!(root, Root::Local(local) if locals[local.0 as usize].reference);
        match (self.root, other.root) {
            (Root::State, Root::State) => {
                let meets = |memory| {
                    let (first, second) = (self.base.of(memory), other.base.of(memory));
                    first < second + other.size.of(memory) && second < first + self.size.of(memory)
                };
                meets(Memory::Words) || meets(Memory::Clocks)
            }
            (Root::Constants, _) | (_, Root::Constants) => false,
            (first, second) => first == second || is_reference(first) || is_reference(second),
        }
    }
}

/// A loop body, taken apart.
struct Body {
    local: LocalId,
    writes: Vec<(Touched, Write)>,
    /// The variables that are read. If the loop variable chooses a part of one: how far apart its
    /// parts are.
    reads: Vec<(Touched, Option<(u32, u32)>)>,
    /// The values that end the loop.
    returns: Vec<i32>,
    is_simple: bool,
}

/// Whether running through the values of `local` in another order does the same: each round touches
/// only its own parts of what is written, or gathers into variables in a way that does not depend
/// on the order, or only looks for a reason to return.
pub(super) fn is_order_irrelevant(body: &Statement, local: LocalId, locals: &[Local]) -> bool {
    let mut parts = Body {
        local,
        writes: Vec::new(),
        reads: Vec::new(),
        returns: Vec::new(),
        is_simple: true,
    };
    parts.statement(body);
    let writes_agree = parts.writes.iter().all(|one| {
        let mut others = parts.writes.iter();
        others.all(|other| one == other || !one.0.may_overlap(other.0, locals))
    });
    let reads_fit = parts.reads.iter().all(|&(read, own)| {
        let mut writes = parts.writes.iter();
        writes.all(|(written, write)| {
            let is_own = own.is_some_and(|own| read == *written && *write == Write::Own(own));
            is_own || !read.may_overlap(*written, locals)
        })
    });
    let returns_fit = match parts.returns.as_slice() {
        [] => true,
        [first, others @ ..] => parts.writes.is_empty() && others.iter().all(|one| one == first),
    };
    parts.is_simple && writes_agree && reads_fit && returns_fit
}

/// The variable that a place is part of.
fn touched(place: &Expr) -> Option<Touched> {
    match &place.kind {
        Kind::Variable(Place { root, base, .. }) => Some(Touched {
            root: *root,
            base: *base,
            size: place.ty.size(),
        }),
        Kind::Index(Element { array: inner, .. }) | Kind::Field { record: inner, .. } => {
            touched(inner)
        }
        _ => None,
    }
}

impl Body {
    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Block(statements) => {
                for one in statements {
                    self.statement(one);
                }
            }
            Statement::Expr(expr) => self.effect(expr),
            Statement::Iterate { body, .. } => self.statement(body),
            Statement::If(branches, otherwise) => {
                for (condition, then) in branches {
                    self.reading(condition);
                    self.statement(then);
                }
                if let Some(otherwise) = otherwise {
                    self.statement(otherwise);
                }
            }
            Statement::Return(Some(Expr {
                kind: Kind::Int(value),
                ty,
                ..
            })) if ty.is_integral() => self.returns.push(*value),
            Statement::Assert(condition, _) => self.reading(condition),
            Statement::Declare(..) | Statement::Loop { .. } | Statement::Return(_) => {
                self.is_simple = false;
            }
        }
    }

    /// An expression that stands for its effect.
    fn effect(&mut self, expr: &Expr) {
        match &expr.kind {
            Kind::Assign(target, value) => {
                let constant = match value.kind {
                    Kind::Int(value) if target.ty.is_integral() => Some(Write::Sets(value)),
                    _ => None,
                };
                self.write(target, constant);
                self.reading(value);
            }
            Kind::AssignClock {
                target,
                source: None,
                value,
            } => {
                self.write(target, None);
                if let Some(value) = value {
                    self.reading(value);
                }
            }
            Kind::Compound(operator, target, value) => {
                let is_monotone = match operator {
                    // Values of one sign leave the range at the end or not at all.
                    IntegerOperator::Add | IntegerOperator::Subtract => value.interval.0 >= 0,
                    IntegerOperator::And
                    | IntegerOperator::Or
                    | IntegerOperator::Minimum
                    | IntegerOperator::Maximum => true,
                    _ => false,
                };
                self.write(target, is_monotone.then_some(Write::Gathers(*operator)));
                self.reading(value);
            }
            Kind::Step { target, delta, .. } => {
                let operator = if *delta > 0 {
                    IntegerOperator::Add
                } else {
                    IntegerOperator::Subtract
                };
                self.write(target, Some(Write::Gathers(operator)));
            }
            _ => self.reading(expr),
        }
    }

    /// A write to a part of a variable; `common` says what it is if the loop variable does not
    /// choose the part.
    fn write(&mut self, target: &Expr, common: Option<Write>) {
        let own = self.own_stride(target);
        let write = own.map(Write::Own).or(common);
        match (touched(target), write) {
            (Some(variable), Some(write)) => self.writes.push((variable, write)),
            _ => self.is_simple = false,
        }
        self.indices(target);
    }

    /// If the loop variable chooses a part of a place: how far apart its parts are.
    fn own_stride(&self, place: &Expr) -> Option<(u32, u32)> {
        match &place.kind {
            Kind::Index(element) if self.is_loop_variable(&element.index) => {
                Some((element.stride.words, element.stride.clocks))
            }
            Kind::Index(element) => self.own_stride(&element.array),
            Kind::Field { record, .. } => self.own_stride(record),
            _ => None,
        }
    }

    fn is_loop_variable(&self, expr: &Expr) -> bool {
        matches!(&expr.kind, Kind::Variable(place) if place.root == Root::Local(self.local))
    }

    /// The indices of a place are read.
    fn indices(&mut self, place: &Expr) {
        match &place.kind {
            Kind::Index(element) => {
                self.reading(&element.index);
                self.indices(&element.array);
            }
            Kind::Field { record, .. } => self.indices(record),
            _ => {}
        }
    }

    /// An expression that must be without effect.
    fn reading(&mut self, expr: &Expr) {
        match &expr.kind {
            Kind::Variable(_) | Kind::Index(_) | Kind::Field { .. } => {
                match touched(expr) {
                    Some(variable) => self.reads.push((variable, self.own_stride(expr))),
                    None => self.is_simple = false,
                }
                self.indices(expr);
            }
            Kind::Assign(..)
            | Kind::Compound(..)
            | Kind::Step { .. }
            | Kind::AssignClock { .. }
            | Kind::Call { .. } => self.is_simple = false,
            _ => {
                let mut children = Vec::new();
                expr.children(&mut |child| children.push(child));
                for child in children {
                    self.reading(child);
                }
            }
        }
    }
}

//! Values that must be known when the model is loaded: bounds, sizes, initialisers, arguments of
//! templates.
//!
//! Most are folded while they are checked. What is left (calls of functions, parts of constant
//! arrays) is lowered and run by the interpreter, so there is one meaning of code only.

use super::checker::Checker;
use super::codes;
use super::typed::{Expr, Kind, Root};
use super::types::Type;
use crate::diagnostics::Span;
use crate::exec::arithmetic;
use crate::ir::RunTimeErrorKind;

impl Checker<'_> {
    /// Whether the value of an expression is known without a state.
    pub(super) fn is_computable(expr: &Expr) -> bool {
        !expr.any(&|e| match &e.kind {
            Kind::Variable(place) => match place.root {
                Root::Constants => false,
                Root::State => true,
                Root::Local(_) => !Self::is_bound_inside(expr, place.root),
            },
            Kind::Call { signature, .. } => {
                signature.effects.reads_state
                    || signature.effects.mentions_clocks
                    || signature.may_write()
            }
            Kind::Deadlock
            | Kind::ClockCompare { .. }
            | Kind::ClockSum(_)
            | Kind::Rate { .. }
            | Kind::Random(..)
            | Kind::AssignClock { .. } => true,
            _ => false,
        })
    }

    /// Whether a local is bound by a quantifier inside the expression itself.
    fn is_bound_inside(expr: &Expr, root: Root) -> bool {
        expr.any(
            &|e| matches!(&e.kind, Kind::Quantifier { local, .. } if root == Root::Local(*local)),
        )
    }

    /// The words of an expression that must be known now, converted to `ty`; `None` if that was
    /// reported, or if it depends on a value that no instance gives.
    pub(super) fn known_words(&mut self, expr: &Expr, ty: &Type, what: &str) -> Option<Vec<i32>> {
        if expr.is_error() || ty.is_error() {
            return None;
        }
        if !Self::is_computable(expr) {
            return self.refused(
                codes::VALUE_NOT_CONSTANT,
                expr.span,
                format!("{what} must be known when the model is loaded"),
                "use constants, and functions that read only constants",
            );
        }
        if *ty == Type::RealClock {
            let words = self.known_words(expr, &Type::Double, what)?;
            let value = arithmetic::double_of_words(words[0], words[1]);
            return Some(Type::clock_words(value).to_vec());
        }
        let words = match expr.kind {
            Kind::Int(value) => vec![value],
            Kind::Double(value) => arithmetic::double_words(value).to_vec(),
            _ => self.run_expression(expr)?,
        };
        if ty.split_value(&words).is_none() {
            let value = match words[..] {
                [value] => format!("the value {value}"),
                _ => String::from("a part of this value"),
            };
            return self.refused(
                codes::CONSTANT_OUT_OF_RANGE,
                expr.span,
                format!("{value} is outside {ty}"),
                "use another value, or widen the range",
            );
        }
        Some(words)
    }

    fn run_expression(&mut self, expr: &Expr) -> Option<Vec<i32>> {
        // What is open elsewhere in a function does not matter here.
        let elsewhere = if expr.is_unknown() {
            Vec::new()
        } else {
            std::mem::take(&mut self.unknowns)
        };
        let can_lower = self.can_lower();
        self.unknowns.extend(elsewhere);
        if !can_lower {
            if let Some(kind) = failure(expr) {
                self.report_failure(kind, expr.span);
            }
            return None;
        }
        let functions = self.world.network.functions.len();
        let function = self.builder(&[]).words(String::from("constant"), expr);
        let result = self.run(function, expr.ty.size().words);
        self.world.network.functions.truncate(functions);
        match result {
            Ok(words) => Some(words),
            Err(kind) => {
                self.report_failure(kind, expr.span);
                None
            }
        }
    }

    fn report_failure(&mut self, kind: RunTimeErrorKind, span: Span) {
        let reason = reason(kind);
        let help = if kind == RunTimeErrorKind::NotLoaded {
            "allow the library with --allow-external and its file or folder, if you trust its code"
        } else {
            "correct the expression"
        };
        let message = format!("this constant has no value: {reason}");
        self.error(codes::CONSTANT_WITHOUT_VALUE, span, message, help);
    }

    /// The value of an integer that must be known now.
    pub(super) fn known_int(&mut self, expr: &Expr, what: &str) -> Option<i32> {
        if !expr.ty.is_integral() {
            self.expect_integer(expr, what);
            return None;
        }
        self.known_words(expr, &Type::ANY_INT, what)
            .map(|words| words[0])
    }

    /// The bound of a range. As in C, and as UPPAAL does, the arithmetic of bounds wraps round
    /// where 32 bits are exceeded: `-(1<<31)` and `(1<<31)-1` are common ways to write the limits
    /// of integers.
    pub(super) fn known_bound(&mut self, expr: &Expr) -> Option<i32> {
        wrapping_value(expr).or_else(|| self.known_int(expr, "the bound of a range"))
    }

    /// Reports that an integer is needed.
    pub(super) fn expect_integer(&mut self, expr: &Expr, what: &str) -> bool {
        if expr.is_error() || expr.ty.is_integral() {
            return !expr.is_error();
        }
        self.error(
            codes::INTEGER_EXPECTED,
            expr.span,
            format!(
                "{what} must be an integer, but this is {}",
                expr.ty.described()
            ),
            "use an integer expression; fint(…) truncates a double",
        );
        false
    }
}

/// What goes wrong, for a sentence.
pub(super) fn reason(kind: RunTimeErrorKind) -> &'static str {
    match kind {
        RunTimeErrorKind::Overflow => "a result that does not fit into 32 bits",
        RunTimeErrorKind::DivisionByZero => "a division by zero",
        RunTimeErrorKind::ShiftDistance => {
            "a shift by a negative number of bits or by more than 31"
        }
        RunTimeErrorKind::NegativeExponent => "a negative exponent",
        RunTimeErrorKind::OutOfRange => "a value outside its range",
        RunTimeErrorKind::IndexOutOfBounds => "an index outside its array",
        RunTimeErrorKind::NotAnInteger => "a double that fits into no integer",
        RunTimeErrorKind::Parameter(_) => "a parameter of a random function out of its domain",
        RunTimeErrorKind::NoRoom => "too many instances of a dynamic template",
        RunTimeErrorKind::NotLoaded => "a call of an external function whose library is not loaded",
        RunTimeErrorKind::ClockValue => "a clock value beyond the limits",
        RunTimeErrorKind::AssertionFailed => "an assertion that does not hold",
        RunTimeErrorKind::StepLimit | RunTimeErrorKind::Interrupted => {
            "its loops, with those of all constants before it, take more than ten million rounds"
        }
    }
}

/// Why an expression has no value, if that can be seen without running code.
fn failure(expr: &Expr) -> Option<RunTimeErrorKind> {
    let own = match &expr.kind {
        Kind::Integer(operator, left, right) => {
            let operands = left.constant().zip(right.constant());
            operands.and_then(|(left, right)| arithmetic::integer(*operator, left, right).err())
        }
        Kind::Index(element) => {
            let is_outside = element.index.constant().is_some() && element.position().is_none();
            is_outside.then_some(RunTimeErrorKind::IndexOutOfBounds)
        }
        _ => None,
    };
    let mut found = own;
    expr.children(&mut |child| found = found.or_else(|| failure(child)));
    found
}

/// The value of arithmetic on integer constants, wrapping round.
fn wrapping_value(expr: &Expr) -> Option<i32> {
    match &expr.kind {
        Kind::Int(value) => Some(*value),
        Kind::Integer(operator, left, right) => {
            let (left, right) = (wrapping_value(left)?, wrapping_value(right)?);
            let result = arithmetic::integer(*operator, left, right).ok();
            result.map(|(value, _)| value)
        }
        _ => None,
    }
}

//! What an instruction computes, in a form in which equal computations are equal.

use crate::ir::{
    Address, DoubleOperator, Instruction, IntegerOperator, MathFunction, Register, Relation, SiteId,
};

/// An expression over values.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Expression {
    Integer(i32),
    /// The bits of a double.
    Double(u64),
    /// With its site where the result may wrap round, so that every place where one does is noted.
    Arithmetic(IntegerOperator, Register, Register, Option<SiteId>),
    CompareIntegers(Relation, Register, Register),
    CompareDoubles(Relation, Register, Register),
    Not(Register),
    DoubleArithmetic(DoubleOperator, Register, Register),
    Select(Register, Register, Register),
    ToDouble(Register),
    ToInteger(Register),
    Math(MathFunction, Vec<Register>, Option<SiteId>),
    Address(Address),
    Scale(Register, i32, u32, u32),
    AddIndices(Register, Register),
}

/// The expression that an instruction computes, if computing it again gives the same; operands of
/// commutative operators are sorted.
pub(super) fn expression_of(instruction: &Instruction) -> Option<Expression> {
    let sorted = |left: Register, right: Register| (left.min(right), left.max(right));
    Some(match instruction {
        &Instruction::Arithmetic {
            operator,
            left,
            right,
            site,
            ..
        } => {
            use IntegerOperator::{
                Add, And, Divide, Maximum, Minimum, Multiply, Or, Power, Subtract, Xor,
            };
            let (left, right) = match operator {
                Add | Multiply | And | Or | Xor | Minimum | Maximum => sorted(left, right),
                _ => (left, right),
            };
            let may_wrap = matches!(operator, Add | Subtract | Multiply | Divide | Power);
            Expression::Arithmetic(operator, left, right, may_wrap.then_some(site))
        }
        &Instruction::CompareIntegers {
            relation,
            left,
            right,
            ..
        } => Expression::CompareIntegers(relation, left, right),
        &Instruction::CompareDoubles {
            relation,
            left,
            right,
            ..
        } => Expression::CompareDoubles(relation, left, right),
        &Instruction::Not { source, .. } => Expression::Not(source),
        &Instruction::DoubleArithmetic {
            operator,
            left,
            right,
            ..
        } => {
            let (left, right) = match operator {
                DoubleOperator::Add | DoubleOperator::Multiply => sorted(left, right),
                _ => (left, right),
            };
            Expression::DoubleArithmetic(operator, left, right)
        }
        &Instruction::Select {
            condition,
            then,
            otherwise,
            ..
        } => Expression::Select(condition, then, otherwise),
        &Instruction::IntegerToDouble { source, .. } => Expression::ToDouble(source),
        &Instruction::DoubleToInteger { source, .. } => Expression::ToInteger(source),
        Instruction::Math {
            function,
            arguments,
            site,
            ..
        } => {
            let site = function.may_fail_or_wrap().then_some(*site);
            Expression::Math(*function, arguments.clone(), site)
        }
        &Instruction::AddressOf { address, .. } => Expression::Address(address),
        &Instruction::ScaleIndex {
            index,
            first,
            length,
            stride,
            ..
        } => Expression::Scale(index, first, length, stride),
        &Instruction::AddIndices { left, right, .. } => {
            let (left, right) = sorted(left, right);
            Expression::AddIndices(left, right)
        }
        _ => return None,
    })
}

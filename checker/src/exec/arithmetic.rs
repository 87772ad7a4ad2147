//! What the operators mean, on plain values: the one definition that interpretation, constant
//! folding and the tests of compiled code go back to.
//!
//! Invariant: nothing here panics or wraps silently: whether a result wrapped round is said with
//! it, and whatever has no result is a [`RunTimeErrorKind`].

use crate::builtins::canonical;
use crate::ir::{
    DoubleOperator, Instruction, IntegerOperator, Register, Relation, RunTimeErrorKind,
};

/// The result of integer arithmetic, and whether it wrapped round: the true result is another one
/// modulo 2^32.
pub(crate) type Wrapping = (i32, bool);

/// `left operator right`, or why there is no such integer.
pub(crate) fn integer(
    operator: IntegerOperator,
    left: i32,
    right: i32,
) -> Result<Wrapping, RunTimeErrorKind> {
    Ok(match operator {
        IntegerOperator::Add => left.overflowing_add(right),
        IntegerOperator::Subtract => left.overflowing_sub(right),
        IntegerOperator::Multiply => left.overflowing_mul(right),
        IntegerOperator::Divide | IntegerOperator::Remainder if right == 0 => {
            return Err(RunTimeErrorKind::DivisionByZero);
        }
        IntegerOperator::Divide => left.overflowing_div(right),
        IntegerOperator::Remainder => (left.wrapping_rem(right), false),
        IntegerOperator::Power => power(left, right)?,
        IntegerOperator::ShiftLeft => (left << shift_distance(right)?, false),
        IntegerOperator::ShiftRight => (left >> shift_distance(right)?, false),
        IntegerOperator::And => (left & right, false),
        IntegerOperator::Or => (left | right, false),
        IntegerOperator::Xor => (left ^ right, false),
        IntegerOperator::Minimum => (left.min(right), false),
        IntegerOperator::Maximum => (left.max(right), false),
    })
}

/// `left operator right` if there is such an integer and it did not wrap round: what may be
/// computed beforehand.
pub(crate) fn fitting(operator: IntegerOperator, left: i32, right: i32) -> Option<i32> {
    match integer(operator, left, right) {
        Ok((value, false)) => Some(value),
        Ok((_, true)) | Err(_) => None,
    }
}

/// The integer that an instruction computes from registers alone, if those are known and it fits.
pub(crate) fn value_of(
    instruction: &Instruction,
    known: impl Fn(Register) -> Option<i32>,
) -> Option<i32> {
    match *instruction {
        Instruction::Integer { value, .. } => Some(value),
        Instruction::Copy { source, .. } => known(source),
        Instruction::Not { source, .. } => Some(i32::from(known(source)? == 0)),
        Instruction::Arithmetic {
            operator,
            left,
            right,
            ..
        } => fitting(operator, known(left)?, known(right)?),
        Instruction::CompareIntegers {
            relation,
            left,
            right,
            ..
        } => Some(relate(relation, known(left)?, known(right)?).into()),
        Instruction::ScaleIndex {
            index,
            first,
            length,
            stride,
            ..
        } => scale_index(known(index)?, first, length, stride).ok(),
        Instruction::AddIndices { left, right, .. } => {
            Some(known(left)?.wrapping_add(known(right)?))
        }
        _ => None,
    }
}

/// `base ** exponent`; `0 ** 0` is 1.
pub(crate) fn power(base: i32, exponent: i32) -> Result<Wrapping, RunTimeErrorKind> {
    let exponent = u32::try_from(exponent).map_err(|_| RunTimeErrorKind::NegativeExponent)?;
    Ok(base.overflowing_pow(exponent))
}

fn shift_distance(bits: i32) -> Result<u32, RunTimeErrorKind> {
    u32::try_from(bits)
        .ok()
        .filter(|&bits| bits < 32)
        .ok_or(RunTimeErrorKind::ShiftDistance)
}

/// Whether two numbers stand in a relation; a NaN is unequal to everything and in no order.
pub(crate) fn relate<T: PartialOrd + Copy>(relation: Relation, left: T, right: T) -> bool {
    match relation {
        Relation::Less => left < right,
        Relation::LessEqual => left <= right,
        Relation::Greater => left > right,
        Relation::GreaterEqual => left >= right,
        Relation::Equal => left == right,
        Relation::NotEqual => left != right,
    }
}

/// `left operator right` on doubles. The sign and payload of a NaN are of no meaning, see
/// [`canonical`].
pub(crate) fn double(operator: DoubleOperator, left: f64, right: f64) -> f64 {
    match operator {
        DoubleOperator::Add => left + right,
        DoubleOperator::Subtract => left - right,
        DoubleOperator::Multiply => left * right,
        DoubleOperator::Divide => left / right,
        DoubleOperator::Minimum if left < right => left,
        DoubleOperator::Maximum if left > right => left,
        DoubleOperator::Minimum | DoubleOperator::Maximum => right,
    }
}

/// The double truncated towards zero, if it is a number and the result fits.
pub(crate) fn truncate(value: f64) -> Result<i32, RunTimeErrorKind> {
    // Both comparisons are false for a NaN.
    if value > -2_147_483_649.0 && value < 2_147_483_648.0 {
        Ok(value as i32)
    } else {
        Err(RunTimeErrorKind::NotAnInteger)
    }
}

/// The words of a double, low word first.
#[inline]
pub(crate) fn double_words(value: f64) -> [i32; 2] {
    let bits = canonical(value).to_bits();
    [bits as i32, (bits >> 32) as i32]
}

/// The double that two words hold, low word first.
#[inline]
pub(crate) fn double_of_words(low: i32, high: i32) -> f64 {
    f64::from_bits(u64::from(low as u32) | u64::from(high as u32) << 32)
}

/// `(index - first) * stride` if the index lies inside.
///
/// The subtraction wraps: integers modulo 2^32 are told apart by 32 bits, so exactly the `length`
/// valid indices have an unsigned difference below `length`.
pub(crate) fn scale_index(
    index: i32,
    first: i32,
    length: u32,
    stride: u32,
) -> Result<i32, RunTimeErrorKind> {
    let position = index.wrapping_sub(first) as u32;
    if position < length {
        Ok(position.wrapping_mul(stride) as i32)
    } else {
        Err(RunTimeErrorKind::IndexOutOfBounds)
    }
}

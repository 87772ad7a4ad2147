//! What an instruction comes down to, from what is known of its operands.

use crate::builtins::Number;
use crate::exec::arithmetic;
use crate::ir::{Instruction, IntegerOperator, Register, Relation};

use super::{Numbering, Simplified};

impl Numbering<'_, '_> {
    pub(super) fn simplify(&mut self, instruction: Instruction) -> Simplified {
        match instruction {
            Instruction::Integer { value, .. } => Simplified::Literal(Number::Integer(value)),
            Instruction::Double { value, .. } => Simplified::Literal(Number::Double(value.value())),
            Instruction::Copy { source, .. } => Simplified::Value(source),
            Instruction::Arithmetic { .. } => self.simplify_arithmetic(instruction),
            Instruction::CompareIntegers {
                relation,
                left,
                right,
                ..
            } => match self.relate(relation, left, right) {
                Some(holds) => Simplified::Literal(Number::Integer(holds.into())),
                None => Simplified::Instruction(instruction),
            },
            Instruction::CheckRange {
                value, low, high, ..
            } => {
                let range = self.range(value);
                if low <= range.0 && range.1 <= high {
                    return Simplified::Nothing;
                }
                let range = (range.0.max(low), range.1.min(high));
                if range.0 <= range.1 {
                    self.known.ranges.insert(value, range);
                }
                Simplified::Instruction(instruction)
            }
            Instruction::Require { condition, .. }
                if self.integer(condition).is_some_and(|value| value != 0) =>
            {
                Simplified::Nothing
            }
            Instruction::AddIndices { left, right, .. } => {
                match (self.integer(left), self.integer(right)) {
                    (Some(left), Some(right)) => {
                        Simplified::Literal(Number::Integer(left.wrapping_add(right)))
                    }
                    (Some(0), _) => Simplified::Value(right),
                    (_, Some(0)) => Simplified::Value(left),
                    _ => Simplified::Instruction(instruction),
                }
            }
            Instruction::ScaleIndex {
                index,
                first,
                length,
                stride,
                ..
            } => {
                let value = self
                    .integer(index)
                    .and_then(|index| arithmetic::scale_index(index, first, length, stride).ok());
                let (low, high) = self.range(index);
                match value {
                    Some(value) => Simplified::Literal(Number::Integer(value)),
                    None if first == 0 && stride == 1 && low >= 0 && (high as u32) < length => {
                        Simplified::Value(index)
                    }
                    None => Simplified::Instruction(instruction),
                }
            }
            Instruction::LoadInteger { .. }
            | Instruction::LoadDouble { .. }
            | Instruction::StoreInteger { .. }
            | Instruction::StoreDouble { .. }
            | Instruction::CopyWords { .. }
            | Instruction::Random { .. }
            | Instruction::External { .. }
            | Instruction::Call { .. } => self.simplify_access(instruction),
            other => match self.fold(&other) {
                Some(literal) => Simplified::Literal(literal),
                None => Simplified::Instruction(other),
            },
        }
    }

    /// The value of an expression over constants.
    fn fold(&self, instruction: &Instruction) -> Option<Number> {
        let integer = |register: &Register| self.integer(*register);
        let double = |register: &Register| self.double(*register);
        Some(match instruction {
            Instruction::Not { source, .. } => Number::Integer((integer(source)? == 0).into()),
            Instruction::CompareDoubles {
                relation,
                left,
                right,
                ..
            } => {
                let holds = arithmetic::doubles_relate(*relation, double(left)?, double(right)?);
                Number::Integer(holds.into())
            }
            Instruction::DoubleArithmetic {
                operator,
                left,
                right,
                ..
            } => Number::Double(arithmetic::double(*operator, double(left)?, double(right)?)),
            Instruction::Select {
                condition,
                then,
                otherwise,
                ..
            } => {
                let chosen = if integer(condition)? != 0 {
                    then
                } else {
                    otherwise
                };
                Number::Integer(integer(chosen)?)
            }
            Instruction::IntegerToDouble { source, .. } => {
                Number::Double(f64::from(integer(source)?))
            }
            Instruction::DoubleToInteger { source, .. } => {
                Number::Integer(arithmetic::truncate(double(source)?).ok()?)
            }
            Instruction::Math {
                function,
                arguments,
                ..
            } => {
                let known = arguments.iter().map(|&argument| self.literal(argument));
                let known: Vec<Number> = known.collect::<Option<_>>()?;
                match function.evaluate(&known)? {
                    (value, false) => value,
                    (_, true) => return None,
                }
            }
            _ => return None,
        })
    }

    fn simplify_arithmetic(&self, instruction: Instruction) -> Simplified {
        use IntegerOperator::{Add, Divide, Multiply, Subtract};
        let Instruction::Arithmetic {
            operator,
            target,
            left,
            right,
            ..
        } = instruction
        else {
            return Simplified::Instruction(instruction);
        };
        match (operator, self.integer(left), self.integer(right)) {
            (_, Some(left), Some(right)) => match arithmetic::fitting(operator, left, right) {
                Some(value) => Simplified::Literal(Number::Integer(value)),
                None => Simplified::Instruction(instruction),
            },
            (Add | Subtract, _, Some(0)) | (Multiply | Divide, _, Some(1)) => {
                Simplified::Value(left)
            }
            (Add, Some(0), _) | (Multiply, Some(1), _) => Simplified::Value(right),
            (Add, ..) => {
                let (left_range, right_range) = (self.range(left), self.range(right));
                let fits = left_range.0.checked_add(right_range.0).is_some()
                    && left_range.1.checked_add(right_range.1).is_some();
                if fits {
                    // A sum that cannot overflow needs no check.
                    Simplified::Instruction(Instruction::AddIndices {
                        target,
                        left,
                        right,
                    })
                } else {
                    Simplified::Instruction(instruction)
                }
            }
            _ => Simplified::Instruction(instruction),
        }
    }

    /// Whether two integers stand in a relation, if their ranges tell.
    fn relate(&self, relation: Relation, left: Register, right: Register) -> Option<bool> {
        if left == right {
            return Some(arithmetic::integers_relate(relation, 0, 0));
        }
        let (left, right) = (self.range(left), self.range(right));
        // The relation holds for all pairs, or for none, if it does so at both ends.
        match relation {
            Relation::Less | Relation::GreaterEqual => {
                let less = if left.1 < right.0 {
                    true
                } else if left.0 >= right.1 {
                    false
                } else {
                    return None;
                };
                Some(less == (relation == Relation::Less))
            }
            Relation::LessEqual | Relation::Greater => {
                let less_equal = if left.1 <= right.0 {
                    true
                } else if left.0 > right.1 {
                    false
                } else {
                    return None;
                };
                Some(less_equal == (relation == Relation::LessEqual))
            }
            Relation::Equal | Relation::NotEqual => {
                let equal = if left.1 < right.0 || right.1 < left.0 {
                    false
                } else if left.0 == left.1 && left == right {
                    true
                } else {
                    return None;
                };
                Some(equal == (relation == Relation::Equal))
            }
        }
    }
}

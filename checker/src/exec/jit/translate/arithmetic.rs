//! Instructions that compute registers from registers, and their checks.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::types::{F64, I32, I64};
use cranelift_codegen::ir::{InstBuilder, InstructionData, Opcode, Value};

use crate::builtins::{Code, IntegerResult};
use crate::exec::jit::runtime;
use crate::ir::{
    DoubleOperator, Instruction, IntegerOperator, MathFunction, Register, Relation,
    RunTimeErrorKind, SiteId,
};

use super::Translator;

impl Translator<'_> {
    /// The instructions that compute a register from others and cannot fail.
    pub(super) fn compute(&mut self, instruction: &Instruction) {
        let (target, value) = match *instruction {
            Instruction::Integer { target, value } => (target, self.integer(value)),
            Instruction::Double { target, value } => (target, self.ins().f64const(value.value())),
            Instruction::Copy { target, source } => (target, self.get(source)),
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                let holds = self.ins().icmp(integer_condition(relation), left, right);
                (target, self.truth(holds))
            }
            Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                let holds = self.ins().fcmp(double_condition(relation), left, right);
                (target, self.truth(holds))
            }
            Instruction::Not { target, source } => {
                let source = self.get(source);
                let is_zero = self.ins().icmp_imm_s(IntCC::Equal, source, 0);
                (target, self.truth(is_zero))
            }
            Instruction::Select {
                target,
                condition,
                then,
                otherwise,
            } => {
                let [condition, then, otherwise] =
                    [condition, then, otherwise].map(|register| self.get(register));
                (target, self.ins().select(condition, then, otherwise))
            }
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                (target, self.double_arithmetic(operator, left, right))
            }
            Instruction::IntegerToDouble { target, source } => {
                let source = self.get(source);
                (target, self.ins().fcvt_from_sint(F64, source))
            }
            Instruction::AddIndices {
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                (target, self.ins().iadd(left, right))
            }
            _ => unreachable!("sorted out by instruction"),
        };
        self.set(target, value);
    }

    /// The instructions that compute a register from others and can fail.
    pub(super) fn compute_checked(&mut self, instruction: &Instruction) {
        let (target, value) = match instruction {
            &Instruction::Arithmetic {
                operator,
                target,
                left,
                right,
                site,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                (target, self.arithmetic(operator, left, right, site))
            }
            &Instruction::DoubleToInteger {
                target,
                source,
                site,
            } => {
                let source = self.get(source);
                (target, self.truncate(source, site))
            }
            Instruction::Math {
                function,
                target,
                arguments,
                site,
            } => (*target, self.math(*function, arguments, *site)),
            Instruction::Random {
                distribution,
                target,
                arguments,
                stream,
                site,
            } => (*target, self.draw(*distribution, arguments, *stream, *site)),
            &Instruction::ScaleIndex {
                target,
                index,
                first,
                length,
                stride,
                site,
            } => {
                let index = self.get(index);
                let position = match first {
                    0 => index,
                    _ => self.ins().iadd_imm_s(index, -i64::from(first)),
                };
                let outside = self.ins().icmp_imm_u(
                    IntCC::UnsignedGreaterThanOrEqual,
                    position,
                    i64::from(length),
                );
                self.fail_if(outside, RunTimeErrorKind::IndexOutOfBounds, site);
                let scaled = match stride {
                    1 => position,
                    _ => self.ins().imul_imm_u(position, i64::from(stride)),
                };
                (target, scaled)
            }
            _ => unreachable!("sorted out by instruction"),
        };
        self.set(target, value);
    }

    fn double_arithmetic(&mut self, operator: DoubleOperator, left: Value, right: Value) -> Value {
        let ins = self.ins();
        match operator {
            DoubleOperator::Add => ins.fadd(left, right),
            DoubleOperator::Subtract => ins.fsub(left, right),
            DoubleOperator::Multiply => ins.fmul(left, right),
            DoubleOperator::Divide => ins.fdiv(left, right),
            DoubleOperator::Minimum => {
                let less = ins.fcmp(FloatCC::LessThan, left, right);
                self.ins().select(less, left, right)
            }
            DoubleOperator::Maximum => {
                // Cranelift knows the instruction for a maximum by this comparison only.
                let greater = ins.fcmp(FloatCC::LessThan, right, left);
                self.ins().select(greater, left, right)
            }
        }
    }

    fn arithmetic(
        &mut self,
        operator: IntegerOperator,
        left: Value,
        right: Value,
        site: SiteId,
    ) -> Value {
        let ins = self.ins();
        match operator {
            IntegerOperator::Add => {
                let (sum, overflow) = ins.sadd_overflow(left, right);
                self.overflow_if(overflow, site);
                sum
            }
            IntegerOperator::Subtract => {
                let (difference, overflow) = ins.ssub_overflow(left, right);
                self.overflow_if(overflow, site);
                difference
            }
            IntegerOperator::Multiply => {
                let (product, overflow) = ins.smul_overflow(left, right);
                self.overflow_if(overflow, site);
                product
            }
            IntegerOperator::Divide => {
                self.check_divisor(right, site);
                let divisor = self.divisor_that_fits(left, right, site);
                self.ins().sdiv(left, divisor)
            }
            IntegerOperator::Remainder => {
                self.check_divisor(right, site);
                self.ins().srem(left, right)
            }
            IntegerOperator::Power => self.power(left, right, site),
            IntegerOperator::ShiftLeft => {
                self.check_distance(right, site);
                self.ins().ishl(left, right)
            }
            IntegerOperator::ShiftRight => {
                self.check_distance(right, site);
                self.ins().sshr(left, right)
            }
            IntegerOperator::And => ins.band(left, right),
            IntegerOperator::Or => ins.bor(left, right),
            IntegerOperator::Xor => ins.bxor(left, right),
            IntegerOperator::Minimum => ins.smin(left, right),
            IntegerOperator::Maximum => ins.smax(left, right),
        }
    }

    /// The integer that a value always is, if it is a constant.
    fn constant(&self, value: Value) -> Option<i32> {
        let graph = &self.builder.func.dfg;
        match graph.insts[graph.value_def(value).inst()?] {
            InstructionData::UnaryImm {
                opcode: Opcode::Iconst,
                imm,
            } => Some(imm.bits() as i32),
            _ => None,
        }
    }

    fn check_divisor(&mut self, divisor: Value, site: SiteId) {
        if self.constant(divisor).is_some_and(|divisor| divisor != 0) {
            return;
        }
        let is_zero = self.ins().icmp_imm_s(IntCC::Equal, divisor, 0);
        self.fail_if(is_zero, RunTimeErrorKind::DivisionByZero, site);
    }

    /// The divisor, but 1 for `-2^31 / -1`, which wraps round to the dividend.
    fn divisor_that_fits(&mut self, dividend: Value, divisor: Value, site: SiteId) -> Value {
        if self.constant(divisor).is_some_and(|divisor| divisor != -1) {
            return divisor;
        }
        let is_least = self
            .ins()
            .icmp_imm_s(IntCC::Equal, dividend, i64::from(i32::MIN));
        let is_minus_one = self.ins().icmp_imm_s(IntCC::Equal, divisor, -1);
        let both = self.ins().band(is_least, is_minus_one);
        self.overflow_if(both, site);
        let one = self.integer(1);
        self.ins().select(both, one, divisor)
    }

    fn check_distance(&mut self, distance: Value, site: SiteId) {
        if (self.constant(distance)).is_some_and(|distance| (0..32).contains(&distance)) {
            return;
        }
        let outside = self
            .ins()
            .icmp_imm_u(IntCC::UnsignedGreaterThan, distance, 31);
        self.fail_if(outside, RunTimeErrorKind::ShiftDistance, site);
    }

    fn power(&mut self, base: Value, exponent: Value, site: SiteId) -> Value {
        let negative = self.ins().icmp_imm_s(IntCC::SignedLessThan, exponent, 0);
        self.fail_if(negative, RunTimeErrorKind::NegativeExponent, site);
        let code = runtime::power as *const () as usize;
        let power = self.call_back(code, Some(I64), &[base, exponent]);
        self.unwrapped(power, site)
    }

    /// The integer of an [`IntegerResult`] that is one.
    fn unwrapped(&mut self, result: Value, site: SiteId) -> Value {
        let has_wrapped = self.ins().icmp_imm_s(
            IntCC::SignedGreaterThanOrEqual,
            result,
            IntegerResult::HAS_WRAPPED,
        );
        self.overflow_if(has_wrapped, site);
        self.ins().ireduce(I32, result)
    }

    fn truncate(&mut self, source: Value, site: SiteId) -> Value {
        // Both comparisons are false for a NaN, and the conversion is exact between the two.
        let high = self.ins().f64const(2_147_483_648.0);
        let below = self.ins().fcmp(FloatCC::LessThan, source, high);
        self.fail_unless(below, RunTimeErrorKind::NotAnInteger, site);
        let low = self.ins().f64const(-2_147_483_649.0);
        let above = self.ins().fcmp(FloatCC::GreaterThan, source, low);
        self.fail_unless(above, RunTimeErrorKind::NotAnInteger, site);
        self.ins().fcvt_to_sint_sat(I32, source)
    }

    fn math(&mut self, function: MathFunction, arguments: &[Register], site: SiteId) -> Value {
        let arguments: Vec<Value> = arguments
            .iter()
            .map(|&register| self.get(register))
            .collect();
        let ins = self.ins();
        // Where the processor has an instruction that gives what the library gives, it is taken.
        match function {
            MathFunction::Fabs => return ins.fabs(arguments[0]),
            MathFunction::Sqrt => return ins.sqrt(arguments[0]),
            MathFunction::Abs => {
                let least = i64::from(i32::MIN);
                let is_least = ins.icmp_imm_s(IntCC::Equal, arguments[0], least);
                self.overflow_if(is_least, site);
                return self.ins().iabs(arguments[0]);
            }
            _ => {}
        }
        let (code, result) = match function.code() {
            Code::Integer(code) => (code as usize, I64),
            Code::ToInteger(code) => (code as usize, I64),
            Code::Classify(code) => (code as usize, I32),
            Code::Unary(code) => (code as usize, F64),
            Code::Binary(code) => (code as usize, F64),
            Code::Scale(code) => (code as usize, F64),
            Code::Ternary(code) => (code as usize, F64),
        };
        let result = self.call_back(code, Some(result), &arguments);
        if !function.may_fail_or_wrap() {
            return result;
        }
        let is_none = self.ins().icmp_imm_s(IntCC::SignedLessThan, result, 0);
        self.fail_if(is_none, RunTimeErrorKind::NotAnInteger, site);
        self.unwrapped(result, site)
    }

    /// A condition as 0 or 1.
    pub(super) fn truth(&mut self, condition: Value) -> Value {
        self.ins().uextend(I32, condition)
    }
}

fn integer_condition(relation: Relation) -> IntCC {
    match relation {
        Relation::Less => IntCC::SignedLessThan,
        Relation::LessEqual => IntCC::SignedLessThanOrEqual,
        Relation::Greater => IntCC::SignedGreaterThan,
        Relation::GreaterEqual => IntCC::SignedGreaterThanOrEqual,
        Relation::Equal => IntCC::Equal,
        Relation::NotEqual => IntCC::NotEqual,
    }
}

/// Cranelift's conditions are ordered but for `NotEqual`, as ours are.
fn double_condition(relation: Relation) -> FloatCC {
    match relation {
        Relation::Less => FloatCC::LessThan,
        Relation::LessEqual => FloatCC::LessThanOrEqual,
        Relation::Greater => FloatCC::GreaterThan,
        Relation::GreaterEqual => FloatCC::GreaterThanOrEqual,
        Relation::Equal => FloatCC::Equal,
        Relation::NotEqual => FloatCC::NotEqual,
    }
}

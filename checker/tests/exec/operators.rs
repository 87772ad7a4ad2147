//! Every operator on its edge cases. The expectations are written by hand from the definitions and
//! not computed with the code under test.

use checker::exec::RunTimeError;
use checker::ir::{
    Block, BlockId, ClockId, ClockOperand, DoubleOperator, Function, FunctionId, Instruction,
    IntegerOperator, MathFunction, Overflow, Register, RegisterType, Relation, RunTimeErrorKind,
    SiteId, Terminator,
};

use crate::support::{OVERFLOWS, Outcome, engines, run, state_word, straight_line};

use RegisterType::{Double, Integer};
use RunTimeErrorKind as Kind;

const MIN: i32 = i32::MIN;
const MAX: i32 = i32::MAX;
const SITE: SiteId = SiteId(77);

/// Runs instructions over registers of the given types, of which the first take the arguments, on
/// every engine.
fn check(
    registers: &[RegisterType],
    arguments: &[i32],
    instructions: Vec<Instruction>,
    result: Option<u32>,
    expected: &Result<(i32, Vec<i32>), Kind>,
) {
    let code = straight_line(arguments.len() as u32, registers, instructions, result);
    for overflow in OVERFLOWS {
        let expected = (expected, None);
        check_on(overflow, std::slice::from_ref(&code), arguments, expected);
    }
}

/// What a call returns, with the state, or how it ends; and the first place where a result wrapped
/// round.
type Expected<'e> = (&'e Result<(i32, Vec<i32>), Kind>, Option<SiteId>);

fn check_on(overflow: Overflow, functions: &[Function], arguments: &[i32], expected: Expected<'_>) {
    for (name, engine) in engines(functions, &[], overflow) {
        let outcome = run(&*engine, FunctionId(0), arguments, &[0; 4]);
        let Outcome { result, state, .. } = outcome;
        let actual = result.map(|value| (value, state)).map_err(|error| {
            assert_eq!(error.site, SITE, "{name}: {:?}", functions[0]);
            error.kind
        });
        assert_eq!(
            (&actual, outcome.wrapped),
            expected,
            "{name} {arguments:?}: {:?}",
            functions[0]
        );
    }
}

/// Checks what computing this comes to where its result does not fit: the wrapped result with a
/// note, or an error.
fn check_wrapping(
    registers: &[RegisterType],
    arguments: &[i32],
    instructions: &[Instruction],
    result: u32,
    wrapped: i32,
) {
    let code = straight_line(
        arguments.len() as u32,
        registers,
        instructions.to_vec(),
        Some(result),
    );
    let functions = [code];
    let value = Ok((wrapped, vec![0; 4]));
    check_on(Overflow::Wrap, &functions, arguments, (&value, Some(SITE)));
    let error = Err(Kind::Overflow);
    check_on(Overflow::Error, &functions, arguments, (&error, None));
}

/// Operands whose results do not fit, with what is left of them modulo 2^32.
fn check_wrapping_integer(operator: IntegerOperator, cases: &[(i32, i32, i32)]) {
    for &(left, right, wrapped) in cases {
        let instruction = Instruction::Arithmetic {
            operator,
            target: Register(2),
            left: Register(0),
            right: Register(1),
            site: SITE,
        };
        let values = [(0, left), (1, right)].map(|(target, value)| Instruction::Integer {
            target: Register(target),
            value,
        });
        // No operand is known beforehand, or the second one, or both.
        for known in [&values[..0], &values[1..], &values[..]] {
            let instructions = [known, std::slice::from_ref(&instruction)].concat();
            check_wrapping(&[Integer; 3], &[left, right], &instructions, 2, wrapped);
        }
    }
}

fn check_integer(operator: IntegerOperator, cases: &[(i32, i32, Result<i32, Kind>)]) {
    for &(left, right, expected) in cases {
        let instruction = Instruction::Arithmetic {
            operator,
            target: Register(2),
            left: Register(0),
            right: Register(1),
            site: SITE,
        };
        check(
            &[Integer; 3],
            &[left, right],
            vec![instruction.clone()],
            Some(2),
            &expected.map(|value| (value, vec![0; 4])),
        );
        // The same with operands that are written in the code.
        let constants = [(0, left), (1, right)].map(|(target, value)| Instruction::Integer {
            target: Register(target),
            value,
        });
        let mut instructions = constants.to_vec();
        instructions.push(instruction);
        check(
            &[Integer; 3],
            &[],
            instructions,
            Some(2),
            &expected.map(|value| (value, vec![0; 4])),
        );
    }
}

/// Checks the bits of a double computed by one instruction from constants.
fn check_double(operands: &[f64], instruction: Instruction, expected: f64) {
    let mut registers = vec![Double; operands.len()];
    registers.push(Double);
    let mut instructions: Vec<Instruction> = load_doubles(operands);
    instructions.push(instruction);
    instructions.push(Instruction::StoreDouble {
        address: state_word(1),
        source: Register(operands.len() as u32),
        is_number: false,
    });
    let bits = expected.to_bits();
    let words = vec![0, bits as i32, (bits >> 32) as i32, 0];
    check(&registers, &[], instructions, None, &Ok((0, words)));
}

/// Checks an integer computed by one instruction from constant doubles.
fn check_double_to_integer(
    operands: &[f64],
    instruction: Instruction,
    expected: Result<i32, Kind>,
) {
    let mut registers = vec![Double; operands.len()];
    registers.push(Integer);
    let mut instructions = load_doubles(operands);
    instructions.push(instruction);
    check(
        &registers,
        &[],
        instructions,
        Some(operands.len() as u32),
        &expected.map(|value| (value, vec![0; 4])),
    );
}

fn load_doubles(operands: &[f64]) -> Vec<Instruction> {
    (0..)
        .map(Register)
        .zip(operands)
        .map(|(target, &value)| Instruction::Double {
            target,
            value: value.into(),
        })
        .collect()
}

fn check_math(function: MathFunction, operands: &[f64], expected: f64) {
    let instruction = Instruction::Math {
        function,
        target: Register(operands.len() as u32),
        arguments: (0..operands.len() as u32).map(Register).collect(),
        site: SITE,
    };
    check_double(operands, instruction, expected);
}

fn check_classification(function: MathFunction, operand: f64, expected: Result<i32, Kind>) {
    let instruction = Instruction::Math {
        function,
        target: Register(1),
        arguments: vec![Register(0)],
        site: SITE,
    };
    check_double_to_integer(&[operand], instruction, expected);
}

#[test]
fn sums_and_differences_reach_the_limits_of_32_bits() {
    use IntegerOperator::{Add, Subtract};
    check_integer(Add, &[(2, 3, Ok(5)), (MAX, 0, Ok(MAX)), (MIN, MAX, Ok(-1))]);
    check_integer(Subtract, &[(2, 3, Ok(-1)), (-1, MIN, Ok(MAX))]);
}

#[test]
fn products_reach_the_limits_of_32_bits() {
    check_integer(
        IntegerOperator::Multiply,
        &[
            (6, -7, Ok(-42)),
            (46340, 46340, Ok(2_147_395_600)),
            (65536, -32768, Ok(MIN)),
            (MIN, 1, Ok(MIN)),
            (MIN, 0, Ok(0)),
        ],
    );
}

#[test]
fn results_that_do_not_fit_wrap_round() {
    use IntegerOperator::{Add, Divide, Multiply, Power, Subtract};
    check_wrapping_integer(
        Add,
        &[(MAX, 1, MIN), (MIN, -1, MAX), (MAX, MAX, -2), (MIN, MIN, 0)],
    );
    check_wrapping_integer(
        Subtract,
        &[(0, MIN, MIN), (MIN, 1, MAX), (MAX, -1, MIN), (MAX, MIN, -1)],
    );
    check_wrapping_integer(
        Multiply,
        &[
            (46341, 46341, -2_147_479_015),
            (MIN, -1, MIN),
            (MAX, MAX, 1),
            (65536, 65536, 0),
        ],
    );
    check_wrapping_integer(Divide, &[(MIN, -1, MIN)]);
    check_wrapping_integer(
        Power,
        &[
            (2, 31, MIN),
            (2, 32, 0),
            (MIN, 2, 0),
            (-2, 33, 0),
            (3, 21, 1_870_418_611),
        ],
    );
}

#[test]
fn division_truncates_and_the_remainder_has_the_dividends_sign() {
    use IntegerOperator::{Divide, Remainder};
    check_integer(
        Divide,
        &[
            (7, 2, Ok(3)),
            (-7, 2, Ok(-3)),
            (7, -2, Ok(-3)),
            (1, 0, Err(Kind::DivisionByZero)),
            (MIN, 0, Err(Kind::DivisionByZero)),
            (MIN, 1, Ok(MIN)),
            (MAX, -1, Ok(-MAX)),
        ],
    );
    check_integer(
        Remainder,
        &[
            (7, 2, Ok(1)),
            (-7, 2, Ok(-1)),
            (7, -2, Ok(1)),
            (1, 0, Err(Kind::DivisionByZero)),
            (MIN, -1, Ok(0)),
            (MIN, 3, Ok(-2)),
        ],
    );
}

#[test]
fn powers_reject_negative_exponents() {
    check_integer(
        IntegerOperator::Power,
        &[
            (2, 10, Ok(1024)),
            (0, 0, Ok(1)),
            (0, MAX, Ok(0)),
            (-1, MAX, Ok(-1)),
            (-1, MAX - 1, Ok(1)),
            (-2, 31, Ok(MIN)),
            (MIN, 1, Ok(MIN)),
            (2, -1, Err(Kind::NegativeExponent)),
            (1, MIN, Err(Kind::NegativeExponent)),
        ],
    );
}

#[test]
fn shifts_take_0_to_31_bits() {
    use IntegerOperator::{ShiftLeft, ShiftRight};
    check_integer(
        ShiftLeft,
        &[
            (1, 31, Ok(MIN)),
            (3, 31, Ok(MIN)),
            (MAX, 1, Ok(-2)),
            (5, 0, Ok(5)),
            (1, 32, Err(Kind::ShiftDistance)),
            (1, -1, Err(Kind::ShiftDistance)),
            (1, MIN, Err(Kind::ShiftDistance)),
        ],
    );
    check_integer(
        ShiftRight,
        &[
            (MIN, 31, Ok(-1)),
            (-5, 1, Ok(-3)),
            (MAX, 30, Ok(1)),
            (1, 32, Err(Kind::ShiftDistance)),
            (1, -1, Err(Kind::ShiftDistance)),
        ],
    );
}

#[test]
fn bits_and_extremes_of_integers() {
    check_integer(IntegerOperator::And, &[(12, 10, Ok(8)), (-1, MIN, Ok(MIN))]);
    check_integer(IntegerOperator::Or, &[(12, 10, Ok(14)), (MAX, MIN, Ok(-1))]);
    check_integer(IntegerOperator::Xor, &[(12, 10, Ok(6)), (-1, MAX, Ok(MIN))]);
    check_integer(
        IntegerOperator::Minimum,
        &[(MIN, MAX, Ok(MIN)), (3, 2, Ok(2))],
    );
    check_integer(
        IntegerOperator::Maximum,
        &[(MIN, MAX, Ok(MAX)), (3, 2, Ok(3))],
    );
}

#[test]
fn relations_of_integers_are_signed() {
    let relations = [
        (Relation::Less, [1, 0, 0]),
        (Relation::LessEqual, [1, 1, 0]),
        (Relation::Greater, [0, 0, 1]),
        (Relation::GreaterEqual, [0, 1, 1]),
        (Relation::Equal, [0, 1, 0]),
        (Relation::NotEqual, [1, 0, 1]),
    ];
    for (relation, expected) in relations {
        for ((left, right), expected) in [(MIN, MAX), (-4, -4), (1, -1)].into_iter().zip(expected) {
            let instruction = Instruction::CompareIntegers {
                relation,
                target: Register(2),
                left: Register(0),
                right: Register(1),
            };
            check(
                &[Integer; 3],
                &[left, right],
                vec![instruction],
                Some(2),
                &Ok((expected, vec![0; 4])),
            );
        }
    }
}

#[test]
fn a_nan_is_unequal_to_everything_and_in_no_order() {
    let relations = [
        (Relation::Less, [1, 0, 0, 0, 0]),
        (Relation::LessEqual, [1, 1, 0, 0, 0]),
        (Relation::Greater, [0, 0, 1, 0, 0]),
        (Relation::GreaterEqual, [0, 1, 1, 0, 0]),
        (Relation::Equal, [0, 1, 0, 0, 0]),
        (Relation::NotEqual, [1, 0, 1, 1, 1]),
    ];
    let pairs = [
        (-1.5, f64::INFINITY),
        (0.0, -0.0),
        (2.0, 1.0),
        (f64::NAN, f64::NAN),
        (1.0, f64::NAN),
    ];
    for (relation, expected) in relations {
        for ((left, right), expected) in pairs.into_iter().zip(expected) {
            let instruction = Instruction::CompareDoubles {
                relation,
                target: Register(2),
                left: Register(0),
                right: Register(1),
            };
            check_double_to_integer(&[left, right], instruction, Ok(expected));
        }
    }
}

#[test]
fn arithmetic_of_doubles_is_ieee() {
    let cases = [
        (DoubleOperator::Add, 0.1, 0.2, 0.300_000_000_000_000_04),
        (DoubleOperator::Subtract, 0.0, 0.0, 0.0),
        (DoubleOperator::Multiply, -1.0, 0.0, -0.0),
        (DoubleOperator::Divide, 1.0, -0.0, f64::NEG_INFINITY),
        (DoubleOperator::Divide, 0.0, 0.0, f64::NAN),
        (
            DoubleOperator::Subtract,
            f64::INFINITY,
            f64::INFINITY,
            f64::NAN,
        ),
        (DoubleOperator::Minimum, 0.0, -0.0, -0.0),
        (DoubleOperator::Minimum, -0.0, 0.0, 0.0),
        (DoubleOperator::Minimum, f64::NAN, 1.0, 1.0),
        (DoubleOperator::Minimum, 1.0, f64::NAN, f64::NAN),
        (DoubleOperator::Maximum, 1.0, 2.0, 2.0),
        (DoubleOperator::Maximum, 0.0, -0.0, -0.0),
        (DoubleOperator::Maximum, f64::NAN, 1.0, 1.0),
    ];
    for (operator, left, right, expected) in cases {
        let instruction = Instruction::DoubleArithmetic {
            operator,
            target: Register(2),
            left: Register(0),
            right: Register(1),
        };
        check_double(&[left, right], instruction, expected);
    }
}

#[test]
fn doubles_become_integers_only_where_they_fit() {
    let cases = [
        (2.999, Ok(2)),
        (-2.999, Ok(-2)),
        (-0.0, Ok(0)),
        (-0.9, Ok(0)),
        (2_147_483_647.999, Ok(MAX)),
        (2_147_483_648.0, Err(Kind::NotAnInteger)),
        (-2_147_483_648.0, Ok(MIN)),
        (-2_147_483_648.999, Ok(MIN)),
        (-2_147_483_649.0, Err(Kind::NotAnInteger)),
        (4_294_967_296.0, Err(Kind::NotAnInteger)),
        (1e300, Err(Kind::NotAnInteger)),
        (f64::NAN, Err(Kind::NotAnInteger)),
        (f64::INFINITY, Err(Kind::NotAnInteger)),
        (f64::NEG_INFINITY, Err(Kind::NotAnInteger)),
    ];
    for (operand, expected) in cases {
        let instruction = Instruction::DoubleToInteger {
            target: Register(1),
            source: Register(0),
            site: SITE,
        };
        check_double_to_integer(&[operand], instruction, expected);
    }
}

#[test]
fn mathematical_functions_mean_what_c_says() {
    use MathFunction as M;
    let infinity = f64::INFINITY;
    let cases: &[(MathFunction, &[f64], f64)] = &[
        (M::Fabs, &[-0.0], 0.0),
        (M::Sqrt, &[2.0], std::f64::consts::SQRT_2),
        (M::Sqrt, &[-1.0], f64::NAN),
        (M::Sqrt, &[-0.0], -0.0),
        (M::Log, &[1000.0], 3.0),
        (M::Log10, &[1e-3], -3.0),
        (M::Log2, &[8.0], 3.0),
        (M::Ln, &[1.0], 0.0),
        (M::Ln, &[0.0], -infinity),
        (M::Log1p, &[0.0], 0.0),
        (M::Exp, &[0.0], 1.0),
        (M::Exp2, &[-3.0], 0.125),
        (M::Expm1, &[-0.0], -0.0),
        (M::Cbrt, &[-27.0], -3.0),
        (M::Sin, &[0.0], 0.0),
        (M::Cos, &[0.0], 1.0),
        (M::Tan, &[-0.0], -0.0),
        (M::Asin, &[2.0], f64::NAN),
        (M::Acos, &[1.0], 0.0),
        (M::Atan, &[1.0], std::f64::consts::FRAC_PI_4),
        (M::Sinh, &[0.0], 0.0),
        (M::Cosh, &[0.0], 1.0),
        (M::Tanh, &[infinity], 1.0),
        (M::Asinh, &[-0.0], -0.0),
        (M::Acosh, &[1.0], 0.0),
        (M::Atanh, &[1.0], infinity),
        (M::Erf, &[infinity], 1.0),
        (M::Erfc, &[0.0], 1.0),
        (M::Tgamma, &[5.0], 24.0),
        (M::Lgamma, &[1.0], 0.0),
        (M::Ceil, &[-0.5], -0.0),
        (M::Ceil, &[1.2], 2.0),
        (M::Floor, &[-0.5], -1.0),
        (M::Trunc, &[-1.7], -1.0),
        (M::Round, &[0.5], 1.0),
        (M::Round, &[-0.5], -1.0),
        (M::Round, &[2.5], 3.0),
        (M::Round, &[0.499_999_999_999_999_94], 0.0),
        (M::Logb, &[10.0], 3.0),
        (M::Logb, &[0.0], -infinity),
        (M::Fmod, &[-7.5, 2.0], -1.5),
        (M::Fmod, &[1.0, 0.0], f64::NAN),
        (M::Fmax, &[f64::NAN, 1.0], 1.0),
        (M::Fmin, &[2.0, f64::NAN], 2.0),
        (M::Fdim, &[3.0, 5.0], 0.0),
        (M::Fdim, &[5.0, 3.0], 2.0),
        (M::Pow, &[2.0, 0.5], std::f64::consts::SQRT_2),
        (M::Pow, &[f64::NAN, 0.0], 1.0),
        (M::Pow, &[0.0, -1.0], infinity),
        (M::Hypot, &[3.0, 4.0], 5.0),
        (M::Atan2, &[0.0, -1.0], std::f64::consts::PI),
        (M::Atan2, &[-0.0, -1.0], -std::f64::consts::PI),
        (M::Nextafter, &[0.0, 1.0], 5e-324),
        (M::Nextafter, &[1.0, 1.0], 1.0),
        (M::Copysign, &[3.0, -0.0], -3.0),
        (M::Copysign, &[-3.0, -f64::NAN], 3.0),
        (M::Fma, &[0.1, 10.0, -1.0], 5.551_115_123_125_783e-17),
    ];
    for (function, operands, expected) in cases {
        check_math(*function, operands, *expected);
    }
}

#[test]
fn ldexp_scales_by_powers_of_two() {
    for (value, exponent, expected) in [
        (0.75, 4, 12.0),
        (1.0, -1074, 5e-324),
        (1.0, MIN, 0.0),
        (-1.0, MAX, f64::NEG_INFINITY),
    ] {
        let code = vec![
            Instruction::Double {
                target: Register(1),
                value: value.into(),
            },
            Instruction::Math {
                function: MathFunction::Ldexp,
                target: Register(2),
                arguments: vec![Register(1), Register(0)],
                site: SITE,
            },
            Instruction::StoreDouble {
                address: state_word(0),
                source: Register(2),
                is_number: false,
            },
        ];
        let bits = expected.to_bits();
        let words = vec![bits as i32, (bits >> 32) as i32, 0, 0];
        check(
            &[Integer, Double, Double],
            &[exponent],
            code,
            None,
            &Ok((0, words)),
        );
    }
}

#[test]
fn classification_of_doubles() {
    use MathFunction as M;
    let not = Err(Kind::NotAnInteger);
    for (function, operand, expected) in [
        (M::IsFinite, 1.0, Ok(1)),
        (M::IsFinite, f64::INFINITY, Ok(0)),
        (M::IsInfinite, f64::NEG_INFINITY, Ok(1)),
        (M::IsInfinite, f64::NAN, Ok(0)),
        (M::IsNan, f64::NAN, Ok(1)),
        (M::IsNan, 0.0, Ok(0)),
        (M::IsUnordered, f64::NAN, Ok(1)),
        (M::IsNormal, 5e-324, Ok(0)),
        (M::IsNormal, 0.0, Ok(0)),
        (M::IsNormal, -1.0, Ok(1)),
        (M::SignBit, -0.0, Ok(1)),
        (M::SignBit, 0.0, Ok(0)),
        (M::SignBit, -f64::NAN, Ok(0)),
        (M::Ilogb, 10.0, Ok(3)),
        (M::Ilogb, 5e-324, Ok(-1074)),
        (M::Ilogb, 0.0, not),
        (M::Ilogb, f64::INFINITY, not),
        (M::Ilogb, f64::NAN, not),
    ] {
        check_classification(function, operand, expected);
    }
}

#[test]
fn the_absolute_value_of_the_least_integer_wraps_round() {
    let instruction = Instruction::Math {
        function: MathFunction::Abs,
        target: Register(1),
        arguments: vec![Register(0)],
        site: SITE,
    };
    check_wrapping(
        &[Integer; 2],
        &[MIN],
        std::slice::from_ref(&instruction),
        1,
        MIN,
    );
    for (value, expected) in [(-5, Ok(5)), (MAX, Ok(MAX)), (MIN + 1, Ok(MAX))] {
        let instruction = instruction.clone();
        check(
            &[Integer; 2],
            &[value],
            vec![instruction],
            Some(1),
            &expected.map(|value| (value, vec![0; 4])),
        );
    }
}

#[test]
fn ranges_include_their_ends() {
    for (value, low, high, fits) in [
        (5, 5, 5, true),
        (4, 5, 5, false),
        (6, 5, 5, false),
        (MIN, MIN, MAX, true),
        (MIN, MIN + 1, MAX, false),
        (MAX, MIN, MAX - 1, false),
        (-1, 0, MAX, false),
        (-32768, -32768, 32767, true),
        (32768, -32768, 32767, false),
        (0, 1, 0, false),
    ] {
        let instruction = Instruction::CheckRange {
            value: Register(0),
            low,
            high,
            site: SITE,
        };
        let expected = if fits {
            Ok((value, vec![0; 4]))
        } else {
            Err(Kind::OutOfRange)
        };
        check(&[Integer], &[value], vec![instruction], Some(0), &expected);
    }
}

#[test]
fn indices_count_from_the_first_and_are_scaled() {
    for (index, first, length, stride, expected) in [
        (2, 0, 3, 5, Ok(10)),
        (3, 0, 3, 5, Err(Kind::IndexOutOfBounds)),
        (-1, 0, 3, 1, Err(Kind::IndexOutOfBounds)),
        (-2, -2, 2, 3, Ok(0)),
        (-1, -2, 2, 3, Ok(3)),
        (0, -2, 2, 3, Err(Kind::IndexOutOfBounds)),
        (MIN, MAX - 7, 8, 1, Err(Kind::IndexOutOfBounds)),
        (MAX, MAX - 7, 8, 1, Ok(7)),
        (MAX, MIN, 8, 1, Err(Kind::IndexOutOfBounds)),
    ] {
        let instruction = Instruction::ScaleIndex {
            target: Register(1),
            index: Register(0),
            first,
            length,
            stride,
            site: SITE,
        };
        check(
            &[Integer; 2],
            &[index],
            vec![instruction],
            Some(1),
            &expected.map(|value| (value, vec![0; 4])),
        );
    }
}

#[test]
fn clocks_are_set_and_compared_within_the_limit() {
    let limit = checker::ir::CLOCK_LIMIT;
    let clock = |first| ClockOperand {
        first: ClockId(first),
        index: None,
    };
    for (value, compares, sets) in [
        (0, true, true),
        (limit, true, true),
        (limit + 1, false, false),
        (-1, true, false),
        (-limit, true, false),
        (-limit - 1, false, false),
        (MIN, false, false),
    ] {
        let expected = |works: bool| {
            if works {
                Ok((0, vec![0; 4]))
            } else {
                Err(Kind::ClockValue)
            }
        };
        let constrain = Instruction::Constrain {
            left: clock(1),
            right: clock(0),
            strict: false,
            bound: Register(0),
            negate_bound: true,
            site: SITE,
        };
        check(
            &[Integer],
            &[value],
            vec![constrain],
            None,
            &expected(compares),
        );
        let set = Instruction::SetClock {
            clock: clock(1),
            value: Register(0),
            site: SITE,
        };
        check(&[Integer], &[value], vec![set], None, &expected(sets));
        let copy = Instruction::CopyClock {
            clock: clock(1),
            source: clock(2),
            increment: Some(Register(0)),
            site: SITE,
        };
        check(&[Integer], &[value], vec![copy], None, &expected(compares));
    }
}

/// A function that jumps from its only block to the same block.
fn endless() -> Function {
    Function {
        name: "endless".into(),
        registers: vec![],
        parameters: 0,
        frame_words: 0,
        result: None,
        blocks: vec![Block {
            instructions: vec![],
            terminator: Terminator::Jump(BlockId(0)),
        }],
    }
}

#[test]
fn an_endless_loop_ends_at_the_limit_of_rounds() {
    for (name, engine) in engines(&[endless()], &[], Overflow::default()) {
        let outcome = run(&*engine, FunctionId(0), &[], &[]);
        let expected = Err(RunTimeError {
            kind: Kind::StepLimit,
            site: SiteId(0),
        });
        assert_eq!(outcome.result, expected, "{name}");
    }
}

#[test]
fn a_look_ends_a_call_that_runs_long() {
    use checker::cancellation::{self, Look};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};
    let error = |kind| {
        Err(RunTimeError {
            kind,
            site: SiteId(0),
        })
    };
    for (name, engine) in engines(&[endless()], &[], Overflow::default()) {
        let looks = Arc::new(AtomicU32::new(0));
        let seen = Arc::clone(&looks);
        let look: Look = Arc::new(move |_| seen.fetch_add(1, Ordering::Relaxed) == 2);
        let outcome = cancellation::within(look, || run(&*engine, FunctionId(0), &[], &[]));
        let result = outcome.map(|outcome| outcome.result);
        assert_eq!(result, Ok(error(Kind::Interrupted)), "{name}");
        assert_eq!(looks.load(Ordering::Relaxed), 3, "{name}");
        let outcome = run(&*engine, FunctionId(0), &[], &[]);
        assert_eq!(outcome.result, error(Kind::StepLimit), "{name}");
    }
}

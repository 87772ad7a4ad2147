//! Engines share the compiled code of equal functions: whatever two programs differ in, each engine
//! must do what an interpreter of its own program does, also after others are gone.

use checker::exec::Executor;
use checker::ir::{
    Address, Base, DoubleOperator, Function, FunctionId, Instruction, IntegerOperator, Overflow,
    Register, RegisterType, SiteId,
};

use crate::support::{engines, run, state_word, straight_line};

use RegisterType::{Double, Integer};

/// More than the pool that engines share takes before a new one is begun.
const MANY: i32 = 220;
const LONG: u32 = 1000;

/// A program whose first function has one parameter.
struct Program {
    functions: Vec<Function>,
    constants: Vec<i32>,
    overflow: Overflow,
}

impl Program {
    fn of(functions: Vec<Function>) -> Program {
        Program {
            functions,
            constants: vec![5, 6, 7],
            overflow: Overflow::Wrap,
        }
    }

    fn engines(&self) -> Vec<(&'static str, Box<dyn Executor>)> {
        engines(&self.functions, &self.constants, self.overflow)
    }
}

/// Runs all engines of a program, and compares them with the first.
fn compare(program: &Program, engines: &[(&str, Box<dyn Executor>)]) {
    for argument in [0, 1, 2, i32::MAX, -1] {
        let [expected, others @ ..] = &engines
            .iter()
            .map(|(name, engine)| (name, run(&**engine, FunctionId(0), &[argument], &[0; 4])))
            .collect::<Vec<_>>()[..]
        else {
            panic!("there are several engines");
        };
        for other in others {
            let text = &program.functions[0];
            assert_eq!(other.1, expected.1, "{} of {argument}: {text:?}", other.0);
        }
    }
}

fn integer(target: u32, value: i32) -> Instruction {
    Instruction::Integer {
        target: Register(target),
        value,
    }
}

fn arithmetic(
    operator: IntegerOperator,
    [target, left, right]: [u32; 3],
    site: u32,
) -> Instruction {
    Instruction::Arithmetic {
        operator,
        target: Register(target),
        left: Register(left),
        right: Register(right),
        site: SiteId(site),
    }
}

/// Adds a number to the argument.
fn adder(value: i32, operator: IntegerOperator, site: u32) -> Function {
    let code = vec![integer(1, value), arithmetic(operator, [2, 0, 1], site)];
    straight_line(1, &[Integer; 3], code, Some(2))
}

/// Divides 1 by a constant, and stores the quotient.
fn quotient(value: f64) -> Function {
    let double = |target, value: f64| Instruction::Double {
        target: Register(target),
        value: value.into(),
    };
    let code = vec![
        double(1, value),
        Instruction::IntegerToDouble {
            target: Register(2),
            source: Register(0),
        },
        Instruction::DoubleArithmetic {
            operator: DoubleOperator::Divide,
            target: Register(3),
            left: Register(2),
            right: Register(1),
        },
        Instruction::StoreDouble {
            address: state_word(0),
            source: Register(3),
            is_number: false,
        },
    ];
    straight_line(1, &[Integer, Double, Double, Double], code, None)
}

/// Reads the constant whose number is the argument.
fn reader() -> Function {
    let code = vec![
        Instruction::ScaleIndex {
            target: Register(1),
            index: Register(0),
            first: 0,
            length: 3,
            stride: 1,
            site: SiteId(3),
        },
        Instruction::LoadInteger {
            target: Register(2),
            address: Address {
                base: Base::Constants,
                offset: 0,
                index: Some(Register(1)),
            },
        },
    ];
    straight_line(1, &[Integer; 3], code, Some(2))
}

/// Adds a constant.
fn adder_of_constant(offset: u32) -> Function {
    let load = Instruction::LoadInteger {
        target: Register(1),
        address: Address {
            base: Base::Constants,
            offset,
            index: None,
        },
    };
    let sum = arithmetic(IntegerOperator::Add, [2, 0, 1], 3);
    straight_line(1, &[Integer; 3], vec![load, sum], Some(2))
}

/// Calls the second function with what it was given, and keeps a word in its own frame meanwhile.
fn caller(frame_words: u32) -> Function {
    let kept = Address {
        base: Base::Frame,
        offset: frame_words - 1,
        index: None,
    };
    let code = vec![
        Instruction::StoreInteger {
            address: kept,
            source: Register(0),
        },
        Instruction::Call {
            target: Some(Register(1)),
            function: FunctionId(1),
            arguments: vec![Register(0)],
        },
        Instruction::LoadInteger {
            target: Register(2),
            address: kept,
        },
        arithmetic(IntegerOperator::Multiply, [3, 1, 2], 9),
    ];
    let mut function = straight_line(1, &[Integer; 4], code, Some(3));
    function.frame_words = frame_words;
    function
}

/// Writes its frame and reads it again.
fn scratch(value: i32) -> Function {
    let word = Address {
        base: Base::Frame,
        offset: 0,
        index: None,
    };
    let code = vec![
        integer(1, value),
        Instruction::StoreInteger {
            address: word,
            source: Register(1),
        },
        Instruction::LoadInteger {
            target: Register(2),
            address: word,
        },
        arithmetic(IntegerOperator::Add, [3, 2, 0], 8),
    ];
    let mut function = straight_line(1, &[Integer; 4], code, Some(3));
    function.frame_words = 1;
    function
}

/// Programs that are equal but for one thing.
fn programs() -> Vec<Program> {
    let add = IntegerOperator::Add;
    let mut programs = vec![
        Program::of(vec![adder(1, add, 3)]),
        Program::of(vec![adder(1, add, 4)]),
        Program::of(vec![adder(2, add, 3)]),
        Program::of(vec![adder(1, IntegerOperator::Subtract, 3)]),
        Program::of(vec![quotient(0.0)]),
        Program::of(vec![quotient(-0.0)]),
        Program::of(vec![quotient(f64::NAN)]),
        Program::of(vec![reader()]),
        Program::of(vec![caller(1), adder(1, add, 3)]),
        Program::of(vec![caller(1), adder(2, add, 3)]),
        Program::of(vec![caller(1), scratch(1)]),
        Program::of(vec![caller(7), scratch(1)]),
        Program::of(vec![caller(7), scratch(2)]),
        // The callee has another number in its program.
        Program::of(vec![caller(7), scratch(2), adder(1, add, 3)]),
    ];
    programs.push(Program {
        overflow: Overflow::Error,
        ..Program::of(vec![adder(1, add, 3)])
    });
    programs.push(Program {
        constants: vec![-1, -2, -3],
        ..Program::of(vec![reader()])
    });
    for constants in [[5, 6, 7], [5, -2, 7], [-1, 6, -3], [5, 1, 7]] {
        programs.push(Program {
            constants: constants.to_vec(),
            ..Program::of(vec![adder_of_constant(1)])
        });
    }
    programs.push(Program::of(vec![adder_of_constant(0)]));
    programs
}

#[test]
fn engines_of_programs_that_are_nearly_equal_keep_to_their_own() {
    let programs = programs();
    for _ in 0..2 {
        let engines: Vec<_> = programs.iter().map(Program::engines).collect();
        for _ in 0..2 {
            for (program, engines) in programs.iter().zip(&engines) {
                compare(program, engines);
            }
        }
    }
}

#[test]
fn an_engine_works_when_the_engines_that_compiled_its_code_are_gone() {
    let programs = programs();
    let first: Vec<_> = programs.iter().map(Program::engines).collect();
    let second: Vec<_> = programs.iter().map(Program::engines).collect();
    drop(first);
    for (program, engines) in programs.iter().zip(&second) {
        compare(program, engines);
    }
}

#[test]
fn engines_work_on_when_so_much_is_compiled_that_a_new_pool_is_begun() {
    let programs = programs();
    let kept: Vec<_> = programs.iter().map(Program::engines).collect();
    for number in 0..MANY {
        let sums = (0..LONG).map(|site| arithmetic(IntegerOperator::Add, [2, 2, 0], site));
        let mut code = vec![integer(2, number)];
        code.extend(sums);
        let long = Program::of(vec![straight_line(1, &[Integer; 3], code, Some(2))]);
        compare(&long, &long.engines());
    }
    let fresh: Vec<_> = programs.iter().map(Program::engines).collect();
    for (program, engines) in programs.iter().zip(kept.iter().chain(&fresh)) {
        compare(program, engines);
    }
}

//! Code that no front end may hand over is told apart before machine code is made of it.

use checker::exec::{Interpreter, validate};
use checker::ir::{
    Address, Base, Block, BlockId, Distribution, Function, FunctionId, Instruction,
    IntegerOperator, Register, RegisterType, STREAM_WORDS, SiteId, Terminator,
};

use crate::support::{state_word, straight_line};

use RegisterType::{Double, Integer};

fn one(registers: &[RegisterType], instructions: Vec<Instruction>) -> Function {
    straight_line(0, registers, instructions, None)
}

fn check_flaw(functions: &[Function], expected: &str) {
    let flaw = validate(functions, 0, 4).expect_err(expected);
    assert!(flaw.what.contains(expected), "{flaw}");
    #[cfg(feature = "jit")]
    assert!(checker::exec::Jit::new(functions, &[0; 4]).is_err());
}

const R0: Register = Register(0);
const R1: Register = Register(1);
const SITE: SiteId = SiteId(0);

fn indexed(base: Base, offset: u32, index: Register) -> Address {
    Address {
        base,
        offset,
        index: Some(index),
    }
}

fn scaled(length: u32, stride: u32) -> Instruction {
    Instruction::ScaleIndex {
        target: R1,
        index: R0,
        first: 0,
        length,
        stride,
        site: SITE,
    }
}

#[test]
fn wrong_draws_are_found() {
    let draw = |arguments: &[Register], stream| Instruction::Random {
        distribution: Distribution::Normal,
        target: R0,
        arguments: arguments.to_vec(),
        stream,
        site: SITE,
    };
    let cases = [
        (draw(&[R0], state_word(0)), "another number of arguments"),
        (draw(&[R0, R1], state_word(0)), "another type"),
        (
            draw(
                &[R0, R0],
                Address {
                    base: Base::Constants,
                    ..state_word(0)
                },
            ),
            "a constant that is written",
        ),
        (
            draw(
                &[R0, R0],
                Address {
                    base: Base::Frame,
                    ..state_word(0)
                },
            ),
            "behind the frame",
        ),
    ];
    for (instruction, expected) in cases {
        check_flaw(&[one(&[Double, Integer], vec![instruction])], expected);
    }
    let fine = one(&[Double], vec![draw(&[R0, R0], state_word(3))]);
    assert_eq!(validate(&[fine], 0, 0), Ok(3 + STREAM_WORDS));
}

#[test]
fn wrong_registers_are_found() {
    let add = |target| Instruction::Arithmetic {
        operator: IntegerOperator::Add,
        target,
        left: R0,
        right: R0,
        site: SITE,
    };
    check_flaw(&[one(&[Integer], vec![add(R1)])], "does not exist");
    check_flaw(&[one(&[Integer, Double], vec![add(R1)])], "another type");
    let copy = Instruction::Copy {
        target: R1,
        source: R0,
    };
    check_flaw(&[one(&[Integer, Double], vec![copy])], "another type");
    let select = Instruction::Select {
        target: R0,
        condition: R0,
        then: R0,
        otherwise: R1,
    };
    check_flaw(&[one(&[Integer, Double], vec![select])], "another type");
    let mut function = one(&[Integer], vec![]);
    function.blocks[0].terminator = Terminator::Return(Some(R0));
    check_flaw(&[function], "returns something else");
}

#[test]
fn wrong_jumps_and_calls_are_found() {
    let mut function = one(&[], vec![]);
    function.blocks[0].terminator = Terminator::Jump(BlockId(1));
    check_flaw(&[function], "block that does not exist");
    let mut function = one(&[Integer], vec![]);
    let list = [BlockId(0), BlockId(1)];
    function.blocks[0].terminator = Terminator::Switch(R0, list.into(), BlockId(0));
    check_flaw(&[function], "block that does not exist");
    let call = |function, arguments| Instruction::Call {
        target: None,
        function: FunctionId(function),
        arguments,
    };
    check_flaw(
        &[one(&[], vec![call(1, vec![])])],
        "function that does not exist",
    );
    let callee = straight_line(1, &[Integer], vec![], None);
    let caller = |arguments| one(&[Double], vec![call(0, arguments)]);
    check_flaw(&[callee.clone(), caller(vec![])], "number of arguments");
    check_flaw(&[callee, caller(vec![R0])], "another type");
    check_flaw(&[one(&[], vec![call(0, vec![])])], "calls itself");
    let first = one(&[], vec![call(1, vec![])]);
    let second = one(&[], vec![call(0, vec![])]);
    check_flaw(&[first, second], "calls itself");
}

#[test]
fn accesses_outside_of_a_memory_are_found() {
    let load = |address| Instruction::LoadInteger {
        target: R0,
        address,
    };
    let constant = |offset| Address {
        base: Base::Constants,
        ..state_word(offset)
    };
    let frame = |offset| Address {
        base: Base::Frame,
        ..state_word(offset)
    };
    assert_eq!(
        validate(&[one(&[Integer], vec![load(constant(3))])], 0, 4),
        Ok(0)
    );
    check_flaw(
        &[one(&[Integer], vec![load(constant(4))])],
        "behind the constants",
    );
    check_flaw(&[one(&[Integer], vec![load(frame(0))])], "behind the frame");
    let store = Instruction::StoreInteger {
        address: constant(0),
        source: R0,
    };
    check_flaw(&[one(&[Integer], vec![store])], "constant that is written");
    let types = &[Integer, Integer];
    let unchecked = load(indexed(Base::Constants, 0, R1));
    let number = Instruction::Integer {
        target: R1,
        value: -1,
    };
    check_flaw(
        &[one(types, vec![number, unchecked.clone()])],
        "was not checked",
    );
    check_flaw(
        &[one(types, vec![scaled(3, 2), unchecked.clone()])],
        "behind the constants",
    );
    assert_eq!(
        validate(&[one(types, vec![scaled(2, 3), unchecked])], 0, 4),
        Ok(0)
    );
    let grows = Instruction::AddIndices {
        target: R1,
        left: R1,
        right: R1,
    };
    let word = load(indexed(Base::State, 0, R1));
    check_flaw(
        &[one(types, vec![scaled(2, 3), grows, word])],
        "was not checked",
    );
}

#[test]
fn the_words_of_state_that_code_reaches_are_known() {
    let load = Instruction::LoadInteger {
        target: R0,
        address: indexed(Base::State, 5, R1),
    };
    let function = one(&[Integer, Integer], vec![scaled(3, 4), load]);
    assert_eq!(validate(&[function], 0, 0), Ok(5 + 8 + 1));
}

#[test]
fn blocks_after_a_return_are_checked_too() {
    let mut function = one(&[Integer], vec![]);
    function.blocks.push(Block {
        instructions: vec![],
        terminator: Terminator::Branch(R1, BlockId(0), BlockId(0)),
    });
    check_flaw(std::slice::from_ref(&function), "does not exist");
    // The interpreter needs no such check: it never gets there.
    let _ = Interpreter::new(&[function], &[]);
}

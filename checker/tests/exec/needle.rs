//! The kinematics of the needle as code, written as the front end would: every index scaled and checked, every assignment
//! checked against the range of its variable, nothing simplified. For tests and for the benchmark.

use checker::ir::{
    Address, Base, Block, BlockId, DoubleOperator, Function, FunctionId, Instruction,
    IntegerOperator, MathFunction, Register, RegisterType, Relation, SiteId, Terminator,
};

/// Words of the state, by variable.
pub(crate) const DT: u32 = 0;
pub(crate) const VELOCITY: u32 = 1;
pub(crate) const RADIUS: u32 = 2;
pub(crate) const PROGRESS: u32 = 3;
pub(crate) const ROLL: u32 = 4;
pub(crate) const YAW: u32 = 5;
pub(crate) const ROTATIONS: u32 = 6;
pub(crate) const TIP: u32 = 7;
pub(crate) const CENTRE: u32 = 10;
pub(crate) const VECTORS: u32 = 13;
pub(crate) const MATRICES: u32 = 37;
pub(crate) const WORDS: usize = 91;

/// Functions of the program.
pub(crate) const STEP: FunctionId = FunctionId(13);
pub(crate) const ROTATE: FunctionId = FunctionId(14);

const SCALE: i32 = 1000;
const VECTOR_COUNT: u32 = 8;
const MATRIX_COUNT: u32 = 6;
const GLOBAL_Y: i32 = 1;
const GLOBAL_Z: i32 = 2;
const TIP_X: i32 = 3;
const TIP_Z: i32 = 5;
const TEMPORARY_1: i32 = 6;
const TEMPORARY_2: i32 = 7;
const IDENTITY: i32 = 0;
const BASE: i32 = 1;
const CIRCLE: i32 = 2;
const ACTION: i32 = 3;
const TIP_MATRIX: i32 = 4;
const TEMPORARY: i32 = 5;

/// The state before the first step: at the origin, heading along -y, the centre of the circle not yet computed.
pub(crate) fn initial_state() -> Vec<i32> {
    let mut state = vec![0; WORDS];
    state[DT as usize] = 2;
    state[VELOCITY as usize] = SCALE;
    state[RADIUS as usize] = 30 * SCALE;
    for axis in 0..3 {
        state[VECTORS as usize + 4 * axis] = SCALE;
        for matrix in [IDENTITY, CIRCLE, ACTION, TIP_MATRIX] {
            state[MATRICES as usize + 9 * matrix as usize + 4 * axis] = SCALE;
        }
    }
    let base = MATRICES as usize + 9 * BASE as usize;
    state[base + 1] = SCALE;
    state[base + 3] = -SCALE;
    state[base + 8] = SCALE;
    state
}

/// All functions; each calls only earlier ones.
pub(crate) fn functions() -> Vec<Function> {
    vec![
        matrix_times_matrix(),
        matrix_times_vector(),
        copy_matrix(),
        magnitude(),
        normalise(),
        rotation_matrix(),
        calls(
            "update_tip_matrix",
            &[
                (0, &[CIRCLE, BASE, TEMPORARY]),
                (0, &[ACTION, TEMPORARY, TIP_MATRIX]),
            ],
        ),
        update_axes(),
        update_circle_matrix(),
        update_centre(),
        update_tip(),
        update_base(),
        rotate_by_radians(),
        step(),
        rotate_by_degrees(),
    ]
}

/// Writes one function.
struct Writer {
    function: Function,
    sites: u32,
}

impl Writer {
    fn new(name: &str, parameters: u32) -> Writer {
        Writer {
            function: Function {
                name: name.into(),
                registers: vec![RegisterType::Integer; parameters as usize],
                parameters,
                frame_words: 0,
                result: None,
                blocks: vec![empty_block()],
            },
            sites: 0,
        }
    }

    fn site(&mut self) -> SiteId {
        self.sites += 1;
        SiteId(self.sites)
    }

    fn register(&mut self, kind: RegisterType) -> Register {
        self.function.registers.push(kind);
        Register(self.function.registers.len() as u32 - 1)
    }

    fn push(&mut self, instruction: Instruction) {
        let block = self.function.blocks.last_mut().expect("there is a block");
        block.instructions.push(instruction);
    }

    fn open(&mut self) -> BlockId {
        self.function.blocks.push(empty_block());
        BlockId(self.function.blocks.len() as u32 - 1)
    }

    fn current(&self) -> BlockId {
        BlockId(self.function.blocks.len() as u32 - 1)
    }

    fn end(&mut self, BlockId(block): BlockId, terminator: Terminator) {
        self.function.blocks[block as usize].terminator = terminator;
    }

    fn finish(mut self, result: Option<Register>) -> Function {
        self.function.result = result.map(|_| RegisterType::Integer);
        let last = self.current();
        self.end(last, Terminator::Return(result));
        self.function
    }

    fn integer(&mut self, value: i32) -> Register {
        let target = self.register(RegisterType::Integer);
        self.push(Instruction::Integer { target, value });
        target
    }

    fn double(&mut self, value: f64) -> Register {
        let target = self.register(RegisterType::Double);
        self.push(Instruction::Double { target, value });
        target
    }

    fn arithmetic(
        &mut self,
        operator: IntegerOperator,
        left: Register,
        right: Register,
    ) -> Register {
        let target = self.register(RegisterType::Integer);
        let site = self.site();
        self.push(Instruction::Arithmetic {
            operator,
            target,
            left,
            right,
            site,
        });
        target
    }

    fn compute(&mut self, operator: DoubleOperator, left: Register, right: Register) -> Register {
        let target = self.register(RegisterType::Double);
        self.push(Instruction::DoubleArithmetic {
            operator,
            target,
            left,
            right,
        });
        target
    }

    fn math(&mut self, function: MathFunction, arguments: &[Register]) -> Register {
        let target = self.register(RegisterType::Double);
        let site = self.site();
        self.push(Instruction::Math {
            function,
            target,
            arguments: arguments.to_vec(),
            site,
        });
        target
    }

    fn double_of(&mut self, source: Register) -> Register {
        let target = self.register(RegisterType::Double);
        self.push(Instruction::IntegerToDouble { target, source });
        target
    }

    /// `x / _S_`
    fn unscaled(&mut self, value: Register) -> Register {
        let value = self.double_of(value);
        let scale = self.double(f64::from(SCALE));
        self.compute(DoubleOperator::Divide, value, scale)
    }

    /// `fint(x * _S_)`
    fn scaled(&mut self, value: Register) -> Register {
        let scale = self.double(f64::from(SCALE));
        let source = self.compute(DoubleOperator::Multiply, value, scale);
        let target = self.register(RegisterType::Integer);
        let site = self.site();
        self.push(Instruction::DoubleToInteger {
            target,
            source,
            site,
        });
        target
    }

    fn check(&mut self, value: Register, low: i32, high: i32) {
        let site = self.site();
        self.push(Instruction::CheckRange {
            value,
            low,
            high,
            site,
        });
    }

    /// The place of an element, by (index, length, stride) of each dimension.
    fn place(&mut self, offset: u32, indices: &[(Register, u32, u32)]) -> Address {
        let mut sum = None;
        for &(index, length, stride) in indices {
            let target = self.register(RegisterType::Integer);
            let site = self.site();
            self.push(Instruction::ScaleIndex {
                target,
                index,
                first: 0,
                length,
                stride,
                site,
            });
            sum = Some(match sum {
                None => target,
                Some(left) => {
                    let sum = self.register(RegisterType::Integer);
                    self.push(Instruction::AddIndices {
                        target: sum,
                        left,
                        right: target,
                    });
                    sum
                }
            });
        }
        Address {
            base: Base::State,
            offset,
            index: sum,
        }
    }

    fn load(&mut self, offset: u32, indices: &[(Register, u32, u32)]) -> Register {
        let address = self.place(offset, indices);
        let target = self.register(RegisterType::Integer);
        self.push(Instruction::LoadInteger { target, address });
        target
    }

    fn store(&mut self, offset: u32, indices: &[(Register, u32, u32)], source: Register) {
        self.check(source, i32::MIN, i32::MAX);
        let address = self.place(offset, indices);
        self.push(Instruction::StoreInteger { address, source });
    }

    fn matrix(&mut self, matrix: Register, row: Register, column: Register) -> Register {
        self.load(MATRICES, &matrix_indices(matrix, row, column))
    }

    fn vector(&mut self, vector: Register, row: Register) -> Register {
        self.load(VECTORS, &[(vector, VECTOR_COUNT, 3), (row, 3, 1)])
    }

    /// `for (i = 0; i < 3; i++)`, the counter checked against the range of `int`.
    fn three_times(&mut self, body: &mut dyn FnMut(&mut Writer, Register)) {
        let counter = self.register(RegisterType::Integer);
        let zero = self.integer(0);
        self.check(zero, -32768, 32767);
        self.push(Instruction::Copy {
            target: counter,
            source: zero,
        });
        let before = self.current();
        let head = self.open();
        let limit = self.integer(3);
        let goes_on = self.register(RegisterType::Integer);
        self.push(Instruction::CompareIntegers {
            relation: Relation::Less,
            target: goes_on,
            left: counter,
            right: limit,
        });
        let start = self.open();
        body(self, counter);
        let one = self.integer(1);
        let next = self.arithmetic(IntegerOperator::Add, counter, one);
        self.check(next, -32768, 32767);
        self.push(Instruction::Copy {
            target: counter,
            source: next,
        });
        let end = self.current();
        let after = self.open();
        self.end(before, Terminator::Jump(head));
        self.end(head, Terminator::Branch(goes_on, start, after));
        self.end(end, Terminator::Jump(head));
    }

    fn call(&mut self, function: u32, arguments: &[i32]) {
        let arguments = arguments.iter().map(|&value| self.integer(value)).collect();
        self.push(Instruction::Call {
            target: None,
            function: FunctionId(function),
            arguments,
        });
    }

    /// `sum += fint(((matrices[in_mat][i][k]/_S_) * (…/_S_))*_S_)`
    fn accumulate(&mut self, sum: Register, left: Register, right: Register) {
        let left = self.unscaled(left);
        let right = self.unscaled(right);
        let product = self.compute(DoubleOperator::Multiply, left, right);
        let scaled = self.scaled(product);
        let total = self.arithmetic(IntegerOperator::Add, sum, scaled);
        self.check(total, i32::MIN, i32::MAX);
        self.push(Instruction::Copy {
            target: sum,
            source: total,
        });
    }

    fn new_sum(&mut self) -> Register {
        let sum = self.register(RegisterType::Integer);
        self.reset(sum);
        sum
    }

    fn reset(&mut self, sum: Register) {
        self.push(Instruction::Integer {
            target: sum,
            value: 0,
        });
    }
}

fn empty_block() -> Block {
    Block {
        instructions: Vec::new(),
        terminator: Terminator::Return(None),
    }
}

fn matrix_indices(matrix: Register, row: Register, column: Register) -> [(Register, u32, u32); 3] {
    [(matrix, MATRIX_COUNT, 9), (row, 3, 3), (column, 3, 1)]
}

fn calls(name: &str, calls: &[(u32, &[i32])]) -> Function {
    let mut writer = Writer::new(name, 0);
    for (function, arguments) in calls {
        writer.call(*function, arguments);
    }
    writer.finish(None)
}

fn matrix_times_matrix() -> Function {
    let mut writer = Writer::new("matrix_times_matrix", 3);
    let (left, right, out) = (Register(0), Register(1), Register(2));
    let sum = writer.new_sum();
    writer.three_times(&mut |writer, row| {
        writer.three_times(&mut |writer, column| {
            writer.reset(sum);
            writer.three_times(&mut |writer, inner| {
                let left = writer.matrix(left, row, inner);
                let right = writer.matrix(right, inner, column);
                writer.accumulate(sum, left, right);
            });
            writer.store(MATRICES, &matrix_indices(out, row, column), sum);
        });
    });
    writer.finish(None)
}

fn matrix_times_vector() -> Function {
    let mut writer = Writer::new("matrix_times_vector", 3);
    let (matrix, vector, out) = (Register(0), Register(1), Register(2));
    let sum = writer.new_sum();
    writer.three_times(&mut |writer, row| {
        writer.reset(sum);
        writer.three_times(&mut |writer, inner| {
            let left = writer.matrix(matrix, row, inner);
            let right = writer.vector(vector, inner);
            writer.accumulate(sum, left, right);
        });
        writer.store(VECTORS, &[(out, VECTOR_COUNT, 3), (row, 3, 1)], sum);
    });
    writer.finish(None)
}

fn copy_matrix() -> Function {
    let mut writer = Writer::new("copy_matrix", 2);
    writer.three_times(&mut |writer, row| {
        writer.three_times(&mut |writer, column| {
            let value = writer.matrix(Register(0), row, column);
            writer.store(MATRICES, &matrix_indices(Register(1), row, column), value);
        });
    });
    writer.finish(None)
}

fn magnitude() -> Function {
    let mut writer = Writer::new("magnitude", 1);
    let squares = [0, 1, 2].map(|row| {
        let row = writer.integer(row);
        let value = writer.vector(Register(0), row);
        let value = writer.unscaled(value);
        let two = writer.double(2.0);
        writer.math(MathFunction::Pow, &[value, two])
    });
    let sum = writer.compute(DoubleOperator::Add, squares[0], squares[1]);
    let sum = writer.compute(DoubleOperator::Add, sum, squares[2]);
    let root = writer.math(MathFunction::Sqrt, &[sum]);
    let result = writer.scaled(root);
    writer.check(result, i32::MIN, i32::MAX);
    writer.finish(Some(result))
}

fn normalise() -> Function {
    let mut writer = Writer::new("normalise", 1);
    let magnitude = writer.register(RegisterType::Integer);
    writer.push(Instruction::Call {
        target: Some(magnitude),
        function: FunctionId(3),
        arguments: vec![Register(0)],
    });
    let zero = writer.integer(0);
    let is_zero = writer.register(RegisterType::Integer);
    writer.push(Instruction::CompareIntegers {
        relation: Relation::Equal,
        target: is_zero,
        left: magnitude,
        right: zero,
    });
    let head = writer.current();
    let early = writer.open();
    let rest = writer.open();
    writer.end(head, Terminator::Branch(is_zero, early, rest));
    writer.three_times(&mut |writer, row| {
        let value = writer.vector(Register(0), row);
        let value = writer.unscaled(value);
        let divisor = writer.unscaled(magnitude);
        let quotient = writer.compute(DoubleOperator::Divide, value, divisor);
        let value = writer.scaled(quotient);
        writer.store(
            VECTORS,
            &[(Register(0), VECTOR_COUNT, 3), (row, 3, 1)],
            value,
        );
    });
    writer.finish(None)
}

/// As the paper writes it: sine and cosine anew in every entry.
fn rotation_matrix() -> Function {
    let mut writer = Writer::new("rotation_matrix", 3);
    let (axis, angle, out) = (Register(0), Register(1), Register(2));
    for row in 0..3_i32 {
        for column in 0..3_i32 {
            let value = if row == column {
                diagonal_entry(&mut writer, axis, angle, row)
            } else {
                other_entry(&mut writer, axis, angle, row, column)
            };
            let value = writer.scaled(value);
            let (row, column) = (writer.integer(row), writer.integer(column));
            writer.store(MATRICES, &matrix_indices(out, row, column), value);
        }
    }
    writer.finish(None)
}

fn component(writer: &mut Writer, axis: Register, row: i32) -> Register {
    let row = writer.integer(row);
    let value = writer.vector(axis, row);
    writer.unscaled(value)
}

fn trigonometric(writer: &mut Writer, function: MathFunction, angle: Register) -> Register {
    let angle = writer.unscaled(angle);
    writer.math(function, &[angle])
}

fn versine(writer: &mut Writer, angle: Register) -> Register {
    let one = writer.integer(1);
    let one = writer.double_of(one);
    let cosine = trigonometric(writer, MathFunction::Cos, angle);
    writer.compute(DoubleOperator::Subtract, one, cosine)
}

/// `cos(theta) + pow(v[i], 2) * (1 - cos(theta))`
fn diagonal_entry(writer: &mut Writer, axis: Register, angle: Register, row: i32) -> Register {
    let cosine = trigonometric(writer, MathFunction::Cos, angle);
    let value = component(writer, axis, row);
    let two = writer.double(2.0);
    let square = writer.math(MathFunction::Pow, &[value, two]);
    let versine = versine(writer, angle);
    let product = writer.compute(DoubleOperator::Multiply, square, versine);
    writer.compute(DoubleOperator::Add, cosine, product)
}

/// `v[i] * v[j] * (1 - cos(theta)) ∓ v[k] * sin(theta)`
fn other_entry(
    writer: &mut Writer,
    axis: Register,
    angle: Register,
    row: i32,
    column: i32,
) -> Register {
    let left = component(writer, axis, row);
    let right = component(writer, axis, column);
    let product = writer.compute(DoubleOperator::Multiply, left, right);
    let versine = versine(writer, angle);
    let product = writer.compute(DoubleOperator::Multiply, product, versine);
    let third = component(writer, axis, 3 - row - column);
    let sine = trigonometric(writer, MathFunction::Sin, angle);
    let turn = writer.compute(DoubleOperator::Multiply, third, sine);
    let is_subtracted = (row + 1) % 3 == column;
    let operator = if is_subtracted {
        DoubleOperator::Subtract
    } else {
        DoubleOperator::Add
    };
    writer.compute(operator, product, turn)
}

fn update_axes() -> Function {
    let mut writer = Writer::new("update_axes", 0);
    for axis in 0..3 {
        writer.call(1, &[TIP_MATRIX, axis, TIP_X + axis]);
        writer.call(4, &[TIP_X + axis]);
    }
    writer.finish(None)
}

fn update_circle_matrix() -> Function {
    let mut writer = Writer::new("update_circle_matrix", 0);
    writer.call(1, &[BASE, GLOBAL_Y, TEMPORARY_1]);
    writer.call(4, &[TEMPORARY_1]);
    let axis = writer.integer(TEMPORARY_1);
    let angle = writer.load(YAW, &[]);
    let out = writer.integer(CIRCLE);
    writer.push(Instruction::Call {
        target: None,
        function: FunctionId(5),
        arguments: vec![axis, angle, out],
    });
    writer.finish(None)
}

fn update_centre() -> Function {
    let mut writer = Writer::new("update_centre", 0);
    writer.call(6, &[]);
    writer.call(7, &[]);
    for row in 0..3 {
        let index = writer.integer(row);
        let tip = writer.load(TIP, &[(index, 3, 1)]);
        let tip = writer.unscaled(tip);
        let radius = writer.load(RADIUS, &[]);
        let radius = writer.unscaled(radius);
        let axis = writer.integer(TIP_Z);
        let axis = writer.vector(axis, index);
        let axis = writer.unscaled(axis);
        let offset = writer.compute(DoubleOperator::Multiply, radius, axis);
        let centre = writer.compute(DoubleOperator::Subtract, tip, offset);
        let centre = writer.scaled(centre);
        writer.store(CENTRE, &[(index, 3, 1)], centre);
    }
    writer.finish(None)
}

fn update_tip() -> Function {
    let mut writer = Writer::new("update_tip", 0);
    writer.call(8, &[]);
    writer.call(1, &[BASE, GLOBAL_Z, TEMPORARY_1]);
    writer.call(1, &[CIRCLE, TEMPORARY_1, TEMPORARY_2]);
    for row in 0..3 {
        let index = writer.integer(row);
        let centre = writer.load(CENTRE, &[(index, 3, 1)]);
        let centre = writer.unscaled(centre);
        let vector = writer.integer(TEMPORARY_2);
        let vector = writer.vector(vector, index);
        let vector = writer.unscaled(vector);
        let radius = writer.load(RADIUS, &[]);
        let radius = writer.unscaled(radius);
        let offset = writer.compute(DoubleOperator::Multiply, vector, radius);
        let tip = writer.compute(DoubleOperator::Add, centre, offset);
        let tip = writer.scaled(tip);
        writer.store(TIP, &[(index, 3, 1)], tip);
    }
    writer.call(6, &[]);
    writer.call(7, &[]);
    writer.finish(None)
}

fn update_base() -> Function {
    let mut writer = Writer::new("update_base", 0);
    writer.call(6, &[]);
    writer.call(2, &[TIP_MATRIX, BASE]);
    writer.call(2, &[IDENTITY, CIRCLE]);
    writer.call(2, &[IDENTITY, ACTION]);
    let zero = writer.integer(0);
    writer.store(YAW, &[], zero);
    writer.finish(None)
}

fn rotate_by_radians() -> Function {
    let mut writer = Writer::new("rotate_by_radians", 1);
    writer.store(ROLL, &[], Register(0));
    let axis = writer.integer(TIP_X);
    let angle = writer.load(ROLL, &[]);
    let out = writer.integer(ACTION);
    writer.push(Instruction::Call {
        target: None,
        function: FunctionId(5),
        arguments: vec![axis, angle, out],
    });
    writer.call(9, &[]);
    writer.call(11, &[]);
    let count = writer.load(ROTATIONS, &[]);
    let one = writer.integer(1);
    let count = writer.arithmetic(IntegerOperator::Add, count, one);
    writer.check(count, -32768, 32767);
    writer.store(ROTATIONS, &[], count);
    writer.finish(None)
}

fn rotate_by_degrees() -> Function {
    let mut writer = Writer::new("rotate_by_degrees", 1);
    let degrees = writer.double_of(Register(0));
    let half_turn = writer.double(180.0);
    let halves = writer.compute(DoubleOperator::Divide, degrees, half_turn);
    let pi = writer.double(std::f64::consts::PI);
    let radians = writer.compute(DoubleOperator::Multiply, halves, pi);
    let angle = writer.scaled(radians);
    writer.push(Instruction::Call {
        target: None,
        function: FunctionId(12),
        arguments: vec![angle],
    });
    writer.finish(None)
}

fn step() -> Function {
    let mut writer = Writer::new("step", 0);
    let velocity = writer.load(VELOCITY, &[]);
    let velocity = writer.unscaled(velocity);
    let dt = writer.load(DT, &[]);
    let dt = writer.double_of(dt);
    let advance = writer.compute(DoubleOperator::Multiply, velocity, dt);
    let advance = writer.scaled(advance);
    let arc = writer.unscaled(advance);
    let radius = writer.load(RADIUS, &[]);
    let radius = writer.unscaled(radius);
    let turn = writer.compute(DoubleOperator::Divide, arc, radius);
    let turn = writer.scaled(turn);
    for (variable, increment) in [(PROGRESS, advance), (YAW, turn)] {
        let old = writer.load(variable, &[]);
        let new = writer.arithmetic(IntegerOperator::Add, old, increment);
        writer.store(variable, &[], new);
    }
    writer.call(10, &[]);
    writer.finish(None)
}

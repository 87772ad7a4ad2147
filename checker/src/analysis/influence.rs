//! Which words of a state make a difference to what may happen from there on, and to how a number
//! grows.
//!
//! A word *makes a difference* if a guard, an invariant, a rate, a weight or a channel depends on
//! it, or the value of a word that does, or by how much the number grows. A word that is only added
//! to, and is a term of the number, makes none: whatever it is, the number grows by as much.
//!
//! For each function the analysis finds on what the words depend that it writes: in every word a
//! sum of words with constant factors, and the rest. Order and branches within a function are
//! ignored: whatever is read where a function branches may decide about all that it writes.
//!
//! What it cannot follow makes all words count that the function reads, or all there are.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::function_reads::{read_words, state_words};
use crate::ir::{
    Access, Address, Base, DoubleOperator, Function, FunctionId, Instruction, IntegerOperator,
    Network, Operand, Register, Terminator,
};

/// What a value depends on.
#[derive(Clone, Debug, Default, PartialEq)]
struct Value {
    /// The words that it is a sum of, with their factors.
    terms: BTreeMap<u32, f64>,
    /// The words that it depends on in any other way, ascending.
    rest: Vec<u32>,
    /// The number that it is, if it is one.
    constant: Option<f64>,
}

impl Value {
    fn number(value: f64) -> Value {
        Value {
            constant: Some(value),
            ..Value::default()
        }
    }

    fn word(word: u32) -> Value {
        Value {
            terms: [(word, 1.0)].into(),
            ..Value::default()
        }
    }

    /// The sum with another value times a factor.
    fn plus(&self, other: &Value, factor: f64) -> Value {
        let mut sum = self.clone();
        for (&word, term) in &other.terms {
            *sum.terms.entry(word).or_default() += factor * term;
        }
        sum.constant = self
            .constant
            .zip(other.constant)
            .map(|(one, other)| one + factor * other);
        sum.add_rest(&other.rest);
        sum
    }

    fn times(&self, factor: f64) -> Value {
        Value::number(0.0).plus(self, factor)
    }

    /// Some value that depends on the same words.
    fn any(&self) -> Value {
        let mut any = Value::default();
        any.rest.extend(self.terms.keys());
        any.add_rest(&self.rest);
        any
    }

    fn add_rest(&mut self, words: &[u32]) {
        self.rest.extend_from_slice(words);
        self.rest.sort_unstable();
        self.rest.dedup();
    }

    /// What is either of two values.
    fn joined(&self, other: &Value) -> Value {
        let mut joined = Value {
            constant: self.constant.filter(|_| self.constant == other.constant),
            ..Value::default()
        };
        joined.add_rest(&self.rest);
        joined.add_rest(&other.rest);
        for (word, term) in self.terms.iter().chain(&other.terms) {
            if self.terms.get(word) == other.terms.get(word) {
                joined.terms.insert(*word, *term);
            } else {
                joined.add_rest(&[*word]);
            }
        }
        joined
    }
}

/// What a function does to the words that it writes, and what it gives back.
#[derive(Clone, Debug, Default)]
struct Summary {
    writes: BTreeMap<u32, Value>,
    /// What it returns.
    returned: Value,
    /// The number that it leaves.
    left: Value,
}

/// Which words make a difference.
#[derive(Clone, Debug)]
pub struct Influence {
    differs: Vec<bool>,
}

impl Influence {
    /// Those of a network in the stochastic reading, if these functions are asked of its states,
    /// and it matters how much the number grows that another one leaves.
    pub fn new(
        network: &Network,
        asked: impl IntoIterator<Item = FunctionId>,
        number: Option<FunctionId>,
    ) -> Influence {
        let words = network.layout.words as usize;
        let mut analysis = Analysis {
            network,
            summaries: FxHashMap::default(),
        };
        let influence = analysis.find(asked, number);
        Influence {
            differs: influence.unwrap_or_else(|| vec![true; words]),
        }
    }

    /// Whether a word makes a difference.
    pub fn differs(&self, word: u32) -> bool {
        self.differs[word as usize]
    }
}

struct Analysis<'n> {
    network: &'n Network,
    summaries: FxHashMap<FunctionId, Option<Summary>>,
}

impl Analysis<'_> {
    /// By word, whether it makes a difference; `None` if that is not known.
    fn find(
        &mut self,
        asked: impl IntoIterator<Item = FunctionId>,
        number: Option<FunctionId>,
    ) -> Option<Vec<bool>> {
        let network = self.network;
        let words = network.layout.words as usize;
        let mut differs = vec![false; words];
        let mut open: Vec<u32> = read_words(network, deciders(network).chain(asked), words)?;
        // What the words depend on that count, and those of which only the growth does.
        let mut flows: Vec<(u32, Value)> = Vec::new();
        for function in updates(network) {
            let summary = self.summary(function)?;
            flows.extend(summary.writes);
        }
        if let Some(number) = number {
            let Summary { left, .. } = self.summary(number)?;
            open.extend(&left.rest);
            for &word in left.terms.keys() {
                for (_, value) in flows.iter().filter(|flow| flow.0 == word) {
                    if value.terms.get(&word) != Some(&1.0) || value.rest.contains(&word) {
                        open.push(word);
                    }
                    let others = value.terms.keys().filter(|&&other| other != word);
                    open.extend(others);
                    open.extend(&value.rest);
                }
                open.extend(self.rate_words(word)?);
            }
        }
        while let Some(word) = open.pop() {
            if std::mem::replace(&mut differs[word as usize], true) {
                continue;
            }
            for (_, value) in flows.iter().filter(|flow| flow.0 == word) {
                open.extend(value.terms.keys());
                open.extend(&value.rest);
            }
            open.extend(self.rate_words(word)?);
        }
        Some(differs)
    }

    /// What the rate of the clock at a word depends on.
    fn rate_words(&self, word: u32) -> Option<Vec<u32>> {
        let network = self.network;
        let rates = network.locations().filter_map(|location| {
            let sets = location.chances.rated_clocks.contains(&word);
            location.chances.rates.filter(|_| sets)
        });
        read_words(network, rates, network.layout.words as usize)
    }

    fn summary(&mut self, function: FunctionId) -> Option<Summary> {
        if let Some(known) = self.summaries.get(&function) {
            return known.clone();
        }
        // Functions do not call themselves.
        let summary = self.summarised(function);
        self.summaries.insert(function, summary.clone());
        summary
    }

    fn summarised(&mut self, function: FunctionId) -> Option<Summary> {
        let code = &self.network.functions[function.0 as usize];
        let mut reader = Reader {
            code,
            most: self.network.layout.words as usize,
            hidden: hidden(self.network),
            registers: vec![None; code.registers.len()],
            frame: Value::default(),
            left: Value::default(),
            writes: BTreeMap::new(),
            is_straight: code.blocks.len() == 1,
        };
        for _ in 0..MOST_ROUNDS {
            let before = (reader.registers.clone(), reader.writes.clone());
            for instruction in code.instructions() {
                if let Instruction::Call {
                    target,
                    function,
                    ref arguments,
                } = *instruction
                {
                    let summary = self.summary(function)?;
                    reader.call(target, &summary, arguments);
                } else {
                    reader.instruction(instruction)?;
                }
            }
            if reader.is_straight || before == (reader.registers.clone(), reader.writes.clone()) {
                return Some(reader.finish());
            }
        }
        None
    }
}

/// What rounds of a loop carry from one to the next is followed so often.
const MOST_ROUNDS: usize = 100;

/// The words that functions leave numbers in for others, and draw random numbers from.
fn hidden(network: &Network) -> Vec<u32> {
    let chances = &network.chances;
    let doubles = [chances.result, chances.ahead, chances.signature];
    let stream = chances.stream..chances.stream + crate::ir::STREAM_WORDS as u32;
    doubles
        .into_iter()
        .flat_map(|word| [word, word + 1])
        .chain(stream)
        .collect()
}

/// The functions that decide what happens.
fn deciders(network: &Network) -> impl Iterator<Item = FunctionId> {
    let locations = network.locations().flat_map(|location| {
        [
            location.invariant.function,
            location.chances.exponential_rate,
        ]
    });
    let edges = network.edges().flat_map(|edge| {
        let index = edge.sync.and_then(|sync| sync.index);
        let weights = edge.branches.iter().map(|branch| branch.weight);
        weights.chain([edge.guard.function, index])
    });
    locations.chain(edges).flatten()
}

/// The functions of all updates.
fn updates(network: &Network) -> impl Iterator<Item = FunctionId> {
    let around = [&network.before_update, &network.after_update];
    let edges = network.edges().flat_map(|edge| {
        let branches = edge.branches.iter().map(|branch| branch.update.function);
        branches.chain([edge.update.function])
    });
    let around = around.into_iter().flatten().map(|update| update.function);
    edges.chain(around).flatten()
}

/// Follows values through a function.
struct Reader<'c> {
    code: &'c Function,
    most: usize,
    hidden: Vec<u32>,
    registers: Vec<Option<Value>>,
    /// All local arrays.
    frame: Value,
    /// The number that is left for whoever calls.
    left: Value,
    writes: BTreeMap<u32, Value>,
    /// Whether each instruction runs once, in order.
    is_straight: bool,
}

impl Reader<'_> {
    fn value(&self, Register(register): Register) -> Value {
        self.registers[register as usize]
            .clone()
            .unwrap_or_default()
    }

    fn set(&mut self, Register(register): Register, value: Value) {
        let known = &mut self.registers[register as usize];
        *known = Some(match known {
            Some(before) if !self.is_straight => before.joined(&value),
            _ => value,
        });
    }

    fn call(&mut self, target: Option<Register>, summary: &Summary, arguments: &[Register]) {
        let mut given = Value::default();
        for &argument in arguments {
            given.add_rest(&self.value(argument).any().rest);
        }
        for (&word, value) in &summary.writes {
            let mut value = value.clone();
            value.add_rest(&given.rest);
            self.write(word, value);
        }
        let with_arguments = |value: &Value| {
            if given.rest.is_empty() {
                return value.clone();
            }
            let mut value = value.any();
            value.add_rest(&given.rest);
            value
        };
        self.left = with_arguments(&summary.left);
        if let Some(target) = target {
            self.set(target, with_arguments(&summary.returned));
        }
    }

    fn write(&mut self, word: u32, mut value: Value) {
        if !self.is_straight {
            // It may not run, or run again: the word may be what it was.
            value = self.word(word).joined(&value);
        }
        self.writes.insert(word, value);
    }

    /// What a word is by now.
    fn word(&self, word: u32) -> Value {
        let written = self.writes.get(&word).cloned();
        written.unwrap_or_else(|| Value::word(word))
    }

    fn finish(self) -> Summary {
        let mut conditions = Value::default();
        let mut returned: Option<Value> = None;
        for block in &self.code.blocks {
            match block.terminator {
                Terminator::Branch(register, ..) | Terminator::Switch(register, ..) => {
                    conditions.add_rest(&self.value(register).any().rest);
                }
                Terminator::Return(Some(register)) => {
                    let value = self.value(register);
                    returned = Some(returned.map_or(value.clone(), |known| known.joined(&value)));
                }
                Terminator::Jump(_) | Terminator::Return(None) | Terminator::Fail(..) => {}
            }
        }
        let mut summary = Summary {
            writes: self.writes,
            returned: returned.unwrap_or_default(),
            left: self.left,
        };
        let all = summary.writes.values_mut();
        for value in all.chain([&mut summary.returned, &mut summary.left]) {
            value.add_rest(&conditions.rest);
        }
        summary
    }

    fn instruction(&mut self, instruction: &Instruction) -> Option<()> {
        match *instruction {
            Instruction::Integer { target, value } => {
                self.set(target, Value::number(f64::from(value)));
            }
            Instruction::Double { target, value } => self.set(target, Value::number(value.value())),
            Instruction::Copy { target, source }
            | Instruction::IntegerToDouble { target, source } => {
                let value = self.value(source);
                self.set(target, value);
            }
            Instruction::Arithmetic {
                operator,
                target,
                left,
                right,
                ..
            } => {
                let operator = match operator {
                    IntegerOperator::Add => Some(DoubleOperator::Add),
                    IntegerOperator::Subtract => Some(DoubleOperator::Subtract),
                    IntegerOperator::Multiply => Some(DoubleOperator::Multiply),
                    _ => None,
                };
                let value = self.computed(operator, left, right);
                self.set(target, value);
            }
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
                ..
            } => {
                let value = self.computed(Some(operator), left, right);
                self.set(target, value);
            }
            Instruction::LoadInteger { target, address } => {
                let value = self.read(address, 1)?;
                self.set(target, value);
            }
            Instruction::LoadDouble { target, address } => {
                let value = self.read(address, 2)?;
                self.set(target, value);
            }
            Instruction::StoreInteger { address, source } => {
                let value = self.value(source);
                self.store(address, 1, &value)?;
            }
            Instruction::StoreDouble {
                address, source, ..
            } => {
                let value = self.value(source);
                self.store(address, 2, &value)?;
            }
            ref other => self.other(other)?,
        }
        Some(())
    }

    fn computed(&self, operator: Option<DoubleOperator>, left: Register, right: Register) -> Value {
        let (left, right) = (self.value(left), self.value(right));
        match operator {
            Some(DoubleOperator::Add) => left.plus(&right, 1.0),
            Some(DoubleOperator::Subtract) => left.plus(&right, -1.0),
            Some(DoubleOperator::Multiply) => match (left.constant, right.constant) {
                (_, Some(factor)) => left.times(factor),
                (Some(factor), _) => right.times(factor),
                _ => left.any().joined(&right.any()),
            },
            Some(DoubleOperator::Divide) => match right.constant {
                Some(divisor) if divisor != 0.0 => left.times(1.0 / divisor),
                _ => left.any().joined(&right.any()),
            },
            _ => left.any().joined(&right.any()),
        }
    }

    /// An instruction of which only what it reads matters.
    fn other(&mut self, instruction: &Instruction) -> Option<()> {
        let mut read = Value::default();
        let mut targets = Vec::new();
        let mut written = Vec::new();
        let mut is_known = true;
        instruction.each_operand(&mut |operand| match operand {
            Operand::Source(&register) => read.add_rest(&self.value(register).any().rest),
            Operand::Target(&register) => targets.push(register),
            Operand::Memory(&address, access) => {
                if let Access::Read(count) | Access::Update(count) = access {
                    match self.read(address, count) {
                        Some(value) => read.add_rest(&value.any().rest),
                        None => is_known = false,
                    }
                }
                match access {
                    Access::Write(count) | Access::Update(count) => written.push((address, count)),
                    Access::Take if address.base == Base::State => is_known = false,
                    Access::Read(_) | Access::Take => {}
                }
            }
            Operand::Clock(_) => {}
        });
        for (address, count) in written {
            self.store(address, count, &read)?;
        }
        for target in targets {
            self.set(target, read.clone());
        }
        is_known.then_some(())
    }

    /// What is read at an address.
    fn read(&self, address: Address, count: u32) -> Option<Value> {
        let mut value = match address.base {
            Base::Constants => Value::default(),
            Base::Frame => self.frame.clone(),
            Base::State | Base::Register(_) => {
                let words = state_words(self.code, address, count, self.most)?;
                if self.hidden.contains(&words.start) {
                    return Some(if words.start == self.hidden[0] {
                        self.left.clone()
                    } else {
                        Value::default()
                    });
                }
                if address.index.is_none() && words.len() as u32 == count && count <= 2 {
                    self.word(words.start)
                } else {
                    let mut any = Value::default();
                    for word in words {
                        any.add_rest(&self.word(word).any().rest);
                    }
                    any
                }
            }
        };
        if let Some(index) = address.index {
            value = value.any();
            value.add_rest(&self.value(index).any().rest);
        }
        Some(value)
    }

    fn store(&mut self, address: Address, count: u32, value: &Value) -> Option<()> {
        let mut value = value.clone();
        if let Some(index) = address.index {
            value = value.any();
            value.add_rest(&self.value(index).any().rest);
        }
        match address.base {
            Base::Constants => {}
            Base::Frame => {
                self.frame.add_rest(&value.any().rest);
            }
            Base::State | Base::Register(_) => {
                let words = state_words(self.code, address, count, self.most)?;
                if self.hidden.contains(&words.start) {
                    if words.start == self.hidden[0] {
                        self.left = value;
                    }
                    return Some(());
                }
                let is_one = address.index.is_none() && words.len() as u32 == count && count <= 2;
                if is_one {
                    self.write(words.start, value);
                    return Some(());
                }
                for word in words {
                    // It may be another part that is written.
                    let mut one = value.any();
                    one.add_rest(&[word]);
                    self.write(word, one);
                }
            }
        }
        Some(())
    }
}

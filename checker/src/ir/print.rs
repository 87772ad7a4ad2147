//! Code as text, for people who look for a fault and for tests that show what they ran.
//!
//! One line an instruction, the target first: `r7 = r3 + r5  @12`, where `@12` is the site that
//! errors are reported at. Words in memory are written `state[4 + r2]`.

use std::fmt::{Display, Formatter, Result};

use super::{
    Address, Base, BlockId, ClockOperand, DoubleOperator, ExternalArgument, Function, FunctionId,
    Instruction, IntegerOperator, Register, RegisterType, Relation, SiteId, Terminator,
};

impl Display for Function {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "function `{}` (", self.name)?;
        for (index, kind) in self.registers.iter().enumerate() {
            let separator = match index {
                0 => "",
                _ if index == self.parameters as usize => "; ",
                _ => ", ",
            };
            write!(f, "{separator}r{index} {kind}")?;
        }
        write!(f, ")")?;
        if let Some(result) = self.result {
            write!(f, " gives {result}")?;
        }
        writeln!(f, ", frame of {} words", self.frame_words)?;
        for (index, block) in self.blocks.iter().enumerate() {
            writeln!(f, "b{index}:")?;
            for instruction in &block.instructions {
                writeln!(f, "    {instruction}")?;
            }
            writeln!(f, "    {}", block.terminator)?;
        }
        Ok(())
    }
}

impl Display for RegisterType {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            RegisterType::Integer => "integer",
            RegisterType::Double => "double",
            RegisterType::Address => "address",
        })
    }
}

impl Display for Register {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "r{}", self.0)
    }
}

impl Display for BlockId {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "b{}", self.0)
    }
}

impl Display for FunctionId {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "f{}", self.0)
    }
}

impl Display for SiteId {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "@{}", self.0)
    }
}

impl Display for Terminator {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Terminator::Jump(target) => write!(f, "jump {target}"),
            Terminator::Branch(condition, then, otherwise) => {
                write!(f, "if {condition} then {then} else {otherwise}")
            }
            Terminator::Switch(number, list, otherwise) => {
                write!(f, "switch {number} to")?;
                for target in list {
                    write!(f, " {target},")?;
                }
                write!(f, " else {otherwise}")
            }
            Terminator::Return(None) => write!(f, "return"),
            Terminator::Return(Some(result)) => write!(f, "return {result}"),
            Terminator::Fail(kind, site) => write!(f, "fail {kind:?}  {site}"),
        }
    }
}

impl Display for Address {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self.base {
            Base::State => write!(f, "state[{}", self.offset)?,
            Base::Constants => write!(f, "constants[{}", self.offset)?,
            Base::Frame => write!(f, "frame[{}", self.offset)?,
            Base::Register(register) => write!(f, "{register}[{}", self.offset)?,
        }
        if let Some(index) = self.index {
            write!(f, " + {index}")?;
        }
        write!(f, "]")
    }
}

impl Display for ClockOperand {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self.index {
            None => write!(f, "x{}", self.first.0),
            Some(index) => write!(f, "x({} + {index})", self.first.0),
        }
    }
}

impl Display for Relation {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            Relation::Less => "<",
            Relation::LessEqual => "<=",
            Relation::Greater => ">",
            Relation::GreaterEqual => ">=",
            Relation::Equal => "==",
            Relation::NotEqual => "!=",
        })
    }
}

impl Display for IntegerOperator {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            IntegerOperator::Add => "+",
            IntegerOperator::Subtract => "-",
            IntegerOperator::Multiply => "*",
            IntegerOperator::Divide => "/",
            IntegerOperator::Remainder => "%",
            IntegerOperator::Power => "**",
            IntegerOperator::ShiftLeft => "<<",
            IntegerOperator::ShiftRight => ">>",
            IntegerOperator::And => "&",
            IntegerOperator::Or => "|",
            IntegerOperator::Xor => "^",
            IntegerOperator::Minimum => "<?",
            IntegerOperator::Maximum => ">?",
        })
    }
}

impl Display for DoubleOperator {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            DoubleOperator::Add => "+",
            DoubleOperator::Subtract => "-",
            DoubleOperator::Multiply => "*",
            DoubleOperator::Divide => "/",
            DoubleOperator::Minimum => "<?",
            DoubleOperator::Maximum => ">?",
        })
    }
}

/// Registers with commas between them.
struct RegisterList<'a>(&'a [Register]);

impl Display for RegisterList<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (index, register) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { ", " };
            write!(f, "{separator}{register}")?;
        }
        Ok(())
    }
}

impl Display for Instruction {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Instruction::Integer { target, value } => write!(f, "{target} = {value}"),
            Instruction::Double { target, value } => write!(f, "{target} = {:?}", value.value()),
            Instruction::Copy { target, source } => write!(f, "{target} = {source}"),
            Instruction::Arithmetic {
                operator,
                target,
                left,
                right,
                site,
            } => write!(f, "{target} = {left} {operator} {right}  {site}"),
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            }
            | Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            } => write!(f, "{target} = {left} {relation} {right}"),
            Instruction::Not { target, source } => write!(f, "{target} = not {source}"),
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            } => write!(f, "{target} = {left} {operator} {right}"),
            Instruction::Select {
                target,
                condition,
                then,
                otherwise,
            } => write!(f, "{target} = {then} if {condition} else {otherwise}"),
            Instruction::IntegerToDouble { target, source } => {
                write!(f, "{target} = double {source}")
            }
            Instruction::DoubleToInteger {
                target,
                source,
                site,
            } => write!(f, "{target} = truncate {source}  {site}"),
            Instruction::Math {
                function,
                target,
                arguments,
                site,
            } => {
                let name = format!("{function:?}").to_lowercase();
                write!(f, "{target} = {name}({})  {site}", RegisterList(arguments))
            }
            Instruction::Random {
                distribution,
                target,
                arguments,
                stream,
                site,
            } => {
                let (name, arguments) = (distribution.name(), RegisterList(arguments));
                write!(f, "{target} = {name}({arguments}) from {stream}  {site}")
            }
            Instruction::External {
                target,
                function,
                arguments,
                site,
            } => {
                if let Some(target) = target {
                    write!(f, "{target} = ")?;
                }
                write!(f, "external {}(", function.0)?;
                for (number, argument) in arguments.iter().enumerate() {
                    let comma = if number > 0 { ", " } else { "" };
                    match argument {
                        ExternalArgument::Value(register) => write!(f, "{comma}{register}")?,
                        ExternalArgument::Memory { address, words, .. } => {
                            write!(f, "{comma}{address} of {words}")?;
                        }
                    }
                }
                write!(f, ")  {site}")
            }
            Instruction::AddIndices { .. }
            | Instruction::ScaleIndex { .. }
            | Instruction::CheckRange { .. }
            | Instruction::Require { .. }
            | Instruction::CountRound { .. } => write_check(self, f),
            Instruction::Call {
                target,
                function,
                arguments,
            } => {
                if let Some(target) = target {
                    write!(f, "{target} = ")?;
                }
                write!(f, "{function}({})", RegisterList(arguments))
            }
            Instruction::LoadInteger { .. }
            | Instruction::LoadDouble { .. }
            | Instruction::StoreInteger { .. }
            | Instruction::StoreDouble { .. }
            | Instruction::CopyWords { .. }
            | Instruction::EqualWords { .. }
            | Instruction::AddressOf { .. } => write_access(self, f),
            Instruction::Constrain { .. }
            | Instruction::SetClock { .. }
            | Instruction::CopyClock { .. } => write_clock(self, f),
        }
    }
}

/// The instructions on indices, and those that may only fail.
fn write_check(instruction: &Instruction, f: &mut Formatter<'_>) -> Result {
    match instruction {
        Instruction::AddIndices {
            target,
            left,
            right,
        } => write!(f, "{target} = {left} + {right}  (index)"),
        Instruction::ScaleIndex {
            target,
            index,
            first,
            length,
            stride,
            site,
        } => write!(
            f,
            "{target} = ({index} - {first}) below {length} * {stride}  {site}"
        ),
        Instruction::CheckRange {
            value,
            low,
            high,
            site,
        } => write!(f, "check {low} <= {value} <= {high}  {site}"),
        Instruction::Require {
            condition,
            kind,
            site,
        } => write!(f, "require {condition}, else {kind:?}  {site}"),
        Instruction::CountRound { site } => write!(f, "count round  {site}"),
        _ => Ok(()),
    }
}

/// The instructions on memory.
fn write_access(instruction: &Instruction, f: &mut Formatter<'_>) -> Result {
    match instruction {
        Instruction::LoadInteger { target, address } => write!(f, "{target} = {address}"),
        Instruction::LoadDouble { target, address } => write!(f, "{target} = double {address}"),
        Instruction::StoreInteger { address, source } => write!(f, "{address} = {source}"),
        Instruction::StoreDouble {
            address, source, ..
        } => write!(f, "double {address} = {source}"),
        Instruction::CopyWords {
            target,
            source,
            words,
        } => write!(f, "{target} = {source}, {words} words"),
        Instruction::EqualWords {
            target,
            left,
            right,
            words,
        } => write!(f, "{target} = {left} == {right}, {words} words"),
        Instruction::AddressOf { target, address } => write!(f, "{target} = &{address}"),
        _ => Ok(()),
    }
}

/// The instructions on clocks.
fn write_clock(instruction: &Instruction, f: &mut Formatter<'_>) -> Result {
    match instruction {
        Instruction::Constrain {
            left,
            right,
            strict,
            bound,
            negate_bound,
            site,
        } => {
            let relation = if *strict { "<" } else { "<=" };
            let sign = if *negate_bound { "-" } else { "" };
            write!(
                f,
                "constrain {left} - {right} {relation} {sign}{bound}  {site}"
            )
        }
        Instruction::SetClock { clock, value, site } => write!(f, "{clock} := {value}  {site}"),
        Instruction::CopyClock {
            clock,
            source,
            increment,
            site,
        } => {
            write!(f, "{clock} := {source}")?;
            if let Some(increment) = increment {
                write!(f, " + {increment}")?;
            }
            write!(f, "  {site}")
        }
        _ => Ok(()),
    }
}

//! Places: variables, their parts, and what is loaded from and stored to them.

use super::super::typed::{ClockSet, Element, Expr, Kind, LocalId, Place, Root};
use super::super::types::{Memory, Type};
use super::{Builder, Home, at, register_type};
use crate::ir::{
    Address, Base, ClockId, ClockOperand, ClockRange, Instruction, Register, RegisterType,
};

/// Where a value can be stored.
#[derive(Clone, Copy, Debug)]
pub(super) enum Destination {
    /// In a register.
    Register(Register),
    /// In memory.
    Memory(Address),
}

/// What a path of indices and fields starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AddressStart {
    /// The memory that is meant, counted from its beginning.
    Fixed,
    /// The constants.
    Constants,
    /// The frame.
    Frame,
    /// An address, or the index of a clock, in a register; and the parameter it came from.
    Register(Register, Option<LocalId>),
    /// The variable is a register.
    Home(Register),
}

/// A place in one memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub(super) start: AddressStart,
    /// The known part of the offset.
    pub(super) offset: u32,
    /// The computed part.
    pub(super) index: Option<Register>,
    /// The greatest value of the computed part.
    pub(super) reach: u32,
}

impl Builder<'_> {
    /// The place in one of the memories that an expression names.
    pub(super) fn path(&mut self, expr: &Expr, memory: Memory) -> Path {
        match &expr.kind {
            Kind::Variable(place) => self.root(place, memory),
            Kind::Field { record, offset } => {
                let mut path = self.path(record, memory);
                path.offset += offset.of(memory);
                path
            }
            Kind::Index(element) => {
                let path = self.path(&element.array, memory);
                self.indexed(path, element, memory)
            }
            _ => {
                let address = self.address(expr);
                address_path(address)
            }
        }
    }

    fn root(&mut self, place: &Place, memory: Memory) -> Path {
        let offset = place.base.of(memory);
        let start = match place.root {
            Root::State => {
                if memory == Memory::Words {
                    self.effects.reads_state = true;
                }
                AddressStart::Fixed
            }
            Root::Constants => AddressStart::Constants,
            Root::Local(local) => match self.homes[local.0 as usize] {
                Some(Home::Register(register)) => AddressStart::Home(register),
                Some(Home::Frame(frame)) => return fixed_path(AddressStart::Frame, offset + frame),
                Some(Home::Reference { address, clock }) => {
                    let register = if memory == Memory::Clocks {
                        clock
                    } else {
                        address
                    };
                    let register = register.expect("a reference holds what its type promises");
                    AddressStart::Register(register, Some(local))
                }
                None => unreachable!("locals are declared before they are used"),
            },
        };
        fixed_path(start, offset)
    }

    fn indexed(&mut self, mut path: Path, element: &Element, memory: Memory) -> Path {
        let &Element { first, length, .. } = element;
        let stride = element.stride.of(memory);
        if let Some(position) = element.position() {
            path.offset += position * stride;
            return path;
        }
        let source = self.value(&element.index);
        let scaled = self.scaled_index(source, first, length, stride, element.index.span);
        if length == 0 {
            // Any index is an error, so nothing is touched; what comes after must lie somewhere all
            // the same.
            return address_path(self.frame(stride));
        }
        path.reach += (length - 1) * stride;
        path.index = Some(self.add_indices(path.index, scaled));
        path
    }

    pub(super) fn add_indices(&mut self, left: Option<Register>, right: Register) -> Register {
        let Some(left) = left else { return right };
        self.compute(RegisterType::Integer, |target| Instruction::AddIndices {
            target,
            left,
            right,
        })
    }

    /// The address of a place in the words that is not a register.
    pub(super) fn path_address(path: Path) -> Address {
        let base = match path.start {
            AddressStart::Fixed => Base::State,
            AddressStart::Constants => Base::Constants,
            AddressStart::Frame => Base::Frame,
            AddressStart::Register(register, _) => Base::Register(register),
            AddressStart::Home(_) => unreachable!("only whole scalars live in registers"),
        };
        Address {
            base,
            offset: path.offset,
            index: path.index,
        }
    }

    /// Where an assignment to a place stores; `written` records the words as changed.
    pub(super) fn target(&mut self, expr: &Expr, written: bool) -> Destination {
        match &expr.kind {
            Kind::Variable(_) | Kind::Index(_) | Kind::Field { .. } => {
                let path = self.path(expr, Memory::Words);
                if written {
                    self.record_write(path, expr.ty.size().words);
                }
                match path.start {
                    AddressStart::Home(register) => Destination::Register(register),
                    _ => Destination::Memory(Self::path_address(path)),
                }
            }
            Kind::Ternary(condition, then, otherwise) => {
                let address =
                    self.choose_address(condition, then, otherwise, |builder, side| match builder
                        .target(side, written)
                    {
                        Destination::Memory(address) => address,
                        Destination::Register(_) => {
                            unreachable!("places that are chosen from lie in memory")
                        }
                    });
                Destination::Memory(address)
            }
            Kind::Assign(target, value) => self.assign(target, value),
            Kind::Compound(operator, target, value) => {
                self.compound(*operator, target, value, expr.span).0
            }
            Kind::Step { target, delta, .. } => self.step(target, *delta, expr.span).0,
            _ => Destination::Memory(self.address(expr)),
        }
    }

    fn choose_address(
        &mut self,
        condition: &Expr,
        then: &Expr,
        otherwise: &Expr,
        mut of: impl FnMut(&mut Self, &Expr) -> Address,
    ) -> Address {
        let target = self.register(RegisterType::Address);
        self.either_side(condition, [then, otherwise], |builder, side| {
            let address = of(builder, side);
            builder.emit(Instruction::AddressOf { target, address });
        });
        at(Base::Register(target), 0)
    }

    /// Records that words may be changed, if they are words of the state.
    pub(super) fn record_write(&mut self, path: Path, words: u32) {
        if path.start == AddressStart::Fixed {
            self.effects.writes.push((path.offset, path.reach + words));
        }
    }

    /// The words of an array or struct, or of a scalar in memory.
    pub(super) fn address(&mut self, expr: &Expr) -> Address {
        match &expr.kind {
            Kind::Call { .. } => {
                let target = self.frame(expr.ty.size().words);
                self.call(expr, Some(target));
                target
            }
            Kind::Ternary(condition, then, otherwise) if expr.ty.is_aggregate() => {
                self.choose_address(condition, then, otherwise, Self::address)
            }
            _ if expr.is_place() => match self.target(expr, false) {
                Destination::Memory(address) => address,
                Destination::Register(register) => self.spill(register, &expr.ty),
            },
            _ => {
                let value = self.value(expr);
                self.spill(value, &expr.ty)
            }
        }
    }

    /// Puts a value into memory of its own.
    fn spill(&mut self, register: Register, ty: &Type) -> Address {
        let address = self.frame(ty.size().words.max(1));
        self.store(Destination::Memory(address), register, ty);
        address
    }

    /// Stores a scalar.
    pub(super) fn store(&mut self, target: Destination, source: Register, ty: &Type) {
        match target {
            Destination::Register(register) => self.copy(register, source),
            Destination::Memory(address) => self.emit(if ty.is_real() {
                Instruction::StoreDouble {
                    address,
                    source,
                    is_number: false,
                }
            } else {
                Instruction::StoreInteger { address, source }
            }),
        }
    }

    /// Loads a scalar.
    pub(super) fn load(&mut self, target: Destination, ty: &Type) -> Register {
        match target {
            Destination::Register(register) => register,
            Destination::Memory(address) => self.compute(register_type(ty), |target| {
                if ty.is_real() {
                    Instruction::LoadDouble { target, address }
                } else {
                    Instruction::LoadInteger { target, address }
                }
            }),
        }
    }

    /// A clock as an operand, and the clocks that it may be.
    pub(super) fn clock(&mut self, expr: &Expr) -> (ClockOperand, ClockSet) {
        self.effects.mentions_clocks = true;
        if let Kind::Ternary(condition, then, otherwise) = &expr.kind {
            return self.choose_clock(condition, then, otherwise);
        }
        if let Kind::AssignClock {
            target,
            source,
            value,
        } = &expr.kind
        {
            return self.assign_clock(expr, target, source.as_deref(), value.as_deref());
        }
        let path = self.path(expr, Memory::Clocks);
        let first = ClockId(path.offset);
        let AddressStart::Register(register, parameter) = path.start else {
            let operand = ClockOperand {
                first,
                index: path.index,
            };
            let count = path.reach + 1;
            return (operand, ClockSet::Range(ClockRange { first, count }));
        };
        let index = match path.index {
            Some(index) => self.add_indices(Some(register), index),
            None => register,
        };
        let operand = ClockOperand {
            first,
            index: Some(index),
        };
        let parameter = parameter.expect("clocks come in parameters");
        (operand, ClockSet::Parameter(parameter))
    }

    /// One of two clocks; static analysis takes all clocks between them for possible.
    fn choose_clock(
        &mut self,
        condition: &Expr,
        then: &Expr,
        otherwise: &Expr,
    ) -> (ClockOperand, ClockSet) {
        let chosen = self.register(RegisterType::Integer);
        let mut sets = Vec::new();
        self.either_side(condition, [then, otherwise], |builder, side| {
            let (operand, set) = builder.clock(side);
            let number = builder.clock_number(operand);
            builder.copy(chosen, number);
            sets.push(set);
        });
        let operand = ClockOperand {
            first: ClockId(0),
            index: Some(chosen),
        };
        (operand, join_clock_sets(sets[0], sets[1]))
    }

    /// The index of a clock, to be passed by reference.
    pub(super) fn clock_number(&mut self, operand: ClockOperand) -> Register {
        match operand.index {
            Some(index) if operand.first.0 == 0 => index,
            index => {
                let first = self.integer(operand.first.0 as i32);
                match index {
                    Some(index) => self.add_indices(Some(first), index),
                    None => first,
                }
            }
        }
    }
}

fn address_path(address: Address) -> Path {
    let start = match address.base {
        Base::State => AddressStart::Fixed,
        Base::Constants => AddressStart::Constants,
        Base::Frame => AddressStart::Frame,
        Base::Register(register) => AddressStart::Register(register, None),
    };
    Path {
        start,
        offset: address.offset,
        index: address.index,
        reach: 0,
    }
}

fn fixed_path(start: AddressStart, offset: u32) -> Path {
    Path {
        start,
        offset,
        index: None,
        reach: 0,
    }
}

/// The smallest set of consecutive clocks that holds both; a parameter stands for itself.
fn join_clock_sets(left: ClockSet, right: ClockSet) -> ClockSet {
    match (left, right) {
        (ClockSet::Range(a), ClockSet::Range(b)) => {
            let first = a.first.min(b.first);
            let end = (a.first.0 + a.count).max(b.first.0 + b.count);
            ClockSet::Range(ClockRange {
                first,
                count: end - first.0,
            })
        }
        (ClockSet::Range(_), other) | (other, _) => other,
    }
}

//! The function that makes an instance of a dynamic template.

use super::super::pools::Slots;
use super::super::typed::{LOCATION_WORDS, LocalId, Place, Signature};
use super::super::types::Type;
use super::places::Destination;
use super::{Builder, Home, at, store_constant};
use crate::diagnostics::Span;
use crate::ir::{
    Address, Base, FunctionId, Instruction, IntegerOperator, Register, RegisterType, Relation,
    RunTimeErrorKind, Terminator,
};

impl Builder<'_> {
    /// A function that takes the first slot that is not in use; `initial` holds the words of the
    /// variables of a slot, and those of its `meta` variables.
    pub(in crate::semantics) fn spawn(
        mut self,
        signature: &Signature,
        slots: &Slots,
        initial: [Vec<i32>; 2],
        counter: &Place,
        span: Span,
    ) -> FunctionId {
        let site = self.site(span);
        let images = initial.map(|words| store_constant(self.network, self.images, words));
        let last = slots.count as i32 - 1;
        self.counted((0, last), span, &mut |builder, number| {
            let location = builder.slot_word(LOCATION_WORDS + slots.first, 1, slots, number, span);
            let found = builder.register(RegisterType::Integer);
            builder.emit(Instruction::LoadInteger {
                target: found,
                address: location,
            });
            let absent = builder.integer(slots.absent.0 as i32);
            let is_free = builder.register(RegisterType::Integer);
            builder.emit(Instruction::CompareIntegers {
                relation: Relation::Equal,
                target: is_free,
                left: found,
                right: absent,
            });
            let (free, next) = (builder.new_block(), builder.new_block());
            builder.terminate(Terminator::Branch(is_free, free, next));
            builder.switch(free);
            let source = builder.integer(slots.initial.0 as i32);
            builder.emit(Instruction::StoreInteger {
                address: location,
                source,
            });
            for ((first, words), image) in [slots.words, slots.meta_words].into_iter().zip(images) {
                if words > 0 {
                    let target = builder.slot_word(first, words, slots, number, span);
                    let source = at(Base::Constants, image);
                    builder.emit(Instruction::CopyWords {
                        target,
                        source,
                        words,
                    });
                }
            }
            builder.store_arguments(signature, slots, number, span);
            builder.count_instance(counter, span);
            builder.terminate(Terminator::Return(None));
            builder.switch(next);
        });
        self.terminate(Terminator::Fail(RunTimeErrorKind::NoRoom, site));
        self.finish(format!("spawn {}", signature.name), None).0
    }

    /// The place in a slot of what lies at `first` in the first slot, if a slot has this number of
    /// words.
    fn slot_word(
        &mut self,
        first: u32,
        words: u32,
        slots: &Slots,
        number: Register,
        span: Span,
    ) -> Address {
        let site = self.site(span);
        let index = self.register(RegisterType::Integer);
        self.emit(Instruction::ScaleIndex {
            target: index,
            index: number,
            first: 0,
            length: slots.count,
            stride: words,
            site,
        });
        Address {
            base: Base::State,
            offset: first,
            index: Some(index),
        }
    }

    fn store_arguments(
        &mut self,
        signature: &Signature,
        slots: &Slots,
        number: Register,
        span: Span,
    ) {
        for (i, (parameter, place)) in signature
            .parameters
            .iter()
            .zip(&slots.parameters)
            .enumerate()
        {
            let words = slots.words.1;
            let target = self.slot_word(place.base.words, words, slots, number, span);
            match self.homes[LocalId(i as u32).0 as usize] {
                Some(Home::Register(value)) => {
                    let ty = if parameter.passes_channel {
                        &Type::ANY_INT
                    } else {
                        &parameter.ty
                    };
                    self.store(Destination::Memory(target), value, ty);
                }
                Some(Home::Frame(frame)) => {
                    self.emit(Instruction::CopyWords {
                        target,
                        source: at(Base::Frame, frame),
                        words: parameter.ty.size().words,
                    });
                }
                _ => unreachable!("arguments are values"),
            }
        }
    }

    fn count_instance(&mut self, counter: &Place, span: Span) {
        let address = at(Base::State, counter.base.words);
        let before = self.register(RegisterType::Integer);
        self.emit(Instruction::LoadInteger {
            target: before,
            address,
        });
        let one = self.integer(1);
        let source = self.arithmetic(IntegerOperator::Add, before, one, span);
        self.emit(Instruction::StoreInteger { address, source });
    }
}

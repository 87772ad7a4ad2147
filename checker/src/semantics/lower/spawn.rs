//! The function that makes an instance of a dynamic template.

use super::super::pools::Slots;
use super::super::typed::{LOCATION_WORDS, LocalId, Place, Signature};
use super::super::types::Type;
use super::places::Destination;
use super::{Builder, Home, at, store_constant};
use crate::diagnostics::Span;
use crate::ir::{
    Address, Base, FunctionId, IntegerOperator, Register, Relation, RunTimeErrorKind, Terminator,
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
            let location = Destination::Memory(location);
            let found = builder.load(location, &Type::ANY_INT);
            let absent = builder.integer(slots.absent.0 as i32);
            let is_free = builder.compare(Relation::Equal, found, absent);
            let (free, next) = (builder.new_block(), builder.new_block());
            builder.terminate(Terminator::Branch(is_free, free, next));
            builder.switch(free);
            let source = builder.integer(slots.initial.0 as i32);
            builder.store(location, source, &Type::ANY_INT);
            for ((first, words), image) in [slots.words, slots.meta_words].into_iter().zip(images) {
                if words > 0 {
                    let target = builder.slot_word(first, words, slots, number, span);
                    builder.copy_words(target, at(Base::Constants, image), words);
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
        let index = self.scaled_index(number, 0, slots.count, words, span);
        Address {
            index: Some(index),
            ..at(Base::State, first)
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
                    self.copy_words(target, at(Base::Frame, frame), parameter.ty.size().words);
                }
                _ => unreachable!("arguments are values"),
            }
        }
    }

    fn count_instance(&mut self, counter: &Place, span: Span) {
        let count = Destination::Memory(at(Base::State, counter.base.words));
        let before = self.load(count, &Type::ANY_INT);
        let one = self.integer(1);
        let after = self.arithmetic(IntegerOperator::Add, before, one, span);
        self.store(count, after, &Type::ANY_INT);
    }
}

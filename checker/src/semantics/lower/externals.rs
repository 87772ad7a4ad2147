//! Functions that call those of libraries.

use super::super::typed::{Expr, Kind, Signature};
use super::{Builder, Home, at, register_type, store_constant};
use crate::diagnostics::Span;
use crate::ir::{
    Base, ExternalArgument, ExternalId, ExternalSignature, FunctionId, Instruction, Register,
    RunTimeErrorKind, Terminator,
};

impl Builder<'_> {
    /// The function that passes its arguments on to one of a library, and checks the result; one
    /// without a number always fails.
    pub(in crate::semantics) fn external(
        mut self,
        signature: &Signature,
        id: Option<ExternalId>,
        types: &ExternalSignature,
        span: Span,
    ) -> FunctionId {
        let site = self.site(span);
        let result = signature.result.is_register();
        let result = result.then(|| register_type(&signature.result));
        let Some(function) = id else {
            self.terminate(Terminator::Fail(RunTimeErrorKind::NotLoaded, site));
            return self.finish(signature.name.clone(), result).0;
        };
        let homes = self.homes.iter().flatten();
        let arguments = homes.zip(&types.parameters).map(|(home, parameter)| {
            match (*home, parameter.memory()) {
                (Home::Register(register), None) => ExternalArgument::Value(register),
                (
                    Home::Reference {
                        address: Some(address),
                        ..
                    },
                    Some((words, is_written)),
                ) => ExternalArgument::Memory {
                    address: at(Base::Register(address), 0),
                    words,
                    is_written,
                },
                _ => unreachable!("values are in registers, and the others come by reference"),
            }
        });
        let arguments = arguments.collect();
        let target = result.map(|kind| self.register(kind));
        self.emit(Instruction::External {
            target,
            function,
            arguments,
            site,
        });
        if let Some(value) = target {
            let whole = (i32::MIN, i32::MAX);
            self.check_range(value, whole, &signature.result, span);
        }
        self.terminate(Terminator::Return(target));
        self.finish(signature.name.clone(), result).0
    }

    /// The address of a text in the constant memory, with the 0 that ends it.
    pub(super) fn text(&mut self, text: &Expr) -> Register {
        let Kind::Text(text) = &text.kind else {
            unreachable!("only texts are given for texts");
        };
        let mut bytes = text.as_bytes().to_vec();
        bytes.push(0);
        let (words, rest) = bytes.as_chunks::<4>();
        let mut words: Vec<i32> = words.iter().map(|word| i32::from_le_bytes(*word)).collect();
        if !rest.is_empty() {
            let mut last = [0; 4];
            last[..rest.len()].copy_from_slice(rest);
            words.push(i32::from_le_bytes(last));
        }
        let offset = store_constant(self.network, self.images, words);
        self.address_of(at(Base::Constants, offset))
    }
}

//! Calls of functions of libraries.

use cranelift_codegen::ir::types::{F64, I32, I64};
use cranelift_codegen::ir::{InstBuilder, StackSlotData, StackSlotKind};

use crate::exec::jit::{external, runtime};
use crate::ir::{ExternalArgument, ExternalId, ExternalType, Register, RunTimeErrorKind, SiteId};

use super::Translator;

impl Translator<'_> {
    /// Calls a function of a library: the arguments and the result pass through the stack.
    pub(super) fn call_external(
        &mut self,
        target: Option<Register>,
        function: ExternalId,
        arguments: &[ExternalArgument],
        site: SiteId,
    ) {
        let Some(called) = external::by_id(function) else {
            let always = self.integer(1);
            self.fail_if(always, RunTimeErrorKind::NotLoaded, site);
            if let Some(target) = target {
                let zero = self.integer(0);
                self.set(target, zero);
            }
            return;
        };
        let words = arguments.len().max(1) as u32;
        let mut slot = |bytes| {
            let data = StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 3);
            self.builder.create_sized_stack_slot(data)
        };
        let (given, left) = (slot(8 * words), slot(8));
        for (number, argument) in arguments.iter().enumerate() {
            let value = match *argument {
                ExternalArgument::Value(register) => self.get(register),
                ExternalArgument::Memory { address, .. } => self.pointer(address),
            };
            let offset = 8 * number as i32;
            self.ins().stack_store(I64, value, given, offset);
        }
        let pointer = std::ptr::from_ref(called) as usize;
        let called_at = self.ins().iconst(I64, pointer as i64);
        let given = self.ins().stack_addr(I64, given, 0);
        let result = self.ins().stack_addr(I64, left, 0);
        let place = self.integer(site.0 as i32);
        let code = runtime::call_external as *const () as usize;
        let status = self.call_back(code, Some(I64), &[called_at, given, result, place]);
        self.propagate_failure(status);
        if let (Some(target), Some(kind)) = (target, called.signature().result) {
            let native = match kind {
                ExternalType::Integer | ExternalType::Bool => I32,
                ExternalType::Double => F64,
            };
            let value = self.ins().stack_load(I64, native, left, 0);
            self.set(target, value);
        }
    }
}

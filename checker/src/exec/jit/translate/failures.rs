//! Checks, and the cold blocks to which they jump.

use std::mem::offset_of;

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32, I64};
use cranelift_codegen::ir::{Block as NativeBlock, InstBuilder, MemFlagsData, Value};

use crate::exec::jit::runtime::{self, NativeContext, failure_status};
use crate::ir::{Instruction, Overflow, Register, RunTimeErrorKind, SiteId};

use super::Translator;

impl Translator<'_> {
    /// The instructions that can fail and do nothing else.
    pub(super) fn check(&mut self, instruction: &Instruction) {
        match *instruction {
            Instruction::CheckRange {
                value,
                low,
                high,
                site,
            } => self.check_range(value, low, high, RunTimeErrorKind::OutOfRange, site),
            Instruction::CountRound { site } => {
                let offset = offset_of!(NativeContext<'static>, rounds_left) as i32;
                let flags = MemFlagsData::trusted();
                let left = self.builder.ins().load(I64, flags, self.context, offset);
                let left = self.refill_rounds(left, site);
                let left = self.ins().iadd_imm_s(left, -1);
                self.builder.ins().store(flags, left, self.context, offset);
            }
            Instruction::Require {
                condition,
                kind,
                site,
            } => {
                let condition = self.get(condition);
                self.fail_unless(condition, kind, site);
            }
            _ => unreachable!("sorted out by instruction"),
        }
    }

    /// The rounds that are left, after more were asked for if there were none.
    fn refill_rounds(&mut self, left: Value, SiteId(site): SiteId) -> Value {
        let (refill, next) = (self.builder.create_block(), self.builder.create_block());
        self.builder.set_cold_block(refill);
        self.builder.append_block_param(next, I64);
        let ins = self.ins();
        ins.brif(left, next, &[left.into()], refill, &[]);
        self.builder.switch_to_block(refill);
        let site = self.integer(site as i32);
        let code = runtime::more_rounds as *const () as usize;
        let status = self.call_back(code, Some(I64), &[self.context, site]);
        self.propagate_failure(status);
        let offset = offset_of!(NativeContext<'static>, rounds_left) as i32;
        let flags = MemFlagsData::trusted();
        let left = self.builder.ins().load(I64, flags, self.context, offset);
        self.ins().jump(next, &[left.into()]);
        self.builder.switch_to_block(next);
        self.builder.block_params(next)[0]
    }

    /// Fails unless `low <= value <= high`.
    pub(super) fn check_range(
        &mut self,
        value: Register,
        low: i32,
        high: i32,
        kind: RunTimeErrorKind,
        site: SiteId,
    ) {
        let value = self.get(value);
        if low > high {
            let always = self.integer(1);
            self.fail_if(always, kind, site);
            return;
        }
        let ins = self.ins();
        let outside = if low == i32::MIN {
            ins.icmp_imm_s(IntCC::SignedGreaterThan, value, i64::from(high))
        } else if high == i32::MAX {
            ins.icmp_imm_s(IntCC::SignedLessThan, value, i64::from(low))
        } else {
            // Counted from the least value without a sign, too small values are too large as well.
            let position = ins.iadd_imm_s(value, -i64::from(low));
            let width = i64::from(high.wrapping_sub(low) as u32);
            self.ins()
                .icmp_imm_u(IntCC::UnsignedGreaterThan, position, width)
        };
        self.fail_if(outside, kind, site);
    }

    /// Returns the status if it is an error.
    pub(super) fn propagate_failure(&mut self, status: Value) {
        let cold = *self.failed_call.get_or_insert_with(|| {
            let block = self.builder.create_block();
            self.builder.append_block_param(block, I64);
            self.builder.set_cold_block(block);
            block
        });
        let failed = self.ins().icmp_imm_s(IntCC::SignedLessThan, status, 0);
        let next = self.builder.create_block();
        self.ins().brif(failed, cold, &[status.into()], next, &[]);
        self.builder.switch_to_block(next);
    }

    pub(super) fn write_failures(&mut self) {
        for (SiteId(site), block, next) in std::mem::take(&mut self.wraps) {
            self.builder.switch_to_block(block);
            // Without a call, which would make the hot path save registers.
            let offset = offset_of!(NativeContext<'static>, wrapped) as i32;
            let (flags, context) = (MemFlagsData::trusted(), self.context);
            let first = self.ins().load(I32, flags, context, offset);
            let site = self.integer(site as i32);
            let first = self.ins().umin(first, site);
            self.ins().store(flags, first, context, offset);
            self.ins().jump(next, &[]);
        }
        for (status, block) in std::mem::take(&mut self.failures) {
            self.builder.switch_to_block(block);
            let status = self.ins().iconst(I64, status);
            self.return_status(status);
        }
        if let Some(block) = self.failed_call {
            self.builder.switch_to_block(block);
            let status = self.builder.block_params(block)[0];
            self.return_status(status);
        }
    }

    /// The cold block that returns this error.
    pub(super) fn failure(&mut self, kind: RunTimeErrorKind, site: SiteId) -> NativeBlock {
        let status = failure_status(kind, site);
        // The checks of one instruction follow each other, so that the block is mostly among the
        // last.
        let known = self
            .failures
            .iter()
            .rev()
            .find(|(known, _)| *known == status);
        if let Some(&(_, block)) = known {
            return block;
        }
        let block = self.builder.create_block();
        self.builder.set_cold_block(block);
        self.failures.push((status, block));
        block
    }

    /// Handles a result of integer arithmetic that does not fit: notes it and continues, or fails.
    pub(super) fn overflow_if(&mut self, condition: Value, site: SiteId) {
        if self.overflow == Overflow::Error {
            self.fail_if(condition, RunTimeErrorKind::Overflow, site);
            return;
        }
        let (cold, next) = (self.builder.create_block(), self.builder.create_block());
        self.builder.set_cold_block(cold);
        self.wraps.push((site, cold, next));
        self.ins().brif(condition, cold, &[], next, &[]);
        self.builder.switch_to_block(next);
    }

    pub(super) fn fail_if(&mut self, condition: Value, kind: RunTimeErrorKind, site: SiteId) {
        let (cold, next) = (self.failure(kind, site), self.builder.create_block());
        self.ins().brif(condition, cold, &[], next, &[]);
        self.builder.switch_to_block(next);
    }

    pub(super) fn fail_unless(&mut self, condition: Value, kind: RunTimeErrorKind, site: SiteId) {
        let (cold, next) = (self.failure(kind, site), self.builder.create_block());
        self.ins().brif(condition, next, &[], cold, &[]);
        self.builder.switch_to_block(next);
    }
}

//! Random numbers in native code.
//!
//! The uniform ones, which runs draw all the time, are taken from the numbers of the stream here
//! as long as there are some that were made before; all else is called back.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::types::{F64, I64};
use cranelift_codegen::ir::{InstBuilder, Value};

use crate::builtins::{MOST_PARAMETERS, STREAM_BUFFER, STREAM_BUFFERED, STREAM_POSITION};
use crate::exec::jit::runtime;
use crate::ir::{Address, Distribution, Register, RunTimeErrorKind, SiteId};

use super::{MODEL_MEMORY, Translator};

/// The places of distributions that runs draw from all the time.
const UNIFORM: usize = place_of(Distribution::Uniform);
const EXPONENTIAL: usize = place_of(Distribution::Exponential);
const BELOW: usize = place_of(Distribution::Below);

const fn place_of(distribution: Distribution) -> usize {
    let mut place = 0;
    while Distribution::ALL[place] as u8 != distribution as u8 {
        place += 1;
    }
    place
}

impl Translator<'_> {
    pub(super) fn draw(
        &mut self,
        distribution: Distribution,
        arguments: &[Register],
        stream: Address,
        site: SiteId,
    ) -> Value {
        let stream = self.pointer(stream);
        let mut values = vec![stream];
        for index in 0..MOST_PARAMETERS {
            values.push(match arguments.get(index) {
                Some(&argument) => self.get(argument),
                None => self.builder.ins().f64const(0.0),
            });
        }
        let value = match distribution {
            Distribution::Uniform => self.uniform(stream, values[1]),
            Distribution::Exponential => {
                self.draw_one(runtime::draw_one::<EXPONENTIAL> as *const (), &values)
            }
            Distribution::Below => self.draw_one(runtime::draw_one::<BELOW> as *const (), &values),
            _ => {
                let number = Distribution::ALL
                    .iter()
                    .position(|&one| one == distribution);
                let number = number.expect("the list has every distribution");
                let number = self.integer(number as i32);
                values.insert(1, number);
                let code = runtime::draw as *const () as usize;
                self.call_back(code, Some(F64), &values)
            }
        };
        let is_none = self.builder.ins().fcmp(FloatCC::Unordered, value, value);
        self.fail_if(is_none, RunTimeErrorKind::Parameter(distribution), site);
        value
    }

    /// Calls back what draws from a distribution of one parameter.
    fn draw_one(&mut self, code: *const (), values: &[Value]) -> Value {
        self.call_back(code as usize, Some(F64), &values[..2])
    }

    /// A uniform number below `max`, as [`Distribution::sample`] draws it.
    fn uniform(&mut self, stream: Value, max: Value) -> Value {
        let word = |place: usize| 4 * place as i32;
        let ins = self.builder.ins();
        let position = ins.load(I64, MODEL_MEMORY, stream, word(STREAM_POSITION));
        let within = (STREAM_BUFFERED - 1) as i64;
        let place = self.builder.ins().band_imm_s(position, within);
        // The first number of the buffer is the one that fills it.
        let is_there = self.builder.ins().icmp_imm_s(IntCC::NotEqual, place, 0);
        let size = self.builder.ins().fabs(max);
        let infinity = self.builder.ins().f64const(f64::INFINITY);
        let is_finite = self.builder.ins().fcmp(FloatCC::LessThan, size, infinity);
        let is_fast = self.builder.ins().band(is_there, is_finite);
        let (fast, slow, next) = (
            self.builder.create_block(),
            self.builder.create_block(),
            self.builder.create_block(),
        );
        self.builder.append_block_param(next, F64);
        self.builder.set_cold_block(slow);
        self.builder.ins().brif(is_fast, fast, &[], slow, &[]);
        self.builder.switch_to_block(fast);
        let bytes = self.builder.ins().ishl_imm_u(place, 3);
        let base = self.builder.ins().iadd(stream, bytes);
        let ins = self.builder.ins();
        let bits = ins.load(I64, MODEL_MEMORY, base, word(STREAM_BUFFER));
        let after = self.builder.ins().iadd_imm_s(position, 1);
        let ins = self.builder.ins();
        ins.store(MODEL_MEMORY, after, stream, word(STREAM_POSITION));
        let bits = self.builder.ins().ushr_imm_u(bits, 11);
        let whole = self.builder.ins().fcvt_from_sint(F64, bits);
        let scale = self.builder.ins().f64const(1.0 / (1_u64 << 53) as f64);
        let part = self.builder.ins().fmul(whole, scale);
        let value = self.builder.ins().fmul(max, part);
        // The sum is the same number, but never the negative 0.
        let zero = self.builder.ins().f64const(0.0);
        let value = self.builder.ins().fadd(value, zero);
        self.builder.ins().jump(next, &[value.into()]);
        self.builder.switch_to_block(slow);
        let value = self.draw_one(runtime::draw_one::<UNIFORM> as *const (), &[stream, max]);
        self.builder.ins().jump(next, &[value.into()]);
        self.builder.switch_to_block(next);
        self.builder.block_params(next)[0]
    }
}

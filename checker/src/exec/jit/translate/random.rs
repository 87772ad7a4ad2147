//! Random numbers in native code.
//!
//! The uniform and the exponential ones, which runs draw all the time, are taken here from the
//! numbers of the stream. Where none is left, a call makes the next ones. All else is called back.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::{F64, I64};
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value};

use crate::builtins::{
    LAYERS, LOW_BITS, MOST_PARAMETERS, STREAM_BUFFER, STREAM_BUFFERED, STREAM_NEXT,
    STREAM_NEXT_WHOLE, STREAM_POSITION, exponential_edges,
};
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

/// The bytes before a place of a stream.
fn word(place: usize) -> i32 {
    4 * place as i32
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
                None => self.ins().f64const(0.0),
            });
        }
        let code = match distribution {
            Distribution::Uniform => return self.uniform(stream, values[1], site),
            Distribution::Exponential => return self.exponential(stream, values[1], site),
            Distribution::Below => {
                values.truncate(2);
                runtime::draw_one::<BELOW> as *const ()
            }
            _ => {
                let number = Distribution::ALL
                    .iter()
                    .position(|&one| one == distribution);
                let number = number.expect("the list has every distribution");
                let number = self.integer(number as i32);
                values.insert(1, number);
                runtime::draw as *const ()
            }
        };
        self.draw_elsewhere(distribution, code, &values, site)
    }

    /// Calls back what draws; fails if an argument is out of its domain.
    fn draw_elsewhere(
        &mut self,
        distribution: Distribution,
        code: *const (),
        values: &[Value],
        site: SiteId,
    ) -> Value {
        let value = self.call_back(code as usize, Some(F64), values);
        let is_none = self.ins().fcmp(FloatCC::Unordered, value, value);
        self.fail_if(is_none, RunTimeErrorKind::Parameter(distribution), site);
        value
    }

    /// A uniform number below `max`, as [`Distribution::sample`] draws it.
    fn uniform(&mut self, stream: Value, max: Value, site: SiteId) -> Value {
        let position = self.next_number(stream);
        let is_finite = match self.double(max) {
            Some(max) if max.is_finite() => None,
            _ => {
                let size = self.ins().fabs(max);
                let infinity = self.ins().f64const(f64::INFINITY);
                Some(self.ins().fcmp(FloatCC::LessThan, size, infinity))
            }
        };
        let ins = self.ins();
        let whole = ins.load(F64, MODEL_MEMORY, stream, word(STREAM_NEXT_WHOLE));
        let scale = 1.0 / (1_u64 << f64::MANTISSA_DIGITS) as f64;
        let value = match self.double(max) {
            // One multiplication rounds as two do where one of them is exact.
            Some(max) if max * scale >= f64::MIN_POSITIVE => {
                let unit = self.ins().f64const(max * scale);
                self.ins().fmul(whole, unit)
            }
            _ => {
                let scale = self.ins().f64const(scale);
                let part = self.ins().fmul(whole, scale);
                let value = self.ins().fmul(max, part);
                // The sum is the same number, but never the negative 0.
                let zero = self.ins().f64const(0.0);
                self.ins().fadd(value, zero)
            }
        };
        self.take_if(is_finite, stream, position, value, |this| {
            let code = runtime::draw_one::<UNIFORM> as *const ();
            this.draw_elsewhere(Distribution::Uniform, code, &[stream, max], site)
        })
    }

    /// An exponential number with this rate, as [`Distribution::sample`] draws it.
    fn exponential(&mut self, stream: Value, rate: Value, site: SiteId) -> Value {
        let position = self.next_number(stream);
        let (mean, is_rate) = match self.double(rate) {
            Some(rate) if rate > 0.0 && rate.is_finite() => (self.ins().f64const(1.0 / rate), None),
            _ => {
                let (zero, infinity) = (0.0, f64::INFINITY);
                let [zero, infinity] = [zero, infinity].map(|it| self.ins().f64const(it));
                let is_positive = self.ins().fcmp(FloatCC::GreaterThan, rate, zero);
                let is_finite = self.ins().fcmp(FloatCC::LessThan, rate, infinity);
                let is_rate = self.ins().band(is_positive, is_finite);
                let one = self.ins().f64const(1.0);
                (self.ins().fdiv(one, rate), Some(is_rate))
            }
        };
        let ins = self.ins();
        let bits = ins.load(I64, MODEL_MEMORY, stream, word(STREAM_NEXT));
        // The low bits choose a layer of the ziggurat, the high ones a place in it.
        let layer = self.ins().band_imm_s(bits, LAYERS as i64 - 1);
        let layer = self.ins().ishl_imm_u(layer, 3);
        let high = self.ins().ushr_imm_u(bits, 12);
        let one = self.ins().iconst(I64, 1.0_f64.to_bits() as i64);
        let from_one = self.ins().bor(high, one);
        let from_one = self.ins().bitcast(F64, MemFlagsData::new(), from_one);
        let almost_one = self.ins().f64const(1.0 - f64::EPSILON / 2.0);
        let part = self.ins().fsub(from_one, almost_one);
        let edges = exponential_edges().as_ptr() as i64;
        let edges = self.ins().iconst(I64, edges);
        let edges = self.ins().iadd(edges, layer);
        let ins = self.ins();
        let edge = ins.load(F64, MODEL_MEMORY, edges, 0);
        let ins = self.ins();
        let next_edge = ins.load(F64, MODEL_MEMORY, edges, 8);
        let drawn = self.ins().fmul(part, edge);
        let is_inside = self.ins().fcmp(FloatCC::LessThan, drawn, next_edge);
        let is_known = match is_rate {
            None => is_inside,
            Some(is_rate) => self.ins().band(is_rate, is_inside),
        };
        let value = self.ins().fmul(drawn, mean);
        self.take_if(Some(is_known), stream, position, value, |this| {
            let code = runtime::draw_one::<EXPONENTIAL> as *const ();
            this.draw_elsewhere(Distribution::Exponential, code, &[stream, rate], site)
        })
    }

    /// Makes sure that there is a next number of a stream; returns how many were drawn before.
    fn next_number(&mut self, stream: Value) -> Value {
        let ins = self.ins();
        let position = ins.load(I64, MODEL_MEMORY, stream, word(STREAM_POSITION));
        let place = self.place_in_buffer(position);
        // Whoever takes the first number of the buffer fills it before.
        let (empty, full) = (self.builder.create_block(), self.builder.create_block());
        self.builder.set_cold_block(empty);
        self.ins().brif(place, full, &[], empty, &[]);
        self.builder.switch_to_block(empty);
        self.call_back(runtime::fill as *const () as usize, None, &[stream]);
        self.ins().jump(full, &[]);
        self.builder.switch_to_block(full);
        position
    }

    fn place_in_buffer(&mut self, position: Value) -> Value {
        let within = (STREAM_BUFFERED - 1) as i64;
        self.ins().band_imm_s(position, within)
    }

    /// Takes the next number of a stream, and reads the one behind it: whoever draws that one need
    /// not wait for its place.
    fn take(&mut self, stream: Value, position: Value) {
        let after = self.ins().iadd_imm_s(position, 1);
        let ins = self.ins();
        ins.store(MODEL_MEMORY, after, stream, word(STREAM_POSITION));
        let place = self.place_in_buffer(after);
        let bytes = self.ins().ishl_imm_u(place, 3);
        let base = self.ins().iadd(stream, bytes);
        let ins = self.ins();
        let bits = ins.load(I64, MODEL_MEMORY, base, word(STREAM_BUFFER));
        let ins = self.ins();
        ins.store(MODEL_MEMORY, bits, stream, word(STREAM_NEXT));
        let whole = self.ins().ushr_imm_u(bits, i64::from(LOW_BITS));
        let whole = self.ins().fcvt_from_sint(F64, whole);
        let ins = self.ins();
        ins.store(MODEL_MEMORY, whole, stream, word(STREAM_NEXT_WHOLE));
    }

    /// Takes the next number of a stream with the value that was made of it, if the condition
    /// holds; else the value is drawn elsewhere. Without a condition it always holds.
    fn take_if(
        &mut self,
        condition: Option<Value>,
        stream: Value,
        position: Value,
        value: Value,
        elsewhere: impl FnOnce(&mut Self) -> Value,
    ) -> Value {
        let Some(condition) = condition else {
            self.take(stream, position);
            return value;
        };
        let (known, unknown, done) = (
            self.builder.create_block(),
            self.builder.create_block(),
            self.builder.create_block(),
        );
        self.builder.append_block_param(done, F64);
        self.builder.set_cold_block(unknown);
        self.ins().brif(condition, known, &[], unknown, &[]);
        self.builder.switch_to_block(known);
        self.take(stream, position);
        self.ins().jump(done, &[value.into()]);
        self.builder.switch_to_block(unknown);
        let value = elsewhere(self);
        self.ins().jump(done, &[value.into()]);
        self.builder.switch_to_block(done);
        self.builder.block_params(done)[0]
    }
}

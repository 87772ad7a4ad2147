//! What compiled code and the engine share: the context that every compiled function gets, how it
//! says what went wrong, and the functions that it calls back.
//!
//! The status of a call is 64 bits: negative for a run-time error (its kind and site in the lower
//! bits), else the integer that the function returned, or 0. A double or an address is returned as
//! a second value.

use crate::builtins::{IntegerResult, MOST_PARAMETERS};
use crate::cancellation;
use crate::exec::executor::ROUNDS_BETWEEN_LOOKS;
use crate::exec::external_words::{ExternalWords, ends_text};
use crate::exec::{Context, EmittedAssignment, ROUND_LIMIT, RunTimeError, Wraps, arithmetic};
use crate::ir::{
    ClockId, Distribution, ExternalParameter, FixedConstraint, RunTimeErrorKind, STREAM_WORDS,
    SiteId, Stream,
};

use super::external::External;

/// The first argument of every compiled function. Compiled code reads and writes `rounds_left` and
/// reads `constants`.
#[derive(Debug)]
#[repr(C)]
pub(super) struct NativeContext<'call> {
    /// How many rounds of loops this call may still take before it asks for more ([`more_rounds`]).
    pub(super) rounds_left: u64,
    /// The constant memory.
    pub(super) constants: *const i32,
    /// The two vectors are apart: side by side they would be copied as one value right after they
    /// were written as two, which a processor waits for.
    constraints: &'call mut Vec<FixedConstraint>,
    /// How many rounds it may take beyond these.
    rounds_beyond: u64,
    /// The first site where a result wrapped round in this call, or [`Wraps::NOWHERE`]. Compiled
    /// code writes it.
    pub(super) wrapped: u32,
    assignments: &'call mut Vec<EmittedAssignment>,
}

impl<'call> NativeContext<'call> {
    /// The context of a call. The state's words are passed separately.
    #[inline]
    pub(super) fn new(
        constants: &[i32],
        context: &'call mut Context<'_>,
    ) -> (NativeContext<'call>, &'call mut [i32]) {
        let native = NativeContext {
            rounds_left: ROUNDS_BETWEEN_LOOKS,
            rounds_beyond: ROUND_LIMIT - ROUNDS_BETWEEN_LOOKS,
            wrapped: Wraps::NOWHERE,
            constants: constants.as_ptr(),
            constraints: context.constraints,
            assignments: context.assignments,
        };
        (native, context.state)
    }
}

/// The kinds of errors but for [`RunTimeErrorKind::Parameter`].
const KINDS: [RunTimeErrorKind; 13] = [
    RunTimeErrorKind::Overflow,
    RunTimeErrorKind::DivisionByZero,
    RunTimeErrorKind::ShiftDistance,
    RunTimeErrorKind::NegativeExponent,
    RunTimeErrorKind::OutOfRange,
    RunTimeErrorKind::IndexOutOfBounds,
    RunTimeErrorKind::NotAnInteger,
    RunTimeErrorKind::NotLoaded,
    RunTimeErrorKind::NoRoom,
    RunTimeErrorKind::ClockValue,
    RunTimeErrorKind::AssertionFailed,
    RunTimeErrorKind::StepLimit,
    RunTimeErrorKind::Interrupted,
];

/// All kinds of errors, in the order of their numbers in a status.
fn kinds() -> impl Iterator<Item = RunTimeErrorKind> {
    let parameters = Distribution::ALL.iter().copied();
    KINDS
        .into_iter()
        .chain(parameters.map(RunTimeErrorKind::Parameter))
}

/// The status of a failed call.
pub(super) fn failure_status(kind: RunTimeErrorKind, SiteId(site): SiteId) -> i64 {
    let index = kinds().position(|known| known == kind);
    let index = index.expect("the table lists every kind") as i64;
    i64::MIN | index << 32 | i64::from(site)
}

/// The result of a call by its status.
#[inline]
pub(super) fn result_of_status(status: i64) -> Result<i32, RunTimeError> {
    if status >= 0 {
        return Ok(status as i32);
    }
    Err(error_of_status(status))
}

#[cold]
fn error_of_status(status: i64) -> RunTimeError {
    let kind = kinds().nth((status >> 32 & 0xff) as usize);
    RunTimeError {
        kind: kind.expect("a status has the number of a kind"),
        site: SiteId(status as u32),
    }
}

/// Lets a call take more rounds of loops; returns its status, an error if it must end here.
pub(super) extern "C" fn more_rounds(context: &mut NativeContext<'_>, site: u32) -> i64 {
    if context.rounds_beyond == 0 {
        return failure_status(RunTimeErrorKind::StepLimit, SiteId(site));
    }
    if cancellation::is_due() {
        return failure_status(RunTimeErrorKind::Interrupted, SiteId(site));
    }
    context.rounds_left = context.rounds_beyond.min(ROUNDS_BETWEEN_LOOKS);
    context.rounds_beyond -= context.rounds_left;
    0
}

/// `base ** exponent`; the exponent is not negative.
pub(super) extern "C" fn power(base: i32, exponent: i32) -> IntegerResult {
    arithmetic::power(base, exponent).map_or(IntegerResult::NONE, |(power, has_wrapped)| {
        IntegerResult::new(power, has_wrapped)
    })
}

/// Makes the next numbers of a stream that has none left.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn fill(stream: *mut i32) {
    // SAFETY: as in [`draw_one`].
    let words = unsafe { std::slice::from_raw_parts_mut(stream, STREAM_WORDS) };
    Stream::of(words).fill();
}

/// Draws a random number of one distribution, by its place in [`Distribution::ALL`]: as [`draw`]
/// does, and faster.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn draw_one<const DISTRIBUTION: usize>(
    stream: *mut i32,
    argument: f64,
) -> f64 {
    // SAFETY: compiled code passes the place of the words of a stream, whose index was checked, and
    // nothing else uses them during the call.
    let words = unsafe { std::slice::from_raw_parts_mut(stream, STREAM_WORDS) };
    let distribution = const { Distribution::ALL[DISTRIBUTION] };
    let value = distribution.sample(&mut Stream::of(words), &[argument]);
    value.unwrap_or(f64::NAN)
}

/// Draws a random number; a NaN if an argument is out of its domain. The arguments are as many as
/// the distribution takes, and further ones of no meaning.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn draw(
    stream: *mut i32,
    distribution: u32,
    first: f64,
    second: f64,
    third: f64,
) -> f64 {
    // SAFETY: compiled code passes the place of the words of a stream, whose index was checked, and
    // nothing else uses them during the call.
    let words = unsafe { std::slice::from_raw_parts_mut(stream, STREAM_WORDS) };
    let distribution = Distribution::ALL[distribution as usize];
    let arguments: [f64; MOST_PARAMETERS] = [first, second, third];
    let value = distribution.sample(&mut Stream::of(words), &arguments[..distribution.arity()]);
    value.unwrap_or(f64::NAN)
}

/// Emits a clock constraint.
pub(super) extern "C" fn emit_constraint(
    context: &mut NativeContext<'_>,
    left: u32,
    right: u32,
    bound: i32,
    strict: i32,
) {
    context.constraints.push(FixedConstraint {
        left: ClockId(left),
        right: ClockId(right),
        bound,
        strict: strict != 0,
    });
}

/// Emits a clock assignment.
pub(super) extern "C" fn emit_assignment(
    context: &mut NativeContext<'_>,
    target: u32,
    source: u32,
    value: i32,
) {
    context.assignments.push(EmittedAssignment {
        target: ClockId(target),
        source: ClockId(source),
        value,
    });
}

/// Sets words to 0.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn zero_words(target: *mut i32, words: u64) {
    // SAFETY: compiled code passes the frame of a function, which has this number of words.
    unsafe { target.write_bytes(0, words as usize) }
}

/// Copies words between ranges that are the same or disjoint.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn copy_words(target: *mut i32, source: *const i32, words: u64) {
    // SAFETY: compiled code passes places of arrays or structs with this number of words, whose
    // indices were checked; `copy` allows the two to be the same.
    unsafe { target.copy_from(source, words as usize) }
}

/// Whether two ranges of words are the same: 0 or 1.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn equal_words(
    left: *const i32,
    right: *const i32,
    words: u64,
) -> i32 {
    // SAFETY: compiled code passes places of arrays or structs with this number of words, whose
    // indices were checked, and nothing writes during the comparison.
    let (left, right) = unsafe {
        (
            std::slice::from_raw_parts(left, words as usize),
            std::slice::from_raw_parts(right, words as usize),
        )
    };
    (left == right).into()
}

/// Calls a function of a library. The arguments are words: values, or the addresses of words of the
/// model. Returns a status; the result is left at its address.
#[expect(unsafe_code, reason = "compiled code passes raw addresses")]
pub(super) unsafe extern "C" fn call_external(
    external: *const External,
    arguments: *const u64,
    result: *mut u64,
    site: u32,
) -> i64 {
    // SAFETY: compiled code passes the address of an `External`, which lives for ever, and those of
    // two places on its stack: the arguments, as many as the signature has parameters, and the
    // result.
    let (external, arguments) = unsafe {
        let external = &*external;
        let count = external.signature().parameters.len();
        (external, std::slice::from_raw_parts(arguments, count))
    };
    let parameters = &external.signature().parameters;
    let read = |(&argument, parameter): (&u64, &ExternalParameter)| match parameter.memory() {
        None => ExternalWords::Value(argument),
        Some((words, _)) => {
            let source = argument as *const i32;
            let count = if *parameter == ExternalParameter::Text {
                // SAFETY: a text lies in constant memory, up to a word that ends it.
                let ends = |&word: &usize| ends_text(unsafe { source.add(word).read() });
                (0..usize::MAX).find(ends).map_or(0, |last| last + 1)
            } else {
                words as usize
            };
            // SAFETY: the place was checked to have the words of the signature, and nothing writes
            // them while they are copied.
            ExternalWords::Memory(unsafe { std::slice::from_raw_parts(source, count) }.to_vec())
        }
    };
    let mut given: Vec<ExternalWords> = arguments.iter().zip(parameters).map(read).collect();
    match external.call(&mut given) {
        Err(kind) => failure_status(kind, SiteId(site)),
        Ok(value) => {
            for ((words, &argument), parameter) in given.iter().zip(arguments).zip(parameters) {
                if let (ExternalWords::Memory(words), Some((_, true))) = (words, parameter.memory())
                {
                    let target = argument as *mut i32;
                    // SAFETY: the same words as above, which the function may change.
                    unsafe { target.copy_from(words.as_ptr(), words.len()) }
                }
            }
            // SAFETY: the place of the result is on the stack of the caller.
            unsafe { result.write(value) }
            0
        }
    }
}

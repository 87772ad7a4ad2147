//! What the built-in functions compute.
//!
//! Interpretation, constant folding and compiled code call the same machine code: mostly the
//! platform's C library itself, whose results may differ in the last bit from those of other
//! libraries, so that no two engines may use different ones. Rust's standard library has no `erf`,
//! `logb` or `ldexp`, and its `asinh` is its own; so they are declared at the end.
//!
//! Two functions see the sign of a NaN, which IEEE arithmetic leaves open: `signbit` and the second
//! argument of `copysign`. Here every NaN counts as positive there.

use super::integer_result::IntegerResult;

/// The squares of whole numbers up to this one are exact in doubles.
const WHOLE_ROOT: f64 = 67_108_864.0;

/// The value, with one NaN for all: the IEEE leaves sign and payload of a NaN open, processors and
/// compilers differ in them, and they must not leak into states.
#[inline]
pub(crate) fn canonical(value: f64) -> f64 {
    if value.is_nan() { f64::NAN } else { value }
}

/// The absolute value; that of -2^31 wraps round to itself.
pub(super) extern "C" fn absolute(value: i32) -> IntegerResult {
    let (value, has_wrapped) = value.overflowing_abs();
    IntegerResult::new(value, has_wrapped)
}

/// The binary exponent of a number other than 0.
pub(super) extern "C" fn ilogb(value: f64) -> IntegerResult {
    if value == 0.0 || !value.is_finite() {
        return IntegerResult::NONE;
    }
    IntegerResult::new(c::ilogb(value), false)
}

pub(super) extern "C" fn copysign(magnitude: f64, sign: f64) -> f64 {
    magnitude.copysign(canonical(sign))
}

/// Distances of points are sums of squares. That of a whole number is exact as a product, and what
/// is exact the library gives too, but takes ten times as long for it.
pub(super) extern "C" fn pow(base: f64, exponent: f64) -> f64 {
    if exponent - 2.0 == 0.0 && base.abs() <= WHOLE_ROOT {
        // Asking for the part behind the point would be a call of the library again.
        let whole = f64::from(base as i32);
        if whole - base == 0.0 {
            return base * base;
        }
    }
    c::pow(base, exponent)
}

pub(super) extern "C" fn is_finite(value: f64) -> i32 {
    value.is_finite().into()
}

pub(super) extern "C" fn is_infinite(value: f64) -> i32 {
    value.is_infinite().into()
}

pub(super) extern "C" fn is_nan(value: f64) -> i32 {
    value.is_nan().into()
}

pub(super) extern "C" fn is_normal(value: f64) -> i32 {
    value.is_normal().into()
}

pub(super) extern "C" fn sign_bit(value: f64) -> i32 {
    canonical(value).is_sign_negative().into()
}

/// The C library. Its functions take and give plain numbers and touch no memory of the caller (but
/// for `errno`, and `signgam` of `lgamma`, which nobody here reads), so that calling them is safe.
#[expect(
    unsafe_code,
    reason = "declaring functions of the C library is the only way to call them"
)]
pub(super) mod c {
    // SAFETY: these are the declarations of `math.h`.
    unsafe extern "C" {
        pub(in crate::builtins) safe fn fabs(x: f64) -> f64;
        pub(in crate::builtins) safe fn exp(x: f64) -> f64;
        pub(in crate::builtins) safe fn exp2(x: f64) -> f64;
        pub(in crate::builtins) safe fn expm1(x: f64) -> f64;
        pub(in crate::builtins) safe fn log(x: f64) -> f64;
        pub(in crate::builtins) safe fn log10(x: f64) -> f64;
        pub(in crate::builtins) safe fn log2(x: f64) -> f64;
        pub(in crate::builtins) safe fn log1p(x: f64) -> f64;
        pub(in crate::builtins) safe fn sqrt(x: f64) -> f64;
        pub(in crate::builtins) safe fn cbrt(x: f64) -> f64;
        pub(in crate::builtins) safe fn sin(x: f64) -> f64;
        pub(in crate::builtins) safe fn cos(x: f64) -> f64;
        pub(in crate::builtins) safe fn tan(x: f64) -> f64;
        pub(in crate::builtins) safe fn asin(x: f64) -> f64;
        pub(in crate::builtins) safe fn acos(x: f64) -> f64;
        pub(in crate::builtins) safe fn atan(x: f64) -> f64;
        pub(in crate::builtins) safe fn sinh(x: f64) -> f64;
        pub(in crate::builtins) safe fn cosh(x: f64) -> f64;
        pub(in crate::builtins) safe fn tanh(x: f64) -> f64;
        pub(in crate::builtins) safe fn asinh(x: f64) -> f64;
        pub(in crate::builtins) safe fn acosh(x: f64) -> f64;
        pub(in crate::builtins) safe fn atanh(x: f64) -> f64;
        pub(in crate::builtins) safe fn erf(x: f64) -> f64;
        pub(in crate::builtins) safe fn erfc(x: f64) -> f64;
        pub(in crate::builtins) safe fn tgamma(x: f64) -> f64;
        pub(in crate::builtins) safe fn lgamma(x: f64) -> f64;
        pub(in crate::builtins) safe fn ceil(x: f64) -> f64;
        pub(in crate::builtins) safe fn floor(x: f64) -> f64;
        pub(in crate::builtins) safe fn trunc(x: f64) -> f64;
        pub(in crate::builtins) safe fn round(x: f64) -> f64;
        pub(in crate::builtins) safe fn logb(x: f64) -> f64;
        pub(in crate::builtins) safe fn ilogb(x: f64) -> i32;
        pub(in crate::builtins) safe fn fmod(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn fmax(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn fmin(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn fdim(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn pow(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn hypot(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn atan2(y: f64, x: f64) -> f64;
        pub(in crate::builtins) safe fn nextafter(x: f64, y: f64) -> f64;
        pub(in crate::builtins) safe fn ldexp(x: f64, exponent: i32) -> f64;
        pub(in crate::builtins) safe fn fma(x: f64, y: f64, z: f64) -> f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_those_of_the_library() {
        let whole = (0..60).flat_map(|bit| [-1.0, 0.0, 1.0].map(|one| 2f64.powi(bit) + one));
        let bases = whole.flat_map(|base| [base, -base, base + 0.5, 1.0 / base]);
        for base in bases.chain([-0.0, f64::INFINITY, f64::MIN_POSITIVE, f64::NAN]) {
            for exponent in [2.0, 3.0, -2.0] {
                let expected = c::pow(base, exponent).to_bits();
                let given = pow(base, exponent).to_bits();
                assert_eq!(given, expected, "{base} to the power of {exponent}");
            }
        }
    }
}

//! The functions of the mathematical library, for interpretation, constant folding and compiled
//! code alike.
//!
//! All three call the very same machine code: mostly the platform's C library itself, whose results
//! may differ in the last bit from those of other libraries, so that no two engines may use
//! different ones. Rust's standard library has no `erf`, `logb` or `ldexp`, and its `asinh` is its
//! own; hence the declarations at the end.
//!
//! Two functions see the sign of a NaN, which IEEE arithmetic leaves open: `signbit` and the second
//! argument of `copysign`. Here every NaN counts as positive there.

use crate::ir::{MathFunction, RunTimeErrorKind};

use super::arithmetic::canonical;

/// The squares of whole numbers up to this one are exact in doubles.
const WHOLE_ROOT: f64 = 67_108_864.0;

/// A function by the types of its parameters and result.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MathCode {
    /// int → int, the absolute value; fails for `-2^31`.
    Abs,
    /// double → int; fails where there is no integer result.
    Ilogb,
    /// double → double
    Unary(extern "C" fn(f64) -> f64),
    /// double, double → double
    Binary(extern "C" fn(f64, f64) -> f64),
    /// double, int → double
    Scale(extern "C" fn(f64, i32) -> f64),
    /// double, double, double → double
    Ternary(extern "C" fn(f64, f64, f64) -> f64),
    /// double → 0 or 1
    Classify(extern "C" fn(f64) -> i32),
}

/// The code of a function.
pub(crate) fn code_of(function: MathFunction) -> MathCode {
    match function {
        MathFunction::Abs => MathCode::Abs,
        MathFunction::Ilogb => MathCode::Ilogb,
        MathFunction::Ldexp => MathCode::Scale(library::ldexp),
        MathFunction::Fma => MathCode::Ternary(library::fma),
        _ => unary_code(function)
            .map(MathCode::Unary)
            .or_else(|| binary_code(function).map(MathCode::Binary))
            .or_else(|| classify_code(function).map(MathCode::Classify))
            .expect("every function is in one of the tables"),
    }
}

/// The binary exponent of a number other than 0.
pub(crate) fn ilogb(value: f64) -> Result<i32, RunTimeErrorKind> {
    if value == 0.0 || !value.is_finite() {
        return Err(RunTimeErrorKind::NotAnInteger);
    }
    Ok(library::ilogb(value))
}

fn unary_code(function: MathFunction) -> Option<extern "C" fn(f64) -> f64> {
    Some(match function {
        MathFunction::Fabs => library::fabs,
        MathFunction::Exp => library::exp,
        MathFunction::Exp2 => library::exp2,
        MathFunction::Expm1 => library::expm1,
        MathFunction::Ln => library::log,
        MathFunction::Log | MathFunction::Log10 => library::log10,
        MathFunction::Log2 => library::log2,
        MathFunction::Log1p => library::log1p,
        MathFunction::Sqrt => library::sqrt,
        MathFunction::Cbrt => library::cbrt,
        MathFunction::Sin => library::sin,
        MathFunction::Cos => library::cos,
        MathFunction::Tan => library::tan,
        MathFunction::Asin => library::asin,
        MathFunction::Acos => library::acos,
        MathFunction::Atan => library::atan,
        MathFunction::Sinh => library::sinh,
        MathFunction::Cosh => library::cosh,
        MathFunction::Tanh => library::tanh,
        MathFunction::Asinh => library::asinh,
        MathFunction::Acosh => library::acosh,
        MathFunction::Atanh => library::atanh,
        MathFunction::Erf => library::erf,
        MathFunction::Erfc => library::erfc,
        MathFunction::Tgamma => library::tgamma,
        MathFunction::Lgamma => library::lgamma,
        MathFunction::Ceil => library::ceil,
        MathFunction::Floor => library::floor,
        MathFunction::Trunc => library::trunc,
        MathFunction::Round => library::round,
        MathFunction::Logb => library::logb,
        _ => return None,
    })
}

fn binary_code(function: MathFunction) -> Option<extern "C" fn(f64, f64) -> f64> {
    Some(match function {
        MathFunction::Fmod => library::fmod,
        MathFunction::Fmax => library::fmax,
        MathFunction::Fmin => library::fmin,
        MathFunction::Fdim => library::fdim,
        MathFunction::Pow => pow,
        MathFunction::Hypot => library::hypot,
        MathFunction::Atan2 => library::atan2,
        MathFunction::Nextafter => library::nextafter,
        MathFunction::Copysign => copysign,
        _ => return None,
    })
}

fn classify_code(function: MathFunction) -> Option<extern "C" fn(f64) -> i32> {
    Some(match function {
        MathFunction::IsFinite => is_finite,
        MathFunction::IsInfinite => is_infinite,
        MathFunction::IsNan | MathFunction::IsUnordered => is_nan,
        MathFunction::IsNormal => is_normal,
        MathFunction::SignBit => sign_bit,
        _ => return None,
    })
}

extern "C" fn copysign(magnitude: f64, sign: f64) -> f64 {
    magnitude.copysign(canonical(sign))
}

/// Distances of points are sums of squares. That of a whole number is exact as a product, and what
/// is exact the library gives too, but takes ten times as long for it.
extern "C" fn pow(base: f64, exponent: f64) -> f64 {
    if exponent - 2.0 == 0.0 && base.abs() <= WHOLE_ROOT {
        // Asking for the part behind the point would be a call of the library again.
        let whole = f64::from(base as i32);
        if whole - base == 0.0 {
            return base * base;
        }
    }
    library::pow(base, exponent)
}

extern "C" fn is_finite(value: f64) -> i32 {
    value.is_finite().into()
}

extern "C" fn is_infinite(value: f64) -> i32 {
    value.is_infinite().into()
}

extern "C" fn is_nan(value: f64) -> i32 {
    value.is_nan().into()
}

extern "C" fn is_normal(value: f64) -> i32 {
    value.is_normal().into()
}

extern "C" fn sign_bit(value: f64) -> i32 {
    canonical(value).is_sign_negative().into()
}

/// The C library. Its functions take and give plain numbers and touch no memory of the caller (but
/// for `errno`, and `signgam` of `lgamma`, which nobody here reads), so that calling them is safe.
#[expect(
    unsafe_code,
    reason = "declaring functions of the C library is the only way to call them"
)]
mod library {
    // SAFETY: these are the declarations of `math.h`.
    unsafe extern "C" {
        pub(super) safe fn fabs(x: f64) -> f64;
        pub(super) safe fn exp(x: f64) -> f64;
        pub(super) safe fn exp2(x: f64) -> f64;
        pub(super) safe fn expm1(x: f64) -> f64;
        pub(super) safe fn log(x: f64) -> f64;
        pub(super) safe fn log10(x: f64) -> f64;
        pub(super) safe fn log2(x: f64) -> f64;
        pub(super) safe fn log1p(x: f64) -> f64;
        pub(super) safe fn sqrt(x: f64) -> f64;
        pub(super) safe fn cbrt(x: f64) -> f64;
        pub(super) safe fn sin(x: f64) -> f64;
        pub(super) safe fn cos(x: f64) -> f64;
        pub(super) safe fn tan(x: f64) -> f64;
        pub(super) safe fn asin(x: f64) -> f64;
        pub(super) safe fn acos(x: f64) -> f64;
        pub(super) safe fn atan(x: f64) -> f64;
        pub(super) safe fn sinh(x: f64) -> f64;
        pub(super) safe fn cosh(x: f64) -> f64;
        pub(super) safe fn tanh(x: f64) -> f64;
        pub(super) safe fn asinh(x: f64) -> f64;
        pub(super) safe fn acosh(x: f64) -> f64;
        pub(super) safe fn atanh(x: f64) -> f64;
        pub(super) safe fn erf(x: f64) -> f64;
        pub(super) safe fn erfc(x: f64) -> f64;
        pub(super) safe fn tgamma(x: f64) -> f64;
        pub(super) safe fn lgamma(x: f64) -> f64;
        pub(super) safe fn ceil(x: f64) -> f64;
        pub(super) safe fn floor(x: f64) -> f64;
        pub(super) safe fn trunc(x: f64) -> f64;
        pub(super) safe fn round(x: f64) -> f64;
        pub(super) safe fn logb(x: f64) -> f64;
        pub(super) safe fn ilogb(x: f64) -> i32;
        pub(super) safe fn fmod(x: f64, y: f64) -> f64;
        pub(super) safe fn fmax(x: f64, y: f64) -> f64;
        pub(super) safe fn fmin(x: f64, y: f64) -> f64;
        pub(super) safe fn fdim(x: f64, y: f64) -> f64;
        pub(super) safe fn pow(x: f64, y: f64) -> f64;
        pub(super) safe fn hypot(x: f64, y: f64) -> f64;
        pub(super) safe fn atan2(y: f64, x: f64) -> f64;
        pub(super) safe fn nextafter(x: f64, y: f64) -> f64;
        pub(super) safe fn ldexp(x: f64, exponent: i32) -> f64;
        pub(super) safe fn fma(x: f64, y: f64, z: f64) -> f64;
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
                let expected = library::pow(base, exponent).to_bits();
                let given = pow(base, exponent).to_bits();
                assert_eq!(given, expected, "{base} to the power of {exponent}");
            }
        }
    }
}

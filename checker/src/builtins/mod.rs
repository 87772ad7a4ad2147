//! The functions that the language defines, in one table: name, types and code of each.
//!
//! The parser (which names are taken), the checker (names, types, folding of constants), the
//! interpreter and compiled code all read this table. A new function is one row in
//! the table of [`MathFunction`], and its code in `library.rs`. The kind of its code gives its
//! types, and what may go wrong: only a code that gives an [`IntegerResult`] can wrap round or have
//! no result. The random functions are the table of [`Distribution`].

mod integer_result;
mod library;
mod random;

pub(crate) use integer_result::IntegerResult;
pub(crate) use library::canonical;
pub(crate) use random::{
    BUFFER as STREAM_BUFFER, BUFFERED as STREAM_BUFFERED, LAYERS, LOW_BITS, MOST_PARAMETERS,
    NEXT as STREAM_NEXT, NEXT_WHOLE as STREAM_NEXT_WHOLE, POSITION as STREAM_POSITION,
    exponential_edges,
};
pub use random::{Distribution, STREAM_WORDS, Stream};

use library::c;

/// Code by the types of its parameters and result.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Code {
    /// int → int
    Integer(extern "C" fn(i32) -> IntegerResult),
    /// double → int
    ToInteger(extern "C" fn(f64) -> IntegerResult),
    /// double → 0 or 1
    Classify(extern "C" fn(f64) -> i32),
    /// double → double
    Unary(extern "C" fn(f64) -> f64),
    /// double, double → double
    Binary(extern "C" fn(f64, f64) -> f64),
    /// double, int → double
    Scale(extern "C" fn(f64, i32) -> f64),
    /// double, double, double → double
    Ternary(extern "C" fn(f64, f64, f64) -> f64),
}

macro_rules! math_functions {
    ($($(#[$doc:meta])* $variant:ident $name:literal $kind:ident($code:expr),)*) => {
        /// A function that is computed from its arguments, with the meaning that C gives it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[expect(missing_docs, reason = "the names are those of the language")]
        pub enum MathFunction {
            $($(#[$doc])* $variant,)*
        }

        impl MathFunction {
            /// All of them.
            pub const ALL: &[MathFunction] = &[$(MathFunction::$variant),*];

            /// What computes it.
            pub(crate) fn code(self) -> Code {
                match self {
                    $(MathFunction::$variant => Code::$kind($code),)*
                }
            }

            fn named(name: &str) -> Option<MathFunction> {
                Some(match name {
                    $($name => MathFunction::$variant,)*
                    _ => return None,
                })
            }
        }
    };
}

math_functions! {
    /// `-2^31` wraps round to itself.
    Abs "abs" Integer(library::absolute),
    Fabs "fabs" Unary(c::fabs),
    Exp "exp" Unary(c::exp),
    Exp2 "exp2" Unary(c::exp2),
    Expm1 "expm1" Unary(c::expm1),
    /// The natural logarithm.
    Ln "ln" Unary(c::log),
    /// The logarithm to base 10.
    Log "log" Unary(c::log10),
    Log10 "log10" Unary(c::log10),
    Log2 "log2" Unary(c::log2),
    Log1p "log1p" Unary(c::log1p),
    Sqrt "sqrt" Unary(c::sqrt),
    Cbrt "cbrt" Unary(c::cbrt),
    Sin "sin" Unary(c::sin),
    Cos "cos" Unary(c::cos),
    Tan "tan" Unary(c::tan),
    Asin "asin" Unary(c::asin),
    Acos "acos" Unary(c::acos),
    Atan "atan" Unary(c::atan),
    Sinh "sinh" Unary(c::sinh),
    Cosh "cosh" Unary(c::cosh),
    Tanh "tanh" Unary(c::tanh),
    Asinh "asinh" Unary(c::asinh),
    Acosh "acosh" Unary(c::acosh),
    Atanh "atanh" Unary(c::atanh),
    Erf "erf" Unary(c::erf),
    Erfc "erfc" Unary(c::erfc),
    Tgamma "tgamma" Unary(c::tgamma),
    Lgamma "lgamma" Unary(c::lgamma),
    Ceil "ceil" Unary(c::ceil),
    Floor "floor" Unary(c::floor),
    Trunc "trunc" Unary(c::trunc),
    Round "round" Unary(c::round),
    Logb "logb" Unary(c::logb),
    /// There is no result where the C function gives no exponent.
    Ilogb "ilogb" ToInteger(library::ilogb),
    Fmod "fmod" Binary(c::fmod),
    Fmax "fmax" Binary(c::fmax),
    Fmin "fmin" Binary(c::fmin),
    Fdim "fdim" Binary(c::fdim),
    Pow "pow" Binary(library::pow),
    Hypot "hypot" Binary(c::hypot),
    Atan2 "atan2" Binary(c::atan2),
    Nextafter "nextafter" Binary(c::nextafter),
    Copysign "copysign" Binary(library::copysign),
    Ldexp "ldexp" Scale(c::ldexp),
    Fma "fma" Ternary(c::fma),
    IsFinite "isfinite" Classify(library::is_finite),
    IsInfinite "isinf" Classify(library::is_infinite),
    IsNan "isnan" Classify(library::is_nan),
    IsNormal "isnormal" Classify(library::is_normal),
    SignBit "signbit" Classify(library::sign_bit),
    IsUnordered "isunordered" Classify(library::is_nan),
}

/// What a name stands for where the model declares no such name.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Builtin {
    Math(MathFunction),
    /// Cuts a double down to an integer, as conversions do.
    Truncation,
    /// A random number, which exists in statistical model checking only.
    Random,
    /// The same, in old versions of UPPAAL only: models may declare the name.
    OldRandom,
    /// A function of UPPAAL that this engine does not have.
    Missing,
}

/// The built-in function of this name.
pub(crate) fn named(name: &str) -> Option<Builtin> {
    Some(match name {
        "fint" => Builtin::Truncation,
        "normal" => Builtin::OldRandom,
        "fpclassify" => Builtin::Missing,
        _ if Distribution::named(name).is_some() => Builtin::Random,
        _ => Builtin::Math(MathFunction::named(name)?),
    })
}

/// An argument or a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Number {
    Integer(i32),
    Double(f64),
}

impl MathFunction {
    /// Its value for arguments of the types that its code has, if there is one, and whether it
    /// wrapped round.
    pub(crate) fn evaluate(self, arguments: &[Number]) -> Option<(Number, bool)> {
        use Number::{Double, Integer};
        let value = match (self.code(), arguments) {
            (Code::Integer(code), &[Integer(x)]) => return integer(code(x)),
            (Code::ToInteger(code), &[Double(x)]) => return integer(code(x)),
            (Code::Classify(code), &[Double(x)]) => Integer(code(x)),
            (Code::Unary(code), &[Double(x)]) => Double(code(x)),
            (Code::Binary(code), &[Double(x), Double(y)]) => Double(code(x, y)),
            (Code::Scale(code), &[Double(x), Integer(y)]) => Double(code(x, y)),
            (Code::Ternary(code), &[Double(x), Double(y), Double(z)]) => Double(code(x, y, z)),
            _ => unreachable!("the checker gives arguments the types of the parameters"),
        };
        Some((value, false))
    }

    /// Whether its code gives an [`IntegerResult`].
    pub(crate) fn may_fail_or_wrap(self) -> bool {
        matches!(self.code(), Code::Integer(_) | Code::ToInteger(_))
    }
}

fn integer(result: IntegerResult) -> Option<(Number, bool)> {
    let (value, has_wrapped) = result.get()?;
    Some((Number::Integer(value), has_wrapped))
}

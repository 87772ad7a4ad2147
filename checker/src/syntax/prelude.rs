//! What every model can use without declaring it: ranges of machine integers and constants of
//! mathematics.

use super::ast::Declaration;
use super::keywords::Dialect;
use super::parser::Parser;
use crate::diagnostics::{Source, SourceMap};

/// The declarations that UPPAAL puts before every model. `UINT8_MAX` is 255; the reference manual's
/// 256 is a slip.
const PRELUDE: &str = "\
const int INT8_MIN = -128, INT8_MAX = 127, UINT8_MAX = 255;
const int INT16_MIN = -32768, INT16_MAX = 32767, UINT16_MAX = 65535;
const int INT32_MIN = -2147483648, INT32_MAX = 2147483647;
typedef int[INT8_MIN, INT8_MAX] int8_t;
typedef int[0, UINT8_MAX] uint8_t;
typedef int[INT16_MIN, INT16_MAX] int16_t;
typedef int[0, UINT16_MAX] uint16_t;
typedef int[INT32_MIN, INT32_MAX] int32_t;
const double FLT_MIN = 1.1754943508222875e-38, FLT_MAX = 3.4028234663852886e38;
const double DBL_MIN = 2.2250738585072014e-308, DBL_MAX = 1.7976931348623157e308;
const double M_PI = 3.141592653589793, M_PI_2 = 1.5707963267948966, M_PI_4 = 0.7853981633974483;
const double M_1_PI = 0.3183098861837907, M_2_PI = 0.6366197723675814, M_2_SQRTPI = 1.1283791670955126;
const double M_E = 2.718281828459045, M_LOG2E = 1.4426950408889634, M_LOG10E = 0.4342944819032518;
const double M_LN2 = 0.6931471805599453, M_LN10 = 2.302585092994046;
const double M_SQRT2 = 1.4142135623730951, M_SQRT1_2 = 0.7071067811865476;
";

/// The declarations that stand before every model.
///
/// # Panics
/// Never: the text is fixed, and a test parses it.
pub fn prelude(sources: &mut SourceMap) -> Vec<Declaration> {
    let span = sources.add(Source {
        place: "the prelude".to_owned(),
        text: PRELUDE.into(),
        ..Source::default()
    });
    let mut diagnostics = Vec::new();
    let mut parser = Parser::new(span, sources, Dialect::New, &mut diagnostics);
    let declarations = parser.local_declarations();
    assert!(diagnostics.is_empty(), "the prelude is well-formed");
    declarations
}

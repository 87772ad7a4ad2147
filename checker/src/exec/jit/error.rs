//! Why there is no native code.

use std::fmt;

/// Why there is no native code.
#[derive(Clone, Debug)]
pub struct JitError(String);

impl JitError {
    pub(super) fn new(cause: impl fmt::Display) -> JitError {
        JitError(cause.to_string())
    }
}

impl fmt::Display for JitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot generate native code: {}", self.0)
    }
}

impl std::error::Error for JitError {}

//! What passes between the model and a function of a library, and why there may be none.

use std::fmt;

/// Why there is no function of a library.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LibraryError {
    /// The system does not load the library, and says why.
    NotLoaded(String),
    /// The file has changed since this process loaded it.
    Changed,
    /// The library has no function of this name.
    NoSymbol,
    /// No code can be made that calls it.
    NotCallable(String),
}

impl fmt::Display for LibraryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LibraryError::NotLoaded(cause) => write!(f, "it cannot be loaded: {cause}"),
            LibraryError::Changed => f.write_str("its file has changed since it was loaded"),
            LibraryError::NoSymbol => f.write_str("it has no such function"),
            LibraryError::NotCallable(cause) => f.write_str(cause),
        }
    }
}

/// Whether the text that these words hold ends in this one.
pub(super) fn ends_text(word: i32) -> bool {
    word.to_le_bytes().contains(&0)
}

/// What a function of a library is given for a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ExternalWords {
    /// A value.
    Value(u64),
    /// The words behind a pointer.
    Memory(Vec<i32>),
}

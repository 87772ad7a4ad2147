//! Functions of libraries that a model imports.

use super::ids::ExternalId;

/// What a value is in C.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExternalType {
    /// `int32_t`; a word.
    Integer,
    /// `bool`; a word, 0 or 1.
    Bool,
    /// `double`; two words.
    Double,
}

/// What a parameter is in C.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum ExternalParameter {
    /// A value.
    Value(ExternalType),
    /// A pointer to values.
    Pointer {
        /// What each of them is.
        of: ExternalType,
        /// How many there are.
        length: u32,
        /// How many words lie between the starts of two.
        stride: u32,
        /// What integers may be after the call; `None` if the function only reads.
        written: Option<(i32, i32)>,
    },
    /// `const char*`: the bytes of a text that ends with 0, four of them a word.
    Text,
}

impl ExternalParameter {
    /// How many words lie behind the pointer, and whether the function may change them; `None` for
    /// a value. The words of a text follow each other up to the one that holds its 0.
    pub fn memory(&self) -> Option<(u32, bool)> {
        match self {
            ExternalParameter::Value(_) => None,
            ExternalParameter::Pointer {
                length,
                stride,
                written,
                ..
            } => Some((length * stride, written.is_some())),
            ExternalParameter::Text => Some((1, false)),
        }
    }
}

/// The type of a function in C.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct ExternalSignature {
    /// Its parameters.
    pub parameters: Vec<ExternalParameter>,
    /// What it returns.
    pub result: Option<ExternalType>,
}

/// A library that a model imports.
#[derive(Clone, Debug)]
pub struct ExternalLibrary {
    /// How the model names it.
    pub name: String,
    /// The functions that the model imports.
    pub functions: Vec<String>,
    /// Whether it was loaded.
    pub is_loaded: bool,
    /// Its function `__ON_BEGIN__`, run before a query.
    pub begin: Option<ExternalId>,
    /// Its function `__ON_END__`, run after a query.
    pub end: Option<ExternalId>,
}

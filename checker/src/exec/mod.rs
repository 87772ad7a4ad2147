//! Running code: the interpreter is the reference, compiled code is fast, and both answer to one
//! trait.
//!
//! Neither knows the solver, zones or queries. The context collects the clock constraints and
//! assignments that code emits, for the caller.

pub(crate) mod arithmetic;

mod cycles;
mod executor;
mod external_words;
mod libraries;
mod rounds;
mod wraps;

mod interpreter;

mod validate;

#[cfg(feature = "jit")]
mod jit;

pub use executor::{Context, EmittedAssignment, Executor, RunTimeError};
pub use external_words::LibraryError;
pub use interpreter::Interpreter;
#[cfg(feature = "jit")]
pub use jit::{Jit, JitError};
pub use libraries::{Libraries, call_hook};
pub use rounds::ROUND_LIMIT;
pub use validate::{Flaw, validate};
pub use wraps::Wraps;

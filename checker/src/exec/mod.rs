//! Running code: the interpreter is the reference, compiled code is fast, and both answer to one
//! trait.
//!
//! Neither knows the solver, zones or queries. Clock constraints and assignments that code emits
//! are collected in the context for whoever called.

pub(crate) mod arithmetic;

mod executor;
mod rounds;
mod wraps;

mod interpreter;
mod optimise;

mod validate;

#[cfg(feature = "jit")]
mod jit;

pub use executor::{Context, EmittedAssignment, EmittedConstraint, Executor, RunTimeError};
pub use interpreter::Interpreter;
#[cfg(feature = "jit")]
pub use jit::{Jit, JitError};
pub use optimise::optimise;
pub use rounds::ROUND_LIMIT;
pub use validate::{Flaw, validate};
pub use wraps::Wraps;

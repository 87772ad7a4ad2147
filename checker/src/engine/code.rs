//! The code of a model, ready to run: compiled or interpreted.

use super::options::CodeEngine;
#[cfg(feature = "jit")]
use crate::exec::Jit;
use crate::exec::{Executor, Interpreter};
use crate::ir::{Network, Overflow};
use crate::tuning::Tuning;

/// The code of the model, ready to run.
pub(super) struct PreparedCode {
    /// The rule for overflows that it was made for.
    overflow: Overflow,
    tuning: Tuning,
    runner: Runner,
}

/// What runs it.
enum Runner {
    Interpreter(Interpreter),
    #[cfg(feature = "jit")]
    Jit(Box<Jit>),
}

impl PreparedCode {
    /// What runs it.
    pub(super) fn executor(&self) -> &dyn Executor {
        match &self.runner {
            Runner::Interpreter(interpreter) => interpreter,
            #[cfg(feature = "jit")]
            Runner::Jit(jit) => jit.as_ref(),
        }
    }

    /// Makes the code of a network, or adds what queries brought since it was made.
    ///
    /// # Errors
    /// Says why it cannot be compiled.
    pub(super) fn prepare(
        code: &mut Option<PreparedCode>,
        network: &Network,
        wanted: CodeEngine,
        tuning: Tuning,
    ) -> Result<(), String> {
        let overflow = network.overflow;
        code.take_if(|code| (code.overflow, code.tuning) != (overflow, tuning));
        let (functions, constants) = (&network.functions, &network.constants);
        let runner = match (code.as_mut().map(|code| &mut code.runner), wanted) {
            (Some(Runner::Interpreter(interpreter)), CodeEngine::Interpreter) => {
                interpreter.extend(functions, constants);
                return Ok(());
            }
            #[cfg(feature = "jit")]
            (Some(Runner::Jit(jit)), CodeEngine::Jit) => {
                let extended = jit.extend(functions, constants);
                return extended.map_err(|error| error.to_string());
            }
            (_, CodeEngine::Interpreter) => {
                let interpreter = Interpreter::new(functions, constants);
                Runner::Interpreter(interpreter.with_overflow(overflow))
            }
            #[cfg(feature = "jit")]
            (_, CodeEngine::Jit) => {
                let jit = Jit::tuned(functions, constants, overflow, tuning);
                let jit = jit.map_err(|error| error.to_string())?;
                jit.prepare(network.functions_of_edges());
                Runner::Jit(Box::new(jit))
            }
            #[cfg(not(feature = "jit"))]
            (_, CodeEngine::Jit) => {
                return Err("this build of the engine has no compiler".to_owned());
            }
        };
        *code = Some(PreparedCode {
            overflow,
            tuning,
            runner,
        });
        Ok(())
    }
}

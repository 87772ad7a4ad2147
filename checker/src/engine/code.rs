//! The code of a model in one of its readings, ready to run: compiled or interpreted.

use super::options::CodeEngine;
#[cfg(feature = "jit")]
use crate::exec::Jit;
use crate::exec::{Executor, Interpreter};
use crate::ir::{Network, Overflow};
use crate::semantics::Model;
use crate::tuning::Tuning;

/// A model in one of its readings, with its code once something was asked of it.
pub(super) struct CompiledModel {
    pub(super) model: Model,
    code: Option<PreparedCode>,
}

/// The code of the model, ready to run.
struct PreparedCode {
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

impl CompiledModel {
    pub(super) fn new(model: Model) -> CompiledModel {
        CompiledModel { model, code: None }
    }

    pub(super) fn network(&self) -> &Network {
        &self.model.network
    }

    /// What runs the code of the model.
    ///
    /// # Panics
    ///
    /// If the code was not made before.
    pub(super) fn executor(&self) -> &dyn Executor {
        match &self
            .code
            .as_ref()
            .expect("code is made before it is run")
            .runner
        {
            Runner::Interpreter(interpreter) => interpreter,
            #[cfg(feature = "jit")]
            Runner::Jit(jit) => jit.as_ref(),
        }
    }

    /// Makes the code, or adds what queries brought since it was made. If this is cut off, what is
    /// half made is forgotten.
    ///
    /// # Errors
    /// Says why it cannot be compiled.
    pub(super) fn prepare(&mut self, wanted: CodeEngine, tuning: Tuning) -> Result<(), String> {
        let network = &self.model.network;
        let overflow = network.overflow;
        let (functions, constants) = (&network.functions, &network.constants);
        let known = self.code.take();
        let known = known.filter(|code| (code.overflow, code.tuning) == (overflow, tuning));
        let runner = match (known.map(|code| code.runner), wanted) {
            (Some(Runner::Interpreter(mut interpreter)), CodeEngine::Interpreter) => {
                interpreter.extend(functions, constants);
                Runner::Interpreter(interpreter)
            }
            (_, CodeEngine::Interpreter) => {
                let interpreter = Interpreter::new(functions, constants);
                Runner::Interpreter(interpreter.with_overflow(overflow))
            }
            #[cfg(feature = "jit")]
            (Some(Runner::Jit(mut jit)), CodeEngine::Jit) => {
                let extended = jit.extend(functions, constants);
                extended.map_err(|error| error.to_string())?;
                Runner::Jit(jit)
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
        self.code = Some(PreparedCode {
            overflow,
            tuning,
            runner,
        });
        Ok(())
    }
}

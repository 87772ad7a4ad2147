//! Libraries of functions that a model imports, while random runs are made.

use crate::exec::call_hook;
use crate::ir::{Network, Statistical};
use crate::stochastic::{Behaviour, Failure, is_repeatable};

/// Makes libraries ready for the runs of queries: their hooks are called, and the first runs must
/// be repeatable. What is returned calls the hooks that end runs when it is dropped.
pub(super) fn begin_libraries<'n>(
    behaviour: Behaviour<'n>,
    queries: &[&Statistical],
    seed: u64,
) -> Result<Hooks<'n>, Failure> {
    let hooks = Hooks::new(behaviour.network);
    if has_libraries(behaviour.network) {
        for query in queries {
            if !is_repeatable(behaviour, query, seed)? {
                return Err(Failure::NotRepeatable);
            }
        }
    }
    Ok(hooks)
}

/// Whether functions of libraries can be called.
pub(super) fn has_libraries(network: &Network) -> bool {
    network.externals.iter().any(|one| one.is_loaded)
}

/// Calls the hooks of libraries that begin runs, and when it is dropped those that end them: also
/// where runs are cut off.
#[must_use]
pub(in crate::engine) struct Hooks<'n>(&'n Network);

impl Hooks<'_> {
    pub(in crate::engine) fn new(network: &Network) -> Hooks<'_> {
        let begin = network.externals.iter().filter_map(|one| one.begin);
        begin.for_each(call_hook);
        Hooks(network)
    }
}

impl Drop for Hooks<'_> {
    fn drop(&mut self) {
        let end = self.0.externals.iter().filter_map(|one| one.end);
        end.for_each(call_hook);
    }
}

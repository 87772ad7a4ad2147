//! What random runs are runs of.

use super::control::{Fence, Guidance};
use super::restriction::Restriction;
use crate::exec::Executor;
use crate::ir::Network;

/// A network in the stochastic reading with what runs its code, and what its controller may do.
#[derive(Clone, Copy)]
pub struct Behaviour<'a> {
    /// The network.
    pub network: &'a Network,
    /// What runs its code.
    pub executor: &'a dyn Executor,
    /// The strategy that the controller follows, if runs are asked for under one.
    pub restriction: Option<&'a Restriction>,
    /// Who decides for the controller, if somebody does, within what the strategy allows.
    pub guidance: Option<&'a dyn Guidance>,
    /// What keeps the controller from some of its moves, if something does.
    pub fence: Option<&'a dyn Fence>,
    /// The step with which Euler's method solves equations of clocks; adaptive steps without it.
    pub fixed_step: Option<f64>,
}

impl<'a> Behaviour<'a> {
    /// A network whose processes may do whatever they can.
    pub fn new(network: &'a Network, executor: &'a dyn Executor) -> Behaviour<'a> {
        Behaviour {
            network,
            executor,
            restriction: None,
            guidance: None,
            fence: None,
            fixed_step: None,
        }
    }
}

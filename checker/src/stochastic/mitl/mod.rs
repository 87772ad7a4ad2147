//! Formulas over time (metric interval temporal logic) along random runs.
//!
//! `f U[a,b] g` speaks of distances in time, `X f` of the next move. Both see all positions of a
//! run: each state at each moment at which it is the current one, both ends included. A run that is
//! bounded ends there: what is looked for behind its end is not found, and what is to hold all the
//! time need hold up to there only.
//!
//! A run ends as soon as the formula is decided.

mod monitor;
mod signal;
mod until;
mod watch;

pub(super) use watch::Watch;

#[cfg(test)]
mod tests;

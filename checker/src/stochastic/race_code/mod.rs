//! The race as code of the network, so that whole runs are compiled: for networks whose clocks have
//! constant rates and whose processes synchronise by broadcast.
//!
//! The code makes the same runs as [`Race`](super::race::Race), bit by bit: the same random
//! numbers in the same order, the same arithmetic. Whatever is rare or goes wrong it leaves to the
//! race: it gives a run up, and the run is made again from its start.
//!
//! Invariants:
//! * The words of a run are those of the state, and behind them those of [`layout::Layout`].
//! * The code of a process is written out for all its locations, so its size grows with the
//!   product of senders and receivers: beyond a limit there is no code.

mod backend;
mod decisions;
mod inline;
mod layout;
mod moves;
mod plans;
mod race_writer;
mod rates;
mod rounds;
mod runs;
mod stages;
mod watching;
mod writer;

pub(super) use runs::RaceCode;
pub(super) use stages::Stages;
pub(super) use watching::Watched;

//! Models and their queries: verdicts, traces, certificates, reductions, threads and limits, on the
//! corpus and on random networks.

mod activity;
mod asked;
mod certificates;
#[path = "../common/checks.rs"]
#[allow(dead_code, reason = "this program asks in some of the ways only")]
mod checks;
#[path = "../common/corpus.rs"]
#[allow(dead_code, reason = "this program reads some of the files only")]
mod corpus;
mod great_constants;
mod great_differences;
mod interrupts;
mod live_variables;
mod long_chains;
mod long_runs;
mod numbers;
mod option_sets;
mod partial_order;
#[path = "../common/process.rs"]
mod process;
#[path = "../common/random.rs"]
mod random;
mod replay;
#[path = "../common/searches.rs"]
mod searches;
mod shown;
mod spilled;
mod state_space;
mod stopwatches;
mod stored;
mod subsumption;
mod symmetry;
mod threads;
mod verdicts;
mod zone_memo;

//! The engine against brute force: small random networks whose queries are answered by an explicit
//! exploration of regions.
//!
//! The explicit side knows the definitions only (`checker::verify::concrete`, or for some tests the
//! tree that the network was generated as): it shares nothing with the engine's moves, zones,
//! search and games. Formulas are evaluated on the tree they were
//! generated as, not on compiled queries.
//!
//! `NTAGEN_CASES` says how many networks each test tries, `NTAGEN_SEED` from which seed.

#[path = "../common/checks.rs"]
#[allow(dead_code, reason = "this program asks in some of the ways only")]
mod checks;
mod closed_loops;
mod compare;
mod endless;
mod every_kind;
mod explicit;
mod freedom;
mod games;
mod generate;
mod legs;
mod mutations;
mod observed;
#[path = "../common/process.rs"]
mod process;
#[path = "../common/random.rs"]
#[expect(dead_code, reason = "networks are made by proptest here")]
mod random;
mod random_mutations;
mod reachability;
mod under;

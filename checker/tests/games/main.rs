//! Timed games: who wins, what strategies in every form do, and how far the solver gets within its
//! limits.

#[path = "../common/c_programs.rs"]
mod c_programs;
#[path = "../common/checks.rs"]
#[allow(dead_code, reason = "this program asks in some of the ways only")]
mod checks;
mod choices;
mod controllers;
#[path = "../common/corpus.rs"]
#[allow(dead_code, reason = "this program reads some of the files only")]
mod corpus;
mod dead_ends;
#[path = "../common/games.rs"]
mod families;
mod game_threads;
mod guides;
mod learned_files;
mod machines;
mod nodes;
#[path = "../common/plates.rs"]
mod plates;
#[path = "../common/random.rs"]
#[allow(dead_code, reason = "this program draws in some of the ways only")]
mod random;
#[path = "../common/solved.rs"]
mod solved;
mod strategy_files;
mod strategy_limits;
mod strategy_text;

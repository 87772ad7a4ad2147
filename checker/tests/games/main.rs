//! Timed games: who wins, what strategies in every form do, and how far the solver gets within its
//! limits.

#[path = "../common/c_programs.rs"]
mod c_programs;
mod choices;
mod controllers;
mod dead_ends;
#[path = "../common/games.rs"]
mod families;
mod game_threads;
mod machines;
mod nodes;
#[path = "../common/plates.rs"]
mod plates;
#[path = "../common/solved.rs"]
mod solved;
mod strategy_files;
mod strategy_limits;
mod strategy_text;

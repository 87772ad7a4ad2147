//! Hostile inputs: whatever is read, loading, asking and checking end in a value or in a
//! diagnostic, and soon.
//!
//! Inputs are made from those of the corpus by mutation, one from each number, so that a failure is
//! found again by its number. A panic, and an input that takes longer than [`SLOW`] or
//! [`SLOW_CHECK`], fails the test; a stack overflow ends it.
//!
//! * `FUZZ_CASES`: how many inputs (a few thousand otherwise).
//! * `FUZZ_FIRST`: the number of the first one.
//! * `FUZZ_SEEDS`: folders with more inputs to begin from, separated by colons.
//! * `FUZZ_KIND`: one of the kinds of [`Kind`] only.
//! * `FUZZ_SHOW`: say the number of each input before it is tried, to find one that never ends
//!   (with `--nocapture`).

#[path = "../common/corpus.rs"]
mod corpus;
mod evidence;
mod mutate;
mod seeds;
mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use mutate::Random;
use seeds::Seeds;
use targets::{Kind, Targets};

/// Longer than this, an input counts as one that hangs.
const SLOW: Duration = Duration::from_secs(1);
/// The same for evidence, whose check goes through up to two million regions.
const SLOW_CHECK: Duration = Duration::from_secs(10);

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().expect("a number is wanted"))
}

#[expect(
    clippy::print_stderr,
    reason = "it is asked for, and a test that never ends reports nothing"
)]
fn show(case: u64) {
    if std::env::var_os("FUZZ_SHOW").is_some() {
        eprintln!("case {case}");
    }
}

#[test]
fn hostile_inputs_do_no_harm() {
    let seeds = Seeds::read();
    let mut targets = Targets::new();
    let only = std::env::var("FUZZ_KIND").ok();
    let first = number("FUZZ_FIRST", 0);
    let cases = number("FUZZ_CASES", 4_000);
    let mut failures = Vec::new();
    for case in first..first + cases {
        let mut random = Random::new(case);
        let kind = Kind::ALL[random.below(Kind::ALL.len())];
        if only
            .as_ref()
            .is_some_and(|only| *only != format!("{kind:?}"))
        {
            continue;
        }
        let input = mutate::mutated(&seeds, kind, &mut random);
        let begin = Instant::now();
        show(case);
        let ended = catch_unwind(AssertUnwindSafe(|| targets.run(kind, &input, &seeds)));
        let longest = if kind == Kind::Evidence {
            SLOW_CHECK
        } else {
            SLOW
        };
        let is_slow = begin.elapsed() > longest && !cfg!(debug_assertions);
        if ended.is_err() || is_slow {
            let what = if is_slow { "is slow" } else { "panics" };
            let shown = String::from_utf8_lossy(&input);
            failures.push(format!("case {case}, {kind:?}, {what}:\n{shown:.4000}\n"));
            targets = Targets::new();
        }
    }
    assert!(failures.is_empty(), "{}", failures.concat());
}

//! What no run of a model can do has no probability: random runs against the symbolic engine.
//!
//! A query for a state within a bound is asked of zones, with a clock that nobody sets. Where they
//! say that there is no such state, no random run may reach one; and where the probability is
//! greater than 0, they must find one.
//!
//! `NETWORKS=2000 cargo test --release --test stochastic certainties::` tries more than the usual.

use checker::engine::{CodeEngine, Options, Verdict};
use checker::stochastic::Precision;

use crate::checks::{ask, interpreted, load, try_ask};
use crate::networks::generate::{Family, network};
use crate::networks::{Bound, Path, grid};
use crate::random::{Random, networks};

/// Networks of each family without the environment variable `NETWORKS`.
const NETWORKS: u64 = 40;
const RUNS: u64 = 200;

/// How often zones said that there is no such state, and that there is one.
#[derive(Default)]
struct Tally {
    impossible: u64,
    possible: u64,
}

/// Compares the answers about a random network, if no run of it can fail and zones can hold it.
fn compare(random: &mut Random, family: Family, tally: &mut Tally) {
    let (mut net, mut query) = network(random, family);
    let halves = 2 * (1 + random.below(3) as u32);
    query.bound = Bound::HalfUnits(halves);
    let Ok(Some(exact)) = grid::probability(&net, &query, 2, &mut |_| true) else {
        return;
    };
    let time = net.clocks;
    net.clocks += 1;
    let (wanted, is_avoided) = match &query.path {
        Path::Eventually(goal) | Path::Until(_, goal) => (goal.text(), false),
        Path::Always(keep) => (format!("not ({})", keep.text()), true),
    };
    let mut model = load(&net.text());
    let symbolic = format!("E<> ({wanted}) && x{time} <= {}", halves / 2);
    let Ok(answer) = try_ask(&mut model, &symbolic, &interpreted()) else {
        // Receivers and urgent channels with conditions on clocks.
        return;
    };
    let options = Options {
        code: CodeEngine::Interpreter,
        precision: Precision {
            runs: Some(RUNS),
            ..Precision::default()
        },
        ..Options::default()
    };
    let estimate = ask(&mut model, &query.text(), &options).estimate;
    let satisfied = estimate
        .and_then(|estimate| estimate.satisfied_runs)
        .expect("runs are counted");
    let reached = if is_avoided {
        RUNS - satisfied
    } else {
        satisfied
    };
    let shown = || format!("{symbolic}\n{}: {satisfied}\n{}", query.text(), net.text());
    match answer.verdict {
        Verdict::NotSatisfied => {
            assert_eq!(reached, 0, "{}", shown());
            tally.impossible += 1;
        }
        Verdict::Satisfied => tally.possible += 1,
        other => panic!("{other:?}\n{}", shown()),
    }
    let value = if is_avoided {
        1.0 - exact.value
    } else {
        exact.value
    };
    let is_likely = value > exact.error + 1e-6;
    assert!(
        !is_likely || answer.verdict == Verdict::Satisfied,
        "{}",
        shown()
    );
}

fn check_family(family: Family) {
    let networks = networks(NETWORKS);
    let mut tally = Tally::default();
    let mut one = 0;
    while tally.impossible + tally.possible < networks {
        compare(&mut Random::of_network(one + 77), family, &mut tally);
        one += 1;
    }
    assert!(tally.impossible * 10 > networks && tally.possible * 10 > networks);
}

#[test]
fn delays_of_chance_reach_only_what_zones_reach() {
    check_family(Family::Timed);
}

#[test]
fn known_moments_reach_only_what_zones_reach() {
    check_family(Family::Ticking);
}

//! Random small networks: how often runs satisfy a query, against its exact probability.
//!
//! Each network is made as data. The engine reads its text and makes runs; the probability is
//! computed from the data, by uniformisation, by powers, or on a grid of moments. No single
//! network may deviate more than a risk of one in a million allows, all tests together, and neither
//! may the sum of all squared deviations, nor their sum, which a small bias of all networks moves.
//!
//! `NETWORKS=1000 RUNS=2000 cargo test --release --test stochastic random_networks::` tries more
//! than the usual, `POINTS=4` more exactly; `SEED` chooses others.

use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF};

use checker::engine::{CodeEngine, Options};
use checker::stochastic::Precision;

use crate::checks;
use crate::networks::generate::{Family, network};
use crate::networks::grid::Approximation;
use crate::networks::{Net, Query, chain, grid};
use crate::random::Random;

/// Networks of each family without the environment variable `NETWORKS`.
const NETWORKS: u64 = 40;
/// Runs of each network without the environment variable `RUNS`.
const RUNS: u64 = 400;
/// Points a unit of time of the coarsest grid without the environment variable `POINTS`.
const POINTS: u64 = 2;
/// The risk that a test fails although all is right.
const RISK: f64 = 1e-6;
/// Networks whose probability is less certain than this are left out.
const GREATEST_ERROR: f64 = 2e-3;

fn number(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).map_or(usual, |number| number.parse().expect("it is a number"))
}

/// A random network with its query, and the probability, which is seldom 0 or 1.
fn next(random: &mut Random, family: Family) -> (Net, Query, Approximation) {
    let points = number("POINTS", POINTS) as i32;
    loop {
        let (net, query) = network(random, family);
        let takes_all = random.chance(3);
        let mut is_wanted = |value: f64| takes_all || (0.01..=0.99).contains(&value);
        let found = match family {
            Family::Exponential => chain::probability(&net, &query).map(|value| {
                let error = 1e-9;
                is_wanted(value).then_some(Approximation { value, error })
            }),
            Family::Timed | Family::Ticking => {
                grid::probability(&net, &query, points, &mut is_wanted)
            }
        };
        if let Ok(Some(found)) = found
            && found.error <= GREATEST_ERROR
        {
            return (net, query, found);
        }
    }
}

/// How many of so many runs of a seed satisfy a query.
fn satisfied(
    (text, query): (&str, &str),
    (code, threads): (CodeEngine, usize),
    (seed, runs): (u64, u64),
) -> u64 {
    let options = Options {
        code,
        threads,
        precision: Precision {
            runs: Some(runs),
            seed,
            ..Precision::default()
        },
        ..Options::default()
    };
    let answer = checks::try_ask(&mut checks::load(text), query, &options)
        .unwrap_or_else(|refused| panic!("{query}\n{text}\n{}", refused.rendered.join("\n")));
    let estimate = answer.estimate.expect("a probability is estimated");
    assert_eq!(estimate.runs, runs);
    estimate.satisfied_runs.expect("runs are counted")
}

/// How far counts deviate from probabilities, over all networks.
#[derive(Default)]
struct Deviations {
    tried: f64,
    least: Option<(f64, String)>,
    squares: f64,
    sum: f64,
    count: f64,
}

impl Deviations {
    fn add(&mut self, (count, runs): (u64, u64), found: Approximation, shown: &str) {
        let share = count as f64 / runs as f64;
        // The nearest probability that may be right.
        let near = share.clamp(found.value - found.error, found.value + found.error);
        let p = near.clamp(0.0, 1.0);
        let binomial = Binomial::new(p, runs).expect("it is a probability");
        let below = binomial.cdf(count);
        let above = if count == 0 {
            1.0
        } else {
            binomial.sf(count - 1)
        };
        let risk = (2.0 * below.min(above)).min(1.0);
        self.tried += 1.0;
        if self.least.as_ref().is_none_or(|least| risk < least.0) {
            self.least = Some((risk, format!("{count} of {runs}, not {p}:\n{shown}")));
        }
        let variance = p * (1.0 - p) * runs as f64;
        if variance >= 5.0 {
            let deviation = (count as f64 - p * runs as f64) / variance.sqrt();
            self.squares += deviation * deviation;
            self.sum += deviation;
            self.count += 1.0;
        }
    }

    #[expect(clippy::print_stderr, reason = "the large run says what it measured")]
    fn expect_chance(&self, family: Family) {
        let (least, shown) = self.least.as_ref().expect("networks were tried");
        let squares = ChiSquared::new(self.count).expect("there are networks");
        let (many, few) = (squares.sf(self.squares), squares.cdf(self.squares));
        let bias = self.sum / self.count.sqrt();
        let text = format!(
            "{family:?}: {} networks, least risk {least:.3e}, squares {:.1} of {} ({many:.3e} above, \
             {few:.3e} below), sum {bias:.2} deviations",
            self.tried, self.squares, self.count
        );
        assert!(least * self.tried > RISK, "{text}\n{shown}");
        assert!(many > RISK && few > RISK, "{text}");
        assert!(bias.abs() < 5.0, "{text}");
        if std::env::var("NETWORKS").is_ok() {
            eprintln!("{text}");
        }
    }
}

fn check_family(family: Family) {
    let (networks, runs) = (number("NETWORKS", NETWORKS), number("RUNS", RUNS));
    let mut deviations = Deviations::default();
    let seed = number("SEED", 1) * 1_000_000;
    for one in 0..networks {
        let mut random = Random::of_network(seed + one);
        let (net, query, found) = next(&mut random, family);
        let (text, asked) = (net.text(), query.text());
        let program = (&*text, &*asked);
        // With a seed for all, the networks would share their random numbers and their luck.
        let (all, few) = ((seed + one, runs), (seed + one, runs.min(100)));
        let threads = 1 + one as usize % 3;
        let count = satisfied(program, (CodeEngine::Jit, threads), all);
        let interpreted = satisfied(program, (CodeEngine::Interpreter, 1), few);
        let compiled = satisfied(program, (CodeEngine::Jit, 1 + threads % 3), few);
        assert_eq!(interpreted, compiled, "{asked}\n{text}");
        let shown = format!("{asked}, {found:?}, network {one}\n{text}");
        deviations.add((count, runs), found, &shown);
    }
    deviations.expect_chance(family);
}

#[test]
fn exponential_delays_have_their_probabilities() {
    check_family(Family::Exponential);
}

#[test]
fn uniform_delays_and_windows_have_their_probabilities() {
    check_family(Family::Timed);
}

#[test]
fn moves_at_the_same_moment_have_their_probabilities() {
    check_family(Family::Ticking);
}

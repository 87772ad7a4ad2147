//! Known values, each at the level of the engine's interface, and how often the interval of an
//! estimate holds them.
//!
//! Every estimate is repeated with many seeds. Its interval misses the value with a risk that is at
//! most what it says; a test fails if there are more misses than that risk explains, but for a
//! chance of one in a million. The interval of an expectation is Student's, which holds for many
//! runs: its risk is allowed a little more.
//!
//! `REPETITIONS=1000 cargo test --release --test stochastic known::` repeats more than the usual.

use statrs::distribution::{Binomial, DiscreteCDF};

use checker::engine::{CodeEngine, LoadedModel, Options};
use checker::stochastic::{Estimate, Precision};

use crate::checks::{ask, load};

/// Repetitions without the environment variable `REPETITIONS`.
const REPETITIONS: u64 = 40;
/// The risk that a test fails although all is right.
const RISK: f64 = 1e-6;
/// The runs of an expectation.
const RUNS: u64 = 400;
/// The risk of Student's interval at this number of runs, where it promises 5 %; the values here
/// are bounded or have an exponential tail.
const STUDENTS_RISK: f64 = 0.07;

/// The answer with a seed, if so many runs are made; else the default rule ends it.
fn estimate(model: &mut LoadedModel, query: &str, seed: u64, runs: Option<u64>) -> Estimate {
    let options = Options {
        code: CodeEngine::Jit,
        precision: Precision {
            runs,
            seed,
            ..Precision::default()
        },
        ..Options::default()
    };
    let answer = ask(model, query, &options);
    let estimate = answer.estimate.expect("an estimate was asked for");
    assert!(estimate.is_complete, "{query}");
    assert!((estimate.confidence - 0.95).abs() < 1e-12, "{query}");
    estimate
}

/// Checks how often intervals hold a value: it may miss with this risk.
#[track_caller]
#[expect(clippy::print_stderr, reason = "the large run says what it measured")]
fn expect_coverage(model: &str, query: &str, value: f64, (runs, risk): (Option<u64>, f64)) {
    let is_large = std::env::var("REPETITIONS").is_ok();
    let repetitions = std::env::var("REPETITIONS").map_or(REPETITIONS, |number| {
        number.parse().expect("REPETITIONS is a number")
    });
    let mut model = load(model);
    let mut misses = 0;
    for seed in 0..repetitions {
        let found = estimate(&mut model, query, seed, runs);
        misses += u64::from(!(found.lower <= value && value <= found.upper));
    }
    let binomial = Binomial::new(risk, repetitions).expect("a risk is a probability");
    let chance = if misses == 0 {
        1.0
    } else {
        binomial.sf(misses - 1)
    };
    let text = format!("{query}: {misses} of {repetitions} intervals miss {value} ({chance:.2e})");
    assert!(chance > RISK, "{text}");
    if is_large {
        eprintln!("{text}");
    }
}

/// A probability, by the default rule and by a fixed number of runs.
#[track_caller]
fn expect_probability(model: &str, query: &str, value: f64) {
    expect_coverage(model, query, value, (None, 0.05));
    expect_coverage(model, query, value, (Some(200), 0.05));
}

#[track_caller]
fn expect_mean(model: &str, query: &str, value: f64) {
    expect_coverage(model, query, value, (Some(RUNS), STUDENTS_RISK));
}

/// A double that is drawn at the first moment.
fn drawn(call: &str) -> String {
    format!(
        "double v = 0.0;
         process P() {{ state a, b; commit a; init a; trans a -> b {{ assign v = {call}; }}; }}
         system P;"
    )
}

#[test]
fn races_of_delays() {
    let model = "
        bool is_first = true;
        process P(const int r) {
            state a { ; r }, won, late;
            init a;
            trans a -> won { guard is_first; assign is_first = false; },
                  a -> late { guard !is_first; };
        }
        A = P(1); B = P(3);
        system A, B;";
    expect_probability(model, "Pr[<=1000](<> A.won)", 0.25);
    let model = "
        clock x;
        bool is_first = true;
        process P(const int low, const int high) {
            state a { x <= high }, won, late;
            init a;
            trans a -> won { guard is_first && x >= low; assign is_first = false; },
                  a -> late { guard !is_first && x >= low; };
        }
        A = P(0, 2); B = P(1, 3);
        system A, B;";
    expect_probability(model, "Pr[<=9](<> A.won)", 0.875);
    let model = "
        clock x;
        broadcast chan go;
        process Uniform() {
            state a { x <= 1 }, won, lost;
            init a;
            trans a -> won { sync go!; }, a -> lost { sync go?; };
        }
        process Exponential() {
            state a { ; 1 }, won, lost;
            init a;
            trans a -> won { sync go!; }, a -> lost { sync go?; };
        }
        system Uniform, Exponential;";
    let exact = 1.0 - (-1.0_f64).exp();
    expect_probability(model, "Pr[<=9](<> Uniform.won)", exact);
}

#[test]
fn single_delays() {
    let model = "
        process P() { state a { ; 1:2 }, out; init a; trans a -> out { }; }
        system P;";
    expect_probability(model, "Pr[<=2](<> P.out)", 1.0 - (-1.0_f64).exp());
    let model = "
        clock x;
        process P() { state a { x <= 10 }, out; init a; trans a -> out { guard x >= 4; }; }
        system P;";
    expect_probability(model, "Pr[<=7](<> P.out)", 0.5);
    let model = "
        clock x;
        process P() { state a { ; 2 }, out; init a; trans a -> out { guard x >= 3; }; }
        system P;";
    expect_probability(model, "Pr[<=4](<> P.out)", 1.0 - (-2.0_f64).exp());
    let model = "
        clock cost;
        process P() { state a { cost' == 3 ; 1 }, out; init a; trans a -> out { }; }
        system P;";
    expect_probability(model, "Pr[cost<=6](<> P.out)", 1.0 - (-2.0_f64).exp());
}

#[test]
fn sums_of_delays() {
    let stages = |count: u32, location: &str| {
        format!(
            "clock x; int n = 0;
             process P() {{
                 state a {{ {location} }}, done;
                 init a;
                 trans a -> a {{ guard n < {0}; assign x = 0, n++; }},
                       a -> done {{ guard n == {0}; }};
             }}
             system P;",
            count - 1
        )
    };
    expect_probability(&stages(2, "x <= 1"), "Pr[<=1](<> P.done)", 0.5);
    expect_probability(&stages(5, "x <= 1"), "Pr[<=2](<> P.done)", 0.225);
    // Fewer than five events of a Poisson process within 5 units.
    let few = (-5.0_f64).exp() * (1.0 + 5.0 + 12.5 + 125.0 / 6.0 + 625.0 / 24.0);
    expect_probability(&stages(5, "; 1"), "Pr[<=5](<> P.done)", 1.0 - few);
    let model = "
        int n = 0;
        process P() { state a { ; 10 }; init a; trans a -> a { assign n++; }; }
        system P;";
    expect_probability(model, "Pr[<=1](<> n >= 10)", 0.542_070_285_528_147_7);
    let model = "
        const int N = 5;
        process P(int[0, N - 1] id) { state a { ; 1 }, done; init a; trans a -> done { }; }
        system P;";
    let exact = (1.0 - (-2.0_f64).exp()).powi(5);
    let query = "Pr[<=2](<> forall (i : int[0, N - 1]) P(i).done)";
    expect_probability(model, query, exact);
}

#[test]
fn walks() {
    let model = "
        int n = 3;
        process P() {
            state a { ; 1 };
            branchpoint b;
            init a;
            trans a -> b { guard n > 0 && n < 10; },
                  b -> a { assign n++; probability 4; },
                  b -> a { assign n--; probability 6; };
        }
        system P;";
    expect_probability(
        model,
        "Pr[#<=100000](<> n == 10)",
        0.041_912_968_548_039_636,
    );
    let model = "
        int n = 0;
        process P() {
            state a { ; 1 };
            branchpoint b;
            init a;
            trans a -> b { },
                  b -> a { assign n++; probability 1; },
                  b -> a { assign n--; probability 1; };
        }
        system P;";
    expect_probability(model, "Pr[#<=10](<> n >= 2)", 0.548_828_125);
}

#[test]
fn protocols_and_games_of_chance() {
    let model = "
        int probes = 0;
        process Host() {
            state start { ; 1 }, taken { ; 1 }, error, done;
            branchpoint choice, reply;
            init start;
            trans start -> choice { },
                  choice -> taken { assign probes = 0; probability 3; },
                  choice -> done { probability 7; },
                  taken -> reply { },
                  reply -> start { probability 1; },
                  reply -> taken { assign probes++; probability probes < 3 ? 1 : 0; },
                  reply -> error { probability probes == 3 ? 1 : 0; };
        }
        system Host;";
    // The probability p that the host fails is 0.3 (e + (1 - e) p); e = 0.5^4 are all probes lost.
    let exact = 0.3 * 0.0625 / (1.0 - 0.3 * 0.9375);
    expect_probability(model, "Pr[#<=100000](<> Host.error)", exact);
    let model = "
        int point = 0;
        process Craps() {
            state start { ; 1 }, again { ; 1 }, win, lose;
            branchpoint first, later;
            init start;
            trans start -> first { },
                  first -> win { probability 8; },
                  first -> lose { probability 4; },
                  first -> again { assign point = 3; probability 6; },
                  first -> again { assign point = 4; probability 8; },
                  first -> again { assign point = 5; probability 10; },
                  again -> later { },
                  later -> win { probability point; },
                  later -> lose { probability 6; },
                  later -> again { probability 30 - point; };
        }
        system Craps;";
    expect_probability(model, "Pr[#<=100000](<> Craps.win)", 244.0 / 495.0);
    let model = "
        int die = 0;
        process Coin() {
            state s0 { ; 1 }, s1 { ; 1 }, s2 { ; 1 }, s3 { ; 1 }, s4 { ; 1 }, s5 { ; 1 },
                  s6 { ; 1 }, done;
            branchpoint b0, b1, b2, b3, b4, b5, b6;
            init s0;
            trans s0 -> b0 { }, b0 -> s1 { probability 1; }, b0 -> s2 { probability 1; },
                  s1 -> b1 { }, b1 -> s3 { probability 1; }, b1 -> s4 { probability 1; },
                  s2 -> b2 { }, b2 -> s5 { probability 1; }, b2 -> s6 { probability 1; },
                  s3 -> b3 { }, b3 -> s1 { probability 1; },
                  b3 -> done { assign die = 1; probability 1; },
                  s4 -> b4 { }, b4 -> done { assign die = 2; probability 1; },
                  b4 -> done { assign die = 3; probability 1; },
                  s5 -> b5 { }, b5 -> done { assign die = 4; probability 1; },
                  b5 -> done { assign die = 5; probability 1; },
                  s6 -> b6 { }, b6 -> done { assign die = 6; probability 1; },
                  b6 -> s2 { probability 1; };
        }
        system Coin;";
    expect_probability(model, "Pr[#<=100000](<> die == 1)", 1.0 / 6.0);
}

/// A queue with one server.
fn queue(arrival: &str, service: &str) -> String {
    format!(
        "int[0, 100] n = 0;
         process Arrivals() {{ state a {{ ; {arrival} }}; init a; trans a -> a {{ assign n++; }}; }}
         process Server() {{
             state a {{ ; {service} }};
             init a;
             trans a -> a {{ guard n > 0; assign n--; }};
         }}
         system Arrivals, Server;"
    )
}

#[test]
fn queues() {
    let query = "Pr[<=10](<> n >= 5)";
    expect_probability(&queue("1", "3:2"), query, 0.247_074_521_311_354_82);
    expect_probability(&queue("4", "5"), query, 0.866_741_559_025_179);
    let model = "
        clock b;
        int n = 1;
        process Arrivals() {
            state a { ; 1 };
            init a;
            trans a -> a { guard n > 0; assign n++; };
        }
        process Server() {
            state busy { ; 2 }, idle { b' == 0 };
            init busy;
            trans busy -> busy { guard n > 1; assign n--; },
                  busy -> idle { guard n == 1; assign n--; };
        }
        system Arrivals, Server;";
    expect_mean(model, "E[<=10000; 400](max: b)", 1.0);
}

#[test]
fn random_functions() {
    let query = "Pr[<=1](<> v > 3)";
    expect_probability(
        &drawn("random_normal(1, 2)"),
        query,
        0.158_655_253_931_457_07,
    );
    let query = "Pr[<=1]([] v > 0 - 1 && not (P.b && v == 0))";
    expect_probability(&drawn("random_poisson(3)"), query, 1.0 - (-3.0_f64).exp());
    for (call, mean) in [
        ("random(4)", 2.0),
        ("random_beta(2, 5)", 2.0 / 7.0),
        ("random_gamma(2, 3)", 6.0),
        ("random_weibull(2, 1)", std::f64::consts::PI.sqrt() / 2.0),
        ("random_tri(0, 1, 4)", 5.0 / 3.0),
    ] {
        expect_mean(&drawn(call), "E[<=1; 400](max: v)", mean);
    }
}

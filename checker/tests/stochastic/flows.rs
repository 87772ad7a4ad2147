//! Clocks whose rates change as time passes, and conditions that are not linear in time, against
//! solutions in closed form.

use checker::ir::{Asked, Statistical};
use checker::stochastic::{Behaviour, Precision, RunId, Runner, simulate};

use super::{executors, expect, load};

/// The value of `E[...](max: ...)` or `(min: ...)` in one run, in both engines.
fn extreme(model: &str, query: &str) -> f64 {
    let (network, query) = load(model, query).unwrap_or_else(|message| panic!("{message}"));
    let &Statistical::Expectation {
        ref bound,
        maximum,
        value,
        ..
    } = &query.kind
    else {
        panic!("{} asks for no expectation", query.text);
    };
    let [left, right] = executors(&network).map(|executor| {
        let mut runner = Runner::new(&network, &*executor);
        let found = runner.observe(
            RunId { seed: 1, run: 0 },
            bound,
            Asked::Extreme(value, maximum),
        );
        found.expect("the run does not fail").value
    });
    assert_eq!(left.to_bits(), right.to_bits(), "the engines differ");
    left
}

#[track_caller]
fn expect_extreme(model: &str, query: &str, expected: f64, error: f64) {
    let found = extreme(model, query);
    assert!(
        (found - expected).abs() <= error,
        "{query}: {found} instead of {expected}"
    );
}

#[test]
fn a_decay_is_solved_and_its_crossing_found() {
    let model = "
        clock x, t;
        double seen = 0;
        urgent broadcast chan now;
        process P() {
            state begin, a { x' == -x }, b { x' == 0 };
            commit begin;
            init begin;
            trans begin -> a { assign x = 1; },
                  a -> b { guard x <= 0.5; sync now!; assign seen = t; };
        }
        system P;";
    expect_extreme(model, "E[<=1; 1](max: seen)", 2.0_f64.ln(), 1e-8);
    expect_extreme(model, "E[<=1; 1](min: x > 0.4 ? x : 1.0)", 0.5, 1e-9);
    expect(model, "Pr[<=1](<> P.b)", 1.0);
    expect(model, "Pr[<=0.69](<> P.b)", 0.0);
    expect(model, "Pr[<=0.7](<> P.a && x <= 0.5)", 1.0);
    expect(model, "Pr[<=0.69](<> P.a && x <= 0.5)", 0.0);
}

#[test]
fn a_pendulum_turns_where_the_cosine_does() {
    let model = "
        clock x, v;
        process P() {
            state begin, a { x' == v && v' == -x };
            commit begin;
            init begin;
            trans begin -> a { assign x = 1, v = 0; };
        }
        system P;";
    expect_extreme(model, "E[<=10; 1](max: v)", 1.0, 1e-6);
    expect_extreme(model, "E[<=10; 1](min: x)", -1.0, 1e-6);
    expect_extreme(model, "E[<=1; 1](min: P.a ? x : 1.0)", 1.0_f64.cos(), 1e-8);
    expect(model, "Pr[<=3](<> x <= -0.99)", 0.0);
    expect(model, "Pr[<=3.1](<> x <= -0.99)", 1.0);
    expect(model, "Pr[v<=0.5](<> x <= -0.99)", 1.0);
}

/// A ball that loses a quarter of its energy with each bounce: bounces at the times of a geometric
/// series.
#[test]
fn a_ball_bounces_when_it_meets_the_ground() {
    let model = "
        hybrid clock p, v;
        int bounces = 0;
        urgent broadcast chan bounce;
        process Ball() {
            state begin, a { p' == v && v' == -10 };
            commit begin;
            init begin;
            trans begin -> a { assign p = 5, v = 0; },
                  a -> a { guard p <= 0 && v < 0; sync bounce!; assign v = -v / 2, bounces++; };
        }
        system Ball;";
    // It falls for 1, then flies for 1, 1/2, 1/4.
    for (time, bounces) in [
        (0.99, 0.0),
        (1.01, 1.0),
        (1.99, 1.0),
        (2.01, 2.0),
        (2.51, 3.0),
    ] {
        expect_extreme(
            model,
            &format!("E[<={time}; 1](max: bounces)"),
            bounces,
            0.0,
        );
    }
    expect_extreme(model, "E[<=1; 1](min: p)", 0.0, 1e-9);
    let equal = model.replace("p <= 0 && v < 0", "p == 0 && v < 0");
    expect_extreme(&equal, "E[<=2.51; 1](max: bounces)", 3.0, 0.0);
}

/// A ball that loses nothing: it meets the ground every 2 units, however often.
#[test]
fn a_ball_bounces_as_often_as_it_should() {
    let model = "
        clock p = 5.0, v;
        int bounces = 0;
        urgent broadcast chan bounce;
        process Ball() {
            state Flying { p' == v && v' == -10 };
            init Flying;
            trans Flying -> Flying {
                guard p == 0 && v < 0; sync bounce!; assign v = -v, bounces++;
            };
        }
        system Ball;";
    expect_extreme(model, "E[<=200; 1](max: bounces)", 100.0, 0.0);
    expect_extreme(model, "E[<=200; 1](min: p)", 0.0, 1e-9);
    // Its top lies between two looks that are far apart.
    expect_extreme(model, "E[<=200; 1](max: p)", 5.0, 1e-9);
    let thrown = model.replace("p = 5.0, v", "p, v = 10.0");
    expect(&thrown, "Pr[<=1.9](<> p >= 4.9999)", 1.0);
    expect(&thrown, "Pr[<=1.9](<> p >= 5.0001)", 0.0);
    expect(&thrown, "Pr[<=0.9](<> p >= 4.9999)", 0.0);
}

/// The steps of a run do not depend on the runs before it.
#[test]
fn a_run_with_equations_is_the_same_alone_and_after_others() {
    let model = "
        clock x = 1.0, y;
        process P() {
            state a { x' == y - x && y' == 1 - x * y; 2 };
            init a;
            trans a -> a { assign y = random(2); };
        }
        system P;";
    let query = "E[<=10; 1](max: x)";
    let (network, query) = load(model, query).unwrap_or_else(|message| panic!("{message}"));
    let Statistical::Expectation { bound, value, .. } = &query.kind else {
        panic!("{} asks for no expectation", query.text);
    };
    for executor in executors(&network) {
        let mut together = Runner::new(&network, &*executor);
        for run in 0..10 {
            let mut alone = Runner::new(&network, &*executor);
            let [left, right] = [&mut together, &mut alone].map(|runner| {
                let found =
                    runner.observe(RunId { seed: 1, run }, bound, Asked::Extreme(*value, true));
                found.expect("the run does not fail").value
            });
            assert_eq!(left.to_bits(), right.to_bits(), "run {run}");
        }
    }
}

/// The delay is uniform up to the moment at which the clock that flows reaches its bound.
#[test]
fn an_invariant_on_a_clock_that_flows_bounds_a_delay() {
    let model = "
        clock x, t;
        process P() {
            state begin, a { x' == x && x <= 7.38905609893065 }, b;
            commit begin;
            init begin;
            trans begin -> a { assign x = 1; }, a -> b { };
        }
        system P;";
    expect(model, "Pr[<=0.5](<> P.b)", 0.25);
    expect(model, "Pr[<=1.5](<> P.b)", 0.75);
    expect(model, "Pr[<=2.01](<> P.b)", 1.0);
    let guarded = model.replace("a -> b { }", "a -> b { guard x >= 2.718281828459045; }");
    expect(&guarded, "Pr[<=1.5](<> P.b)", 0.5);
}

/// A guard that is curved, of clocks that are linear: a product, and a function of a clock.
#[test]
fn conditions_that_are_not_linear_are_watched() {
    let model = "
        clock x, y;
        process P() {
            state a { x <= 4 }, b;
            init a;
            trans a -> b { guard x * y >= 4; };
        }
        system P;";
    expect(model, "Pr[<=3](<> P.b)", 0.5);
    expect(model, "Pr[<=2](<> x * y > 4.1)", 0.0);
    expect(model, "Pr[<=2.1](<> x * y > 4.1)", 1.0);
    let model = "
        clock x;
        bool high() { return sin(x) >= 0.5; }
        process P() {
            state a { x <= 3.141592653589793 }, b;
            init a;
            trans a -> b { guard high(); };
        }
        system P;";
    // Between pi/6 and 5 pi/6.
    expect(model, "Pr[<=1.5707963267948966](<> P.b)", 0.5);
}

/// An exponential delay beside an equation: neither knows of the other.
#[test]
fn moves_do_not_disturb_an_equation() {
    let model = "
        clock x;
        int n = 0;
        process Decay() {
            state begin, a { x' == -x };
            commit begin;
            init begin;
            trans begin -> a { assign x = 1; };
        }
        process Count() { state a { ; 20 }; init a; trans a -> a { assign n++; }; }
        system Decay, Count;";
    expect_extreme(
        model,
        "E[<=3; 1](min: Decay.a ? x : 1.0)",
        (-3.0_f64).exp(),
        1e-8,
    );
    expect(model, "Pr[<=1](<> n >= 20)", 0.529_743);
}

#[test]
fn a_fixed_step_is_eulers() {
    let model = "
        clock x;
        process P() {
            state begin, a { x' == -x };
            commit begin;
            init begin;
            trans begin -> a { assign x = 1; };
        }
        system P;";
    let (network, query) = load(model, "E[<=1; 1](min: P.a ? x : 1.0)").unwrap();
    let &Statistical::Expectation { value, .. } = &query.kind else {
        panic!("it is an expectation");
    };
    let [_, jit] = executors(&network);
    let mut runner = Runner::of(Behaviour {
        guidance: None,
        fixed_step: Some(0.25),
        ..Behaviour::new(&network, &*jit)
    });
    let outcome = runner
        .observe(
            RunId { seed: 1, run: 0 },
            query.kind.bound(),
            Asked::Extreme(value, false),
        )
        .expect("the run does not fail");
    assert!(
        (outcome.value - 0.75_f64.powi(4)).abs() < 1e-12,
        "{outcome:?}"
    );
}

#[test]
fn trajectories_follow_the_solution() {
    let model = "
        clock x;
        process P() {
            state begin, a { x' == -x };
            commit begin;
            init begin;
            trans begin -> a { assign x = 1; };
        }
        system P;";
    let (network, query) = load(model, "simulate[<=1; 1]{x, x * x}").unwrap();
    let Statistical::Simulation(asked) = &query.kind else {
        panic!("it shows runs");
    };
    let [_, jit] = executors(&network);
    let shown = simulate(
        Behaviour::new(&network, &*jit),
        asked,
        &Precision::default(),
        |_| false,
    )
    .unwrap();
    let points = &shown.runs[0].points;
    assert!(points[0].len() > 100, "{} points", points[0].len());
    for &(time, value) in points[0].iter().filter(|point| point.0 > 0.0) {
        assert!((value - (-time).exp()).abs() < 1e-8, "{time}: {value}");
    }
    let &(time, value) = points[1].last().expect("there are points");
    assert!((time - 1.0).abs() < 1e-12 && (value - (-2.0_f64).exp()).abs() < 1e-8);
}

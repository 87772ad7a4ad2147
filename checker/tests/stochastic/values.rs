//! Probabilities and expectations that have closed forms.

use checker::ir::{Asked, Statistical};
use checker::stochastic::{Behaviour, Failure, Precision, RunId, Runner, simulate};

use super::{executors, expect, load};

#[test]
fn the_faster_of_two_exponential_delays_wins_by_its_rate() {
    let model = "
        process P(const int r) {
            state a { ; r }, won, late;
            init a;
            trans a -> won { guard first; assign first = false; }, a -> late { guard !first; };
        }
        bool first = true;
        A = P(1); B = P(3);
        system A, B;";
    let model = model.replace("bool first = true;", "");
    let model = format!("bool first = true;\n{model}");
    expect(&model, "Pr[<=1000](<> A.won)", 0.25);
}

#[test]
fn an_exponential_delay_has_its_distribution() {
    let model = "
        process P() { state a { ; 1:2 }, out; init a; trans a -> out { }; }
        system P;";
    expect(model, "Pr[<=2](<> P.out)", 1.0 - (-1.0_f64).exp());
    expect(model, "Pr[<=2]([] not P.out)", (-1.0_f64).exp());
    expect(model, "Pr[<=2](P.a U P.out)", 1.0 - (-1.0_f64).exp());
}

#[test]
fn a_uniform_delay_lies_between_guard_and_invariant() {
    let model = "
        clock x;
        process P() { state a { x <= 10 }, out; init a; trans a -> out { guard x >= 4; }; }
        system P;";
    expect(model, "Pr[<=7](<> P.out)", 0.5);
    expect(model, "Pr[<=10](<> P.out)", 1.0);
    expect(model, "Pr[<=4](<> x > 4)", 0.0);
    expect(model, "Pr[<=4](<> x >= 4)", 1.0);
}

#[test]
fn a_guard_shifts_an_exponential_delay() {
    let model = "
        clock x;
        process P() { state a { ; 2 }, out; init a; trans a -> out { guard x >= 3; }; }
        system P;";
    expect(model, "Pr[<=4](<> P.out)", 1.0 - (-2.0_f64).exp());
}

#[test]
fn uniform_delays_race() {
    let model = "
        clock x;
        broadcast chan go;
        process P(const int low, const int high) {
            state a { x <= high }, won, lost;
            init a;
            trans a -> won { guard x >= low; sync go!; }, a -> lost { sync go?; };
        }
        A = P(0, 2); B = P(1, 3);
        system A, B;";
    expect(model, "Pr[<=9](<> A.won)", 0.875);
}

#[test]
fn a_disjunction_leaves_two_windows() {
    let model = "
        clock x;
        process P() {
            state a { x <= 10 }, out;
            init a;
            trans a -> out { guard x <= 1 || x >= 7; };
        }
        system P;";
    expect(model, "Pr[<=5](<> P.out)", 0.25);
    expect(model, "Pr[<=8](<> P.out)", 0.5);
}

#[test]
fn an_equality_is_a_moment() {
    let model = "
        clock x;
        process P() {
            state a { x <= 5 }, b { x <= 7 }, out;
            init a;
            trans a -> b { guard x == 5; }, b -> out { guard x == 6 || x == 7; };
        }
        system P;";
    expect(model, "Pr[<=20](<> P.out && x == 6)", 0.5);
    expect(model, "Pr[<=20](<> P.b && x < 5)", 0.0);
}

#[test]
fn stages_add_up() {
    let model = "
        clock x; int n = 0;
        process P() {
            state a { x <= 1 }, done;
            init a;
            trans a -> a { guard n < 4; assign x = 0, n++; }, a -> done { guard n == 4; };
        }
        system P;";
    expect(model, "Pr[<=2](<> P.done)", 0.225);
    let model = "
        int n = 0;
        process P() { state a { ; 10 }; init a; trans a -> a { assign n++; }; }
        system P;";
    expect(model, "Pr[<=1](<> n >= 10)", 0.542_070_285_528_147_7);
}

#[test]
fn weights_choose_branches() {
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
    expect(model, "Pr[#<=100000](<> n == 10)", 0.041_912_968_548_039_64);
}

#[test]
fn legs_that_send_are_chosen_by_weight() {
    // Who listens moves with the sender.
    let model = "
        broadcast chan high, low; int heard = 0; clock x;
        process Coin() {
            state wait { x <= 1 }, done;
            branchpoint toss;
            init wait;
            trans wait -> toss { guard x >= 1; assign heard = 10; },
                  toss -> done { sync high!; assign heard += 1; probability 3; },
                  toss -> done { sync low!; assign heard += 2; probability 1; };
        }
        process Ear() {
            state a, b;
            init a;
            trans a -> b { sync high?; assign heard = 5 * heard; };
        }
        system Coin, Ear;";
    expect(model, "Pr[<=1](<> Coin.done && heard == 55 && Ear.b)", 0.75);
    expect(model, "Pr[<=1](<> Coin.done && heard == 12 && Ear.a)", 0.25);
    expect(model, "Pr[<=1](<> Ear.b && Coin.wait)", 0.0);
}

#[test]
fn of_the_legs_that_are_possible_one_is_chosen_by_weight() {
    // Until 1 the second leg is closed; nobody receives on `alone`; a leg without a weight has 1,
    // and one of weight 0 is never drawn. The other edge counts once, however many legs this one
    // has.
    let model = "
        chan alone, meet;
        int n = 0;
        clock x;
        process P() {
            state a { x <= 1 }, b, c, d, e, f;
            branchpoint t;
            init a;
            trans a -> t { guard x >= 1; },
                  t -> b { guard n == 0; probability 2; },
                  t -> c { guard n == 1; probability 100; },
                  t -> c { sync alone!; probability 100; },
                  t -> d { sync meet!; },
                  t -> e { probability 0; },
                  a -> f { guard x >= 1; };
        }
        process Q() {
            state a, b;
            branchpoint t;
            init a;
            trans a -> t { }, t -> b { sync meet?; };
        }
        system P, Q;";
    expect(model, "Pr[<=2](<> P.b)", 1.0 / 3.0);
    expect(model, "Pr[<=2](<> P.d && Q.b)", 1.0 / 6.0);
    expect(model, "Pr[<=2](<> P.f)", 0.5);
    expect(model, "Pr[<=2](<> P.c || P.e)", 0.0);
}

#[test]
fn a_clock_with_a_rate_bounds_a_run() {
    let model = "
        clock cost;
        process P() { state a { cost' == 3 ; 1 }, out; init a; trans a -> out { }; }
        system P;";
    expect(model, "Pr[cost<=6](<> P.out)", 1.0 - (-2.0_f64).exp());
}

#[test]
fn a_quantifier_inside_another_one_sets_a_rate_once() {
    let model = "
        clock x[2], y[2]; int r[2] = {2, 4};
        process P() {
            state a { forall (i : int[0,1]) x[i]' == r[i] && forall (i : int[0,1]) y[i]' == 1 + r[i] };
            init a;
        }
        system P;";
    expect(model, "Pr[<=1](<> x[1] >= 4 && y[0] >= 3)", 1.0);
    expect(model, "Pr[<=1](<> x[0] > 2 || y[1] > 5)", 0.0);
}

#[test]
fn a_stopwatch_stands_still() {
    let model = "
        clock x, y;
        process P() {
            state a { y <= 4 && x' == 0 }, b { y <= 8 }, out;
            init a;
            trans a -> b { guard y == 4; }, b -> out { guard x >= 2; };
        }
        system P;";
    expect(model, "Pr[<=7](<> P.out)", 0.5);
}

#[test]
fn a_queue_grows_as_uniformisation_says() {
    let model = "
        int[0,100] n = 0;
        broadcast chan left;
        process Arrival() { state a { ; 1 }; init a; trans a -> a { assign n++; }; }
        process Server() {
            state idle { ; 3:2 };
            init idle;
            trans idle -> idle { guard n > 0; assign n--; };
        }
        system Arrival, Server;";
    expect(model, "Pr[<=10](<> n >= 5)", 0.247_074_521_311_354_82);
}

#[test]
fn a_binary_channel_waits_for_its_receiver() {
    let model = "
        clock x;
        chan c;
        process S() { state a { ; 1 }, out; init a; trans a -> out { sync c!; }; }
        process R() { state w, out; init w; trans w -> out { guard x >= 2; sync c?; }; }
        system S, R;";
    expect(model, "Pr[<=3](<> S.out && R.out)", 1.0 - (-1.0_f64).exp());
}

#[test]
fn urgent_and_committed_locations_take_no_time() {
    let model = "
        clock x; int n = 0;
        process P() {
            state a { x <= 1 }, b, c, out;
            commit c;
            urgent b;
            init a;
            trans a -> b { assign x = 0; }, b -> c { }, c -> out { assign n = 1; };
        }
        process Q() { state a { ; 1000000 }, b; init a; trans a -> b { }; }
        system P, Q;";
    expect(model, "Pr[<=2](<> P.c && x > 0)", 0.0);
    expect(model, "Pr[<=2](<> n == 1)", 1.0);
}

#[test]
fn an_urgent_channel_is_used_at_once() {
    let model = "
        clock x;
        urgent broadcast chan go;
        process P() {
            state a { ; 1 }, out;
            init a;
            trans a -> out { guard x >= 3; sync go!; };
        }
        system P;";
    expect(model, "Pr[<=5](<> P.out && x == 3)", 1.0);
    expect(model, "Pr[<=5](<> P.a && x > 3)", 0.0);
}

#[test]
fn who_only_sends_on_urgent_channels_needs_no_rate() {
    let model = "
        bool ready = false;
        urgent broadcast chan go;
        process P() { state a, out; init a; trans a -> out { guard ready; sync go!; }; }
        process Q() { state a { ; 2 }, b; init a; trans a -> b { assign ready = true; }; }
        system P, Q;";
    expect(model, "Pr[<=1](<> P.out)", 1.0 - (-2.0_f64).exp());
}

#[test]
fn a_rate_of_zero_is_never() {
    let model = "
        int n = 0;
        process P() { state a { ; n }, out; init a; trans a -> out { }; }
        process Q() { state a { ; 1 }, b; init a; trans a -> b { assign n = 3; }; }
        system P, Q;";
    // The sum of exponential delays with rates 1 and 3.
    let exact = 1.0 - 1.5 * (-1.0_f64).exp() + 0.5 * (-3.0_f64).exp();
    expect(model, "Pr[<=1](<> P.out)", exact);
}

#[test]
fn select_makes_an_edge_for_each_value() {
    let model = "
        int v = 0;
        process P() {
            state a { ; 1 }, out;
            init a;
            trans a -> out { select i : int[1, 4]; assign v = i; };
        }
        system P;";
    expect(model, "Pr[<=100](<> v == 3)", 0.25);
}

#[test]
fn doubles_take_clocks_and_random_numbers() {
    let model = "
        clock x; double v = 0.0; double when = 0.0;
        process P() {
            state a { x <= 4 }, out;
            init a;
            trans a -> out { assign v = random_normal(1, 2), when = x; };
        }
        system P;";
    expect(model, "Pr[<=4](<> v > 3)", 0.158_655_253_931_457_07);
    expect(model, "Pr[<=9](<> P.out && when <= 1)", 0.25);
}

#[test]
fn clocks_are_taken_by_reference() {
    let model = "
        clock x[2];
        void reset(clock &c, double v) { c = v; }
        process P(clock &c) {
            state a { c <= 4 }, out;
            init a;
            trans a -> out { guard c >= 2; assign reset(c, 0.5); };
        }
        A = P(x[1]);
        system A;";
    expect(model, "Pr[<=3](<> A.out)", 0.5);
    expect(model, "Pr[<=9](<> A.out && x[1] < 0.75)", 1.0);
}

#[test]
fn processes_of_a_set_are_asked_by_quantifiers() {
    let model = "
        const int N = 5;
        process P(int[0, N - 1] id) { state a { ; 1 }, done; init a; trans a -> done { }; }
        system P;";
    let exact = (1.0 - (-2.0_f64).exp()).powi(5);
    expect(
        model,
        "Pr[<=2](<> forall (i : int[0, N - 1]) P(i).done)",
        exact,
    );
}

#[test]
fn expectations_are_means() {
    let model = "
        double v = 0.0; clock x;
        process P() {
            state a { x <= 4 }, out { x' == 0 };
            init a;
            trans a -> out { assign v = random(4); };
        }
        system P;";
    for (query, mean) in [
        ("E[<=10; 20000](max: v)", 2.0),
        ("E[<=10; 20000](max: x)", 2.0),
        ("E[<=10; 20000](min: x)", 0.0),
    ] {
        let (network, query) = load(model, query).expect("the query compiles");
        let Statistical::Expectation { maximum, value, .. } = query.kind else {
            panic!("it is an expectation");
        };
        let bound = query.kind.bound();
        let [_, jit] = executors(&network);
        let mut runner = Runner::new(&network, &*jit);
        let runs = bound.runs.expect("the query says how many");
        let mut sum = 0.0;
        for run in 0..runs {
            sum += runner
                .observe(
                    RunId { seed: 7, run },
                    bound,
                    Asked::Extreme(value, maximum),
                )
                .expect("no run fails")
                .value;
        }
        let found = sum / runs as f64;
        // Values between 0 and 4: Hoeffding's bound at a risk of one in a million.
        let margin = 4.0 * ((2e6_f64).ln() / (2.0 * runs as f64)).sqrt();
        assert!((found - mean).abs() <= margin, "{}: {found}", query.text);
    }
}

#[test]
fn trajectories_are_linear_between_their_points() {
    let model = "
        clock x; int n = 0;
        process P() {
            state a { x <= 2 }, b { x' == 3 && x <= 9 }, out { x' == 0 };
            init a;
            trans a -> b { guard x == 2; assign n = 4; }, b -> out { guard x == 8; assign x = 1; };
        }
        system P;";
    let (network, query) = load(model, "simulate[<=5; 2]{x, n, P.b}").expect("the query compiles");
    let Statistical::Simulation(asked) = &query.kind else {
        panic!("it asks for runs");
    };
    let [interpreter, jit] = executors(&network);
    for executor in [interpreter, jit] {
        let mut runner = Runner::new(&network, &*executor);
        let shown = runner
            .trajectory(RunId { seed: 0, run: 1 }, asked)
            .expect("no run fails");
        assert_eq!(
            shown.points,
            [
                vec![(0.0, 0.0), (2.0, 2.0), (4.0, 8.0), (4.0, 1.0), (5.0, 1.0)],
                vec![(0.0, 0.0), (2.0, 0.0), (2.0, 4.0), (5.0, 4.0)],
                vec![
                    (0.0, 0.0),
                    (2.0, 0.0),
                    (2.0, 1.0),
                    (4.0, 1.0),
                    (4.0, 0.0),
                    (5.0, 0.0)
                ],
            ]
        );
    }
}

#[test]
fn a_filter_ends_the_run_where_it_holds() {
    let model = "
        clock x; double d = 0.0;
        process P() {
            state a { x <= 4 }, out;
            init a;
            trans a -> out { assign d = x; };
        }
        system P;";
    let (network, query) =
        load(model, "simulate[<=5; 100]{x, x * x} : 3 : x >= 3 && P.a").expect("it compiles");
    let Statistical::Simulation(asked) = &query.kind else {
        panic!("it asks for runs");
    };
    let [_, jit] = executors(&network);
    let precision = Precision::default();
    let shown = simulate(Behaviour::new(&network, &*jit), asked, &precision, |_| {
        false
    })
    .expect("no run fails");
    assert_eq!(shown.runs.len(), 3);
    for run in &shown.runs {
        assert_eq!(run.points[0], [(0.0, 0.0), (3.0, 3.0)]);
        // A square is shown at many moments.
        assert!(run.points[1].len() > 150, "{:?}", run.points[1].len());
        for &(time, value) in &run.points[1] {
            assert!((value - time * time).abs() < 1e-9);
        }
    }
    let estimate = shown.estimate.expect("there is a filter");
    assert!(
        estimate.lower < 0.25 && 0.25 < estimate.upper,
        "{estimate:?}"
    );
}

#[test]
fn moves_at_the_bound_count() {
    let model = "
        clock x;
        process A() { state a { x <= 3 }, out; init a; trans a -> out { guard x >= 3; }; }
        process B() {
            state a { x <= 3 }, b, out;
            commit b;
            init a;
            trans a -> b { guard x >= 3; }, b -> out { };
        }
        first = A(); second = A(); third = B();
        system first, second, third;";
    expect(
        model,
        "Pr[<=3](<> first.out && second.out && third.out)",
        1.0,
    );
    expect(
        model,
        "Pr[<=2.9](<> first.out || second.out || third.b)",
        0.0,
    );
}

#[test]
fn a_value_that_is_no_number_is_an_error() {
    let model = "
        double v = 0.0;
        process P() { state a { ; 5 }, b; init a; trans a -> b { assign v = sqrt(0 - 1.0); }; }
        system P;";
    let (network, query) = load(model, "E[<=9; 50](max: v)").unwrap();
    let &Statistical::Expectation { value, .. } = &query.kind else {
        panic!("it is an expectation");
    };
    let [_, jit] = executors(&network);
    let mut runner = Runner::new(&network, &*jit);
    let asked = Asked::Extreme(value, true);
    let failed = runner.observe(RunId { seed: 1, run: 0 }, query.kind.bound(), asked);
    assert_eq!(failed, Err(Failure::NoNumber));
}

#[test]
fn a_committed_receiver_may_be_left_by_a_broadcast_of_others() {
    let model = "
        broadcast chan go;
        process P() { state a { ; 1 }, b; init a; trans a -> b { sync go!; }; }
        process Q() { state c, d; commit c; init c; trans c -> d { sync go?; }; }
        system P, Q;";
    expect(model, "Pr[<=1](<> P.b && Q.d)", 1.0);
}

#[test]
fn a_strict_guard_does_not_hold_at_its_bound() {
    let model = "
        clock x;
        broadcast chan go;
        process P() { state a { x <= 1 }, b; init a; trans a -> b { guard x == 1; sync go!; }; }
        process Q() { state c, d; init c; trans c -> d { guard x > 1; sync go?; }; }
        process R() { state e, f; init e; trans e -> f { guard x >= 1; sync go?; }; }
        system P, Q, R;";
    expect(model, "Pr[<=2](<> P.b && R.f)", 1.0);
    expect(model, "Pr[<=2](<> Q.d)", 0.0);
}

#[test]
fn locals_of_functions_begin_with_random_numbers() {
    let model = "
        double d = 0.0;
        int dice() { double drawn = random(6), half = drawn / 2; return fint(half * 2 + 1); }
        int n = 0;
        process P() {
            state a { ; 1 }, b;
            init a;
            trans a -> b { assign n = dice(); };
        }
        system P;";
    expect(model, "Pr[<=100](<> n == 6)", 1.0 / 6.0);
}

/// Rounding may put a move a little behind the bound, where the run ends all the same.
#[test]
fn moves_a_little_behind_the_bound_end_a_run() {
    let model = "
        clock x, y;
        int n = 0;
        process P() { state a { x <= 10000 }; init a; trans a -> a { guard x == 10000; assign x = 0; }; }
        process Q() { state a { y <= 30000 }; init a; trans a -> a { guard y == 30000; assign y = 0, n++; }; }
        process R() { state a { ; 1:500 }; init a; trans a -> a { }; }
        system P, Q, R;";
    expect(model, "Pr[<=300000](<> n >= 9)", 1.0);
}

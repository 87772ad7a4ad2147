//! Random runs under strategies of games: closed forms, and random games in which a strategy must
//! keep what it promises.

use std::fmt::Write as _;
use std::fs;
use std::sync::Arc;

use checker::engine::{CodeEngine, Limits, LoadedModel, Options, Verdict};
use checker::learning::Learning;
use checker::search::limits::StopReason;
use checker::stochastic::{Estimate, Precision, UnderChoice};

use crate::checks::{ask, interpreted, load, try_ask};
use crate::random::{Random, networks};

fn options(choice: UnderChoice, runs: u64) -> Options {
    Options {
        under_choice: choice,
        precision: Precision {
            runs: Some(runs),
            ..Precision::default()
        },
        ..Options::default()
    }
}

#[track_caller]
fn estimate(model: &mut LoadedModel, query: &str, options: &Options) -> Estimate {
    let answer = ask(model, query, options);
    answer.estimate.expect("there is an estimate")
}

/// What chooses between two doors and a pit at once.
const PIT: &str = "
    process P() {
        state start, left, right, pit;
        commit start;
        init start;
        trans start -> left { }, start -> right { }, start -> pit { };
    }
    system P;";

/// The model, with the strategy S that this query gives.
#[track_caller]
fn with_strategy(text: &str, query: &str) -> LoadedModel {
    let mut model = load(text);
    let answer = ask(
        &mut model,
        &format!("strategy S = {query}"),
        &Options::default(),
    );
    assert_eq!(answer.verdict, Verdict::Satisfied, "{query}");
    model
}

/// Checks the probability of a query under S: exactly, if it is 0 or 1. Interpreter and compiled
/// code must agree, and so must numbers of threads.
#[track_caller]
fn expect(model: &mut LoadedModel, choice: UnderChoice, path: &str, probability: f64) {
    const RUNS: u64 = 10_000;
    let query = format!("{path} under S");
    let found = estimate(model, &query, &options(choice, RUNS));
    let margin = if probability.fract() == 0.0 {
        0.0
    } else {
        // Two-sided, at a risk of one in a million.
        ((2e6_f64).ln() / (2.0 * RUNS as f64)).sqrt()
    };
    assert!(
        (found.value - probability).abs() <= margin,
        "{query}, {choice:?}: {} instead of {probability}",
        found.value
    );
    let few = options(choice, 300);
    let compiled = estimate(model, &query, &few);
    for threads in [2, 4] {
        let shared = Options {
            threads,
            ..few.clone()
        };
        assert_eq!(
            compiled,
            estimate(model, &query, &shared),
            "{threads} threads"
        );
    }
    let code = CodeEngine::Interpreter;
    let interpreted = Options { code, ..few };
    assert_eq!(compiled, estimate(model, &query, &interpreted));
}

/// A controller that may go from time 2 on, an alarm after time 5 unless it has gone, and what says
/// how long the controller waits.
fn deadline(wait: &str) -> String {
    let wait = if wait.is_empty() {
        String::new()
    } else {
        format!("{{ {wait} }}")
    };
    format!(
        "clock x;
        const int early = 2;
        bool waiting = true;
        process C() {{
            state wait {wait}, done;
            init wait;
            trans wait -> done {{ guard x >= early; assign waiting = false; }};
        }}
        process E() {{
            state calm {{ ; 50 }}, alarm;
            init calm;
            trans calm -u-> alarm {{ guard x > 5 && waiting; }};
        }}
        c = C(); e = E();
        system c, e;"
    )
}

/// How likely a process has moved when this part of the time is over in which the strategy lets it,
/// if it draws uniformly and has so many moves to weigh against waiting. The moments that it draws,
/// one after the other, each uniform in the rest, are a Poisson process in -log of the rest, of
/// which waiting takes one in `moves + 1` away.
fn weighed(part: f64, moves: u32) -> f64 {
    1.0 - (1.0 - part).powf(f64::from(moves) / f64::from(moves + 1))
}

#[test]
fn a_choice_without_time_is_uniform_among_what_is_allowed() {
    let mut model = with_strategy(PIT, "control: A[] not P.pit");
    for choice in [UnderChoice::Race, UnderChoice::Eager] {
        expect(&mut model, choice, "Pr[<=1](<> P.pit)", 0.0);
        expect(&mut model, choice, "Pr[<=1](<> P.left)", 0.5);
        expect(&mut model, choice, "Pr[<=1](<> P.left || P.right)", 1.0);
    }
    let free = estimate(
        &mut model,
        "Pr[<=1](<> P.pit)",
        &options(UnderChoice::Race, 3000),
    );
    assert!((free.value - 1.0 / 3.0).abs() < 0.05, "{free:?}");
}

#[test]
fn a_bounded_delay_is_uniform_until_the_strategy_demands_a_move() {
    let mut model = with_strategy(&deadline("x <= 10"), "control: A[] not e.alarm");
    let race = UnderChoice::Race;
    expect(&mut model, race, "Pr[<=20](<> e.alarm)", 0.0);
    expect(
        &mut model,
        race,
        "Pr[<=3](<> c.done)",
        weighed(1.0 / 3.0, 1),
    );
    expect(&mut model, race, "Pr[<=5](<> c.done)", 1.0);
    expect(&mut model, race, "Pr[<=20]([] c.wait imply x <= 5)", 1.0);
}

#[test]
fn an_exponential_delay_ends_when_the_strategy_demands_a_move() {
    let mut model = with_strategy(&deadline("; 1:2"), "control: A[] not e.alarm");
    let race = UnderChoice::Race;
    // Half of the rate: waiting is as likely as moving.
    let until = |time: f64| 1.0 - (-0.25 * (time - 2.0)).exp();
    expect(&mut model, race, "Pr[<=3](<> c.done)", until(3.0));
    expect(&mut model, race, "Pr[<=4.999](<> c.done)", until(4.999));
    expect(&mut model, race, "Pr[<=5](<> c.done)", 1.0);
    expect(&mut model, race, "Pr[<=20](<> e.alarm)", 0.0);
    // The mean of the least of 5 and a shifted exponential time.
    let mean = 2.0 + (1.0 - (-0.75_f64).exp()) / 0.25;
    let query = "E[<=5; 20000](max: c.wait ? x : 0) under S";
    let found = ask(&mut model, query, &Options::default())
        .estimate
        .expect("a mean");
    assert!((found.value - mean).abs() < 0.05, "{found:?}, not {mean}");
}

#[test]
fn without_a_rate_the_delay_is_uniform_until_the_demand() {
    let mut model = with_strategy(&deadline(""), "control: A[] not e.alarm");
    let race = UnderChoice::Race;
    expect(
        &mut model,
        race,
        "Pr[<=3](<> c.done)",
        weighed(1.0 / 3.0, 1),
    );
    expect(&mut model, race, "Pr[<=20](<> e.alarm)", 0.0);
    // Nothing says how long it waits without the strategy.
    let query = "Pr[<=3](<> c.done)";
    let refused = try_ask(&mut model, query, &Options::default()).expect_err("it fails");
    assert!(refused.rendered[0].contains("E0806"), "{refused:?}");
}

#[test]
fn waiting_is_one_choice_more_and_none_of_the_environments() {
    let text = "
        process P() {
            state start { ; 3 }, left, right, slipped, pit;
            init start;
            trans start -> left { }, start -> right { }, start -u-> slipped { }, pit -u-> pit { };
        }
        system P;";
    let mut model = with_strategy(text, "control: A[] not P.pit");
    let race = UnderChoice::Race;
    // Each edge has a third of the rate 3, of which waiting takes a third from those of the
    // controller.
    let rates = (2.0 / 3.0, 1.0);
    let all = 2.0 * rates.0 + rates.1;
    expect(&mut model, race, "Pr[<=50](<> P.slipped)", rates.1 / all);
    expect(&mut model, race, "Pr[<=50](<> P.left)", rates.0 / all);
    let by_half = 1.0 - (-0.5 * all).exp();
    expect(&mut model, race, "Pr[<=0.5]([] P.start)", 1.0 - by_half);
    let text = text
        .replace("; 3 }", "x <= 2 }")
        .replace("process P() {", "clock x; process P() {");
    let text = text.replace(", start -u-> slipped { }", "");
    let mut model = with_strategy(&text, "control: A[] not P.pit");
    expect(
        &mut model,
        race,
        "Pr[<=1]([] P.start)",
        1.0 - weighed(0.5, 2),
    );
    expect(&mut model, race, "Pr[<=2](<> P.left)", 0.5);
}

#[test]
fn a_reach_strategy_leaves_all_that_keeps_the_win() {
    let text = "
        clock time;
        process Job() {
            clock x;
            state Idle { ; 2 }, Work { x <= 3 }, Done { ; 1 }, Left;
            init Idle;
            trans
                Idle -> Work { assign x = 0; },
                Work -u-> Done { guard x >= 2; },
                Done -> Left { };
        }
        Kim = Job();
        system Kim;";
    let mut model = with_strategy(text, "control: A<> Kim.Done && time <= 8");
    let race = UnderChoice::Race;
    expect(&mut model, race, "Pr[<=8](<> Kim.Done)", 1.0);
    expect(&mut model, race, "Pr[<=1]([] Kim.Idle)", (-1.0_f64).exp());
    expect(
        &mut model,
        race,
        "Pr[<=4.999]([] Kim.Idle)",
        (-4.999_f64).exp(),
    );
    expect(&mut model, race, "Pr[<=5]([] Kim.Idle)", 0.0);
    expect(
        &mut model,
        UnderChoice::Lazy,
        "Pr[<=4.99]([] Kim.Idle)",
        1.0,
    );
    expect(&mut model, UnderChoice::Eager, "Pr[<=3](<> Kim.Done)", 1.0);
    // Once the goal is reached there is nothing to weigh: the rate is that of the location. Eager,
    // it is reached uniformly between 2 and 3.
    let stays = (1.0_f64.exp() - 1.0) * (-2.0_f64).exp();
    expect(
        &mut model,
        UnderChoice::Eager,
        "Pr[<=4](<> Kim.Left)",
        1.0 - stays,
    );
}

#[test]
fn the_controller_is_eager_or_lazy() {
    let mut model = with_strategy(&deadline(""), "control: A[] not e.alarm");
    expect(&mut model, UnderChoice::Eager, "Pr[<=2](<> c.done)", 1.0);
    expect(&mut model, UnderChoice::Eager, "Pr[<=1.99](<> c.done)", 0.0);
    expect(&mut model, UnderChoice::Lazy, "Pr[<=4.99](<> c.done)", 0.0);
    expect(&mut model, UnderChoice::Lazy, "Pr[<=5](<> c.done)", 1.0);
    for choice in [UnderChoice::Eager, UnderChoice::Lazy] {
        expect(&mut model, choice, "Pr[<=20](<> e.alarm)", 0.0);
    }
}

#[test]
fn a_strategy_that_must_wait_does() {
    let text = "
        clock x;
        process C() {
            state wait, done;
            init wait;
            trans wait -> done { guard x > 3; };
        }
        process E() {
            state idle { x <= 6 }, on;
            init idle;
            trans idle -u-> on { guard x >= 1; };
        }
        c = C(); e = E();
        system c, e;";
    let mut model = with_strategy(text, "control: A<> c.done");
    for choice in [UnderChoice::Race, UnderChoice::Eager, UnderChoice::Lazy] {
        // There is no first moment after 3: one soon after it is taken.
        expect(&mut model, choice, "Pr[<=3](<> c.done)", 0.0);
        expect(&mut model, choice, "Pr[<=3.0001](<> c.done)", 1.0);
        expect(&mut model, choice, "Pr[<=10](<> c.done && e.idle)", 0.6);
    }
}

#[test]
fn a_strategy_waits_for_the_environment() {
    // The controller wins only once the environment has moved, and then within a time of its own.
    let text = "
        clock x, y;
        bool ready = false;
        process C() {
            state wait, done;
            init wait;
            trans wait -> done { guard ready && y >= 2; };
        }
        process E() {
            state idle { x <= 4 }, on;
            init idle;
            trans idle -u-> on { assign ready = true, y = 0; };
        }
        c = C(); e = E();
        system c, e;";
    let mut model = with_strategy(text, "control: A<> c.done");
    expect(&mut model, UnderChoice::Race, "Pr[<=6](<> c.done)", 1.0);
    expect(&mut model, UnderChoice::Race, "Pr[<=3](<> c.done)", 0.25);
}

#[test]
fn receivers_and_values_of_select_are_those_of_the_strategy() {
    let text = "
        broadcast chan go[3]; chan pass;
        int taken = 0; bool heard = false;
        struct { clock c; int n; } record;
        process C() {
            state start, sent, end;
            commit start, sent;
            init start;
            trans
                start -> sent { select i : int[0, 2]; sync go[i]!; assign taken = i; },
                sent -> end { sync pass!; };
        }
        process L() {
            state off, on, pit;
            init off;
            trans
                off -> on { guard taken == 0; sync go[1]?; assign heard = true, record.n = 7; },
                off -> pit { sync go[2]?; },
                on -> on { sync pass?; }, on -> pit { sync pass?; },
                off -> off { sync pass?; };
        }
        c = C(); l = L();
        system c, l;";
    let mut model = with_strategy(text, "control: A[] not l.pit");
    let race = UnderChoice::Race;
    expect(&mut model, race, "Pr[<=1](<> l.pit)", 0.0);
    expect(&mut model, race, "Pr[<=1](<> heard)", 0.5);
    expect(&mut model, race, "Pr[<=1](<> c.end)", 1.0);
    let mut model = with_strategy(text, "control: A<> c.end && record.n == 7");
    expect(
        &mut model,
        race,
        "Pr[<=1](<> c.end && heard && taken == 1)",
        1.0,
    );
}

#[test]
fn an_edge_is_that_of_the_strategy_and_the_leg_is_drawn() {
    // The strategy takes the edge that leads to `b`, whoever the leg meets, and not the one to `c`.
    let text = "
        chan meet; broadcast chan tell; clock x;
        process P() {
            state start { x <= 2 }, met, told, left, lost;
            branchpoint b, c;
            init start;
            trans start -> b { select i : int[0, 1]; guard x >= 1 && i == 1; },
                  b -> met { sync meet!; probability 2; },
                  b -> told { sync tell!; probability 5; },
                  b -> left { select i : int[0, 2]; guard i < 1; probability 1; },
                  start -> c { guard x >= 1; },
                  c -> left { sync tell!; }, c -> lost { guard x >= 0; };
        }
        process Q() {
            state on, off;
            init on;
            trans on -> off { sync meet?; }, on -> off { sync tell?; };
        }
        system P, Q;";
    let mut model = with_strategy(text, "control: A<> (P.met || P.told || P.left) && x <= 2");
    for choice in [UnderChoice::Race, UnderChoice::Eager, UnderChoice::Lazy] {
        expect(&mut model, choice, "Pr[<=3](<> P.met && Q.off)", 0.25);
        expect(&mut model, choice, "Pr[<=3](<> P.told && Q.off)", 0.625);
        expect(&mut model, choice, "Pr[<=3](<> P.left && Q.on)", 0.125);
        expect(&mut model, choice, "Pr[<=3](<> P.lost)", 0.0);
    }
}

#[test]
fn other_objectives_and_limits_of_time_are_followed() {
    let text = "
        clock x;
        process C() {
            state wait { x <= 3 }, work { x <= 2 }, off;
            init wait;
            trans
                wait -> work { guard x >= 1; assign x = 0; },
                work -u-> wait { assign x = 0; },
                wait -> off { };
        }
        system C;";
    let mut model = with_strategy(text, "control: A[] (not C.off && A<> C.work)");
    expect(&mut model, UnderChoice::Race, "Pr[<=50](<> C.off)", 0.0);
    expect(&mut model, UnderChoice::Race, "Pr[<=3](<> C.work)", 1.0);
    let text = "
        clock x;
        process C() {
            state a, b, c;
            init a;
            trans a -> b { guard x >= 1; assign x = 0; }, b -> c { guard x >= 1; };
        }
        system C;";
    let mut model = with_strategy(text, "control_t*(5): A<> C.c");
    expect(&mut model, UnderChoice::Race, "Pr[<=5](<> C.c)", 1.0);
    expect(&mut model, UnderChoice::Race, "Pr[<=1.99](<> C.c)", 0.0);
}

#[test]
fn a_strategy_from_a_file_is_followed() {
    let folder = std::env::temp_dir().join(format!("ntagen-under-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("there is a folder");
    let in_folder = Options {
        folder: Some(folder.clone()),
        allow_write: vec![folder.clone()],
        ..options(UnderChoice::Race, 500)
    };
    let text = deadline("x <= 10");
    let query = "Pr[<=3](<> c.done) under S";
    let mut model = with_strategy(&text, "control: A[] not e.alarm");
    let first = estimate(&mut model, query, &in_folder);
    ask(&mut model, "saveStrategy(\"s.json\", S)", &in_folder);
    let mut model = load(&text);
    ask(
        &mut model,
        "strategy S = loadStrategy{}->{}(\"s.json\")",
        &in_folder,
    );
    assert_eq!(first, estimate(&mut model, query, &in_folder));
    // One that demands what the model cannot do.
    let other = text.replace("early = 2", "early = 9");
    let mut model = load(&other);
    ask(
        &mut model,
        "strategy S = loadStrategy{}->{}(\"s.json\")",
        &in_folder,
    );
    let refused = try_ask(&mut model, query, &in_folder).expect_err("it fails");
    assert!(
        refused.rendered[0].contains("demands a move"),
        "{refused:?}"
    );
    fs::remove_dir_all(&folder).expect("the folder goes");
}

#[test]
fn unknown_strategies_are_refused() {
    let mut model = load(&deadline("x <= 10"));
    let refused = try_ask(
        &mut model,
        "Pr[<=3](<> c.done) under T",
        &Options::default(),
    );
    let unknown = refused.expect_err("it is refused").rendered.join("\n");
    assert!(unknown.contains("there is no strategy 'T'"), "{unknown}");
}

/// A game of two processes in which time never locks: who must leave a location can.
fn game(random: &mut Random) -> String {
    let mut text = String::from("clock x, y; int[0, 3] n = 0; broadcast chan a, b;\n");
    for process in ["P", "Q"] {
        let clock = random.one_of(&["x", "y"]);
        let mut states = Vec::new();
        let mut edges = Vec::new();
        for place in 0..4 {
            let rate = random.one_of(&["1", "2", "1:3"]);
            // The initial location has no invariant, so all entries of the others reset the clock.
            let bound = (place > 0 && random.chance(50)).then(|| 1 + random.below(4));
            states.push(match bound {
                Some(bound) => {
                    // Whoever has to go can.
                    edges.push(format!("s{place} -u-> s0 {{ }}"));
                    format!("s{place} {{ {clock} <= {bound} ; {rate} }}")
                }
                None => format!("s{place} {{ ; {rate} }}"),
            });
            for _ in 0..=random.below(3) {
                let arrow = random.one_of(&["->", "->", "-u->"]);
                let other = random.one_of(&["x", "y"]);
                let relation = random.one_of(&["<", "<=", ">", ">=", ">="]);
                let constant = random.below(5);
                let sync = random.one_of(&["", "", "sync a!;", "sync b!;", "sync a?;", "sync b?;"]);
                let count = random.one_of(&["", ", n = 1", ", n = 2"]);
                // The controller lets time pass in every loop.
                let pause = match arrow {
                    "->" => format!("&& {clock} {} 1", random.one_of(&[">", ">="])),
                    _ => String::new(),
                };
                let data = random.one_of(&["", "", "&& n == 1", "&& n != 1"]);
                edges.push(format!(
                    "s{place} {arrow} s{} {{ guard {other} {relation} {constant} {data} {pause}; {sync} \
                     assign {clock} = 0{count}; }}",
                    random.below(4)
                ));
            }
        }
        let (states, edges) = (states.join(", "), edges.join(",\n        "));
        let _ = writeln!(
            text,
            "process {process}() {{\n    state {states};\n    init s0;\n    trans {edges};\n}}"
        );
    }
    text + "system P, Q;\n"
}

#[test]
fn strategies_keep_their_promises_in_random_runs() {
    let (mut kept, mut reached) = (0, 0);
    for number in 1..=networks(120) {
        let mut random = Random::of_network(number);
        let text = game(&mut random);
        let mut model = load(&text);
        let bad = random.one_of(&["P.s3", "Q.s2 && P.s1", "P.s2 && x > 1", "n == 2 && Q.s1"]);
        let goal = random.one_of(&[
            "P.s1 || P.s2",
            "not P.s0",
            "Q.s1 && x >= 2",
            "n > 0",
            "P.s3",
        ]);
        let choice = [UnderChoice::Race, UnderChoice::Eager, UnderChoice::Lazy][random.below(3)];
        for (query, path, probability) in [
            (
                format!("control: A[] not ({bad})"),
                format!("Pr[<=40](<> {bad})"),
                0.0,
            ),
            (
                format!("control: A<> {goal}"),
                format!("Pr[<=4000](<> {goal})"),
                1.0,
            ),
        ] {
            let define = format!("strategy S = {query}");
            if ask(&mut model, &define, &interpreted()).verdict != Verdict::Satisfied {
                continue;
            }
            let path = format!("{path} under S");
            let few = Options {
                code: CodeEngine::Interpreter,
                ..options(choice, 100)
            };
            match try_ask(&mut model, &path, &few) {
                Ok(answer) => {
                    let found = answer.estimate.expect("an estimate");
                    let is_kept = found.value.to_bits() == f64::to_bits(probability);
                    assert!(
                        is_kept,
                        "{number}, {choice:?}: {query}\n{path}\n{found:?}\n{text}"
                    );
                    *(if probability > 0.0 {
                        &mut reached
                    } else {
                        &mut kept
                    }) += 1;
                }
                // Runs of no length have no end; all else is a defect.
                Err(rejection) => {
                    let message = rejection.rendered.join("\n");
                    assert!(
                        message.contains("moves take less"),
                        "{number}: {message}\n{text}"
                    );
                }
            }
        }
    }
    assert!(
        kept > 20 && reached > 5,
        "{kept} are kept, {reached} reached"
    );
}

#[test]
fn comparisons_may_name_their_strategy_behind_both_probabilities() {
    let mut model = with_strategy(PIT, "control: A[] not P.pit");
    ask(&mut model, "strategy T = control: A[] true", &interpreted());
    let options = options(UnderChoice::Race, 3000);
    let [once, twice] = ["", "under S "].map(|first| {
        let query = format!("Pr[<=1](<> P.pit) {first}>= Pr[<=1](<> P.left) under S");
        let answer = ask(&mut model, &query, &options);
        assert_eq!(answer.verdict, Verdict::NotSatisfied, "{query}");
        answer.estimate.expect("there is one")
    });
    assert_eq!(once, twice);
    assert_eq!(twice.satisfied_runs, Some(0));
    // A number has no strategy: the only one may stand on either side of it.
    for query in [
        "Pr[<=1](<> P.left) under S >= 0.4",
        "Pr[<=1](<> P.left) >= 0.4 under S",
    ] {
        assert_eq!(
            ask(&mut model, query, &options).verdict,
            Verdict::Satisfied,
            "{query}"
        );
    }
    for (second, words) in [
        (" under T", "under 'S' and the second under 'T'"),
        ("", "under 'S' and the second under no strategy"),
    ] {
        let query = format!("Pr[<=1](<> P.pit) under S <= Pr[<=1](<> P.left){second}");
        let refused = try_ask(&mut model, &query, &options).expect_err("it is refused");
        let message = &refused.rendered[0];
        assert!(message.contains("E0274"), "{message}");
        assert!(message.contains(words), "{message}");
        assert!(message.contains("query:1:25"), "{message}");
    }
    let unknown = "Pr[<=1](<> P.pit) under U >= Pr[<=1](<> P.left) under U";
    let refused = try_ask(&mut model, unknown, &options).expect_err("it is refused");
    assert!(refused.rendered[0].contains("E0275"), "{refused:?}");
    assert_eq!(refused.rendered.len(), 2, "{refused:?}");
}

#[test]
fn learning_that_is_cut_off_leaves_no_strategy() {
    let text = "
        double level = 5;
        clock x;
        process Tank() {
            state Choose { x <= 1 }, Wait { x <= 1 };
            init Choose;
            trans Choose -> Wait { guard x >= 1; assign level = level + 2.5, x = 0; },
                Choose -> Wait { guard x >= 1; assign level = level - 5, x = 0; },
                Wait -u-> Choose { guard x >= 1; assign x = 0; };
        }
        system Tank;";
    let mut model = load(text);
    let shield = "strategy Shield = acontrol: A[] level >= 0 && level < 8 { level[0,10]:4 }";
    ask(&mut model, shield, &interpreted());
    let cut = Options {
        limits: Limits {
            // The counters of an iteration are those of its runs.
            observer: Some(Arc::new(|counters| {
                (counters.explored > 0).then_some(StopReason::Interrupted)
            })),
            ..Limits::default()
        },
        learning: Learning {
            learning_runs: Some(10_000_000),
            ..Learning::default()
        },
        ..interpreted()
    };
    let query = "strategy S = minE(level)[<=1000] {} -> {level}: <> false under Shield";
    let answer = ask(&mut model, query, &cut);
    assert_eq!(
        answer.verdict,
        Verdict::Unknown(StopReason::Interrupted),
        "{answer:?}"
    );
    let few = options(UnderChoice::Race, 10);
    ask(&mut model, "Pr[<=9](<> level < 0) under Shield", &few);
    let refused = try_ask(&mut model, "Pr[<=9](<> level < 0) under S", &few);
    let refused = refused.expect_err("there is no S");
    let message = &refused.rendered[0];
    assert!(message.contains("there is no strategy 'S'"), "{message}");
    assert!(message.contains("minE(level)"), "{message}");
}

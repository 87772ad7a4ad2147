//! Learned strategies in files: what is read is written again, other spellings mean the same, what
//! does not fit is refused, and the code in C decides as the strategy does.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use checker::engine::format::learned_code::Language;
use checker::engine::{Answer, LoadedModel, Options, Verdict};
use checker::learning::LearnedStrategy;
use serde_json::{Value, json};

use crate::c_programs::{compiled, in_folder};
use crate::checks::{ask, interpreted, load, try_ask};
use crate::random::Random;

/// The controller has an edge with `select`, two edges that look the same, an edge to a branch
/// point, one with a quantifier, and one with a value that no label names.
const MODEL: &str = "
clock x, y;
int[-2,9] n;
double level;
bool flags[3];
broadcast chan go[3];
process P() {
  state A, B, C;
  branchpoint Fork;
  init A;
  trans A -> B { select i : int[0,2]; guard n + i < 9 && x >= i; sync go[i]!; assign n = i; },
        A -> B { guard x <= 5; assign n = 1; },
        A -> B { guard x <= 5; assign n = 1; },
        B -> A { select i : int[0,1]; guard forall (k : int[0,2]) flags[k] || i == 0; },
        B -> C { select j : int[-1,0]; },
        C -> Fork { assign level = 0.5; },
        Fork -> A { probability 1; },
        Fork -> B { assign n = 0; probability 2; };
}
process Q(const int number) {
  state Idle, Busy;
  init Idle;
  trans Idle -u-> Busy { guard y > number; assign y = 0; }, Busy -u-> Idle { };
}
One = Q(1);
system P, One;
";

/// The texts of the controller's moves.
const ACTIONS: [&str; 11] = [
    "P.A->P.B { n + 0 < 9 && x >= 0, go[0]!, n = 0 }",
    "P.A->P.B { n + 1 < 9 && x >= 1, go[1]!, n = 1 }",
    "P.A->P.B { n + 2 < 9 && x >= 2, go[2]!, n = 2 }",
    "P.A->P.B { x <= 5, tau, n = 1 } [edge=1]",
    "P.A->P.B { x <= 5, tau, n = 1 } [edge=2]",
    "P.B->P.A { forall (k : int[0,2]) flags[k] || i == 0, tau, 1 } [i=0]",
    "P.B->P.A { forall (k : int[0,2]) flags[k] || i == 0, tau, 1 } [i=1]",
    "P.B->P.C { 1, tau, 1 } [j=-1]",
    "P.B->P.C { 1, tau, 1 } [j=0]",
    "P.C->(P.A|P.B) { 1, tau, level = 0.5 }",
    "WAIT",
];

fn location_names() -> Value {
    json!({
        "P.location": { "0": "A", "1": "B", "2": "C" },
        "One.location": { "0": "Idle", "1": "Busy" },
    })
}

/// A strategy with random trees over two continuous features.
fn file(random: &mut Random, minimises: bool) -> Value {
    let actions = ACTIONS.iter().enumerate();
    let actions: serde_json::Map<String, Value> = actions
        .map(|(number, text)| (number.to_string(), json!(text)))
        .collect();
    let mut regressors = serde_json::Map::new();
    for location in 0..3 {
        for n in [-2, 0, 3, 9] {
            for level in ["0.5", "1e-9", "3"] {
                let all = 0..ACTIONS.len();
                let tried: Vec<usize> = all.filter(|_| random.below(3) > 0).collect();
                let tried = tried.into_iter();
                let trees: serde_json::Map<String, Value> = tried
                    .map(|action| (action.to_string(), tree(random, 4)))
                    .collect();
                let regressor = json!({
                    "type": "act->point->val", "representation": "simpletree",
                    "minimize": i32::from(minimises), "regressor": trees,
                });
                regressors.insert(format!("({location},{n},{level})"), regressor);
            }
        }
    }
    json!({
        "version": 1.0, "type": "state->regressor", "representation": "map",
        "actions": actions,
        "statevars": ["P.location", "n", "level"], "pointvars": ["x", "y - x"],
        "locationnames": location_names(),
        "regressors": regressors,
    })
}

/// Few different numbers, so that some actions are worth the same.
fn tree(random: &mut Random, depth: usize) -> Value {
    if depth == 0 || random.below(3) == 0 {
        return json!(random.below(9) as f64 / 3.0 - 1.0);
    }
    json!({
        "var": random.below(2),
        "bound": random.below(40) as f64 / 4.0 - 3.0,
        "low": tree(random, depth - 1),
        "high": tree(random, depth - 1),
    })
}

struct Folder<'f> {
    place: &'f Path,
    options: Options,
}

impl Folder<'_> {
    fn new(place: &Path) -> Folder<'_> {
        let options = Options {
            folder: Some(place.to_owned()),
            allow_write: vec![place.to_owned()],
            ..interpreted()
        };
        Folder { place, options }
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.place.join(name), text).expect("the folder can be written");
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.place.join(name)).expect("the file is there")
    }

    fn ask(&self, model: &mut LoadedModel, query: &str) -> Answer {
        ask(model, query, &self.options)
    }

    fn loaded(&self, model: &mut LoadedModel, query: &str) -> Arc<LearnedStrategy> {
        let answer = self.ask(model, query);
        assert_eq!(answer.verdict, Verdict::Satisfied);
        answer.evidence.learned.expect("it is a learned strategy")
    }

    /// Why a file is refused.
    fn refusal(&self, model: &mut LoadedModel, text: &str, features: &str) -> String {
        self.write("bad.json", text);
        let query = format!("strategy S = loadStrategy {features}(\"bad.json\")");
        match try_ask(model, &query, &self.options) {
            Ok(answer) => panic!("{text} is read: {:?}", answer.message),
            Err(rejection) => rejection.rendered.join("\n"),
        }
    }
}

#[test]
fn what_is_read_is_written_again() {
    in_folder("learned-again", |place| {
        let folder = Folder::new(place);
        let random = &mut Random::of_network(1);
        for round in 0..20 {
            folder.write("a.json", &file(random, round % 2 == 0).to_string());
            let mut model = load(MODEL);
            let first = folder.loaded(&mut model, "strategy S = loadStrategy(\"a.json\")");
            folder.ask(&mut model, "saveStrategy(\"b.json\", S)");
            let text = folder.read("b.json");
            let written: Value = serde_json::from_str(&text).expect("it is JSON");
            let actions = written["actions"].as_object().expect("they are there");
            assert!(actions.iter().all(|(number, text)| {
                let number: usize = number.parse().expect("it is a number");
                ACTIONS[number] == *text
            }));
            assert_eq!(written["locationnames"], location_names());
            let mut model = load(MODEL);
            let features = "{P.location,n , level} -> {x, y-x}";
            let query = format!("strategy T = loadStrategy {features} (\"b.json\")");
            let second = folder.loaded(&mut model, &query);
            assert_eq!(first.regressors, second.regressors);
            folder.ask(&mut model, "saveStrategy(\"c.json\", T)");
            assert_eq!(folder.read("c.json"), text);
        }
    });
}

#[test]
fn other_spellings_mean_the_same() {
    let usual = r#"{"version":1.0,"type":"state->regressor","representation":"map",
        "actions":{"0":"P.A->P.B { n + 0 < 9 && x >= 0, go[0]!, n = 0 }","4":"P.B->P.C { 1, tau, 1 } [j=0]",
            "5":"P.C->(P.A|P.B) { 1, tau, level = 0.5 }","7":"WAIT"},
        "statevars":["P.location","n"],"pointvars":["x"],
        "locationnames":{"P.location":{"0":"A","1":"B","2":"C"}},
        "regressors":{"(0,2)":{"type":"act->point->val","representation":"simpletree","minimize":1,
            "regressor":{"0":{"var":0,"bound":2.0,"low":1.0,"high":9.0},"7":9.5,"4":19.0,"5":20.0}},
          "(2,-1)":{"type":"act->point->val","representation":"simpletree","minimize":1,"regressor":{"5":1.0}}}}"#;
    let other = r#"{"regressors":{
          "(1.0, -1)":{"minimize":true,"regressor":{"5":1},"type":"act->point->val","representation":"simpletree"},
          "( 5 ,2e0 )":{"representation":"simpletree","type":"act->point->val","minimize":true,
            "regressor":{"7":9.5,"4":19,"5":"inf","0":{"high":9,"low":1,"bound":2,"var":0}}}},
        "pointvars":["x "],"statevars":[" P.location ","n"],
        "actions":{"7":" WAIT","0":"P.A -> P.B{(n+0<9)&&x>=0,go[0]!,n:=0}","5":"P.C->(P.A|P.B) { true, tau, P.level := 0.5 }",
            "4":"P.B->P.C{true,tau,1}[j=0]"},
        "locationnames":{"P.location":{"5":"A","0":"B","1":"C"}},
        "representation":"map","type":"state->regressor","version":1}"#;
    in_folder("learned-spelling", |place| {
        let folder = Folder::new(place);
        let mut model = load(MODEL);
        for (name, text) in [("usual", usual), ("other", other)] {
            folder.write(&format!("{name}.json"), text);
            folder.loaded(
                &mut model,
                &format!("strategy S = loadStrategy(\"{name}.json\")"),
            );
            folder.ask(&mut model, &format!("saveStrategy(\"{name}2.json\", S)"));
        }
        let usual = folder.read("usual2.json");
        // The leaf without end is worse than all others there.
        assert_eq!(
            usual.replace("\"9\":20.0", "\"9\":39.0"),
            folder.read("other2.json")
        );
    });
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let good = r#"{"version":1.0,"type":"state->regressor","representation":"map",
        "actions":{"0":"P.B->P.C { 1, tau, 1 } [j=0]","1":"WAIT"},
        "statevars":["P.location","n"],"pointvars":["x"],
        "locationnames":{"P.location":{"0":"A","1":"B","2":"C"}},
        "regressors":{"(1,2)":{"type":"act->point->val","representation":"simpletree","minimize":1,
            "regressor":{"0":{"var":0,"bound":2.5,"low":1.0,"high":9.0},"1":9.5}}}}"#;
    let cases = [
        (
            "\"version\":1.0",
            "\"version\":2.0",
            "at version: version 2.0 of the format is not known",
        ),
        ("\"version\":1.0,", "", "\"version\" is missing"),
        (
            "state->regressor",
            "point->regressor",
            "at type: this is \"point->regressor\"",
        ),
        ("\"map\"", "\"list\"", "at representation: this is \"list\""),
        (
            "P.B->P.C { 1",
            "P.B->P.A { 1",
            "at actions.0: several moves may be P.B->P.A",
        ),
        (
            "P.B->P.C { 1",
            "P.C->P.B { 1",
            "at actions.0: the controller has no move P.C->P.B",
        ),
        (
            "\"WAIT\"",
            "\"P.B->P.C { 1, tau, 1 } [j=0]\"",
            "at actions.1: this is the same action as number 0",
        ),
        ("\"WAIT\"", "3", "at actions.1: this is no text"),
        (
            "\"n\"]",
            "\"m\"]",
            "at statevars[1]: m is nothing that is seen of a state: 'm' is not declared",
        ),
        ("[\"x\"]", "[\"x'' +\"]", "at pointvars[0]:"),
        (
            "[\"x\"]",
            "[\"flags\"]",
            "at pointvars[0]: flags is nothing that is seen",
        ),
        ("[\"x\"]", "[3]", "at pointvars[0]: this is no text"),
        (
            "\"2\":\"C\"",
            "\"2\":\"D\"",
            "process P has no location \"D\"",
        ),
        ("\"2\":\"C\"", "\"two\":\"C\"", "\"two\" is no number"),
        (
            "{\"P.location\"",
            "{\"R.location\"",
            "the model has no process R",
        ),
        (
            "(1,2)",
            "(1,2,3)",
            "at regressors.(1,2,3): there should be 2 values",
        ),
        (
            "(1,2)",
            "(7,2)",
            "process P has no location with the number 7",
        ),
        ("(1,2)", "(1,2.5)", "are no values of statevars"),
        ("(1,2)", "(1,nan)", "\"nan\" is no number"),
        ("(1,2)", "1,2", "a key is a list of values in brackets"),
        (
            "\"minimize\":1",
            "\"minimize\":2",
            "minimize: this is no 0 or 1",
        ),
        ("simpletree", "table", "only \"simpletree\" is known here"),
        (
            "\"1\":9.5",
            "\"3\":9.5",
            "at regressors.(1,2).regressor.3: there is no action with this number",
        ),
        (
            "9.5",
            "\"nan\"",
            "at regressors.(1,2).regressor.1: \"nan\" is no number",
        ),
        ("9.5", "NaN", "this is no JSON"),
        ("9.5", "1e999", "this is no JSON: number out of range"),
        ("9.5", "null", "null is no number"),
        (
            "\"var\":0",
            "\"var\":1",
            "regressor.0.var: there are 1 pointvars, and none is number 1",
        ),
        (
            "\"bound\":2.5",
            "\"bound\":null",
            "regressor.0.bound: this is no number",
        ),
        ("\"low\":1.0,", "", "\"low\" is missing"),
        (
            "\"high\":9.0",
            "\"high\":{\"var\":0}",
            "regressor.0.high: \"bound\" is missing",
        ),
        ("}}}}", "}}}} 7", "there is more behind its end"),
        ("}}}}", "}}}", "this is no JSON: EOF"),
        (good, "", "the file is empty"),
        (good, "[]", "this is no strategy of ntagen"),
        (
            good,
            "{\"format\":\"ntagen-plan\"}",
            "this is no strategy of ntagen",
        ),
        (
            "\"regressors\":{",
            "\"regressors\":{\"(1.0,2)\":{\"type\":\"act->point->val\",\"representation\":\"simpletree\",\"minimize\":0,\"regressor\":{}},",
            "this is the other way round than before",
        ),
        (
            "\"regressors\":{",
            "\"regressors\":{\"(1.0,2)\":{\"type\":\"act->point->val\",\"representation\":\"simpletree\",\"minimize\":1,\"regressor\":{}},",
            "the values (1,2) are there twice",
        ),
    ];
    in_folder("learned-bad", |place| {
        let folder = Folder::new(place);
        let mut model = load(MODEL);
        folder.write("good.json", good);
        let before = folder.loaded(&mut model, "strategy S = loadStrategy(\"good.json\")");
        for (old, new, message) in cases {
            assert!(good.contains(old), "{old}");
            let shown = folder.refusal(&mut model, &good.replacen(old, new, 1), "");
            assert!(
                shown.contains(message) && shown.contains("E0805"),
                "{message}\n{shown}"
            );
        }
        let shown = folder.refusal(&mut model, good, "{n, P.location} -> {x}");
        assert!(shown.contains("the query says {n, P.location}"), "{shown}");
        let huge = fs::File::create(place.join("huge.json")).expect("the folder can be written");
        huge.set_len((2 << 30) + 1).expect("most of it is a hole");
        let query = "strategy S = loadStrategy(\"huge.json\")";
        let refused = try_ask(&mut model, query, &folder.options).expect_err("it is too large");
        assert!(
            refused
                .rendered
                .join("\n")
                .contains("huge.json cannot be read: it is too large")
        );
        // The strategy that was there before is still there.
        let kept = model.strategy("S").and_then(|one| one.learned.clone());
        assert_eq!(
            kept.map(|one| one.regressors.clone()),
            Some(before.regressors.clone())
        );
        // Only strategies are replaced.
        folder.write("notes.json", "{\"version\": 1}");
        let query = "saveStrategy(\"notes.json\", S)";
        let refused = try_ask(&mut model, query, &folder.options).expect_err("it is no strategy");
        assert!(refused.rendered.join("\n").contains("is no strategy"));
        assert_eq!(folder.read("notes.json"), "{\"version\": 1}");
    });
}

#[test]
fn trees_may_be_deep_but_not_without_end() {
    let deep = |levels: usize| {
        let low = "{\"var\":0,\"bound\":2.5,\"high\":9.0,\"low\":".repeat(levels);
        format!(
            r#"{{"version":1.0,"type":"state->regressor","representation":"map","actions":{{"0":"WAIT"}},
            "statevars":[],"pointvars":["x"],"locationnames":{{}},"regressors":{{"(1)":{{"type":"act->point->val",
            "representation":"simpletree","minimize":0,"regressor":{{"0":{low}1.0{}}}}}}}}}"#,
            "}".repeat(levels)
        )
    };
    in_folder("learned-deep", |place| {
        let folder = Folder::new(place);
        let mut model = load(MODEL);
        folder.write("deep.json", &deep(499));
        folder.loaded(&mut model, "strategy S = loadStrategy(\"deep.json\")");
        folder.ask(&mut model, "saveStrategy(\"again.json\", S)");
        folder.loaded(&mut model, "strategy S = loadStrategy(\"again.json\")");
        for levels in [600, 1_000_000] {
            let shown = folder.refusal(&mut model, &deep(levels), "");
            assert!(shown.contains("this is nested too deeply"), "{shown}");
        }
    });
}

#[test]
fn a_learned_strategy_is_the_same_after_it_was_saved_and_loaded() {
    let text = "
        int cost;
        clock x;
        process G() {
          state A { x <= 4 }, Done;
          init A;
          trans A -> Done { assign cost = 5; },
                A -> Done { guard x > 2; assign cost = 1; };
        }
        system G;";
    in_folder("learned-same", |place| {
        let folder = Folder::new(place);
        let mut model = load(text);
        let mut options = folder.options.clone();
        options.learning.iterations = 2;
        let query = "strategy S = minE(cost)[<=9] {} -> {x} : <> G.Done";
        let answer = ask(&mut model, query, &options);
        assert!(answer.evidence.learned.is_some());
        folder.ask(&mut model, "saveStrategy(\"s.json\", S)");
        folder.ask(
            &mut model,
            "strategy T = loadStrategy {} -> {x} (\"s.json\")",
        );
        let mut mean = |name: &str| {
            let query = format!("E[<=9; 500](max: cost) under {name}");
            let estimate = folder.ask(&mut model, &query).estimate;
            estimate.expect("it is a mean").value.to_bits()
        };
        assert_eq!(mean("S"), mean("T"));
    });
}

#[test]
fn models_with_random_runs_only_save_and_load() {
    let text = "
        double cost;
        clock x;
        process G() { state A { x' == 0.5 }, Done; init A; trans A -> Done { guard cost <= x; assign cost = x; }; }
        system G;";
    in_folder("learned-stochastic", |place| {
        let folder = Folder::new(place);
        let mut model = load(text);
        assert!(model.expect_symbolic().is_err());
        let file = r#"{"version":1.0,"type":"state->regressor","representation":"map",
            "actions":{"0":"G.A->G.Done { cost <= x, tau, cost = x }"},"statevars":["cost"],"pointvars":["x"],
            "locationnames":{},"regressors":{"(0.5)":{"type":"act->point->val",
            "representation":"simpletree","minimize":0,"regressor":{"0":0.1}}}}"#;
        folder.write("s.json", file);
        folder.loaded(&mut model, "strategy S = loadStrategy(\"s.json\")");
        folder.ask(&mut model, "saveStrategy(\"t.json\", S)");
        assert!(folder.read("t.json").contains("\"(0.5)\""));
    });
}

#[test]
fn a_model_that_is_analysed_again_keeps_what_was_learned() {
    // The run under the strategy needs more slots for dynamic templates than there were.
    let text = "
        dynamic Child(int number);
        int cost;
        int[0,300] made;
        process Child(int number) { state A; init A; }
        process P() {
          state Go, Choose, Done;
          urgent Go, Choose;
          init Go;
          trans Go -u-> Go { guard made < 200; assign made++, spawn Child(made); },
                Go -u-> Choose { guard made >= 200; },
                Choose -> Done { assign cost = 5; },
                Choose -> Done { assign cost = 2; };
        }
        system P;";
    in_folder("learned-again-analysed", |place| {
        let folder = Folder::new(place);
        let mut model = load(text);
        let regressor = r#""type":"act->point->val","representation":"simpletree","minimize":1"#;
        let file = format!(
            r#"{{"version":1.0,"type":"state->regressor","representation":"map",
            "actions":{{"0":"P.Choose->P.Done {{ 1, tau, cost = 5 }}","1":"P.Choose->P.Done {{ 1, tau, cost = 2 }}"}},
            "statevars":["P.location","made + 0"],"pointvars":[],"locationnames":{{}},
            "regressors":{{"(1,200)":{{{regressor},"regressor":{{"0":5.0,"1":2.0}}}}}}}}"#
        );
        folder.write("s.json", &file);
        folder.loaded(&mut model, "strategy S = loadStrategy(\"s.json\")");
        let answer = folder.ask(&mut model, "E[<=1; 50](max: cost) under S");
        let value = answer.estimate.expect("it is a mean").value;
        assert!((value - 2.0).abs() < 1e-9, "{value}");
    });
}

/// Reads states as bytes, and writes decisions as bytes.
const DRIVER: &str = "
#include <stdio.h>
int main(void)
{
    double values[some_DISCRETE + some_CONTINUOUS + 1];
    unsigned char enabled[some_ACTIONS];
    size_t count = some_DISCRETE + some_CONTINUOUS;
    while (fread(values, sizeof(double), count, stdin) == count && fread(enabled, 1, some_ACTIONS, stdin) == some_ACTIONS)
        putchar(some_decide(values, values + some_DISCRETE, enabled));
    return 0;
}
";

#[test]
fn the_code_in_c_decides_as_the_strategy_does() {
    const STATES: usize = 250_000;
    in_folder("learned-c", |place| {
        let folder = Folder::new(place);
        let random = &mut Random::of_network(7);
        for round in 0..4 {
            folder.write("s.json", &file(random, round % 2 == 0).to_string());
            let mut model = load(MODEL);
            let strategy = folder.loaded(&mut model, "strategy S = loadStrategy(\"s.json\")");
            let code =
                model.learned_code(&strategy, Language::C, "some", "loadStrategy(\"s.json\")");
            let again =
                model.learned_code(&strategy, Language::C, "some", "loadStrategy(\"s.json\")");
            assert_eq!(code, again);
            let program = compiled(place, &format!("{code}{DRIVER}"), "learned");
            let (mut input, mut expected) = (Vec::new(), Vec::new());
            for _ in 0..STATES {
                let discrete = [
                    random.below(4) as f64,
                    [-2.0, 0.0, -0.0, 3.0, 9.0, 4.0][random.below(6)],
                    [0.5, 1e-9, 3.0, 0.7][random.below(4)],
                ];
                // Bounds are met often.
                let mut value = || random.below(60) as f64 / 4.0 - 4.0;
                let continuous = [value(), value()];
                let enabled: Vec<bool> = ACTIONS.iter().map(|_| random.below(2) == 0).collect();
                let all = discrete.iter().chain(&continuous);
                input.extend(all.flat_map(|one| one.to_ne_bytes()));
                input.extend(enabled.iter().map(|&one| u8::from(one)));
                let decided = strategy.decide(&discrete, &continuous, |one| enabled[one as usize]);
                expected.push(decided.map_or(0xff, |action| action as u8));
            }
            assert!(expected.contains(&0xff));
            assert_eq!(expected, answers(&program, &input));
        }
    });
}

fn answers(program: &Path, input: &[u8]) -> Vec<u8> {
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut stdin = child.stdin.take().expect("it is piped");
    std::thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(input).expect("the program reads"));
        child.wait_with_output().expect("it ends").stdout
    })
}

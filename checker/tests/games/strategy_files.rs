//! Strategies read from files: what does not fit the model is refused with its place.

use checker::engine::format::strategy_json;
use checker::engine::{Options, Verdict};
use serde_json::{Value, json};

use crate::checks::{ask, interpreted, load, try_ask};

const MODEL: &str = "
clock x, y;
int[0,3] n;
double d;
bool flags[2];
chan go;
process P() {
  state A, B, C;
  init A;
  trans A -> B { select k : int[0,2]; guard x > 1; sync go!; assign n = k, d = 0.5, flags[1] = true; },
        A -u-> C { };
}
process Q() {
  state A;
  init A;
  trans A -> A { sync go?; assign y = 0; };
}
system P, Q;
";

/// A strategy for the model, as a file.
fn file() -> Value {
    json!({
        "format": "ntagen-strategy",
        "version": 1,
        "query": "control: A<> P.B",
        "owner": "controller",
        "selection": "first",
        "states": [{
            "locations": { "P": "A", "Q": "A" },
            "variables": { "n": 2, "d": 0.25, "flags[0]": 0, "flags[1]": 1 },
            "goal": false,
            "decisions": [
                {
                    "zones": [["x > 1", "x-y <= 2"], ["y == 3"]],
                    "action": [
                        { "process": "P", "edge": 0, "branch": 0, "source": "A", "target": "B", "select": { "k": 1 } },
                        { "process": "Q", "edge": 0, "branch": 0, "source": "A", "target": "A", "select": {} },
                    ],
                    "rank": 1,
                },
                { "zones": [[]], "action": null, "rank": 1 },
            ],
        }],
    })
}

fn read(file: &Value) -> Result<Value, checker::engine::format::json_reader::Mismatch> {
    let model = load(MODEL);
    let (query, strategy) = strategy_json::read(model.network(), file.to_string().as_bytes())?;
    let text = strategy_json::text(model.network(), &strategy, &query);
    let file: Value = serde_json::from_str(&text).expect("it is JSON");
    assert_eq!(text, file.to_string());
    Ok(file)
}

#[test]
fn what_is_read_is_written_again() {
    let written = read(&file()).expect("the file fits the model");
    let state = &written["states"][0];
    assert_eq!(state["variables"], file()["states"][0]["variables"]);
    assert_eq!(state["locations"], file()["states"][0]["locations"]);
    let action = &state["decisions"][0]["action"];
    assert_eq!(action[0]["select"], json!({ "k": 1 }));
    assert_eq!(action[0]["sync"], "go!");
    assert_eq!(
        state["decisions"][0]["zones"][1],
        json!(["y >= 3", "y <= 3"])
    );
    assert_eq!(read(&written), Ok(written.clone()));
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let cases: &[(&str, Value, &str, &str)] = &[
        (
            "/format",
            json!("other"),
            "",
            "this is no strategy of ntagen",
        ),
        (
            "/version",
            json!(2),
            "version",
            "version 2 of the format is not known",
        ),
        ("/query", json!(1), "query", "this is no text"),
        ("/states", json!({}), "states", "this is no list"),
        (
            "/states/0/locations",
            json!({ "P": "A" }),
            "states[0].locations",
            "the model's process Q is missing",
        ),
        (
            "/states/0/locations/P",
            json!("Z"),
            "states[0].locations",
            "process P has no location \"Z\"",
        ),
        (
            "/states/0/locations/R",
            json!("A"),
            "states[0].locations",
            "the model has no process R",
        ),
        (
            "/states/0/variables/n",
            json!(4),
            "states[0].variables",
            "variable n cannot be 4",
        ),
        (
            "/states/0/variables/n",
            json!(0.5),
            "states[0].variables",
            "variable n cannot be 0.5",
        ),
        (
            "/states/0/variables/m",
            json!(0),
            "states[0].variables",
            "the model has no variable m",
        ),
        (
            "/states/0/goal",
            json!(0),
            "states[0].goal",
            "this is no truth value",
        ),
        (
            "/states/0/decisions/0/zones/1/0",
            json!("z < 3"),
            "states[0].decisions[0].zones[1][0]",
            "the model has no clocks z",
        ),
        (
            "/states/0/decisions/0/zones/1/0",
            json!("x < y"),
            "states[0].decisions[0].zones[1][0]",
            "\"x < y\" is no comparison of clocks with a number",
        ),
        (
            "/states/0/decisions/0/zones/1/0",
            json!("x < 1999999999"),
            "states[0].decisions[0].zones[1][0]",
            "1999999999 is too large for a zone",
        ),
        (
            "/states/0/decisions/0/action",
            json!([]),
            "states[0].decisions[0].action",
            "the action has no edge",
        ),
        (
            "/states/0/decisions/0/action/0/process",
            json!("R"),
            "states[0].decisions[0].action[0]",
            "the model has no process R",
        ),
        (
            "/states/0/decisions/0/action/0/source",
            json!("B"),
            "states[0].decisions[0].action[0]",
            "edge 0 of process P does not leave B",
        ),
        (
            "/states/0/decisions/0/action/0/target",
            json!("C"),
            "states[0].decisions[0].action[0]",
            "edge 0 of process P does not lead to C by branch 0",
        ),
        (
            "/states/0/decisions/0/action/0/edge",
            json!(1),
            "states[0].decisions[0].action[0]",
            "edge 1 of process P does not lead to B by branch 0",
        ),
        (
            "/states/0/decisions/0/action/0/select",
            json!({ "k": 3 }),
            "states[0].decisions[0].action[0]",
            "edge 0 of process P has no select values {\"k\":3}",
        ),
        (
            "/states/0/decisions/1/rank",
            json!(-1),
            "states[0].decisions[1].rank",
            "this is no index",
        ),
    ];
    for (pointer, value, place, message) in cases {
        let mut file = file();
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer has a name");
        let parent = file.pointer_mut(parent).expect("the pointer fits the file");
        match parent {
            Value::Object(entries) => drop(entries.insert((*name).to_owned(), value.clone())),
            Value::Array(entries) => {
                entries[name.parse::<usize>().expect("an index")] = value.clone();
            }
            _ => panic!("{pointer} lies in no list or object"),
        }
        let mismatch = read(&file).expect_err(pointer);
        assert_eq!(mismatch.place, *place, "{pointer}");
        assert!(
            mismatch.message.starts_with(message),
            "{pointer}: {}",
            mismatch.message
        );
        assert!(mismatch.help.is_some(), "{pointer}");
    }
    let mut file = file();
    file["states"][0]["locations"]["P"] = json!("B");
    let mismatch = read(&file).expect_err("P is elsewhere");
    assert_eq!(mismatch.message, "process P is not in A in this state");
}

#[test]
fn strategies_are_saved_and_loaded_beside_the_model() {
    let folder = std::env::temp_dir().join(format!("ntagen-strategies-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is a place for files");
    let mut model = load(MODEL);
    let options = Options {
        folder: Some(folder.clone()),
        allow_write: vec![folder.clone()],
        ..interpreted()
    };
    let mut ask = |query: &str| {
        try_ask(&mut model, query, &options)
            .map(|answer| (answer.verdict, answer.message))
            .map_err(|rejection| rejection.rendered.join("\n"))
    };
    ask("strategy S = control: A<> P.A").expect("the query is right");
    let (_, message) = ask("saveStrategy(\"S.json\", S)").expect("the folder can be written");
    let path = folder.join("S.json");
    assert_eq!(
        message,
        Some(format!("strategy S written to {}", path.display()))
    );
    ask("strategy R = loadStrategy(\"S.json\")").expect("the file is there");
    ask("E<> P.B under R").expect("R is a strategy");
    let refused = ask("strategy R = loadStrategy(\"T.json\")").expect_err("there is no T.json");
    assert!(
        refused.contains("error[E0805]") && refused.contains("T.json cannot be read"),
        "{refused}"
    );
    std::fs::remove_dir_all(&folder).expect("the folder is there");
}

const RACE: &str = "clock x; process P() { state A { x <= 5 }, B, C; init A; trans A -> B { guard x >= 1; }, B -> C { }; } system P;";

/// Under the strategy of a time-optimal game, the goal comes within the time; traces are about the
/// model, without the clock.
#[test]
fn strategies_within_a_time_are_asked_under() {
    let mut model = load(RACE);
    let options = Options {
        runs: true,
        ..interpreted()
    };
    let mut ask = |query: &str| {
        let answer = ask(&mut model, query, &options);
        let witnesses = &answer.evidence.witnesses;
        let trace = checker::engine::format::json::witnesses(model.network(), witnesses, "");
        (answer.verdict, answer.evidence.is_verified(), trace)
    };
    assert_eq!(
        ask("strategy S = control_t*(4): A<> P.C").0,
        Verdict::Satisfied
    );
    assert_eq!(
        ask("A[] not P.C imply x <= 1 under S").0,
        Verdict::Satisfied
    );
    assert_eq!(ask("A[] x <= 1 under S").0, Verdict::NotSatisfied);
    let (verdict, verified, trace) = ask("E<> P.C and x > 3 under S");
    assert_eq!((verdict, verified), (Verdict::Satisfied, Some(true)));
    let last = &trace["run"]["states"].as_array().expect("there are states");
    let clocks = last[0]["clocks"].as_object().expect("there are clocks");
    assert_eq!(clocks.keys().collect::<Vec<_>>(), ["x"]);
}

#[test]
fn limit_of_time_is_read_with_care() {
    let mut model = load(RACE);
    let options = Options {
        strategy: true,
        ..interpreted()
    };
    let answer = ask(&mut model, "control_t*: A<> P.C", &options);
    let strategy = answer.evidence.strategy.expect("the controller wins");
    let file = strategy_json::text(model.network(), &strategy, "control_t*: A<> P.C");
    let file: Value = serde_json::from_str(&file).expect("it is JSON");
    assert_eq!(file["time_limit"], 1);
    let mut other = file.clone();
    other["time_limit"] = "soon".into();
    let read = |file: &serde_json::Value| {
        strategy_json::read(model.network(), file.to_string().as_bytes())
            .map_err(|mismatch| (mismatch.place, mismatch.message))
    };
    assert_eq!(
        read(&other).map(|_| ()),
        Err((
            "time_limit".to_owned(),
            "\"soon\" is no time limit".to_owned()
        ))
    );
    other["time_limit"] = serde_json::Value::Null;
    let (place, message) = read(&other).map(|_| ()).expect_err("the clock is missing");
    assert!(place.starts_with("states[0].decisions[0].zones"), "{place}");
    assert!(
        message.contains("the model has no clocks #time"),
        "{message}"
    );
}

//! Tables of integers: lists of many numbers are read without a tree, and mean what the same list
//! means that the grammar reads.
//!
//! A number in parentheses makes the grammar read the lists around it. It takes the place of the
//! number between two blanks, so that everything else stands where it did.

use std::fmt::Write as _;
use std::time::Instant;

use checker::diagnostics::SourceMap;
use checker::engine::{LoadedModel, Options, Verdict};
use checker::exec::{Context, Executor, Interpreter};
use checker::syntax::ast::{Declaration, Initialiser};
use checker::syntax::read_model;
use proptest::prelude::*;

use crate::checks::{ask, expect, load};

const PROCESS: &str = "process P() { state A; init A; }\nsystem P;\n";

/// A list of values as a table, and with the first number of each innermost list in parentheses.
fn both_ways(list: &str) -> [String; 2] {
    let mut table = String::new();
    let mut grammar = String::new();
    let mut rest = list;
    while let Some(start) = rest.find('{') {
        let (before, list) = rest.split_at(start + 1);
        let number = list
            .find(|c: char| !(c.is_ascii_digit() || c == '-'))
            .unwrap_or(0);
        table += before;
        grammar += before;
        if number > 0 {
            let _ = write!(table, " {} ", &list[..number]);
            let _ = write!(grammar, "({})", &list[..number]);
        }
        rest = &list[number..];
    }
    [table + rest, grammar + rest]
}

/// What a declaration gives: the constants and the variables, or all that is wrong.
fn outcome(declarations: &str) -> String {
    let text = format!("{declarations}\n{PROCESS}");
    match LoadedModel::load("model", text.as_bytes()) {
        Ok(model) => {
            let network = model.network();
            let words = (&*network.constants, &network.initial);
            let warnings: Vec<&str> = model.warnings.iter().map(|text| head(text)).collect();
            format!("{words:?} {:?} {warnings:?}", network.initial_clocks)
        }
        Err(rejection) => {
            let heads: Vec<&str> = rejection.rendered.iter().map(|text| head(text)).collect();
            heads.join("\n")
        }
    }
}

/// The first line of a diagnostic: where and what.
fn head(text: &str) -> &str {
    text.lines().next().unwrap_or("")
}

#[track_caller]
fn assert_same(before: &str, list: &str, after: &str) -> String {
    let [table, grammar] = both_ways(list);
    let declaration = |list: &str| format!("{before} {list}{after}");
    assert!(is_table(&declaration(&table)), "{table}");
    assert!(!is_table(&declaration(&grammar)), "{grammar}");
    let outcome_of_table = outcome(&declaration(&table));
    assert_eq!(
        outcome_of_table,
        outcome(&declaration(&grammar)),
        "{before} {list}{after}"
    );
    outcome_of_table
}

/// Whether the first declaration has a table as its initialiser.
fn is_table(declarations: &str) -> bool {
    let mut sources = SourceMap::default();
    let text = format!("{declarations}\n{PROCESS}");
    let document = read_model("model", text.as_bytes(), &mut sources).document;
    let is_table = |declaration: &Declaration| matches!(declaration, Declaration::Variable(variable) if matches!(variable.initialiser, Some(Initialiser::Table(_))));
    document.declarations.iter().any(is_table)
}

/// `{f(0), f(1), …}`
fn list(length: usize, part: impl Fn(usize) -> String) -> String {
    let parts: Vec<String> = (0..length).map(part).collect();
    format!("{{{}}}", parts.join(", "))
}

fn numbers(length: usize) -> String {
    list(length, |i| (7 * i as i64 % 23 - 11).to_string())
}

#[test]
fn arrays_of_all_kinds_have_the_same_words() {
    let rows = |count, length| list(count, |_| numbers(length));
    let cube = list(3, |_| rows(4, 5));
    let cases = [
        ("const int T[40] =", numbers(40), ";"),
        ("const int T[int[5, 44]] =", numbers(40), ";"),
        ("int T[40] =", numbers(40), ";"),
        ("meta int T[40] =", numbers(40), ";"),
        ("const int T[8][5] =", rows(8, 5), ";"),
        ("const int T[3][4][5] =", cube, ";"),
        ("const bool T[40] =", numbers(40), ";"),
        ("const double T[40] =", numbers(40), ";"),
        ("const int[-11, 11] T[2][20] =", rows(2, 20), ", b = 3;"),
        (
            "clock T[40] =",
            list(40, |i| (i % 3 * 100).to_string()),
            ";",
        ),
        (
            "typedef struct { int a; bool b[2]; double c; } part; const part T[10] =",
            list(10, |i| {
                format!("{{{i}, {{{}, 0}}, {}}}", i % 2, -(i as i64))
            }),
            ";",
        ),
        ("const n 3; const T[40]", numbers(40), ";"),
    ];
    for (before, list, after) in cases {
        let outcome = assert_same(before, &list, after);
        assert!(outcome.starts_with("(["), "{before}: {outcome}");
    }
}

#[test]
fn mistakes_are_told_with_their_places() {
    let row = |i: usize| numbers(if i == 3 { 6 } else { 5 });
    let cases = [
        ("const int[-5, 5] T[40] =", numbers(40), "model:1:"),
        (
            "const int T[40] =",
            numbers(41),
            "has 40 parts, but 41 values are given",
        ),
        (
            "const int T[41] =",
            numbers(40),
            "has 41 parts, but only 40 values are given",
        ),
        (
            "const int T[10][5] =",
            list(10, row),
            "has 5 parts, but 6 values are given",
        ),
        ("const int T =", numbers(40), "E0"),
        ("const int T[8][5] =", numbers(40), "E0"),
        (
            "const int T[40] =",
            list(8, |_| numbers(5)),
            "8 values are given",
        ),
        (
            "typedef scalar[50] S; const S T[40] =",
            list(40, |i| i.to_string()),
            "E0",
        ),
        (
            "chan T[40] =",
            numbers(40),
            "this cannot be the initial value",
        ),
        ("clock T[40] =", numbers(40), "E0"),
        (
            "typedef struct { int a; int b; } part; const part T[40] =",
            list(40, |_| numbers(1)),
            "the field 'b' has no value",
        ),
        (
            "typedef struct { int a; int b; } part; const part T[20] =",
            list(20, |_| numbers(3)),
            "the struct has 2 fields, but other values are given",
        ),
    ];
    for (before, list, part) in cases {
        let outcome = assert_same(before, &list, ";");
        assert!(outcome.contains(part), "{before}: {outcome}");
    }
}

#[test]
fn a_value_out_of_range_is_shown_where_it_stands_in_a_line_of_any_length() {
    let mut values: Vec<String> = (0..50_000).map(|i| (i % 10).to_string()).collect();
    values[40_000] = "-77".to_owned();
    let list = values.join(",");
    for text in [
        format!("const int[-9, 9] T[50000] = {{{list}}};\n{PROCESS}"),
        format!(
            "<nta><declaration>const int[-9, 9] T[50000] = {{{list}}};\nbool f() {{ return 1 &lt; 2; }}</declaration>\
             <template><name>Q</name><location id=\"a\"/><init ref=\"a\"/></template><system>system Q;</system></nta>"
        ),
    ] {
        let place = text.find("-77").expect("it is there") + 1;
        let rejection = LoadedModel::load("model", text.as_bytes()).err();
        let rejection = rejection.expect("a value is out of range");
        let [rendered] = &rejection.rendered[..] else {
            panic!("{:?}", rejection.rendered);
        };
        let head = format!("model:1:{place}: error[E0");
        assert!(rendered.starts_with(&head), "{head}\n{rendered}");
        assert!(
            rendered.contains("the value -77 is outside int[-9,9]"),
            "{rendered}"
        );
        assert!(rendered.contains(",8,9,-77,1,2,"), "{rendered}");
        assert!(rendered.len() < 5_000, "{rendered}");
    }
}

#[test]
fn of_many_mistakes_only_some_are_told() {
    let list = list(100_000, |_| "9".to_owned());
    for kind in ["int[0,1]", "scalar[3]"] {
        let text = format!("typedef {kind} t; const t T[100000] = {list};\n{PROCESS}");
        let rejection = LoadedModel::load("model", text.as_bytes()).err();
        let rejection = rejection.expect("all values are wrong");
        let told = rejection.rendered.len();
        assert!((100..=103).contains(&told), "{kind}: {told}");
    }
}

#[test]
fn lists_that_are_no_tables_are_read_by_the_grammar() {
    let with = |one: &str| {
        list(40, |i| {
            if i == 37 {
                one.to_owned()
            } else {
                i.to_string()
            }
        })
    };
    for one in [
        "1.5",
        "n",
        "1 + 1",
        "- 3",
        "--3",
        "{3}",
        "{}",
        "",
        "2147483648",
        "-2147483649",
        "99999999999999999999",
        "3 4",
        "3x",
        "0x3",
        "'",
        "/*",
        "a: 3",
        "1e3",
    ] {
        let list = with(one);
        let declaration = format!("const int n = 3; const int T[40] = {list};");
        let is_nested = one == "{3}";
        assert_eq!(is_table(&declaration), is_nested, "{one}");
        // It is read, or refused with a message: nothing else.
        let _ = outcome(&declaration);
    }
    assert!(is_table(&format!(
        "const int T[40] = {};",
        with("-2147483648 /* least */")
    )));
    assert!(is_table(&format!(
        "const int T[40] = {};",
        with("+7 // seven\n")
    )));
}

#[test]
fn rows_are_tables_beside_rows_with_names() {
    let named = format!("{{n, {}", &numbers(39)[1..]);
    let text = format!(
        "const int n = -11;\nconst int T[3][40] = {{{}, {named}, {}}};\n{PROCESS}",
        numbers(40),
        numbers(40),
    );
    let model = load(&text);
    let row: Vec<i32> = (0..40).map(|i| 7 * i % 23 - 11).collect();
    let constants = &model.network().constants;
    assert_eq!(constants[..40], row[..]);
    assert_eq!(constants[40], -11);
    assert_eq!(constants[41..80], row[..39]);
    assert_eq!(constants[80..], row[..]);
}

#[test]
fn hostile_nesting_takes_no_time() {
    let begin = Instant::now();
    for text in [
        "{".repeat(300_000),
        "{1,".repeat(300_000),
        format!("{}{}", "{".repeat(200), numbers(60_000)),
        format!("{{{}x}}", "{{{1,2,3},4},5},".repeat(60_000)),
        format!("{}1{}", "{".repeat(100_000), "}".repeat(100_000)),
        format!("{}{}1", "{".repeat(250), " ".repeat(1 << 20)),
    ] {
        let _ = outcome(&format!("const int T[2] = {text};"));
    }
    // A quadratic reading takes minutes.
    assert!(begin.elapsed().as_secs() < 60);
}

#[test]
fn tables_of_functions_are_constants_or_initial_values() {
    let table = list(40, |i| (i * i).to_string());
    let text = format!(
        "int calls;\n\
         int fixed(int i) {{ const int T[40] = {table}; return T[i]; }}\n\
         int own(int i) {{ int T[40] = {table}; T[i] += 1; return T[i]; }}\n\
         int both(int i) {{ int T[2][20] = {{{}, {}}}; T[1][i] = 0; return T[0][i] + T[1][i]; }}\n\
         {PROCESS}",
        numbers(20),
        numbers(20)
    );
    for query in [
        "fixed(3) == 9 && fixed(39) == 1521",
        "own(3) == 10 && own(3) == 10 && own(39) == 1522",
        "both(2) == 3 && both(0) == -11",
    ] {
        expect(
            &text,
            &format!("E<> {query}"),
            &Options::default(),
            Verdict::Satisfied,
        );
    }
}

#[test]
fn a_local_value_out_of_range_is_an_error_of_the_run() {
    let table = list(40, |i| i.to_string());
    let text = format!("int own(int i) {{ int[0, 38] T[40] = {table}; return T[i]; }}\n{PROCESS}");
    let answer = ask(&mut load(&text), "E<> own(3) == 3", &Options::default());
    assert!(!matches!(answer.verdict, Verdict::Satisfied));
}

#[test]
fn xml_without_its_tables_keeps_its_places() {
    let table = |seed: usize| list(3_000, |i| ((i * seed) % 100).to_string());
    let declarations = format!(
        "const int A[3000] = {};\nbool f() {{ return 1 &lt; 2; }}\nconst int B[3000] = {};\nint later = oops;",
        table(3),
        table(7)
    );
    let text = format!(
        "<nta>\n<declaration>{declarations}</declaration>\n<template><name>T</name>\n\
         <declaration>const int C[3000] = {};\nint again = oops;</declaration>\n<location id=\"a\"/><init ref=\"a\"/></template>\
         <system>system T;</system></nta>",
        table(11)
    );
    let rejection = LoadedModel::load("m.xml", text.as_bytes()).err();
    let rejection = rejection.expect("a name is unknown");
    let heads: Vec<&str> = rejection.rendered.iter().map(|text| head(text)).collect();
    let begins: Vec<bool> = ["m.xml:5:13:", "m.xml:8:13:"]
        .iter()
        .zip(&heads)
        .map(|(begin, head)| head.starts_with(begin))
        .collect();
    assert_eq!(begins, [true, true], "{heads:?}");

    let broken = text.replace("</template>", "</temp>");
    let rejection = LoadedModel::load("m.xml", broken.as_bytes()).err();
    let rejection = rejection.expect("the XML is broken");
    assert!(
        head(&rejection.rendered[0]).starts_with("m.xml:9:"),
        "{:?}",
        rejection.rendered
    );

    let right = text.replace("oops", "A[2] + B[3]");
    let model = LoadedModel::load("m.xml", right.as_bytes());
    let model = model.unwrap_or_else(|rejection| panic!("{:?}", rejection.rendered));
    let network = model.network();
    assert_eq!(network.constants.len(), 9_000);
    assert!((0..3_000).all(|i| network.constants[6_000 + i] == (i * 11 % 100) as i32));
    assert_eq!(network.initial[1..], [27, 27]);
}

#[test]
fn equal_tables_lie_in_memory_once() {
    let table = list(40, |i| i.to_string());
    let text = format!(
        "const int A[40] = {table};\nconst int B[5][8] = {{{{0,1,2,3,4,5,6,7}},{{8,9,10,11,12,13,14,15}},{{16,17,18,19,20,21,22,23}},{{24,25,26,27,28,29,30,31}},{{32,33,34,35,36,37,38,39}}}};\n{PROCESS}"
    );
    assert_eq!(load(&text).network().constants.len(), 40);
}

#[test]
fn both_engines_read_the_table_of_the_network() {
    let text = format!(
        "const int T[40] = {};\nint at(int i) {{ return T[i]; }}\n{PROCESS}",
        numbers(40)
    );
    let model = load(&text);
    let network = model.network();
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let at = network.functions.iter().position(|one| one.name == "at");
    let at = checker::ir::FunctionId(at.expect("it is a function") as u32);
    let mut executors: Vec<Box<dyn Executor>> = vec![Box::new(interpreter)];
    #[cfg(feature = "jit")]
    {
        use checker::exec::Jit;
        let jit = Jit::compile(&network.functions, &network.constants, network.overflow);
        executors.push(Box::new(jit.expect("the host is supported")));
    }
    for executor in executors {
        for i in 0..40 {
            let mut context = Context {
                state: &mut network.initial.clone(),
                constraints: &mut Vec::new(),
                assignments: &mut Vec::new(),
            };
            let value = executor.call(at, &[i], &mut context);
            assert_eq!(value.expect("it has a value"), 7 * i % 23 - 11);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Lists of random shapes, some of them with mistakes, mean the same both ways.
    #[test]
    fn random_lists_mean_the_same(
        rows in 1..6_usize,
        length in 8..40_usize,
        wrong in proptest::option::of((0..6_usize, 0..40_usize, 0..4_u8)),
        values in proptest::collection::vec(-20..20_i32, 240),
    ) {
        let row = |i: usize| {
            let mut row: Vec<String> = (0..length).map(|j| values[i * 40 + j].to_string()).collect();
            if let Some((at, place, kind)) = wrong && at == i && place > 0 && place < length {
                match kind {
                    0 => row[place] = "300".to_owned(),
                    1 => row.truncate(place),
                    2 => row.push("1".to_owned()),
                    _ => row[place] = "{1, 2}".to_owned(),
                }
            }
            format!("{{{}}}", row.join(","))
        };
        // One more list keeps it a table when a row is cut short.
        let rows_text = list(rows + 1, |i| if i < rows { row(i) } else { list(length.max(32), |j| j.to_string()) });
        let width = length.max(32);
        let before = format!("const int[-100, 100] T[{}][{width}] =", rows + 1);
        let [table, grammar] = both_ways(&rows_text);
        prop_assert_eq!(
            outcome(&format!("{before} {table};")),
            outcome(&format!("{before} {grammar};"))
        );
    }
}

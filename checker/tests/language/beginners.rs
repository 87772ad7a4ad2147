//! What people write who know another notation better, and the hint that each of them gets: one
//! diagnostic for one mistake, and the hint says what to write.

use checker::engine::{LoadedModel, Rejection, Verdict};

use crate::checks::{interpreted, load};

const MODEL: &str = "clock x, y; int v; bool b; chan c; const int N = 3; int arr[N], l1;
    process P() { clock z; int Count; state Idle { x <= 5 }, Done; init Idle;
      trans Idle -> Done { guard x >= 2; assign v = 1; }; }
    process Set(const int[2,4] k) { state Here; init Here; }
    process Unused() { state Here; init Here; }
    p = P(); system p, Set;";

/// The diagnostics of a query.
fn of_query(query: &str) -> Vec<String> {
    let mut model = load(MODEL);
    let query = model.add_query(query);
    match model.check(&query, &interpreted()) {
        Ok(answer) => answer.warnings,
        Err(rejection) => rejection.rendered,
    }
}

/// The diagnostics of a model in which an edge has these labels.
fn of_edge(labels: &str) -> Vec<String> {
    let text = MODEL.replace("guard x >= 2; assign v = 1;", labels);
    assert_ne!(text, MODEL);
    of_text(&text)
}

fn of_text(text: &str) -> Vec<String> {
    match LoadedModel::load("model", text.as_bytes()) {
        Ok(model) => model.warnings,
        Err(Rejection { rendered, .. }) => rendered,
    }
}

#[track_caller]
fn expect_hint(written: &str, found: &[String], hint: &str) {
    assert_eq!(found.len(), 1, "{written}\n{}", found.join("\n"));
    let wanted = format!("hint: {hint}");
    assert!(
        found[0].lines().any(|line| line.trim() == wanted),
        "{written}\nwithout `{wanted}`:\n{}",
        found[0]
    );
}

#[test]
fn queries_of_beginners_get_a_hint_that_helps() {
    let imply = "write `p imply q` if q holds whenever p does, `p --> q` if q comes after p";
    let cases = [
        (
            "A[] 0 <= v <= 3",
            "write `a <= b && b <= c` for a <= b <= c",
        ),
        ("A[] 0 < x < 3", "write `a <= b && b <= c` for a <= b <= c"),
        (
            "A[] v == l1 == 3",
            "write `a <= b && b <= c` for a <= b <= c",
        ),
        (
            "E<> v = 1",
            "write `==`: a query compares, it changes nothing",
        ),
        (
            "E<> p.Done = true",
            "write `==`: a query compares, it changes nothing",
        ),
        (
            "E<> x == 1 and y = 2",
            "write `==`: a query compares, it changes nothing",
        ),
        ("A[] v === 3", "write `==` to compare"),
        (
            "A[] p.Idle => v == 0",
            "write `imply` between a condition and what follows from it, or `>=` to compare numbers",
        ),
        ("A[] v =< 3", "write `<=`; only the old syntax knows `=<`"),
        ("A[] v <> 3", "write `!=` for \"is not\""),
        ("A[] p.Idle -> p.Done", imply),
        (
            "A[] p.Idle --> p.Done",
            "write `p --> q` alone, without a path quantifier",
        ),
        (
            "A[](p.Idle --> p.Done)",
            "write `p --> q` alone, without a path quantifier",
        ),
        ("A[] p.Idle <=> p.Done", "write `==` for \"if and only if\""),
        ("A[] p.Idle implies p.Done", "write `imply`"),
        ("A[] p.Idle AND v == 0", "write `and` or `&&`"),
        (
            "A[] if p.Idle then v == 0",
            "write `p imply q` for \"if p then q\"",
        ),
        ("A[] v ≤ 3", "write `<=`"),
        ("A[] p.Idle → p.Done", "write `imply`"),
        (
            "A[] р.Idle",
            "names have the letters a to z only; some letters look like these: type it again",
        ),
        ("E<> p(0).Done", "it is one process, not a set: write `p`"),
        ("E<> P.Done", "P is the template of the process: write `p`"),
        (
            "E<> Unused.Here",
            "only processes of the system have a state",
        ),
        ("E<> Set.Here", "name one process of the set: Set(2)"),
        ("E<> z > 3", "write `p.z`: it belongs to the process"),
        ("E<> Done", "write `p.Done`: it belongs to the process"),
        ("E<> Z > 3", "declare it first"),
        (
            "E<> V == 1",
            "did you mean 'v'? Small and capital letters differ",
        ),
        (
            "E<> ll == 1",
            "did you mean 'l1'? The letters l, I, O and the digits 1, 0 look alike",
        ),
        (
            "E<> p.done",
            "did you mean 'Done'? Small and capital letters differ",
        ),
        ("E<> p.Dome", "did you mean 'Done'?"),
        (
            "E<> p.state == 1",
            "name a variable of the process or one of its locations: Idle, Done",
        ),
        (
            "E<> p",
            "name a location or a variable of the process: p.Idle",
        ),
        (
            "E<> \"p.Done\"",
            "write names of locations and variables without quotation marks",
        ),
        ("E<> 'p.Done'", "write names without quotation marks"),
        (
            "E<> c",
            "a channel has no value: set a variable where it synchronises",
        ),
        ("E<> arr == 0", "name a part of the array by an index: a[0]"),
        (
            "E<> arr(0) == 0",
            "write the index of an array in brackets: arr[0]",
        ),
        ("E<> x + y < 3", "write x - y < c, x < y + c or x < c"),
        ("A[] !deadlock()", "write `deadlock` without parentheses"),
        ("A[] no deadlock", "write `A[] not deadlock`"),
        ("A[] deadlock free", "write `A[] not deadlock`"),
        ("G p.Idle", "did you mean `A[] p.Idle`?"),
        ("always p.Idle", "did you mean `A[] p.Idle`?"),
        ("never (p.Done)", "did you mean `A[] not (p.Done)`?"),
        (
            "G == 1",
            "write `E<> p` for \"p can be reached\" or `A[] p` for \"p always holds\"",
        ),
        (
            "A[]<> p.Done",
            "a query has one path quantifier, at its start: A[], A<>, E[] or E<>",
        ),
        ("E<> p.Idle;", "leave it out: a query ends with its line"),
        ("E<> p.Idle)", "remove it: no `(` belongs to it"),
        (
            "E<> p:Done",
            "write `P.l` for the location l of the process P",
        ),
        ("sup v", "write `sup: v`"),
        (
            "A[] forall i in 0..2: arr[i] == 0",
            "write `forall (i : int[0,3])`",
        ),
        ("Pr[<=10] <> p.Done", "write `Pr[<=10](<> p)`"),
        ("Pr[<=10]{<> p.Done}", "write `Pr[<=10](<> p)`"),
        (
            "P[<=10](<> p.Done)",
            "write `Pr[<=10](<> p)` for a probability",
        ),
        (
            "E[<=10; 100](v)",
            "write `E[<=10; 100](max: e)` or `E[<=10; 100](min: e)`",
        ),
    ];
    for (query, hint) in cases {
        expect_hint(query, &of_query(query), hint);
    }
}

#[test]
fn labels_of_beginners_get_a_hint_that_helps() {
    let compare = "to compare, write `==`; to change it, do so in the update of an edge";
    let cases = [
        ("guard v = 0;", compare),
        ("guard x = 2;", compare),
        (
            "guard 0 < x < 3;",
            "write `a <= b && b <= c` for a <= b <= c",
        ),
        (
            "guard 0 <= v <= 3;",
            "write `a <= b && b <= c` for a <= b <= c",
        ),
        ("guard x > 2 AND y < 3;", "write `and` or `&&`"),
        ("guard x > 2 & y < 3;", "join conditions on clocks by `&&`"),
        ("guard z > 2; update z = 0;", "write `assign`"),
        (
            "assign z = 0; v = 1;",
            "write a comma between updates: `assign a = 0, b = 1;`",
        ),
        (
            "guard Idle;",
            "only queries can ask for locations; in the model, keep what you need in a variable",
        ),
        (
            "guard p.Idle;",
            "declare it in the global declarations: templates do not see the system section",
        ),
        ("sync d!;", "declare it first"),
        (
            "guard if (v > 2) then 1;",
            "write `p imply q` for \"if p then q\"",
        ),
    ];
    for (labels, hint) in cases {
        expect_hint(labels, &of_edge(labels), hint);
    }
}

#[test]
fn declarations_of_beginners_get_a_hint_that_helps() {
    let behind = "process P() { state A; init A; } system P;";
    let cases = [
        ("boolean b;", "write `bool`"),
        ("float f;", "write `double`"),
        (
            "#define N 3\n",
            "write `const int N = 3;` for a constant: there is no preprocessor",
        ),
        (
            "void f() { for (int i = 0; i < 3; i++) {} }",
            "write `for (i : int[0,2])`, or declare the variable before the loop",
        ),
        (
            "int f() { if true return 1; return 0; }",
            "write the condition in parentheses",
        ),
    ];
    for (text, hint) in cases {
        expect_hint(text, &of_text(&format!("{text} {behind}")), hint);
    }
}

#[test]
fn one_strict_invariant_gives_one_short_warning() {
    let text = "process P(int k) { clock x; state A { x < k }; init A; }
        p = P(1); q = P(2); r = P(3); system p, q, r;";
    let found = of_text(text);
    assert_eq!(found.len(), 1, "{}", found.join("\n"));
    assert!(!found[0].contains("note:"), "{}", found[0]);
}

#[test]
fn a_weight_may_read_clocks() {
    for weight in ["x", "1 + x", "2 * x + 1"] {
        let text = format!(
            "clock x; process P() {{ state A {{ x <= 4 }}, B, C; branchpoint R; init A;
             trans A -> R {{ guard x >= 3; }}, R -> B {{ probability {weight}; }},
             R -> C {{ probability 1; }}; }} system P;"
        );
        let mut model = load(&text);
        for (query, is_satisfied) in [("E<> P.B", true), ("Pr[<=4](<> P.B) >= 0.5", true)] {
            let query = model.add_query(query);
            let answer = model.check(&query, &interpreted()).expect("it is accepted");
            let found = matches!(answer.verdict, Verdict::Satisfied);
            assert_eq!(found, is_satisfied, "{weight}");
        }
    }
}

#[test]
fn parentheses_say_that_a_truth_value_is_meant() {
    for query in ["A[] (0 <= v) <= 3", "A[] (v == 1) == b", "A[] v == 1 == b"] {
        let found = of_query(query);
        assert!(found.is_empty(), "{query}\n{}", found.join("\n"));
    }
}

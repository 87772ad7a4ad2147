//! Trees of queries, the splitting of `.q` files, and what is wrong with queries.

use crate::syntax::support::{document, query, query_shape, shown, whole};
use checker::diagnostics::SourceMap;
use checker::syntax::ast::Expectation;
use checker::syntax::read_queries;

fn check(text: &str, expected: &str) {
    let (found, diagnostics) = query(text);
    assert!(diagnostics.is_empty(), "{text}: {diagnostics:?}");
    let found = found.map(|query| query_shape(&query));
    assert_eq!(found.as_deref(), Some(expected), "{text}");
}

fn check_mistake(text: &str, expected: &str) {
    let (found, diagnostics) = query(text);
    assert!(found.is_none(), "{text} was accepted");
    assert_eq!(diagnostics.len(), 1, "{text}: {diagnostics:?}");
    assert!(diagnostics[0].contains(expected), "{text}: {diagnostics:?}");
}

#[test]
fn path_formulas() {
    check("E<> P.a and x > 3", "E<> (And (. P a) (Greater x 3))");
    check("A[] not deadlock", "A[] (Not deadlock)");
    check("E[] true", "E[] true");
    check("A<>a imply b", "A<> (Imply a b)");
    check("P.a --> P.b || c", "(. P a) --> (Or (. P b) c)");
    check(
        "A[] forall (i : id_t) P(i).x <= 3",
        "A[] (ForAll i id_t (LessEqual (. (call P i) x) 3))",
    );
}

#[test]
fn extrema() {
    check("sup: x, y + 1", "Sup: x (Add y 1)");
    check("inf{P.a}: x", "Inf{(. P a)}: x");
    check("bounds{a || b} : x", "Bounds{(Or a b)}: x");
}

#[test]
fn names_that_only_begin_a_query_stay_names() {
    check(
        "sup + inf > bounds --> A[0] == E[1]",
        "(Greater (Add sup inf) bounds) --> (Equal ([] A 0) ([] E 1))",
    );
    check("A[0] == 1 --> U", "(Equal ([] A 0) 1) --> U");
    check("E[0](i) --> W", "(call ([] E 0) i) --> W");
    check(
        "E<> A + U + W + R + M == 0",
        "E<> (Equal (Add (Add (Add (Add A U) W) R) M) 0)",
    );
}

#[test]
fn games() {
    check("control: A<> P.goal", "control: A<> (. P goal)");
    check("control: A[] not P.bad", "control: A[] (Not (. P bad))");
    check("control: A[ not b U g ]", "control: A[(Not b) U g]");
    check("control: A[ U W W ]", "control: A[U W W]");
    check("E<> control: A<> g", "E<> control: A<> g");
    check(
        "{ P.a, x >= 2 } control: A[] p",
        "{ (. P a) (GreaterEqual x 2) } control: A[] p",
    );
    check("{} control: A<> p", "{ } control: A<> p");
    check("control: A[] (p && A<> q)", "control: A[](p A<> q)");
    check(
        "control: A[] (p and r && A<> q || s)",
        "control: A[]((And p r) A<> (Or q s))",
    );
    check(
        "control: A[] (p && q) || r",
        "control: A[] (Or (And p q) r)",
    );
}

#[test]
fn time_optimal_games() {
    check("control_t*(u, g): A<> p", "control_t*(u, g): A<> p");
    check("control_t*(10): A[ p U q ]", "control_t*(10, -): A[p U q]");
    check("control_t*: A<> p", "control_t*(-, -): A<> p");
}

#[test]
fn strategies() {
    check("strategy S = control: A<> g", "strategy S = control: A<> g");
    check("A[] x < 3 under S", "A[] (Less x 3) under S");
    check("control: A<> g under S", "control: A<> g under S");
    check("sup: x under S", "Sup: x under S");
    check("saveStrategy(\"a b.json\", S)", "save \"a b.json\" S");
    check(
        "strategy T = loadStrategy {P.location} -> {x, y} (\"f\")",
        "strategy T = load \"f\"",
    );
    check(
        "strategy T = loadStrategy(\"f\")",
        "strategy T = load \"f\"",
    );
}

#[test]
fn statistical_queries_are_read() {
    check("Pr[<=10](<> P.a)", "Pr[<=10](<> (. P a))");
    check("Pr [c<=N] ([] x < 3)", "Pr[c<=N]([] (Less x 3))");
    check(
        "Pr[#<=10; 100](p U q) >= 0.5",
        "Pr[#<=10; 100](p U q) >= 0.5",
    );
    check(
        "Pr[<=1+1](<> p) <= 0.1 under S",
        "Pr[<=(Add 1 1)](<> p) <= 0.1 under S",
    );
    check("E[<=10; 100](max: x)", "E[<=10; 100](max: x)");
    check("E[x<=10; N](min: a[1])", "E[x<=10; N](min: ([] a 1))");
    check("simulate [<=10; 5] {x, y}", "simulate[<=10; 5]{ x y}");
    check(
        "simulate 5 [<=10] {x} : 2 : p",
        "simulate[<=10; 5]{ x} : 2 : p",
    );
    check(
        "simulate [<=10] {x, foreach (c : T) c.n + 1}",
        "simulate[<=10]{ x (foreach c:T (Add (. c n) 1))}",
    );
    check("simulate N [#<=10] {x} : p", "simulate[#<=10; N]{ x} : p");
    check(
        "Pr[<=9](<> p) >= Pr[#<=3; 50]([] q)",
        "Pr[<=9](<> p) >= Pr[#<=3; 50]([] q)",
    );
    check("Pr[<=9](p U q) <= Pr(X p)", "Pr[<=9](p U q) <= Pr((X p))");
}

#[test]
fn older_forms_of_statistical_queries_are_read() {
    check("Pr[c<=5] (<> p) ?", "Pr[c<=5](<> p)");
    check(
        "simulate (N+1) [<=10] {x, y,}",
        "simulate[<=10; (Add N 1)]{ x y}",
    );
}

#[test]
fn formulas_over_time() {
    check("Pr(<>[0,2] q)", "Pr((<>[0,2] q))");
    check("Pr((p U[1,N+1] q))", "Pr((U[1,(Add N 1)] p q))");
    check("Pr ([][0,9] p)", "Pr(([][0,9] p))");
    check("Pr[<=5](X p)", "Pr[<=5]((X p))");
    check("Pr(p R[0,3] q)", "Pr((R[0,3] p q))");
    // Operators over time bind most loosely, and take all to their right.
    check(
        "Pr(a && b U[0,1] c || d)",
        "Pr((U[0,1] (And a b) (Or c d)))",
    );
    check(
        "Pr(forall (c : T) p || <>[0,1] q)",
        "Pr((forall c:T (or p (<>[0,1] q))))",
    );
    check(
        "Pr(!exists (c : T) (X p) && q)",
        "Pr((not (exists c:T (and (X p) q))))",
    );
    check("Pr(p || <>[0,1] q && r)", "Pr((or p (<>[0,1] (And q r))))");
    check(
        "Pr(([][0,9](a != 0 || (b == 1 U[0,3] a == 1))))",
        "Pr(([][0,9] (or (NotEqual a 0) (U[0,3] (Equal b 1) (Equal a 1)))))",
    );
    check(
        "Pr(!(<>[0,1] p) and not (q imply X r))",
        "Pr((and (not (<>[0,1] p)) (not (or (not q) (X r)))))",
    );
    check("Pr[<=9](<> (p U[0,1] q))", "Pr[<=9]((<> (U[0,1] p q)))");
    // Names of the operators stay names where none can stand.
    check("Pr[<=9](<> X > U + R)", "Pr[<=9](<> (Greater X (Add U R)))");
    check("Pr(X.a U[0,1] X)", "Pr((U[0,1] (. X a) X))");
    // Parentheses of expressions are no parentheses of formulas.
    check(
        "Pr((a + 1) * 2 > 3 U[0,1] ((b)))",
        "Pr((U[0,1] (Greater (Multiply (Add a 1) 2) 3) b))",
    );
}

#[test]
fn mistakes_in_statistical_queries() {
    check_mistake("Pr[<=10](<> p", "expected `)` after what is asked of a run");
    check_mistake(
        "Pr[<=10] <> p",
        "expected `(` before what is asked of a run",
    );
    check_mistake(
        "Pr[<=10](<> p) > 0.5",
        "a probability is not compared by `>`",
    );
    check_mistake("Pr[<=10](<> p) = ?", "a probability is not compared by `=`");
    check_mistake(
        "Pr[10](<> p)",
        "E0105 at 1:4 \"this does not bound the runs\"",
    );
    check_mistake("Pr[#10](<> p)", "expected `<=` before the number of moves");
    check_mistake(
        "Pr(<>[0] p)",
        "expected `,` between the bounds of the operator",
    );
    check_mistake(
        "Pr(<>[0,2 p)",
        "expected `]` after the bounds of the operator",
    );
    check_mistake("Pr(p U[0,2])", "expected an expression");
    check_mistake("Pr[<=10](<> p &&)", "expected an expression");
    check_mistake("simulate [<=10] x", "expected `{` before what is shown");
    check_mistake(
        "simulate 5 [<=10; 5] {x}",
        "the number of runs is given twice",
    );
    check_mistake(
        "simulate {x}",
        "expected the bound of the runs, or their number",
    );
    check_mistake("E[<=10; 5](avg: x)", "expected `max:` or `min:`");
    check_mistake("E[<=10; 5](max: x / (y z))", "E0105");
}

#[test]
fn unsupported_queries_are_named() {
    check("Pmax", "unsupported: statistical model checking");
    check("sat: Scenario", "unsupported: live sequence chart scenario");
    check("A[ p U q ]", "unsupported: `A[p U q]` outside `control:`");
    check(
        "E<> foreach (c : T) c.n > 3",
        "unsupported: `foreach` over the instances of a dynamic template",
    );
}

#[test]
fn best_strategies_and_shields_are_asked_for() {
    check(
        "strategy S = minE(c)[<=9]{P.location}->{x}: <> g under T imitate U",
        "strategy S = minE(c)[<=9]{ (. P location)} -> { x}: g under T imitate U",
    );
    check("maxPr[#<=3]: <> g", "maxPr[#<=3]: g");
    check("maxE(c)[x<=3] {} -> {}: <> g", "maxE(c)[x<=3]{} -> {}: g");
    for (text, hint) in [("minE[<=3]: <> g", "W0108"), ("minE(c)[<=3]", "W0109")] {
        let (found, diagnostics) = query(text);
        assert!(found.is_some() && diagnostics[0].contains(hint), "{text}");
    }
    check(
        "strategy S = acontrol: A[] p { P.location, i[0,5], x[-1,1]:4 }",
        "strategy S = acontrol: p {(. P location), i[0,5], x[(Minus 1),1]:4}",
    );
    check_mistake("minPr(c)[<=3]: <> g", "E0145 at 1:1");
    check_mistake("minE(c)[<=3]: [] g", "E0146 at 1:15");
    check_mistake("maxPr[<=3]", "E0146");
    check_mistake("minE(c): <> g", "E0105");
    check_mistake("minE(c)[<=3] {a}: <> g", "E0105");
}

#[test]
fn mistakes_in_queries() {
    check_mistake("", "E0144");
    check_mistake("// only a comment", "E0144");
    check_mistake("x > 3", "E0140 at 1:1");
    check_mistake("x > 3 under S", "E0140");
    check_mistake("EF p && q", "E0140 at 1:1");
    check_mistake("AG (p && q)", "E0140 at 1:1");
    check_mistake("AF p", "E0140 at 1:1");
    check_mistake("<>", "E0140 at 1:1");
    check_mistake("<>p under S", "E0140 at 1:1");
    check_mistake("[] not deadlock", "E0140 at 1:1");
    check_mistake("E <> p", "E0105 at 1:3 \"a path quantifier is one word\"");
    check_mistake("A[] A<> p", "E0141 at 1:5");
    check_mistake("A[] (p && A<> q)", "E0141 at 1:11");
    check_mistake("E<> p q", "E0105 at 1:7");
    check_mistake("E<> p &&", "found the end of the text");
    check_mistake("control: E<> p", "E0142 at 1:10");
    check_mistake("control: A<> p --> q", "E0105");
    check_mistake("control: p", "E0142");
    check_mistake("control A<> p", "expected `:` after `control`");
    check_mistake("control: A[ p q ]", "expected `U` or `W`");
    check_mistake("strategy S = A[] p", "E0143 at 1:14");
    check_mistake("strategy S = Pr[<=3](<> p)", "E0143");
    check_mistake(
        "strategy = control: A<> p",
        "expected the name of the strategy",
    );
    check_mistake("{a} A<> p", "expected `control:`");
    check_mistake("saveStrategy(S, T)", "E0105");
    check_mistake("A[] p under", "expected the name of a strategy");
    check_mistake("E<> p.", "expected the name of a member");
    check_mistake("E<> a[1", "expected `]`");
    check_mistake("E<> (a", "expected `)`");
    check_mistake("E<> x @ y", "E0101");
    check_mistake("sup{p} x", "expected `:`");
}

#[test]
fn a_formula_may_span_lines() {
    check(
        "A[] a and // first\n /* second */ b \\\n and c",
        "A[] (And (And a b) c)",
    );
}

/// The queries of a `.q` file: text, comment, expectation.
fn split(text: &str) -> Vec<(String, String, Option<Expectation>)> {
    let mut sources = SourceMap::default();
    let (queries, diagnostics) = read_queries("queries.q", text.as_bytes(), &mut sources);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    queries
        .into_iter()
        .map(|query| (query.text, query.comment, query.expect))
        .collect()
}

fn texts(text: &str) -> Vec<String> {
    split(text).into_iter().map(|(text, ..)| text).collect()
}

#[test]
fn a_query_file_has_one_query_a_line() {
    assert_eq!(
        texts("E<> a\n\n  A[] b  \r\nE[]  c"),
        ["E<> a", "A[] b", "E[] c"]
    );
    assert_eq!(texts(""), Vec::<String>::new());
    assert_eq!(texts("//NO_QUERY\n/* nothing */\n"), Vec::<String>::new());
}

#[test]
fn a_line_goes_on_behind_a_backslash_and_in_a_comment() {
    assert_eq!(texts("A[] a \\\n  and b\nE<> c"), ["A[] a and b", "E<> c"]);
    assert_eq!(texts("A[] a /* x\ny */ and b"), ["A[] a and b"]);
    assert_eq!(
        texts("saveStrategy(\"http://x\", S)"),
        ["saveStrategy(\"http://x\", S)"]
    );
}

#[test]
fn comments_belong_to_the_next_query() {
    let found = split("/* first\n*/\nE<> a\n//second\nE<> b // same line\n");
    let comments: Vec<&str> = found
        .iter()
        .map(|(_, comment, _)| comment.as_str())
        .collect();
    assert_eq!(comments, ["first", "second\nsame line"]);
}

fn expectations(text: &str) -> Vec<Option<Expectation>> {
    split(text).into_iter().map(|(.., expect)| expect).collect()
}

#[test]
fn expectations_stand_before_on_or_behind_the_line() {
    let (yes, no) = (Some(Expectation::True), Some(Expectation::False));
    let before = "/* EXPECT:T */\nE<> a\n/* EXPECT:F */\nE<> b";
    assert_eq!(expectations(before), [yes.clone(), no.clone()]);
    let behind = "E<> a\n/* EXPECT:T */\nE<> b\n/* EXPECT:F */\n";
    assert_eq!(expectations(behind), [yes.clone(), no.clone()]);
    let same = "E<> a /* EXPECT:SAT */\nE<> b /* EXPECT:UNSAT,5S,100KB */";
    assert_eq!(expectations(same), [yes, no]);
    let others = "a/*EXPECT:MT*/\nb/*EXPECT:MF*/\nc/*EXPECT:ERR*/\nd/*EXPECT:2.5*/\ne";
    assert_eq!(
        expectations(others),
        [
            Some(Expectation::MaybeTrue),
            Some(Expectation::MaybeFalse),
            Some(Expectation::Error),
            Some(Expectation::Number(2.5)),
            None,
        ]
    );
}

#[test]
fn an_unknown_expectation_is_a_warning() {
    let mut sources = SourceMap::default();
    let (queries, diagnostics) = read_queries("q", b"E<> a /* EXPECT:maybe */", &mut sources);
    assert_eq!(queries.len(), 1);
    let shown: Vec<String> = diagnostics.iter().map(|d| shown(d, &sources)).collect();
    assert_eq!(shown, ["W0105 at 1:7 \"`maybe` is not an expectation\""]);
}

#[test]
fn a_textual_model_may_hold_queries() {
    let document = document(
        "process P() { state A; init A; } system P; query { E<> P.A } query { } query { A[] x < 3 /* c */ }",
    );
    let texts: Vec<&str> = document.queries.iter().map(|q| q.text.as_str()).collect();
    assert_eq!(texts, ["E<> P.A", "A[] x < 3"]);
}

#[test]
fn a_query_given_as_text_is_a_source_of_its_own() {
    let mut sources = SourceMap::default();
    whole("E<> a", &mut sources);
    let span = whole("E<> b", &mut sources);
    assert_eq!(sources.text(span), "E<> b");
}

//! Formulas over time, on models whose probabilities have closed forms.

use super::{expect, load};

/// One move, at rate 1: `P.p` before it, `P.q` behind it.
const ONE_MOVE: &str = "
    process P() { state p { ; 1 }, q; init p; trans p -> q { }; }
    system P;";

#[test]
fn something_happens_in_an_interval() {
    let tail = |time: f64| (-time).exp();
    expect(ONE_MOVE, "Pr(<>[0,2] P.q)", 1.0 - tail(2.0));
    expect(ONE_MOVE, "Pr((P.p U[1,2] P.q))", tail(1.0) - tail(2.0));
    expect(ONE_MOVE, "Pr([][0,2] P.p)", tail(2.0));
    expect(ONE_MOVE, "Pr([][1,2] P.q)", 1.0 - tail(1.0));
    expect(ONE_MOVE, "Pr(<>[1,2] P.p)", tail(1.0));
    expect(ONE_MOVE, "Pr(!(<>[1,2] P.p))", 1.0 - tail(1.0));
    expect(ONE_MOVE, "Pr(X P.q)", 1.0);
    expect(ONE_MOVE, "Pr(X X P.q)", 0.0);
    expect(ONE_MOVE, "Pr(P.p)", 1.0);
    // Behind q, p never comes back: q holds as long as p does not release it.
    expect(ONE_MOVE, "Pr(P.q R[0,3] P.p)", tail(3.0));
}

#[test]
fn bounds_of_runs_end_formulas_without_bounds() {
    let tail = |time: f64| (-time).exp();
    expect(ONE_MOVE, "Pr[<=2](X P.q)", 1.0 - tail(2.0));
    expect(ONE_MOVE, "Pr[<=2](<> ([] P.q))", 1.0 - tail(2.0));
    // At every moment q is at most 1 away: at the first one, too.
    expect(
        ONE_MOVE,
        "Pr[<=3]([] (P.q || <>[0,1] P.q))",
        1.0 - tail(1.0),
    );
    expect(ONE_MOVE, "Pr[#<=1](P.p U[0,1] P.q)", 1.0 - tail(1.0));
    // What is looked for behind the end of the run is not found.
    expect(ONE_MOVE, "Pr[<=1](<>[0,2] P.q)", 1.0 - tail(1.0));
    expect(ONE_MOVE, "Pr[<=1]([][2,3] P.p)", 1.0);
}

#[test]
fn nested_operators_speak_of_distances() {
    // Each state lasts for a time of rate 1.
    let model = "
        process P() { state a { ; 1 }, b { ; 1 }, c; init a; trans a -> b { }, b -> c { }; }
        system P;";
    let tail = |time: f64| (-time).exp();
    // The first move within 1, and the second one at most 1 later.
    expect(
        model,
        "Pr(P.a U[0,1] (P.b && (P.b U[0,1] P.c)))",
        (1.0 - tail(1.0)).powi(2),
    );
    // The first move within 1, and the second one more than 1 later.
    expect(
        model,
        "Pr(<>[0,1] (P.b && [][0,1] P.b))",
        (1.0 - tail(1.0)) * tail(1.0),
    );
    expect(model, "Pr(X (P.b U[0,1] P.c))", 1.0 - tail(1.0));
    expect(model, "Pr(X X P.c)", 1.0);
}

#[test]
fn conditions_on_clocks_change_within_delays() {
    let model = "
        clock x;
        int n = 0;
        process P() {
            state a { x <= 4 };
            init a;
            trans a -> a { guard x >= 2; assign x = 0, n++; };
        }
        system P;";
    // The first move comes at a moment between 2 and 4, uniformly.
    expect(model, "Pr([][0,3] x < 3)", 0.5);
    // The first delay that is longer than 3 must begin before 6: it is one of the first three, as
    // three delays take 6 at least.
    expect(model, "Pr((x <= 3 U[0,9] x > 3))", 0.5 + 0.25 + 0.125);
    // Two delays 2 + 2 u, 2 + 2 v take at most 5, so u + v is at most 1/2.
    expect(model, "Pr(<>[5,5] n == 2)", 0.125);
}

#[test]
fn zero_time_has_moments_too() {
    let model = "
        int n = 0;
        process P() {
            state a, b, c; urgent a, b; init a;
            trans a -> b { assign n = 1; }, b -> c { assign n = 2; };
        }
        system P;";
    expect(model, "Pr(<>[0,0] n == 1)", 1.0);
    expect(model, "Pr(n == 0 U[0,0] n == 1)", 1.0);
    expect(model, "Pr(n == 0 U[0,0] n == 2)", 0.0);
    expect(model, "Pr([][1,5] n == 2)", 1.0);
    expect(model, "Pr(X X X n == 2)", 0.0);
}

#[test]
fn formulas_without_end_and_wrong_bounds_are_refused() {
    let refused = |query: &str, code: &str, says: &str| match load(ONE_MOVE, query) {
        Err(message) => assert!(
            message.contains(code) && message.contains(says),
            "{message}"
        ),
        Ok(_) => panic!("{query} is accepted"),
    };
    refused("Pr(<> P.q)", "E0286", "how long the runs are");
    refused("Pr(P.p U P.q)", "E0286", "Pr(<>[0,10] p)");
    refused("Pr(<>[0,2] ([] P.q))", "E0286", "how long the runs are");
    refused(
        "Pr(<>[2,1] P.q)",
        "E0215",
        "no distance is at least 2 and at most 1",
    );
    refused(
        "Pr(<>[0-1,1] P.q)",
        "E0215",
        "the first bound of an operator",
    );
    refused(
        "Pr(<>[0,P.p] P.q)",
        "E0213",
        "the second bound of an operator",
    );
}

#[test]
fn quantifiers_range_over_operators() {
    let model = "
        process P(const int[0,2] i) { state p { ; 1 }, q; init p; trans p -> q { }; }
        system P;";
    let tail = |time: f64| (-time).exp();
    expect(
        model,
        "Pr(forall (i : int[0,2]) <>[0,1] P(i).q)",
        (1.0 - tail(1.0)).powi(3),
    );
    expect(
        model,
        "Pr(exists (i : int[0,2]) <>[0,1] P(i).q)",
        1.0 - tail(3.0),
    );
    // The one that is still there after 1 leaves within 1 more.
    expect(
        model,
        "Pr(forall (i : int[0,0]) (P(i).p && [][0,1] P(i).p) && <>[0,2] P(i).q)",
        tail(1.0) * (1.0 - tail(1.0)),
    );
    expect(
        model,
        "Pr(forall (i : int[0,2]) exists (j : int[i,i]) (<>[0,1] P(j).q))",
        (1.0 - tail(1.0)).powi(3),
    );
    expect(model, "Pr(forall (i : int[1,0]) <>[0,1] P(i).q)", 1.0);
    expect(model, "Pr(exists (i : int[1,0]) <>[0,1] P(i).q)", 0.0);
    for (query, code) in [
        ("Pr(forall (i : int[0,1024]) <>[0,1] P(0).q)", "E0209"),
        (
            "Pr(forall (i : int[0,99]) exists (j : int[0,99]) <>[0,1] P(0).q)",
            "E0209",
        ),
        ("Pr(forall (i : int[0,3]) <>[0,1] P(i).q)", "E0215"),
    ] {
        let message = load(model, query).map(|_| ()).unwrap_err();
        assert!(message.contains(code), "{query}: {message}");
    }
    let model = "
        dynamic C(); process C() { state a { ; 1 }; init a; }
        process S() { state s { ; 1 }; init s; trans s -> s { assign spawn C(); }; }
        system S;";
    let query = "Pr(forall (c : C) <>[0,1] c.a)";
    let message = load(model, query).map(|_| ()).unwrap_err();
    assert!(
        message.contains("E0298") || message.contains("instance of a dynamic"),
        "{message}"
    );
}

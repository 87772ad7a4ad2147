//! States are left out where a stored one can do all that they can do, though its zone does not
//! contain theirs.

use checker::engine::{Answer, Options, Verdict};

use crate::checks::{self, interpreted};

/// Users who collect certificates, each of which takes more than 2, for one of two policies, and
/// have access if that took less than ten. How long ago the last certificate came hardly ever
/// matters, but no two zones that differ in it contain each other.
pub(crate) fn collectors(users: usize, further: &str) -> String {
    format!(
        "const int N = {users};
process User(const int[1, N] pid) {{
    clock certifying, collecting;
    int[0, 2] certificates, policy;
    state authenticating, access;
    init authenticating;
    trans
        authenticating -> authenticating {{ select p : int[1, 2]; guard policy == 0;
            assign policy = p, certificates = 0, certifying = 0, collecting = 0; }},
        authenticating -> authenticating {{ guard policy > 0 && certifying > 2 && certificates < 2;
            assign certificates = certificates + 1, certifying = 0; }},
        authenticating -> access {{ guard collecting < 10 {further} && policy > 0 && certificates >= policy; }},
        access -> authenticating {{ assign policy = 0; }};
}}
system User;"
    )
}

fn check(text: &str, query: &str, threads: usize) -> Answer {
    let options = Options {
        threads,
        verify: true,
        runs: true,
        ..interpreted()
    };
    checks::check(text, query, &options)
}

#[test]
fn states_are_at_most_as_many_as_abstractions_that_differ() {
    // What `tck-reach -a aLU-covreach` of TChecker stores of the same automata; with inclusion of
    // zones it is 573 and 61,948. Bounds that depend on variables make it fewer here.
    for (users, stored) in [(2, 265), (3, 8_746)] {
        let answer = check(&collectors(users, ""), "E<> false", 1);
        assert_eq!(answer.verdict, Verdict::NotSatisfied);
        assert!(answer.counters.stored <= stored);
    }
}

#[test]
fn what_can_be_done_does_not_depend_on_what_is_left_out() {
    // A certificate takes more than 2, so that the second one comes after more than 4.
    let of_both = |limit: i32| {
        format!(
            "E<> User(1).access && User(1).certificates == 2 && User(1).collecting < {limit} && User(2).access"
        )
    };
    for threads in 1..=3 {
        for further in ["", "&& collecting - certifying < 20"] {
            let text = collectors(2, further);
            let verdict = |query: &str| check(&text, query, threads).verdict;
            assert_eq!(verdict(&of_both(5)), Verdict::Satisfied);
            assert_eq!(verdict(&of_both(4)), Verdict::NotSatisfied);
        }
    }
}

//! Models whose constants are the greatest that there are have the answers of those with small
//! ones.

use checker::engine::evidence::witness::Proof;
use checker::engine::{Answer, Options, TraceWanted, Verdict};
use checker::search::limits::StopReason;
use checker::search::optimum::extremum::Extreme;
use checker::zones::Bound;

use crate::checks::{check, expect, interpreted};
use crate::process::alone;

/// Rests exactly as long as a constant can say, twice.
fn rest(length: i32) -> String {
    let nearly = length - 1;
    format!(
        "clock x, y;
process P() {{ state A {{ x <= {length} }}, B {{ x <= {length} }}, C; init A;
  trans A -> B {{ guard x > {nearly}; assign x = 0; }},
        B -> C {{ guard x >= {length} && y < {length}; }},
        B -> A {{ guard x >= {length} && y > {length}; assign x = {nearly}, y = {nearly}; }};
}}
system P;"
    )
}

/// Whether values may be twice the length: zones cannot hold them if constants are the greatest.
fn doubles(query: &str) -> bool {
    query.contains("y - x") || query == "sup{P.B}: y"
}

#[test]
fn the_greatest_constants_are_compared_as_small_ones() {
    let name = "great_constants::the_greatest_constants_are_compared_as_small_ones";
    alone(name, || {
        for length in [Bound::NARROW_VALUE, 1 << 29, Bound::MAX_VALUE] {
            for options in [interpreted(), Options::default()] {
                check_all(length, &options);
            }
        }
    });
}

fn check_all(length: i32, options: &Options) {
    let queries = |length: i32| {
        let nearly = length - 1;
        [
            "E<> P.B".to_owned(),
            "E<> P.C".to_owned(),
            format!("E<> P.A && x >= {length}"),
            format!("E<> P.A && x > {length}"),
            format!("A[] P.A imply x <= {length}"),
            format!("A[] P.A imply x < {length}"),
            "E<> P.A && y - x < 0".to_owned(),
            format!("E<> P.B && y - x > {nearly}"),
            format!("A[] P.B imply y - x > {nearly}"),
            "A[] not deadlock".to_owned(),
            "A<> P.B".to_owned(),
            "P.B --> P.A".to_owned(),
            "E[] P.A".to_owned(),
            "control: A<> P.B".to_owned(),
            "control: A[] not P.B".to_owned(),
            "sup: x".to_owned(),
            "sup{P.B}: y".to_owned(),
            "inf{P.B}: y".to_owned(),
        ]
    };
    for (small, great) in queries(10).iter().zip(queries(length)) {
        let expected = check(&rest(10), small, options);
        let answer = check(&rest(length), &great, options);
        let is_stopped = answer.verdict == Verdict::Unknown(StopReason::Clocks);
        if is_stopped && length > Bound::NARROW_VALUE && doubles(&great) {
            continue;
        }
        assert_eq!(answer.verdict, expected.verdict, "{great}");
        let greatest =
            |answer: &Answer| answer.value.as_ref().and_then(|all| all.items[0].greatest);
        if let Some(Extreme::Value { value, is_reached }) = greatest(&expected) {
            let value = value / 10 * length;
            assert_eq!(
                greatest(&answer),
                Some(Extreme::Value { value, is_reached }),
                "{great}"
            );
        }
        let least = |answer: &Answer| answer.value.as_ref().and_then(|all| all.items[0].least);
        if let Some(Extreme::Value { is_reached, .. }) = least(&expected) {
            let value = length - 1;
            assert_eq!(
                least(&answer),
                Some(Extreme::Value { value, is_reached }),
                "{great}"
            );
        }
    }
}

#[test]
fn the_fastest_trace_and_the_least_time_are_as_long_as_a_constant_can_be() {
    let name =
        "great_constants::the_fastest_trace_and_the_least_time_are_as_long_as_a_constant_can_be";
    alone(name, || {
        let length = Bound::MAX_VALUE;
        let model = format!(
            "clock x; process P() {{ state A {{ x <= {length} }}, B; init A;
trans A -> B {{ guard x >= {length}; }}; }} system P;"
        );
        let options = Options {
            trace: TraceWanted::Fastest,
            runs: true,
            ..interpreted()
        };
        let answer = expect(&model, "E<> P.B", &options, Verdict::Satisfied);
        let run = &answer.evidence.witnesses[0].run;
        assert!(matches!(run, Some(Proof::Replayed(..))), "{run:?}");
        for query in [
            format!("control_t*({length}): A<> P.B"),
            "control_t*: A<> P.B".to_owned(),
        ] {
            let answer = expect(&model, &query, &interpreted(), Verdict::Satisfied);
            let time = answer.value.expect("the least time is told").items[0].least;
            let value = length;
            assert_eq!(
                time,
                Some(Extreme::Value {
                    value,
                    is_reached: true
                }),
                "{query}"
            );
        }
        let query = format!("control_t*({}): A<> P.B", length - 1);
        expect(&model, &query, &interpreted(), Verdict::NotSatisfied);
    });
}

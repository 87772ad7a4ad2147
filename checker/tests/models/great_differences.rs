//! Games in which clocks differ by nearly as much as a bound can say have the answers of those with
//! small differences.

use checker::engine::{Options, Verdict};
use checker::zones::Bound;

use crate::checks::expect;

/// A watchman makes eight rounds of `length` units each, so that a difference of clocks grows to
/// eight times as much; then he may go home. That he sleeps needs a difference that no round
/// leaves.
fn watch(length: i32) -> String {
    format!(
        "clock x, y; int[0, 8] rounds;
process Watch() {{ state Round {{ y <= {length} }}, Home, Asleep; init Round;
  trans Round -> Round {{ guard y >= {length} && rounds < 8; assign y = 0, rounds++; }},
        Round -> Home {{ guard x - y > 5 && rounds == 8; }},
        Round -> Asleep {{ guard x - y < 3 && rounds > 0; }};
}}
system Watch;"
    )
}

#[test]
fn games_with_great_differences_end_as_those_with_small_ones() {
    for length in [1_000, 500_000, 100_000_000, Bound::NARROW_VALUE] {
        for (query, expected) in [
            ("E<> Watch.Home", Verdict::Satisfied),
            ("control: A<> Watch.Home", Verdict::Satisfied),
            ("control: A[] not Watch.Home", Verdict::NotSatisfied),
            ("control: A<> Watch.Asleep", Verdict::NotSatisfied),
        ] {
            expect(&watch(length), query, &Options::default(), expected);
        }
    }
}

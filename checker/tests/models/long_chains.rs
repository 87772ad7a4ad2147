//! Chains of `else if` may be as long as one likes: no part of the engine recurses along them.

use std::fmt::Write as _;

use checker::engine::{Options, Verdict};

use crate::checks::{expect, interpreted};

/// A function with so many cases, of which each gives its own number, twice over: by `return` and
/// by assignment. It is asked for each number of the list.
fn chain(cases: usize, asked: &[i32]) -> String {
    let mut returned = String::new();
    let mut assigned = String::new();
    for case in 0..cases {
        let word = if case == 0 { "if" } else { "else if" };
        writeln!(returned, "{word} (n == {case}) return {};", 2 * case).expect("it takes all");
        writeln!(assigned, "{word} (n == {case}) {{ r = {}; }}", 3 * case).expect("it takes all");
    }
    let asked_text: Vec<String> = asked.iter().map(i32::to_string).collect();
    format!(
        "const int asked[{0}] = {{ {1} }};
typedef int[-10, 1000000] wide;
wide a, b; int[0, {0}] k;
wide pick(wide n) {{ {returned} else return -7; }}
wide set(wide n) {{ wide r; {assigned} else r = -9; return r; }}
process P() {{ state A, B; init A;
  trans A -> B {{ select i : int[0, {0} - 1]; assign a = pick(asked[i]), b = set(asked[i]), k = i; }}; }}
system P;",
        asked.len(),
        asked_text.join(", ")
    )
}

fn check_chain(cases: usize, asked: &[i32], options: &Options) {
    let text = chain(cases, asked);
    let last = cases as i32;
    let query = format!(
        "A[] P.A || (asked[k] >= 0 && asked[k] < {last} \
         ? a == 2 * asked[k] && b == 3 * asked[k] : a == -7 && b == -9)"
    );
    expect(&text, &query, options, Verdict::Satisfied);
    expect(&text, "E<> a == -7", options, Verdict::Satisfied);
}

#[test]
fn all_cases_of_a_chain_are_reached() {
    let asked: Vec<i32> = (-1..=2_000).collect();
    check_chain(2_000, &asked, &interpreted());
    check_chain(2_000, &asked, &Options::default());
}

#[test]
fn chains_of_a_hundred_thousand_cases_run() {
    let asked = [0, 1, 255, 256, 257, 49_999, 99_998, 99_999, 100_000, -1];
    check_chain(100_000, &asked, &interpreted());
    check_chain(100_000, &asked, &Options::default());
}

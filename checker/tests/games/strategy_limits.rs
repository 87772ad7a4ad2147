//! Limits that come while a strategy is made: what is known is answered, and why there is no
//! strategy is said.

use checker::engine::evidence::strategy_check;
use checker::engine::evidence::strategy_check::Played;
use checker::engine::{Answer, Limits, Options, Verdict};
use checker::verify::strategy::Outcome;
use checker::verify::{Effort, GivenUp};

use crate::checks::{self, interpreted, load};
use crate::families::{ONE_ON_THE_BRIDGE, trains};

fn check(text: &str, query: &str, limits: Limits) -> Answer {
    let options = Options {
        strategy: true,
        limits,
        ..interpreted()
    };
    checks::check(text, query, &options)
}

#[test]
fn memory_ends_a_strategy_and_not_the_answer() {
    // Of each kind of strategy some: permissive, seeking, evading, with a goal that comes again and
    // one that is denied, after a way, and from anywhere.
    let queries = [
        ONE_ON_THE_BRIDGE,
        "control: A<> Train(0).Stopped",
        "control: A<> Train(0).Bridge && Train(1).Bridge",
        "control: A[] not Train(0).Near",
        "control: A[] (true && A<> not Train(0).Bridge)",
        "control: A[] (not Train(0).Near && A<> Train(1).Stopped)",
        "E<> control: A<> Train(0).Stopped && Train(1).Bridge",
        "E<> control: A[] not Train(0).Near && Train(0).Bridge",
    ];
    let mut lost = 0;
    for query in queries {
        for text in [trains(3, "->"), trains(3, "-u->")] {
            let whole = check(&text, query, Limits::default());
            assert!(whole.evidence.strategy.is_some(), "{query}");
            lost += u32::from(whole.verdict == Verdict::NotSatisfied);
            // The most memory is taken when a strategy is nearly finished.
            let limits = Limits {
                memory_bytes: Some(whole.peak_bytes),
                ..Limits::default()
            };
            let answer = check(&text, query, limits);
            assert_eq!(answer.verdict, whole.verdict, "{query}");
            assert!(answer.evidence.strategy.is_none(), "{query}");
            let reason = "no strategy: the search for it was stopped by the memory limit";
            assert_eq!(answer.message.as_deref(), Some(reason), "{query}");
        }
    }
    assert!((4..=12).contains(&lost), "{lost} of 16 are lost");
}

#[test]
fn a_check_of_a_strategy_ends_when_it_is_to() {
    let text = trains(2, "-u->");
    let mut model = load(&text);
    let query = model.add_query(ONE_ON_THE_BRIDGE);
    let options = Options {
        strategy: true,
        ..interpreted()
    };
    let answer = model.check(&query, &options).expect("it is answered");
    let strategy = answer.evidence.strategy.expect("it is wanted");
    let decisions = strategy_check::decisions(model.network(), &strategy);
    let played = Played::new(&strategy, &decisions);
    let rules = options.rules();
    let mut check = |effort: &mut Effort<'_>| {
        let outcome = model.verify_strategy(&query, played, rules, effort);
        outcome.expect("the query is right").expect("it is covered")
    };
    let Outcome::Verified(whole) = check(&mut Effort::up_to(u64::MAX)) else {
        panic!("the strategy wins");
    };
    let outcome = check(&mut Effort::up_to(whole.parts - 1));
    assert!(matches!(outcome, Outcome::GivenUp(GivenUp::TooLarge, _)));
    let mut ends = || true;
    let outcome = check(&mut Effort::up_to(u64::MAX).unless(&mut ends));
    let Outcome::GivenUp(GivenUp::Ended, coverage) = outcome else {
        panic!("it was to end");
    };
    assert!(coverage.parts < whole.parts, "{whole:?}");
}

//! Of several ways to evade, a verdict needs one: the others are explored only where the seeker wins against those before.

use checker::engine::{CodeEngine, LoadedModel, Options, Verdict};

/// Every round the controller gives and the environment takes, both up to four.
const TEXT: &str = "
int[-9, 99] stock = 20;
int[0, 4] given;
clock x;
process Store() {
  state Give, Take { x <= 1 }, Wait { x <= 1 };
  commit Give;
  init Give;
  trans Give -> Take { select g : int[0, 4]; assign given = ORDER; },
        Take -u-> Wait { guard x >= 1 && stock < 95 && stock > -5; select t : int[0, 4]; assign stock += given - t, given = 0; },
        Wait -u-> Give { guard x >= 1; assign x = 0; };
}
system Store;
";

/// Whether the controller wins if it tries gifts in this order, and how many states were explored for it.
fn asked(order: &str, query: &str, verify: bool) -> (bool, u64) {
    let text = TEXT.replace("ORDER", order);
    let mut model = LoadedModel::load("store.xta", text.as_bytes()).expect("it is accepted");
    let options = Options {
        code: CodeEngine::Interpreter,
        verify,
        ..Options::default()
    };
    let query = model.add_query(query);
    let answer = model.check(&query, &options).expect("it is answered");
    let is_satisfied = match answer.verdict {
        Verdict::Satisfied => true,
        Verdict::NotSatisfied => false,
        other => panic!("{query:?}: {other:?}"),
    };
    (is_satisfied, answer.counters.explored)
}

#[test]
fn one_way_to_evade_is_enough_for_a_verdict() {
    for order in ["g", "4 - g", "(g + 2) % 5"] {
        let safe = "control: A[] stock >= 0 && stock <= 40";
        let (is_safe, explored) = asked(order, safe, false);
        // The most permissive strategy says what to do after every gift.
        let (is_still_safe, of_all) = asked(order, safe, true);
        assert!(is_safe && is_still_safe, "{order}");
        assert!(2 * explored < of_all, "{order}: {explored} of {of_all}");
    }
}

#[test]
fn ways_that_turn_out_to_be_lost_are_left() {
    for (query, expected) in [
        ("control: A[] stock >= 18", true),
        ("control: A[] stock >= 18 && stock <= 22", true),
        ("control: A[] stock >= 18 && stock <= 21", false),
        ("control: A<> stock >= 30", false),
        ("control: A<> stock <= 8", false),
        (
            "control: A[ stock <= 24 U stock >= 20 && given == 4 ]",
            true,
        ),
    ] {
        for order in ["g", "4 - g", "(g + 2) % 5"] {
            for verify in [false, true] {
                let (is_satisfied, _) = asked(order, query, verify);
                assert_eq!(is_satisfied, expected, "{query} with {order}");
            }
        }
    }
}

#[test]
fn losses_that_come_late_are_found() {
    // The environment takes one more than it can be given, in each of twenty rounds; every round is like the one before.
    for order in ["g % 4", "3 - g % 4"] {
        for verify in [false, true] {
            let (is_safe, _) = asked(order, "control: A[] stock >= 0", verify);
            assert!(!is_safe, "{order}");
            let (is_safe, _) = asked(order, "control: A[] stock <= 40", verify);
            assert!(is_safe, "{order}");
        }
    }
}

//! A guide says where a game is explored first. It changes how much is explored, and no answer.

use checker::engine::{CodeEngine, Options, Verdict};

use crate::checks::{check, load, try_ask};
use crate::solved::won_and_explored;

/// A walk on a grid. The goal is a corner; walls stand in the way, and the environment may push the
/// walker back once.
const TEXT: &str = "
int[0, 40] x = 20, y = 20;
int[0, 1] pushes = 0;
int far() { return (40 - x) + (40 - y); }
int wrong() { return x + y; }
int broken() { return 1 / (x - 20); }
process Walker() {
  state Turn, Moved;
  commit Moved;
  init Turn;
  trans Turn -> Moved { guard x < 40 && !(x == 30 && y < 22); assign x++; },
        Turn -> Moved { guard x > 0; assign x--; },
        Turn -> Moved { guard y < 40; assign y++; },
        Turn -> Moved { guard y > 0; assign y--; },
        Moved -u-> Turn { },
        Moved -u-> Turn { guard pushes < 1 && x > 0; assign x--, pushes++; };
}
system Walker;
";

const QUERY: &str = "control: A<> x == 40 && y == 40";

fn guided(guide: Option<&str>) -> Options {
    Options {
        guide: guide.map(str::to_owned),
        code: CodeEngine::Interpreter,
        ..Options::default()
    }
}

fn asked(guide: Option<&str>, query: &str) -> (bool, u64) {
    won_and_explored(&check(TEXT, query, &guided(guide)))
}

#[test]
fn a_guide_leads_to_the_goal_sooner() {
    let (is_won, explored) = asked(None, QUERY);
    let (is_still_won, with_guide) = asked(Some("far()"), QUERY);
    assert!(is_won && is_still_won);
    assert!(2 * with_guide < explored, "{with_guide} of {explored}");
}

#[test]
fn no_guide_changes_an_answer() {
    for guide in [
        None,
        Some("far()"),
        Some("wrong()"),
        Some("broken()"),
        Some("-x * y"),
    ] {
        assert!(asked(guide, QUERY).0, "{guide:?}");
        let (is_won, _) = asked(guide, "control: A<> x == 40 && y == 40 && pushes == 1");
        assert!(!is_won, "{guide:?}");
        assert!(
            asked(guide, "control: A[] x == 20 && y == 20").0,
            "{guide:?}"
        );
    }
}

#[test]
fn a_strategy_that_was_found_with_a_guide_passes_its_check() {
    let options = Options {
        strategy: true,
        verify: true,
        ..guided(Some("far()"))
    };
    let answer = check(TEXT, QUERY, &options);
    assert_eq!(answer.verdict, Verdict::Satisfied);
    let verification = answer.evidence.verification.expect("it was wanted");
    assert!(verification.is_ok(), "{verification:?}");
}

#[test]
fn what_is_no_integer_expression_is_refused() {
    let with_clock = TEXT.replace("int[0, 1] pushes", "clock c; int[0, 1] pushes");
    for (guide, words) in [("nothing()", "nothing"), ("c", "is no guide"), ("far(", "")] {
        let rejection = try_ask(&mut load(&with_clock), QUERY, &guided(Some(guide)));
        let text = rejection.expect_err("it is no guide").rendered.join("\n");
        assert!(text.contains(words), "{guide}: {text}");
    }
}

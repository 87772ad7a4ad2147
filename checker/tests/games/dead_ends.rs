//! What follows after a dead end is not explored, however the goal is written; where only variables
//! make one, or the locations do not show it, all of it is. So it is for the strategy of the
//! environment.

use checker::engine::{Answer, Limits, Options, StrategyWanted};

use crate::checks::{check, interpreted};
use crate::solved::won_and_explored;

/// Two counters run for two hundred states each: after `Lost` nothing can be won, after `Late` it
/// can.
const TEXT: &str = "
const int N = 2;
typedef int[0, N - 1] id_t;
int[0, 200] count[N];
bool won[N];
bool are_won(const id_t first) {
  for (i : id_t) if (i >= first && !won[i]) return false;
  return true;
}
process Runner(const id_t id) {
  state Start, Late, Won, Lost;
  init Start;
  trans Start -> Lost { assign count[id] = 1; },
        Start -> Late { assign count[id] = 1; },
        Lost -> Lost { guard count[id] < 200; assign count[id]++; },
        Late -u-> Late { guard count[id] < 200; assign count[id]++; },
        Late -> Won { guard count[id] == 200; assign won[id] = true; },
        Start -u-> Start { guard count[id] < 0; };
}
system Runner;
";

/// The verdict of a query, and how many states were explored for it.
fn asked(query: &str) -> (bool, u64) {
    won_and_explored(&check(TEXT, query, &interpreted()))
}

#[test]
fn goals_out_of_reach_are_not_looked_for() {
    for goal in [
        "Runner(0).Start && Runner(1).Won",
        "forall (i : id_t) (i == 0 ? Runner(i).Start : Runner(i).Won)",
        "(exists (i : id_t) Runner(i).Won) && not (Runner(0).Lost || Runner(0).Late || Runner(0).Won)",
    ] {
        let (is_satisfied, explored) = asked(&format!("control: A<> {goal}"));
        assert!(!is_satisfied, "{goal}");
        // Only the second one may run; both would go through tens of thousands of states.
        assert!(explored <= 500, "{goal}: {explored}");
    }
}

#[test]
fn what_variables_say_is_no_dead_end() {
    let (is_satisfied, explored) = asked("control: A<> are_won(1) && count[0] == 0");
    assert!(!is_satisfied);
    assert!(explored > 210, "{explored}");
}

const LOST: &str = "control: A<> Runner(0).Start && Runner(1).Won";

fn with_strategy(wanted_strategy: StrategyWanted, states: Option<u64>) -> Answer {
    let options = Options {
        strategy: true,
        wanted_strategy,
        limits: Limits {
            states,
            ..Limits::default()
        },
        ..interpreted()
    };
    check(TEXT, LOST, &options)
}

#[test]
fn a_strategy_of_the_controller_leaves_them() {
    let (_, for_the_verdict) = asked(LOST);
    let answer = with_strategy(StrategyWanted::Controller, None);
    assert_eq!(won_and_explored(&answer), (false, for_the_verdict));
    assert!(answer.evidence.strategy.is_none() && answer.message.is_none());
    let answer = with_strategy(StrategyWanted::Winner, None);
    let (is_won, explored) = won_and_explored(&answer);
    assert!(!is_won && explored > 10_000, "{explored}");
    assert!(answer.evidence.strategy.is_some());
}

#[test]
fn limits_hold_there() {
    let most = 2_000;
    let answer = with_strategy(StrategyWanted::Winner, Some(most));
    let (is_won, explored) = won_and_explored(&answer);
    assert!(!is_won && explored < 2 * most, "{explored}");
    assert!(answer.evidence.strategy.is_none());
    let reason = "no strategy: the search for it was stopped by the state limit";
    assert_eq!(answer.message.as_deref(), Some(reason));
}

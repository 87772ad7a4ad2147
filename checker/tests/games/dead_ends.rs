//! What follows after a dead end is not explored, however the goal is written; where only variables
//! make one, or the locations do not show it, all of it is.

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

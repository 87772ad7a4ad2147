//! Of several ways to evade, a verdict needs one: the others are explored only where the seeker
//! wins against those before. Where time passes, the evader may wait: no way is explored before
//! there is something to evade.

use checker::engine::{CodeEngine, Options};
use checker::game::Nodes;

use crate::checks::check;
use crate::families;
use crate::solved::won_and_explored;

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

/// Whether the controller wins if it tries gifts in this order, and how many states were explored
/// for it.
fn asked(order: &str, query: &str, verify: bool) -> (bool, u64) {
    let text = TEXT.replace("ORDER", order);
    let options = Options {
        verify,
        ..Options::default()
    };
    asked_of(&text, query, options)
}

/// Whether the controller wins, and how many states were explored for it.
fn asked_of(text: &str, query: &str, options: Options) -> (bool, u64) {
    let options = Options {
        code: CodeEngine::Interpreter,
        ..options
    };
    won_and_explored(&check(text, query, &options))
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
    // The environment takes one more than it can be given, in each of twenty rounds; every round is
    // like the one before.
    for order in ["g % 4", "3 - g % 4"] {
        for verify in [false, true] {
            let (is_safe, _) = asked(order, "control: A[] stock >= 0", verify);
            assert!(!is_safe, "{order}");
            let (is_safe, _) = asked(order, "control: A[] stock <= 40", verify);
            assert!(is_safe, "{order}");
        }
    }
}

#[test]
fn while_time_passes_moves_are_explored_as_they_are_needed() {
    for (trains, nodes) in [(3, Nodes::Symbolic), (4, Nodes::Discrete)] {
        let text = families::trains(trains, "-u->");
        let query = families::ONE_ON_THE_BRIDGE;
        let options = |strategy| Options {
            strategy,
            nodes,
            ..Options::default()
        };
        let (is_safe, explored) = asked_of(&text, query, options(false));
        let (is_still_safe, of_all) = asked_of(&text, query, options(true));
        assert!(is_safe && is_still_safe, "{trains} trains");
        assert!(2 * explored < of_all, "{trains}: {explored} of {of_all}");
    }
}

/// An attacker that strikes three time units after it has begun, at the earliest, and a shield that
/// takes a while to go up and only does so during an attack. Decoys move now and then, without any
/// effect.
const SHIELD: &str = "
const int DECOYS = 1;
typedef int[0, DECOYS - 1] decoy_t;
bool is_up, attacks;
process Decoy(const decoy_t id) {
  clock z;
  state Left, Right;
  init Left;
  trans Left -> Right { guard z >= 1; assign z = 0; }, Right -> Left { guard z >= 1; assign z = 0; };
}
process Attacker() {
  clock x;
  state Calm, Charging { x <= 5 }, Struck, Repelled;
  init Calm;
  trans Calm -u-> Charging { assign x = 0, attacks = true; },
        Charging -u-> Struck { guard x >= 3 && !is_up; },
        Charging -u-> Repelled { guard x >= 3 && is_up; };
}
process Shield() {
  clock y;
  state Down, Rising { y <= TIME }, Up;
  init Down;
  trans Down -> Rising { guard attacks; assign y = 0; },
        Rising -u-> Up { guard y >= TIME; assign is_up = true; };
}
system Decoy, Attacker, Shield;
";

#[test]
fn moves_help_that_have_nothing_in_common_with_the_attack() {
    for (time, expected) in [(1, true), (2, true), (3, false), (4, false)] {
        let text = SHIELD.replace("TIME", &time.to_string());
        for nodes in [Nodes::Symbolic, Nodes::Discrete] {
            for verify in [false, true] {
                let query = "control: A[] not Attacker.Struck";
                let options = Options {
                    verify,
                    nodes,
                    ..Options::default()
                };
                let (is_safe, _) = asked_of(&text, query, options);
                assert_eq!(is_safe, expected, "a shield that takes {time}");
            }
        }
    }
}

/// A duel of two who both need a while between two blows; all moves are the environment's.
const DUEL: &str = "
const int N = 2;
int[0, 9] life[N] = {6, 6};
int[0, 3] tricks[N] = {2, 2};
chan hit[N], stun[N];
process Fighter(const int[0, 1] id) {
  clock blow, trick, pause, rest;
  state Ready { pause <= 4 }, Stunned { rest <= 2 }, Struck;
  commit Struck;
  init Ready;
  trans Ready -u-> Ready { guard blow > 2; sync hit[1 - id]!; assign blow = 0, pause = 0; },
        Ready -u-> Ready { guard trick > 3 && tricks[id] > 0; sync stun[1 - id]!; assign tricks[id]--, trick = 0, pause = 0; },
        Ready -u-> Struck { sync hit[id]?; assign life[id]--; },
        Ready -u-> Stunned { sync stun[id]?; assign rest = 0; },
        Stunned -u-> Struck { sync hit[id]?; assign life[id]--; },
        Stunned -u-> Ready { guard rest >= 2; assign pause = 0; },
        Struck -u-> Ready { guard life[id] > 0; assign pause = 0; };
}
system Fighter;
";

#[test]
fn a_goal_that_the_evader_keeps_away_from_is_given_up_early() {
    let query = "control: A<> life[1] == 0";
    let (is_won, explored) = asked_of(DUEL, query, Options::default());
    // All that can be reached are several thousand states.
    assert!(!is_won && explored < 1000, "{explored}");
}

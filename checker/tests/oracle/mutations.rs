//! Strategies that were made wrong on purpose must be caught.
//!
//! The first game is the running example of the TIGA manual (section 3), for which every decision
//! matters.

use std::sync::Arc;

use checker::engine::evidence::strategy_check;
use checker::engine::evidence::strategy_check::Played;
use checker::engine::{LoadedModel, Options, Rules};
use checker::game::Player;
use checker::game::strategy::{Selection, Start, Strategy};
use checker::syntax::ast::QueryText;
use checker::verify::strategy::{Decision, Decisions, Defect, Outcome};
use checker::verify::{Effort, Part};

use crate::checks::load;
use crate::compare;

const QUERY: &str = "control: A<> P.goal";

const GAME: &str = "
process P() {
  clock x;
  state L0 { x <= 2 }, L1, L2, L3, L4, goal;
  init L0;
  trans L0 -> L1 { guard x <= 1; },
        L0 -u-> L2 { guard x < 1; assign x = 0; },
        L0 -u-> L4 { guard x > 1; },
        L1 -> goal { guard x >= 2; },
        L1 -u-> L2 { guard x < 1; },
        L2 -> L3 { },
        L3 -> L1 { guard x <= 1; };
}
system P;
";

/// The controller has to hurry, and the environment is faster.
const RACE: &str = "
process P() {
  clock x;
  state L { x <= 3 }, G, Bad;
  init L;
  trans L -> G { guard x >= 2; },
        L -u-> Bad { guard x >= 1; };
}
system P;
";

/// The controller throws, the environment says what falls. From Low there is a way on.
const DIE: &str = "
process P() {
  state Hand, High, Low, Moved, Stolen;
  branchpoint Falls;
  init Hand;
  trans Hand -> Falls { }, Falls -> High { }, Falls -> Low { }, Low -> Moved { }, Low -u-> Stolen { };
}
system P;
";

/// A game, with the strategy of its winner.
struct Solved {
    model: LoadedModel,
    query: QueryText,
    strategy: Arc<Strategy>,
    decisions: Vec<Decisions>,
}

fn solved(game: &str, query: &str) -> Solved {
    let mut model = load(game);
    let query = model.add_query(query);
    let options = Options {
        strategy: true,
        ..compare::options()
    };
    let answer = model.check(&query, &options).expect("the query is right");
    let strategy = answer.evidence.strategy.expect("somebody wins");
    Solved {
        decisions: strategy_check::decisions(model.network(), &strategy),
        strategy,
        model,
        query,
    }
}

/// The defect of a strategy after `mutate`, which is given the decisions of a location.
fn defect_of(solved: Solved, location: i32, mutate: impl Fn(&mut Vec<Decision>)) -> Option<Defect> {
    defect_of_state(solved, location, |state| mutate(&mut state.decisions))
}

/// The defect of a strategy after `mutate`, which is given all that it says in a location.
fn defect_of_state(
    mut solved: Solved,
    location: i32,
    mutate: impl Fn(&mut Decisions),
) -> Option<Defect> {
    let mut states = solved.decisions.iter_mut();
    let state = states.find(|state| state.words[0] == location);
    mutate(state.expect("play gets there"));
    let played = Played::new(&solved.strategy, &solved.decisions);
    let verification = solved
        .model
        .verify_strategy(
            &solved.query,
            played,
            Rules::default(),
            &mut Effort::up_to(10_000),
        )
        .expect("the query is right");
    match verification.expect("the model can be checked") {
        Outcome::Verified(_) => None,
        Outcome::Violated(violation, _) => {
            assert_eq!(violation.states.len(), violation.steps.len() + 1);
            Some(violation.defect)
        }
        Outcome::GivenUp(..) => panic!("the game is small"),
    }
}

fn check_defect(location: i32, mutate: impl Fn(&mut Vec<Decision>)) -> Option<Defect> {
    defect_of(solved(GAME, QUERY), location, mutate)
}

/// Adds a decision for all valuations before the others.
fn everywhere(decisions: &mut Vec<Decision>, action: Option<Vec<Part>>) {
    decisions.insert(
        0,
        Decision {
            rank: 0,
            zones: vec![Vec::new()],
            action,
        },
    );
}

fn acts(decisions: &mut [Decision]) -> &mut Decision {
    let mut decisions = decisions.iter_mut();
    let found = decisions.find(|decision| decision.action.is_some());
    found.expect("the strategy acts here")
}

#[test]
fn every_leg_that_may_be_picked_is_followed() {
    let solved = || solved(DIE, "control: A[] not P.Stolen");
    assert_eq!(solved().strategy.owner, Player::Controller);
    assert_eq!(defect_of(solved(), 0, |_| {}), None);
    for branch in 0..2 {
        let throws = |decisions: &mut Vec<Decision>| {
            let entry = Part {
                process: 0,
                edge: 0,
                branch,
                select: 0,
            };
            decisions.clear();
            everywhere(decisions, Some(vec![entry]));
        };
        // It says nothing of Low, whichever branch names the edge.
        assert_eq!(defect_of(solved(), 0, throws), Some(Defect::NoDecision));
    }
}

#[test]
fn a_leg_that_loses_is_caught() {
    let solved = || solved(DIE, "control: A<> P.High");
    assert_eq!(solved().strategy.owner, Player::Environment);
    assert_eq!(defect_of_state(solved(), 0, |_| {}), None);
    let picks = |leg: u32| {
        move |state: &mut Decisions| {
            for one in &mut state.legs {
                one.action.as_mut().expect("a leg is a move")[0].branch = leg;
            }
        }
    };
    assert_eq!(defect_of_state(solved(), 0, picks(1)), None);
    assert_eq!(
        defect_of_state(solved(), 0, picks(0)),
        Some(Defect::GoalReached)
    );
    // Without a leg either may be picked.
    assert_eq!(
        defect_of_state(solved(), 0, |state| state.legs.clear()),
        Some(Defect::GoalReached)
    );
    let impossible = |state: &mut Decisions| {
        for one in &mut state.legs {
            one.action.as_mut().expect("a leg is a move")[0].branch = 2;
        }
    };
    assert_eq!(
        defect_of_state(solved(), 0, impossible),
        Some(Defect::ImpossibleAction)
    );
}

#[test]
fn strategy_as_it_is_passes() {
    assert_eq!(check_defect(0, |_| {}), None);
}

#[test]
fn waiting_instead_of_acting_is_caught() {
    let wait = |decisions: &mut Vec<Decision>| acts(decisions).action = None;
    assert_eq!(check_defect(0, wait), Some(Defect::NoDecision));
    assert_eq!(check_defect(1, wait), Some(Defect::Endless));
}

#[test]
fn action_of_another_edge_is_caught() {
    let other = |decisions: &mut Vec<Decision>| {
        let action = acts(decisions).action.as_mut().expect("it acts");
        action[0].edge = 2;
    };
    assert_eq!(check_defect(0, other), Some(Defect::ImpossibleAction));
}

#[test]
fn widened_zone_of_an_action_is_caught() {
    let widen = |decisions: &mut Vec<Decision>| {
        let mut action = acts(decisions).clone();
        action.zones = vec![Vec::new()];
        decisions.insert(0, action);
    };
    assert_eq!(check_defect(1, widen), Some(Defect::ImpossibleAction));
}

#[test]
fn widened_zone_of_waiting_is_caught() {
    let widen = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
    assert_eq!(check_defect(1, widen), Some(Defect::Endless));
}

#[test]
fn missing_decision_is_caught() {
    assert_eq!(check_defect(1, Vec::clear), Some(Defect::NoDecision));
}

const SAFE: &str = "control: A[] not P.L4";

#[test]
fn permissive_strategy_as_it_is_passes() {
    let solved = solved(GAME, SAFE);
    assert_eq!(
        (solved.strategy.owner, solved.strategy.selection),
        (Player::Controller, Selection::Any)
    );
    assert_eq!(defect_of(solved, 0, |_| {}), None);
}

#[test]
fn permissive_strategy_that_waits_too_long_is_caught() {
    let wait = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
    assert_eq!(defect_of(solved(GAME, SAFE), 0, wait), Some(Defect::Broken));
}

#[test]
fn permissive_strategy_with_a_move_too_many_is_caught() {
    let widen = |decisions: &mut Vec<Decision>| {
        let action = acts(decisions).action.clone();
        everywhere(decisions, action);
    };
    assert_eq!(
        defect_of(solved(GAME, SAFE), 1, widen),
        Some(Defect::ImpossibleAction)
    );
}

/// Both counter-strategies of the race: against reaching, and against keeping.
fn counter_strategies() -> [Solved; 2] {
    ["control: A<> P.G", "control: A[] not P.Bad"].map(|query| {
        let solved = solved(RACE, query);
        assert_eq!(
            (solved.strategy.owner, solved.strategy.selection),
            (Player::Environment, Selection::First)
        );
        solved
    })
}

#[test]
fn counter_strategies_as_they_are_pass() {
    for solved in counter_strategies() {
        assert_eq!(defect_of(solved, 0, |_| {}), None);
    }
}

#[test]
fn counter_strategy_that_waits_is_caught() {
    let defects = counter_strategies()
        .map(|solved| defect_of(solved, 0, |decisions| everywhere(decisions, None)));
    // Where it declines at the end of the invariant, the controller has to move to where it says
    // nothing.
    assert_eq!(
        defects,
        [Some(Defect::GoalReached), Some(Defect::NoDecision)]
    );
}

#[test]
fn counter_strategy_that_moves_too_early_is_caught() {
    for solved in counter_strategies() {
        let widen = |decisions: &mut Vec<Decision>| {
            let action = acts(decisions).action.clone();
            everywhere(decisions, action);
        };
        assert_eq!(defect_of(solved, 0, widen), Some(Defect::ImpossibleAction));
    }
}

#[test]
fn counter_strategy_with_a_move_of_the_controller_is_caught() {
    for solved in counter_strategies() {
        let steal = |decisions: &mut Vec<Decision>| {
            let action = acts(decisions).action.as_mut().expect("it acts");
            action[0].edge = 0;
        };
        assert_eq!(defect_of(solved, 0, steal), Some(Defect::ImpossibleAction));
    }
}

/// The environment leads play out of the goal for ever, as soon as it can.
const LEAVING: &str = "
process P() {
  clock x;
  state G, Trap;
  init G;
  trans G -> G { guard x >= 3; assign x = 0; },
        G -u-> Trap { guard x >= 2; };
}
system P;
";

#[test]
fn counter_strategy_that_lets_a_goal_recur_is_caught() {
    let game = || solved(LEAVING, "control: A[] (true && A<> P.G)");
    assert_eq!(defect_of(game(), 0, |_| {}), None);
    let wait = |decisions: &mut Vec<Decision>| acts(decisions).action = None;
    assert_eq!(defect_of(game(), 0, wait), Some(Defect::Recurring));
    let widen = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
    assert_eq!(defect_of(game(), 0, widen), Some(Defect::Recurring));
}

#[test]
fn strategies_with_a_condition_on_the_way_are_checked_too() {
    for query in [
        "control: A[ not P.L4 U P.goal ]",
        "control: A[ not P.L4 W P.goal ]",
    ] {
        let defect = |location, mutate: &dyn Fn(&mut Vec<Decision>)| {
            defect_of(solved(GAME, query), location, mutate)
        };
        assert_eq!(defect(0, &|_| {}), None, "{query}");
        let widen_waiting = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
        assert_eq!(
            defect(0, &widen_waiting),
            Some(Defect::Broken),
            "{query}: the environment leads to L4"
        );
        let widen_action = |decisions: &mut Vec<Decision>| {
            let action = acts(decisions).action.clone();
            everywhere(decisions, action);
        };
        assert_eq!(
            defect(1, &widen_action),
            Some(Defect::ImpossibleAction),
            "{query}: nothing leads from L1 before 2"
        );
    }
}

/// The environment leads play away again and again, and into the trap if the controller does not
/// come back at once.
const RETURNING: &str = "
process P() {
  clock x;
  state G, Away { x <= 2 }, Trap;
  init G;
  trans G -u-> Away { assign x = 0; },
        Away -> G { guard x >= 1; },
        Away -u-> Trap { guard x > 1; };
}
system P;
";

#[test]
fn strategy_that_does_not_let_the_goal_recur_is_caught() {
    let game = || solved(RETURNING, "control: A[] (true && A<> P.G)");
    assert_eq!(game().strategy.owner, Player::Controller);
    assert_eq!(defect_of(game(), 1, |_| {}), None);
    let wait = |decisions: &mut Vec<Decision>| acts(decisions).action = None;
    let widen_waiting = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
    // Past the moment of the action nothing is decided; and where waiting is, the invariant ends
    // it, out of the goal.
    assert_eq!(defect_of(game(), 1, wait), Some(Defect::NoDecision));
    assert_eq!(defect_of(game(), 1, widen_waiting), Some(Defect::Stuck));
    let widen_action = |decisions: &mut Vec<Decision>| {
        let action = acts(decisions).action.clone();
        everywhere(decisions, action);
    };
    assert_eq!(
        defect_of(game(), 1, widen_action),
        Some(Defect::ImpossibleAction)
    );
}

/// The goal may be left out only for so long: waiting costs time.
const HURRY: &str = "
process P() {
  clock x;
  state L { x <= 4 }, M { x <= 6 }, G;
  init L;
  trans L -> M { guard x >= 1; },
        M -> G { guard x >= 3; },
        M -u-> L { guard x <= 2; assign x = 0; };
}
system P;
";

#[test]
fn strategy_that_takes_more_time_than_it_has_is_caught() {
    let game = || solved(HURRY, "control_t*: A<> P.G");
    assert_eq!(
        (game().strategy.owner, game().strategy.time_limit),
        (Player::Controller, Some(3))
    );
    assert_eq!(defect_of(game(), 0, |_| {}), None);
    let wait = |decisions: &mut Vec<Decision>| acts(decisions).action = None;
    assert_eq!(defect_of(game(), 1, wait), Some(Defect::Broken));
    let widen = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
    assert_eq!(defect_of(game(), 1, widen), Some(Defect::Broken));
}

#[test]
fn counter_strategy_that_gives_in_before_its_time_is_caught() {
    let game = || solved(HURRY, "control_t*(2): A<> P.G");
    assert_eq!(game().strategy.owner, Player::Environment);
    assert_eq!(defect_of(game(), 0, |_| {}), None);
    let mut longer = game();
    longer.query = longer.model.add_query("control_t*(3): A<> P.G");
    assert_eq!(defect_of(longer, 0, |_| {}), Some(Defect::OtherGame));
}

#[test]
fn strategy_for_another_time_than_it_says_is_caught() {
    let with_limit = |query: &str, limit: Option<i32>| {
        let mut game = solved(HURRY, "control_t*: A<> P.G");
        let mut other = (*game.strategy).clone();
        other.time_limit = limit;
        game.strategy = Arc::new(other);
        game.query = game.model.add_query(query);
        defect_of(game, 0, |_| {})
    };
    assert_eq!(with_limit("control_t*(3): A<> P.G", Some(3)), None);
    assert_eq!(
        with_limit("control_t*(2): A<> P.G", Some(3)),
        Some(Defect::OtherGame)
    );
    assert_eq!(
        with_limit("control_t*: A<> P.G", Some(2)),
        Some(Defect::Broken)
    );
    assert_eq!(
        with_limit("control: A<> P.G", Some(3)),
        Some(Defect::OtherGame)
    );
    assert_eq!(
        with_limit("control_t*: A<> P.G", None),
        Some(Defect::OtherGame)
    );
}

/// The controller wins once the environment has opened, and not from the start.
const HELP: &str = "
process P() {
  clock x;
  state Shut, Open { x <= 5 }, G, Bad;
  init Shut;
  trans Shut -u-> Open { guard x >= 2; assign x = 0; },
        Open -> G { guard x >= 1; },
        Open -u-> Bad { guard x >= 3; };
}
system P;
";

#[test]
fn strategy_after_a_way_is_caught_if_it_or_the_way_is_wrong() {
    let game = || solved(HELP, "E<> control: A<> P.G");
    let Start::After(way) = game().strategy.start.clone() else {
        panic!("the controller wins after a way");
    };
    assert_eq!(way.moves.len(), 1);
    assert_eq!(defect_of(game(), 1, |_| {}), None);
    let widen = |decisions: &mut Vec<Decision>| everywhere(decisions, None);
    assert_eq!(defect_of(game(), 1, widen), Some(Defect::Stuck));
    let from = |start: Start, query: &str| {
        let mut game = game();
        let mut other = (*game.strategy).clone();
        other.start = start;
        game.strategy = Arc::new(other);
        game.query = game.model.add_query(query);
        defect_of(game, 1, |_| {})
    };
    let query = "E<> control: A<> P.G";
    let mut early = way.clone();
    early.moves[0].0 = 0;
    assert_eq!(
        from(Start::After(early), query),
        Some(Defect::ImpossibleWay)
    );
    // Where the environment may be faster the controller has no decision.
    let mut late = way.clone();
    late.wait = 4 * way.ticks_per_unit;
    assert_eq!(from(Start::After(late), query), Some(Defect::NoDecision));
    assert_eq!(from(Start::Anywhere, query), Some(Defect::OtherGame));
    assert_eq!(
        from(Start::After(way), "control: A<> P.G"),
        Some(Defect::OtherGame)
    );
    assert_eq!(from(Start::Initial, query), Some(Defect::NoDecision));
}

#[test]
fn counter_strategy_must_win_from_everywhere() {
    // The environment need not open; but to deny help everywhere is more.
    let mut lost = solved(HELP, "control: A<> P.G");
    assert_eq!(lost.strategy.owner, Player::Environment);
    let mut anywhere = (*lost.strategy).clone();
    anywhere.start = Start::Anywhere;
    lost.strategy = Arc::new(anywhere);
    lost.query = lost.model.add_query("E<> control: A<> P.G");
    let defect = defect_of(lost, 0, |_| {});
    assert!(
        matches!(defect, Some(Defect::NoDecision | Defect::GoalReached)),
        "{defect:?}"
    );
    let game = || solved(HELP, "E<> control: A[] P.Bad and P.G");
    assert_eq!(
        (game().strategy.owner, &game().strategy.start),
        (Player::Environment, &Start::Anywhere)
    );
    assert_eq!(defect_of(game(), 0, |_| {}), None);
    let steady = || solved(HELP, "E<> control: A[] (P.Open && A<> P.Open && P.x > 1)");
    assert_eq!(steady().strategy.start, Start::Anywhere);
    assert_eq!(defect_of(steady(), 1, |_| {}), None);
}

/// A lift between two floors, doors and calls, with all constants but two multiplied by a factor.
fn lift(factor: i64) -> String {
    let times = |value: i64| value * factor;
    format!(
        "
clock move, door, call, idle;
int[0, 1] at;
bool open, asked;
process Lift() {{
  state Stay, Go {{ move <= {go} }}, Open {{ door <= {shut} }};
  init Stay;
  trans Stay -> Go {{ guard !open && idle >= 17; assign move = 0; }},
        Go -u-> Stay {{ guard move >= {arrive}; assign at = 1 - at, idle = 0; }},
        Stay -> Open {{ assign door = 0, open = true; }},
        Open -u-> Stay {{ guard door >= 150; assign open = false, idle = 0; }};
}}
process User() {{
  state Rest, Wait, Bad;
  init Rest;
  trans Rest -u-> Wait {{ guard call >= 701; assign call = 0, asked = true; }},
        Wait -> Rest {{ guard open && at == 1; assign asked = false, call = 0; }},
        Wait -u-> Bad {{ guard call > {late}; }};
}}
L = Lift();
U = User();
system L, U;
",
        go = times(430),
        shut = times(310),
        arrive = times(290),
        late = times(2003),
    )
}

#[test]
fn checks_do_not_count_up_to_constants() {
    for factor in [1, 2_500] {
        let game = || solved(&lift(factor), "control: A[] not U.Bad");
        assert_eq!(game().strategy.owner, Player::Controller);
        assert_eq!(defect_of(game(), 0, |_| {}), None, "{factor}");
    }
    // The run that shows it goes through regions, of which there may be too many.
    let silent = |factor| {
        let game = solved(&lift(factor), "control: A[] not U.Bad");
        defect_of(game, 1, Vec::clear)
    };
    assert_eq!(silent(1), Some(Defect::NoDecision));
    assert!(matches!(
        silent(2_500),
        Some(Defect::NoDecision | Defect::Lost)
    ));
}

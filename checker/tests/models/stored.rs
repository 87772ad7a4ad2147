//! How many states are stored of small models, one for each abstraction and reduction: each is
//! chosen so that its part decides the count.
//!
//! Where an option or another abstraction switches the part off, the count without it stands beside
//! the count with it. The other parts are switched off by a change to the model that takes from the
//! engine what it needs to know, and that leaves what can happen as it is; for two there is only
//! the count.
//!
//! A count that falls is a gain and is written down here; one that rises is a loss that is to be
//! explained.

use checker::analysis::{Abstraction, ClockBounds};
use checker::engine::{Answer, Options, TraceWanted};
use checker::exec::Interpreter;
use checker::ir::Predicate;
use checker::network::{Stepper, Symbolic};
use checker::search::limits::{Counters, StopReason, Watch};
use checker::search::reachability::report::Order;
use checker::search::reachability::search;
use checker::tuning::Tuning;

use crate::checks::{self, interpreted, load};
use crate::subsumption::collectors;

fn check(text: &str, query: &str, adjust: impl FnOnce(&mut Options)) -> Answer {
    let mut options = interpreted();
    adjust(&mut options);
    checks::check(text, query, &options)
}

/// How many states of a model are stored when all are explored.
fn stored(text: &str) -> u64 {
    stored_with(text, |_| {})
}

fn stored_with(text: &str, adjust: impl FnOnce(&mut Options)) -> u64 {
    check(text, "E<> false", adjust).counters.stored
}

/// Ends searches that store more states than any model here has.
struct Few;

impl Watch for Few {
    fn look(&mut self, counters: &Counters) -> Option<StopReason> {
        (counters.stored > 2000).then_some(StopReason::States)
    }
}

/// As [`stored`], with a given abstraction; `None` if the search does not end by itself.
fn stored_by(abstraction: Abstraction, text: &str) -> Option<u64> {
    let model = load(text);
    let network = model.network();
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let bounds = ClockBounds::new(network, &[], abstraction, Tuning::default());
    let mut symbolic = Symbolic::new(Stepper::new(network, &interpreter), bounds);
    let goal = Predicate::Constant(false);
    let report = search::search(&mut symbolic, &mut &goal, Order::BreadthFirst, &mut Few);
    let is_whole = matches!(report.outcome, Ok(checker::search::Outcome::Exhausted));
    is_whole.then_some(report.counters.stored)
}

/// A process that can never do anything, but of which the engine does not know that.
const SPOILER: &str = "int[0, 1] never;
    process Spoiler() { state on; init on; trans on -> on { guard never == 1; assign never = 1 - never; }; }";

/// A heater whose clock `since` grows for ever while it ticks.
const TICKS: &str = "clock since, tick;
    process Heater() { state on { tick <= 1 }, off; init on; trans
        on -> on { guard tick == 1; assign tick = 0; }, on -> off { guard since >= 5; }; }
    system Heater;";

#[test]
fn what_lies_beyond_the_greatest_constant_is_forgotten() {
    assert_eq!(stored_by(Abstraction::Exact, TICKS), None);
    assert_eq!(stored_by(Abstraction::Maximum, TICKS), Some(8));
}

#[test]
fn comparisons_from_below_and_from_above_are_told_apart() {
    // Nothing compares `since` from above, so that no lower bound of it matters.
    assert_eq!(stored(TICKS), 2);
}

#[test]
fn bounds_hold_where_they_matter() {
    let switch = |everywhere: &str| {
        format!(
            "clock x, tick; {SPOILER}
             process Switch() {{ state on {{ tick <= 1 }}, armed {{ x <= 50 }}, off; init on; trans
                on -> on {{ guard tick == 1; assign tick = 0; }}, on -> armed {{ assign x = 0; }}, armed -> off {{ guard x == 50; }},
                {everywhere} off -> on {{ assign tick = 0; }}; }}
             system Switch, Spoiler;"
        )
    };
    assert_eq!(stored(&switch("")), 3);
    let everywhere = "on -> off { guard never == 1 && x == 50; },";
    assert_eq!(stored(&switch(everywhere)), 53);
}

#[test]
fn comparisons_of_two_clocks_keep_zones_finite() {
    let text = "clock x, y, tick;
        process Racer() { state on { tick <= 1 }, done; init on; trans
            on -> on { guard tick == 1; assign tick = 0; }, on -> on { guard x <= 2; assign y = 0; },
            on -> done { guard x - y > 3; }; }
        system Racer;";
    assert_eq!(stored_by(Abstraction::Exact, text), None);
    assert_eq!(stored_by(Abstraction::Differences, text), Some(5));
    assert_eq!(stored(text), 5);
}

/// A worker ticks until it starts the timer's clock, and stops when it shows 300; `further` is what
/// else there is.
fn timer(channel: &str, further: &str) -> String {
    format!(
        "clock x; {channel} go; bool running = false; {SPOILER}
         process Worker() {{
           clock tick;
           state ticking {{ tick <= 1 }}, waiting, stopped;
           init ticking;
           trans ticking -> ticking {{ guard tick == 1; assign tick = 0; }},
                 ticking -> waiting {{ sync go!; assign running = true; }},
                 ticking -> stopped {{ guard running && x == 300; }},
                 waiting -> ticking {{ guard x == 300; assign tick = 0, running = false; }};
         }}
         process Other() {{ state on; init on; trans on -> on {{ sync go?; assign x = 0; }}; }}
         {further}
         system Worker, Other, Spoiler{};",
        if further.is_empty() { "" } else { ", Further" }
    )
}

#[test]
fn clocks_do_not_matter_before_their_flag_is_set() {
    assert_eq!(stored(&timer("chan", "")), 2);
    // Where another process could write the flag, nothing is known of it.
    let further = "process Further() { state on; init on; trans on -> on { guard never == 1; assign running = true; }; }";
    assert_eq!(stored(&timer("chan", further)), 303);
}

#[test]
fn what_all_partners_reset_does_not_matter_before() {
    let further =
        "process Further() { state on; init on; trans on -> on { guard never == 1; sync go?; }; }";
    assert_eq!(stored(&timer("chan", further)), 303);
}

#[test]
fn states_are_left_out_where_another_can_do_as_much() {
    // By inclusion of zones it is more than four times as many: how long ago the last certificate
    // came makes zones that do not contain each other.
    assert_eq!(stored(&collectors(2, "")), 137);
}

#[test]
fn zones_within_others_are_not_stored() {
    for (first, second) in [(1, 3), (3, 1)] {
        // Without inclusion there are two zones of `done`.
        let text = format!(
            "clock x; process P() {{ state on, done; init on; trans
                on -> done {{ guard x >= {first} && x <= 9; }}, on -> done {{ guard x >= {second} && x <= 8; }},
                done -> done {{ guard x > 9; }}, done -> done {{ guard x < 2; }}; }}
             system P;"
        );
        assert_eq!(stored(&text), 2);
    }
}

#[test]
fn variables_that_nothing_reads_again_are_forgotten() {
    let text = "chan pass; int[0, 15] message;
        process Sender() { state idle, busy; init idle; trans
            idle -> busy { select k : int[0, 15]; sync pass!; assign message = k; }, busy -> idle { }; }
        process Receiver() { int[0, 15] value; state waiting, odd; init waiting; trans
            waiting -> odd { sync pass?; assign value = message; }, odd -> waiting { guard value % 2 == 1; },
            odd -> waiting { guard value % 2 == 0; }; }
        system Sender, Receiver;";
    assert_eq!(stored(text), 34);
    assert_eq!(
        stored_with(text, |options| options.reductions.live_variables = false),
        64
    );
}

#[test]
fn states_that_differ_by_exchanged_members_are_stored_once() {
    let text = "typedef scalar[4] pid; pid id; bool free = true;
        process P(const pid me) { clock x; state idle, asked { x <= 2 }, waits, inside; init idle; trans
            idle -> asked { guard free; assign x = 0; },
            asked -> waits { guard x <= 2; assign x = 0, id = me, free = false; },
            waits -> asked { guard free; assign x = 0; },
            waits -> inside { guard x > 2 && !free && id == me; }, inside -> idle { assign free = true; }; }
        system P;";
    assert_eq!(stored(text), 34);
    assert_eq!(
        stored_with(text, |options| options.reductions.symmetry = false),
        308
    );
}

const SENSORS: &str = "broadcast chan tick; int[0, 3] level[4];
    process S(const int[0, 3] me) { state wait, read, tell; urgent read, tell; init wait; trans
        wait -> read { sync tick?; }, read -> tell { assign level[me] = (level[me] + 1) % 2; }, tell -> wait { }; }
    process Bell() { clock x; state on { x <= 5 }; init on; trans on -> on { guard x == 5; sync tick!; assign x = 0; }; }
    system Bell, S;";

#[test]
fn independent_moves_are_taken_in_one_order_where_time_stands_still() {
    for query in ["E<> false", "A[] not deadlock"] {
        let count = |reduced: bool| {
            check(SENSORS, query, |options| {
                options.reductions.partial_order = reduced;
            })
            .counters
            .stored
        };
        assert_eq!((count(true), count(false)), (18, 162), "{query}");
    }
}

#[test]
fn committed_states_without_a_choice_are_not_stored() {
    let chain = |urgency: &str| {
        format!(
            "process P() {{ state a, b, c, d; {urgency} b, c, d; init a; trans a -> b {{ }}, b -> c {{ }}, c -> d {{ }}, d -> a {{ }}; }}
             system P;"
        )
    };
    assert_eq!(stored(&chain("commit")), 1);
    // Nothing else moves, so that urgent locations are left as soon.
    assert_eq!(stored(&chain("urgent")), 4);
}

#[test]
fn deadlocks_are_looked_for_in_the_zones_of_reachability() {
    let query = "A[] not deadlock";
    let text = TICKS.replace(
        "system",
        "process Idle() { state on; init on; trans on -> on { }; } system Idle,",
    );
    assert_eq!(check(&text, query, |_| {}).counters.stored, 2);
    // The trace with the fewest moves is only found in zones that keep deadlocks apart.
    let exact = check(&text, query, |options| {
        options.trace = TraceWanted::Shortest;
    });
    assert_eq!(exact.counters.stored, 8);
}

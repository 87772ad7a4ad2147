//! The bytes that a game says it takes are those that it takes, and the memory limit holds where
//! there are many clocks.
//!
//! An allocator counts what lives. What it takes is compared with the account of the answer, by
//! which the memory limit goes, and with the limit.

#![expect(unsafe_code, reason = "an allocator is not safe to write")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use checker::engine::{Answer, Limits, Options, Verdict};
use checker::game::Nodes;
use checker::zones::federation::block_bytes;

#[path = "common/checks.rs"]
#[allow(dead_code, reason = "this program asks in some of the ways only")]
mod checks;
#[path = "common/games.rs"]
mod games;

use checks::{interpreted, load};

/// Plates that come on a belt, an arm that takes each to a press that is ready when it likes; a
/// plate that waits too long falls. `arrow` says who lets plates come: `->` or `-u->`.
fn cell(count: usize, arrow: &str) -> String {
    format!(
        "const int N = {count};
typedef int[0, N - 1] id_t;
bool arm, press;
process Plate(const id_t id) {{
  clock x;
  state Far {{ x <= 12 * id + 4 }}, Belt, Fallen, Arm, Press {{ x <= 8 }}, Ready, Done;
  init Far;
  trans Far {arrow} Belt {{ guard x >= 12 * id; assign x = 0; }},
        Belt -u-> Fallen {{ guard x >= 12; }},
        Belt -> Arm {{ guard x >= 2 && !arm; assign arm = true, x = 0; }},
        Arm -> Press {{ guard x >= 2 && !press; assign arm = false, press = true, x = 0; }},
        Press -u-> Ready {{ guard x >= 5; assign x = 0; }},
        Ready -> Done {{ guard x >= 1; assign press = false; }};
}}
system Plate;
"
    )
}

/// That no plate falls before all are done.
const ALL_DONE: &str = "control: A<> forall (i : id_t) Plate(i).Done";

/// The allocator of the system, with an account.
struct Counting;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn count(layout: Layout) {
    let bytes = block_bytes(layout.size());
    let live = LIVE.fetch_add(bytes, Ordering::Relaxed) + bytes;
    PEAK.fetch_max(live, Ordering::Relaxed);
}

// SAFETY: everything is passed on to the allocator of the system as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout);
        // SAFETY: the caller's promises are those that are asked for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        LIVE.fetch_sub(block_bytes(layout.size()), Ordering::Relaxed);
        // SAFETY: the caller's promises are those that are asked for.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What lives at most while a query is answered, beside what lived before, and the answer.
fn measured(text: &str, query: &str, options: &Options) -> (usize, Answer) {
    let mut model = load(text);
    let query = model.add_query(query);
    let before = LIVE.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let answer = model.check(&query, options).expect("it is answered");
    (PEAK.load(Ordering::Relaxed) - before, answer)
}

/// Vectors of some length have room that takes no memory before it is written to, and is not in the
/// account: in small games up to so much.
const LEAST_PERCENT: u64 = 70;

/// One test, since all of them would share the counts.
#[test]
fn account_is_what_is_taken() {
    account_is_what_games_take();
    limit_holds_where_there_are_many_clocks();
    bounds_of_clocks_take_no_table_of_all();
}

fn account_is_what_games_take() {
    let trains = (games::trains(4, "-u->"), games::ONE_ON_THE_BRIDGE);
    let cell = (cell(9, "-u->"), ALL_DONE);
    let cases = [
        (&trains, Nodes::Symbolic, false),
        (&trains, Nodes::Automatic, false),
        (&trains, Nodes::Automatic, true),
        (&cell, Nodes::Automatic, false),
        (&cell, Nodes::Symbolic, true),
    ];
    for ((text, query), nodes, strategy) in cases {
        let options = Options {
            nodes,
            strategy,
            ..interpreted()
        };
        let (taken, answer) = measured(text, query, &options);
        assert_eq!(answer.verdict, Verdict::Satisfied);
        let percent = answer.peak_bytes * 100 / taken as u64;
        assert!(
            (LEAST_PERCENT..=100).contains(&percent),
            "{query}, {nodes:?}, with a strategy: {strategy}: {} bytes in the account, {taken} taken",
            answer.peak_bytes
        );
    }
}

/// Jobs with a clock each that pass through committed locations; the environment begins them where
/// `arrow` is `-u->`.
fn jobs(count: usize, arrow: &str) -> String {
    format!(
        "process Job(const int[1,{count}] id) {{
  clock x;
  state Idle {{ x <= 9 }}, Begun, Works {{ x <= 5 }};
  commit Begun;
  init Idle;
  trans Idle {arrow} Begun {{ guard x >= id % 5; assign x = 0; }}, Begun {arrow} Works {{ }},
        Works {arrow} Idle {{ guard x >= 2; assign x = 0; }};
}}
system Job;
"
    )
}

/// What is allocated may come to so much of a limit: vectors that grow have room to spare, which
/// takes no memory before it is written to.
const MOST_PERCENT: u64 = 220;

fn limit_holds_where_there_are_many_clocks() {
    const LIMIT: u64 = 16 << 20;
    let cases = [
        (jobs(200, "->"), "E<> false", false),
        (jobs(200, "->"), "A[] not deadlock", false),
        // What is explored for the strategy of the environment counts, too.
        (jobs(200, "-u->"), "control: A<> false", true),
    ];
    for (text, query, strategy) in cases {
        let options = Options {
            strategy,
            limits: Limits {
                states: Some(1000),
                memory_bytes: Some(LIMIT),
                ..Limits::default()
            },
            ..interpreted()
        };
        let (taken, _) = measured(&text, query, &options);
        let percent = taken as u64 * 100 / LIMIT;
        assert!(
            percent <= MOST_PERCENT,
            "{query}: {percent} % of the limit are taken"
        );
    }
}

fn bounds_of_clocks_take_no_table_of_all() {
    let options = Options {
        limits: Limits {
            states: Some(1),
            ..Limits::default()
        },
        ..interpreted()
    };
    let clocks = 1000;
    let (taken, _) = measured(&jobs(clocks, "->"), "E<> false", &options);
    // A table of the bounds of all clocks in all locations of all processes has three times eight
    // bytes for each pair of clocks.
    let zones = taken / (4 * clocks * clocks);
    assert!(zones <= 6, "as much as {zones} zones is taken");
}

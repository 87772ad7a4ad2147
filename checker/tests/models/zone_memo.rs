//! What is remembered of zones changes nothing: searches come to the same end with whatever limits,
//! by the same steps.

use checker::analysis::{Abstraction, ClockBounds};
use checker::exec::Interpreter;
use checker::ir::{LocationId, Predicate, ProcessId};
use checker::network::{Failure, MemoLimits, Stepper, Symbolic};
use checker::search::Outcome;
use checker::search::limits::Unlimited;
use checker::search::liveness::leads_to::Unanswered;
use checker::search::reachability::goal::{Goal, SharedGoal};
use checker::search::reachability::report::{Manner, Order, Report};
use checker::search::reachability::search;
use checker::tuning::Tuning;
use checker::zones::{Bound, Zone};

use crate::checks::load;

/// Workers who take turns at a machine, some with flags that updates set and guards ask for.
const WORKSHOP: &str = "
const int N = 3;
chan take[N], give[N];
int[0, N] waiting;
bool is_warm;

process Worker(const int[0, N - 1] pid) {
    clock x, y;
    state resting { x <= 7 }, asking { x <= 5 }, working { x <= 4 }, leaving;
    commit leaving;
    init resting;
    trans
        resting -> asking { guard x >= 2 && y >= 1; assign x = 0, waiting = waiting + 1; },
        asking -> working { guard is_warm || x >= 3; sync take[pid]!; assign x = 0, waiting = waiting - 1; },
        asking -> asking { guard x == 5 && waiting > 1; assign x = 0; },
        working -> leaving { guard x >= 1; sync give[pid]!; assign x = 0, y = 0; },
        leaving -> resting { assign is_warm = waiting > 0; };
}

process Machine() {
    clock z;
    state free, busy { z <= 9 };
    init free;
    trans
        free -> busy { select i : int[0, N - 1]; sync take[i]?; assign z = 0; },
        busy -> free { select i : int[0, N - 1]; sync give[i]?; };
}
system Worker, Machine;
";

/// Processes who enter a room one at a time, as M. J. Fischer lets them.
const ROOM: &str = "
const int N = 4;
int[0, N] id;

process P(const int[1, N] pid) {
    clock x;
    state idle, request { x <= 2 }, waiting, critical;
    init idle;
    trans
        idle -> request { guard id == 0; assign x = 0; },
        request -> waiting { guard x <= 2; assign x = 0, id = pid; },
        waiting -> request { guard id == 0; assign x = 0; },
        waiting -> critical { guard x > 2 && id == pid; },
        critical -> idle { assign id = 0; };
}
system P;
";

/// Looks for a state in which processes are in locations, and a clock can be at least so great, if
/// one is named.
#[derive(Clone)]
struct Wanted {
    locations: Vec<(usize, i32)>,
    clock: Option<(usize, i32)>,
}

impl Goal for Wanted {
    fn confirms(
        &mut self,
        _: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        let is_there = |&(process, location): &(usize, i32)| words[process] == location;
        let least = |value| Bound::weak(value).expect("a constant within the range");
        let clock = self.clock;
        let may_be_so_great =
            clock.is_none_or(|(clock, value)| zone.bound(clock, 0) >= least(value));
        Ok(self.locations.iter().all(is_there) && may_be_so_great)
    }

    fn depends_on_zones(&self) -> bool {
        self.clock.is_some()
    }
}

impl SharedGoal for Wanted {
    fn fork(&self) -> Wanted {
        self.clone()
    }

    fn join(&mut self, _: Wanted) {}
}

/// Whether a state was found, how many were explored and stored, and how many moves lead there.
type End = (bool, u64, u64, usize);

fn end(wanted: &Wanted, abstraction: Abstraction, threads: usize, limits: MemoLimits) -> End {
    let model = load(WORKSHOP);
    let network = model.network();
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let bounds = ClockBounds::new(network, &[], abstraction, Tuning::default());
    let symbolic = Symbolic::new(Stepper::new(network, &interpreter), bounds);
    let mut symbolic = symbolic.remembering(limits);
    let manner = Manner {
        order: Order::BreadthFirst,
        threads,
    };
    let mut wanted = wanted.clone();
    end_of(search::search_shared(
        &mut symbolic,
        &mut wanted,
        manner,
        &mut Unlimited,
    ))
}

fn end_of(report: Report) -> End {
    let (explored, stored) = (report.counters.explored, report.counters.stored);
    match report.outcome.expect("nothing fails") {
        Outcome::Found(trace) => (true, explored, stored, trace.moves.len()),
        Outcome::Exhausted => (false, explored, stored, 0),
        Outcome::Stopped(reason) => panic!("there are no limits: {reason:?}"),
    }
}

#[test]
fn limits_of_memory_change_nothing() {
    let wanted = |locations: &[(usize, i32)], clock| Wanted {
        locations: locations.to_vec(),
        clock,
    };
    let goals = [
        // Two at one machine are never there; the clock z is less than 10 at work, and x of the
        // third at most 5 where it asks.
        (false, wanted(&[(0, 2), (1, 2)], None)),
        (false, wanted(&[(3, 1)], Some((7, 10)))),
        (true, wanted(&[(2, 1)], Some((5, 5)))),
        (true, wanted(&[(0, 1), (1, 1), (2, 2)], None)),
    ];
    let limits = [
        // Everything is forgotten with each state, or now and then.
        (0, u32::MAX, 1),
        (1 << 14, u32::MAX, 1),
        // It is given up again and again.
        (usize::MAX, 8, 4),
    ];
    for (is_found, goal) in &goals {
        for abstraction in [Abstraction::LowerUpper, Abstraction::Maximum] {
            for threads in 1..=2 {
                // It is given up with the first pair that is not found.
                let hardly = MemoLimits {
                    bytes: usize::MAX,
                    misses: 0,
                    pause: u32::MAX,
                };
                let expected = end(goal, abstraction, threads, hardly);
                assert_eq!(expected.0, *is_found);
                let limits = limits.map(|(bytes, misses, pause)| MemoLimits {
                    bytes,
                    misses,
                    pause,
                });
                for limits in limits.into_iter().chain([MemoLimits::default()]) {
                    let found = end(goal, abstraction, threads, limits);
                    assert_eq!(found, expected, "{limits:?}");
                }
            }
        }
    }
}

/// The goal and the search share the cache: what one of them forgets, the other does not use.
#[test]
fn limits_of_memory_change_nothing_where_runs_begin_that_do_not_end() {
    let is_in = |location| Predicate::Location(ProcessId(0), LocationId(location));
    let end = |from, to, abstraction, limits| {
        let model = load(ROOM);
        let network = model.network();
        let interpreter = Interpreter::new(&network.functions, &network.constants);
        let bounds = ClockBounds::new(network, &[], abstraction, Tuning::default());
        let symbolic = Symbolic::new(Stepper::new(network, &interpreter), bounds);
        let mut symbolic = symbolic.comparing_as_sets().remembering(limits);
        let (open, keep) = (is_in(from), Predicate::Not(Box::new(is_in(to))));
        let mut goal = Unanswered::new(&symbolic, &open, &keep);
        let order = Order::BreadthFirst;
        end_of(search::search(
            &mut symbolic,
            &mut goal,
            order,
            &mut Unlimited,
        ))
    };
    // Who asks will wait; who waits may do so for ever.
    for (is_found, from, to) in [(false, 1, 2), (true, 2, 3)] {
        for abstraction in [Abstraction::LowerUpper, Abstraction::Maximum] {
            let expected = end(from, to, abstraction, MemoLimits::default());
            assert_eq!(expected.0, is_found);
            for (bytes, misses, pause) in
                [(0, u32::MAX, 1), (1 << 14, u32::MAX, 1), (1 << 20, 8, 4)]
            {
                let limits = MemoLimits {
                    bytes,
                    misses,
                    pause,
                };
                assert_eq!(end(from, to, abstraction, limits), expected, "{limits:?}");
            }
        }
    }
}
